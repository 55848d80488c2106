//! The kinds of material with their inputs, and the scattering that each comes to at a point.

use super::base::Base;
use super::conductor::Conductor;
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::diffuse_transmission::DiffuseTransmission;
use super::fresnel;
use super::hair::{Hair, colour};
use super::layered::Coated;
use super::microfacet::TrowbridgeReitz;
use super::subsurface;
use super::texture::{FloatInput, RgbInput, Textures};
use super::thin_dielectric::ThinDielectric;
use super::{Lobe, MaterialId, TexturePoint};
use crate::math::Rgb;
use crate::math::phase::HenyeyGreenstein;

/// A material with its inputs.
#[derive(Clone, Copy, Debug)]
pub(super) enum Material {
    Diffuse { reflectance: RgbInput },
    DiffuseTransmission { reflectance: RgbInput, transmittance: RgbInput, scale: f32 },
    Conductor { metal: Metal, roughness: Roughness },
    Dielectric { eta: FloatInput, roughness: Roughness },
    ThinDielectric { eta: FloatInput },
    CoatedDiffuse { coat: Coat, reflectance: RgbInput },
    CoatedConductor { coat: Coat, metal: Metal, roughness: Roughness },
    Subsurface { coat: Coat, matter: Matter },
    Hair(Fibre),
    Mix { materials: [MaterialId; 2], amount: FloatInput },
    Interface,
}

/// How a metal is described.
#[derive(Clone, Copy, Debug)]
pub(super) enum Metal {
    Index { eta: RgbInput, k: RgbInput },
    Reflectance(RgbInput),
}

/// Roughness along and across the tangent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roughness {
    pub u: FloatInput,
    pub v: FloatInput,
    /// Whether α is the square root of the input.
    pub remap: bool,
}

/// A dielectric layer over something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    pub roughness: Roughness,
    pub thickness: FloatInput,
    pub eta: FloatInput,
    pub g: FloatInput,
    pub albedo: RgbInput,
    pub max_depth: u32,
    pub samples: u32,
}

/// What light is scattered by below a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Matter {
    /// By coefficients; `g` is the mean cosine.
    Coefficients { sigma_a: RgbInput, sigma_s: RgbInput, g: FloatInput },
    /// By what comes out again of the light that goes in.
    Reflectance(RgbInput),
}

/// A hair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fibre {
    pub colour: HairColour,
    pub eta: FloatInput,
    pub beta_m: FloatInput,
    pub beta_n: FloatInput,
    pub alpha: FloatInput,
}

/// How the colour of hair is described.
#[derive(Clone, Copy, Debug)]
pub(super) enum HairColour {
    Absorption(RgbInput),
    Reflectance(RgbInput),
    Pigments { eumelanin: FloatInput, pheomelanin: FloatInput },
}

impl Material {
    /// The scattering at `at`. `seed` starts the random walks of layered materials. Mixes have been resolved.
    #[inline]
    pub fn lobe(&self, textures: &Textures, at: &TexturePoint, seed: u32) -> Lobe {
        let albedo = |input: &RgbInput| input.evaluate(textures, at).clamp(0.0, 1.0);
        match self {
            Self::Diffuse { reflectance } => Lobe::Diffuse(Diffuse { reflectance: albedo(reflectance) }),
            Self::DiffuseTransmission { reflectance, transmittance, scale } => {
                let scaled = |input: &RgbInput| (input.evaluate(textures, at) * *scale).clamp(0.0, 1.0);
                Lobe::DiffuseTransmission(DiffuseTransmission {
                    reflectance: scaled(reflectance),
                    transmittance: scaled(transmittance),
                })
            }
            Self::Conductor { metal, roughness } => {
                let (eta, k) = metal.index(textures, at);
                Lobe::Conductor(Conductor { distribution: roughness.distribution(textures, at), eta, k })
            }
            Self::Dielectric { eta, roughness } => {
                let distribution = roughness.distribution(textures, at);
                Lobe::Dielectric(Dielectric { distribution, eta: valid_eta(eta.evaluate(textures, at)) })
            }
            Self::ThinDielectric { eta } => {
                Lobe::ThinDielectric(ThinDielectric { eta: valid_eta(eta.evaluate(textures, at)) })
            }
            Self::CoatedDiffuse { coat, reflectance } => {
                let base = Diffuse { reflectance: albedo(reflectance) };
                Lobe::CoatedDiffuse(coat.over(base, textures, at, seed))
            }
            Self::CoatedConductor { coat, metal, roughness } => {
                // Relative to the coat, as in pbrt-v4.
                let outside = valid_eta(coat.eta.evaluate(textures, at));
                let (eta, k) = metal.index(textures, at);
                let distribution = roughness.distribution(textures, at);
                let base = Conductor { distribution, eta: eta / outside, k: k / outside };
                Lobe::CoatedConductor(coat.over(base, textures, at, seed))
            }
            Self::Subsurface { coat, matter } => {
                let reflectance = match matter {
                    Matter::Coefficients { sigma_a, sigma_s, g } => {
                        let [a, s] = [sigma_a, sigma_s].map(|input| input.evaluate(textures, at));
                        subsurface::half_space_albedo(a, s, g.evaluate(textures, at))
                    }
                    Matter::Reflectance(input) => {
                        let eta = valid_eta(coat.eta.evaluate(textures, at));
                        subsurface::albedo_under_boundary(albedo(input), eta)
                    }
                };
                Lobe::CoatedDiffuse(coat.over(Diffuse { reflectance }, textures, at, seed))
            }
            Self::Hair(fibre) => Lobe::Hair(fibre.hair(textures, at)),
            Self::Interface | Self::Mix { .. } => Lobe::Passthrough,
        }
    }

    /// Whether light can pass through, so that the media behind can be seen. Fibres are too thin to hold any.
    pub fn is_transmissive(&self) -> bool {
        match self {
            Self::Interface
            | Self::Dielectric { .. }
            | Self::ThinDielectric { .. }
            | Self::DiffuseTransmission { .. } => true,
            Self::Diffuse { .. }
            | Self::Conductor { .. }
            | Self::CoatedDiffuse { .. }
            | Self::CoatedConductor { .. }
            | Self::Subsurface { .. }
            | Self::Hair(_)
            | Self::Mix { .. } => false,
        }
    }
}

impl Metal {
    /// η and k.
    #[inline]
    fn index(&self, textures: &Textures, at: &TexturePoint) -> (Rgb, Rgb) {
        match self {
            Self::Index { eta, k } => (eta.evaluate(textures, at), k.evaluate(textures, at)),
            Self::Reflectance(r) => (Rgb::WHITE, fresnel::k_from_reflectance(r.evaluate(textures, at))),
        }
    }
}

impl Roughness {
    #[inline]
    fn distribution(&self, textures: &Textures, at: &TexturePoint) -> TrowbridgeReitz {
        let alpha = |input: &FloatInput| {
            let roughness = input.evaluate(textures, at).max(0.0);
            if self.remap { TrowbridgeReitz::roughness_to_alpha(roughness) } else { roughness }
        };
        TrowbridgeReitz::new(alpha(&self.u), alpha(&self.v))
    }
}

impl Coat {
    #[inline]
    fn over<B: Base>(&self, base: B, textures: &Textures, at: &TexturePoint, seed: u32) -> Coated<B> {
        Coated {
            top: Dielectric {
                distribution: self.roughness.distribution(textures, at),
                eta: valid_eta(self.eta.evaluate(textures, at)),
            },
            base,
            thickness: self.thickness.evaluate(textures, at),
            albedo: self.albedo.evaluate(textures, at).clamp(0.0, 1.0),
            phase: HenyeyGreenstein::new(self.g.evaluate(textures, at)),
            max_depth: self.max_depth,
            samples: self.samples,
            seed,
        }
    }
}

impl Fibre {
    fn hair(&self, textures: &Textures, at: &TexturePoint) -> Hair {
        let float = |input: &FloatInput| input.evaluate(textures, at);
        let beta_n = float(&self.beta_n);
        let sigma_a = match &self.colour {
            HairColour::Absorption(sigma_a) => sigma_a.evaluate(textures, at).map(|s| s.max(0.0)),
            HairColour::Reflectance(colour) => colour::from_reflectance(colour.evaluate(textures, at), beta_n),
            HairColour::Pigments { eumelanin, pheomelanin } => {
                colour::from_pigments(float(eumelanin), float(pheomelanin))
            }
        };
        // On curves v runs from 0 to 1 across the width, towards −ω_o × x (see `geometry/curve.rs`). On other shapes it is what it is.
        let v = at.uv.y;
        let v = if (0.0..=1.0).contains(&v) { v } else { v - v.floor() };
        let h = if v.is_finite() { 1.0 - 2.0 * v } else { 0.0 };
        Hair::new(h, valid_eta(float(&self.eta)), sigma_a, float(&self.beta_m), beta_n, float(&self.alpha))
    }
}

/// An index of refraction of 0 means none was given for that place: no boundary (pbrt-v4).
#[inline]
fn valid_eta(eta: f32) -> f32 {
    if eta > 0.0 && eta.is_finite() { eta } else { 1.0 }
}
