//! What a path does in the media along its ray. Source: Miller et al. 2019; Li et al. 2024, section 4.2, for the points that are drawn beside it.

use super::direct::{DirectLight, Vertex};
use super::flight::{FlightVertex, PathWeight, sample_flight};
use super::glow_line;
use super::in_scatter::alternatives::OwnVertex;
use super::in_scatter::{self, MOST_RAYS, null_share};
use super::layers::{FirstVertex, Layers};
use super::path::{MOST_BOUNCES, PathSettings, Scratch};
use super::record::{Event, VertexKind};
use super::volume_light::FlightPdfs;
use super::walk::Walk;
use super::world::World;
use crate::geometry::Ray;
use crate::geometry::extent::within;
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SamplePoint};

/// What became of the path.
pub(super) enum Passage {
    /// Nothing scattered it: it comes to what ends its ray.
    Through,
    /// It goes on in another direction.
    Scattered,
    /// It is over.
    Ended,
}

/// Whether the path's ray may be in a medium. Most rays of a scene with little smoke are nowhere near it, and should not pay for it.
#[inline]
pub(super) fn is_near_media(world: &World, walk: &Walk, scratch: &Scratch) -> bool {
    !walk.path.regions.media().is_empty() || scratch.in_scatter.is_on() || world.tracer.may_cross(&walk.ray)
}

/// Takes a path along its ray, up to `walk.ray.t_max`.
#[inline(never)]
pub(super) fn through_media(
    world: &World,
    settings: &PathSettings,
    walk: &mut Walk,
    random: &SamplePoint,
    scratch: &mut Scratch,
    layers: &mut Layers,
) -> Passage {
    let (index, depth) = (walk.index, walk.depth);
    walk.path.hero.get_or_insert_with(|| (random.draw::<2>(0, Dimension::Time)[1] * 3.0) as u8);
    // Camera rays, and what mirrors and glass make of them. Rays from rough surfaces share their knots with no other: in `godrays`
    // drawing points on them as well left the variance as it was and took 1.7 times as long.
    let is_mixed = index <= MOST_RAYS
        && walk.sampled_from.is_none()
        && walk.mixed.is_none()
        && scratch.in_scatter.is_on()
        && depth < settings.max_depth;
    let began_with = walk.path.weight;
    if is_mixed {
        let scattered = in_scatter::gather(world, settings, walk, random, scratch);
        layers.add_scattered(scattered, depth + 1);
    }
    let Walk { ref ray, ref mut path, sampled_from, .. } = *walk;
    // Where the ray leaves what grids light up, if it comes there.
    let fires = world.fires.filter(|_| depth < settings.max_depth).and_then(|fires| within(ray, fires));
    let mut grids_glow = fires.is_some();
    if let (Some([_, end]), None) = (fires, sampled_from) {
        // Nothing else finds what emits along this ray.
        let mut stream = random.stream(index, Dimension::Glow);
        let [u] = random.draw::<1>(index, Dimension::Glow);
        let glow = glow_line::gather(world, &Ray { t_max: end, ..*ray }, &path.regions, u, &mut stream, scratch);
        layers.add(path.weight.alone() * glow, depth, true);
        grids_glow = false;
    }
    let mut stream = random.stream(index, Dimension::Flight);
    let mut pdfs = FlightPdfs::new(world, ray, sampled_from, path.links);
    let vertex = sample_flight(world, ray, path, grids_glow, &mut stream, scratch, |weight, medium, glow, lights| {
        if depth < settings.max_depth {
            layers.add(pdfs.weight(weight, medium, lights) * glow, depth, true);
        }
    });
    if path.weight.throughput.is_black() {
        return Passage::Ended;
    }
    let Some(reached) = vertex else { return Passage::Through };
    if depth >= settings.max_depth {
        scratch.counters.cut_paths += u64::from(depth >= MOST_BOUNCES);
        return Passage::Ended;
    }
    walk.depth += 1;
    let began_with = is_mixed.then_some(&began_with);
    if scatter(world, settings, walk, &reached, began_with, random, scratch, layers) {
        Passage::Scattered
    } else {
        Passage::Ended
    }
}

/// Gathers light where a flight ended, and scatters the path there; false where it is over. `began_with` is what it weighed where its ray began, if points
/// were drawn on that ray as well.
#[expect(clippy::too_many_arguments, reason = "it is the second half of the one above")]
fn scatter(
    world: &World,
    settings: &PathSettings,
    walk: &mut Walk,
    reached: &FlightVertex,
    began_with: Option<&PathWeight>,
    random: &SamplePoint,
    scratch: &mut Scratch,
    layers: &mut Layers,
) -> bool {
    let Walk { index, depth, .. } = *walk;
    let Ray { direction, time, .. } = walk.ray;
    let &FlightVertex { ref vertex, medium, t, passed } = reached;
    let (p, wo) = (vertex.p, -direction);
    scratch.counters.medium_vertices += 1;
    layers.first.get_or_insert(FirstVertex::Medium);
    scratch.note(|| Event::Vertex {
        index,
        depth,
        kind: VertexKind::Medium,
        p,
        throughput: walk.path.weight.alone(),
        so_far: layers.result.beauty,
    });
    let mut is_drawn = false;
    if let Some(began_with) = began_with {
        let share = in_scatter::medium_share(world, walk.path.regions.media(), medium, p, time);
        let expected = passed * share * scratch.in_scatter.expected(index, t);
        is_drawn = expected > 0.0 && expected.is_finite();
        let drawn = if is_drawn { began_with.unidirectional * expected } else { Rgb::BLACK };
        let null = walk.path.weight.unidirectional;
        walk.roulette_scale *= scratch.in_scatter.share(&mut walk.path.weight, drawn, began_with);
        let (share, before) = (null_share(null, drawn), layers.result.beauty);
        walk.mixed = Some(OwnVertex { share, before, light: Rgb::BLACK });
    }
    let path = &walk.path;
    let direct = DirectLight { world, settings, vertex: Vertex::Medium(vertex), wo, time, path, depth, random, index };
    if is_drawn && !scratch.in_scatter.null_lights() {
        direct.prepare(scratch);
    } else {
        let before = scratch.counters.work();
        let gathered = direct.gather_in_medium(scratch);
        layers.add(gathered, depth, false);
        if let Some(vertex) = walk.mixed.as_mut().filter(|_| began_with.is_some()) {
            vertex.light = gathered;
            scratch.in_scatter.work.null_lights += scratch.counters.work() - before;
        }
    }

    let [u0, u1, u_roulette] = random.draw::<3>(index, Dimension::Scatter);
    let wi = vertex.phase.sample(wo, [u0, u1]);
    // f / pdf = 1: only the pdf of having sampled a light instead changes.
    let pdf = vertex.phase.evaluate(wo, wi);
    walk.path.weight.light = walk.path.weight.light / pdf;
    if let Some(differentials) = &mut walk.differentials {
        differentials.pass(t);
        differentials.scatter(wi, pdf);
    }
    walk.sampled_from = Some(p);
    walk.path.links = Some(vertex.links);
    walk.ray = Ray { origin: p, direction: wi, t_max: f32::INFINITY, ..walk.ray };
    walk.survives(u_roulette)
}
