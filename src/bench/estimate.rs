//! Means over repetitions, with their confidence intervals.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A mean over repetitions and half the width of its 95 % confidence interval (Student's t).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Half the width; infinite for a single value.
    pub half_width: f64,
}

impl Estimate {
    /// Of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        if values.len() < 2 {
            return Self { mean, half_width: f64::INFINITY };
        }
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let t = StudentsT::new(0.0, 1.0, n - 1.0).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
        Self { mean, half_width: t * (variance / n).sqrt() }
    }

    /// `1.50 ± 0.02`.
    pub fn show(&self, digits: usize) -> String {
        format!("{:.digits$} ± {:.digits$}", self.mean, self.half_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::Stream;

    /// Of 2000 intervals from five values each, 95 % hold the truth; the count is binomial, and one more than 4.9 standard deviations (48) off
    /// would be a false alarm once in a million.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        let mut stream = Stream::from_seed(1);
        let mut normal = || (0..12).map(|_| f64::from(stream.next_f32())).sum::<f64>() - 6.0;
        let held = (0..2000)
            .filter(|_| {
                let values: Vec<f64> = (0..5).map(|_| 3.0 + normal()).collect();
                let estimate = Estimate::of(&values);
                (estimate.mean - 3.0).abs() <= estimate.half_width
            })
            .count();
        assert!(held.abs_diff(1900) <= 48, "{held}");
        assert!(Estimate::of(&[1.0]).half_width.is_infinite());
    }
}
