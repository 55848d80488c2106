//! One side of a symmetric density, as a table that is sampled exactly.

/// Intervals of the table.
const INTERVALS: usize = 512;

/// A piecewise linear density over 0..=radius.
#[derive(Clone, Debug)]
pub struct HalfTable {
    /// Density at the interval ends, normalised to unit area over 0..=radius.
    density: Vec<f32>,
    /// Distribution function there; the last is 1.
    cumulative: Vec<f32>,
    width: f32,
    area: f64,
}

impl HalfTable {
    /// That of max(0, `height`), tabulated over 0..=`radius`. With 512 intervals it differs from the true one by less than (radius / 512)² / 8 times
    /// its largest second derivative.
    pub fn new(radius: f64, height: impl Fn(f64) -> f64) -> Self {
        let width = radius / INTERVALS as f64;
        let heights: Vec<f64> = (0..=INTERVALS).map(|i| height(i as f64 * width).max(0.0)).collect();
        let mut cumulative = vec![0.0f64];
        for pair in heights.windows(2) {
            cumulative.push(cumulative[cumulative.len() - 1] + 0.5 * (pair[0] + pair[1]) * width);
        }
        let total = cumulative[INTERVALS];
        let whole = if total > 0.0 { total } else { 1.0 };
        Self {
            density: heights.iter().map(|h| (h / whole) as f32).collect(),
            cumulative: cumulative.iter().map(|c| (c / whole) as f32).collect(),
            width: width as f32,
            area: total,
        }
    }

    /// The area under the heights.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The distance whose distribution function is `u` in 0..=1.
    #[inline]
    pub fn sample(&self, u: f32) -> f32 {
        let i = self.cumulative[1..INTERVALS].partition_point(|&c| c <= u);
        let (a, b) = (self.density[i], self.density[i + 1]);
        let area = (u - self.cumulative[i]).max(0.0);
        // The root of (b − a) / (2 w) · x² + a · x = area, in the form that stays exact where a = b or a = 0.
        let slope = (b - a) / self.width;
        let root = (a * a + 2.0 * slope * area).max(0.0).sqrt();
        let x = if a + root > 0.0 { 2.0 * area / (a + root) } else { 0.0 };
        i as f32 * self.width + x.min(self.width)
    }
}
