//! Places on the camera rays of pilot paths, where cache points may come to be that serve in-scatter sampling alone. **Ours**: half of them are spread evenly,
//! half by equi-angular sampling ([`super::equi_angular`]), so points are denser where lights are close, fires among them: there scattered light changes
//! over the shortest way.

use super::stretches::{each_stretch, leaves};
use crate::geometry::Ray;
use crate::integrator::path::Scratch;
use crate::integrator::walk::Walk;
use crate::integrator::world::World;
use crate::math::sampler::{Dimension, SamplePoint};

/// Places on a ray that are spread evenly, and as many near lights.
const PLACES: usize = 2;

/// Notes places along the camera ray of a pilot path where media may scatter it.
pub(super) fn seed(world: &World, start: &Walk, random: &SamplePoint, scratch: &mut Scratch) {
    let Walk { ref ray, index: number, ref path, .. } = *start;
    let t_end = ray.t_max.min(leaves(ray, world.extent));
    let u = random.draw::<{ 2 * PLACES }>(super::vertex_index(number, 0), Dimension::InScatter);
    // Stratified, each within its share.
    let shares: [f32; 2 * PLACES] = std::array::from_fn(|k| ((k % PLACES) as f32 + u[k]) / PLACES as f32);
    let (even, near) = shares.split_at(PLACES);
    let mut distances: Vec<f32> = even.iter().map(|share| t_end * share).collect();
    if let Some(lights) = &world.equi_angular {
        let density = &mut scratch.in_scatter.along[number as usize - 1].density;
        density.aim_at_lights(&Ray { t_max: t_end, ..*ray }, lights, world.extent);
        distances.extend(near.iter().filter_map(|&share| density.sample(f64::from(share))).map(|(t, _)| t));
    }
    distances.sort_by(f32::total_cmp);

    let mut places = std::mem::take(&mut scratch.in_scatter.seeds);
    let mut next = distances.into_iter().peekable();
    each_stretch(world, &Ray { t_max: t_end, ..*ray }, &mut path.regions.clone(), scratch, |[_, end], media| {
        while let Some(t) = next.next_if(|&t| t < end) {
            if media.iter().any(|&id| world.medium(id).scatters()) {
                places.push(ray.origin + ray.direction * t);
            }
        }
    });
    scratch.in_scatter.seeds = places;
}
