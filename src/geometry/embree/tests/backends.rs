//! Both backends give the same answers on one scene with everything in it.

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DQuat, DVec3, Vec3};

use super::*;
use crate::geometry::native::NativeTracer;
use crate::geometry::shape::{BilinearMesh, Sphere};
use crate::geometry::trace::{Opacity, PrimitivePoint};
use crate::math::transform::Decomposed;

/// A chequerboard of the parameters, drawn anew for each seed.
pub(super) struct Chequered;

impl Opacity for Chequered {
    fn is_opaque(&self, _: &Geometry, at: &PrimitivePoint, seed: u32) -> bool {
        // Each instance has holes of its own.
        let place = at.primitive + at.instance.map_or(0, |instance| instance.0 + 1);
        let square = (4.0 * at.uv[0]) as u32 + (4.0 * at.uv[1]) as u32 + place + seed;
        square.is_multiple_of(2)
    }
}

/// Every kind of shape but curves, as such and instanced, still and moving, opaque and as boundaries.
pub(super) fn everything() -> Arc<Geometry> {
    let sphere = |radius: f32| {
        ShapeKind::Sphere(Sphere {
            radius,
            z_min: -radius,
            z_max: radius,
            phi_max: std::f32::consts::TAU,
            to_shape: Affine3A::IDENTITY,
            inverse: glam::DMat3::IDENTITY,
        })
    };
    let patch = BilinearMesh {
        positions: [(-1.0, -1.0, 0.3), (1.0, -1.0, -0.3), (-1.0, 1.0, -0.3), (1.0, 1.0, 0.3)].map(Vec3::from).to_vec(),
        indices: vec![[0, 1, 2, 3]],
        ..BilinearMesh::default()
    };
    let mesh = |radius: f32| ShapeKind::Triangles(ball_mesh(Vec3::new(0.2, 0.1, 0.0), radius, 3));
    let boundary = |kind, flip_normal| Shape { is_boundary: true, flip_normal, ..shape(kind) };
    let shapes = vec![
        Shape { alpha: Some(0), ..shape(mesh(0.9)) },
        shape(mesh(0.2)),
        boundary(mesh(1.1), false),
        boundary(sphere(0.8), true),
        Shape { alpha: Some(0), ..shape(ShapeKind::Bilinear(patch)) },
        shape(sphere(0.3)),
        boundary(sphere(0.5), false),
    ];
    let key = |angle: f64, x: f64| {
        let turn = DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(0.3);
        Box::new(
            Decomposed::new(&DAffine3::from_scale_rotation_translation(
                DVec3::new(0.7, 0.5, 0.6),
                turn,
                DVec3::new(x, 0.4, 0.0),
            ))
            .expect("invertible"),
        )
    };
    let still = Affine3A::from_scale_rotation_translation(
        Vec3::new(0.5, -0.6, 0.4),
        glam::Quat::from_rotation_z(1.0),
        Vec3::new(-0.6, -0.3, 0.2),
    );
    Arc::new(Geometry {
        shapes,
        top_level: (0..4).map(ShapeId).collect(),
        prototypes: vec![Prototype { shapes: (4..7).map(ShapeId).collect() }],
        instances: vec![
            Instance { prototype: 0, transform: MotionTransform::Fixed(still) },
            Instance { prototype: 0, transform: MotionTransform::Moving { start: key(0.0, 0.2), end: key(2.0, 0.8) } },
        ],
        ..Geometry::default()
    })
}

#[test]
fn agree_on_everything() {
    let geometry = everything();
    let embree = EmbreeTracer::build(geometry.clone(), Some(Arc::new(Chequered))).expect("well formed");
    let native = NativeTracer::build(geometry.clone(), Some(Arc::new(Chequered))).expect("well formed");
    let mut random = Random::new(60);
    let (mut a, mut b) = (Vec::new(), Vec::new());
    let (mut hits, mut crossings, mut differing) = (0, 0, 0);
    for opacity_seed in 0..20_000 {
        let ray = Ray { time: random.unit(), t_max: 2.0 + 3.0 * random.unit(), opacity_seed, ..random.inward_ray() };
        let same_hit = match (embree.closest(&ray), native.closest(&ray)) {
            (Some(x), Some(y)) => {
                hits += 1;
                let close = (x.t - y.t).abs() < 1e-4 && (0..2).all(|i| (x.uv[i] - y.uv[i]).abs() < 1e-2);
                close && (x.shape, x.instance, x.primitive) == (y.shape, y.instance, y.primitive)
            }
            (None, None) => true,
            _ => false,
        };
        let same_occlusion = embree.occluded(&ray) == native.occluded(&ray);
        embree.boundaries(&ray, &mut a);
        native.boundaries(&ray, &mut b);
        crossings += a.len();
        let same_crossings = a.len() == b.len()
            && a.iter().zip(&b).all(|(x, y)| {
                (x.t - y.t).abs() < 1e-4 && (x.shape, x.instance, x.entering) == (y.shape, y.instance, y.entering)
            });
        differing += u32::from(!(same_hit && same_occlusion && same_crossings));
    }
    assert!(hits > 5000 && crossings > 20_000, "{hits} {crossings}");
    // Rounding decides at outlines, at the edges of the opacity's squares and of segments: some rays in a hundred thousand.
    assert!(differing <= 6, "{differing} of 20000 rays differ");
}
