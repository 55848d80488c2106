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
        let differences: Vec<f64> = point.runs.iter().map(|run| run.errors.difference / reference.mean).collect();
        let Estimate { mean, half_width } = Estimate::of(&differences);
        let own = Z95 * reference.own_error_of_mean.unwrap_or(0.0) / reference.mean;
        Self { value: mean, half_width: half_width.hypot(own) }
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
