//! Reconstruction filters by importance sampling: a sample's position is drawn from the filter itself, so its weight is 1 and
//! it belongs to one pixel. Source: Ernst, Stamminger, Greiner, "Filter Importance Sampling" (2006); filters and their
//! defaults as in pbrt-v4, section 8.8.

use glam::Vec2;

use crate::scene::{Entity, SceneError, Warnings};

/// A separable, symmetric, non-negative filter.
#[derive(Clone, Debug)]
pub enum PixelFilter {
    /// Constant over ± radius (pixels).
    Box {
        /// Half width per axis.
        radius: Vec2,
    },
    /// Falling linearly to 0 at ± radius.
    Triangle {
        /// Half width per axis.
        radius: Vec2,
    },
    /// max(0, G(x) − G(radius)) with a Gaussian G of standard deviation `sigma`.
    Gaussian {
        /// Half width per axis.
        radius: Vec2,
        /// Standard deviation in pixels.
        sigma: f32,
        /// The inverse of its distribution, per axis.
        tables: Box<[HalfGaussian; 2]>,
    },
}

impl PixelFilter {
    /// pbrt-v4's default: a Gaussian of radius 1.5 and standard deviation 0.5.
    pub fn gaussian(radius: Vec2, sigma: f32) -> Self {
        let tables = Box::new([HalfGaussian::new(radius.x, sigma), HalfGaussian::new(radius.y, sigma)]);
        Self::Gaussian { radius, sigma, tables }
    }

    /// The filter that a `PixelFilter` directive states. `mitchell` and `sinc` have negative lobes, which one-signed weights
    /// cannot express: they are replaced by the default Gaussian, with a warning.
    pub fn build(entity: &Entity, warnings: &mut Warnings) -> Result<Self, Box<SceneError>> {
        let params = &entity.params;
        let radius = |default: f32| -> Result<Vec2, Box<SceneError>> {
            Ok(Vec2::new(params.positive("xradius", default)?, params.positive("yradius", default)?))
        };
        let filter = match entity.kind.as_str() {
            "box" => Self::Box { radius: radius(0.5)? },
            "triangle" => Self::Triangle { radius: radius(2.0)? },
            "gaussian" | "" => Self::gaussian(radius(1.5)?, params.positive("sigma", 0.5)?),
            other => {
                let known = matches!(other, "mitchell" | "sinc");
                let what = if known { "is not supported" } else { "is not known" };
                let message = format!("pixel filter \"{other}\" {what}: a gaussian of radius 1.5 is used");
                warnings.add(Some(entity.span()), message);
                return Ok(Self::gaussian(Vec2::splat(1.5), 0.5));
            }
        };
        params.warn_unused(warnings);
        Ok(filter)
    }

    /// A position relative to the pixel's centre, in pixels, distributed as the filter.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Vec2 {
        // Half of the unit interval is one side of the symmetric filter; distance grows away from its middle, so the map is
        // monotonic and keeps strata together.
        let v = [2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0];
        match self {
            Self::Box { radius } => Vec2::from_array(v) * *radius,
            Self::Triangle { radius } => {
                let tent = |v: f32| (1.0 - (1.0 - v.abs()).max(0.0).sqrt()).copysign(v);
                Vec2::new(tent(v[0]), tent(v[1])) * *radius
            }
            Self::Gaussian { tables, .. } => {
                let side = |axis: usize| tables[axis].sample(v[axis].abs()).copysign(v[axis]);
                Vec2::new(side(0), side(1))
            }
        }
    }

    /// The filter's value at `offset` from the pixel's centre, not normalised.
    pub fn evaluate(&self, offset: Vec2) -> f32 {
        let d = offset.abs();
        match self {
            Self::Box { radius } => f32::from(u8::from(d.x <= radius.x && d.y <= radius.y)),
            Self::Triangle { radius } => (radius.x - d.x).max(0.0) * (radius.y - d.y).max(0.0),
            Self::Gaussian { radius, sigma, .. } => {
                (gaussian(d.x, *sigma) - gaussian(radius.x, *sigma)).max(0.0)
                    * (gaussian(d.y, *sigma) - gaussian(radius.y, *sigma)).max(0.0)
            }
        }
    }

    /// Half width per axis in pixels.
    pub fn radius(&self) -> Vec2 {
        match self {
            Self::Box { radius } | Self::Triangle { radius } | Self::Gaussian { radius, .. } => *radius,
        }
    }
}

fn gaussian(x: f32, sigma: f32) -> f32 {
    (-0.5 * (x / sigma).powi(2)).exp()
}

/// Intervals of the tabulated half Gaussian.
const INTERVALS: usize = 512;

/// One side of G(x) − G(radius), as a piecewise linear density that is sampled exactly. With 512 intervals it differs from
/// the true one by less than (radius / 512)² / (8 σ²) of its peak: 4e-6 for pbrt's default.
#[derive(Clone, Debug)]
pub struct HalfGaussian {
    /// Density at the interval ends, normalised to unit area over 0..=radius.
    density: Vec<f32>,
    /// Distribution function there; the last is 1.
    cumulative: Vec<f32>,
    width: f32,
}

impl HalfGaussian {
    fn new(radius: f32, sigma: f32) -> Self {
        // Beyond 12 σ the density is below 1e-31 of its peak: a table over less keeps its resolution.
        let radius = f64::from(radius.min(12.0 * sigma));
        let sigma = f64::from(sigma);
        let width = radius / INTERVALS as f64;
        // G(x) − G(r) = G(r) (exp((r² − x²) / 2σ²) − 1): in this form a very wide σ loses no digits to cancellation.
        let height = |x: f64| ((radius * radius - x * x) / (2.0 * sigma * sigma)).exp_m1().max(0.0);
        let heights: Vec<f64> = (0..=INTERVALS).map(|i| height(i as f64 * width)).collect();
        let mut cumulative = vec![0.0f64];
        for pair in heights.windows(2) {
            cumulative.push(cumulative[cumulative.len() - 1] + 0.5 * (pair[0] + pair[1]) * width);
        }
        let total = cumulative[INTERVALS];
        Self {
            density: heights.iter().map(|h| (h / total) as f32).collect(),
            cumulative: cumulative.iter().map(|c| (c / total) as f32).collect(),
            width: width as f32,
        }
    }

    /// The distance whose distribution function is `u` in 0..=1.
    #[inline]
    fn sample(&self, u: f32) -> f32 {
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
