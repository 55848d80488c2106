//! The stretches of a camera ray between boundaries of media, and the media there.

use glam::Vec3;

use crate::geometry::Ray;
use crate::integrator::path::Scratch;
use crate::integrator::world::World;
use crate::medium::MediumId;
use crate::medium::regions::Regions;

/// Visits the stretches between boundaries of a ray that starts in `regions`, with the media there, in order.
pub(super) fn each_stretch(
    world: &World,
    ray: &Ray,
    regions: &mut Regions,
    scratch: &mut Scratch,
    mut visit: impl FnMut([f32; 2], &[MediumId]),
) {
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(ray, &mut crossings);
    scratch.counters.boundary_rays += 1;
    let mut t_start = 0.0;
    for i in 0..=crossings.len() {
        let end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        if end > t_start {
            visit([t_start, end], regions.media());
        }
        if let Some(crossing) = crossings.get(i) {
            // What does not fit is counted by whoever follows the ray.
            let _ = world.cross(regions, crossing.shape, crossing.instance, crossing.entering);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
}

/// Where `ray` enters a box and leaves it for good; both 0 where it never meets it.
pub(super) fn enters_and_leaves(ray: &Ray, (low, high): (Vec3, Vec3)) -> (f32, f32) {
    let (a, b) = ((low - ray.origin) / ray.direction, (high - ray.origin) / ray.direction);
    let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    if leave > enter { (enter, leave) } else { (0.0, 0.0) }
}

/// Where `ray` leaves a box for good; 0 where it never meets it.
pub(super) fn leaves(ray: &Ray, extent: (Vec3, Vec3)) -> f32 {
    enters_and_leaves(ray, extent).1
}
