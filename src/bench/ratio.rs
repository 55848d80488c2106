//! Ratios of paired measurements, and numbers that are above 0 in general: what they vary by is a factor.

use serde::Serialize;

use super::estimate::Estimate;

/// The geometric mean of ratios and its 95 % confidence interval, from Student's t on their logarithms.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Ratio {
    /// The mean.
    pub value: f64,
    /// The interval's lower end; 0 where a single value tells nothing.
    pub low: f64,
    /// The interval's upper end; infinite where a single value tells nothing.
    pub high: f64,
}

impl Ratio {
    /// Of independent ratios; NaN if one of them is not above 0.
    pub fn of(ratios: impl Iterator<Item = f64>) -> Self {
        let Estimate { mean, half_width } = Estimate::of(&ratios.map(f64::ln).collect::<Vec<_>>());
        Self { value: mean.exp(), low: (mean - half_width).exp(), high: (mean + half_width).exp() }
    }

    /// `12.0 (2.80 to 49.0)`.
    pub fn show(&self) -> String {
        match (self.value.is_finite(), self.high.is_finite()) {
            (false, _) => "unknown".to_owned(),
            (true, false) => short(self.value),
            (true, true) => format!("{} ({} to {})", short(self.value), short(self.low), short(self.high)),
        }
    }
}

/// Three digits that matter.
pub fn short(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".to_owned(),
        _ if size.is_nan() => "unknown".to_owned(),
        _ if size.is_infinite() => "∞".to_owned(),
        _ if !(1e-3..1e6).contains(&size) => format!("{value:.2e}"),
        _ => format!("{value:.*}", (2.0 - size.log10().floor()).clamp(0.0, 6.0) as usize),
    }
}

/// A mean and half the width of its interval.
pub fn show(estimate: &Estimate) -> String {
    if !estimate.half_width.is_finite() {
        return short(estimate.mean);
    }
    format!("{} ± {}", short(estimate.mean), short(estimate.half_width))
}
