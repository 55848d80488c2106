//! In-scatter sampling: scattering points on camera rays, drawn where cache points expect light to be scattered towards the camera, combined
//! with null-collision tracking by multiple importance sampling. Source: Li et al. 2024, section 4.2.
//!
//! The ray's density p_select over distance is linear between knots. A point x_k drawn from it is reached by ratio tracking,
//! against null tracking that reaches it past the same null collisions, so nearly everything cancels:
//!
//! ```text
//! p_null : p_in-scatter  =  P_n(x_1) … P_n(x_{k−1}) μ̄(x_k) P_s(x_k)  :  p_select(x_k)
//! ```
//!
//! What is drawn is a place to sample lights from. So the direct light that a vertex on a camera ray receives is found in three ways
//! (null tracking or in-scatter sampling with a light sample, null tracking with a phase sample), and weighed by the balance heuristic over
//! all of them; longer paths go on from null tracking's vertices alone.
//!
//! A file for each part: [`layout`] is what cache points know along a ray, [`beams`] where it crosses narrow ones, [`density`] the sum of both,
//! [`equi_angular`] a rival to compare with. Rays
//! that share a layout differ a little, which is why any density that is 0 somewhere is allowed.

mod beams;
mod density;
pub mod equi_angular;
mod layout;
mod stretches;

use std::borrow::Cow;

use glam::Vec3;

use super::direct::{DirectLight, Vertex};
use super::flight::{MediumVertex, PathState, PathWeight, pass};
use super::light_choice::LightChoice;
use super::path::{PathSettings, Scratch};
use super::world::World;
use crate::geometry::Ray;
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;
use crate::medium::{MediumId, MediumPoint};
use density::RayDensity;
use layout::{LaidOut, lay_out};
use stretches::seed;

/// The first number of the vertices that are drawn: path vertices never come this far.
const FIRST_INDEX: u32 = 1 << 24;

/// The density along the camera rays of a pixel, and what it brings. One per thread, reused.
#[derive(Debug, Default)]
pub struct InScatter {
    density: RayDensity,
    laid_out: LaidOut,
    /// Points that each camera path draws: a whole number, or a probability.
    count: f32,
    /// What the current path has found of the light that is scattered once, by points drawn and by its own vertex.
    pub scattered: Rgb,
    /// An estimate of the square of what null tracking alone would have found in its place, from the same vertices: those of either technique count
    /// v² p / p_null, v being what they bring, p the pdf of both techniques together. So what null tracking finds once in a thousand
    /// paths does not come as a surprise.
    pub null_square: f64,
    /// What the points drawn on the current path's camera ray brought.
    pub drawn: Rgb,
    /// What they took, of all paths of the pixel so far, and what laying out knots for them took.
    pub work: [u64; 2],
    /// Places on the camera rays of pilot paths.
    pub seeds: Vec<Vec3>,
}

impl InScatter {
    /// Forgets the knots: the next ray is another one.
    pub fn forget(&mut self) {
        self.laid_out.reach = 0.0;
        self.density.clear();
    }

    /// A new pixel begins, each of whose paths draws `count` points: a whole number, or a probability. Its rays may share knots with the pixel
    /// before.
    pub fn begin_pixel(&mut self, count: f32) {
        (self.count, self.laid_out.count, self.work) = (count, 0, [0; 2]);
    }

    /// Whether the pixel's paths draw points.
    #[inline]
    pub fn is_on(&self) -> bool {
        self.count > 0.0
    }

    /// The pdf with which a point at `t` of the current camera ray is drawn, times the number of points that are.
    #[inline]
    pub fn expected(&self, t: f32) -> f32 {
        self.count * self.density.pdf(t)
    }
}

/// The direct light that points drawn on the camera ray `ray` scatter back along it. `path` is as it leaves the camera.
pub fn gather(
    world: &World,
    settings: &PathSettings,
    ray: &Ray,
    path: &PathState,
    random: &SamplePoint,
    scratch: &mut Scratch,
) -> Rgb {
    if let LightChoice::Pilot = world.light_choice {
        seed(world, ray, &path.regions, random, scratch);
        return Rgb::BLACK;
    }
    let mut before = scratch.counters.work();
    if let Some(lights) = &world.equi_angular {
        scratch.in_scatter.density.aim_at_lights(ray, lights, world.extent);
    } else {
        let Some(cache) = world.light_choice.cache_points() else { return Rgb::BLACK };
        lay_out(world, cache, ray, &path.regions, scratch);
        scratch.in_scatter.work[1] += scratch.counters.work() - before;
        before = scratch.counters.work();
        scratch.counters.beam_crossings += scratch.in_scatter.density.aim(ray, &world.lights, cache) as u64;
    }
    let count = scratch.in_scatter.count;
    let [u, u_count, u_medium] = random.draw::<3>(FIRST_INDEX, Dimension::InScatter);
    let draws = if count < 1.0 { u32::from(u_count < count) } else { count as u32 };
    let mut to_point =
        PathState { weight: PathWeight::START, regions: Regions::default(), hero: path.hero, links: None };
    let (mut gathered, mut null_square) = (Rgb::BLACK, 0.0);
    for draw in 0..draws {
        let u = (f64::from(u) + f64::from(draw)) / f64::from(draws);
        let Some((t, pdf)) = scratch.in_scatter.density.sample(u) else { break };
        let index = FIRST_INDEX + draw;
        let mut stream = random.stream(index, Dimension::Flight);
        let mut regions = Cow::Borrowed(&path.regions);
        let (passed, t) = pass(world, &Ray { t_max: t, ..*ray }, &mut regions, &mut stream, scratch);
        if passed.value.is_black() {
            continue;
        }
        let p = ray.origin + ray.direction * t;
        let Some((medium, share)) = choose_medium(world, regions.media(), p, ray.time, u_medium) else { continue };
        let MediumPoint { absorption, scattering, .. } = world.medium(medium).coefficients(p, ray.time).limited(p);
        // All weights are relative to the density of having drawn this point and medium.
        let inverse = 1.0 / (pdf * share);
        let unidirectional = passed.pass_probability * (absorption + scattering) * inverse;
        let null = if settings.null_samples_lights { unidirectional } else { Rgb::BLACK };
        to_point.weight = PathWeight {
            throughput: passed.value * scattering * inverse,
            unidirectional,
            light: null + Rgb::splat(count),
        };
        to_point.regions.copy_from(&regions);
        scratch.counters.medium_vertices += 1;
        let (vertex, wo) = (MediumVertex::new(world, p, medium), -ray.direction);
        let vertex = Vertex::Medium(&vertex);
        let direct =
            DirectLight { world, settings, vertex, wo, time: ray.time, path: &to_point, depth: 1, random, index };
        let found = direct.gather::<true>(scratch);
        gathered += found;
        null_square += to_point.weight.null_square(found);
    }
    // The path begins without a cache point in use.
    world.light_choice.begin_path(&mut scratch.lights);
    let in_scatter = &mut scratch.in_scatter;
    (in_scatter.drawn, in_scatter.scattered, in_scatter.null_square) = (gathered, gathered, null_square);
    in_scatter.work[0] += scratch.counters.work() - before;
    gathered
}

/// The medium that scatters at `p`, in proportion to the media's scattering coefficients, and its probability.
fn choose_medium(world: &World, media: &[MediumId], p: Vec3, time: f32, u: f32) -> Option<(MediumId, f32)> {
    if let &[only] = media {
        return Some((only, 1.0));
    }
    let strength = |id: MediumId| world.medium(id).coefficients(p, time).scattering.luminance();
    let total: f32 = media.iter().map(|&id| strength(id)).sum();
    let mut rest = u * total;
    let mut chosen = None;
    for &id in media {
        let own = strength(id);
        if own > 0.0 {
            chosen = Some((id, own / total));
            if rest < own {
                break;
            }
        }
        rest -= own;
    }
    chosen
}

/// The probability with which [`choose_medium`] chooses `medium` at `p`.
pub(super) fn medium_share(world: &World, media: &[MediumId], medium: MediumId, p: Vec3, time: f32) -> f32 {
    if media.len() == 1 {
        return 1.0;
    }
    let strength = |id: MediumId| world.medium(id).coefficients(p, time).scattering.luminance();
    let total: f32 = media.iter().map(|&id| strength(id)).sum();
    if total > 0.0 { strength(medium) / total } else { 0.0 }
}
