//! Media that emit as lights: what arrives along a line, and what a flight that meets them weighs.
//!
//! Source: Simon, Hanika, Zirr, Dachsbacher, "Line Integration for Rendering Heterogeneous Emissive Volumes", EGSR 2017: a direction
//! drawn towards one point of a fire finds all of it that lies on the line, so smoke in front of that point, or its being one of millions, makes
//! little noise. Points on the line are as dense as on a flight in the same direction, and each tentative collision before them is one that the
//! flight could have had, with the same bounds: so each point is weighed by multiple importance sampling for itself (Miller, Georgiev,
//! Jarosz 2019).

use arrayvec::ArrayVec;
use glam::Vec3;

use super::counters::Counters;
use super::flight::PathWeight;
use super::light_choice::LightScratch;
use super::path::Scratch;
use super::world::World;
use crate::geometry::Ray;
use crate::geometry::extent::within;
use crate::light::LinkSet;
use crate::math::Rgb;
use crate::math::sampler::Stream;
use crate::medium::MediumId;
use crate::medium::emission_points::{EmissionPoints, PointWalks};
use crate::medium::regions::Regions;
use crate::medium::tracker::{Flights, Tracker, Transmittance};
use crate::system::fault::{self, Fault};

/// Gathers the emission of `medium` along `ray` up to the first surface: `add` receives, at each point where it is gathered, what
/// passes from there to the ray's origin, and μ_a L_e over the density of points.
pub(super) fn gather_line(
    world: &World,
    mut ray: Ray,
    regions: &Regions,
    medium: MediumId,
    stream: &mut Stream,
    scratch: &mut Scratch,
    mut add: impl FnMut(&Transmittance, Rgb),
) {
    let Some(end) = end_of(world.medium(medium).bounds(), &ray) else { return };
    ray.t_max = end;
    if let Some(hit) = world.tracer.closest(&ray) {
        ray.t_max = hit.t;
    }
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(&ray, &mut crossings);
    scratch.counters.boundary_rays += 1;
    let mut passed = Transmittance::CLEAR;
    let mut regions = std::borrow::Cow::Borrowed(regions);
    let mut t_start = 0.0;
    for i in 0..=crossings.len() {
        let t_end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        if !regions.media().is_empty() && t_end > t_start {
            let stretch = [t_start, t_end];
            let media = regions.media();
            let counters = &mut scratch.counters;
            if !gather_stretch(world, &ray, media, medium, stretch, stream, &mut passed, counters, &mut add) {
                break;
            }
        }
        if let Some(crossing) = crossings.get(i) {
            let fits = world.cross(regions.to_mut(), crossing.shape, crossing.instance, crossing.entering);
            scratch.counters.region_overflows += u64::from(!fits);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
}

/// One stretch between boundaries; false once nothing passes.
#[expect(clippy::too_many_arguments, reason = "it is the inner loop of the one above")]
fn gather_stretch(
    world: &World,
    ray: &Ray,
    media: &[MediumId],
    emitter: MediumId,
    stretch: [f32; 2],
    stream: &mut Stream,
    passed: &mut Transmittance,
    counters: &mut Counters,
    add: &mut impl FnMut(&Transmittance, Rgb),
) -> bool {
    let Ray { origin, direction, t_max, .. } = *ray;
    let glows = if media.contains(&emitter) { &[emitter][..] } else { &[] };
    let (mut walks, mut flights) = (PointWalks::new(), Flights::new());
    let mut points = EmissionPoints::new(&mut walks, &world.media, glows, ray, stretch, || stream.next_f32());
    let mut tracker = Tracker::new(&mut flights, &world.media, media, origin, direction, stretch, stream);
    loop {
        let collision = tracker.next(stream);
        while let Some(point) = points.next_before(tracker.distance()) {
            counters.emission_points += 1;
            let emission = world.medium(emitter).point(origin + direction * point.t, ray.time).emission;
            if !emission.is_black() {
                add(passed, emission * (1.0 / point.rate));
            }
        }
        // Behind the last point of the last stretch there is nothing to come.
        let Some(collision) = collision.filter(|_| !points.is_empty() || stretch[1] < t_max) else { break };
        counters.transmittance_steps += 1;
        let extinction = world.medium(collision.medium).extinction(origin + direction * collision.t, ray.time);
        if !passed.pass(extinction.map(|mu| (1.0 - mu / collision.majorant).max(0.0)), stream) {
            return false;
        }
    }
    true
}

/// Where a ray has surely left a box, infinite without a box; `None` where it never meets it.
fn end_of(bounds: Option<(Vec3, Vec3)>, ray: &Ray) -> Option<f32> {
    let Some(bounds) = bounds else { return Some(ray.t_max) };
    within(ray, bounds).map(|[_, leave]| leave)
}

/// With which pdfs the media's lights would have drawn the direction of a flight: worked out when first asked for, once for each medium.
pub(super) struct FlightPdfs<'a> {
    world: &'a World,
    /// The vertex that the flight starts from, if lights were sampled there and media are among them.
    from: Option<Vec3>,
    direction: Vec3,
    links: Option<LinkSet>,
    known: ArrayVec<(MediumId, f32), 8>,
}

impl<'a> FlightPdfs<'a> {
    /// For the flight along `ray`; `links` are those of the vertex `sampled_from`.
    #[inline]
    pub fn new(world: &'a World, ray: &Ray, sampled_from: Option<Vec3>, links: Option<LinkSet>) -> Self {
        let from = sampled_from.filter(|_| world.lights.volume_count() > 0);
        Self { world, from, direction: ray.direction, links, known: ArrayVec::new() }
    }

    /// The weight of emission that the flight gathers where its own is `weight`: shared with next-event estimation where the medium is a
    /// light that could have been drawn.
    #[inline]
    pub fn weight(&mut self, weight: &PathWeight, medium: Option<MediumId>, scratch: &LightScratch) -> Rgb {
        match (self.from, medium) {
            (Some(from), Some(medium)) if !fault::is(Fault::FireTwice) => {
                weight.with_light(self.pdf(from, medium, scratch))
            }
            _ => weight.alone(),
        }
    }

    fn pdf(&mut self, from: Vec3, medium: MediumId, scratch: &LightScratch) -> f32 {
        if let Some((_, pdf)) = self.known.iter().find(|(known, _)| *known == medium) {
            return *pdf;
        }
        let lights = &self.world.lights;
        // Emission of media is not linked: who cannot draw its light finds it alone.
        let is_drawn = |id: &_| self.links.is_none_or(|links| lights.is_linked(links, *id));
        let pdf = lights.of_medium(medium).filter(is_drawn).map_or(0.0, |id| {
            self.world.light_choice.pmf(lights, id, scratch) * lights.volume_pdf(id, from, self.direction)
        });
        // Where there is no room left, it is worked out again.
        let _ = self.known.try_push((medium, pdf));
        pdf
    }
}
