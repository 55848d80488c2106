//! From `Shape` directives to [`Shape`]s: parameters checked, transforms applied in f64 before anything is rounded to f32.
//! Source: pbrt-v4's file format for names, defaults and conventions.

mod curves;
pub mod displacement;
mod loop_subdivision;
mod meshes;
mod quadrics;
#[cfg(test)]
mod tests;

use std::cell::Cell;
use std::path::PathBuf;

use glam::{DAffine3, DVec3, Vec3};

use self::displacement::Displacement;
use super::{Shape, ShapeKind};
use crate::scene::{ParamSet, SceneError, SceneErrorKind, ShapeEntity, Warnings};

/// What a shape is bound to: numbers in other rooms' tables, copied into the [`Shape`].
#[derive(Clone, Copy, Debug, Default)]
pub struct ShapeBindings {
    /// See [`Shape::material`].
    pub material: u32,
    /// See [`Shape::light`].
    pub light: Option<u32>,
    /// See [`Shape::medium_interface`].
    pub medium_interface: Option<u32>,
    /// See [`Shape::alpha`].
    pub alpha: Option<u32>,
    /// See [`Shape::is_boundary`].
    pub is_boundary: bool,
    /// See [`Shape::links`].
    pub links: u32,
}

/// A shape and what is known of it only here.
#[derive(Debug)]
pub struct Built {
    /// The shape.
    pub shape: Shape,
    /// How many faces it was stated with, where that is not the number of its primitives.
    pub stated_faces: Option<u32>,
}

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Coordinates beyond this overflow areas in f32.
pub const MAX_COORDINATE: f32 = 1e18;

/// Builds the shapes that a directive states: usually one; none for kinds not known (with a warning that names them) and for
/// empty meshes; two for a PLY file with triangles and quads.
///
/// `to_space` maps object space to render space or to the prototype's; `base` resolves file names. The parameters `alpha` and, of meshes,
/// `displacement` are the caller's to read ([`ShapeBindings::alpha`], [`Displacement`]). Shapes that pbrt-v4 goes on without are left out
/// with a warning: indices out of range, numbers of points that make no curve, surfaces that are none.
///
/// # Errors
/// Parameters of wrong types, values that are not finite or too large, transforms that flatten a quadric, files that cannot be read, meshes too
/// fine for memory.
pub fn build_shape(
    entity: &ShapeEntity,
    to_space: &DAffine3,
    base: &dyn Fn(&str) -> PathBuf,
    bindings: ShapeBindings,
    displacement: Option<&Displacement>,
    warnings: &mut Warnings,
) -> Result<Vec<Built>> {
    let params = &entity.entity.params;
    let reverse = entity.reverse_orientation;
    let placement = Placement { affine: *to_space, reverse, displacement, stated_faces: Cell::default() };
    if !to_space.is_finite() {
        return Err(placement.error(params, "its transformation is not finite"));
    }
    // The caller turns it into a texture; here it only counts as used.
    params.get("alpha");
    let built = match entity.entity.kind.as_str() {
        "trianglemesh" => meshes::triangle_mesh(params, &placement, warnings),
        "plymesh" => meshes::ply_mesh(params, &placement, base, warnings),
        "loopsubdiv" => meshes::loop_subdivision(params, &placement, warnings),
        "bilinearmesh" => meshes::bilinear_mesh(params, &placement, warnings),
        "sphere" => quadrics::sphere(params, &placement).map(|kind| vec![kind]),
        "disk" => quadrics::disk(params, &placement).map(|kind| vec![kind]),
        "cylinder" => quadrics::cylinder(params, &placement).map(|kind| vec![kind]),
        "curve" => curves::curve(params, &placement, warnings).map(|kind| vec![kind]),
        other => {
            warnings.add(Some(params.span), format!("shapes of type \"{other}\" are not supported; it is left out"));
            return Ok(Vec::new());
        }
    };
    let kinds = match built {
        Err(error) if matches!(error.kind, SceneErrorKind::Shape(_)) => {
            // As in pbrt-v4, which goes on without it.
            warnings.add_fault(error.span.unwrap_or(params.span), error.to_string(), "the shape is left out");
            return Ok(Vec::new());
        }
        built => built?,
    };
    params.warn_unused(warnings);
    let shape = |kind| Shape {
        material: bindings.material,
        light: bindings.light,
        medium_interface: bindings.medium_interface,
        alpha: bindings.alpha,
        is_boundary: bindings.is_boundary,
        links: bindings.links,
        flip_normal: entity.reverse_orientation != placement.swaps_handedness(),
        kind,
    };
    let shapes: Vec<Shape> = kinds.into_iter().map(shape).collect();
    for shape in shapes.iter().filter(|shape| !matches!(shape.kind, ShapeKind::Triangles(_) | ShapeKind::Bilinear(_))) {
        // The vertices of meshes were looked at one by one.
        let beyond = |(low, high): (Vec3, Vec3)| !(low.abs().max(high.abs()).max_element() <= MAX_COORDINATE);
        if (0..shape.primitive_count()).any(|primitive| beyond(shape.bounds(primitive))) {
            return Err(placement.error(params, format!("it reaches beyond {MAX_COORDINATE:e} units")));
        }
    }
    let stated = placement.stated_faces.get();
    let stated_faces = |shape: &Shape| stated.filter(|_| matches!(shape.kind, ShapeKind::Triangles(_)));
    Ok(shapes.into_iter().map(|shape| Built { stated_faces: stated_faces(&shape), shape }).collect())
}

/// Where a shape goes.
struct Placement<'a> {
    affine: DAffine3,
    reverse: bool,
    /// What moves the points of meshes before.
    displacement: Option<&'a Displacement<'a>>,
    /// [`Built::stated_faces`] of the triangles.
    stated_faces: Cell<Option<u32>>,
}

impl Placement<'_> {
    fn swaps_handedness(&self) -> bool {
        self.affine.matrix3.determinant() < 0.0
    }

    /// Whether the transform can be undone, with something to spare for f32.
    fn is_invertible(&self) -> bool {
        let m = self.affine.matrix3;
        let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        m.determinant().abs() > 1e-12 * volume && m.inverse().is_finite()
    }

    fn error(&self, params: &ParamSet, what: impl std::fmt::Display) -> Box<SceneError> {
        SceneError::at(params.span, SceneErrorKind::Parameter(format!("{}: {what}", params.owner)))
    }

    /// The error of a shape that the scene goes on without.
    fn unusable(&self, params: &ParamSet, what: impl std::fmt::Display) -> Box<SceneError> {
        SceneError::at(params.span, SceneErrorKind::Shape(format!("{}: {what}", params.owner)))
    }

    /// Points into the shape's space, rounded last.
    fn points(&self, params: &ParamSet, name: &str, points: &[[f32; 3]]) -> Result<Vec<Vec3>> {
        let placed = |(i, p): (usize, &[f32; 3])| self.point(params, name, i, Vec3::from_array(*p).as_dvec3());
        points.iter().enumerate().map(placed).collect()
    }

    /// One point, which is number `i` of `name`.
    fn point(&self, params: &ParamSet, name: &str, i: usize, p: DVec3) -> Result<Vec3> {
        let q = self.affine.transform_point3(p).as_vec3();
        if !q.is_finite() {
            Err(self.error(params, format!("\"{name}\" number {i} is not finite: {} {} {}", p.x, p.y, p.z)))
        } else if q.abs().max_element() > MAX_COORDINATE {
            Err(self.error(params, format!("\"{name}\" number {i} is beyond {MAX_COORDINATE:e} units")))
        } else {
            Ok(q)
        }
    }

    /// Normals into the shape's space by the inverse transpose, their lengths kept in proportion: they weigh interpolation.
    fn normals(&self, params: &ParamSet, normals: &[[f32; 3]], turn: bool) -> Result<Vec<Vec3>> {
        if normals.is_empty() {
            return Ok(Vec::new());
        }
        if !self.is_invertible() {
            return Err(self.error(params, "its transformation flattens it, so its normals have no meaning"));
        }
        let transform = self.affine.matrix3.inverse().transpose() * if turn { -1.0 } else { 1.0 };
        normals
            .iter()
            .enumerate()
            .map(|(i, n)| {
                let n = (transform * Vec3::from_array(*n).as_dvec3()).as_vec3();
                if n.is_finite() { Ok(n) } else { Err(self.error(params, format!("\"N\" number {i} is not finite"))) }
            })
            .collect()
    }
}

/// One form in a list.
type Kinds = Vec<ShapeKind>;
