//! Reconstruction filters by importance sampling: a sample's position is drawn from the filter itself, so its weight is 1, or ± a constant where
//! the filter has negative lobes, and it belongs to one pixel. Source: Ernst, Stamminger, Greiner, "Filter Importance Sampling" (2006); filters and their
//! defaults as in pbrt-v4, section 8.8.

mod half_table;
mod lobes;
#[cfg(test)]
mod tests;

use glam::Vec2;

use half_table::HalfTable;
use lobes::{Lobes, mitchell, windowed_sinc};

use crate::scene::{Entity, SceneError, SceneErrorKind, Warnings};

/// Samples that count more than this, with either sign, make an image of noise.
const MOST_WEIGHT: f32 = 16.0;

/// A separable, symmetric filter.
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
        tables: Box<[HalfTable; 2]>,
    },
    /// Mitchell and Netravali's cubic, which sharpens.
    Mitchell {
        /// Half width per axis.
        radius: Vec2,
        /// How much it blurs.
        b: f32,
        /// How much it rings.
        c: f32,
        /// What it is drawn from.
        lobes: Box<Lobes>,
    },
    /// Lanczos' windowed sinc.
    Sinc {
        /// Half width per axis.
        radius: Vec2,
        /// Cycles of the sinc under its window.
        tau: f32,
        /// What it is drawn from.
        lobes: Box<Lobes>,
    },
}

/// Where in a pixel a sample is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Relative to the pixel's centre, in pixels.
    pub offset: Vec2,
    /// What the sample counts, positive or negative; its mean is 1.
    pub weight: f32,
}

impl PixelFilter {
    /// pbrt-v4's default: a Gaussian of radius 1.5 and standard deviation 0.5.
    pub fn gaussian(radius: Vec2, sigma: f32) -> Self {
        let table = |radius: f32| {
            // Beyond 12 σ the density is below 1e-31 of its peak: a table over less keeps its resolution.
            let radius = f64::from(radius.min(12.0 * sigma));
            let sigma = f64::from(sigma);
            // G(x) − G(r) = G(r) (exp((r² − x²) / 2σ²) − 1): in this form a very wide σ loses no digits to cancellation.
            HalfTable::new(radius, |x| ((radius * radius - x * x) / (2.0 * sigma * sigma)).exp_m1())
        };
        let tables = Box::new([table(radius.x), table(radius.y)]);
        Self::Gaussian { radius, sigma, tables }
    }

    /// Mitchell and Netravali's, over ± `radius`.
    fn mitchell(radius: Vec2, [b, c]: [f32; 2]) -> Self {
        let lobes = Lobes::new(radius, |x, radius| mitchell(x, radius, b.into(), c.into()));
        Self::Mitchell { radius, b, c, lobes: Box::new(lobes) }
    }

    /// Lanczos', over ± `radius`.
    fn sinc(radius: Vec2, tau: f32) -> Self {
        let lobes = Lobes::new(radius, |x, radius| windowed_sinc(x, radius, tau.into()));
        Self::Sinc { radius, tau, lobes: Box::new(lobes) }
    }

    /// The filter that a `PixelFilter` directive states; unknown ones are replaced by the default Gaussian, with a warning.
    ///
    /// # Errors
    /// Radii and widths that are not above 0, and a filter that takes away more than it adds.
    pub fn build(entity: &Entity, warnings: &mut Warnings) -> Result<Self, Box<SceneError>> {
        let params = &entity.params;
        let radius = |default: f32| -> Result<Vec2, Box<SceneError>> {
            Ok(Vec2::new(params.positive("xradius", default)?, params.positive("yradius", default)?))
        };
        let filter = match entity.kind.as_str() {
            "box" => Self::Box { radius: radius(0.5)? },
            "triangle" => Self::Triangle { radius: radius(2.0)? },
            "gaussian" | "" => Self::gaussian(radius(1.5)?, params.positive("sigma", 0.5)?),
            "mitchell" => Self::mitchell(radius(2.0)?, [params.float("B", 1.0 / 3.0)?, params.float("C", 1.0 / 3.0)?]),
            "sinc" => Self::sinc(radius(4.0)?, params.positive("tau", 3.0)?),
            other => {
                let message = format!("pixel filter \"{other}\" is not known: a gaussian of radius 1.5 is used");
                warnings.add(Some(entity.span()), message);
                return Ok(Self::gaussian(Vec2::splat(1.5), 0.5));
            }
        };
        params.warn_unused(warnings);
        if let Self::Mitchell { lobes, .. } | Self::Sinc { lobes, .. } = &filter
            && !(1.0..=MOST_WEIGHT).contains(&lobes.weight())
        {
            let message = format!("a {} filter of these parameters takes away nearly all that it adds", entity.kind);
            return Err(SceneError::at(entity.span(), SceneErrorKind::Parameter(message))
                .help("use pbrt's defaults, or a gaussian"));
        }
        Ok(filter)
    }

    /// A position distributed as the filter's absolute value. `u_lobe`, in 0..1, is asked for where the filter has negative lobes.
    #[inline]
    pub fn sample(&self, u: [f32; 2], u_lobe: impl FnOnce() -> f32) -> FilterSample {
        // Half of the unit interval is one side of the symmetric filter; distance grows away from its middle, so the map is
        // monotonic and keeps strata together.
        let v = [2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0];
        let offset = match self {
            Self::Box { radius } => Vec2::from_array(v) * *radius,
            Self::Triangle { radius } => {
                let tent = |v: f32| (1.0 - (1.0 - v.abs()).max(0.0).sqrt()).copysign(v);
                Vec2::new(tent(v[0]), tent(v[1])) * *radius
            }
            Self::Gaussian { tables, .. } => {
                let side = |axis: usize| tables[axis].sample(v[axis].abs()).copysign(v[axis]);
                Vec2::new(side(0), side(1))
            }
            Self::Mitchell { lobes, .. } | Self::Sinc { lobes, .. } => return lobes.sample(v, u_lobe()),
        };
        FilterSample { offset, weight: 1.0 }
    }

    /// Whether samples count ±c instead of 1.
    pub fn is_signed(&self) -> bool {
        matches!(self, Self::Mitchell { lobes, .. } | Self::Sinc { lobes, .. } if lobes.weight() > 1.0)
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
            Self::Mitchell { radius, b, c, .. } => along(d, *radius, |x, r| mitchell(x, r, (*b).into(), (*c).into())),
            Self::Sinc { radius, tau, .. } => along(d, *radius, |x, r| windowed_sinc(x, r, (*tau).into())),
        }
    }

    /// Half width per axis in pixels.
    pub fn radius(&self) -> Vec2 {
        match self {
            Self::Box { radius }
            | Self::Triangle { radius }
            | Self::Gaussian { radius, .. }
            | Self::Mitchell { radius, .. }
            | Self::Sinc { radius, .. } => *radius,
        }
    }
}

fn gaussian(x: f32, sigma: f32) -> f32 {
    (-0.5 * (x / sigma).powi(2)).exp()
}

/// The product of a factor of each axis.
fn along(d: Vec2, radius: Vec2, factor: impl Fn(f64, f64) -> f64) -> f32 {
    (factor(d.x.into(), radius.x.into()) * factor(d.y.into(), radius.y.into())) as f32
}
