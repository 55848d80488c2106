//! The native tracer against brute force, at edges, far away, at extreme sizes and with degenerate input.

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DQuat, DVec3, Quat, Vec3};

use super::NativeTracer;
use crate::geometry::fixtures::*;
use crate::geometry::trace::{Opacity, PrimitivePoint};
use crate::geometry::{
    BoundaryCrossing, Geometry, Instance, InstanceId, MotionTransform, Prototype, Ray, RayHit, ShapeId, ShapeKind,
    affine,
};
use crate::math::transform::Decomposed;

/// Holes where the first parameter is below 0.4.
struct Holes;

impl Opacity for Holes {
    fn is_opaque(&self, _: &Geometry, at: &PrimitivePoint, _: u32) -> bool {
        at.uv[0] >= 0.4
    }
}

/// Every primitive of every shape, one after the other.
fn brute_force(geometry: &Geometry, ray: &Ray, opacity: Option<&dyn Opacity>) -> Option<RayHit> {
    let mut best: Option<RayHit> = None;
    let mut test = |id: ShapeId, instance: Option<InstanceId>, origin, direction| {
        let shape = &geometry.shapes[id.0 as usize];
        for primitive in 0..shape.primitive_count() {
            let mut start = 0.0;
            let limit = best.map_or(ray.t_max, |b| b.t);
            while let Some((t, uv)) = shape.intersect(primitive, origin, direction, start, limit) {
                start = t;
                let at = PrimitivePoint { shape: id, instance, primitive, uv };
                if shape.has_opacity() && !opacity.is_none_or(|o| o.is_opaque(geometry, &at, 0)) {
                    continue;
                }
                best = Some(RayHit { t, shape: id, instance, primitive, uv });
                break;
            }
        }
    };
    for &id in &geometry.top_level {
        test(id, None, ray.origin, ray.direction);
    }
    for (number, instance) in geometry.instances.iter().enumerate() {
        let (o, d) = instance.transform.ray_to_local(ray.time, ray.origin, ray.direction).unwrap();
        for &id in &geometry.prototypes[instance.prototype as usize].shapes {
            test(id, Some(InstanceId(number as u32)), o, d);
        }
    }
    best
}

fn moving(random: &mut Random, spread: f32) -> MotionTransform {
    let mut key = || {
        Box::new(
            Decomposed::new(&DAffine3::from_scale_rotation_translation(
                DVec3::new(0.5, 1.0, 2.0) * f64::from(0.5 + random.unit()),
                DQuat::from_scaled_axis(random.vector(2.5).as_dvec3()),
                random.vector(spread).as_dvec3(),
            ))
            .expect("invertible"),
        )
    };
    MotionTransform::Moving { start: key(), end: key() }
}

fn crowd(seed: u64, alpha: bool) -> Geometry {
    let mut random = Random(seed);
    let mut geometry = Geometry::default();
    for place in 0..4 {
        let mut ids = Vec::new();
        for mut shape in one_of_each(&mut random, if place == 0 { 5.0 } else { 1.5 }) {
            shape.alpha = alpha.then_some(0);
            ids.push(ShapeId(geometry.shapes.len() as u32));
            geometry.shapes.push(shape);
        }
        if place == 0 {
            geometry.top_level = ids;
        } else {
            geometry.prototypes.push(Prototype { shapes: ids });
        }
    }
    for i in 0..24 {
        let transform = if i % 2 == 0 {
            moving(&mut random, 5.0)
        } else {
            MotionTransform::Fixed(Affine3A::from_scale_rotation_translation(
                random.vector(1.0) + Vec3::splat(1.5),
                Quat::from_scaled_axis(random.vector(3.0)),
                random.vector(5.0),
            ))
        };
        geometry.instances.push(Instance { prototype: i % 3, transform });
    }
    geometry
}

#[test]
fn agrees_with_brute_force() {
    for (seed, alpha) in [(1, false), (2, true)] {
        let geometry = Arc::new(crowd(seed, alpha));
        let tracer = NativeTracer::build(geometry.clone(), Some(Arc::new(Holes))).unwrap();
        let mut random = Random(seed + 100);
        let mut hits = 0;
        for i in 0..3000 {
            let direction = if i % 10 == 0 { Vec3::AXES[i % 3] } else { random.direction() };
            let t_max = if i % 2 == 0 { f32::INFINITY } else { 4.0 * random.unit() };
            let ray = Ray { origin: random.vector(6.0), direction, t_max, time: random.unit(), opacity_seed: 0 };
            let expected = brute_force(&geometry, &ray, Some(&Holes));
            let found = tracer.closest(&ray);
            let key = |h: &RayHit| (h.t, h.shape, h.instance, h.primitive, h.uv);
            assert_eq!(found.as_ref().map(key), expected.as_ref().map(key), "ray {i}: {ray:?}");
            assert_eq!(tracer.occluded(&ray), expected.is_some(), "ray {i}");
            hits += usize::from(expected.is_some());
        }
        assert!((300..2900).contains(&hits), "the test sees too little: {hits} hits");
    }
}

#[test]
fn moving_boxes_hold_the_whole_motion() {
    let mut random = Random(5);
    for _ in 0..200 {
        let transform = moving(&mut random, 10.0);
        let (low, high) = (random.vector(2.0) - Vec3::splat(2.0), random.vector(2.0) + Vec3::splat(2.0));
        let (least, most) = transform.bounds(low, high);
        for _ in 0..100 {
            let p = low + (high - low) * Vec3::new(random.unit().round(), random.unit().round(), random.unit().round());
            let q = transform.at(random.unit()).transform_point3(p);
            assert!(q.cmpge(least).all() && q.cmple(most).all(), "{q} outside {least}..{most}");
        }
    }
}

#[test]
fn closed_meshes_leak_no_ray() {
    for shift in [Vec3::ZERO, Vec3::new(1e6, 0.0, 0.0), Vec3::new(1e6, -1e6, 1e6)] {
        let mesh = ball_mesh(100.0, shift, 24, 16);
        let mut random = Random(7);
        let targets: Vec<Vec3> = (0..30_000)
            .map(|i| {
                let [a, b, _] = mesh.triangle(i % mesh.indices.len() as u32);
                match i % 3 {
                    0 => a,
                    1 => a.midpoint(b),
                    _ => a.lerp(b, random.unit()),
                }
            })
            .collect();
        let geometry = geometry_of(vec![shape(ShapeKind::Triangles(mesh))]);
        let tracer = NativeTracer::build(Arc::new(geometry), None).unwrap();
        for target in targets {
            let origin = shift + random.vector(30.0);
            let ray = ray(origin, (target - origin).normalize());
            assert!(tracer.closest(&ray).is_some(), "escaped from {origin} to {target}");
            assert!(tracer.occluded(&ray));
        }
    }
}

/// The same, with the mesh placed by an instance.
#[test]
fn instanced_closed_meshes_leak_no_ray() {
    let mesh = ball_mesh(1.0, Vec3::ZERO, 24, 16);
    let place = Affine3A::from_scale_rotation_translation(
        Vec3::new(90.0, 70.0, 110.0),
        Quat::from_scaled_axis(Vec3::new(0.3, -1.0, 0.4)),
        Vec3::new(1e5, -3e5, 2e4),
    );
    let targets: Vec<Vec3> = mesh.positions.iter().map(|p| place.transform_point3(*p)).collect();
    let geometry = instanced(shape(ShapeKind::Triangles(mesh)), MotionTransform::Fixed(place));
    let tracer = NativeTracer::build(Arc::new(geometry), None).unwrap();
    let mut random = Random(8);
    for _ in 0..40 {
        let origin = Vec3::from(place.translation) + random.vector(30.0);
        for target in &targets {
            assert!(tracer.closest(&ray(origin, (target - origin).normalize())).is_some());
        }
    }
}

#[test]
fn boundaries_alternate_through_closed_shapes() {
    let place = Affine3A::from_scale_rotation_translation(
        Vec3::new(-1.0, 2.0, 0.5),
        Quat::from_scaled_axis(Vec3::new(1.0, 0.2, 0.0)),
        Vec3::new(3.0, 0.0, 0.0),
    );
    for kind in
        [ShapeKind::Triangles(ball_mesh(1.0, Vec3::ZERO, 13, 9)), ShapeKind::Sphere(sphere(1.0, Affine3A::IDENTITY))]
    {
        let mut boundary = shape(kind);
        boundary.is_boundary = true;
        let geometry = instanced(boundary, MotionTransform::Fixed(place));
        let tracer = NativeTracer::build(Arc::new(geometry), None).unwrap();
        let mut random = Random(9);
        let mut crossings: Vec<BoundaryCrossing> = Vec::new();
        let mut crossed = 0;
        for _ in 0..20_000 {
            let origin = random.direction() * 8.0;
            let towards = Vec3::new(3.0, 0.0, 0.0) + random.vector(1.5);
            let ray = ray(origin, (towards - origin).normalize());
            tracer.boundaries(&ray, &mut crossings);
            assert!(tracer.closest(&ray).is_none(), "boundaries block nothing");
            assert!(crossings.len() == 2 || crossings.is_empty(), "{crossings:?}");
            if let [a, b] = crossings[..] {
                assert!(a.t <= b.t && a.entering && !b.entering, "{crossings:?}");
                crossed += 1;
                // From between them only the way out is left.
                let middle = Ray { origin: ray.origin + ray.direction * (0.5 * (a.t + b.t)), ..ray };
                if b.t - a.t > 1e-3 {
                    tracer.boundaries(&middle, &mut crossings);
                    assert!(matches!(crossings[..], [only] if !only.entering));
                }
            }
        }
        assert!(crossed > 5000);
    }
}

#[test]
fn sizes_do_not_matter() {
    for size in [1e-12f32, 1e-6, 1.0, 1e6, 1e12] {
        let mesh = ball_mesh(size, Vec3::ZERO, 12, 8);
        let tracer = NativeTracer::build(Arc::new(geometry_of(vec![shape(ShapeKind::Triangles(mesh))])), None).unwrap();
        let mut random = Random(11);
        for _ in 0..2000 {
            let hit =
                tracer.closest(&ray(random.vector(0.3 * size), random.direction())).expect("inside a closed mesh");
            assert!(hit.t > 0.2 * size && hit.t < 1.8 * size);
        }
    }
}

#[test]
fn degenerate_input_is_survived() {
    // Very many copies of one triangle, triangles without area, and chains of ever smaller ones.
    let triangle = |scale: f32| [Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale];
    let copies: Vec<[Vec3; 3]> = vec![triangle(1.0); 50_000];
    let flat: Vec<[Vec3; 3]> = vec![[Vec3::ZERO, Vec3::X, Vec3::X * 2.0], [Vec3::ONE; 3], triangle(1.0)];
    let chain: Vec<[Vec3; 3]> = (0..100).map(|i| triangle(0.7f32.powi(i))).collect();
    for soup in [copies, flat, chain, vec![triangle(1.0)], Vec::new()] {
        let count = soup.len();
        let tracer = NativeTracer::build(Arc::new(geometry_of(vec![shape(soup_mesh(&soup))])), None).unwrap();
        let hit = tracer.closest(&ray(Vec3::new(0.5, 0.25, 1.0), Vec3::NEG_Z));
        assert_eq!(hit.is_some(), count > 0);
        if count == 3 {
            assert_eq!(hit.unwrap().primitive, 2, "numbers stay when others are left out");
        }
        assert!(tracer.closest(&ray(Vec3::ONE, Vec3::ZERO)).is_none());
        assert!(tracer.closest(&ray(Vec3::NAN, Vec3::X)).is_none());
    }
    let far = shape(soup_mesh(&[[Vec3::ZERO, Vec3::X * 1e30, Vec3::Y]]));
    assert!(NativeTracer::build(Arc::new(geometry_of(vec![far])), None).is_err());
}

/// Leaving a surface point in any direction never meets the same point again, wherever the shape is.
#[test]
fn offset_rays_do_not_meet_their_own_surface() {
    let mut random = Random(13);
    for i in 0..300 {
        let far = [0.0f32, 1.0, 1e3, 1e6][i % 4];
        let place = Affine3A::from_scale_rotation_translation(
            Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 + Vec3::splat(0.1),
            if i % 3 == 0 { Quat::IDENTITY } else { Quat::from_scaled_axis(random.vector(3.0)) },
            random.vector(far),
        );
        let object = if i % 2 == 0 {
            shape(soup_mesh(&[[random.vector(1.0), random.vector(1.0), random.vector(1.0)]]))
        } else {
            shape(ShapeKind::Sphere(sphere(1.0, Affine3A::from_translation(random.vector(2.0)))))
        };
        let is_sphere = matches!(object.kind, ShapeKind::Sphere(_));
        let centre = match &object.kind {
            ShapeKind::Sphere(s) => Vec3::from(s.to_shape.translation),
            ShapeKind::Triangles(mesh) => mesh.positions.iter().sum::<Vec3>() / 3.0,
            _ => unreachable!("only those two are made"),
        };
        let geometry = Arc::new(instanced(object, MotionTransform::Fixed(place)));
        let tracer = NativeTracer::build(geometry.clone(), None).unwrap();
        for _ in 0..100 {
            let origin = place.transform_point3(centre) + random.direction() * 6.0;
            let aim = place.transform_point3(centre) + random.vector(0.2);
            let first = ray(origin, (aim - origin).normalize());
            let Some(hit) = tracer.closest(&first) else { continue };
            let point = geometry.surface_point(&first, &hit);
            for _ in 0..20 {
                // Half of them nearly along the surface.
                let mut direction = random.direction();
                if random.unit() < 0.5 {
                    direction = (direction - point.ng * direction.dot(point.ng) * (1.0 - 1e-3)).normalize();
                }
                let next =
                    ray(crate::math::robust::offset_ray_origin(point.p, point.p_error, point.ng, direction), direction);
                let again = tracer.closest(&next);
                if !is_sphere || direction.dot(point.ng) > 0.0 {
                    assert!(again.is_none(), "met itself: {point:?} {direction} {again:?}");
                } else if direction.dot(point.ng) < -1e-2 && far < 1e5 {
                    assert!(again.is_some(), "fell through: {point:?} {direction}");
                }
            }
        }
    }
}

#[test]
fn identity_instances_hit_as_the_shape_itself_does() {
    let mut random = Random(17);
    for kind in one_of_each(&mut random, 1.0) {
        let id = affine::linear(&Affine3A::IDENTITY);
        assert_eq!(id, glam::DMat3::IDENTITY);
        let (low, high) = kind.bounds(0);
        let aim = low.midpoint(high);
        let direct = (0..50).map(|i| {
            let origin = aim + Random(i).direction() * 9.0;
            ray(origin, (aim - origin).normalize())
        });
        let rays: Vec<Ray> = direct.collect();
        let expected: Vec<_> = rays
            .iter()
            .map(|r| {
                (0..kind.primitive_count())
                    .filter_map(|p| kind.intersect(p, r.origin, r.direction, 0.0, f32::INFINITY).map(|(t, _)| t))
                    .reduce(f32::min)
            })
            .collect();
        let tracer =
            NativeTracer::build(Arc::new(instanced(kind, MotionTransform::Fixed(Affine3A::IDENTITY))), None).unwrap();
        for (ray, expected) in rays.iter().zip(expected) {
            assert_eq!(tracer.closest(ray).map(|h| h.t), expected);
        }
    }
}
