//! Distant lights: parallel light from one direction. Source: pbrt-v4 section 12.3.

use glam::Vec3;

use super::{LightEnd, LightSample};
use crate::math::Rgb;

/// Light from infinitely far away in one direction.
#[derive(Clone, Copy, Debug)]
pub struct DistantLight {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// What a perpendicular surface receives (W/m²): pbrt's L.
    pub irradiance: Rgb,
}

impl DistantLight {
    /// The only direction there is.
    #[inline]
    pub fn sample(&self) -> Option<LightSample> {
        Some(LightSample { wi: self.wi, end: LightEnd::Infinity, radiance: self.irradiance, pdf: 1.0, is_delta: true })
    }
}
