//! Shapes, instances, cameras, and [`trace`]: the one interface to rays, over two backends.

pub mod affine;
pub mod bilinear;
pub mod build;
pub mod camera;
mod curvature;
pub mod curve;
pub mod cylinder;
pub mod differentials;
pub mod disk;
pub mod extent;
#[cfg(test)]
mod fixtures;
mod local;
mod motion;
mod partials;
mod quadric;
pub mod recording;
pub mod sampling;
pub mod shape;
pub mod sphere;
mod surface;
#[cfg(test)]
mod tests;
pub mod trace;
pub mod triangle;

#[cfg(feature = "embree")]
pub mod embree;
pub mod native;

use std::collections::HashMap;

use glam::{Vec2, Vec3};

pub use partials::Partials;
pub use shape::{Instance, InstanceId, MotionTransform, Prototype, Shape, ShapeId, ShapeKind};
pub use trace::{Backend, BoundaryCrossing, Ray, RayHit, Tracer};

/// Everything that rays can meet, in render space: world space moved so that the camera sits near the origin.
///
/// Shapes that neither move nor belong to an object definition are stored in render space itself (`top_level`); the rest
/// are in the space of their prototype and appear through `instances`. Instances are one level deep.
#[derive(Debug, Default)]
pub struct Geometry {
    /// All shapes.
    pub shapes: Vec<Shape>,
    /// Shapes directly in render space.
    pub top_level: Vec<ShapeId>,
    /// Object definitions (and shapes that move on their own, one each).
    pub prototypes: Vec<Prototype>,
    /// Their appearances.
    pub instances: Vec<Instance>,
    /// Of the first instances: the [`Shape::links`] that each replaces, and by what. Empty where none does.
    pub instance_links: Vec<[u32; 2]>,
    /// How many of the shapes are meshes whose points were moved by a texture.
    pub displaced: usize,
    /// Of emitting meshes that were displaced, or of which faces were cut: how many faces they were stated with.
    pub stated_faces: HashMap<ShapeId, u32>,
}

impl Geometry {
    /// [`Shape::links`] as they hold for a shape that is seen as part of `instance`.
    #[inline]
    pub fn links(&self, shape: ShapeId, instance: Option<InstanceId>) -> u32 {
        let links = self.shapes[shape.0 as usize].links;
        match instance.and_then(|instance| self.instance_links.get(instance.0 as usize)) {
            Some(&[from, to]) if links == from => to,
            _ => links,
        }
    }
}

/// A point on a surface with all that shading needs, in render space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, recomputed from the primitive (not from origin + t·direction).
    pub p: Vec3,
    /// Bound of the rounding error in `p`, per axis.
    pub p_error: Vec3,
    /// Unit geometric normal, flipped as pbrt does (ReverseOrientation, handedness, towards shading normals where given).
    pub ng: Vec3,
    /// Unit shading normal, in `ng`'s hemisphere.
    pub ns: Vec3,
    /// Partial derivative of position by u; the tangent for hair and anisotropy. May be zero where there is none.
    pub dpdu: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The shape.
    pub shape: ShapeId,
    /// The primitive within the shape.
    pub primitive: u32,
    /// The instance, where the shape belongs to a prototype.
    pub instance: Option<InstanceId>,
}
