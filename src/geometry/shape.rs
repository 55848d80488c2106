//! Shapes as the renderer stores them. Each kind's intersection, sampling and derivatives are in the file of its name.

use glam::{Affine3A, Vec3};

use crate::math::transform::Decomposed;

pub use super::bilinear::BilinearMesh;
pub use super::curve::Curves;
pub use super::cylinder::Cylinder;
pub use super::disk::Disk;
pub use super::sphere::Sphere;
pub use super::triangle::TriangleMesh;

/// A shape, by its place in [`super::Geometry::shapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeId(pub u32);

/// An instance, by its place in [`super::Geometry::instances`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InstanceId(pub u32);

/// A shape's form and what it is bound to. The numbers refer to the tables of other rooms, which geometry never opens.
#[derive(Debug)]
pub struct Shape {
    /// The form, in render space or in its prototype's space.
    pub kind: ShapeKind,
    /// Into the material table.
    pub material: u32,
    /// Into the light table, where the shape emits.
    pub light: Option<u32>,
    /// Into the table of medium interfaces, where the media on its sides differ.
    pub medium_interface: Option<u32>,
    /// Into the texture table (or a constant there), where it has an `alpha`.
    pub alpha: Option<u32>,
    /// Whether the material is `interface`: a medium boundary that blocks nothing.
    pub is_boundary: bool,
    /// Into the table of links to lights; 0 where it states none.
    pub links: u32,
    /// Flip the normal: ReverseOrientation xor the transform swaps handedness, as pbrt-v4 has it where rays meet a shape. So a mirrored
    /// sphere is inside out unless its orientation is reversed too, and exporters write scenes that count on it. (pbrt-v4 samples
    /// light on mirrored quadrics by ReverseOrientation alone, against its own hits; here one rule serves both.)
    pub flip_normal: bool,
}

impl Shape {
    /// Whether the surface has holes that [`super::trace::Opacity`] must be asked about.
    #[inline]
    pub const fn has_opacity(&self) -> bool {
        self.alpha.is_some()
    }

    /// How many primitives it is made of.
    pub fn primitive_count(&self) -> u32 {
        match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.indices.len() as u32,
            ShapeKind::Bilinear(mesh) => mesh.indices.len() as u32,
            ShapeKind::Curves(curves) => curves.control_points.len() as u32,
            ShapeKind::Sphere(_) | ShapeKind::Disk(_) | ShapeKind::Cylinder(_) => 1,
        }
    }

    /// The box of one primitive in the shape's space.
    pub fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.bounds(primitive),
            ShapeKind::Bilinear(mesh) => mesh.bounds(primitive),
            ShapeKind::Curves(curves) => curves.bounds(primitive),
            ShapeKind::Sphere(sphere) => sphere.bounds(),
            ShapeKind::Disk(disk) => disk.bounds(),
            ShapeKind::Cylinder(cylinder) => cylinder.bounds(),
        }
    }

    /// The nearest hit of one primitive with `t_min` < t < `t_max`, ray and t in the shape's space; `direction` of any length
    /// but zero.
    pub fn intersect(
        &self,
        primitive: u32,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, [f32; 2])> {
        match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.intersect(primitive, origin, direction, t_min, t_max),
            ShapeKind::Bilinear(mesh) => mesh.intersect(primitive, origin, direction, t_min, t_max),
            ShapeKind::Curves(curves) => curves.intersect(primitive, origin, direction, t_min, t_max),
            ShapeKind::Sphere(sphere) => sphere.intersect(origin, direction, t_min, t_max),
            ShapeKind::Disk(disk) => disk.intersect(origin, direction, t_min, t_max),
            ShapeKind::Cylinder(cylinder) => cylinder.intersect(origin, direction, t_min, t_max),
        }
    }
}

/// The forms.
#[derive(Debug)]
pub enum ShapeKind {
    /// Indexed triangles.
    Triangles(TriangleMesh),
    /// Bilinear patches.
    Bilinear(BilinearMesh),
    /// A sphere, perhaps partial.
    Sphere(Sphere),
    /// A disk, perhaps annular or partial.
    Disk(Disk),
    /// A cylinder without caps, perhaps partial.
    Cylinder(Cylinder),
    /// Bézier curves: hair and fur.
    Curves(Curves),
}

/// An object definition: shapes in one space.
#[derive(Debug, Default)]
pub struct Prototype {
    /// Its shapes.
    pub shapes: Vec<ShapeId>,
}

/// One appearance of a prototype.
#[derive(Debug)]
pub struct Instance {
    /// Into [`super::Geometry::prototypes`].
    pub prototype: u32,
    /// Prototype to render space.
    pub transform: MotionTransform,
}

/// A transform over the animation interval.
#[derive(Clone, Debug)]
pub enum MotionTransform {
    /// Does not move.
    Fixed(Affine3A),
    /// Interpolated between two decomposed keys (`math::transform`).
    Moving {
        /// At time 0.
        start: Box<Decomposed>,
        /// At time 1.
        end: Box<Decomposed>,
    },
}

/// A point sampled on a shape by area, for lights.
#[derive(Clone, Copy, Debug)]
pub struct AreaSample {
    /// Position in the shape's space.
    pub p: Vec3,
    /// Bound of the rounding error in `p`.
    pub p_error: Vec3,
    /// Unit oriented geometric normal.
    pub ng: Vec3,
    /// Texture coordinates.
    pub uv: glam::Vec2,
    /// Probability per unit area.
    pub pdf_area: f32,
}
