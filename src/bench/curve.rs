//! A method's error over samples and time: points of several independent renders each.

use serde::Serialize;

use super::bias::Bias;
use super::error::Errors;
use super::method::Method;
use super::ratio::Ratio;
use super::reference::About;
use super::run::Cost;
use super::slope::Slope;

/// One render.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Its seed.
    pub seed: u32,
    /// The command that makes its image again.
    pub command: String,
    /// What it took.
    pub cost: Cost,
    /// How far it is off.
    pub errors: Errors,
}

impl Run {
    /// RMSE² × minutes of processor time of the whole process: time to unit variance.
    pub fn ttuv(&self) -> f64 {
        self.errors.mse * self.cost.cpu_seconds / 60.0
    }

    /// The same of what was gathered.
    pub fn gathered_ttuv(&self) -> f64 {
        self.errors.gathered_rmse.powi(2) * self.cost.cpu_seconds / 60.0
    }

    /// The same with minutes by the clock.
    pub fn ttuv_by_the_clock(&self) -> f64 {
        self.errors.mse * self.cost.wall_seconds / 60.0
    }
}

/// The renders with as many samples. Bands are geometric means over them with 95 % confidence intervals, by Student's t on the logarithms.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Samples a pixel.
    pub spp: u32,
    /// The RMSE.
    pub rmse: Ratio,
    /// The RMSE of what was gathered.
    pub gathered_rmse: Ratio,
    /// The relative mean square error.
    pub relative_mse: Ratio,
    /// HDR-FLIP.
    pub flip: Ratio,
    /// RMSE² × minutes of processor time.
    pub ttuv: Ratio,
    /// RMSE² × minutes by the clock.
    pub ttuv_by_the_clock: Ratio,
    /// Seconds by the clock.
    pub wall_seconds: Ratio,
    /// Processor seconds.
    pub cpu_seconds: Ratio,
    /// Whether the RMSE is larger than the reference's own: if not, it is not claimed.
    pub is_above_reference: bool,
    /// The renders.
    pub runs: Vec<Run>,
}

impl Point {
    /// Of these renders.
    pub fn of(spp: u32, runs: Vec<Run>, own_rmse: Option<f64>) -> Self {
        let band = |of: fn(&Run) -> f64| Ratio::of(runs.iter().map(of));
        let rmse = band(|run| run.errors.rmse);
        Self {
            spp,
            rmse,
            gathered_rmse: band(|run| run.errors.gathered_rmse),
            relative_mse: band(|run| run.errors.relative_mse),
            flip: band(|run| run.errors.flip),
            ttuv: band(Run::ttuv),
            ttuv_by_the_clock: band(Run::ttuv_by_the_clock),
            wall_seconds: band(|run| run.cost.wall_seconds),
            cpu_seconds: band(|run| run.cost.cpu_seconds),
            is_above_reference: rmse.value > own_rmse.unwrap_or(0.0),
            runs,
        }
    }

    /// The mean of a number of its renders.
    pub fn mean(&self, of: impl Fn(&Run) -> f64) -> f64 {
        self.runs.iter().map(of).sum::<f64>() / self.runs.len() as f64
    }
}

/// All that was measured of a method in a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// The method.
    pub method: Method,
    /// Points, by rising samples; at least one.
    pub points: Vec<Point>,
    /// How fast the error falls.
    pub slope: Slope,
    /// How far its mean is off.
    pub bias: Bias,
    /// The same of gathered light: what is seen of lights themselves adds noise alone. Unknown where images do not tell.
    pub gathered_bias: Bias,
    /// Of the renders with most samples, by seed: RMSE² without the pixels that are worst over all methods, × minutes of processor time.
    pub trimmed_ttuv: Vec<f64>,
}

impl Curve {
    /// Of these points, at least one.
    pub fn of(method: Method, points: Vec<Point>, reference: &About, trimmed: &[f64]) -> Self {
        let last = &points[points.len() - 1];
        let minutes = last.runs.iter().map(|run| run.cost.cpu_seconds / 60.0);
        let trimmed_ttuv = trimmed.iter().zip(minutes).map(|(square, minutes)| square * minutes).collect();
        let slope = Slope::of(&points, last.runs.len());
        let (bias, gathered_bias) = (Bias::of(last, reference), Bias::of_gathered(last, reference));
        Self { method, points, slope, bias, gathered_bias, trimmed_ttuv }
    }

    /// The renders with most samples.
    pub fn last(&self) -> &Point {
        &self.points[self.points.len() - 1]
    }

    /// How many times `other`'s number this method's is, seed by seed, of the renders with most samples.
    pub fn ratio(&self, other: &Self, of: impl Fn(&Run) -> f64) -> Ratio {
        Ratio::of(self.last().runs.iter().zip(&other.last().runs).map(|(a, b)| of(a) / of(b)))
    }

    /// The same of the trimmed TTUV.
    pub fn trimmed_ratio(&self, other: &Self) -> Ratio {
        Ratio::of(self.trimmed_ttuv.iter().zip(&other.trimmed_ttuv).map(|(a, b)| a / b))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A render with this error and these seconds.
    pub fn run(seed: u32, rmse: f64, seconds: f64) -> Run {
        let cost = Cost {
            wall_seconds: seconds,
            cpu_seconds: 2.0 * seconds,
            cpu_seconds_with_helpers: 2.0 * seconds,
            cpu_seconds_rendering: 2.0 * seconds,
            cpu_seconds_learning: 0.0,
            load_seconds: 0.0,
            build_seconds: 0.0,
            render_seconds: seconds,
            learning_seconds: 0.0,
            peak_memory: 1.0,
        };
        let errors = Errors {
            mse: rmse * rmse,
            rmse,
            gathered_rmse: rmse,
            relative_mse: rmse * rmse,
            flip: rmse,
            difference: 0.0,
            gathered_difference: 0.0,
        };
        Run { seed, command: String::new(), cost, errors }
    }

    /// A point over a perfect reference.
    pub fn point(spp: u32, runs: Vec<Run>) -> Point {
        Point::of(spp, runs, Some(0.0))
    }

    #[test]
    fn what_is_below_the_reference_is_not_claimed() {
        let runs = || vec![run(1, 0.1, 1.0), run(2, 0.2, 1.0)];
        let is_claimed = |own| Point::of(1, runs(), own).is_above_reference;
        assert_eq!([Some(0.1), Some(0.3), None].map(is_claimed), [true, false, true]);
        let noisy = Point::of(1, vec![run(1, f64::NAN, 1.0), run(2, 0.2, 1.0)], None);
        assert!(!noisy.is_above_reference && noisy.rmse.value.is_nan());
        let point = point(1, runs());
        assert!((point.rmse.value - 0.1 * 2f64.sqrt()).abs() < 1e-12 && point.rmse.low < 0.1 && point.rmse.high > 0.2);
        assert!((point.runs[0].ttuv() - 0.01 / 30.0).abs() < 1e-12);
    }
}
