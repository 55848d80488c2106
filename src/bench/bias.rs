//! Whether a method's images are as bright as the reference, on average over the image: a method that is not unbiased shows here even where
//! its noise hides it from the slope.

use serde::Serialize;

use super::curve::Point;
use super::estimate::Estimate;
use super::reference::About;

/// The 97.5th percentile of the normal distribution.
const Z95: f64 = 1.959_963_984_540_054;

/// A difference of means, over the reference's mean.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bias {
    /// Mean of the images less that of the reference.
    pub value: f64,
    /// Half of its 95 % confidence interval: of the runs, and of the reference's own mean.
    pub half_width: f64,
}

impl Bias {
    /// Of the renders with most samples.
    pub fn of(point: &Point, reference: &About) -> Self {
        let differences = point.runs.iter().map(|run| run.errors.difference);
        Self::over(differences, reference.mean, reference.own_error_of_mean)
    }

    /// The same of gathered light.
    pub fn of_gathered(point: &Point, reference: &About) -> Self {
        let differences = point.runs.iter().map(|run| run.errors.gathered_difference);
        Self::over(differences, reference.gathered_mean.unwrap_or(f64::NAN), reference.gathered_error_of_mean)
    }

    fn over(differences: impl Iterator<Item = f64>, truth: f64, own_error: Option<f64>) -> Self {
        let Estimate { mean, half_width } = Estimate::of(&differences.map(|off| off / truth).collect::<Vec<_>>());
        Self { value: mean, half_width: half_width.hypot(Z95 * own_error.unwrap_or(0.0) / truth) }
    }

    /// `+0.12 ± 0.30 %`, with a warning where it is not by chance alone.
    pub fn show(&self) -> String {
        if !self.value.is_finite() {
            return "unknown".to_owned();
        }
        if !self.half_width.is_finite() {
            return format!("{:+.2} %", 100.0 * self.value);
        }
        let mark = if self.value.abs() > self.half_width { " (!)" } else { "" };
        format!("{:+.2} ± {:.2} %{mark}", 100.0 * self.value, 100.0 * self.half_width)
    }
}
