//! A structure that is asked only by rays that come near it: finding that a ray passes all of it takes less than asking Embree.

use glam::Vec3;

use super::structure::Structure;
use crate::geometry::Ray;
use crate::geometry::extent::within;

/// A structure and what surrounds it.
pub(super) struct Bounded {
    pub structure: Structure,
    /// A box around all of it, in render space.
    bounds: (Vec3, Vec3),
    /// The middle of a ball around that.
    middle: Vec3,
    /// The ball's radius, squared.
    radius_squared: f32,
}

impl Bounded {
    pub fn new(structure: Structure, bounds: (Vec3, Vec3)) -> Self {
        let (low, high) = bounds;
        let middle = 0.5 * low + 0.5 * high;
        // From the middle as it was rounded.
        let reach = [low, high].map(|corner| (corner.as_dvec3() - middle.as_dvec3()).abs());
        let radius_squared = (1.0001 * reach[0].max(reach[1]).length_squared()) as f32;
        Self { structure, bounds, middle, radius_squared }
    }

    /// Whether `ray` may come into the box. Most that do not are told by the ball, which takes no division.
    #[inline]
    pub fn may_meet(&self, ray: &Ray) -> bool {
        // Of the difference and the products below, which may be of large numbers: 7e-7 at most.
        const ROUNDING: f32 = 2e-6;
        let to_middle = self.middle - ray.origin;
        let along = to_middle.dot(ray.direction);
        let distance_squared = to_middle.length_squared();
        // Directions that many mirrors and panes have turned are not quite of unit length.
        let unit = ray.direction.length_squared();
        // Also where the box has no end.
        let passes =
            distance_squared * unit - along * along > (self.radius_squared + ROUNDING * distance_squared) * unit;
        !passes && within(ray, self.bounds).is_some()
    }
}
