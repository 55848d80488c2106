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
//! A file for each part: [`layout`] is what cache points know along a ray, [`beams`] where it crosses narrow ones, [`density`] the sum of both,
//! [`equi_angular`] a rival to compare with; [`points`] draws from it, [`alternatives`] is what other mixes of the techniques would have found, and
//! [`seeds`] are places for cache points. Rays that share a layout differ a little, which is why any density that is 0 somewhere is allowed.

pub mod alternatives;
mod beams;
mod density;
pub mod equi_angular;
mod layout;
mod points;
mod seeds;
mod stretches;

use glam::Vec3;

use super::flight::PathWeight;
use crate::math::Rgb;
use alternatives::{Alternatives, Mix, OwnVertex};
use density::RayDensity;
use layout::LaidOut;
pub(super) use points::{gather, medium_share};

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
    /// What media on its camera ray emit, whether it is scattered or not.
    pub glow: Rgb,
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
            glow: Rgb::BLACK,
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
