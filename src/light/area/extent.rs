//! How large an emitter is, where it is, and which way it faces, in render space.

use glam::{Affine3A, Vec3};

use super::{EmitterBounds, normal_to_render};
use crate::geometry::sampling::{
    area_scale, patch_area_vector, patch_corners, similarity_scale, triangle_area_vector, triangle_corners,
};
use crate::geometry::shape::{Cylinder, Disk, Sphere};
use crate::geometry::{MotionTransform, Shape, ShapeKind};

/// The area of `shape` (not a curve) under `to_render`. Exact but for curved patches and stretched spheres and cylinders (midpoint rule).
pub fn area(shape: &Shape, to_render: Option<&Affine3A>) -> f32 {
    let all = |to_shape: &Affine3A| to_render.map_or(*to_shape, |m| *m * *to_shape);
    let sum: f64 = match &shape.kind {
        ShapeKind::Triangles(_) | ShapeKind::Bilinear(_) => face_areas(shape, to_render).sum(),
        ShapeKind::Sphere(sphere) => f64::from(sphere_area(sphere, &all(&sphere.to_shape))),
        ShapeKind::Cylinder(cylinder) => f64::from(cylinder_area(cylinder, &all(&cylinder.to_shape))),
        ShapeKind::Disk(disk) => {
            let to_render = all(&disk.to_shape);
            let scale = normal_to_render(&to_render, Vec3::Z).map_or(0.0, |n| area_scale(&to_render.matrix3, n));
            let squares = disk.radius * disk.radius - disk.inner_radius * disk.inner_radius;
            f64::from(0.5 * disk.phi_max * squares * scale)
        }
        ShapeKind::Curves(_) => 0.0,
    };
    sum as f32
}

/// The area of each face of a mesh under `to_render`, as [`area`] counts it; nothing of other shapes.
pub fn face_areas(shape: &Shape, to_render: Option<&Affine3A>) -> impl Iterator<Item = f64> {
    let place = move |p: Vec3| to_render.map_or(p, |m| m.transform_point3(p));
    let count = match &shape.kind {
        ShapeKind::Triangles(_) | ShapeKind::Bilinear(_) => shape.primitive_count(),
        _ => 0,
    };
    (0..count).map(move |i| match &shape.kind {
        ShapeKind::Triangles(mesh) => {
            let [p0, p1, p2] = triangle_corners(mesh, i).map(place);
            f64::from((p1 - p0).cross(p2 - p0).length()) * 0.5
        }
        ShapeKind::Bilinear(mesh) => {
            let corners = patch_corners(mesh, i).map(place);
            const STEPS: u32 = 4;
            let middle = |k: u32| (k as f32 + 0.5) / STEPS as f32;
            let element = |k| f64::from(patch_area_vector(&corners, [middle(k % STEPS), middle(k / STEPS)]).length());
            (0..STEPS * STEPS).map(element).sum::<f64>() / f64::from(STEPS * STEPS)
        }
        _ => 0.0,
    })
}

fn sphere_area(sphere: &Sphere, to_render: &Affine3A) -> f32 {
    let own = sphere.phi_max * sphere.radius * (sphere.z_max - sphere.z_min);
    if let Some(scale) = similarity_scale(&to_render.matrix3) {
        return own * scale * scale;
    }
    own * mean_scale(to_render, |u, v| {
        let z = (sphere.z_min + (sphere.z_max - sphere.z_min) * v) / sphere.radius;
        let ring = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (sphere.phi_max * u).sin_cos();
        Vec3::new(ring * cos, ring * sin, z)
    })
}

fn cylinder_area(cylinder: &Cylinder, to_render: &Affine3A) -> f32 {
    let own = cylinder.phi_max * cylinder.radius * (cylinder.z_max - cylinder.z_min);
    if let Some(scale) = similarity_scale(&to_render.matrix3) {
        return own * scale * scale;
    }
    own * mean_scale(to_render, |u, _| {
        let (sin, cos) = (cylinder.phi_max * u).sin_cos();
        Vec3::new(cos, sin, 0.0)
    })
}

/// By how much areas grow, |cof(M) n| averaged over the unit normals of parameters that are drawn evenly.
fn mean_scale(to_render: &Affine3A, normal: impl Fn(f32, f32) -> Vec3) -> f32 {
    const STEPS: u32 = 48;
    let cofactor = to_render.matrix3.inverse().transpose() * to_render.matrix3.determinant();
    let middle = |k: u32| (k as f32 + 0.5) / STEPS as f32;
    let element = |k: u32| f64::from((cofactor * normal(middle(k / STEPS), middle(k % STEPS))).length());
    ((0..STEPS * STEPS).map(element).sum::<f64>() / f64::from(STEPS * STEPS)) as f32
}

/// Bounds of `shape` wherever `transform` takes it.
pub fn bounds(shape: &Shape, transform: Option<&MotionTransform>) -> EmitterBounds {
    const STEPS: usize = 16;
    let placements: Vec<Option<Affine3A>> = match transform {
        None => vec![None],
        Some(MotionTransform::Fixed(m)) => vec![Some(*m)],
        Some(moving) => (0..=STEPS).map(|k| Some(moving.at(k as f32 / STEPS as f32))).collect(),
    };
    let mut low = Vec3::INFINITY;
    let mut high = Vec3::NEG_INFINITY;
    for placement in &placements {
        for_each_ball(shape, placement.as_ref(), &mut |p, r| (low, high) = (low.min(p - r), high.max(p + r)));
    }
    let centre = low + (high - low) * 0.5;
    let mut radius = 0.0f32;
    for placement in &placements {
        for_each_ball(shape, placement.as_ref(), &mut |p, r| radius = radius.max(p.distance(centre) + r));
    }
    let (axis, cos_normals) = match placements.as_slice() {
        [placement] => normals(shape, placement.as_ref()),
        // What turns may face anywhere.
        _ => (Vec3::Z, -1.0),
    };
    // Between the key times a turning emitter may swing a little beyond its sampled places.
    let slack = if placements.len() > 1 { 1.02 } else { 1.000_01 };
    EmitterBounds { centre, radius: radius * slack, axis, cos_normals }
}

/// Balls in render space (centre and radius) whose convex hull holds the shape.
fn for_each_ball(shape: &Shape, to_render: Option<&Affine3A>, visit: &mut dyn FnMut(Vec3, f32)) {
    let place = |p: Vec3| to_render.map_or(p, |m| m.transform_point3(p));
    match &shape.kind {
        ShapeKind::Triangles(mesh) => {
            mesh.indices.iter().flatten().for_each(|&i| visit(place(mesh.positions[i as usize]), 0.0));
        }
        ShapeKind::Bilinear(mesh) => {
            mesh.indices.iter().flatten().for_each(|&i| visit(place(mesh.positions[i as usize]), 0.0));
        }
        ShapeKind::Sphere(Sphere { radius, to_shape, .. }) => {
            let m = to_render.map_or(*to_shape, |m| *m * *to_shape);
            // The Frobenius norm bounds how far any unit vector is stretched.
            let columns = m.matrix3.x_axis.length_squared()
                + m.matrix3.y_axis.length_squared()
                + m.matrix3.z_axis.length_squared();
            let stretch = similarity_scale(&m.matrix3).unwrap_or_else(|| columns.sqrt());
            visit(m.translation.into(), radius * stretch);
        }
        ShapeKind::Disk(Disk { radius, height, to_shape, .. }) => {
            for_each_corner(*radius, *height, &mut |corner| visit(place(to_shape.transform_point3(corner)), 0.0));
        }
        ShapeKind::Cylinder(Cylinder { radius, z_min, z_max, to_shape, .. }) => {
            for z in [z_min, z_max] {
                for_each_corner(*radius, *z, &mut |corner| visit(place(to_shape.transform_point3(corner)), 0.0));
            }
        }
        ShapeKind::Curves(curves) => curves.control_points.iter().flatten().for_each(|&p| visit(place(p), 0.0)),
    }
}

/// The corners of a polygon around a circle about the z axis.
fn for_each_corner(radius: f32, z: f32, visit: &mut dyn FnMut(Vec3)) {
    const CORNERS: u32 = 16;
    let circumscribed = radius / (std::f32::consts::PI / CORNERS as f32).cos();
    for k in 0..CORNERS {
        let phi = std::f32::consts::TAU * k as f32 / CORNERS as f32;
        visit(Vec3::new(circumscribed * phi.cos(), circumscribed * phi.sin(), z));
    }
}

/// The unit normals under the cone (axis, cosine), in render space.
fn normals(shape: &Shape, to_render: Option<&Affine3A>) -> (Vec3, f32) {
    let everywhere = (Vec3::Z, -1.0);
    let place = |n: Vec3| match to_render {
        None => n.try_normalize(),
        Some(m) => normal_to_render(m, n),
    };
    let mut sum = Vec3::ZERO;
    if for_each_normal(shape, &mut |n| sum += n).is_none() {
        return everywhere;
    }
    let Some(axis) = place(sum) else { return everywhere };
    let mut cos = 1.0f32;
    let bounded = for_each_normal(shape, &mut |n| {
        if let Some(n) = place(n) {
            cos = cos.min(n.dot(axis));
        }
    });
    match bounded {
        None => everywhere,
        Some(()) if cos > 1.0 - 1e-6 => (axis, 1.0),
        Some(()) => (axis, (cos - 1e-4).max(-1.0)),
    }
}

/// Normals, weighted by area, whose convex cone holds all of the shape's; `None` where no such thing is known.
fn for_each_normal(shape: &Shape, visit: &mut dyn FnMut(Vec3)) -> Option<()> {
    let sign = if shape.flip_normal { -1.0 } else { 1.0 };
    match &shape.kind {
        ShapeKind::Triangles(_) | ShapeKind::Bilinear(_) => {
            for i in 0..shape.primitive_count() {
                for_each_primitive_normal(shape, i, visit)?;
            }
        }
        ShapeKind::Disk(disk) => {
            visit(disk.normal() * sign);
        }
        ShapeKind::Sphere(_) | ShapeKind::Cylinder(_) | ShapeKind::Curves(_) => return None,
    }
    Some(())
}

/// As [`for_each_normal`], for one primitive of a mesh.
fn for_each_primitive_normal(shape: &Shape, primitive: u32, visit: &mut dyn FnMut(Vec3)) -> Option<()> {
    let sign = if shape.flip_normal { -1.0 } else { 1.0 };
    match &shape.kind {
        ShapeKind::Triangles(mesh) => {
            let n = triangle_area_vector(mesh, primitive);
            let indices = mesh.indices[primitive as usize];
            visit(n * oriented(n, indices.iter().map(|&v| mesh.normals.get(v as usize)), sign)?);
        }
        ShapeKind::Bilinear(mesh) => {
            let corners = patch_corners(mesh, primitive);
            let indices = mesh.indices[primitive as usize];
            // The area vector is bilinear in (u, v), so the corners' ones span it.
            for uv in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                let n = patch_area_vector(&corners, uv);
                visit(n * oriented(n, indices.iter().map(|&v| mesh.normals.get(v as usize)), sign)?);
            }
        }
        _ => return None,
    }
    Some(())
}

/// The unit normals of one primitive of a mesh, in the shape's space, under a cone (axis, cosine); `None` where it is not known.
pub fn primitive_normals(shape: &Shape, primitive: u32) -> Option<(Vec3, f32)> {
    let mut sum = Vec3::ZERO;
    for_each_primitive_normal(shape, primitive, &mut |n| sum += n)?;
    let axis = sum.try_normalize()?;
    let mut cos = 1.0f32;
    for_each_primitive_normal(shape, primitive, &mut |n| {
        cos = n.try_normalize().map_or(cos, |n| cos.min(n.dot(axis)));
    })?;
    Some((axis, if cos > 1.0 - 1e-6 { 1.0 } else { (cos - 1e-4).max(-1.0) }))
}

/// The sign that shading normals give `n`, `default` where there are none; `None` where they disagree.
fn oriented<'a>(n: Vec3, normals: impl Iterator<Item = Option<&'a Vec3>>, default: f32) -> Option<f32> {
    let mut sign = None;
    for normal in normals {
        let Some(normal) = normal else { return Some(default) };
        let this = if n.dot(*normal) < 0.0 { -1.0 } else { 1.0 };
        if *sign.get_or_insert(this) != this {
            return None;
        }
    }
    sign
}
