//! Shapes, rays and random numbers for the tests of this room.

use std::f32::consts::TAU;

use glam::{Affine3A, Quat, Vec3};

use super::shape::{BilinearMesh, Curves, Cylinder, Disk, Sphere, TriangleMesh};
use super::{Geometry, Instance, MotionTransform, Prototype, Ray, Shape, ShapeId, ShapeKind, curve::CurveKind};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In a cube of half width `size`.
    pub fn vector(&mut self, size: f32) -> Vec3 {
        (Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - Vec3::ONE) * size
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector(1.0);
            if (1e-4..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

pub fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY, time: 0.0, opacity_seed: 0 }
}

pub fn shape(kind: ShapeKind) -> Shape {
    Shape {
        kind,
        material: 0,
        light: None,
        medium_interface: None,
        alpha: None,
        is_boundary: false,
        links: 0,
        flip_normal: false,
    }
}

pub fn geometry_of(shapes: Vec<Shape>) -> Geometry {
    let top_level = (0..shapes.len() as u32).map(ShapeId).collect();
    Geometry { shapes, top_level, ..Geometry::default() }
}

pub fn instanced(shape: Shape, transform: MotionTransform) -> Geometry {
    Geometry {
        shapes: vec![shape],
        top_level: Vec::new(),
        prototypes: vec![Prototype { shapes: vec![ShapeId(0)] }],
        instances: vec![Instance { prototype: 0, transform }],
        ..Geometry::default()
    }
}

pub fn sphere(radius: f32, to_shape: Affine3A) -> Sphere {
    Sphere {
        radius,
        z_min: -radius,
        z_max: radius,
        phi_max: TAU,
        to_shape,
        inverse: crate::geometry::affine::linear(&to_shape).inverse(),
    }
}

pub fn soup_mesh(triangles: &[[Vec3; 3]]) -> ShapeKind {
    ShapeKind::Triangles(TriangleMesh {
        positions: triangles.as_flattened().to_vec(),
        indices: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..TriangleMesh::default()
    })
}

/// A closed ball of triangles with shared vertices, wound outward.
pub fn ball_mesh(radius: f32, centre: Vec3, around: u32, rows: u32) -> TriangleMesh {
    let mut positions = vec![centre + Vec3::Z * radius];
    for row in 1..rows {
        let theta = std::f32::consts::PI * row as f32 / rows as f32;
        for i in 0..around {
            let phi = TAU * i as f32 / around as f32;
            let unit = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            positions.push(centre + unit * radius);
        }
    }
    positions.push(centre - Vec3::Z * radius);
    let last = positions.len() as u32 - 1;
    let at = |row: u32, i: u32| 1 + (row - 1) * around + i % around;
    let mut indices = Vec::new();
    for i in 0..around {
        indices.push([0, at(1, i), at(1, i + 1)]);
        for row in 1..rows - 1 {
            indices.push([at(row, i), at(row + 1, i), at(row + 1, i + 1)]);
            indices.push([at(row, i), at(row + 1, i + 1), at(row, i + 1)]);
        }
        indices.push([at(rows - 1, i), last, at(rows - 1, i + 1)]);
    }
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}

pub fn placement(random: &mut Random, spread: f32) -> Affine3A {
    Affine3A::from_scale_rotation_translation(
        Vec3::new(random.unit(), random.unit(), random.unit()) + Vec3::splat(0.3),
        Quat::from_scaled_axis(random.vector(3.0)),
        random.vector(spread),
    )
}

pub fn random_curves(random: &mut Random, spread: f32, kind: CurveKind, count: usize) -> Curves {
    let mut curves = Curves { kind, control_points: vec![], widths: vec![], parameters: vec![], normals: vec![] };
    for _ in 0..count {
        let start = random.vector(spread);
        curves.control_points.push([
            start,
            start + random.vector(0.6),
            start + random.vector(0.8),
            start + random.vector(1.0),
        ]);
        curves.widths.push([0.2 * random.unit() + 0.02, 0.2 * random.unit() + 0.02]);
        curves.parameters.push([0.25, 0.75]);
        if kind == CurveKind::Ribbon {
            curves.normals.push([random.direction(), random.direction()]);
        }
    }
    curves
}

/// Meshes, patches, partial quadrics and all kinds of curves, spread over a cube of half width `spread`.
pub fn one_of_each(random: &mut Random, spread: f32) -> Vec<Shape> {
    let triangles: Vec<[Vec3; 3]> = (0..120)
        .map(|_| {
            let at = random.vector(spread);
            [at, at + random.vector(0.8), at + random.vector(0.8)]
        })
        .collect();
    let mut patches = BilinearMesh::default();
    for i in 0..20 {
        let at = random.vector(spread);
        patches.positions.extend([at, at + random.vector(0.7), at + random.vector(0.7), at + random.vector(0.7)]);
        patches.indices.push([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]);
    }
    let mut shapes = vec![shape(soup_mesh(&triangles)), shape(ShapeKind::Bilinear(patches))];
    for i in 0..6 {
        let to_shape = placement(random, spread);
        let inverse = crate::geometry::affine::linear(&to_shape).inverse();
        let phi_max = if i % 2 == 0 { TAU } else { 4.0 };
        let z_max = if i % 3 == 0 { 1.0 } else { 0.4 };
        let sphere = Sphere { radius: 1.0, z_min: -0.7, z_max, phi_max, to_shape, inverse };
        shapes.push(shape(ShapeKind::Sphere(sphere)));
        let to_shape = placement(random, spread);
        let inverse = crate::geometry::affine::linear(&to_shape).inverse();
        let inner_radius = if i % 2 == 0 { 0.0 } else { 0.3 };
        shapes.push(shape(ShapeKind::Disk(Disk {
            height: 0.2,
            radius: 0.9,
            inner_radius,
            phi_max,
            to_shape,
            inverse,
        })));
        let to_shape = placement(random, spread);
        let inverse = crate::geometry::affine::linear(&to_shape).inverse();
        let cylinder = Cylinder { radius: 0.6, z_min: -0.5, z_max, phi_max, to_shape, inverse };
        shapes.push(shape(ShapeKind::Cylinder(cylinder)));
    }
    for kind in [CurveKind::Flat, CurveKind::Cylinder, CurveKind::Ribbon] {
        shapes.push(shape(ShapeKind::Curves(random_curves(random, spread, kind, 20))));
    }
    shapes
}
