//! What shines straight into the camera: surfaces and environments that emit, seen along a ray and dimmed by the media before them.
//!
//! A path's camera ray finds that by the way. It may also be asked alone, at the price of one ray, and so much more often than whole paths are
//! traced (splitting: Arvo, Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990, section 4).

use super::flight;
use super::path::Scratch;
use super::walk::camera_regions;
use super::world::World;
use crate::geometry::{Ray, RayHit};
use crate::light::LightId;
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;

/// The radiance of what `ray`, from a camera, meets first, as one unbiased sample. Transmittance is estimated by ratio tracking, which is noisier
/// the denser the media are but less so than whether a path's flight gets through.
pub fn seen(world: &World, mut ray: Ray, random: &SamplePoint, scratch: &mut Scratch) -> Rgb {
    ray.opacity_seed = random.hash(1, Dimension::Opacity);
    scratch.counters.closest_rays += 1;
    scratch.counters.view_rays += 1;
    let hit = world.tracer.closest(&ray);
    let radiance = radiance(world, &ray, hit.as_ref());
    if radiance.is_black() {
        return radiance;
    }
    ray.t_max = hit.map_or(f32::INFINITY, |hit| hit.t);
    let mut regions = Regions::default();
    camera_regions(world, &ray, &mut regions, scratch);
    let stream = || random.stream(1, Dimension::Transmittance);
    radiance * flight::transmittance(world, &ray, &regions, stream, scratch).value
}

/// What is emitted against `ray` where it ends.
fn radiance(world: &World, ray: &Ray, hit: Option<&RayHit>) -> Rgb {
    let lights = &world.lights;
    let Some(hit) = hit else {
        return lights.infinite().iter().map(|&light| lights.background(light, ray.origin, ray.direction)).sum();
    };
    let Some(light) = world.geometry.shapes[hit.shape.0 as usize].light.map(LightId) else { return Rgb::BLACK };
    let point = world.geometry.surface_point(ray, hit);
    lights.emitted(light, point.ng, -ray.direction, point.uv)
}
