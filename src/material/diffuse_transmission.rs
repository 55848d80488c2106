//! Lambertian reflection and transmission: paper, cloth, leaves. Source: pbrt-v4's `DiffuseTransmissionBxDF`. Directions are local.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::local::{LocalSample, same_hemisphere};
use crate::math::{Rgb, warp};

/// Scatters equally to all directions of either side, each side with a colour of its own; from both sides alike.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    /// The fraction that goes back, 0..=1 per channel.
    pub reflectance: Rgb,
    /// The fraction that passes, 0..=1 per channel.
    pub transmittance: Rgb,
}

impl DiffuseTransmission {
    /// f = ρ/π on wo's side, τ/π on the other.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wi.z == 0.0 {
            return Rgb::BLACK;
        }
        if same_hemisphere(wo, wi) { self.reflectance * FRAC_1_PI } else { self.transmittance * FRAC_1_PI }
    }

    /// The share of samples that are reflected: by the brightest channels.
    #[inline]
    fn reflected_share(&self) -> f32 {
        let (r, t) = (self.reflectance.max_channel(), self.transmittance.max_channel());
        if r + t > 0.0 { r / (r + t) } else { 1.0 }
    }

    /// cos θ/π, times the share of wi's side.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let reflected = self.reflected_share();
        let share = if same_hemisphere(wo, wi) { reflected } else { 1.0 - reflected };
        share * warp::cosine_hemisphere_pdf(wi.z.abs())
    }

    /// Chooses the side by `uc`, then a cosine-distributed direction.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: [f32; 2]) -> Option<LocalSample> {
        let reflected = self.reflected_share();
        let is_reflection = uc < reflected;
        let mut wi = warp::cosine_hemisphere(u);
        if (wo.z < 0.0) == is_reflection {
            wi.z = -wi.z;
        }
        let pdf = warp::cosine_hemisphere_pdf(wi.z.abs());
        Some(if is_reflection {
            LocalSample::rough(wi, self.reflectance * FRAC_1_PI, pdf * reflected)
        } else {
            LocalSample::rough(wi, self.transmittance * FRAC_1_PI, pdf * (1.0 - reflected)).transmitted(1.0)
        })
    }
}
