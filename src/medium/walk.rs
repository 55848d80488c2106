//! Moving along a ray by a depth: the integral of a rate that is constant stretch by stretch. Tentative collisions lie at exponential depths of
//! μ̄ (Woodcock et al. 1965), points that gather emission at even ones of a rate of their own.

use super::MajorantIter;
use crate::system::fault::{self, Fault};

/// A place on a ray, and how to go on from there.
pub(crate) struct Walk<'m> {
    segments: MajorantIter<'m>,
    /// Distances are summed in f64: far from the ray's origin the steps of a dense medium are below the last place of an f32.
    t: f64,
    t_end: f64,
    rate: f32,
}

impl<'m> Walk<'m> {
    /// Stands at `t_start`, where `segments` begin.
    #[inline(always)]
    pub fn new(segments: MajorantIter<'m>, t_start: f32) -> Self {
        let t = f64::from(t_start);
        Self { segments, t, t_end: t, rate: 0.0 }
    }

    /// Where it stands.
    #[inline]
    pub fn t(&self) -> f64 {
        self.t
    }

    /// The rate there.
    #[inline]
    pub fn rate(&self) -> f32 {
        self.rate
    }

    /// Lowers the rate up to the end of the stretch.
    #[inline]
    pub fn set_rate(&mut self, rate: f32) {
        self.rate = rate;
    }

    /// Moves on by `depth`; false when the ray ends before.
    #[inline(always)]
    pub fn advance(&mut self, mut depth: f64) -> bool {
        loop {
            let rate = f64::from(self.rate);
            // Empty space may reach to infinity: 0 · ∞ must count as no depth.
            let whole = if rate > 0.0 { rate * (self.t_end - self.t) } else { 0.0 };
            if depth < whole {
                self.t = (self.t + depth / rate).min(self.t_end);
                return true;
            }
            depth -= whole;
            let Some(segment) = self.segments.next() else { return false };
            self.t = self.t_end;
            self.t_end = f64::from(segment.t_end);
            self.rate = if fault::is(Fault::LowMajorant) { 0.75 * segment.majorant } else { segment.majorant };
        }
    }

    /// As [`Walk::advance`], but no further than `limit`: takes from `depth` what it moved on by, and shows `piece` the rate and length of every
    /// piece of the way where the rate is above 0. True where `depth` was reached.
    #[inline]
    pub fn advance_within(&mut self, depth: &mut f64, limit: f64, mut piece: impl FnMut(f32, f64)) -> bool {
        loop {
            let rate = f64::from(self.rate);
            let end = self.t_end.min(limit);
            if rate > 0.0 && end > self.t {
                let whole = rate * (end - self.t);
                if *depth < whole {
                    let t = (self.t + *depth / rate).min(end);
                    piece(self.rate, t - self.t);
                    self.t = t;
                    return true;
                }
                *depth -= whole;
                piece(self.rate, end - self.t);
            }
            self.t = self.t.max(end);
            if self.t_end > limit {
                return false;
            }
            let Some(segment) = self.segments.next() else { return false };
            self.t = self.t_end;
            self.t_end = f64::from(segment.t_end);
            self.rate = segment.majorant;
        }
    }
}
