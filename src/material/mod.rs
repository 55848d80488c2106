//! Materials: textures evaluated at a point give a [`Bsdf`], which is evaluated and sampled.
//!
//! One file an idea: `bsdf.rs` is the interface, `diffuse.rs`, `conductor.rs`, `dielectric.rs` and `layered.rs` the kinds of
//! scattering (in the local frame), `microfacet.rs` and `fresnel.rs` what they are made of, `texture.rs`,
//! `texture_mapping.rs`, `image_texture.rs`, `procedural.rs` the inputs, `opacity.rs` alpha masks, `build.rs`, `build_texture.rs` and
//! `build_procedural.rs` the way from a scene file.

pub mod bsdf;
pub mod build;
mod build_procedural;
pub mod build_texture;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod fresnel;
pub mod image_texture;
pub mod layered;
pub mod local;
pub mod microfacet;
pub mod opacity;
pub mod procedural;
pub mod texture;
pub mod texture_mapping;

#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};

pub use bsdf::{Bsdf, BsdfSample, Lobe};

use crate::geometry::SurfacePoint;
use crate::math::phase::HenyeyGreenstein;
use crate::math::{Frame, ONE_MINUS_EPSILON, Rgb};
use conductor::Conductor;
use dielectric::Dielectric;
use diffuse::Diffuse;
use layered::CoatedDiffuse;
use microfacet::TrowbridgeReitz;
use texture::{FloatInput, RgbInput, Textures};

/// A material, by its place in [`Materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a texture may depend on.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint {
    /// Position in render space.
    pub p: Vec3,
    /// Unit geometric normal, of either sign.
    pub n: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
}

/// All materials and textures of a scene.
#[derive(Debug, Default)]
pub struct Materials {
    list: Vec<Material>,
    /// Whether light passes through each.
    transmissive: Vec<bool>,
    textures: Textures,
    alphas: Vec<Alpha>,
    loader: build_texture::Loader,
}

/// The opacity of some shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Alpha {
    input: FloatInput,
    /// Whether it asks where in space it is.
    is_spatial: bool,
}

/// A material with its inputs.
#[derive(Clone, Copy, Debug)]
enum Material {
    Diffuse { reflectance: RgbInput },
    Conductor { metal: Metal, roughness: Roughness },
    Dielectric { eta: FloatInput, roughness: Roughness },
    CoatedDiffuse(Coat),
    Mix { materials: [MaterialId; 2], amount: FloatInput },
    Interface,
}

/// How a metal is described.
#[derive(Clone, Copy, Debug)]
enum Metal {
    Index { eta: RgbInput, k: RgbInput },
    Reflectance(RgbInput),
}

/// Roughness along and across the tangent.
#[derive(Clone, Copy, Debug)]
struct Roughness {
    u: FloatInput,
    v: FloatInput,
    /// Whether α is the square root of the input.
    remap: bool,
}

#[derive(Clone, Copy, Debug)]
struct Coat {
    reflectance: RgbInput,
    roughness: Roughness,
    thickness: FloatInput,
    eta: FloatInput,
    g: FloatInput,
    albedo: RgbInput,
    max_depth: u32,
    samples: u32,
}

impl Roughness {
    #[inline]
    fn distribution(&self, textures: &Textures, point: &TexturePoint) -> TrowbridgeReitz {
        let alpha = |input: &FloatInput| {
            let roughness = input.evaluate(textures, point).max(0.0);
            if self.remap { TrowbridgeReitz::roughness_to_alpha(roughness) } else { roughness }
        };
        TrowbridgeReitz::new(alpha(&self.u), alpha(&self.v))
    }
}

impl Materials {
    /// The scattering at `point`. `u` in [0, 1) chooses among mixed materials; `wo` points away from the surface; `seed` starts the
    /// random walks of layered materials.
    pub fn bsdf(&self, material: MaterialId, point: &SurfacePoint, _wo: Vec3, u: f32, seed: u32) -> Bsdf {
        let at = TexturePoint { p: point.p, n: point.ng, uv: point.uv };
        let frame = Frame::from_zx(point.ns, point.dpdu);
        let textures = &self.textures;
        let lobe = match self.resolve_mix(material, &at, u) {
            Material::Diffuse { reflectance } => {
                Lobe::Diffuse(Diffuse { reflectance: reflectance.evaluate(textures, &at).clamp(0.0, 1.0) })
            }
            Material::Conductor { metal, roughness } => {
                let (eta, k) = match metal {
                    Metal::Index { eta, k } => (eta.evaluate(textures, &at), k.evaluate(textures, &at)),
                    Metal::Reflectance(r) => (Rgb::WHITE, fresnel::k_from_reflectance(r.evaluate(textures, &at))),
                };
                Lobe::Conductor(Conductor { distribution: roughness.distribution(textures, &at), eta, k })
            }
            Material::Dielectric { eta, roughness } => {
                let distribution = roughness.distribution(textures, &at);
                Lobe::Dielectric(Dielectric { distribution, eta: valid_eta(eta.evaluate(textures, &at)) })
            }
            Material::CoatedDiffuse(coat) => Lobe::CoatedDiffuse(CoatedDiffuse {
                top: Dielectric {
                    distribution: coat.roughness.distribution(textures, &at),
                    eta: valid_eta(coat.eta.evaluate(textures, &at)),
                },
                base: Diffuse { reflectance: coat.reflectance.evaluate(textures, &at).clamp(0.0, 1.0) },
                thickness: coat.thickness.evaluate(textures, &at),
                albedo: coat.albedo.evaluate(textures, &at).clamp(0.0, 1.0),
                phase: HenyeyGreenstein::new(coat.g.evaluate(textures, &at)),
                max_depth: coat.max_depth,
                samples: coat.samples,
                seed,
            }),
            Material::Interface | Material::Mix { .. } => Lobe::Passthrough,
        };
        Bsdf::new(frame, lobe)
    }

    /// Follows mixes down to a material that is none: the second is taken with probability `amount`. Building has made sure
    /// that mixes do not contain themselves.
    fn resolve_mix(&self, material: MaterialId, at: &TexturePoint, mut u: f32) -> Material {
        let mut material = self.list[material.0 as usize];
        while let Material::Mix { materials, amount } = material {
            let amount = amount.evaluate(&self.textures, at).clamp(0.0, 1.0);
            let next = if u < amount {
                u /= amount;
                materials[1]
            } else {
                u = (u - amount) / (1.0 - amount);
                materials[0]
            };
            u = u.min(ONE_MINUS_EPSILON);
            material = self.list[next.0 as usize];
        }
        material
    }

    /// Whether `material` is an `interface`: a boundary between media that light does not notice.
    pub fn is_interface(&self, material: MaterialId) -> bool {
        matches!(self.list[material.0 as usize], Material::Interface)
    }

    /// Whether surfaces of `material` surely reflect and transmit nothing.
    pub fn is_black(&self, material: MaterialId) -> bool {
        let material = self.list[material.0 as usize];
        matches!(material, Material::Diffuse { reflectance: RgbInput::Constant(colour) } if colour.is_black())
    }

    /// Whether [`Materials::bsdf`] looks at its `u` for this material.
    #[inline]
    pub fn is_mix(&self, material: MaterialId) -> bool {
        matches!(self.list[material.0 as usize], Material::Mix { .. })
    }

    /// Whether light can pass through surfaces of `material`, so that the media behind them can be seen.
    pub fn is_transmissive(&self, material: MaterialId) -> bool {
        self.transmissive[material.0 as usize]
    }

    /// How many materials there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// How many textures something refers to, constants not counted.
    pub fn textures_in_use(&self) -> usize {
        self.textures.len()
    }

    /// How many image files are held in memory.
    pub fn images_in_use(&self) -> usize {
        self.loader.images().count()
    }

    /// How many `alpha` masks shapes refer to.
    pub fn alphas_in_use(&self) -> usize {
        self.alphas.len()
    }

    /// Bytes held: tables and images.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.list)
            + size_of_val(&*self.alphas)
            + self.textures.memory()
            + self.loader.images().map(|image| size_of_val(&*image.pixels)).sum::<usize>()
    }
}

/// An index of refraction of 0 means none was given for that place: no boundary (pbrt-v4).
#[inline]
fn valid_eta(eta: f32) -> f32 {
    if eta > 0.0 && eta.is_finite() { eta } else { 1.0 }
}
