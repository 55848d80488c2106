//! Where in a scene something is out of the way: in the corner of its box that is furthest behind the camera, and tiny. Within the box, so that the
//! scene's extent, which bounds and powers of lights depend on, stays as it is.

use glam::{DVec3, Vec2};

use crate::render::Job;

/// The size, as a part of the box's diagonal or of the place's distance from the origin, whichever is larger: single precision resolves 10⁻⁷ of it.
const SIZE: f64 = 1e-5;

/// A tiny cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its lowest corner in world space.
    pub corner: DVec3,
    /// The length of its edges.
    pub size: f64,
}

impl Place {
    /// In that scene; `None` if it has no extent.
    pub fn of(job: &Job) -> Option<Self> {
        let (low, high) = job.world.extent;
        let [width, height] = job.film.resolution.map(|n| n as f32);
        let forward = job.camera.ray(0.5 * Vec2::new(width, height), [0.5; 2], 0.0).direction.as_dvec3();
        Self::within(job.origin, [low.as_dvec3(), high.as_dvec3()], forward)
    }

    /// In the box from `low` to `high`, which is relative to the camera at `origin` that looks `forward`.
    fn within(origin: DVec3, [low, high]: [DVec3; 2], forward: DVec3) -> Option<Self> {
        let diagonal = (high - low).length();
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            return None;
        }
        let behind = |p: &DVec3| p.dot(forward) / p.length().max(f64::MIN_POSITIVE);
        let pick = |corner: u32, k: usize| if corner & (1 << k) == 0 { low[k] } else { high[k] };
        let corners = (0..8).map(|corner| DVec3::new(pick(corner, 0), pick(corner, 1), pick(corner, 2)));
        let corner = corners.min_by(|a, b| behind(a).total_cmp(&behind(b)))?;
        let size = SIZE * diagonal.max((origin + corner).length());
        // All of it within the box, a bit off its sides: what lies in them would share it.
        let inward = DVec3::select(corner.cmpgt(low), DVec3::splat(-2.0 * size), DVec3::splat(size));
        Some(Self { corner: origin + corner + inward, size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_behind_the_camera_and_within_the_box() {
        let origin = DVec3::new(10.0, 0.0, 0.0);
        let [low, high] = [DVec3::new(-1.0, -2.0, -1.0), DVec3::new(1.0, 1.0, 5.0)];
        let place = Place::within(origin, [low, high], DVec3::new(0.1, 0.2, 1.0).normalize()).expect("a box");
        let far = place.corner + place.size;
        assert!(place.corner.cmpgt(origin + low).all() && far.cmplt(origin + high).all(), "{place:?}");
        assert!(place.corner.distance(origin + low) < 1e-3 && place.size > 0.0, "{place:?}");
        assert_eq!(Place::within(origin, [low, low], DVec3::Z), None);
    }
}
