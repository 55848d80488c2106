//! Null-collision tracking: tentative collisions along a ray, and the transmittance estimate built on them.
//! Source: Woodcock et al. 1965 (delta tracking); Novák, Selle, Jarosz 2014 (ratio tracking); Miller, Georgiev, Jarosz 2019
//! (null-scattering path integral), whose notation is used: μ̄ is the majorant, μ_n = μ̄ − μ_t the null coefficient.
//!
//! The majorant is one number for all channels, so every free-flight factor T̄ μ̄ cancels against its pdf exactly and never has to be
//! computed. Where several media overlap, each has its own stream of tentative collisions; the streams together are those of the
//! sum of the media (superposition of Poisson processes), so no combined majorant is ever formed.

use arrayvec::ArrayVec;
use glam::Vec3;

use super::regions::MAX_OVERLAP;
use super::walk::Walk;
use super::{Medium, MediumId};
use crate::geometry::Ray;
use crate::math::Rgb;
use crate::math::sampler::Stream;

/// A tentative collision: something may happen here.
#[derive(Clone, Copy, Debug)]
pub struct TentativeCollision {
    /// Distance along the ray.
    pub t: f32,
    /// The medium whose particle, real or null, was met.
    pub medium: MediumId,
    /// μ̄ of that medium there.
    pub majorant: f32,
}

/// The collisions of one medium along a stretch.
pub struct Flight<'m> {
    medium: MediumId,
    /// μ_t of a medium that is the same everywhere.
    constant: Option<Rgb>,
    walk: Walk<'m>,
}

impl Flight<'_> {
    /// Goes on behind a null collision. In a homogeneous medium such a collision leaves nothing in the channels whose extinction is
    /// the majorant, so the largest extinction below it bounds what is left, and takes its place. Hence such a
    /// medium has at most three collisions along a stretch, and none once the channels left are clear: a ray without end that no channel's
    /// extinction stops comes to an end.
    #[inline]
    fn proceed(&mut self, tau: f32) -> bool {
        if let Some(extinction) = self.constant {
            let majorant = self.walk.rate();
            self.walk.set_rate(extinction.map(|mu| if mu < majorant { mu } else { 0.0 }).max_channel());
        }
        self.walk.advance(f64::from(tau))
    }
}

/// Space for the flights of a tracker: several kilobytes, which stay where they are. (A tracker that owned them was moved as it was
/// returned, at a tenth of the render time of thin fog.)
pub type Flights<'m> = ArrayVec<Flight<'m>, { MAX_OVERLAP + 1 }>;

/// The tentative collisions of all media that are active along a stretch of a ray, in order of distance.
pub struct Tracker<'s, 'm> {
    flights: &'s mut Flights<'m>,
    pending: Option<usize>,
}

impl<'s, 'm> Tracker<'s, 'm> {
    /// Starts at `t_start` on the ray; no collision lies beyond `t_end`. `flights` is empty.
    #[inline(always)]
    pub fn new(
        flights: &'s mut Flights<'m>,
        media: &'m [Medium],
        active: &[MediumId],
        origin: Vec3,
        direction: Vec3,
        [t_start, t_end]: [f32; 2],
        stream: &mut Stream,
    ) -> Self {
        for &medium in active {
            let active = &media[medium.0 as usize];
            let constant = match active {
                Medium::Homogeneous(medium) => Some(medium.point.absorption + medium.point.scattering),
                Medium::Grid(_) => None,
            };
            let segments = active.majorants(origin, direction, t_start, t_end);
            let mut flight = Flight { medium, constant, walk: Walk::new(segments, t_start) };
            if flight.walk.advance(f64::from(stream.next_exponential())) {
                flights.push(flight);
            }
        }
        Self { flights, pending: None }
    }

    /// The next tentative collision, or `None` at the end of the stretch. Asking for another one means that the last was a null
    /// collision.
    #[inline(always)]
    pub fn next(&mut self, stream: &mut Stream) -> Option<TentativeCollision> {
        if let Some(last) = self.pending.take()
            && !self.flights[last].proceed(stream.next_exponential())
        {
            self.flights.swap_remove(last);
        }
        let nearest = match self.flights.len() {
            0 => return None,
            1 => 0,
            count => (1..count).fold(0, |a, b| if self.flights[b].walk.t() < self.flights[a].walk.t() { b } else { a }),
        };
        self.pending = Some(nearest);
        let flight = &self.flights[nearest];
        Some(TentativeCollision { t: flight.walk.t() as f32, medium: flight.medium, majorant: flight.walk.rate() })
    }

    /// How far the last collision is, as exactly as it is known; infinite where there was none.
    #[inline]
    pub fn distance(&self) -> f64 {
        self.pending.map_or(f64::INFINITY, |last| self.flights[last].walk.t())
    }
}

/// Below this transmittance, Russian roulette decides whether ratio tracking goes on.
const ROULETTE_BELOW: f32 = 0.05;
/// The probability of going on then.
const ROULETTE_SURVIVAL: f32 = 0.25;

/// A transmittance estimate.
#[derive(Clone, Copy, Debug)]
pub struct Transmittance {
    /// Unbiased estimate of e^-∫μ_t, per channel.
    pub value: Rgb,
    /// The probability with which delta tracking would have passed the same collisions, per channel: what MIS weighs against.
    pub pass_probability: Rgb,
}

impl Transmittance {
    /// Nothing in the way.
    pub const CLEAR: Self = Self { value: Rgb::WHITE, pass_probability: Rgb::WHITE };

    /// Ratio tracking (Novák et al. 2014): multiplies in μ_n / μ̄ at every tentative collision up to the tracker's end.
    /// Adds the number of collisions to `steps`. Returns false once nothing is left.
    #[inline]
    pub fn track(
        &mut self,
        tracker: &mut Tracker<'_, '_>,
        media: &[Medium],
        ray: &Ray,
        stream: &mut Stream,
        steps: &mut u64,
    ) -> bool {
        while let Some(collision) = tracker.next(stream) {
            *steps += 1;
            let p = ray.origin + ray.direction * collision.t;
            let extinction = media[collision.medium.0 as usize].extinction(p, ray.time);
            let ratio = extinction.map(|mu| (1.0 - mu / collision.majorant).max(0.0));
            if !self.pass(ratio, stream) {
                return false;
            }
        }
        true
    }

    /// Passes one tentative collision, which leaves `ratio` = μ_n / μ̄. Returns false once nothing is left.
    #[inline(always)]
    pub fn pass(&mut self, ratio: Rgb, stream: &mut Stream) -> bool {
        self.value *= ratio;
        self.pass_probability *= ratio;
        if self.value.is_black() {
            return false;
        }
        if self.value.max_channel() < ROULETTE_BELOW {
            if stream.next_f32() >= ROULETTE_SURVIVAL {
                self.value = Rgb::BLACK;
                return false;
            }
            self.value *= 1.0 / ROULETTE_SURVIVAL;
        }
        true
    }
}

#[cfg(test)]
mod tests;
