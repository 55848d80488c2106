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
//! all of them; longer paths go on from null tracking's vertices, and from those drawn too where that pays
//! (**ours**: there the vertices as such are weighed by the balance heuristic).
//!
//! A file for each part: [`alternatives`] is what other mixes would have found, [`layout`] is what cache points know along a ray, [`beams`] where it crosses narrow ones, [`density`] the sum of both,
//! [`equi_angular`] a rival to compare with. Rays
//! that share a layout differ a little, which is why any density that is 0 somewhere is allowed.

pub mod alternatives;
mod beams;
mod density;
pub mod equi_angular;
mod layout;
mod stretches;

use std::borrow::Cow;

use glam::Vec3;

use super::direct::{DirectLight, Vertex};
use super::flight::{MediumVertex, PathState, PathWeight, pass};
use super::layers::{FirstVertex, Layers};
use super::light_choice::LightChoice;
use super::path::{PathSettings, Scratch, Walk, walk};
use super::world::World;
use crate::geometry::Ray;
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;
use crate::medium::{MediumId, MediumPoint};
use alternatives::{Alternatives, Mix, OwnVertex};
use density::RayDensity;
use layout::{LaidOut, lay_out};
use stretches::seed;

/// The first number of the vertices that are drawn: path vertices never come this far.
const FIRST_INDEX: u32 = 1 << 24;

/// The density along the camera rays of a pixel, and what it brings. One per thread, reused.
#[derive(Debug)]
pub struct InScatter {
    density: RayDensity,
    laid_out: LaidOut,
    /// Points that each camera path draws: a whole number, or a probability.
    count: f32,
    /// What they do.
    mix: Mix,
    /// What the current path has found, and what it would have found by other mixes. Known where [`Mix::FULL`] is in use.
    pub alternatives: Alternatives,
    /// What the points drawn on the current path's camera ray brought.
    pub drawn: Rgb,
    /// What the points took, of all paths of the pixel so far.
    pub work: PointWork,
    /// Places on the camera rays of pilot paths.
    pub seeds: Vec<Vec3>,
}

impl Default for InScatter {
    fn default() -> Self {
        Self {
            density: RayDensity::default(),
            laid_out: LaidOut::default(),
            count: 0.0,
            mix: Mix::NULL,
            alternatives: Alternatives::default(),
            drawn: Rgb::BLACK,
            work: PointWork::default(),
            seeds: vec![],
        }
    }
}

impl InScatter {
    /// Forgets the knots: the next ray is another one.
    pub fn forget(&mut self) {
        self.laid_out.reach = 0.0;
        self.density.clear();
    }

    /// A new pixel begins, each of whose paths draws `count` points (a whole number, or a probability), of which `mix` says what they do. Its
    /// rays may share knots with the pixel before.
    pub fn begin_pixel(&mut self, count: f32, mix: Mix) {
        (self.count, self.mix, self.work) = (count, mix, PointWork::default());
        self.laid_out.count = 0;
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

    /// Shares a vertex of first scattering, whose `weight` is that of null tracking (relative to any density), with in-scatter sampling, which comes
    /// there with density `drawn`. Returns what its weight counts in Russian roulette from then on.
    pub(super) fn share(&self, weight: &mut PathWeight, drawn: f32) -> f32 {
        if !(drawn > 0.0 && drawn.is_finite()) {
            return 1.0;
        }
        let (null, drawn) = (weight.unidirectional, Rgb::splat(drawn));
        weight.light = if self.mix.null_lights { null + drawn } else { drawn };
        if !self.mix.goes_on {
            return 1.0;
        }
        weight.unidirectional = null + drawn;
        let scale = weight.unidirectional.mean() / weight.throughput.max_channel();
        if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
    }

    /// The path's own vertex of first scattering, after which `rest` came.
    pub(super) fn add_own(&mut self, vertex: &OwnVertex, rest: Rgb) {
        if self.mix == Mix::FULL {
            self.alternatives.add_own(vertex, rest);
        }
    }

    /// Whether vertices of null tracking where points are drawn as well sample lights.
    pub(super) fn null_lights(&self) -> bool {
        self.mix.null_lights
    }
}

/// What points took.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointWork {
    /// To lay out knots.
    pub knots: u64,
    /// To draw points and gather what lights bring there.
    pub points: u64,
    /// To go on from there.
    pub paths: u64,
    /// To gather what lights bring at null tracking's vertices where points are drawn too.
    pub null_lights: u64,
}

/// Null tracking's share of the density with which a vertex is found, `drawn` being that of points.
pub(super) fn null_share(null: Rgb, drawn: f32) -> f64 {
    let null = f64::from(null.mean());
    null / (null + f64::from(drawn))
}

/// The light that points drawn on the camera ray `ray` scatter back along it. `path` is as it leaves the camera.
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
    (scratch.in_scatter.alternatives, scratch.in_scatter.drawn) = Default::default();
    let mut before = scratch.counters.work();
    if let Some(lights) = &world.equi_angular {
        scratch.in_scatter.density.aim_at_lights(ray, lights, world.extent);
    } else {
        let Some(cache) = world.light_choice.cache_points() else { return Rgb::BLACK };
        lay_out(world, cache, ray, &path.regions, scratch);
        scratch.in_scatter.work.knots += scratch.counters.work() - before;
        before = scratch.counters.work();
        scratch.counters.beam_crossings += scratch.in_scatter.density.aim(ray, &world.lights, cache) as u64;
    }
    let InScatter { count, mix, .. } = scratch.in_scatter;
    let [u, u_count, u_medium] = random.draw::<3>(FIRST_INDEX, Dimension::InScatter);
    let draws = if count < 1.0 { u32::from(u_count < count) } else { count as u32 };
    let wo = -ray.direction;
    let mut on_paths = 0;
    for draw in 0..draws {
        let u = (f64::from(u) + f64::from(draw)) / f64::from(draws);
        let Some((t, pdf)) = scratch.in_scatter.density.sample(u) else { break };
        let index = FIRST_INDEX * (1 + draw);
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
        let null = passed.pass_probability * (absorption + scattering) * inverse;
        let mut weight =
            PathWeight { throughput: passed.value * scattering * inverse, unidirectional: null, light: null };
        let roulette_scale = scratch.in_scatter.share(&mut weight, count);
        let mut to_point = PathState { weight, regions: Regions::default(), hero: path.hero, links: None };
        to_point.regions.copy_from(&regions);
        scratch.counters.medium_vertices += 1;
        let vertex = MediumVertex::new(world, p, medium);
        let direct = DirectLight {
            world,
            settings,
            vertex: Vertex::Medium(&vertex),
            wo,
            time: ray.time,
            path: &to_point,
            depth: 1,
            random,
            index,
        };
        let mut found = [direct.gather::<true>(scratch), Rgb::BLACK];
        if mix.goes_on {
            let before = scratch.counters.work();
            let [u0, u1] = random.draw::<2>(index, Dimension::Scatter);
            let wi = vertex.phase.sample(wo, [u0, u1]);
            to_point.weight.light = to_point.weight.light / vertex.phase.evaluate(wo, wi);
            to_point.links = Some(vertex.links);
            let start = Walk {
                ray: Ray { origin: p, direction: wi, t_max: f32::INFINITY, ..*ray },
                path: to_point,
                depth: 1,
                sampled_from: Some(p),
                roulette_scale,
                index: index + 1,
            };
            let mut layers = Layers { first: Some(FirstVertex::Medium), ..Layers::default() };
            walk::<true>(world, settings, start, random, scratch, &mut layers);
            found[1] = layers.result.beauty;
            on_paths += scratch.counters.work() - before;
        }
        if mix == Mix::FULL {
            scratch.in_scatter.alternatives.add_drawn(null_share(null, count), found);
        }
        scratch.in_scatter.drawn += found[0] + found[1];
    }
    // The path begins without a cache point in use.
    world.light_choice.begin_path(&mut scratch.lights);
    let work = &mut scratch.in_scatter.work;
    work.points += scratch.counters.work() - before - on_paths;
    work.paths += on_paths;
    scratch.in_scatter.drawn
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
