//! Flights through space: along a ray from vertex to vertex, across boundaries, through whatever media are there.
//!
//! Weights follow the null-scattering path integral with spectral MIS (Miller, Georgiev, Jarosz 2019; pbrt-v4 section 14.2.2):
//! decisions are made by the coefficients of one channel (the *hero*, chosen uniformly for each path), and every weight is divided by
//! the mean over the channels of the pdfs with which each of them would have made the same decisions. All
//! pdfs are kept relative to the hero's, so they stay near 1 however long the path.

use std::borrow::Cow;

use glam::Vec3;

use super::counters::Counters;
use super::fog_glow::FogGlow;
use super::light_choice::LightScratch;
use super::path::Scratch;
use super::world::World;
use crate::geometry::Ray;
use crate::light::LinkSet;
use crate::math::Rgb;
use crate::math::phase::HenyeyGreenstein;
use crate::math::sampler::Stream;
use crate::medium::emission_points::{EmissionPoints, PointWalks};
use crate::medium::regions::Regions;
use crate::medium::tracker::{Flights, Tracker, Transmittance};
use crate::medium::{MediumId, MediumPoint};
use crate::system::fault::{self, Fault};

/// The weight of a path and the pdfs, relative to the hero's pdf of the path.
#[derive(Clone, Copy, Debug)]
pub struct PathWeight {
    /// f / p_hero.
    pub throughput: Rgb,
    /// p_c / p_hero of sampling the path as it was sampled (by BSDFs, phase functions and free flights).
    pub unidirectional: Rgb,
    /// At a vertex, p_c / p_hero of sampling a light there: the sum over all ways to have come there that do. Between vertices, of having reached the
    /// current place by that (without the light's own pdf).
    pub light: Rgb,
}

impl PathWeight {
    /// The weight of a path that has just left the camera.
    pub const START: Self = Self { throughput: Rgb::WHITE, unidirectional: Rgb::WHITE, light: Rgb::WHITE };

    /// Throughput over the mean pdf: what a contribution counts that only this technique can find.
    #[inline]
    pub fn alone(&self) -> Rgb {
        self.throughput / self.unidirectional.mean()
    }

    /// Throughput over the sum of the mean pdfs of both techniques (balance heuristic), `light_pdf` being that of sampling the light.
    #[inline]
    pub fn with_light(&self, light_pdf: f32) -> Rgb {
        self.throughput / (self.unidirectional + self.light * light_pdf).mean()
    }
}

/// What a path carries from vertex to vertex.
#[derive(Clone, Debug)]
pub struct PathState {
    /// Weight and pdfs.
    pub weight: PathWeight,
    /// The media around.
    pub regions: Regions,
    /// The channel whose coefficients decide, 0, 1 or 2: drawn where a medium is near.
    pub hero: Option<u8>,
    /// The lights that light the last vertex. `None` before the first: cameras see every light.
    pub links: Option<LinkSet>,
}

/// A place in a medium where the path scatters.
pub struct MediumVertex {
    /// Where.
    pub p: Vec3,
    /// How.
    pub phase: HenyeyGreenstein,
    /// The lights that light the medium.
    pub links: LinkSet,
}

impl MediumVertex {
    /// Where `medium` scatters at `p`.
    #[inline]
    pub fn new(world: &World, p: Vec3, medium: MediumId) -> Self {
        let phase = HenyeyGreenstein::new(world.medium(medium).g());
        Self { p, phase, links: world.media_links[medium.0 as usize] }
    }
}

/// A vertex that a flight came to.
pub struct FlightVertex {
    /// The vertex.
    pub vertex: MediumVertex,
    /// The medium that scatters there.
    pub medium: MediumId,
    /// How far along the ray.
    pub t: f32,
    /// 1 / length, relative to the hero's pdf of the flight: what it would be to have come here without a null collision deciding otherwise, and to have
    /// stopped with density 1.
    pub passed: f32,
}

/// Follows `ray` up to `ray.t_max` (the next surface) and samples whether and where a medium scatters it. The regions of
/// `path` are moved along, its weight is updated, and `emit` receives emission: the path's weight where it is gathered, the medium that
/// emits (`None` for homogeneous ones, which are no lights), how much, and what is known of the lights at the last vertex. Emission of media
/// given by grids is gathered as far as the flight comes, and only where `grids_glow`.
///
/// A path whose weight has become black is over.
pub fn sample_flight(
    world: &World,
    ray: &Ray,
    path: &mut PathState,
    grids_glow: bool,
    stream: &mut Stream,
    scratch: &mut Scratch,
    mut emit: impl FnMut(&PathWeight, Option<MediumId>, Rgb, &LightScratch),
) -> Option<FlightVertex> {
    // The list is taken out of the scratch space so that both can be used at once; its memory is kept.
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(ray, &mut crossings);
    scratch.counters.boundary_rays += 1;

    // What is left of the light's pdf is the hero's of the flight, inverted: it changes alike in all channels.
    let light = path.weight.light.max_channel();
    let mut t_start = 0.0;
    let mut vertex = None;
    for i in 0..=crossings.len() {
        let t_end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        if !path.regions.media().is_empty() && t_end > t_start {
            let Scratch { lights, counters, .. } = scratch;
            let mut emit = |weight: &PathWeight, medium, emission| emit(weight, medium, emission, lights);
            vertex = sample_stretch(world, ray, [t_start, t_end], light, path, grids_glow, stream, counters, &mut emit);
            if vertex.is_some() || path.weight.throughput.is_black() {
                break;
            }
        }
        if let Some(crossing) = crossings.get(i) {
            let fits = world.cross(&mut path.regions, crossing.shape, crossing.instance, crossing.entering);
            scratch.counters.region_overflows += u64::from(!fits);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
    vertex
}

/// One stretch between boundaries: delta tracking.
#[expect(clippy::too_many_arguments, reason = "it is the inner loop of the one above")]
fn sample_stretch(
    world: &World,
    ray: &Ray,
    stretch: [f32; 2],
    light: f32,
    path: &mut PathState,
    grids_glow: bool,
    stream: &mut Stream,
    counters: &mut Counters,
    emit: &mut impl FnMut(&PathWeight, Option<MediumId>, Rgb),
) -> Option<FlightVertex> {
    let PathState { weight, regions, hero, .. } = path;
    let hero = usize::from(hero.unwrap_or(0));
    let mut fog = FogGlow::Gathered;
    if world.fog_glows {
        fog = FogGlow::new(world, regions.media(), ray, stretch, stream);
        if let FogGlow::Whole(emission) = fog {
            emit(weight, None, emission);
        }
    }
    let Ray { origin, direction, .. } = *ray;
    let glows = if grids_glow { regions.media() } else { &[] };
    let (mut walks, mut flights) = (PointWalks::new(), Flights::new());
    let mut points = EmissionPoints::new(&mut walks, &world.media, glows, ray, stretch, || stream.next_f32());
    let mut tracker = Tracker::new(&mut flights, &world.media, regions.media(), origin, direction, stretch, stream);
    loop {
        let collision = tracker.next(stream);
        // Points have no part in the flight: they gather what their place emits, with what has come so far.
        while let Some(point) = points.next_before(tracker.distance()) {
            counters.emission_points += 1;
            let emission = world.medium(point.medium).point(origin + direction * point.t, ray.time).emission;
            if !emission.is_black() {
                emit(weight, Some(point.medium), emission * (1.0 / point.rate));
            }
        }
        let Some(collision) = collision else { break };
        counters.flight_steps += 1;
        if let FogGlow::At { t, value } = fog
            && t <= collision.t
        {
            emit(weight, None, value);
            fog = FogGlow::Gathered;
        }
        let MediumPoint { absorption, scattering, .. } =
            world.medium(collision.medium).coefficients(origin + direction * collision.t, ray.time);

        // Real or null, by the hero's extinction. Absorption is not an event of its own: it goes into the weight as
        // albedo, and Russian roulette ends paths that no longer matter.
        let extinction = absorption + scattering;
        // Divided, so that it is exactly 1 where they are equal: the tracker counts on it.
        let real = extinction.map(|mu| (mu / collision.majorant).min(1.0));
        if stream.next_f32() < real[hero] {
            let inverse = 1.0 / real[hero];
            // μ_s / μ̄; the albedo where μ_t is beyond what the bound was limited to.
            weight.throughput *= scattering * extinction.map(|mu| (1.0 / mu.max(collision.majorant)) * inverse);
            weight.unidirectional *= real * inverse;
            let passed = weight.light.max_channel() / light * ((1.0 / collision.majorant) * inverse);
            // From here on a light is sampled from this vertex.
            weight.light = weight.unidirectional;
            let p = ray.origin + ray.direction * within(collision.t, stretch, ray);
            let vertex = MediumVertex::new(world, p, collision.medium);
            let t = collision.t;
            return (!weight.throughput.is_black()).then_some(FlightVertex {
                vertex,
                medium: collision.medium,
                t,
                passed,
            });
        }
        let mut null = Rgb::WHITE - real;
        if fault::is(Fault::ColourlessNull) {
            null = Rgb::splat(null[hero]);
        }
        let inverse = 1.0 / null[hero];
        weight.throughput *= null * inverse;
        weight.unidirectional *= null * inverse;
        // A shadow ray passes every null collision with probability 1.
        weight.light *= inverse;
        if weight.throughput.is_black() {
            return None;
        }
    }
    if let FogGlow::At { value, .. } = fog {
        emit(weight, None, value);
    }
    None
}

/// `t` moved away from the ends of its stretch by what rounding may shift points along `ray`. A vertex beyond the boundary of its
/// medium could leave without crossing that boundary, and its path would never know that it is outside.
fn within(t: f32, [t_start, t_end]: [f32; 2], ray: &Ray) -> f32 {
    let origin = ray.origin.abs().max_element();
    let margin = |t: f32| 4.0 * f32::EPSILON * (origin + t);
    // Where a ray starts there is no boundary, and none where it never ends.
    let first = if t_start > 0.0 { t_start + margin(t_start) } else { 0.0 };
    let last = if t_end < f32::INFINITY { t_end - margin(t_end) } else { f32::INFINITY };
    if first < last { t.clamp(first, last) } else { 0.5 * (t_start + t_end) }
}

/// Estimates the transmittance of `ray` (a shadow ray that nothing blocks) through all media and across all boundaries.
#[inline]
pub fn transmittance(
    world: &World,
    ray: &Ray,
    regions: &Regions,
    stream: impl FnOnce() -> Stream,
    scratch: &mut Scratch,
) -> Transmittance {
    if regions.media().is_empty() && !world.tracer.may_cross(ray) {
        return Transmittance::CLEAR;
    }
    pass(world, ray, &mut Cow::Borrowed(regions), &mut stream(), scratch).0
}

/// Ratio tracking up to the end of `ray`: moves `regions` along, and returns the transmittance and where the end is, moved off the boundary
/// before it by what rounding may shift points.
pub(super) fn pass(
    world: &World,
    ray: &Ray,
    regions: &mut Cow<'_, Regions>,
    stream: &mut Stream,
    scratch: &mut Scratch,
) -> (Transmittance, f32) {
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(ray, &mut crossings);
    scratch.counters.boundary_rays += 1;

    let mut result = Transmittance::CLEAR;
    let mut t_start = 0.0;
    for i in 0..=crossings.len() {
        let t_end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        let media = regions.media();
        if !media.is_empty() && t_end > t_start {
            let (origin, direction) = (ray.origin, ray.direction);
            let mut flights = Flights::new();
            let mut tracker =
                Tracker::new(&mut flights, &world.media, media, origin, direction, [t_start, t_end], stream);
            let steps = &mut scratch.counters.transmittance_steps;
            if !result.track(&mut tracker, &world.media, ray, stream, steps) {
                break;
            }
        }
        if let Some(crossing) = crossings.get(i) {
            // Copied only where a boundary changes them.
            let fits = world.cross(regions.to_mut(), crossing.shape, crossing.instance, crossing.entering);
            scratch.counters.region_overflows += u64::from(!fits);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
    (result, within(ray.t_max, [t_start, ray.t_max], ray))
}
