//! Medium boundaries: all of them, in order, with the right side.

use glam::{Affine3A, Quat, Vec3};

use super::*;
use crate::geometry::BoundaryCrossing;
use crate::geometry::shape::{BilinearMesh, Disk, Sphere};

fn boundary(kind: ShapeKind) -> Shape {
    Shape { is_boundary: true, ..shape(kind) }
}

pub(super) fn unit_sphere(radius: f32) -> ShapeKind {
    ShapeKind::Sphere(Sphere {
        radius,
        z_min: -radius,
        z_max: radius,
        phi_max: std::f32::consts::TAU,
        to_shape: Affine3A::IDENTITY,
        inverse: glam::DMat3::IDENTITY,
    })
}

fn cross(geometry: &Arc<Geometry>, ray: &Ray) -> Vec<(f32, u32, bool)> {
    let mut crossings = Vec::new();
    build(geometry).boundaries(ray, &mut crossings);
    crossings.iter().map(|c| (c.t, c.shape.0, c.entering)).collect()
}

#[test]
fn nested_shapes_come_in_order_with_their_sides() {
    let geometry = top_level(vec![
        boundary(unit_sphere(1.0)),
        boundary(ShapeKind::Triangles(box_mesh(Vec3::splat(-2.0), Vec3::splat(2.0)))),
        shape(unit_sphere(0.5)),
        boundary(unit_sphere(3.0)),
    ]);
    let along = ray(Vec3::new(-10.0, 0.0, 0.0), Vec3::X);
    let found = cross(&geometry, &along);
    let distances = [7.0, 8.0, 9.0, 11.0, 12.0, 13.0];
    assert!(found.iter().zip(distances).all(|(&(t, ..), wanted)| near(t, wanted)), "{found:?}");
    let order: Vec<_> = found.iter().map(|&(_, shape, entering)| (shape, entering)).collect();
    assert_eq!(order, [(3, true), (1, true), (0, true), (0, false), (1, false), (3, false)]);
    assert_eq!(cross(&geometry, &Ray { t_max: 9.0, ..along }), found[..2]);
    // Boundaries block nothing; what is opaque is no boundary.
    let tracer = build(&geometry);
    assert_eq!(tracer.closest(&along).map(|hit| (hit.t, hit.shape.0)), Some((9.5, 2)));
    assert!(!tracer.occluded(&Ray { t_max: 9.5, ..along }));
}

#[test]
fn old_crossings_are_cleared_also_without_boundaries() {
    let tracer = build(&top_level(vec![shape(unit_sphere(1.0))]));
    let old = BoundaryCrossing { t: 1.0, shape: ShapeId(0), instance: None, entering: true };
    let mut crossings = vec![old];
    tracer.boundaries(&ray(Vec3::ZERO, Vec3::X), &mut crossings);
    assert!(crossings.is_empty());
}

#[test]
fn the_flip_turns_the_side_and_shading_normals_decide_it() {
    let quad = |normals: Vec<Vec3>| TriangleMesh {
        positions: vec![Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)],
        indices: vec![[0, 1, 2]],
        normals,
        ..TriangleMesh::default()
    };
    let patch = || BilinearMesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        indices: vec![[0, 1, 2, 3]],
        ..BilinearMesh::default()
    };
    let disk = || Disk {
        height: 0.0,
        radius: 1.0,
        inner_radius: 0.0,
        phi_max: std::f32::consts::TAU,
        to_shape: Affine3A::IDENTITY,
        inverse: glam::DMat3::IDENTITY,
    };
    let down = ray(Vec3::new(0.1, 0.2, 5.0), -Vec3::Z);
    let up = ray(Vec3::new(0.1, 0.2, -5.0), Vec3::Z);
    let sides = |kind: ShapeKind, flip_normal: bool| {
        let geometry = top_level(vec![Shape { flip_normal, ..boundary(kind) }]);
        let (down, up) = (cross(&geometry, &down), cross(&geometry, &up));
        assert_eq!((down.len(), up.len()), (1, 1));
        assert_ne!(down[0].2, up[0].2);
        down[0].2
    };
    // All of them look along +z: going down enters.
    assert!(sides(ShapeKind::Triangles(quad(vec![])), false));
    assert!(sides(ShapeKind::Bilinear(patch()), false));
    assert!(sides(ShapeKind::Disk(disk()), false));
    assert!(!sides(ShapeKind::Triangles(quad(vec![])), true));
    assert!(!sides(ShapeKind::Bilinear(patch()), true));
    assert!(!sides(ShapeKind::Disk(disk()), true));
    assert!(!sides(ShapeKind::Triangles(quad(vec![-Vec3::Z; 3])), false));
    assert!(sides(ShapeKind::Triangles(quad(vec![Vec3::Z; 3])), false));
}

/// Every ray through closed boundaries, instanced, mirrored and moving, enters as often as it leaves, in turn per shape.
#[test]
fn closed_boundaries_alternate() {
    let shapes = || vec![boundary(ShapeKind::Triangles(ball_mesh(Vec3::ZERO, 0.8, 3))), boundary(unit_sphere(0.5))];
    let transform = |scale: Vec3, x: f32| {
        MotionTransform::Fixed(Affine3A::from_scale_rotation_translation(
            scale,
            Quat::from_rotation_z(x),
            Vec3::new(x, 0.0, 0.0),
        ))
    };
    let transforms = vec![
        transform(Vec3::splat(1.0), -0.5),
        transform(Vec3::new(0.5, 1.5, 0.7), 0.5),
        transform(Vec3::new(0.5, -1.5, 0.7), 0.7),
    ];
    // A mirrored instance of a shape mirrors its normals with it: outward stays outward.
    let geometry = instanced(shapes(), transforms);
    let tracer = build(&geometry);
    let mut random = Random::new(40);
    let mut crossings = Vec::new();
    let mut total = 0;
    for _ in 0..4000 {
        tracer.boundaries(&random.inward_ray(), &mut crossings);
        assert!(crossings.is_sorted_by(|a, b| a.t <= b.t));
        for shape in 0..2 {
            for instance in 0..3 {
                let mut inside = false;
                let of = |c: &&BoundaryCrossing| c.shape.0 == shape && c.instance.is_some_and(|i| i.0 == instance);
                for crossing in crossings.iter().filter(of) {
                    assert_ne!(crossing.entering, inside, "{crossings:?}");
                    inside = crossing.entering;
                    total += 1;
                }
                assert!(!inside);
            }
        }
    }
    assert!(total > 10_000, "{total}");
}
