//! What spheres, cylinders and disks share: where a line crosses a circle or a sphere, and the angle around the axis. Source: pbrt-v4, section 6.2.2.

use std::f64::consts::TAU;

/// A line against the points at `radius` from a centre or an axis.
pub(super) struct RoundHit {
    /// The squared length of its direction, across the axis if there is one; above 0.
    pub a: f64,
    /// Where it is nearest, in units of the direction.
    pub middle: f64,
    /// The squared distance there.
    pub nearest_squared: f64,
    /// The distance of its origin.
    pub origin: f64,
    /// The distance that is looked for.
    pub radius: f64,
}

impl RoundHit {
    /// Both crossings in order; `None` where there are none.
    #[inline]
    pub fn crossings(&self) -> Option<[f64; 2]> {
        // Around the nearest point of the line the quadratic has no linear term, hence no cancellation.
        let discriminant = self.radius * self.radius - self.nearest_squared;
        if discriminant < 0.0 || discriminant.is_nan() {
            return None;
        }
        let half = (discriminant / self.a).sqrt();
        // The product of the roots gives the one that would cancel: t0 t1 = (|o|² − r²)/a.
        let c = (self.origin - self.radius) * (self.origin + self.radius) / self.a;
        let far = self.middle + half.copysign(self.middle);
        let near = if far == 0.0 { 0.0 } else { c / far };
        Some(if near < far { [near, far] } else { [far, near] })
    }
}

/// The angle of (x, y) about the axis as a share of `phi_max` (radians, up to 2π), or `None` beyond it.
#[inline]
pub(super) fn azimuth(x: f64, y: f64, phi_max: f32) -> Option<f32> {
    let mut phi = y.atan2(x);
    if phi < 0.0 {
        phi += TAU;
    }
    let most = f64::from(phi_max);
    if phi_max < TAU as f32 && phi > most {
        return None;
    }
    Some((phi / most).clamp(0.0, 1.0) as f32)
}
