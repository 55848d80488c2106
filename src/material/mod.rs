//! Materials: textures evaluated at a point give a [`Bsdf`], which is evaluated and sampled.
//!
//! One file an idea: `bsdf.rs` is the interface, `diffuse.rs`, `diffuse_transmission.rs`, `conductor.rs`, `dielectric.rs`,
//! `thin_dielectric.rs`, `layered.rs` (over `base.rs`) and `hair/` the kinds of scattering (in the local frame), `microfacet.rs`,
//! `fresnel.rs` and `subsurface.rs` what they are made of, `kinds.rs` the materials with their inputs, `texture.rs`,
//! `texture_mapping.rs`, `footprint.rs`, `image_texture.rs` (over `mip_map/`, with `ewa.rs`) and `procedural.rs` the inputs, `relief.rs` normal and bump maps, `displacement.rs` heights of displaced meshes, `opacity.rs` alpha masks, `build.rs`, `build_kind.rs`,
//! `build_relief.rs`, `build_texture.rs` and `build_procedural.rs` the way from a scene file.

pub mod base;
pub mod bsdf;
pub mod build;
mod build_kind;
mod build_procedural;
mod build_relief;
pub mod build_texture;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod diffuse_transmission;
mod displacement;
mod ewa;
pub mod footprint;
pub mod fresnel;
pub mod hair;
pub mod image_texture;
mod kinds;
pub mod layered;
pub mod local;
pub mod microfacet;
pub mod mip_map;
pub mod opacity;
pub mod procedural;
pub mod relief;
pub mod subsurface;
pub mod texture;
pub mod texture_mapping;
pub mod thin_dielectric;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{Vec2, Vec3};

pub use bsdf::{Bsdf, BsdfSample, Lobe};

use crate::geometry::SurfacePoint;
use crate::math::{Frame, ONE_MINUS_EPSILON};
use crate::scene::{SceneError, Warnings};
use footprint::Footprint;
use kinds::Material;
use mip_map::MipMap;
use mip_map::cache::TileCacheStatistics;
use mip_map::memory::TextureMemory;
use relief::Relief;
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
    /// What the ray that came here covers.
    pub footprint: Footprint,
}

impl TexturePoint {
    /// Where textures of a surface are looked up.
    #[inline]
    pub fn new(point: &SurfacePoint, footprint: &Footprint) -> Self {
        Self { p: point.p, n: point.ng, uv: point.uv, footprint: *footprint }
    }
}

/// All materials and textures of a scene.
#[derive(Debug)]
pub struct Materials {
    list: Vec<Material>,
    /// What is known of each, of mixes by their parts.
    traits: Vec<Traits>,
    /// The relief of each; empty where none has any.
    reliefs: Vec<Relief>,
    textures: Textures,
    alphas: Vec<Alpha>,
    loader: build_texture::Loader,
    memory: Arc<TextureMemory>,
}

/// The opacity of some shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Alpha {
    input: FloatInput,
    /// Whether it asks where in space it is.
    is_spatial: bool,
}

/// What holds for a material, or for any of those that it mixes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Traits {
    /// Light passes through.
    is_transmissive: bool,
    /// Surfaces are fibres.
    is_fibre: bool,
    /// Something of it is looked up in a texture.
    is_textured: bool,
    /// Shading normals are turned.
    has_relief: bool,
}

impl Traits {
    /// What holds for either.
    const fn or(self, other: Self) -> Self {
        Self {
            is_transmissive: self.is_transmissive || other.is_transmissive,
            is_fibre: self.is_fibre || other.is_fibre,
            is_textured: self.is_textured || other.is_textured,
            has_relief: self.has_relief || other.has_relief,
        }
    }
}

impl Materials {
    /// The scattering at `point`, whose textures are looked up as finely as `footprint` says. `u` in [0, 1) chooses among mixed materials; `seed` starts the
    /// random walks of layered materials.
    pub fn bsdf(&self, material: MaterialId, point: &SurfacePoint, footprint: &Footprint, u: f32, seed: u32) -> Bsdf {
        let at = TexturePoint::new(point, footprint);
        let frame = Frame::from_zx(point.ns, point.dpdu);
        let material = &self.list[self.resolve_mix(material, &at, u).0 as usize];
        Bsdf::new(frame, material.lobe(&self.textures, &at, seed))
    }

    /// Follows mixes down to a material that is none: the second is taken with probability `amount`. Building has made sure
    /// that mixes do not contain themselves.
    fn resolve_mix(&self, mut material: MaterialId, at: &TexturePoint, mut u: f32) -> MaterialId {
        while let Material::Mix { materials, amount } = &self.list[material.0 as usize] {
            let amount = amount.evaluate(&self.textures, at).clamp(0.0, 1.0);
            material = if u < amount {
                u /= amount;
                materials[1]
            } else {
                u = (u - amount) / (1.0 - amount);
                materials[0]
            };
            u = u.min(ONE_MINUS_EPSILON);
        }
        material
    }

    /// Whether `material` is an `interface`: a boundary between media that light does not notice.
    pub fn is_interface(&self, material: MaterialId) -> bool {
        matches!(self.list[material.0 as usize], Material::Interface)
    }

    /// Whether surfaces of `material` surely reflect and transmit nothing.
    pub fn is_black(&self, material: MaterialId) -> bool {
        match &self.list[material.0 as usize] {
            Material::Diffuse { reflectance: RgbInput::Constant(colour) } => colour.is_black(),
            _ => false,
        }
    }

    /// Whether [`Materials::bsdf`] looks at its `u` for this material.
    #[inline]
    pub fn is_mix(&self, material: MaterialId) -> bool {
        matches!(self.list[material.0 as usize], Material::Mix { .. })
    }

    /// Whether light can pass through surfaces of `material`, so that the media behind them can be seen.
    pub fn is_transmissive(&self, material: MaterialId) -> bool {
        self.traits[material.0 as usize].is_transmissive
    }

    /// Whether surfaces of `material` are fibres: they have no inside.
    pub fn is_fibre(&self, material: MaterialId) -> bool {
        self.traits[material.0 as usize].is_fibre
    }

    /// Whether anything of `material` is looked up in a texture, so that it matters what a ray covers.
    #[inline]
    pub fn is_textured(&self, material: MaterialId) -> bool {
        self.traits[material.0 as usize].is_textured
    }

    /// Whether `material` turns shading normals: if not, [`Materials::emboss`] need not be called.
    #[inline]
    pub fn has_relief(&self, material: MaterialId) -> bool {
        self.traits[material.0 as usize].has_relief
    }

    /// How many materials have a normal map or a displacement.
    pub fn reliefs_in_use(&self) -> usize {
        self.reliefs.iter().filter(|relief| !matches!(relief, Relief::None)).count()
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

    /// How many image files they refer to.
    pub fn images_in_use(&self) -> usize {
        self.loader.images().count()
    }

    /// Whether any texture has levels of detail: if not, nobody asks what rays cover.
    pub fn has_levels(&self) -> bool {
        self.loader.images().next().is_some()
    }

    /// All shapes and materials are known: reads all images, if they fit into memory, else sees to it that they are read as needed.
    ///
    /// # Errors
    /// As [`Self::report_images`].
    pub fn settle_images(&self, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
        self.memory.settle(self.loader.images(), warnings);
        self.report_images(warnings)
    }

    /// The process leaves images no more memory than `bytes` says of what was asked for. To be called before [`Self::settle_images`].
    pub fn fit_images(&self, bytes: impl FnOnce(u64) -> u64, warnings: &mut Warnings) {
        self.memory.fit(bytes(self.memory.asked()), self.loader.images(), warnings);
    }

    /// Lets tiles of images go that take so many bytes, as far as there are so many.
    pub fn shed_images(&self, bytes: u64) {
        self.memory.shed(bytes);
    }

    /// Takes down what went wrong with images since the last time.
    ///
    /// # Errors
    /// Tiles that could not be written; under `strict` images that could not be read.
    pub fn report_images(&self, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
        self.memory.report(warnings)
    }

    /// Whether rendering on is of no use since images could not be read as was asked for.
    #[inline]
    pub fn has_failed(&self) -> bool {
        self.memory.has_failed()
    }

    /// What the cache of tiles did, where images do not fit into memory.
    pub fn texture_cache(&self) -> Option<TileCacheStatistics> {
        self.memory.statistics()
    }

    /// Bytes of all images at all levels, at most.
    pub fn image_bytes(&self) -> u64 {
        self.loader.images().map(MipMap::whole).sum()
    }

    /// How many `alpha` masks shapes refer to.
    pub fn alphas_in_use(&self) -> usize {
        self.alphas.len()
    }

    /// Bytes held: tables and images.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.list)
            + size_of_val(&*self.traits)
            + size_of_val(&*self.reliefs)
            + size_of_val(&*self.alphas)
            + self.textures.memory()
            + self.loader.images().map(MipMap::resident).sum::<usize>()
            + self.texture_cache().map_or(0, |cache| cache.limit as usize)
    }
}
