//! Where the emission of media given by grids is gathered along a ray: points as dense as each medium's gathering rate says
//! ([`super::grid::gathering`]), laid out systematically.
//!
//! Point k lies where the integral of the rate along the ray is k + u, one uniform u for all of them. So the expected density of points is the rate
//! r(t), and Σ_k e(t_k) / r(t_k) is an unbiased estimate of ∫ e dt, as it is with a Poisson process (the tentative collisions of Simon et al. 2017 and
//! Li et al. 2024) of the same density; but their number does not vary, nor does the sum where e follows r. (Cochran, "Sampling Techniques",
//! 1977, chapter 8: systematic sampling.) What is known of the way up to a point may be multiplied in if it does not depend on u.

use arrayvec::ArrayVec;

use super::regions::MAX_OVERLAP;
use super::walk::Walk;
use super::{Medium, MediumId};
use crate::geometry::Ray;

/// A point of a ray that gathers emission.
#[derive(Clone, Copy, Debug)]
pub struct EmissionPoint {
    /// Distance along the ray.
    pub t: f32,
    /// Whose emission.
    pub medium: MediumId,
    /// Points per unit length: emission counts divided by it.
    pub rate: f32,
}

/// The points of one medium.
pub struct PointWalk<'m> {
    medium: MediumId,
    walk: Walk<'m>,
    stride: f64,
    first_depth: f64,
}

impl<'m> PointWalk<'m> {
    /// The points between `t_start` and `t_end`, `stride` times as far apart as the rate says; `None` where `medium` has none. `u` is from 0 to 1, 1
    /// excluded, and is asked for where it glows.
    #[inline]
    pub fn new(
        media: &'m [Medium],
        medium: MediumId,
        ray: &Ray,
        [t_start, t_end]: [f32; 2],
        stride: f64,
        u: impl FnOnce() -> f32,
    ) -> Option<Self> {
        let rates = media[medium.0 as usize].gathering_rates(ray.origin, ray.direction, t_start, t_end)?;
        let mut walk = Walk::new(rates, t_start);
        let first_depth = f64::from(u()) * stride;
        walk.advance(first_depth).then_some(Self { medium, walk, stride, first_depth })
    }

    /// The point where it stands.
    #[inline]
    pub fn point(&self) -> EmissionPoint {
        EmissionPoint { t: self.walk.t() as f32, medium: self.medium, rate: self.walk.rate() / self.stride as f32 }
    }

    /// How far that is, as exactly as it is known.
    #[inline]
    pub fn t(&self) -> f64 {
        self.walk.t()
    }

    /// The rate there, whatever the stride.
    #[inline]
    pub fn rate(&self) -> f32 {
        self.walk.rate()
    }

    /// The integral of the rate up to the first point.
    #[inline]
    pub fn first_depth(&self) -> f64 {
        self.first_depth
    }

    /// Moves on to the next point; false where there is none.
    #[inline]
    pub fn proceed(&mut self) -> bool {
        self.walk.advance(self.stride)
    }
}

/// Space for the points of several media, which stays where it is, as that of trackers does.
pub type PointWalks<'m> = ArrayVec<PointWalk<'m>, { MAX_OVERLAP + 1 }>;

/// The points of several media along a stretch of a ray, in order of distance.
pub struct EmissionPoints<'s, 'm>(&'s mut PointWalks<'m>);

impl<'s, 'm> EmissionPoints<'s, 'm> {
    /// The points of those media of `active` that glow, as dense as their rates say. `walks` is empty.
    #[inline]
    pub fn new(
        walks: &'s mut PointWalks<'m>,
        media: &'m [Medium],
        active: &[MediumId],
        ray: &Ray,
        stretch: [f32; 2],
        mut u: impl FnMut() -> f32,
    ) -> Self {
        for &medium in active {
            walks.extend(PointWalk::new(media, medium, ray, stretch, 1.0, &mut u));
        }
        Self(walks)
    }

    /// Whether there are no more.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The next point, if it lies before `limit`.
    #[inline]
    pub fn next_before(&mut self, limit: f64) -> Option<EmissionPoint> {
        let nearest = (0..self.0.len()).min_by(|&a, &b| self.0[a].t().total_cmp(&self.0[b].t()))?;
        let walk = &mut self.0[nearest];
        if walk.t() >= limit {
            return None;
        }
        let point = walk.point();
        if !walk.proceed() {
            self.0.swap_remove(nearest);
        }
        Some(point)
    }
}

#[cfg(test)]
mod tests;
