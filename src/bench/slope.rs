//! How fast the error falls: the slope of log RMSE over log time. An unbiased method's is −1/2 once what it learns is learned; one that is
//! biased flattens out, one that still learns, or whose samples are stratified well, falls faster.
//!
//! Time is that of taking samples: neither building nor what is done between passes with what they taught (most of it after the first few) is in it, since both are
//! over at some time, and what is over at some time makes any error seem to fall faster.

use serde::Serialize;

use super::curve::{Point, Run};
use super::estimate::Estimate;

/// Points with fewer samples a pixel are left out: the first passes learn.
const LEAST_SPP: u32 = 4;
/// Processor time is counted in hundredths of a second. Below this, the clock on the wall is the better one.
const LEAST_CPU: f64 = 0.2;
/// What an unbiased method's slope is, and how far off is of no interest.
pub const EXPECTED: f64 = -0.5;
/// See there.
pub const TOLERANCE: f64 = 0.05;
/// An interval wider than this tells nothing either way.
const WIDEST: f64 = 0.25;

/// A fitted slope.
#[derive(Clone, Debug, Serialize)]
pub struct Slope {
    /// The mean over the runs; `None` where fewer than two points could be used.
    pub value: Option<f64>,
    /// The 95 % confidence interval, by Student's t over the runs.
    pub interval: Option<[f64; 2]>,
    /// The same over samples a pixel in place of time.
    pub over_samples: Option<f64>,
    /// Samples a pixel of the points that were used.
    pub spp: Vec<u32>,
    /// What time was taken: processor time of sampling, or the clock where that is too coarse.
    pub time: &'static str,
    /// In words.
    pub verdict: String,
}

/// The slope of the line of least squares through (x, y); NaN for fewer than two different x.
pub fn fit(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let above = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
    let below = points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>();
    if below > 0.0 { above / below } else { f64::NAN }
}

impl Slope {
    /// Of a curve: a line for each run, since its renders share a seed; points that are not above the reference's own error are left out.
    pub fn of(points: &[Point], runs: usize) -> Self {
        let used: Vec<&Point> =
            points.iter().filter(|point| point.spp >= LEAST_SPP && point.is_above_reference).collect();
        let cpu = |run: &Run| run.cost.cpu_seconds_rendering - run.cost.cpu_seconds_learning;
        let is_fine = used.iter().all(|point| point.runs.iter().all(|run| cpu(run) >= LEAST_CPU));
        let fits = |x: &dyn Fn(&Point, usize) -> f64| -> Vec<f64> {
            (0..runs)
                .map(|run| {
                    let log = |point: &&Point| (x(point, run).ln(), point.runs[run].errors.rmse.ln());
                    fit(&used.iter().map(log).collect::<Vec<_>>())
                })
                .collect()
        };
        let by_time = if used.len() < 2 {
            vec![]
        } else if is_fine {
            fits(&|point, run| cpu(&point.runs[run]))
        } else {
            fits(&|point, run| point.runs[run].cost.render_seconds - point.runs[run].cost.learning_seconds)
        };
        let by_samples = if used.len() < 2 { vec![] } else { fits(&|point, _| f64::from(point.spp)) };
        let Estimate { mean, half_width } = Estimate::of(&by_time);
        let interval = [mean - half_width, mean + half_width];
        Self {
            value: mean.is_finite().then_some(mean),
            interval: interval.iter().all(|end| end.is_finite()).then_some(interval),
            over_samples: Some(Estimate::of(&by_samples).mean).filter(|mean| mean.is_finite()),
            spp: used.iter().map(|point| point.spp).collect(),
            time: if is_fine { "processor time of sampling" } else { "wall-clock time of sampling" },
            verdict: verdict(mean, half_width, Estimate::of(&by_samples).mean),
        }
    }
}

fn verdict(mean: f64, half_width: f64, over_samples: f64) -> String {
    if !mean.is_finite() {
        return format!("unknown: fewer than two points of at least {LEAST_SPP} spp above the reference's own error");
    }
    if !half_width.is_finite() {
        return "unknown: a single run".to_owned();
    }
    let off = mean - EXPECTED;
    if off.abs() <= half_width + TOLERANCE {
        let wide = half_width > WIDEST;
        return if wide { "too uncertain to tell from t^-1/2" } else { "falls as t^-1/2" }.to_owned();
    }
    if off < 0.0 {
        "falls faster than t^-1/2: it learns, or its samples are stratified".to_owned()
    } else {
        let why = if over_samples <= EXPECTED + TOLERANCE {
            "more samples do help as they should, but cost more each: it learns in between"
        } else {
            "biased, or rare bright paths are still missing"
        };
        format!("falls slower than t^-1/2: {why}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::curve::tests::{point, run};

    /// Curves of three runs whose errors fall as spp^`slope` and are off by a few per cent, by `wobble`.
    fn curve(slope: f64, seconds: f64, wobble: f64) -> Slope {
        let points: Vec<Point> = (0..6)
            .map(|level| {
                let spp = 1 << level;
                let error = |seed: u32| {
                    let off = wobble * f64::from((seed * 7 + level * 3) % 5) / 5.0;
                    f64::from(spp).powf(slope) * (1.0 + off)
                };
                point(spp, (0..3).map(|seed| run(seed, error(seed), seconds * f64::from(spp))).collect())
            })
            .collect();
        Slope::of(&points, 3)
    }

    #[test]
    fn a_known_slope_is_found_and_judged() {
        assert!((fit(&[(0.0, 1.0), (1.0, -1.0), (2.0, -3.0)]) + 2.0).abs() < 1e-12);
        for (slope, words) in [(-0.5, "falls as t^-1/2"), (-0.8, "faster"), (-0.3, "slower")] {
            let found = curve(slope, 1.0, 0.05);
            let value = found.value.expect("there are enough points");
            assert!((value - slope).abs() < 0.03, "{found:?}");
            let [low, high] = found.interval.expect("three runs");
            assert!(low < value && value < high && high - low < 0.2, "{found:?}");
            assert!(found.verdict.contains(words), "{found:?}");
            assert_eq!((found.spp.as_slice(), found.over_samples.is_some()), (&[4, 8, 16, 32][..], true));
            assert_eq!(found.time, "processor time of sampling");
        }
        assert_eq!(curve(-0.5, 0.001, 0.05).time, "wall-clock time of sampling");
        assert!(curve(-0.5, 1.0, 3.0).verdict.contains("uncertain"));
    }

    #[test]
    fn too_little_tells_nothing() {
        let two = [point(4, vec![run(1, 1.0, 1.0)]), point(8, vec![run(1, 0.7, 2.0)])];
        assert!(Slope::of(&two[..1], 1).verdict.contains("fewer than two"));
        assert!(Slope::of(&two, 1).verdict.contains("a single run"));
        assert!(Slope::of(&[], 3).value.is_none());
    }
}
