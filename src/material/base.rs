//! What a coat may lie over: opaque lobes that reflect, as `layered.rs` needs them.

use glam::Vec3;

use super::conductor::Conductor;
use super::diffuse::Diffuse;
use super::fresnel;
use super::local::LocalSample;
use crate::math::Rgb;

/// An opaque surface under a coat. Directions are local and point away from it.
pub trait Base: Copy {
    /// f(wo, wi); zero for a mirror.
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb;

    /// The pdf of [`Base::sample`]; zero for a mirror.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;

    /// A direction to go on in.
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<LocalSample>;

    /// Whether it is a mirror.
    fn is_specular(&self) -> bool;

    /// What it reflects at `cos` (positive) where it is a mirror; black for others.
    fn mirror(&self, cos: f32) -> Rgb;

    /// How much light in all leaves through a coat of index `eta`, over what leaves after one bounce, as far as it has the same
    /// directions: at least 1, and such that the density it scales stays below 1.
    fn repeats(&self, eta: f32) -> f32;

    /// The albedo under a smooth coat of index `eta` and the extinction `thickness` to light at `cos` (positive, outside the coat).
    fn coated_albedo(&self, cos: f32, eta: f32, thickness: f32) -> Rgb;
}

impl Base for Diffuse {
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        self.evaluate(wo, wi)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<LocalSample> {
        self.sample(wo, u)
    }

    #[inline]
    fn is_specular(&self) -> bool {
        false
    }

    #[inline]
    fn mirror(&self, _cos: f32) -> Rgb {
        Rgb::BLACK
    }

    #[inline]
    fn repeats(&self, eta: f32) -> f32 {
        // A rough coat lets more light out at once than the smooth one of the fit: the factor keeps the whole below 1.
        0.85 / (1.0 - fresnel::mean_internal(eta.max(1.0)))
    }

    /// Under diffuse light: F + (1−F)(1−F_i)ρ / (1−F_iρ).
    fn coated_albedo(&self, cos: f32, eta: f32, thickness: f32) -> Rgb {
        let outer = fresnel::dielectric(cos, eta);
        let inner = fresnel::mean_internal(eta.max(1.0));
        let path = 2.0 * thickness;
        self.reflectance.map(|r| {
            let r = r * (-path).exp();
            outer + (1.0 - outer) * (1.0 - inner) * r / (1.0 - inner * r)
        })
    }
}

impl Base for Conductor {
    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        self.evaluate(wo, wi)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<LocalSample> {
        self.sample(wo, u)
    }

    #[inline]
    fn is_specular(&self) -> bool {
        self.distribution.is_smooth()
    }

    #[inline]
    fn mirror(&self, cos: f32) -> Rgb {
        if self.is_specular() { fresnel::conductor(cos, self.eta, self.k) } else { Rgb::BLACK }
    }

    /// Each bounce blurs, and little is reflected back to a metal.
    #[inline]
    fn repeats(&self, _eta: f32) -> f32 {
        1.0
    }

    /// Of a mirror, exactly: F + (1−F)²ρ / (1−Fρ), where ρ counts the way through the coat.
    fn coated_albedo(&self, cos: f32, eta: f32, thickness: f32) -> Rgb {
        let outer = fresnel::dielectric(cos, eta);
        let sin2_inside = (1.0 - cos * cos) / (eta * eta);
        if sin2_inside >= 1.0 {
            return Rgb::splat(outer);
        }
        let cos_inside = (1.0 - sin2_inside).sqrt();
        let passed = (-2.0 * thickness / cos_inside).exp();
        (fresnel::conductor(cos_inside, self.eta, self.k) * passed)
            .map(|r| outer + (1.0 - outer) * (1.0 - outer) * r / (1.0 - outer * r))
    }
}
