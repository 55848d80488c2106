//! Media that are the same everywhere.

use glam::Vec3;

use super::{MediumPoint, resolution};

/// A homogeneous medium.
#[derive(Debug)]
pub struct HomogeneousMedium {
    /// Its coefficients.
    pub point: MediumPoint,
    /// Mean cosine of the Henyey-Greenstein phase function.
    pub g: f32,
}

impl HomogeneousMedium {
    /// The largest channel of μ_t along a stretch of a ray that begins at `p` of render space. What only absorbs has no vertices that must be kept
    /// apart, and stays as it is.
    #[inline]
    pub fn majorant(&self, p: Vec3) -> f32 {
        let MediumPoint { absorption, scattering, .. } = self.point;
        let largest = (absorption + scattering).max_channel();
        if scattering.is_black() { largest } else { resolution::limit(largest, p) }
    }

    /// Its coefficients along a stretch of a ray that begins at `p` of render space.
    #[inline]
    pub fn along(&self, p: Vec3) -> MediumPoint {
        if self.point.scattering.is_black() { self.point } else { self.point.limited(p) }
    }
}
