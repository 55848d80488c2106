//! Opacity as a filter.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use super::*;
use crate::geometry::shape::Sphere;
use crate::geometry::trace::{Opacity, PrimitivePoint};

/// Half of (primitive, seed) pairs are holes, and the lower half of spheres.
struct Lottery;

impl Opacity for Lottery {
    fn is_opaque(&self, geometry: &Geometry, at: &PrimitivePoint, seed: u32) -> bool {
        let PrimitivePoint { shape, primitive, uv, .. } = *at;
        match &geometry.shapes[shape.0 as usize].kind {
            ShapeKind::Sphere(_) => uv[1] > 0.5,
            _ => {
                let mut hash = Pcg32::seed_from_u64(u64::from(seed) << 32 | u64::from(primitive));
                hash.next_u32() & 1 == 0
            }
        }
    }
}

fn with_alpha(kind: ShapeKind) -> Shape {
    Shape { alpha: Some(0), ..shape(kind) }
}

#[test]
fn filtered_hits_agree_with_brute_force_and_repeat() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 2);
    let geometry = top_level(vec![
        with_alpha(ShapeKind::Triangles(mesh)),
        shape(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 0.3, 2))),
    ]);
    let tracer = EmbreeTracer::build(geometry.clone(), Some(Arc::new(Lottery))).expect("well formed");
    let mut random = Random::new(30);
    let (mut outer, mut inner, mut through) = (0, 0, 0);
    for seed in 0..4000 {
        let ray = Ray { opacity_seed: seed, ..random.inward_ray() };
        let mut best: Option<(f32, ShapeId, u32)> = None;
        for id in [ShapeId(0), ShapeId(1)] {
            let shape = &geometry.shapes[id.0 as usize];
            for primitive in 0..shape.primitive_count() {
                let hit = shape.intersect(primitive, ray.origin, ray.direction, 0.0, f32::INFINITY);
                let Some((t, uv)) = hit else { continue };
                let solid = id.0 == 1
                    || Lottery.is_opaque(&geometry, &PrimitivePoint { shape: id, instance: None, primitive, uv }, seed);
                if solid && best.is_none_or(|(best, ..)| t < best) {
                    best = Some((t, id, primitive));
                }
            }
        }
        let found = tracer.closest(&ray);
        assert_eq!(found.map(|hit| (hit.shape, hit.primitive)), best.map(|(_, shape, primitive)| (shape, primitive)));
        assert_eq!(tracer.occluded(&ray), best.is_some());
        assert_eq!(tracer.closest(&ray).map(|hit| hit.t), found.map(|hit| hit.t));
        match found {
            Some(hit) if hit.shape.0 == 0 => outer += 1,
            Some(_) => inner += 1,
            None => through += 1,
        }
    }
    assert!(outer > 500 && inner > 50 && through > 50, "{outer} {inner} {through}");
}

#[test]
fn far_side_shows_through_a_hole_in_a_quadric() {
    let sphere = Sphere {
        radius: 1.0,
        z_min: -1.0,
        z_max: 1.0,
        phi_max: std::f32::consts::TAU,
        to_shape: Affine3A::IDENTITY,
        inverse: glam::DMat3::IDENTITY,
    };
    let geometry = top_level(vec![with_alpha(ShapeKind::Sphere(sphere))]);
    let tracer = EmbreeTracer::build(geometry, Some(Arc::new(Lottery))).expect("well formed");
    // From below through the hole to the upper half; across the lower half both sides are holes.
    let hit = tracer.closest(&ray(Vec3::new(0.0, 0.0, -5.0), Vec3::new(0.01, 0.0, 1.0))).expect("the upper half");
    assert!((hit.t - 6.0).abs() < 0.01);
    let across = ray(Vec3::new(-5.0, 0.0, -0.5), Vec3::X);
    assert!(tracer.closest(&across).is_none() && !tracer.occluded(&across));
    let across = ray(Vec3::new(-5.0, 0.0, 0.5), Vec3::X);
    assert!(tracer.closest(&across).is_some() && tracer.occluded(&across));
}

#[test]
fn shapes_without_alpha_are_not_asked() {
    struct Never;
    impl Opacity for Never {
        fn is_opaque(&self, _: &Geometry, _: &PrimitivePoint, _: u32) -> bool {
            panic!("asked");
        }
    }
    let geometry = top_level(vec![shape(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 1.0, 1)))]);
    let tracer = EmbreeTracer::build(geometry, Some(Arc::new(Never))).expect("well formed");
    assert!(tracer.closest(&ray(3.0 * Vec3::X, -Vec3::X)).is_some());
}

#[test]
fn a_panic_in_opacity_arrives_in_the_asking_thread() {
    struct Fails;
    impl Opacity for Fails {
        fn is_opaque(&self, _: &Geometry, _: &PrimitivePoint, _: u32) -> bool {
            panic!("opacity failed");
        }
    }
    let geometry = top_level(vec![with_alpha(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 1.0, 1)))]);
    let tracer = EmbreeTracer::build(geometry, Some(Arc::new(Fails))).expect("well formed");
    for _ in 0..2 {
        let asked = std::panic::AssertUnwindSafe(|| tracer.occluded(&ray(3.0 * Vec3::X, -Vec3::X)));
        let panic = std::panic::catch_unwind(asked).expect_err("the panic goes on");
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"opacity failed"));
    }
}
