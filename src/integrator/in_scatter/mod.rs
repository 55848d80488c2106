//! In-scatter sampling: scattering points on camera rays (and on what mirrors and glass make of them), drawn where cache points expect light to be scattered towards the camera, combined
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
//! A file for each part: [`layout`] is what cache points know along a ray, [`shared`] which rays have that in common, [`beams`] where it crosses narrow ones, [`density`] the sum of both,
//! [`equi_angular`] a rival to compare with; [`points`] draws from it, [`alternatives`] is what other mixes of the techniques would have found, and
//! [`seeds`] are places for cache points. Rays that share a layout differ a little, which is why any density that is 0 somewhere is allowed.

pub mod alternatives;
mod beams;
mod density;
pub mod equi_angular;
mod layout;
mod points;
mod seeds;
mod shared;
mod stretches;

use glam::Vec3;

use super::flight::PathWeight;
use crate::math::Rgb;
use crate::system::fault::{self, Fault};
use alternatives::{Alternatives, Mix, OwnVertex};
use density::RayDensity;
pub(super) use points::{gather, medium_share};
use shared::Kept;

/// Points are drawn on so many of a path's rays: a camera ray, and what mirrors and glass make of it.
pub const MOST_RAYS: u32 = 8;

/// The number of the vertex that is drawn as number `draw` on the ray number `ray` (1 for a camera ray) of a path: path vertices do not come this far,
/// nor do the paths that go on from one come to the next.
const fn vertex_index(ray: u32, draw: u32) -> u32 {
    ((1 + draw) << 24) + ((ray - 1) << 20)
}

/// The density along one ray, and what is kept for rays that are almost the same as ones before.
#[derive(Debug, Default)]
struct Along {
    density: RayDensity,
    kept: Kept,
}

/// The densities along the rays of a pixel, and what they bring. One per thread, reused.
#[derive(Debug)]
pub struct InScatter {
    /// For camera rays, and for the rays after one mirror, after two, and so on.
    along: [Along; MOST_RAYS as usize],
    /// Points that each camera path draws: a whole number, or a probability.
    count: f32,
    /// What they do.
    mix: Mix,
    /// What the current path has found, and what it would have found by other mixes. Known where [`Mix::FULL`] is in use.
    pub alternatives: Alternatives,
    /// What the points drawn on the current path's rays brought.
    pub drawn: Rgb,
    /// That, and what the path's own vertex of first scattering did and all that came after it.
    pub scattered: Rgb,
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
            along: Default::default(),
            count: 0.0,
            mix: Mix::NULL,
            alternatives: Alternatives::default(),
            drawn: Rgb::BLACK,
            scattered: Rgb::BLACK,
            glow: Rgb::BLACK,
            work: PointWork::default(),
            seeds: vec![],
        }
    }
}

impl InScatter {
    /// Forgets the knots: rays to come have nothing in common with those before.
    pub fn forget(&mut self) {
        for Along { density, kept } in &mut self.along {
            kept.clear();
            density.shared.reach = 0.0;
        }
    }

    /// A new pixel begins, each of whose paths draws `count` points (a whole number, or a probability), of which `mix` says what they do. Its
    /// rays may share knots with pixels before.
    pub fn begin_pixel(&mut self, count: f32, mix: Mix) {
        (self.count, self.mix, self.work) = (count, mix, PointWork::default());
        self.along.iter_mut().for_each(|along| along.kept.begin_pixel());
    }

    /// A new path begins.
    pub(super) fn begin_path(&mut self) {
        (self.alternatives, self.drawn, self.scattered) = (Alternatives::default(), Rgb::BLACK, Rgb::BLACK);
    }

    /// Whether the pixel's paths draw points.
    #[inline]
    pub fn is_on(&self) -> bool {
        self.count > 0.0
    }

    /// The pdf with which a point at `t` of the path's ray number `ray` is drawn, times the number of points that are.
    #[inline]
    pub fn expected(&self, ray: u32, t: f32) -> f32 {
        self.count * self.along[ray as usize - 1].density.pdf(t)
    }

    /// Shares a vertex of first scattering, whose `weight` is that of null tracking (relative to any density), with in-scatter sampling, which comes
    /// there with density `drawn`. The weights are those of a path that began its ray with `start`; returns by what the path's weight is to be scaled in
    /// Russian roulette, relative to before.
    pub(super) fn share(&self, weight: &mut PathWeight, drawn: Rgb, start: &PathWeight) -> f32 {
        let mean = drawn.mean();
        if !(mean > 0.0 && mean.is_finite()) {
            return 1.0;
        }
        let null = weight.unidirectional;
        weight.light = if self.mix.null_lights && !fault::is(Fault::PointsAlone) { null + drawn } else { drawn };
        if !self.mix.goes_on {
            return 1.0;
        }
        weight.unidirectional = null + drawn;
        // As if the path had come there with the weight that it had.
        let relative = |weight: &PathWeight| weight.throughput.max_channel() / weight.unidirectional.mean();
        let scale = relative(start) / relative(weight);
        if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
    }

    /// The path's own vertex of first scattering, after which `rest` came.
    pub(super) fn add_own(&mut self, vertex: &OwnVertex, rest: Rgb) {
        self.scattered += vertex.light + rest;
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
pub(super) fn null_share(null: Rgb, drawn: Rgb) -> f64 {
    let null = f64::from(null.mean());
    null / (null + f64::from(drawn.mean()))
}
