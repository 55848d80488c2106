//! The graphics state: what directives set and later shapes, lights and textures take over. `AttributeBegin` saves it.

use std::rc::Rc;
use std::sync::Arc;

use glam::{DMat4, DVec3};

use crate::math::spectrum::RgbColorSpace;
use crate::math::transform::Animated;
use crate::scene::{MediumInterface, Param, ParamSet};

/// The two current transformation matrices (at start and end of the interval) and which of them directives change.
#[derive(Clone, Debug)]
pub struct Ctm {
    keys: [DMat4; 2],
    active: [bool; 2],
    /// The keys, once something asked for them.
    shared: Option<Arc<Animated>>,
}

impl Default for Ctm {
    fn default() -> Self {
        Self { keys: [DMat4::IDENTITY; 2], active: [true; 2], shared: None }
    }
}

impl Ctm {
    /// Both keys: in memory once for all that stands between two changes.
    pub fn animated(&mut self) -> Arc<Animated> {
        let [start, end] = self.keys;
        self.shared.get_or_insert_with(|| Arc::new(Animated { start, end })).clone()
    }

    /// Sets which keys directives change.
    pub fn activate(&mut self, start: bool, end: bool) {
        self.active = [start, end];
    }

    /// Multiplies the active keys by `matrix` from the right; `false` if a number overflows.
    pub fn concat(&mut self, matrix: DMat4) -> bool {
        self.change(|key| key * matrix)
    }

    /// Replaces the active keys.
    pub fn set(&mut self, matrix: DMat4) -> bool {
        self.change(|_| matrix)
    }

    /// Replaces both keys.
    pub fn restore(&mut self, saved: &Animated) {
        self.keys = [saved.start, saved.end];
        self.shared = None;
    }

    fn change(&mut self, f: impl Fn(DMat4) -> DMat4) -> bool {
        let mut finite = true;
        self.shared = None;
        for (key, active) in self.keys.iter_mut().zip(self.active) {
            if active {
                *key = f(*key);
                finite &= key.is_finite();
            }
        }
        finite
    }
}

/// `LookAt`: world to camera, with the camera at `eye` looking along +z to `target`, y towards `up`, left-handed as
/// pbrt has it; `None` if the directions are degenerate.
pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let forward = (target - eye).try_normalize()?;
    let up = up.try_normalize()?;
    let right = up.cross(forward);
    // Up within 1e-10 of the direction of view says nothing about where up is.
    let right = if right.length() < 1e-10 { return None } else { right.normalize() };
    let up = forward.cross(right);
    let camera_to_world = DMat4::from_cols(right.extend(0.0), up.extend(0.0), forward.extend(0.0), eye.extend(1.0));
    Some(camera_to_world.inverse()).filter(DMat4::is_finite)
}

/// The material in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurrentMaterial {
    /// Into the description's materials.
    Index(u32),
    /// A name that may be declared later: into the builder's list of names.
    Named(u32),
}

/// What `Attribute` sets defaults for.
pub const ATTRIBUTE_TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];

/// Everything that `AttributeBegin` saves.
#[derive(Clone, Debug)]
pub struct GraphicsState {
    /// The transforms.
    pub ctm: Ctm,
    /// `ReverseOrientation`.
    pub reverse_orientation: bool,
    /// `Material` or `NamedMaterial`.
    pub material: CurrentMaterial,
    /// `AreaLightSource`: into the builder's list.
    pub area_light: Option<u32>,
    /// `MediumInterface`, once set.
    pub medium_interface: Option<Arc<MediumInterface>>,
    /// `ColorSpace`.
    pub color_space: &'static RgbColorSpace,
    /// `Attribute`'s parameters, in the order of [`ATTRIBUTE_TARGETS`].
    pub defaults: [Rc<Vec<Arc<Param>>>; 5],
    /// Those for shapes that link lights, if there are any.
    pub links: Option<Arc<ParamSet>>,
}

impl Default for GraphicsState {
    fn default() -> Self {
        Self {
            ctm: Ctm::default(),
            reverse_orientation: false,
            material: CurrentMaterial::Index(0),
            area_light: None,
            medium_interface: None,
            color_space: RgbColorSpace::srgb(),
            defaults: Default::default(),
            links: None,
        }
    }
}
