//! Moving instances against [`MotionTransform::at`].

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use super::*;
use crate::geometry::embree::{motion, scale::Scale};
use crate::math::transform::Decomposed;

fn moving(start: DAffine3, end: DAffine3) -> MotionTransform {
    MotionTransform::Moving {
        start: Box::new(Decomposed::new(&start).expect("invertible")),
        end: Box::new(Decomposed::new(&end).expect("invertible")),
    }
}

/// Rigid, uniformly scaled, stretched along skew axes, mirrored, and turned by nearly half a turn.
fn motions() -> Vec<(&'static str, MotionTransform)> {
    let turn = |angle: f64| DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle);
    let rigid = |angle: f64, x: f64| DAffine3::from_rotation_translation(turn(angle), DVec3::new(x, 0.2 * x, 0.0));
    let stretch = DAffine3::from_mat3(DMat3::from_cols(
        DVec3::new(1.2, 0.3, 0.0),
        DVec3::new(0.3, 0.7, 0.1),
        DVec3::new(0.0, 0.1, 0.9),
    ));
    let mirror = DAffine3::from_scale(DVec3::new(1.0, -0.8, 1.1));
    vec![
        ("translation", moving(rigid(0.0, -0.5), rigid(0.0, 0.5))),
        ("quarter turn", moving(rigid(0.0, 0.0), rigid(1.57, 0.0))),
        ("nearly half a turn", moving(rigid(0.1, -0.2), rigid(3.1, 0.3))),
        ("growth", moving(rigid(0.3, 0.0) * DAffine3::from_scale(DVec3::splat(0.5)), rigid(1.0, 0.0))),
        ("constant stretch", moving(rigid(0.2, 0.0) * stretch, rigid(1.4, 0.2) * stretch)),
        ("changing stretch", moving(rigid(0.2, 0.0), rigid(1.4, 0.2) * stretch)),
        ("mirrored", moving(rigid(0.2, 0.0) * mirror, rigid(1.4, 0.2) * mirror)),
    ]
}

#[test]
fn interpolation_agrees_with_ours() {
    let device = ::embree::Device::new(1).expect("Embree starts");
    let scene = Arc::new(::embree::SceneBuilder::new(&device, true).and_then(|s| s.commit()).expect("an empty scene"));
    for (name, motion) in motions() {
        let made = motion::instance(&device, &scene, &motion, Scale::ONE, Scale::ONE)
            .expect("well formed")
            .expect("invertible");
        let mut random = Random::new(50);
        let mut largest = 0.0f32;
        for _ in 0..500 {
            let time = random.unit();
            let found = Affine3A::from_cols_array(&made.transform_at(time).expect("an instance"));
            let wanted = motion.at(time);
            for p in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ZERO] {
                largest = largest.max(found.transform_point3(p).distance(wanted.transform_point3(p)));
            }
        }
        assert!(largest < 4e-6, "{name}: {largest:e}");
    }
}

#[test]
fn rays_at_many_times_agree_with_brute_force() {
    for (name, motion) in motions() {
        println!("{name}");
        let shapes = vec![shape(ShapeKind::Triangles(box_mesh(Vec3::new(-0.9, -0.3, -0.5), Vec3::new(0.7, 0.4, 0.5))))];
        agrees_with_brute_force(&instanced(shapes, vec![motion]), 3000, 51, 3, 2e-5);
    }
}
