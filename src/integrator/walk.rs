//! A path on its way: the media that it begins in, and the rules that hold wherever it is, multiple importance sampling of the light that it meets by itself
//! and Russian roulette.

use glam::Vec3;

use super::flight::{PathState, PathWeight};
use super::in_scatter::alternatives::OwnVertex;
use super::path::{CameraRay, Scratch};
use super::world::World;
use crate::geometry::differentials::RayDifferentials;
use crate::geometry::{Ray, SurfacePoint};
use crate::light::LightId;
use crate::math::Rgb;
use crate::medium::regions::Regions;
use crate::system::fault::{self, Fault};

/// Where a path goes next, and what it carries there.
pub(super) struct Walk {
    /// Its next ray.
    pub ray: Ray,
    /// Weight and media.
    pub path: PathState,
    /// Bounces so far.
    pub depth: u32,
    /// The last vertex, if lights were sampled from it.
    pub sampled_from: Option<Vec3>,
    /// What the path's weight counts in Russian roulette: undoes the radiance scaling of refraction, and the weight that it began with.
    pub roulette_scale: f32,
    /// The number of the next ray: 1 for a camera's alone.
    pub index: u32,
    /// How it would change with the pixel, where textures have levels of detail.
    pub differentials: Option<RayDifferentials>,
    /// The first vertex in a medium, where in-scatter sampling may have come to as well.
    pub mixed: Option<OwnVertex>,
}

impl Walk {
    /// Of a path from a camera; in no medium yet.
    #[inline]
    pub fn new((ray, differentials): CameraRay) -> Self {
        let path = PathState { weight: PathWeight::START, regions: Regions::default(), hero: None, links: None };
        Self { ray, path, depth: 0, sampled_from: None, roulette_scale: 1.0, index: 1, differentials, mixed: None }
    }

    /// The weight of light that the path met by itself: shared with next-event estimation where the last vertex sampled lights; 0 where
    /// that light does not light the last vertex, whatever it is made of. `pdf` is that of having sampled its point from there.
    #[inline]
    pub fn mis_weight(&self, world: &World, light: LightId, scratch: &Scratch, pdf: impl FnOnce(Vec3) -> f32) -> Rgb {
        let Self { path, sampled_from, .. } = self;
        if path.links.is_some_and(|links| !world.lights.is_linked(links, light)) {
            Rgb::BLACK
        } else if let Some(from) = *sampled_from {
            let pmf = world.light_choice.pmf(&world.lights, light, &scratch.lights);
            path.weight.with_light(if fault::is(Fault::CertainLight) { 1.0 } else { pmf } * pdf(from))
        } else {
            path.weight.alone()
        }
    }

    /// From here on the path is inside the surface at `point`, or outside of it.
    pub fn cross(&mut self, world: &World, point: &SurfacePoint, is_inwards: bool, scratch: &mut Scratch) {
        let fits = world.cross(&mut self.path.regions, point.shape, point.instance, is_inwards);
        scratch.counters.region_overflows += u64::from(!fits);
    }

    /// Unbiased Russian roulette (Arvo & Kirk 1990): from the second bounce on, a path that would count less than 1 goes on with that
    /// probability, and then counts as 1.
    #[inline]
    pub fn survives(&mut self, u: f32) -> bool {
        let weight = &mut self.path.weight;
        let continuation = (weight.throughput * self.roulette_scale).max_channel() / weight.unidirectional.mean();
        if continuation >= 1.0 || self.depth <= 1 {
            return true;
        }
        if u >= continuation {
            return false;
        }
        weight.throughput *= if fault::is(Fault::FreeRoulette) { 1.0 } else { 1.0 / continuation };
        true
    }
}

/// The regions where a camera ray starts: those of the camera's first position, taken along to where a moving camera or a
/// lens has put the ray. `regions` are none yet.
#[inline]
pub(super) fn camera_regions(world: &World, ray: &Ray, regions: &mut Regions, scratch: &mut Scratch) {
    debug_assert!(regions.are_none(), "the path is nowhere yet");
    if !world.camera_regions.are_none() {
        regions.copy_from(&world.camera_regions);
    }
    if ray.origin != Vec3::ZERO {
        take_along(world, ray, regions, scratch);
    }
}

/// Takes the regions of the camera's first position along to where `ray` starts. Only boundaries count on that way, not surfaces that separate media, and
/// boundaries count as they stand at the ray's time.
#[inline(never)]
fn take_along(world: &World, ray: &Ray, regions: &mut Regions, scratch: &mut Scratch) {
    let distance = ray.origin.length();
    // 0 where the squares underflow.
    if !distance.is_normal() {
        return;
    }
    let way = Ray { origin: Vec3::ZERO, direction: ray.origin / distance, t_max: distance, ..*ray };
    if !world.tracer.may_cross(&way) {
        return;
    }
    world.tracer.boundaries(&way, &mut scratch.crossings);
    scratch.counters.boundary_rays += 1;
    for crossing in &scratch.crossings {
        let fits = world.cross(regions, crossing.shape, crossing.instance, crossing.entering);
        scratch.counters.region_overflows += u64::from(!fits);
    }
}
