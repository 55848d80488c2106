//! Filters with negative lobes, sampled by their absolute value.
//!
//! Source: pbrt-v4, section 8.8.5 (a sample counts with the filter's sign, times the area of its absolute value over its own). Which sign comes is drawn in
//! a dimension of its own: so the share of negative samples of a pixel is as even as one well-distributed number makes it. What unevenness is left is
//! taken out by the film (`signed.rs`).

use glam::Vec2;

use super::FilterSample;
use super::half_table::HalfTable;

/// f(x) g(y), f and g symmetric and of both signs.
#[derive(Clone, Debug)]
pub struct Lobes {
    axes: [Axis; 2],
    /// The probabilities of x alone, y alone, and both being where their factor is negative.
    negative: [f32; 3],
    /// The area of the absolute value over the area.
    weight: f32,
}

/// A factor, in its two signs.
#[derive(Clone, Debug)]
struct Axis {
    positive: HalfTable,
    negative: HalfTable,
}

impl Axis {
    fn new(radius: f32, height: &dyn Fn(f64) -> f64) -> Self {
        let radius = f64::from(radius);
        Self { positive: HalfTable::new(radius, height), negative: HalfTable::new(radius, |x| -height(x)) }
    }

    /// The share of its absolute area that is negative.
    fn share(&self) -> f64 {
        self.negative.area() / (self.negative.area() + self.positive.area())
    }

    fn sample(&self, v: f32, is_negative: bool) -> f32 {
        let side = if is_negative { &self.negative } else { &self.positive };
        side.sample(v.abs()).copysign(v)
    }
}

impl Lobes {
    /// The filter whose factor along an axis of half width `radius` is `height(x, radius)`.
    pub fn new(radius: Vec2, height: impl Fn(f64, f64) -> f64) -> Self {
        let axes = radius.to_array().map(|radius| Axis::new(radius, &|x| height(x, f64::from(radius))));
        let [x, y] = [axes[0].share(), axes[1].share()];
        let negative = [x * (1.0 - y), y * (1.0 - x), x * y].map(|p| p as f32);
        Self { axes, negative, weight: (1.0 / ((1.0 - 2.0 * x) * (1.0 - 2.0 * y))) as f32 }
    }

    /// What a sample counts, but for its sign; not above 0 where the filter has no area.
    pub fn weight(&self) -> f32 {
        self.weight
    }

    /// A position for `v` in −1..1 each, in the lobe that `u` in 0..1 says.
    #[inline]
    pub fn sample(&self, v: [f32; 2], u: f32) -> FilterSample {
        let [x, y, both] = self.negative;
        let (is_negative, weight) = if u < x {
            ([true, false], -self.weight)
        } else if u < x + y {
            ([false, true], -self.weight)
        } else {
            ([u < x + y + both; 2], self.weight)
        };
        let [x, y] = [0, 1].map(|axis: usize| self.axes[axis].sample(v[axis], is_negative[axis]));
        FilterSample { offset: Vec2::new(x, y), weight }
    }
}

/// Mitchell and Netravali's cubic over ±`radius`. Source: their "Reconstruction Filters in Computer Graphics" (1988), eq. 8, with pbrt's stretching of its
/// support of ±2.
pub(super) fn mitchell(x: f64, radius: f64, b: f64, c: f64) -> f64 {
    let x = (2.0 * x / radius).abs();
    let cubic = |k3: f64, k2: f64, k1: f64, k0: f64| ((k3 * x + k2) * x + k1) * x + k0;
    if x < 1.0 {
        cubic(12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b) / 6.0
    } else if x < 2.0 {
        cubic(-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c) / 6.0
    } else {
        0.0
    }
}

/// Lanczos' sinc over ±`radius` with a window of `tau` cycles. Source: pbrt-v4, section 8.8.4.
pub(super) fn windowed_sinc(x: f64, radius: f64, tau: f64) -> f64 {
    let sinc =
        |x: f64| if x.abs() < 1e-5 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    if x.abs() >= radius { 0.0 } else { sinc(x) * sinc(x / tau) }
}
