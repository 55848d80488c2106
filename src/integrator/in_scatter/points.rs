//! Points drawn on a ray from the camera, and the light that is scattered there: what lights bring, and what paths do that go on from them.
//! Source: Li et al. 2024, section 4.2; **ours**: the paths.

use std::borrow::Cow;

use glam::Vec3;

use super::alternatives::Mix;
use super::layout::lay_out;
use super::seeds::seed;
use super::{InScatter, null_share, vertex_index};
use crate::geometry::Ray;
use crate::integrator::direct::{DirectLight, Vertex};
use crate::integrator::flight::{MediumVertex, PathState, PathWeight, pass};
use crate::integrator::layers::{FirstVertex, Layers};
use crate::integrator::light_choice::LightChoice;
use crate::integrator::path::{PathSettings, Scratch, go_on};
use crate::integrator::walk::Walk;
use crate::integrator::world::World;
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;
use crate::medium::{MediumId, MediumPoint};

/// The light that points drawn on a path's ray, up to the next surface, scatter back along it.
pub fn gather(
    world: &World,
    settings: &PathSettings,
    start: &Walk,
    random: &SamplePoint,
    scratch: &mut Scratch,
) -> Rgb {
    if let LightChoice::Pilot = world.light_choice {
        seed(world, start, random, scratch);
        return Rgb::BLACK;
    }
    if !aim(world, start, scratch) {
        return Rgb::BLACK;
    }
    let InScatter { count, mix, .. } = scratch.in_scatter;
    let [u, u_count, u_medium] = random.draw::<3>(vertex_index(start.index, 0), Dimension::InScatter);
    let along = start.index as usize - 1;
    let mut sum = Rgb::BLACK;
    let draws = if count < 1.0 { u32::from(u_count < count) } else { count as u32 };
    for draw in 0..draws {
        let before = scratch.counters.work();
        let u = (f64::from(u) + f64::from(draw)) / f64::from(draws);
        let Some((t, pdf)) = scratch.in_scatter.along[along].density.sample(u) else { break };
        let point = Point { world, settings, start, random, index: vertex_index(start.index, draw) };
        let reached = point.reach(t, pdf, u_medium, scratch);
        scratch.in_scatter.work.points += scratch.counters.work() - before;
        let Some((vertex, mut to_point)) = reached else { continue };

        let null = to_point.weight.unidirectional;
        let drawn = start.path.weight.unidirectional * count;
        let scale = scratch.in_scatter.share(&mut to_point.weight, drawn, &start.path.weight);
        let before = scratch.counters.work();
        let mut found = [point.lights(&vertex, &to_point, scratch), Rgb::BLACK];
        scratch.in_scatter.work.points += scratch.counters.work() - before;
        if mix.goes_on {
            let before = scratch.counters.work();
            found[1] = point.go_on(&vertex, to_point, start.roulette_scale * scale, scratch);
            scratch.in_scatter.work.paths += scratch.counters.work() - before;
        }
        if mix == Mix::FULL {
            scratch.in_scatter.alternatives.add_drawn(null_share(null, drawn), found);
        }
        sum += found[0] + found[1];
    }
    scratch.in_scatter.drawn += sum;
    scratch.in_scatter.scattered += sum;
    // The path begins its ray without a cache point in use.
    world.light_choice.begin_path(&mut scratch.lights);
    sum
}

/// Makes the density that along the ray; false where there is none to go by.
fn aim(world: &World, start: &Walk, scratch: &mut Scratch) -> bool {
    let (ray, along) = (&start.ray, start.index as usize - 1);
    if let Some(lights) = &world.equi_angular {
        scratch.in_scatter.along[along].density.aim_at_lights(ray, lights, world.extent);
        return true;
    }
    let Some(cache) = world.light_choice.cache_points() else { return false };
    let before = scratch.counters.work();
    lay_out(world, cache, start, scratch);
    let laid_out = scratch.counters.work();
    scratch.counters.beam_crossings += scratch.in_scatter.along[along].density.aim(ray, &world.lights, cache) as u64;
    let work = &mut scratch.in_scatter.work;
    // Knots of camera rays serve many samples.
    *if start.index == 1 { &mut work.knots } else { &mut work.points } += laid_out - before;
    work.points += scratch.counters.work() - laid_out;
    true
}

/// A point on a ray.
struct Point<'a> {
    world: &'a World,
    settings: &'a PathSettings,
    start: &'a Walk,
    random: &'a SamplePoint,
    /// The vertex's number.
    index: u32,
}

impl Point<'_> {
    /// Ratio tracking up to `t`, which was drawn with `pdf`: the vertex there, and the path up to it, its weight that of null tracking relative to the
    /// density of having drawn this point and medium.
    fn reach(&self, t: f32, pdf: f32, u_medium: f32, scratch: &mut Scratch) -> Option<(MediumVertex, PathState)> {
        let Self { world, start: Walk { ray, path, .. }, random, index, .. } = *self;
        let mut stream = random.stream(index, Dimension::Flight);
        let mut regions = Cow::Borrowed(&path.regions);
        let (passed, t) = pass(world, &Ray { t_max: t, ..*ray }, &mut regions, &mut stream, scratch);
        if passed.value.is_black() {
            return None;
        }
        let p = ray.origin + ray.direction * t;
        let (medium, share) = choose_medium(world, regions.media(), p, ray.time, u_medium)?;
        let MediumPoint { absorption, scattering, .. } = world.medium(medium).coefficients(p, ray.time).limited(p);
        let inverse = 1.0 / (pdf * share);
        let null = path.weight.unidirectional * passed.pass_probability * (absorption + scattering) * inverse;
        let throughput = path.weight.throughput * passed.value * scattering * inverse;
        let weight = PathWeight { throughput, unidirectional: null, light: null };
        let mut to_point = PathState { weight, regions: Regions::default(), hero: path.hero, links: None };
        to_point.regions.copy_from(&regions);
        scratch.counters.medium_vertices += 1;
        Some((MediumVertex::new(world, p, medium), to_point))
    }

    /// What lights bring at `vertex`.
    fn lights(&self, vertex: &MediumVertex, path: &PathState, scratch: &mut Scratch) -> Rgb {
        let Self { world, settings, start: Walk { ray, depth, .. }, random, index, .. } = *self;
        let (vertex, wo, depth) = (Vertex::Medium(vertex), -ray.direction, depth + 1);
        let direct = DirectLight { world, settings, vertex, wo, time: ray.time, path, depth, random, index };
        direct.gather_in_medium(scratch)
    }

    /// What a path brings that goes on from `vertex`.
    fn go_on(&self, vertex: &MediumVertex, mut path: PathState, roulette_scale: f32, scratch: &mut Scratch) -> Rgb {
        let Walk { ray, depth, .. } = self.start;
        let [u0, u1] = self.random.draw::<2>(self.index, Dimension::Scatter);
        let wo = -ray.direction;
        let wi = vertex.phase.sample(wo, [u0, u1]);
        let pdf = vertex.phase.evaluate(wo, wi);
        path.weight.light = path.weight.light / pdf;
        path.links = Some(vertex.links);
        let mut start = Walk {
            ray: Ray { origin: vertex.p, direction: wi, t_max: f32::INFINITY, ..*ray },
            path,
            depth: depth + 1,
            sampled_from: Some(vertex.p),
            roulette_scale,
            index: self.index + 1,
            differentials: self.start.differentials.map(|mut differentials| {
                differentials.pass(vertex.p.distance(ray.origin));
                differentials.scatter(wi, pdf);
                differentials
            }),
            mixed: None,
        };
        let mut layers = Layers { first: Some(FirstVertex::Medium), ..Layers::default() };
        go_on(self.world, self.settings, &mut start, self.random, scratch, &mut layers);
        layers.result.beauty
    }
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
pub fn medium_share(world: &World, media: &[MediumId], medium: MediumId, p: Vec3, time: f32) -> f32 {
    if media.len() == 1 {
        return 1.0;
    }
    let strength = |id: MediumId| world.medium(id).coefficients(p, time).scattering.luminance();
    let total: f32 = media.iter().map(|&id| strength(id)).sum();
    if total > 0.0 { strength(medium) / total } else { 0.0 }
}
