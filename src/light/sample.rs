//! A direction towards a light, and the shadow ray that asks whether anything is in the way.
//!
//! The ray starts off the receiver's surface and must end before the light's own. Both surfaces are known up to rounding, and either
//! error may be the larger one, so both ends are moved off their surfaces by their own bounds (pbrt-v4, sections 6.8.6 and 6.8.7).

use glam::Vec3;

use crate::math::Rgb;
use crate::math::robust::{gamma, offset_ray_origin};
use crate::medium::MediumId;

/// A direction towards a light from a given point, and what arrives along it if nothing is in the way.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light, render space.
    pub wi: Vec3,
    /// Where a shadow ray ends.
    pub end: LightEnd,
    /// Radiance that arrives, of media an estimate (for Dirac lights: with the inverse square and `pdf` = 1).
    pub radiance: Rgb,
    /// Solid-angle pdf of the direction given the light; 1 for Dirac lights. Divide by it in any case.
    pub pdf: f32,
    /// No BSDF sample can meet it, so its MIS weight is 1: a Dirac light, or an area light that no ray can meet.
    pub is_delta: bool,
}

/// The far end of a shadow ray.
#[derive(Clone, Copy, Debug)]
pub enum LightEnd {
    /// There is none.
    Infinity,
    /// A point of a surface, or of none.
    Point {
        /// Where, in render space.
        p: Vec3,
        /// Bound of the rounding error in `p`, per axis.
        p_error: Vec3,
        /// Unit normal of the surface, of either sign; zero where there is no surface.
        ng: Vec3,
    },
    /// Wherever the direction meets a sphere.
    Sphere {
        /// Its centre.
        centre: Vec3,
        /// Its radius.
        radius: f32,
    },
    /// The first surface, wherever that is: the medium's emission is gathered up to there.
    Volume(MediumId),
}

impl LightSample {
    /// Unit direction and length of the shadow ray from `origin`, which has been moved off the receiver's surface. The length is 0
    /// where that move already reaches the light.
    #[inline]
    pub fn segment(&self, origin: Vec3) -> (Vec3, f32) {
        match self.end {
            LightEnd::Infinity | LightEnd::Volume(_) => (self.wi, f32::INFINITY),
            LightEnd::Point { p, p_error, ng } => {
                let to_light = offset_ray_origin(p, p_error, ng, origin - p) - origin;
                let distance = to_light.length();
                if !(to_light.dot(self.wi) > 0.0 && distance.is_finite()) {
                    return (self.wi, 0.0);
                }
                let direction = to_light / distance;
                let cos = if ng == Vec3::ZERO { 1.0 } else { ng.dot(direction).abs() };
                (direction, shortened(distance, origin, p, cos))
            }
            LightEnd::Sphere { centre, radius } => (self.wi, before_sphere(origin, self.wi, centre, radius)),
        }
    }
}

/// The distance along `wi` at which a ray from `origin` is surely still outside the sphere.
fn before_sphere(origin: Vec3, wi: Vec3, centre: Vec3, radius: f32) -> f32 {
    let to_centre = centre - origin;
    let square = to_centre.length_squared();
    let along = to_centre.dot(wi);
    // Near the rim the square root magnifies rounding: any distance within the error is taken as the nearest one.
    let half_chord = radius * radius - (to_centre - along * wi).length_squared();
    let error = gamma(16) * (square + radius * (origin.length() + centre.length()));
    let nearest = along - half_chord.max(0.0).sqrt();
    let safest = along - (half_chord + error).max(0.0).sqrt();
    let safest = safest.max(shortened(square.sqrt() - radius, origin, centre, 1.0));
    safest.min(shortened(nearest, origin, centre, 1.0)).max(0.0)
}

/// `distance` less what the roundings of a hit's distance can amount to where the ray meets the light at `cos` to its normal. At most
/// a hundredth is taken off.
#[inline]
fn shortened(distance: f32, origin: Vec3, light: Vec3, cos: f32) -> f32 {
    let error = gamma(64) * (origin.abs().max_element() + light.abs().max_element() + distance) / cos.max(1e-3);
    distance - error.min(0.01 * distance)
}
