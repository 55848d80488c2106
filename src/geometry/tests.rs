//! Surface points: error bounds against f64, hits against points, orientation, partial quadrics.

use glam::{Affine3A, DVec3, Quat, Vec3};

use super::curve::CurveKind;
use super::fixtures::*;
use super::shape::{Disk, Sphere, TriangleMesh};
use super::{Geometry, InstanceId, MotionTransform, RayHit, Shape, ShapeId, ShapeKind};

fn hit(uv: [f32; 2], primitive: u32, instance: Option<InstanceId>) -> RayHit {
    RayHit { t: 1.0, shape: ShapeId(0), instance, primitive, uv }
}

/// A ray aimed at the point with given parameters hits it, and the hit's parameters give that point back.
#[test]
fn hits_and_points_agree_for_every_shape() {
    let mut random = Random(3);
    let mut seen = 0;
    for shape in one_of_each(&mut random, 2.0) {
        for _ in 0..400 {
            let primitive = (random.next() % u64::from(shape.primitive_count())) as u32;
            let mut uv = [random.unit() * 0.98 + 0.01, random.unit() * 0.98 + 0.01];
            if matches!(shape.kind, ShapeKind::Triangles(_)) && uv[0] + uv[1] > 1.0 {
                uv = [1.0 - uv[0], 1.0 - uv[1]];
            }
            let curves = match &shape.kind {
                ShapeKind::Curves(curves) => Some(curves),
                _ => None,
            };
            // Rays that see a curve side on, at its middle: the ribbon's far edges depend on how it is cut.
            let mut direction = random.direction();
            if curves.is_some() {
                uv[0] = 0.5;
                let tangent = shape.point(primitive, uv, direction).dpdu;
                direction = tangent.cross(direction).normalize_or_zero();
                if direction == Vec3::ZERO {
                    continue;
                }
            }
            let aimed = shape.point(primitive, uv, direction);
            if curves.is_none() && aimed.ng.dot(direction).abs() < 0.05 {
                // Rounding may take a grazing ray past the surface.
                continue;
            }
            let target = aimed.p;
            let origin = target - direction * 3.0;
            // Something nearer on the same primitive may hide it.
            let Some((t, found)) = shape.intersect(primitive, origin, direction, 0.0, f32::INFINITY) else {
                let ribbon = curves.is_some_and(|c| c.kind == CurveKind::Ribbon);
                assert!(ribbon, "no hit at {uv:?} of {shape:?} along {direction}");
                continue;
            };
            assert!(t <= 3.0 + 1e-3, "{t}");
            let back = shape.point(primitive, found, direction).p;
            let at = origin + direction * t;
            // Curves are cut into straight pieces to a twentieth of their width, and twisted ribbons turn within them.
            let ribbon = curves.is_some_and(|c| c.kind == CurveKind::Ribbon);
            let tolerance = if ribbon {
                0.2
            } else if curves.is_some() {
                0.02
            } else {
                1e-4
            };
            assert!(back.distance(at) < tolerance, "{back} against {at} on {shape:?}");
            seen += 1;
        }
    }
    assert!(seen > 4000, "{seen}");
}

#[test]
fn error_bounds_hold_the_exact_point() {
    let mut random = Random(21);
    for i in 0..2000 {
        let far = [0.0f32, 1.0, 1e3, 1e6][i % 4];
        let instance = placement(&mut random, far);
        let to_render = |p: DVec3| glam::Mat4::from(instance).as_dmat4().transform_point3(p);
        let (object, exact, uv): (Shape, DVec3, [f32; 2]) = if i % 2 == 0 {
            let p = [random.vector(far + 1.0), random.vector(far + 1.0), random.vector(far + 1.0)];
            let uv = [0.5 * random.unit(), 0.5 * random.unit()];
            let [a, b, c] = p.map(Vec3::as_dvec3);
            let (u, v) = (f64::from(uv[0]), f64::from(uv[1]));
            (shape(soup_mesh(&[p])), a * (1.0 - u - v) + b * u + c * v, uv)
        } else {
            let place = placement(&mut random, far);
            let uv = [random.unit(), random.unit()];
            let phi = f64::from(uv[0]) * f64::from(std::f32::consts::TAU);
            let theta = std::f64::consts::PI * (1.0 - f64::from(uv[1]));
            let p = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()) * 3.0;
            let exact = glam::Mat4::from(place).as_dmat4().transform_point3(p);
            (shape(ShapeKind::Sphere(sphere(3.0, place))), exact, uv)
        };
        let r = ray(Vec3::ZERO, Vec3::Z);
        let check = |point: super::SurfacePoint, exact: DVec3| {
            let off = (point.p.as_dvec3() - exact).abs();
            assert!(off.cmple(point.p_error.as_dvec3()).all(), "{off} beyond {}", point.p_error);
            // And not absurdly wide: a few dozen units in the last place of everything involved.
            assert!(point.p_error.max_element() < 1e-5 * (far + 10.0), "{}", point.p_error);
        };
        let placed = instanced(object, MotionTransform::Fixed(instance));
        check(placed.surface_point(&r, &hit(uv, 0, Some(InstanceId(0)))), to_render(exact));
        let direct = geometry_of(placed.shapes);
        check(direct.surface_point(&r, &hit(uv, 0, None)), exact);
    }
}

fn facing(geometry: &Geometry, origin: Vec3, direction: Vec3, instance: bool) -> f32 {
    let id = instance.then_some(InstanceId(0));
    let (o, d) = match id {
        Some(_) => geometry.instances[0].transform.ray_to_local(0.0, origin, direction).unwrap(),
        None => (origin, direction),
    };
    let (t, uv) = geometry.shapes[0].intersect(0, o, d, 0.0, f32::INFINITY).expect("aimed at it");
    let r = ray(origin, direction);
    let point = geometry.surface_point(&r, &RayHit { t, ..hit(uv, 0, id) });
    assert!((point.ng.length() - 1.0).abs() < 1e-5 && point.ns.dot(point.ng) > 0.0);
    let local = geometry.shapes[0].oriented_normal(0, uv, d);
    assert_eq!(local.dot(d) > 0.0, point.ng.dot(direction) > 0.0, "both agree about the side");
    point.ng.dot(-direction)
}

#[test]
fn normals_follow_the_rules_of_orientation() {
    let flipped = |mut shape: Shape| {
        shape.flip_normal = true;
        shape
    };
    let ball = || shape(ShapeKind::Sphere(sphere(1.0, Affine3A::from_scale(Vec3::new(1.0, 2.0, 0.5)))));
    let down = |geometry: &Geometry| facing(geometry, Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z, false);
    assert!(down(&geometry_of(vec![ball()])) > 0.0, "spheres face outward");
    assert!(down(&geometry_of(vec![flipped(ball())])) < 0.0);
    // A mirror does not turn a normal that its transform carries.
    let mirror = MotionTransform::Fixed(Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)));
    assert!(facing(&instanced(ball(), mirror), Vec3::new(0.1, 0.2, 5.0), Vec3::NEG_Z, true) > 0.0);

    let disk = || {
        let (to_shape, inverse) = (Affine3A::IDENTITY, glam::DMat3::IDENTITY);
        shape(ShapeKind::Disk(Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: 7.0, to_shape, inverse }))
    };
    assert!(down(&geometry_of(vec![disk()])) > 0.0, "disks face +z");
    assert!(down(&geometry_of(vec![flipped(disk())])) < 0.0);

    let triangle = |normal: Option<Vec3>| {
        shape(ShapeKind::Triangles(TriangleMesh {
            positions: vec![-Vec3::ONE, Vec3::new(3.0, -1.0, -1.0), Vec3::new(-1.0, 3.0, -1.0)],
            indices: vec![[0, 1, 2]],
            normals: normal.map_or(vec![], |n| vec![n; 3]),
            uvs: vec![],
        }))
    };
    assert!(down(&geometry_of(vec![triangle(None)])) > 0.0, "counterclockwise faces us");
    assert!(down(&geometry_of(vec![flipped(triangle(None))])) < 0.0);
    let tilted = Vec3::new(0.5, 0.0, -1.0);
    assert!(down(&geometry_of(vec![triangle(Some(tilted))])) < 0.0, "the mesh's normals decide");
    assert!(down(&geometry_of(vec![flipped(triangle(Some(tilted)))])) < 0.0, "and the flip does not");
}

#[test]
fn partial_quadrics_lack_what_was_cut() {
    let (to_shape, inverse) = (Affine3A::IDENTITY, glam::DMat3::IDENTITY);
    let half_turn = std::f32::consts::PI;
    let s = Sphere { radius: 2.0, z_min: -1.0, z_max: 1.0, phi_max: half_turn, to_shape, inverse };
    let at = |o: Vec3, d: Vec3| s.intersect(o, d, 0.0, f32::INFINITY);
    assert!(at(Vec3::new(0.1, 0.1, 9.0), Vec3::NEG_Z).is_none(), "open above and below");
    let (t, uv) = at(Vec3::new(0.0, 9.0, 0.0), Vec3::NEG_Y).unwrap();
    assert!((t - 7.0).abs() < 1e-5 && (uv[0] - 0.5).abs() < 1e-5 && (uv[1] - 0.5).abs() < 1e-5, "{t} {uv:?}");
    let (t, _) = at(Vec3::new(0.0, -9.0, 0.0), Vec3::Y).unwrap();
    assert!((t - 11.0).abs() < 1e-5, "through the missing half to the inside of the other");
    assert!(s.intersect(Vec3::new(0.0, -9.0, 0.0), Vec3::Y, 0.0, 11.0).is_none(), "t_max is open");

    let d = Disk { height: 1.0, radius: 2.0, inner_radius: 1.0, phi_max: half_turn, to_shape, inverse };
    let down = |x: f32, y: f32| d.intersect(Vec3::new(x, y, 3.0), Vec3::NEG_Z * 2.0, 0.0, f32::INFINITY);
    let (t, uv) = down(0.0, 1.5).unwrap();
    assert_eq!(t, 1.0, "t counts in lengths of the direction");
    assert!((uv[0] - 0.5).abs() < 1e-6 && (uv[1] - 0.5).abs() < 1e-6);
    assert!(down(0.0, 0.5).is_none() && down(0.0, -1.5).is_none() && down(0.0, 2.5).is_none());
}

#[test]
fn boxes_hold_their_primitives() {
    let mut random = Random(31);
    for shape in one_of_each(&mut random, 3.0) {
        for _ in 0..500 {
            let primitive = (random.next() % u64::from(shape.primitive_count())) as u32;
            let (u, v) = (random.unit(), random.unit());
            let uv = if matches!(shape.kind, ShapeKind::Triangles(_)) { [u * (1.0 - v), v] } else { [u, v] };
            let p = shape.point(primitive, uv, random.direction()).p;
            let (low, high) = shape.bounds(primitive);
            assert!(p.cmpge(low - 1e-6).all() && p.cmple(high + 1e-6).all(), "{p} outside {low}..{high}");
        }
    }
}

#[test]
fn moving_instances_are_where_their_time_puts_them() {
    let key = |x: f64| {
        Box::new(
            crate::math::transform::Decomposed::new(&glam::DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)))
                .expect("invertible"),
        )
    };
    let geometry = instanced(
        shape(ShapeKind::Sphere(sphere(1.0, Affine3A::from_quat(Quat::IDENTITY)))),
        MotionTransform::Moving { start: key(0.0), end: key(10.0) },
    );
    let mut r = ray(Vec3::new(5.0, 0.0, 9.0), Vec3::NEG_Z);
    r.time = 0.5;
    let point = geometry.surface_point(&r, &hit([0.0, 1.0], 0, Some(InstanceId(0))));
    assert!(point.p.distance(Vec3::new(5.0, 0.0, 1.0)) < 1e-5, "{}", point.p);
}

/// A small step over a surface is the step of its texture coordinates times the partial derivatives.
#[test]
fn partial_derivatives_are_those_of_the_points() {
    let mut random = Random(77);
    let mut seen = 0;
    for shape in one_of_each(&mut random, 2.0) {
        let is_cylinder = matches!(&shape.kind, ShapeKind::Curves(curves) if curves.kind == CurveKind::Cylinder);
        let is_curve = matches!(shape.kind, ShapeKind::Curves(_));
        let count = shape.primitive_count();
        let geometry = geometry_of(vec![shape]);
        for _ in 0..50 {
            let primitive = (random.next() % u64::from(count)) as u32;
            let step = 1e-2;
            // Off the middle a curve's edge is not parallel to it.
            let uv = [if is_curve { 0.5 } else { 0.05 + 0.4 * random.unit() }, 0.05 + 0.4 * random.unit()];
            let ray = ray(Vec3::ZERO, random.direction());
            let at = |uv| geometry.surface_point(&ray, &hit(uv, primitive, None));
            let partials = geometry.partials(&ray, &hit(uv, primitive, None));
            for axis in 0..2 {
                // The width is seen round where a curve is a cylinder.
                if is_cylinder && axis == 0 {
                    continue;
                }
                let (mut before, mut after) = (uv, uv);
                before[axis] -= step;
                after[axis] += step;
                let (a, b) = (at(before), at(after));
                let duv = b.uv - a.uv;
                let expected = partials.dpdu * duv.x + partials.dpdv * duv.y;
                let size = (b.p - a.p).length();
                assert!((b.p - a.p).distance(expected) < 0.03 * size + 1e-5, "{axis} {uv:?}: {} {expected}", b.p - a.p);
                seen += 1;
            }
        }
    }
    assert!(seen > 400, "{seen}");
}
