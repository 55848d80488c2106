//! Point lights. Source: pbrt-v4 section 12.2. 24 bytes each.

use std::f32::consts::PI;

use glam::Vec3;

use super::{LightEnd, LightSample};
use crate::math::Rgb;

/// A point that radiates alike in all directions.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// Where, in render space.
    pub p: Vec3,
    /// Radiant intensity I (W/sr).
    pub intensity: Rgb,
}

impl PointLight {
    /// The only direction there is.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Option<LightSample> {
        towards(self.p, p, |_| self.intensity)
    }

    /// Φ = 4π I.
    pub fn power(&self) -> Rgb {
        self.intensity * (4.0 * PI)
    }
}

/// The sample of a Dirac light at `light` whose intensity towards the receiver is `intensity(direction from the light)`.
#[inline]
pub(super) fn towards(light: Vec3, p: Vec3, intensity: impl Fn(Vec3) -> Rgb) -> Option<LightSample> {
    let to_light = light - p;
    let square = to_light.length_squared();
    if !(square > 0.0 && square.is_finite()) {
        return None;
    }
    let wi = to_light / square.sqrt();
    let radiance = intensity(-wi) / square;
    if radiance.is_black() || !radiance.is_finite() {
        return None;
    }
    let end = LightEnd::Point { p: light, p_error: Vec3::ZERO, ng: Vec3::ZERO };
    Some(LightSample { wi, end, radiance, pdf: 1.0, is_delta: true })
}
