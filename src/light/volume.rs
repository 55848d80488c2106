//! A medium that emits, as a light: fire, glowing smoke. Source: Villemin & Hery, "Practical Illumination from Flames", JCGT 2013; Li et al.,
//! DigiPro 2024, section 4.3.
//!
//! Its directions come from a coarse grid of the medium's energy ([`EnergyGrid`]); what arrives from there is gathered along the whole line
//! up to the first surface, by whoever has drawn the direction ([`LightEnd::Volume`]).

use std::sync::Arc;

use glam::Vec3;

use super::tree::LightBounds;
use super::tree::node::Node;
use super::{LightEnd, LightSample, Receiver};
use crate::math::Rgb;
use crate::medium::MediumId;
use crate::medium::grid::energy::EnergyGrid;

/// A medium that emits.
#[derive(Clone, Debug)]
pub struct VolumeLight {
    /// Which.
    pub medium: MediumId,
    energy: Arc<EnergyGrid>,
    bounds: LightBounds,
    /// The same bounds as the light tree has them.
    node: Node,
}

impl VolumeLight {
    /// The light of `medium`, which emits as `energy` says.
    pub fn new(medium: MediumId, energy: Arc<EnergyGrid>) -> Self {
        let (low, high) = energy.bounds();
        let bounds = LightBounds {
            low,
            high,
            radius: (0.5 * (high - low)).length() * (1.0 + 1e-6),
            ..LightBounds::of_point(0.5 * low + 0.5 * high, energy.intensity().luminance())
        };
        Self { medium, energy, bounds, node: Node::new(&bounds, true, 0) }
    }

    /// A direction from `p`. Its radiance is an estimate.
    #[inline]
    pub fn sample(&self, p: Vec3, u: [f32; 2], u_part: f64) -> Option<LightSample> {
        let wi = self.energy.sample(p, u, u_part)?;
        let line = self.energy.along(p, wi);
        // A direction that rounding has led past all energy.
        let is_met = line.pdf > 0.0;
        let end = LightEnd::Volume(self.medium);
        is_met.then_some(LightSample { wi, end, radiance: line.radiance, pdf: line.pdf, is_delta: false })
    }

    /// The solid-angle pdf with which [`VolumeLight::sample`] from `p` draws the unit direction `wi`.
    #[inline]
    pub fn pdf(&self, p: Vec3, wi: Vec3) -> f32 {
        self.energy.along(p, wi).pdf
    }

    /// What arrives at `receiver`: as much as from a ball of its size that emits alike in all directions. Within the ball every
    /// direction counts.
    #[inline]
    pub fn contribution(&self, receiver: &Receiver) -> f32 {
        self.node.importance(receiver)
    }

    /// Where it is and how strong.
    pub fn bounds(&self) -> LightBounds {
        self.bounds
    }

    /// Φ = 4π I.
    pub fn power(&self) -> Rgb {
        self.energy.intensity() * (4.0 * std::f32::consts::PI)
    }

    /// Whether it emits nothing.
    pub fn is_dark(&self) -> bool {
        !(self.energy.intensity().luminance() > 0.0)
    }
}
