//! Points on shapes, distributed over their area, for lights that have a surface.
//!
//! Sources: Heitz 2019 for the triangle; Pharr, Jakob, Humphreys (4th ed.) section 6.6.4 for bilinear patches (parameters drawn in
//! proportion to the bilinear interpolation of the corners' area elements). Everything happens in the shape's own space. A
//! quadric is drawn in its object space, where it is round; the area element of the map M onto a surface of unit normal n
//! being |det M| / |Mᵀn|, the densities stay exact under any affine transform. Curves cannot be sampled.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, DVec3, Mat3A, Vec2, Vec3};

use super::affine;
use super::shape::{AreaSample, BilinearMesh, Cylinder, Disk, Shape, ShapeKind, Sphere, TriangleMesh};
use crate::math::alias::AliasTable;
use crate::math::robust::gamma;
use crate::math::warp::{concentric_disk, uniform_triangle};

/// What drawing points on one shape needs beyond the shape itself. One primitive needs no table.
#[derive(Clone, Debug)]
pub struct ShapeSampler {
    /// Total weight: the area in the space where points are drawn (object space for quadrics, the shape's space for meshes; for
    /// curved patches an estimate of it, which the pdf takes into account).
    weight: f32,
    table: Option<Box<AliasTable>>,
}

/// A point drawn on a shape.
#[derive(Clone, Copy, Debug)]
pub struct ShapeSample {
    /// The point, in the shape's space.
    pub point: AreaSample,
    /// The primitive it lies on.
    pub primitive: u32,
    /// The primitive's own parameters there, as in [`super::RayHit::uv`].
    pub parameters: [f32; 2],
}

impl ShapeSampler {
    /// Prepares `kind`. `None` for curves and for shapes without area.
    pub fn new(kind: &ShapeKind) -> Option<Self> {
        let sampler = match kind {
            ShapeKind::Triangles(mesh) => Self::over_primitives(mesh.indices.len(), |i| triangle_area(mesh, i)),
            ShapeKind::Bilinear(mesh) => Self::over_primitives(mesh.indices.len(), |i| patch_weight(mesh, i)),
            ShapeKind::Sphere(s) => Self { weight: s.phi_max * s.radius * (s.z_max - s.z_min), table: None },
            ShapeKind::Disk(d) => {
                let squares = d.radius * d.radius - d.inner_radius * d.inner_radius;
                Self { weight: 0.5 * d.phi_max * squares, table: None }
            }
            ShapeKind::Cylinder(c) => Self { weight: c.phi_max * c.radius * (c.z_max - c.z_min), table: None },
            ShapeKind::Curves(_) => return None,
        };
        (sampler.weight > 0.0 && sampler.weight.is_finite()).then_some(sampler)
    }

    fn over_primitives(count: usize, area: impl Fn(u32) -> f32) -> Self {
        let areas: Vec<f32> = (0..count as u32).map(area).collect();
        let weight = areas.iter().map(|&a| f64::from(a)).sum::<f64>() as f32;
        let table = if count > 1 && weight.is_finite() { AliasTable::new(&areas).map(Box::new) } else { None };
        Self { weight, table }
    }

    /// A point on `shape` (the one this was made for). `u` places it on a primitive, which `u_part` in [0, 1) chooses. `None`
    /// where the surface has no normal.
    pub fn sample(&self, shape: &Shape, u: [f32; 2], u_part: f64) -> Option<ShapeSample> {
        let primitive = self.table.as_ref().map_or(0, |table| table.sample(u_part).0);
        self.sample_on(shape, primitive, u)
    }

    /// A point on `primitive`, however that was chosen; the density in the result is that for a choice by area.
    pub fn sample_on(&self, shape: &Shape, primitive: u32, u: [f32; 2]) -> Option<ShapeSample> {
        match &shape.kind {
            ShapeKind::Triangles(mesh) => self.sample_triangle(mesh, shape.flip_normal, primitive, u),
            ShapeKind::Bilinear(mesh) => self.sample_patch(mesh, shape.flip_normal, primitive, u),
            ShapeKind::Sphere(sphere) => {
                let (p, parameters) = sphere_point(sphere, u);
                self.quadric(&sphere.to_shape, shape.flip_normal, p, p, parameters)
            }
            ShapeKind::Disk(disk) => {
                let (p, parameters) = disk_point(disk, u);
                self.quadric(&disk.to_shape, shape.flip_normal, p, Vec3::Z, parameters)
            }
            ShapeKind::Cylinder(cylinder) => {
                let p = cylinder_point(cylinder, u);
                self.quadric(&cylinder.to_shape, shape.flip_normal, p, p.with_z(0.0), u)
            }
            ShapeKind::Curves(_) => None,
        }
    }

    /// The density per unit area of the shape's space with which [`ShapeSampler::sample`] draws the point with these `parameters` of
    /// `primitive`, where the unit normal (of either sign) is `normal`.
    pub fn pdf_area(&self, shape: &Shape, primitive: u32, parameters: [f32; 2], normal: Vec3) -> f32 {
        match &shape.kind {
            ShapeKind::Triangles(_) => 1.0 / self.weight,
            ShapeKind::Bilinear(mesh) if (primitive as usize) < mesh.indices.len() => {
                self.patch_pdf(&patch_corners(mesh, primitive), parameters)
            }
            ShapeKind::Sphere(sphere) => 1.0 / (self.weight * area_scale(&sphere.to_shape.matrix3, normal)),
            ShapeKind::Disk(disk) => 1.0 / (self.weight * area_scale(&disk.to_shape.matrix3, normal)),
            ShapeKind::Cylinder(cylinder) => 1.0 / (self.weight * area_scale(&cylinder.to_shape.matrix3, normal)),
            ShapeKind::Bilinear(_) | ShapeKind::Curves(_) => 0.0,
        }
    }

    /// The probability with which [`ShapeSampler::sample`] chooses `primitive` of a mesh; 1 for other shapes.
    #[inline]
    pub fn share_by_area(&self, shape: &Shape, primitive: u32) -> f32 {
        match &shape.kind {
            ShapeKind::Triangles(mesh) => triangle_area(mesh, primitive) / self.weight,
            ShapeKind::Bilinear(mesh) => patch_weight(mesh, primitive) / self.weight,
            _ => 1.0,
        }
    }

    /// Forgets how to choose primitives, where [`ShapeSampler::sample_on`] is all that is asked for.
    pub fn forget_choice(&mut self) {
        self.table = None;
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.table.as_ref().map_or(0, |table| size_of::<AliasTable>() + table.memory())
    }

    fn sample_triangle(&self, mesh: &TriangleMesh, flip: bool, primitive: u32, u: [f32; 2]) -> Option<ShapeSample> {
        let b = uniform_triangle(u);
        let [p0, p1, p2] = triangle_corners(mesh, primitive);
        let (w0, w1, w2) = (b[0] * p0, b[1] * p1, b[2] * p2);
        let ng = triangle_area_vector(mesh, primitive).try_normalize()?;
        let indices = mesh.indices[primitive as usize].map(|i| i as usize);
        let uv = match mesh.uvs.as_slice() {
            [] => Vec2::new(b[1] + b[2], b[2]),
            uvs => b[0] * uvs[indices[0]] + b[1] * uvs[indices[1]] + b[2] * uvs[indices[2]],
        };
        let ng = match mesh.normals.as_slice() {
            [] if flip => -ng,
            [] => ng,
            n => toward(ng, b[0] * n[indices[0]] + b[1] * n[indices[1]] + b[2] * n[indices[2]]),
        };
        let p_error = gamma(6) * (w0.abs() + w1.abs() + w2.abs());
        let point = AreaSample { p: w0 + w1 + w2, p_error, ng, uv, pdf_area: 1.0 / self.weight };
        Some(ShapeSample { point, primitive, parameters: [b[1], b[2]] })
    }

    fn sample_patch(&self, mesh: &BilinearMesh, flip: bool, primitive: u32, u: [f32; 2]) -> Option<ShapeSample> {
        let corners = patch_corners(mesh, primitive);
        let parameters = sample_bilinear(u, patch_corner_elements(&corners));
        let [u, v] = parameters;
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let indices = mesh.indices[primitive as usize].map(|i| i as usize);
        let p = (0..4).map(|i| weights[i] * corners[i]).sum();
        let p_error = gamma(8) * (0..4).map(|i| weights[i] * corners[i].abs()).sum::<Vec3>();
        let ng = patch_area_vector(&corners, parameters).try_normalize()?;
        let uv = match mesh.uvs.as_slice() {
            [] => Vec2::new(u, v),
            uvs => (0..4).map(|i| weights[i] * uvs[indices[i]]).sum(),
        };
        let ng = match mesh.normals.as_slice() {
            [] if flip => -ng,
            [] => ng,
            normals => toward(ng, (0..4).map(|i| weights[i] * normals[indices[i]]).sum()),
        };
        let point = AreaSample { p, p_error, ng, uv, pdf_area: self.patch_pdf(&corners, parameters) };
        Some(ShapeSample { point, primitive, parameters })
    }

    /// P(patch) = ΣJ/4 / weight, p(u, v | patch) = J̃(u, v) / (ΣJ/4): the patch's own sum cancels.
    fn patch_pdf(&self, corners: &[Vec3; 4], [u, v]: [f32; 2]) -> f32 {
        let [j00, j10, j01, j11] = patch_corner_elements(corners);
        let interpolated = (1.0 - v) * ((1.0 - u) * j00 + u * j10) + v * ((1.0 - u) * j01 + u * j11);
        let element = patch_area_vector(corners, [u, v]).length();
        if element > 0.0 { interpolated / (self.weight * element) } else { 0.0 }
    }

    fn quadric(
        &self,
        to_shape: &Affine3A,
        flip: bool,
        p: Vec3,
        normal: Vec3,
        parameters: [f32; 2],
    ) -> Option<ShapeSample> {
        let ng = affine::normal(to_shape, normal.as_dvec3());
        if ng == Vec3::ZERO {
            return None;
        }
        let magnitude = to_shape.matrix3.abs() * p.abs() + Vec3::from(to_shape.translation.abs());
        let point = AreaSample {
            p: to_shape.transform_point3(p),
            p_error: gamma(12) * magnitude,
            ng: if flip { -ng } else { ng },
            uv: Vec2::from_array(parameters),
            pdf_area: 1.0 / (self.weight * area_scale(&to_shape.matrix3, ng)),
        };
        point.p.is_finite().then_some(ShapeSample { point, primitive: 0, parameters })
    }
}

/// By how much `matrix` enlarges the area of a surface that has the unit normal `normal` after the map: |det M| / |Mᵀn|.
#[inline]
pub fn area_scale(matrix: &Mat3A, normal: Vec3) -> f32 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| Vec3::from(axis).as_dvec3());
    let normal = normal.as_dvec3();
    (x.dot(y.cross(z)).abs() / DVec3::new(x.dot(normal), y.dot(normal), z.dot(normal)).length()) as f32
}

/// `ng` on the side that `shading` points to, as pbrt orients meshes that have normals.
fn toward(ng: Vec3, shading: Vec3) -> Vec3 {
    if ng.dot(shading) < 0.0 { -ng } else { ng }
}

/// The corners of a triangle.
pub fn triangle_corners(mesh: &TriangleMesh, primitive: u32) -> [Vec3; 3] {
    mesh.indices[primitive as usize].map(|i| mesh.positions[i as usize])
}

/// The normal by the order of corners, twice the area long.
pub fn triangle_area_vector(mesh: &TriangleMesh, primitive: u32) -> Vec3 {
    let [p0, p1, p2] = triangle_corners(mesh, primitive);
    (p1 - p0).cross(p2 - p0)
}

fn triangle_area(mesh: &TriangleMesh, primitive: u32) -> f32 {
    triangle_area_vector(mesh, primitive).length() * 0.5
}

/// About the area of a patch: the mean of the corners' area elements.
fn patch_weight(mesh: &BilinearMesh, primitive: u32) -> f32 {
    patch_corner_elements(&patch_corners(mesh, primitive)).iter().sum::<f32>() * 0.25
}

/// The corners of a patch at (0,0), (1,0), (0,1), (1,1).
pub fn patch_corners(mesh: &BilinearMesh, primitive: u32) -> [Vec3; 4] {
    mesh.indices[primitive as usize].map(|i| mesh.positions[i as usize])
}

/// ∂p/∂u × ∂p/∂v: the normal, as long as the area element.
pub fn patch_area_vector(&[p00, p10, p01, p11]: &[Vec3; 4], [u, v]: [f32; 2]) -> Vec3 {
    let dpdu = (p10 - p00).lerp(p11 - p01, v);
    let dpdv = (p01 - p00).lerp(p11 - p10, u);
    dpdu.cross(dpdv)
}

/// The area elements at the corners, kept above zero so that no part of a degenerate patch is out of reach.
fn patch_corner_elements(corners: &[Vec3; 4]) -> [f32; 4] {
    let elements = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|uv| patch_area_vector(corners, uv).length());
    let middle = patch_area_vector(corners, [0.5, 0.5]).length();
    let floor = 0.01 * elements.iter().fold(middle, |a, &b| a.max(b));
    elements.map(|e| e.max(floor))
}

/// (u, v) with density proportional to the bilinear interpolation of the weights at (0,0), (1,0), (0,1), (1,1), by inverting the
/// marginal of v and then the conditional of u.
pub fn sample_bilinear(u: [f32; 2], [w00, w10, w01, w11]: [f32; 4]) -> [f32; 2] {
    let v = sample_linear(u[1], w00 + w10, w01 + w11);
    [sample_linear(u[0], w00 + v * (w01 - w00), w10 + v * (w11 - w10)), v]
}

/// x in [0, 1] with density proportional to lerp(a, b, x).
fn sample_linear(u: f32, a: f32, b: f32) -> f32 {
    if a + b <= 0.0 {
        return u;
    }
    // The stable root of (b − a)x²/2 + a x = u(a + b)/2.
    let root = (a * a + u * (b - a) * (b + a)).max(0.0).sqrt();
    if a + root > 0.0 { (u * (a + b) / (a + root)).clamp(0.0, 1.0) } else { 0.0 }
}

/// A uniform point of a sphere in object space (Archimedes: z and φ are uniform), with its parameters.
fn sphere_point(sphere: &Sphere, u: [f32; 2]) -> (Vec3, [f32; 2]) {
    let r = sphere.radius;
    let z = sphere.z_min + (sphere.z_max - sphere.z_min) * u[0];
    let ring = (r * r - z * z).max(0.0).sqrt();
    let phi = sphere.phi_max * u[1];
    let theta = |z: f32| (z / r).clamp(-1.0, 1.0).acos();
    let (low, high) = (theta(sphere.z_min), theta(sphere.z_max));
    (Vec3::new(ring * phi.cos(), ring * phi.sin(), z), [u[1], ((theta(z) - low) / (high - low)).clamp(0.0, 1.0)])
}

/// A uniform point of a disk in object space, with its parameters.
fn disk_point(disk: &Disk, u: [f32; 2]) -> (Vec3, [f32; 2]) {
    let whole = disk.inner_radius == 0.0 && disk.phi_max >= TAU - 1e-5;
    let (x, y, radius, phi) = if whole {
        let d = disk.radius * concentric_disk(u);
        let phi = d.y.atan2(d.x);
        (d.x, d.y, d.length(), if phi < 0.0 { phi + TAU } else { phi })
    } else {
        let (inner, outer) = (disk.inner_radius * disk.inner_radius, disk.radius * disk.radius);
        let (radius, phi) = ((inner + (outer - inner) * u[0]).sqrt(), disk.phi_max * u[1]);
        (radius * phi.cos(), radius * phi.sin(), radius, phi)
    };
    let v = (disk.radius - radius) / (disk.radius - disk.inner_radius);
    (Vec3::new(x, y, disk.height), [(phi / disk.phi_max).clamp(0.0, 1.0), v.clamp(0.0, 1.0)])
}

/// A uniform point of a cylinder in object space, at those parameters.
fn cylinder_point(cylinder: &Cylinder, [u, v]: [f32; 2]) -> Vec3 {
    let phi = cylinder.phi_max * u;
    let z = cylinder.z_min + (cylinder.z_max - cylinder.z_min) * v;
    Vec3::new(cylinder.radius * phi.cos(), cylinder.radius * phi.sin(), z)
}

/// The sphere that `sphere` is in its shape's space, if it is whole and still round there: centre and radius.
pub fn round_sphere(sphere: &Sphere) -> Option<(Vec3, f32)> {
    let r = sphere.radius;
    let whole =
        sphere.z_min <= -r * (1.0 - 1e-6) && sphere.z_max >= r * (1.0 - 1e-6) && sphere.phi_max >= 2.0 * PI - 1e-5;
    let scale = similarity_scale(&sphere.to_shape.matrix3)?;
    whole.then_some((sphere.to_shape.translation.into(), r * scale))
}

/// The factor by which `matrix` scales all lengths; `None` where it does not scale all alike.
pub fn similarity_scale(matrix: &Mat3A) -> Option<f32> {
    let gram = matrix.transpose() * *matrix;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let even = gram.abs_diff_eq(Mat3A::from_diagonal(Vec3::splat(square)), 2e-5 * square);
    (even && square > 0.0).then(|| square.sqrt())
}
