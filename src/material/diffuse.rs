//! Lambert's diffuse reflection. Source: pbrt-v4, section 9.2. Directions are local.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::local::{LocalSample, same_hemisphere};
use crate::math::{Rgb, warp};

/// Reflects equally to all directions of the side that light came from; both sides do.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// The fraction reflected, 0..=1 per channel.
    pub reflectance: Rgb,
}

impl Diffuse {
    /// f = ρ/π.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if same_hemisphere(wo, wi) { self.reflectance * FRAC_1_PI } else { Rgb::BLACK }
    }

    /// cos θ/π.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) { warp::cosine_hemisphere_pdf(wi.z.abs()) } else { 0.0 }
    }

    /// A cosine-distributed direction.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<LocalSample> {
        let mut wi = warp::cosine_hemisphere(u);
        if wo.z < 0.0 {
            wi.z = -wi.z;
        }
        let pdf = warp::cosine_hemisphere_pdf(wi.z.abs());
        Some(LocalSample::rough(wi, self.reflectance * FRAC_1_PI, pdf))
    }
}
