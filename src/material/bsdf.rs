//! Bidirectional scattering distribution functions, in the frame of a surface point.
//!
//! Directions are in render space, unit length and point away from the surface. f is given without the cosine. As in
//! pbrt-v4, what is reflection and what is transmission is decided in the shading frame.

use glam::Vec3;

use super::conductor::Conductor;
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::diffuse_transmission::DiffuseTransmission;
use super::fresnel;
use super::hair::Hair;
use super::layered::Coated;
use super::local::{LocalSample, Sides, Transport};
use super::thin_dielectric::ThinDielectric;
use crate::math::{Frame, Rgb};

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction.
    pub wi: Vec3,
    /// f(wo, wi); for specular lobes, f·|cos θ_i|/pdf = `f`·|cos θ_i|/`pdf` still holds with `pdf` the discrete probability.
    pub f: Rgb,
    /// Solid-angle pdf, or the discrete probability of a specular lobe.
    pub pdf: f32,
    /// A Dirac lobe: next-event estimation cannot see it.
    pub is_specular: bool,
    /// The direction goes to the other side.
    pub is_transmission: bool,
    /// Relative index of refraction along the path (η_t/η_i) for refraction, else 1: Russian roulette undoes its radiance scaling.
    pub eta: f32,
    /// `f` and `pdf` are proportional estimates (layered materials): for MIS, ask [`Bsdf::pdf`] instead.
    pub pdf_is_proportional: bool,
}

/// The scattering at one point.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    frame: Frame,
    lobe: Lobe,
}

/// The kinds of scattering; directions in the local frame.
#[derive(Clone, Copy, Debug)]
pub enum Lobe {
    /// No surface at all: light passes straight through.
    Passthrough,
    /// Lambert.
    Diffuse(Diffuse),
    /// Metal.
    Conductor(Conductor),
    /// Glass.
    Dielectric(Dielectric),
    /// Glass over Lambert.
    CoatedDiffuse(Coated<Diffuse>),
    /// Glass over metal.
    CoatedConductor(Coated<Conductor>),
    /// A pane.
    ThinDielectric(ThinDielectric),
    /// Lambert on both sides.
    DiffuseTransmission(DiffuseTransmission),
    /// A fibre along the local x axis.
    Hair(Hair),
}

impl Bsdf {
    /// The scattering `lobe` around the shading normal `frame.z`.
    #[inline]
    pub fn new(frame: Frame, lobe: Lobe) -> Self {
        Self { frame, lobe }
    }

    /// f(wo, wi), without the cosine; zero for specular lobes.
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (wo, wi) = (self.frame.to_local(wo), self.frame.to_local(wi));
        if wo.z == 0.0 {
            return Rgb::BLACK;
        }
        match &self.lobe {
            Lobe::Passthrough => Rgb::BLACK,
            Lobe::Diffuse(lobe) => lobe.evaluate(wo, wi),
            Lobe::Conductor(lobe) => lobe.evaluate(wo, wi),
            Lobe::Dielectric(lobe) => lobe.evaluate(wo, wi, Transport::Radiance),
            Lobe::CoatedDiffuse(lobe) => lobe.evaluate(wo, wi),
            Lobe::CoatedConductor(lobe) => lobe.evaluate(wo, wi),
            Lobe::ThinDielectric(_) => Rgb::BLACK,
            Lobe::DiffuseTransmission(lobe) => lobe.evaluate(wo, wi),
            Lobe::Hair(lobe) => lobe.evaluate(wo, wi),
        }
    }

    /// The solid-angle pdf with which [`Bsdf::sample`] finds `wi`; zero for specular lobes. For layered materials an unbiased
    /// estimate of a density near to it, independent of what [`Bsdf::evaluate`] and [`Bsdf::sample`] draw.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (wo, wi) = (self.frame.to_local(wo), self.frame.to_local(wi));
        if wo.z == 0.0 {
            return 0.0;
        }
        match &self.lobe {
            Lobe::Passthrough => 0.0,
            Lobe::Diffuse(lobe) => lobe.pdf(wo, wi),
            Lobe::Conductor(lobe) => lobe.pdf(wo, wi),
            Lobe::Dielectric(lobe) => lobe.pdf(wo, wi, Sides::Both),
            Lobe::CoatedDiffuse(lobe) => lobe.pdf(wo, wi),
            Lobe::CoatedConductor(lobe) => lobe.pdf(wo, wi),
            Lobe::ThinDielectric(_) => 0.0,
            Lobe::DiffuseTransmission(lobe) => lobe.pdf(wo, wi),
            Lobe::Hair(lobe) => lobe.pdf(wo, wi),
        }
    }

    /// Samples a direction. `u[0]` chooses the lobe, `u[1..3]` the direction. `None` where the light is lost.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let wo = self.frame.to_local(wo);
        if wo.z == 0.0 {
            return None;
        }
        let (uc, u) = (u[0], [u[1], u[2]]);
        let sample = match &self.lobe {
            Lobe::Passthrough => {
                let f = Rgb::splat(1.0 / wo.z.abs());
                Some(LocalSample::specular(-wo, f, 1.0).transmitted(1.0))
            }
            Lobe::Diffuse(lobe) => lobe.sample(wo, u),
            Lobe::Conductor(lobe) => lobe.sample(wo, u),
            Lobe::Dielectric(lobe) => lobe.sample(wo, uc, u, Sides::Both, Transport::Radiance),
            Lobe::CoatedDiffuse(lobe) => lobe.sample(wo, uc, u),
            Lobe::CoatedConductor(lobe) => lobe.sample(wo, uc, u),
            Lobe::ThinDielectric(lobe) => lobe.sample(wo, uc),
            Lobe::DiffuseTransmission(lobe) => lobe.sample(wo, uc, u),
            Lobe::Hair(lobe) => lobe.sample(wo, uc, u),
        };
        let LocalSample { wi, f, pdf, is_specular, is_transmission, eta, pdf_is_proportional } =
            sample.filter(LocalSample::is_usable)?;
        let wi = self.frame.to_world(wi);
        Some(BsdfSample { wi, f, pdf, is_specular, is_transmission, eta, pdf_is_proportional })
    }

    /// Whether every lobe is Dirac, so that sampling lights is pointless.
    #[inline]
    pub fn is_specular(&self) -> bool {
        match &self.lobe {
            Lobe::Passthrough | Lobe::ThinDielectric(_) => true,
            Lobe::Diffuse(_) | Lobe::CoatedDiffuse(_) | Lobe::DiffuseTransmission(_) | Lobe::Hair(_) => false,
            Lobe::Conductor(lobe) => lobe.distribution.is_smooth(),
            Lobe::Dielectric(lobe) => lobe.is_specular(),
            Lobe::CoatedConductor(lobe) => lobe.is_specular(),
        }
    }

    /// Whether light can pass to the other side.
    #[inline]
    pub fn is_transmissive(&self) -> bool {
        match &self.lobe {
            Lobe::Passthrough
            | Lobe::Dielectric(_)
            | Lobe::ThinDielectric(_)
            | Lobe::DiffuseTransmission(_)
            | Lobe::Hair(_) => true,
            Lobe::Diffuse(_) | Lobe::Conductor(_) | Lobe::CoatedDiffuse(_) | Lobe::CoatedConductor(_) => false,
        }
    }

    /// Whether the cosine to the shading normal says nothing of how much light is received: a fibre has no sides.
    #[inline]
    pub fn is_fibre(&self) -> bool {
        matches!(self.lobe, Lobe::Hair(_))
    }

    /// The directional albedo towards `wo`, or a good guess of it, for the albedo AOV and denoisers: roughness is left out.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let wo = self.frame.to_local(wo);
        match &self.lobe {
            Lobe::Passthrough | Lobe::Dielectric(_) | Lobe::ThinDielectric(_) => Rgb::WHITE,
            Lobe::Diffuse(lobe) => lobe.reflectance,
            Lobe::Conductor(lobe) => fresnel::conductor(wo.z.abs(), lobe.eta, lobe.k),
            Lobe::CoatedDiffuse(lobe) => lobe.albedo(wo),
            Lobe::CoatedConductor(lobe) => lobe.albedo(wo),
            Lobe::DiffuseTransmission(lobe) => lobe.reflectance + lobe.transmittance,
            Lobe::Hair(lobe) => lobe.albedo(wo),
        }
    }
}
