//! Emission of media given by grids along a whole ray that nothing but the ray itself finds: from the camera, or from a mirror.
//!
//! Source: Simon, Hanika, Zirr, Dachsbacher, "Line Integration for Rendering Heterogeneous Emissive Volumes", EGSR 2017: the emission does not
//! stop where the path happens to scatter; all of it is gathered up to the next surface, Σ_k T(t_k) e(t_k) / r(t_k) over the points of
//! [`crate::medium::emission_points`]. T is estimated by residual ratio tracking (Novák, Selle, Jarosz 2014, section 4): what a
//! control extinction μ_c lets through is known, e^{−∫μ_c}, and every tentative collision multiplies in what is left,
//!
//! ```text
//! 1 − (μ_t − μ_c) / μ̄,
//! ```
//!
//! which is unbiased whatever μ_c is, so long as μ̄ is above 0 where they differ. Plain ratio tracking (μ_c = 0) with close bounds is hardly better than
//! flights are: where μ_t = μ̄ the first collision ends it.
//!
//! **Ours:** μ_c is what the emission points on both sides have found there anyway, their mean in between. It does not depend on the collisions, so
//! nothing is biased; it is bounded by μ̄ so that no factor is negative, and the closer the farther apart the points are
//! ([`MOST_DEPTH`]), because a gap between two points where there is nothing would be counted too bright rarely but by much.
//! Homogeneous media take off what is known exactly.
//!
//! Rays from vertices that sample lights gather emission as far as their flight comes. With such lines for them and for light samples, weighed by the pdfs of
//! their directions alone, the scene `explosion` (160 × 90 pixels, 32 samples) has 0.83 times the error² and takes 1.24 times the time, `torch` and its error
//! stay as they are.

use arrayvec::ArrayVec;

use super::counters::Counters;
use super::path::Scratch;
use super::world::World;
use crate::geometry::Ray;
use crate::math::Rgb;
use crate::math::sampler::Stream;
use crate::medium::emission_points::PointWalk;
use crate::medium::grid::GridMedium;
use crate::medium::regions::{MAX_OVERLAP, Regions};
use crate::medium::walk::Walk;
use crate::medium::{Medium, MediumId, MediumPoint};

/// Between two points μ_c² ∫dt / μ̄ goes no further: the log of the second moment of what a wholly wrong control makes of the transmittance there.
const MOST_DEPTH: f64 = 1.0;

/// Distance of points, by that of the rays and lines that others find too. Half of it takes off a sixth of the image's error² in the scene `fire`
/// and, but for the worst 0.1 % of the pixels, in `torch`, nothing in `explosion`; a path has one such line and many of the others.
const STRIDE: f64 = 0.5;

/// Below this transmittance, Russian roulette decides whether the line goes on: so late because what glows behind smoke is often much brighter than
/// what glows in front of it.
const ROULETTE_BELOW: f32 = 0.01;
/// The probability of going on then.
const ROULETTE_SURVIVAL: f32 = 0.25;

/// The radiance that grids emit towards the origin of `ray`, which starts in `regions` and ends at a surface or where nothing emits beyond. `u` is where
/// the points of the first fire lie.
pub(super) fn gather(
    world: &World,
    ray: &Ray,
    regions: &Regions,
    u: f32,
    stream: &mut Stream,
    scratch: &mut Scratch,
) -> Rgb {
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(ray, &mut crossings);
    scratch.counters.boundary_rays += 1;
    let mut line = Line { world, ray, passed: Rgb::WHITE, gathered: Rgb::BLACK, u: Some(u) };
    let mut regions = std::borrow::Cow::Borrowed(regions);
    let mut t_start = 0.0;
    for i in 0..=crossings.len() {
        let t_end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        if !regions.media().is_empty() && t_end > t_start {
            let goes_on = line.pass(regions.media(), [t_start, t_end], stream, &mut scratch.counters);
            if !goes_on {
                break;
            }
        }
        if let Some(crossing) = crossings.get(i) {
            // What does not fit is counted by the flight along the same ray.
            let _ = world.cross(regions.to_mut(), crossing.shape, crossing.instance, crossing.entering);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
    line.gathered
}

/// A line on its way.
struct Line<'w> {
    world: &'w World,
    ray: &'w Ray,
    /// Estimate of the transmittance so far.
    passed: Rgb,
    gathered: Rgb,
    /// Until it is used.
    u: Option<f32>,
}

impl Line<'_> {
    /// Through one stretch between boundaries; false once nothing more can come.
    fn pass(&mut self, media: &[MediumId], stretch: [f32; 2], stream: &mut Stream, counters: &mut Counters) -> bool {
        let Self { world, ray, .. } = *self;
        let mut grids = ArrayVec::<GridLine<'_>, { MAX_OVERLAP + 1 }>::new();
        // The homogeneous media together.
        let mut fog = Rgb::BLACK;
        for &id in media {
            match world.medium(id) {
                Medium::Homogeneous(medium) => fog += medium.point.absorption + medium.point.scattering,
                Medium::Grid(medium) => {
                    let collisions = medium.majorants(ray.origin, ray.direction, stretch[0], stretch[1]);
                    let u = || self.u.take().unwrap_or_else(|| stream.next_f32());
                    let points = PointWalk::new(&world.media, id, ray, stretch, STRIDE, u);
                    grids.push(GridLine::new(medium, collisions, stretch[0], points, stream));
                }
            }
        }
        for grid in &mut grids {
            grid.look_ahead(ray, counters);
        }
        let mut t = f64::from(stretch[0]);
        loop {
            let points = grids.iter().enumerate().filter_map(|(i, grid)| Some((i, grid.ahead.as_ref()?.t)));
            let next = points.min_by(|a, b| a.1.total_cmp(&b.1));
            if next.is_none() && stretch[1] >= ray.t_max {
                return false;
            }
            let limit = next.map_or(f64::from(stretch[1]), |(_, t)| t);
            for grid in &mut grids {
                grid.pass(ray, limit, &mut self.passed, stream, counters);
            }
            self.passed *= fog.map(|mu| (-mu * (limit - t) as f32).exp());
            if !survives(&mut self.passed, stream) {
                return false;
            }
            t = limit;
            let Some((emitter, _)) = next else { return true };
            self.gathered += self.passed * grids[emitter].emission();
            grids[emitter].look_ahead(ray, counters);
        }
    }
}

/// Unbiased Russian roulette (Arvo & Kirk 1990).
#[inline]
fn survives(passed: &mut Rgb, stream: &mut Stream) -> bool {
    if passed.max_channel() < ROULETTE_BELOW {
        let goes_on = !passed.is_black() && stream.next_f32() < ROULETTE_SURVIVAL;
        *passed *= if goes_on { 1.0 / ROULETTE_SURVIVAL } else { 0.0 };
        return goes_on;
    }
    true
}

/// A point that the line comes to next.
struct Ahead {
    t: f64,
    rate: f32,
    found: MediumPoint,
}

/// One medium along a stretch.
struct GridLine<'m> {
    medium: &'m GridMedium,
    collisions: Walk<'m>,
    /// Optical depth of the bounds to the next tentative collision.
    depth: f64,
    points: Option<PointWalk<'m>>,
    ahead: Option<Ahead>,
    /// μ_t at the last point.
    last: Rgb,
    /// μ_c up to the next point, how far it holds, and from where on.
    control: Rgb,
    span: f64,
    from: f64,
}

impl<'m> GridLine<'m> {
    fn new(
        medium: &'m GridMedium,
        collisions: crate::medium::MajorantIter<'m>,
        t_start: f32,
        points: Option<PointWalk<'m>>,
        stream: &mut Stream,
    ) -> Self {
        let (collisions, depth) = (Walk::new(collisions, t_start), f64::from(stream.next_exponential()));
        let (last, control, span, from) = (Rgb::BLACK, Rgb::BLACK, 0.0, f64::INFINITY);
        Self { medium, collisions, depth, points, ahead: None, last, control, span, from }
    }

    /// μ_a L_e over the density of points, at the point ahead.
    fn emission(&self) -> Rgb {
        self.ahead.as_ref().map_or(Rgb::BLACK, |ahead| ahead.found.emission * (1.0 / ahead.rate))
    }

    /// Sets out for the next point.
    fn look_ahead(&mut self, ray: &Ray, counters: &mut Counters) {
        let before = self.ahead.take();
        self.from = f64::INFINITY;
        let goes_on = match (&mut self.points, &before) {
            (Some(points), Some(_)) => points.proceed(),
            (points, _) => points.is_some(),
        };
        let Some(points) = self.points.as_ref().filter(|_| goes_on) else { return };
        let (point, t) = (points.point(), points.t());
        counters.emission_points += 1;
        let found = self.medium.point(ray.origin + ray.direction * point.t, ray.time);
        let here = found.absorption + found.scattering;
        // Before the first point nothing is known, but about where the glow begins.
        let from = before.map_or_else(|| t - points.first_depth() / f64::from(points.rate()), |before| before.t);
        (self.control, self.from, self.span) = ((self.last + here) * 0.5, from, t - from);
        self.last = here;
        self.ahead = Some(Ahead { t, rate: point.rate, found });
    }

    /// Up to `limit`: multiplies what passes into `passed`.
    fn pass(&mut self, ray: &Ray, limit: f64, passed: &mut Rgb, stream: &mut Stream, counters: &mut Counters) {
        if self.from > self.collisions.t() {
            self.pass_under(Rgb::BLACK, ray, self.from.min(limit), passed, stream, counters);
        }
        if self.from < limit {
            self.pass_under(self.control, ray, limit, passed, stream, counters);
        }
    }

    /// The same with one control.
    fn pass_under(
        &mut self,
        control: Rgb,
        ray: &Ray,
        limit: f64,
        passed: &mut Rgb,
        stream: &mut Stream,
        counters: &mut Counters,
    ) {
        let is_controlled = !control.is_black();
        let Self { medium, collisions, depth, span, .. } = self;
        let under = |majorant: f32| {
            let most = majorant.min((MOST_DEPTH * f64::from(majorant) / *span).sqrt() as f32);
            control.map(|mu| mu.min(most))
        };
        loop {
            let is_met = collisions.advance_within(depth, limit, |majorant, length| {
                if is_controlled {
                    *passed *= under(majorant).map(|mu| (-mu * length as f32).exp());
                }
            });
            if !is_met || passed.is_black() {
                return;
            }
            counters.transmittance_steps += 1;
            let majorant = collisions.rate();
            let extinction = medium.extinction(ray.origin + ray.direction * collisions.t() as f32, ray.time);
            // The bound may have been limited.
            let left = extinction.map(|mu| mu.min(majorant)) - if is_controlled { under(majorant) } else { Rgb::BLACK };
            *passed *= left.map(|mu| (1.0 - mu / majorant).max(0.0));
            *depth = f64::from(stream.next_exponential());
            // Here too: in a medium of great extinction there are very many collisions from one point to the next.
            if !survives(passed, stream) {
                return;
            }
        }
    }
}
