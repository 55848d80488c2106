//! Tiny and vast geometries: the answers are the same bits, times a power of two.

use glam::Vec3;

use super::backends::{Chequered, everything};
use super::boundaries::unit_sphere;
use super::*;
use crate::geometry::BoundaryCrossing;
use crate::geometry::curve::{CurveKind, Curves};
use crate::geometry::embree::boxes::Boxes;
use crate::geometry::embree::scale::{Scale, Scales};
use crate::geometry::shape::Sphere;

/// Hair of this kind, leaning over the origin.
fn hair(kind: CurveKind) -> Shape {
    let points = [(-0.8, 0.0, 0.1), (-0.2, 0.7, 0.0), (0.3, 0.6, -0.3), (0.9, -0.4, 0.2)].map(Vec3::from);
    shape(ShapeKind::Curves(Curves {
        kind,
        control_points: vec![points],
        widths: vec![[0.3, 0.1]],
        parameters: vec![[0.0, 1.0]],
        normals: if kind == CurveKind::Ribbon { vec![[Vec3::Z, Vec3::X]] } else { vec![] },
    }))
}

/// One of everything, `by` times as large; of that, objects themselves `within` times, and what is left by their instances.
fn made(by: f32, within: f32) -> Arc<Geometry> {
    let mut geometry = Arc::into_inner(everything()).expect("no one else has it");
    let first = geometry.shapes.len() as u32;
    geometry.shapes.extend([CurveKind::Flat, CurveKind::Flat, CurveKind::Ribbon].map(hair));
    geometry.top_level.push(ShapeId(first));
    geometry.prototypes[0].shapes.extend([first + 1, first + 2].map(ShapeId));
    for (id, shape) in geometry.shapes.iter_mut().enumerate() {
        let is_within = geometry.prototypes[0].shapes.contains(&ShapeId(id as u32));
        enlarge(&mut shape.kind, if is_within { within } else { by });
    }
    for instance in &mut geometry.instances {
        match &mut instance.transform {
            MotionTransform::Fixed(affine) => {
                affine.matrix3 *= by / within;
                affine.translation *= by;
            }
            MotionTransform::Moving { start, end } => {
                for key in [start, end] {
                    key.stretch *= f64::from(by / within);
                    key.translation *= f64::from(by);
                }
            }
        }
    }
    Arc::new(geometry)
}

fn enlarge(kind: &mut ShapeKind, by: f32) {
    match kind {
        ShapeKind::Triangles(mesh) => mesh.positions.iter_mut().for_each(|p| *p *= by),
        ShapeKind::Bilinear(mesh) => mesh.positions.iter_mut().for_each(|p| *p *= by),
        ShapeKind::Sphere(Sphere { radius, z_min, z_max, .. }) => {
            [radius, z_min, z_max].into_iter().for_each(|x| *x *= by)
        }
        ShapeKind::Curves(curves) => {
            curves.control_points.iter_mut().flatten().for_each(|p| *p *= by);
            curves.widths.iter_mut().flatten().for_each(|w| *w *= by);
        }
        ShapeKind::Disk(_) | ShapeKind::Cylinder(_) => unreachable!("there is none"),
    }
}

#[test]
fn answers_are_the_same_bits_at_any_size() {
    let build = |by, within| EmbreeTracer::build(made(by, within), Some(Arc::new(Chequered))).expect("well formed");
    let one = build(1.0, 1.0);
    // The last three: small objects shrunk more, objects shrunk into a small scene, and small objects enlarged into one of ordinary size.
    let pairs = [(-12, -12), (-40, -40), (-50, -50), (41, 41), (57, 57), (-60, -30), (-38, 0), (0, -40)];
    for (power, within) in pairs {
        let by = 2f32.powi(power);
        let sized = build(by, 2f32.powi(within));
        let mut random = Random::new(70);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let (mut hits, mut crossings, mut blocked) = ([0; 2], 0, 0);
        for opacity_seed in 0..4000 {
            let ray =
                Ray { time: random.unit(), t_max: 2.0 + 3.0 * random.unit(), opacity_seed, ..random.inward_ray() };
            let larger = Ray { origin: ray.origin * by, t_max: ray.t_max * by, ..ray };
            let [hit, same] = [one.closest(&ray), sized.closest(&larger)];
            let told =
                |hit: &crate::geometry::RayHit, by: f32| (hit.t * by, hit.shape, hit.instance, hit.primitive, hit.uv);
            assert_eq!(hit.map(|hit| told(&hit, by)), same.map(|hit| told(&hit, 1.0)), "2^{power}: {ray:?}");
            hits[usize::from(hit.is_some_and(|hit| hit.instance.is_some()))] += usize::from(hit.is_some());
            assert_eq!(one.occluded(&ray), sized.occluded(&larger), "2^{power}: {ray:?}");
            blocked += usize::from(one.occluded(&ray));
            one.boundaries(&ray, &mut a);
            sized.boundaries(&larger, &mut b);
            let told = |c: &BoundaryCrossing, by: f32| (c.t * by, c.shape, c.instance, c.entering);
            assert!(a.iter().map(|c| told(c, by)).eq(b.iter().map(|c| told(c, 1.0))), "2^{power}: {ray:?}");
            crossings += a.len();
        }
        assert!(
            hits.iter().all(|&hits| hits > 300) && blocked > 1000 && crossings > 2000,
            "{hits:?} {blocked} {crossings}"
        );
    }
}

#[test]
fn rays_from_a_boundary_cross_it_at_any_size() {
    let crossings = |power: i32| {
        let by = 2f32.powi(power);
        let mesh = box_mesh(-Vec3::ONE, Vec3::new(1.0, 2.0, 1.5));
        let boundaries = [ShapeKind::Triangles(mesh), unit_sphere(1.0)].map(|mut kind| {
            enlarge(&mut kind, by);
            Shape { is_boundary: true, ..shape(kind) }
        });
        let mut crossings = Vec::new();
        build(&top_level(boundaries.into())).boundaries(&ray(-by * Vec3::X, Vec3::X), &mut crossings);
        crossings.iter().map(|c| (c.t / by, c.shape.0, c.entering)).collect::<Vec<_>>()
    };
    let one = crossings(0);
    assert_eq!(one.iter().filter(|&&(t, _, entering)| t == 0.0 && entering).count(), 2, "{one:?}");
    assert_eq!(one.iter().filter(|&&(t, _, entering)| near(t, 2.0) && !entering).count(), 2, "{one:?}");
    for power in [-12, -50, 50] {
        assert_eq!(crossings(power), one, "2^{power}");
    }
}

#[test]
fn ordinary_scenes_keep_their_units() {
    for by in [0.01, 1.0, 1e10] {
        let scales = Scales::new(&Boxes::new(&made(by, by)));
        assert_eq!((scales.render, scales.prototypes.as_slice()), (Scale::ONE, [Scale::ONE].as_slice()));
    }
    // Neither what has no size nor what Embree leaves out decides on units.
    let point = |at: Vec3| TriangleMesh { positions: vec![at; 3], indices: vec![[0, 1, 2]], ..TriangleMesh::default() };
    let scale = |points: &[Vec3]| {
        Scales::new(&Boxes::new(&top_level(points.iter().map(|&p| shape(ShapeKind::Triangles(point(p)))).collect())))
            .render
    };
    for points in [&[][..], &[Vec3::ZERO], &[Vec3::ONE, Vec3::splat(1e30)], &[Vec3::ONE, Vec3::NAN]] {
        assert_eq!(scale(points), Scale::ONE, "{points:?}");
    }
    assert_eq!(scale(&[Vec3::X * 3e-6, Vec3::splat(1e30)]).to_embree, 2f32.powi(19));
    assert_eq!(scale(&[Vec3::splat(1e18)]).to_embree, 2f32.powi(-21));
    assert_eq!(scale(&[Vec3::splat(1e-40)]).to_embree, 2f32.powi(64));
}
