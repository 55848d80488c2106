//! Closest hits and occlusion of every kind of shape.

use glam::{Affine3A, EulerRot, Quat, Vec3};

use super::*;
use crate::geometry::curve::{CurveKind, Curves};
use crate::geometry::shape::{BilinearMesh, Disk, Sphere};
use crate::geometry::trace::TraceError;

/// `count` triangles of edges about `size`.
fn random_triangles(random: &mut Random, count: u32, size: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..count {
        let centre = random.in_cube();
        mesh.positions.extend((0..3).map(|_| centre + size * random.in_cube()));
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

pub(super) fn sphere(to_shape: Affine3A) -> Sphere {
    Sphere {
        radius: 0.7,
        z_min: -0.5,
        z_max: 0.6,
        phi_max: 5.0,
        to_shape,
        inverse: crate::geometry::affine::linear(&to_shape).inverse(),
    }
}

pub(super) fn disk(to_shape: Affine3A) -> Disk {
    Disk {
        height: 0.2,
        radius: 0.9,
        inner_radius: 0.3,
        phi_max: 5.5,
        to_shape,
        inverse: crate::geometry::affine::linear(&to_shape).inverse(),
    }
}

fn tilted() -> Affine3A {
    let rotation = Quat::from_euler(EulerRot::XYZ, 0.4, 0.9, -0.3);
    Affine3A::from_scale_rotation_translation(Vec3::new(1.0, 0.7, 1.2), rotation, Vec3::new(0.1, -0.2, 0.3))
}

pub(super) fn random_curves(random: &mut Random, kind: CurveKind, count: usize) -> Curves {
    let mut curves =
        Curves { kind, control_points: Vec::new(), widths: Vec::new(), parameters: Vec::new(), normals: Vec::new() };
    for _ in 0..count {
        let start = random.in_cube();
        let step = 0.4 * random.direction();
        curves.control_points.push([0.0, 1.0, 2.0, 3.0].map(|i| start + i * step + 0.1 * random.in_cube()));
        curves.widths.push([0.05 + 0.1 * random.unit(), 0.05 + 0.1 * random.unit()]);
        curves.parameters.push([0.0, 1.0]);
        curves.normals.push([random.direction(), random.direction()]);
    }
    curves
}

#[test]
fn random_triangles_agree_with_brute_force() {
    let mesh = random_triangles(&mut Random::new(1), 500, 0.3);
    agrees_with_brute_force(&top_level(vec![shape(ShapeKind::Triangles(mesh))]), 5000, 2, 1, 1e-5);
}

#[test]
fn quadrics_and_patches_agree_with_their_own_intersection() {
    let mut random = Random::new(3);
    let patches = BilinearMesh {
        positions: (0..40).map(|_| random.in_cube()).collect(),
        indices: (0..10).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect(),
        ..BilinearMesh::default()
    };
    for kind in [ShapeKind::Sphere(sphere(tilted())), ShapeKind::Disk(disk(tilted())), ShapeKind::Bilinear(patches)] {
        agrees_with_brute_force(&top_level(vec![shape(kind)]), 3000, 4, 0, 0.0);
    }
}

#[test]
fn ribbons_agree_with_their_own_intersection() {
    let curves = random_curves(&mut Random::new(5), CurveKind::Ribbon, 60);
    agrees_with_brute_force(&top_level(vec![shape(ShapeKind::Curves(curves))]), 3000, 6, 0, 0.0);
}

/// Embree cuts a curve into 16 pieces, the other intersection goes on until a twentieth of the width: outlines may differ.
#[test]
fn flat_curves_agree_with_their_own_intersection() {
    for kind in [CurveKind::Flat, CurveKind::Cylinder] {
        let curves = random_curves(&mut Random::new(7), kind, 60);
        let geometry = top_level(vec![shape(ShapeKind::Curves(curves))]);
        let tracer = build(&geometry);
        let mut random = Random::new(8);
        let (mut both, mut one, mut far) = (0, 0, 0);
        for _ in 0..5000 {
            let ray = random.inward_ray();
            match (tracer.closest(&ray), brute_force(&geometry, &ray)) {
                (Some(found), Some((t, _, primitive))) if found.primitive == primitive => {
                    both += 1;
                    let shape = &geometry.shapes[0];
                    let (_, uv) = shape
                        .intersect(primitive, ray.origin, ray.direction, 0.0, f32::INFINITY)
                        .expect("brute force found it");
                    let away = (found.t - t).abs() > 0.02;
                    if away || (found.uv[0] - uv[0]).abs() > 0.1 || (found.uv[1] - uv[1]).abs() > 0.1 {
                        far += 1;
                    }
                }
                (None, None) => {}
                _ => one += 1,
            }
        }
        assert!(both > 800, "{both}");
        assert!(one * 50 < both, "{one} hits of one side only, {both} of both");
        assert!(far * 50 < both, "{far} of {both} hits are elsewhere");
    }
}

#[test]
fn instances_of_everything_agree_with_brute_force() {
    let mut random = Random::new(9);
    let shapes = vec![
        shape(ShapeKind::Triangles(random_triangles(&mut random, 40, 0.3))),
        shape(ShapeKind::Sphere(sphere(Affine3A::from_translation(Vec3::new(0.3, 0.0, 0.0))))),
        shape(ShapeKind::Disk(disk(tilted()))),
    ];
    let fixed = |scale: Vec3, x: f32| {
        MotionTransform::Fixed(Affine3A::from_scale_rotation_translation(
            scale,
            Quat::from_rotation_y(x),
            Vec3::new(x, 0.0, 0.1),
        ))
    };
    // Stretched and mirrored ones too: t stays in the units of the render-space direction.
    let transforms = vec![
        fixed(Vec3::splat(0.4), -0.7),
        fixed(Vec3::new(2.0, 0.2, 0.5), 0.1),
        fixed(Vec3::new(-0.3, 0.4, 0.9), 0.8),
    ];
    agrees_with_brute_force(&instanced(shapes, transforms), 4000, 10, 2, 1e-5);
}

#[test]
fn hits_name_shape_instance_primitive_and_weights() {
    let triangle = |z: f32| TriangleMesh {
        positions: vec![Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z)],
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    let mut geometry = Geometry {
        shapes: (0..4).map(|z| shape(ShapeKind::Triangles(triangle(z as f32)))).collect(),
        top_level: vec![ShapeId(3)],
        prototypes: vec![Prototype { shapes: vec![] }, Prototype { shapes: vec![ShapeId(0), ShapeId(1)] }],
        instances: vec![],
        ..Geometry::default()
    };
    geometry.shapes[0].is_boundary = true;
    for (prototype, x) in [(0, 0.0), (1, 10.0), (1, 20.0)] {
        let transform = MotionTransform::Fixed(Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)));
        geometry.instances.push(Instance { prototype, transform });
    }
    let tracer = build(&Arc::new(geometry));
    let down = |x: f32| tracer.closest(&ray(Vec3::new(x + 0.25, 0.5, 9.0), -Vec3::Z));
    let hit = down(20.0).expect("the second instance's triangle");
    assert_eq!((hit.shape, hit.instance.map(|i| i.0), hit.primitive), (ShapeId(1), Some(2), 0));
    assert!(near(hit.t, 8.0) && near(hit.uv[0], 0.25) && near(hit.uv[1], 0.5), "{hit:?}");
    let hit = down(0.0).expect("the triangle in render space");
    assert!((hit.shape, hit.instance) == (ShapeId(3), None) && near(hit.t, 6.0), "{hit:?}");
    assert!(down(30.0).is_none());

    let mut crossings = Vec::new();
    tracer.boundaries(&ray(Vec3::new(10.25, 0.5, 9.0), -Vec3::Z), &mut crossings);
    assert_eq!(crossings.len(), 1);
    assert_eq!((crossings[0].shape, crossings[0].instance.map(|i| i.0)), (ShapeId(0), Some(1)));
}

#[test]
fn far_end_is_open_and_nan_rays_hit_nothing() {
    let tracer = build(&top_level(vec![shape(ShapeKind::Triangles(box_mesh(-Vec3::ONE, Vec3::ONE)))]));
    let towards = ray(Vec3::new(0.2, 0.3, -4.0), Vec3::Z);
    let t = tracer.closest(&towards).expect("the box is there").t;
    assert!(near(t, 3.0));
    for (t_max, meets) in [(t, false), (t.next_up(), true)] {
        let segment = Ray { t_max, ..towards };
        assert_eq!((tracer.closest(&segment).is_some(), tracer.occluded(&segment)), (meets, meets));
    }
    for odd in [
        Ray { t_max: f32::NAN, ..towards },
        Ray { t_max: 0.0, ..towards },
        Ray { t_max: -1.0, ..towards },
        Ray { time: f32::NAN, ..towards },
        Ray { origin: Vec3::NAN, ..towards },
        Ray { direction: Vec3::new(0.0, f32::INFINITY, 1.0), ..towards },
    ] {
        assert!(tracer.closest(&odd).is_none() && !tracer.occluded(&odd), "{odd:?}");
    }
}

#[test]
fn degenerate_triangles_and_slivers_are_harmless() {
    let mut mesh = box_mesh(-Vec3::ONE, Vec3::ONE);
    let base = mesh.positions.len() as u32;
    let far = 1e30f32;
    mesh.positions.extend([
        Vec3::ZERO,
        Vec3::new(0.5, 0.0, 0.0),
        Vec3::new(0.5, 1e-38, 0.0),
        Vec3::new(0.25, 1e-7, 0.0),
        Vec3::new(far, far, far),
        Vec3::NAN,
    ]);
    // A point, two segments, two slivers, an immense one and one with a NaN corner.
    for t in [[0, 0, 0], [0, 1, 1], [0, 1, 0], [0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 5]] {
        mesh.indices.push(t.map(|i| base + i));
    }
    let tracer = build(&top_level(vec![shape(ShapeKind::Triangles(mesh))]));
    let mut random = Random::new(11);
    for _ in 0..2000 {
        let hit = tracer.closest(&random.inward_ray());
        let hit = hit.filter(|hit| hit.primitive < 12);
        assert!(hit.is_none_or(|hit| hit.t.is_finite() && hit.uv.iter().all(|x| (-1e-5..=1.00001).contains(x))));
    }
    let through = ray(Vec3::new(0.3, 0.4, 5.0), -Vec3::Z);
    assert!(tracer.closest(&through).is_some_and(|hit| near(hit.t, 4.0)));
}

#[test]
fn empty_and_flattened_things_are_left_out() {
    let empty = || shape(ShapeKind::Triangles(TriangleMesh::default()));
    let ball = || shape(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 1.0, 1)));
    let flat = MotionTransform::Fixed(Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    for geometry in [top_level(vec![]), top_level(vec![empty()]), instanced(vec![ball()], vec![flat])] {
        let tracer = build(&geometry);
        let mut random = Random::new(12);
        for _ in 0..100 {
            let ray = random.inward_ray();
            assert!(tracer.closest(&ray).is_none() && !tracer.occluded(&ray));
        }
    }
}

#[test]
fn vertex_numbers_out_of_range_are_an_error() {
    let mut mesh = box_mesh(-Vec3::ONE, Vec3::ONE);
    mesh.indices.push([0, 1, 8]);
    // With something that may be apart.
    let shapes =
        vec![shape(ShapeKind::Triangles(mesh)), shape(ShapeKind::Disk(disk(Affine3A::from_scale(Vec3::splat(0.1)))))];
    let built = EmbreeTracer::build(top_level(shapes), None);
    assert!(matches!(built, Err(TraceError::Library(message)) if message.contains("vertex number 8 of 8")));
}

#[test]
fn memory_is_counted() {
    let mesh = ball_mesh(Vec3::ZERO, 1.0, 6);
    let count = mesh.indices.len();
    let tracer = build(&top_level(vec![shape(ShapeKind::Triangles(mesh))]));
    let memory = tracer.memory();
    assert!((20 * count..500 * count).contains(&memory), "{memory} bytes for {count} triangles");
}
