//! Spot lights. Source: pbrt-v4 section 12.2.1. 44 bytes each.

use std::f32::consts::PI;

use glam::Vec3;

use super::LightSample;
use crate::math::Rgb;

/// A point that radiates into a cone with a smooth edge.
#[derive(Clone, Copy, Debug)]
pub struct SpotLight {
    /// Where, in render space.
    pub p: Vec3,
    /// Unit axis of the cone, away from the light.
    pub axis: Vec3,
    /// Radiant intensity on the axis (W/sr).
    pub intensity: Rgb,
    /// Cosine of the angle inside which the intensity is full.
    pub cos_start: f32,
    /// Cosine of the angle beyond which it is zero.
    pub cos_end: f32,
}

impl SpotLight {
    /// The share of the full intensity at an angle of this cosine off the axis: 3t² − 2t³ between the two angles.
    #[inline]
    pub fn falloff(&self, cos: f32) -> f32 {
        falloff(cos, self.cos_start, self.cos_end)
    }

    /// The only direction there is.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Option<LightSample> {
        super::point::towards(self.p, p, |w| self.intensity * self.falloff(w.dot(self.axis)))
    }

    /// Φ: the cubic's mean over the edge is ½.
    pub fn power(&self) -> Rgb {
        self.intensity * cone_power(self.cos_start, self.cos_end)
    }
}

/// See [`SpotLight::falloff`].
#[inline]
pub(super) fn falloff(cos: f32, cos_start: f32, cos_end: f32) -> f32 {
    if cos >= cos_start {
        1.0
    } else if cos <= cos_end {
        0.0
    } else {
        let t = (cos - cos_end) / (cos_start - cos_end);
        t * t * (3.0 - 2.0 * t)
    }
}

/// ∫ falloff dω.
pub(super) fn cone_power(cos_start: f32, cos_end: f32) -> f32 {
    2.0 * PI * ((1.0 - cos_start) + (cos_start - cos_end) * 0.5)
}
