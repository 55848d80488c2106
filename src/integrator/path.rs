//! The unidirectional volumetric path tracer. Source: Kajiya 1986; Veach 1997 (MIS); Miller et al. 2019 (media); the depth
//! rule is pbrt-v4's (section 14.2.2): a path of k bounces gathers surface emission while k ≤ `max_depth`, and emission of media
//! only while k < `max_depth`.

use super::at_surface::at_surface;
use super::counters::Counters;
use super::in_scatter::InScatter;
use super::layers::Layers;
use super::light_choice::LightScratch;
use super::record::{Event, PathRecord};
use super::through_media::{Passage, is_near_media, through_media};
use super::walk::{Walk, camera_regions};
use super::world::World;
use crate::film::SampleResult;
use crate::geometry::differentials::RayDifferentials;
use crate::geometry::{BoundaryCrossing, Ray};
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};

/// The most bounces of any path, whatever [`PathSettings::max_depth`] says. In a white medium (albedo exactly 1) Russian roulette ends no path, and one
/// as dense as [`crate::medium::resolution`] lets it be keeps some for 10⁹ vertices. Of the paths that enter a white half-space, H(μ) / √(πn) are still in it after
/// n bounces (from its albedo 1 − √(1 − ϖ) H(μ) as a generating function; Chandrasekhar's H is at most 2.91), so at most 0.052 % of the light is
/// lost: a bias by design, which [`Counters::cut_paths`] counts.
pub const MOST_BOUNCES: u32 = 10_000_000;

/// What the path tracer may be told.
#[derive(Clone, Copy, Debug)]
pub struct PathSettings {
    /// The largest number of bounces, at most [`MOST_BOUNCES`].
    pub max_depth: u32,
    /// From how many candidates the light sample of a vertex is resampled; 1 for no resampling.
    pub light_candidates: u32,
    /// How often each draw of lights is made at a vertex. More than once only where paths rehearse: what they bring is of no use then.
    pub tries: u32,
}

/// Memory that a thread reuses from path to path.
#[derive(Default)]
pub struct Scratch {
    /// Boundary crossings of the current ray.
    pub crossings: Vec<BoundaryCrossing>,
    /// The lights' weights at the current vertex.
    pub lights: LightScratch,
    /// What is known of the camera rays of the current pixel.
    pub in_scatter: InScatter,
    /// What was done so far.
    pub counters: Counters,
    /// What happens along paths, where that is asked for.
    pub record: Option<Box<PathRecord>>,
}

impl Scratch {
    /// Records an event, if events are recorded.
    #[inline]
    pub(super) fn note(&mut self, event: impl FnOnce() -> Event) {
        if let Some(record) = &mut self.record {
            record.add(event());
        }
    }
}

/// A ray from a camera, and how it would change with the pixel, where textures have levels of detail.
pub type CameraRay = (Ray, Option<RayDifferentials>);

/// The radiance that arrives along a ray from a camera, as one unbiased sample, sorted into layers. `seen` is told what of it surfaces and environments
/// shine straight into the camera, and answers with another unbiased sample of that, which the result has in its place.
//
// Scenes without media have no code of their own: they answer a handful of tests along a path. With the path compiled once for each kind both were slower (`lamp`, release
// builds: 1.04 times the processor time without media, and with a fog that no ray meets 1.02 times that of none, in place of 1.003).
pub fn trace_path(
    world: &World,
    settings: &PathSettings,
    start: CameraRay,
    random: &SamplePoint,
    scratch: &mut Scratch,
    seen: impl FnOnce(Rgb, &mut Scratch) -> Rgb,
) -> SampleResult {
    scratch.counters.paths += 1;
    world.light_choice.begin_path(&mut scratch.lights);
    scratch.in_scatter.begin_path();
    let mut walk = Walk::new(start);
    camera_regions(world, &walk.ray, &mut walk.path.regions, scratch);
    let mut layers = Layers::new();
    go_on(world, settings, &mut walk, random, scratch, &mut layers);
    scratch.in_scatter.glow = layers.glow;
    let seen = seen(layers.seen, scratch);
    scratch.note(|| Event::Seen { brought: seen });
    layers.whole(seen)
}

/// Goes on along a path until it ends, and adds what it meets to `layers`.
pub(super) fn go_on(
    world: &World,
    settings: &PathSettings,
    walk: &mut Walk,
    random: &SamplePoint,
    scratch: &mut Scratch,
    layers: &mut Layers,
) {
    loop {
        let index = walk.index;
        walk.ray.opacity_seed = random.hash(index, Dimension::Opacity);
        scratch.counters.closest_rays += 1;
        let hit = world.tracer.closest(&walk.ray);

        walk.ray.t_max = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
        if is_near_media(world, walk, scratch) {
            match through_media(world, settings, walk, random, scratch, layers) {
                Passage::Ended => break,
                Passage::Scattered => {
                    walk.index += 1;
                    continue;
                }
                Passage::Through => {}
            }
        }

        let goes_on = match hit {
            Some(hit) => at_surface(world, settings, walk, &hit, random, scratch, layers),
            None => {
                escape(world, walk, scratch, layers);
                false
            }
        };
        if !goes_on {
            break;
        }
        walk.index += 1;
    }
    scratch.note(|| Event::End { so_far: layers.result.beauty + layers.seen });
    if let Some(vertex) = &walk.mixed {
        let rest = layers.result.beauty - (vertex.before + vertex.light);
        scratch.in_scatter.add_own(vertex, rest);
    }
}

/// What shines on a path that meets no surface.
fn escape(world: &World, walk: &Walk, scratch: &Scratch, layers: &mut Layers) {
    let Ray { origin, direction, .. } = walk.ray;
    for &light in world.lights.infinite() {
        let radiance = world.lights.background(light, origin, direction);
        if !radiance.is_black() {
            let pdf = |from| world.lights.background_pdf(light, from, direction);
            layers.add(walk.mis_weight(world, light, scratch, pdf) * radiance, walk.depth, false);
        }
    }
}
