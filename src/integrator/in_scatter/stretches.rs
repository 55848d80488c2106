//! The stretches of a camera ray between boundaries of media, and the media there.

use glam::Vec3;

use crate::geometry::Ray;
use crate::integrator::path::Scratch;
use crate::integrator::world::World;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::MediumId;
use crate::medium::regions::Regions;

/// Places on a pilot path's camera ray.
const PLACES: usize = 4;

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

/// Notes places along the camera ray of a pilot path where media may scatter it: cache points may come to be there.
pub(super) fn seed(world: &World, ray: &Ray, regions: &Regions, random: &SamplePoint, scratch: &mut Scratch) {
    let t_end = ray.t_max.min(leaves(ray, world.extent));
    let mut places = std::mem::take(&mut scratch.in_scatter.seeds);
    let u = random.draw::<4>(super::FIRST_INDEX, Dimension::InScatter);
    // Stratified, each within its share of the way.
    let mut next = (0..PLACES).map(|k| t_end * (k as f32 + u[k % 4]) / PLACES as f32).peekable();
    each_stretch(world, &Ray { t_max: t_end, ..*ray }, &mut regions.clone(), scratch, |[_, end], media| {
        while let Some(t) = next.next_if(|&t| t < end) {
            if media.iter().any(|&id| world.medium(id).scatters()) {
                places.push(ray.origin + ray.direction * t);
            }
        }
    });
    scratch.in_scatter.seeds = places;
}
