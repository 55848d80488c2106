//! Metals: mirror or microfacet reflection with the Fresnel term of a complex index. Source: pbrt-v4, sections 9.3.6, 9.6;
//! single scattering (light that meets a second microfacet is lost, as in pbrt-v4).

use glam::Vec3;

use super::fresnel;
use super::local::{LocalSample, same_hemisphere};
use super::microfacet::TrowbridgeReitz;
use crate::math::Rgb;

/// Reflection by a metal; both sides reflect.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    /// Roughness.
    pub distribution: TrowbridgeReitz,
    /// η.
    pub eta: Rgb,
    /// k.
    pub k: Rgb,
}

impl Conductor {
    /// D F G / (4 cos θ_o cos θ_i); zero for a mirror.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if self.distribution.is_smooth() || !same_hemisphere(wo, wi) {
            return Rgb::BLACK;
        }
        let Some(wm) = half_vector(wo, wi) else { return Rgb::BLACK };
        self.evaluate_at(wo, wi, wm)
    }

    #[inline]
    fn evaluate_at(&self, wo: Vec3, wi: Vec3, wm: Vec3) -> Rgb {
        let fresnel = fresnel::conductor(wo.dot(wm).abs(), self.eta, self.k);
        fresnel * (self.distribution.d(wm) * self.distribution.g(wo, wi) / (4.0 * (wo.z * wi.z).abs()))
    }

    /// The pdf of the visible normal through the Jacobian of reflection.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.distribution.is_smooth() || !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let Some(wm) = half_vector(wo, wi) else { return 0.0 };
        self.distribution.visible(wo, wm) / (4.0 * wo.dot(wm).abs())
    }

    /// Reflects about the normal, or about a visible microfacet's.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<LocalSample> {
        if wo.z == 0.0 {
            return None;
        }
        if self.distribution.is_smooth() {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            let f = fresnel::conductor(wi.z.abs(), self.eta, self.k) / wi.z.abs();
            return Some(LocalSample::specular(wi, f, 1.0));
        }
        let wm = self.distribution.sample_visible(wo, u);
        let wi = fresnel::reflect(wo, wm);
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let pdf = self.distribution.visible(wo, wm) / (4.0 * wo.dot(wm).abs());
        Some(LocalSample::rough(wi, self.evaluate_at(wo, wi, wm), pdf))
    }
}

/// The upper half vector, if the directions are not opposite.
#[inline]
fn half_vector(wo: Vec3, wi: Vec3) -> Option<Vec3> {
    let wm = (wo + wi).try_normalize()?;
    Some(if wm.z < 0.0 { -wm } else { wm })
}
