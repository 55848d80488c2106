//! The scene as its file states it. Transforms are composed (a file states them by composing), nothing else is derived.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DMat4;

use super::locate::locate;
use super::name::Name;
use super::params::{Param, ParamSet, ParamValue};
use super::source::Span;
use crate::math::transform::Animated;

/// A directive's type word and parameters: `"perspective" "float fov" 40`.
#[derive(Clone, Debug)]
pub struct Entity {
    /// The type word; empty for none.
    pub kind: Name,
    /// Its parameters.
    pub params: ParamSet,
}

impl Entity {
    /// Where the directive stands.
    pub fn span(&self) -> Span {
        self.params.span
    }
}

/// The material that a shape names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialIndex(pub u32);

/// The names of the media on the two sides of a surface; empty means vacuum.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct MediumInterface {
    /// On the side that the normal points away from.
    pub inside: String,
    /// On the side that the normal points to.
    pub outside: String,
}

/// A `Shape` directive with the graphics state it stood in.
#[derive(Clone, Debug)]
pub struct ShapeEntity {
    /// Type and parameters.
    pub entity: Entity,
    /// Object to world (inside an object definition: object to instance space).
    pub transform: Arc<Animated>,
    /// `ReverseOrientation` in force.
    pub reverse_orientation: bool,
    /// Into [`SceneDescription::materials`].
    pub material: MaterialIndex,
    /// Into [`SceneDescription::area_lights`].
    pub area_light: Option<u32>,
    /// The `MediumInterface` in force, if any was set.
    pub medium_interface: Option<Arc<MediumInterface>>,
}

/// A `LightSource` directive.
#[derive(Clone, Debug)]
pub struct LightEntity {
    /// Type and parameters.
    pub entity: Entity,
    /// Light to world.
    pub transform: Arc<Animated>,
    /// The outside medium in force; empty for vacuum.
    pub medium: Name,
}

/// A medium declared by `MakeNamedMedium`.
#[derive(Clone, Debug)]
pub struct MediumEntity {
    /// The name.
    pub name: String,
    /// `"string type"` and parameters.
    pub entity: Entity,
    /// Medium to world.
    pub transform: Animated,
}

/// A texture declared by `Texture`.
#[derive(Clone, Debug)]
pub struct TextureEntity {
    /// The name.
    pub name: String,
    /// Whether it yields spectra (`spectrum`) or floats (`float`).
    pub is_spectrum: bool,
    /// Class (`imagemap` …) and parameters.
    pub entity: Entity,
    /// Texture to world.
    pub transform: Animated,
}

/// A material: from `MakeNamedMaterial` (with its name) or `Material` (without).
#[derive(Clone, Debug)]
pub struct MaterialEntity {
    /// The name, for named ones.
    pub name: Option<String>,
    /// Type and parameters.
    pub entity: Entity,
}

/// The parameters that name files which are not read with the text.
pub const FILES: [&str; 4] = ["filename", "ies", "lensfile", "normalmap"];

/// The parameters of shapes and media that link lights.
pub const LINKS: [&str; 3] = ["lights", "excludelights", "addlights"];

/// An `ObjectBegin … ObjectEnd` definition.
#[derive(Clone, Debug)]
pub struct ObjectEntity {
    /// The name.
    pub name: String,
    /// Where it begins.
    pub span: Span,
    /// Its shapes.
    pub shapes: Vec<ShapeEntity>,
    /// Instances of objects defined before it, which it holds (pbrt-v4 has no such thing).
    pub instances: Vec<InstanceEntity>,
    /// What `Attribute "shape"` says of links to lights where it begins.
    pub links: Option<Arc<ParamSet>>,
}

/// An `ObjectInstance` directive.
#[derive(Clone, Debug)]
pub struct InstanceEntity {
    /// Into [`SceneDescription::objects`].
    pub object: u32,
    /// Instance to world.
    pub transform: Arc<Animated>,
    /// What `Attribute "shape"` says of links to lights here.
    pub links: Option<Arc<ParamSet>>,
    /// Where.
    pub span: Span,
}

/// A `CoordinateSystem` directive.
#[derive(Clone, Debug)]
pub struct SystemEntity {
    /// The name.
    pub name: Name,
    /// Where.
    pub span: Span,
    /// Whether a `CoordSysTransform` returns to it.
    pub is_used: bool,
}

/// A whole scene as stated.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// The folder that relative file names are looked up in (that of the file that names them: see [`SceneDescription::resolve`]).
    pub base: PathBuf,
    /// Camera, with the world-to-camera transform in force.
    pub camera: Entity,
    /// World to camera.
    pub camera_transform: Animated,
    /// The medium around the camera: the outside medium in force at `Camera`; empty for vacuum.
    pub camera_medium: String,
    /// `Film`.
    pub film: Entity,
    /// The name of the colour space in force at `Film`.
    pub film_color_space: &'static str,
    /// `PixelFilter`.
    pub filter: Entity,
    /// `Sampler`.
    pub sampler: Entity,
    /// `Integrator`.
    pub integrator: Entity,
    /// `Option` directives, as parameters of one list.
    pub options: ParamSet,
    /// The times (start, end) of the animated transforms' keys (`TransformTimes`).
    pub transform_times: [f64; 2],
    /// Shapes outside object definitions.
    pub shapes: Vec<ShapeEntity>,
    /// Object definitions.
    pub objects: Vec<ObjectEntity>,
    /// Instances of them.
    pub instances: Vec<InstanceEntity>,
    /// Lights other than area lights.
    pub lights: Vec<LightEntity>,
    /// `AreaLightSource` directives in force at some shape.
    pub area_lights: Vec<Entity>,
    /// Materials.
    pub materials: Vec<MaterialEntity>,
    /// Named media.
    pub media: Vec<MediumEntity>,
    /// Textures, in the order declared.
    pub textures: Vec<TextureEntity>,
    /// Coordinate systems, in the order declared.
    pub systems: Vec<SystemEntity>,
}

impl SceneDescription {
    /// The path of a file that a parameter names: absolute, or beside the scene file; backslashes will do as slashes.
    pub fn resolve(&self, name: &str) -> PathBuf {
        locate(&self.base, name)
    }

    /// The meshes, images, volumes, lenses and photometric files that parameters name, whether or not anything uses them. Spectrum files, which are read
    /// with the text, are not among them.
    pub fn named_files(&self) -> impl Iterator<Item = PathBuf> {
        self.files_of(&FILES)
    }

    /// The mesh, image, volume, lens or photometric file that a parameter names, if it is one that names a file.
    pub fn file_of(&self, param: &Param) -> Option<PathBuf> {
        match &param.value {
            ParamValue::String(names) if FILES.contains(&param.name.as_str()) => {
                names.first().map(|name| self.resolve(name))
            }
            _ => None,
        }
    }

    /// The files that parameters of these names, which are among [`FILES`], name.
    pub fn files_of(&self, parameters: &'static [&str]) -> impl Iterator<Item = PathBuf> {
        let shapes = self.shapes.iter().chain(self.objects.iter().flat_map(|object| &object.shapes));
        let entities = shapes
            .map(|shape| &shape.entity)
            .chain(self.lights.iter().map(|light| &light.entity))
            .chain(&self.area_lights)
            .chain(self.materials.iter().map(|material| &material.entity))
            .chain(self.textures.iter().map(|texture| &texture.entity))
            .chain(self.media.iter().map(|medium| &medium.entity))
            .chain([&self.camera]);
        let is_wanted = |param: &&Param| parameters.contains(&param.name.as_str());
        entities.flat_map(|entity| entity.params.iter()).filter(is_wanted).filter_map(|param| self.file_of(param))
    }

    /// The position of the camera in world space at the interval's start.
    pub fn camera_position(&self) -> glam::DVec3 {
        let camera_to_world: DMat4 = self.camera_transform.start.inverse();
        camera_to_world.w_axis.truncate()
    }
}
