//! Area lights: densities, analytic irradiance, sides, distances.

use std::f64::consts::PI;

use super::*;
use crate::geometry::sampling::{patch_area_vector, patch_corners};
use crate::geometry::shape::Cylinder;
use crate::geometry::{Instance, MotionTransform, Prototype};
use crate::math::frame::Frame;
use crate::math::transform::Decomposed;

const SAMPLES: u32 = 200_000;

fn turned() -> Affine3A {
    Affine3A::from_scale_rotation_translation(
        Vec3::new(1.5, -0.5, 2.0),
        glam::Quat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0),
        Vec3::new(0.3, -2.0, 5.0),
    )
}

/// The point of a shape at given parameters, in the shape's space.
fn point_at(kind: &ShapeKind, primitive: u32, [u, v]: [f32; 2]) -> Vec3 {
    match kind {
        ShapeKind::Triangles(mesh) => {
            let [a, b, c] = crate::geometry::sampling::triangle_corners(mesh, primitive);
            a + (b - a) * u + (c - a) * v
        }
        ShapeKind::Bilinear(mesh) => {
            let [a, b, c, d] = patch_corners(mesh, primitive);
            a.lerp(b, u).lerp(c.lerp(d, u), v)
        }
        ShapeKind::Sphere(s) => {
            let (low, high) = ((s.z_min / s.radius).acos(), (s.z_max / s.radius).acos());
            let (theta, phi) = (low + (high - low) * v, u * s.phi_max);
            let p = s.radius * Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            s.to_shape.transform_point3(p)
        }
        ShapeKind::Disk(d) => {
            let (r, phi) = (d.radius + (d.inner_radius - d.radius) * v, u * d.phi_max);
            d.to_shape.transform_point3(Vec3::new(r * phi.cos(), r * phi.sin(), d.height))
        }
        ShapeKind::Cylinder(c) => {
            let (sin, cos) = (u * c.phi_max).sin_cos();
            c.to_shape.transform_point3(Vec3::new(c.radius * cos, c.radius * sin, c.z_min + (c.z_max - c.z_min) * v))
        }
        ShapeKind::Curves(_) => unreachable!("curves are not sampled"),
    }
}

/// χ² of the parameters drawn on a shape against the integral of its area density, with the point, normal and pdf checked too.
fn check_area_density(kind: ShapeKind, what: &str, seed: u64) {
    const BINS: usize = 12;
    let primitives = match &kind {
        ShapeKind::Triangles(mesh) => mesh.indices.len(),
        ShapeKind::Bilinear(mesh) => mesh.indices.len(),
        _ => 1,
    };
    let triangle = matches!(kind, ShapeKind::Triangles(_));
    let (geometry, lights) = one(kind, false, false);
    let shape = &geometry.shapes[0];
    let sampler = lights.area[0].sampler.as_ref().expect("it can be sampled");
    let mut stream = Stream::from_seed(seed);
    let mut counts = vec![0.0; primitives * BINS * BINS];
    for _ in 0..SAMPLES {
        let u = pair(&mut stream);
        let s = sampler.sample(shape, u, f64::from(stream.next_f32())).expect("it has a normal");
        let there = point_at(&shape.kind, s.primitive, s.parameters);
        assert!(there.distance(s.point.p) < 2e-3, "{what}: {there} {}", s.point.p);
        let pdf = sampler.pdf_area(shape, s.primitive, s.parameters, s.point.ng);
        assert!((pdf / s.point.pdf_area - 1.0).abs() < 1e-3, "{what}: {pdf} {}", s.point.pdf_area);
        let bin = s.parameters.map(|x| ((x * BINS as f32) as usize).min(BINS - 1));
        counts[(s.primitive as usize * BINS + bin[1]) * BINS + bin[0]] += 1.0;
    }
    const STEPS: usize = 16;
    let mut expected = vec![0.0; counts.len()];
    for primitive in 0..primitives {
        for k in 0..(BINS * STEPS).pow(2) {
            let cell = [k % (BINS * STEPS), k / (BINS * STEPS)];
            let step = 1.0 / (BINS * STEPS) as f32;
            let [u, v] = cell.map(|c| (c as f32 + 0.5) * step);
            if triangle && cell[0] + cell[1] >= BINS * STEPS {
                continue;
            }
            // Cells on the hypotenuse lie half inside.
            let share = if triangle && cell[0] + cell[1] == BINS * STEPS - 1 { 0.5 } else { 1.0 };
            let at = |du: f32, dv: f32| point_at(&shape.kind, primitive as u32, [u + du, v + dv]).as_dvec3();
            let h = 2e-3;
            let cross = (at(h, 0.0) - at(-h, 0.0)).cross(at(0.0, h) - at(0.0, -h)) / f64::from(4.0 * h * h);
            let pdf = sampler.pdf_area(shape, primitive as u32, [u, v], cross.normalize().as_vec3());
            let bin = (primitive * BINS + cell[1] / STEPS) * BINS + cell[0] / STEPS;
            expected[bin] += share * f64::from(pdf) * cross.length() * f64::from(step * step) * f64::from(SAMPLES);
        }
    }
    chi_squared(&counts, &expected, what);
}

#[test]
fn points_on_shapes_follow_their_area_density() {
    let triangles = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.2, 2.0, 0.5), Vec3::new(3.0, 1.0, -1.0)],
        indices: vec![[0, 1, 2], [2, 1, 3], [0, 0, 1]],
        ..Default::default()
    };
    check_area_density(ShapeKind::Triangles(triangles), "triangles", 1);
    let corners = [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.5, 1.5, 1.0)];
    check_area_density(patch(corners), "curved patch", 2);
    let patches = BilinearMesh {
        positions: [corners.as_slice(), &corners.map(|c| c * 0.5 - Vec3::Z)].concat(),
        indices: vec![[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5]],
        ..Default::default()
    };
    check_area_density(ShapeKind::Bilinear(patches), "patches", 3);
    // A triangle given as a patch: two corners are the same point.
    check_area_density(patch([Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Y]), "degenerate patch", 4);
    check_area_density(disk(turned(), 1.5, 0.0, std::f32::consts::TAU), "disk", 5);
    check_area_density(disk(turned(), 1.5, 0.5, 4.0), "part of a ring", 6);
    check_area_density(stretched_sphere(turned(), 0.7), "ellipsoid", 7);
    let ShapeKind::Sphere(mut part) = stretched_sphere(turned(), 0.7) else { unreachable!() };
    (part.z_min, part.z_max, part.phi_max) = (-0.6, 0.2, 5.0);
    let Sphere { to_shape, inverse, .. } = part;
    check_area_density(ShapeKind::Sphere(part), "part of an ellipsoid", 8);
    let cylinder = Cylinder { radius: 0.5, z_min: -1.0, z_max: 0.4, phi_max: 5.0, to_shape, inverse };
    check_area_density(ShapeKind::Cylinder(cylinder), "part of a stretched cylinder", 9);
}

#[test]
fn the_pdf_of_a_hit_is_the_pdf_of_the_sample() {
    let corners = [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.5, 1.5, 1.0)];
    let shapes = [
        quad(Vec3::ZERO, Vec3::X, Vec3::Y * 2.0),
        patch(corners),
        disk(turned(), 1.0, 0.2, 5.0),
        stretched_sphere(turned(), 1.0),
        sphere(Vec3::new(0.0, 0.0, 3.0), 4.0),
    ];
    for (seed, kind) in shapes.into_iter().enumerate() {
        let (geometry, lights) = one(kind, true, seed % 2 == 1);
        let mut stream = Stream::from_seed(seed as u64);
        let p = Vec3::new(0.4, 0.3, 4.0);
        let mut compared = 0;
        for _ in 0..10_000 {
            let (u, part) = (pair(&mut stream), f64::from(stream.next_f32()));
            let Some(sample) = lights.sample(&geometry, LightId(0), p, 0.0, u, part) else { continue };
            let hit = hit_of_sample(&geometry, &lights.area[0], u, part);
            assert!((hit.p - p).normalize().distance(sample.wi) < 1e-5);
            let pdf = lights.pdf(&geometry, LightId(0), p, &hit, sample.wi);
            assert!((pdf / sample.pdf - 1.0).abs() < 2e-3, "{pdf} {}", sample.pdf);
            compared += 1;
        }
        assert!(compared > 9_000);
    }
}

/// χ² of the directions to a sphere against the pdf that a ray to it reports.
fn check_cone(centre: Vec3, radius: f32, p: Vec3, seed: u64) {
    const BINS: usize = 16;
    let (geometry, lights) = one(sphere(centre, radius), false, false);
    let (distance, radius) = (f64::from(centre.distance(p)), f64::from(radius));
    let frame = Frame::from_z((centre - p).normalize());
    let sin = radius / distance;
    let one_minus_cos_max = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
    let mut counts = vec![0.0; BINS * BINS];
    let mut stream = Stream::from_seed(seed);
    let mut pdf = 0.0;
    for _ in 0..SAMPLES {
        let s =
            lights.sample(&geometry, LightId(0), p, 0.0, pair(&mut stream), 0.5).expect("it faces every point outside");
        let local = frame.to_local(s.wi).as_dvec3();
        let sin_squared = local.truncate().length_squared();
        let one_minus_cos = sin_squared / (1.0 + (1.0 - sin_squared).sqrt());
        let ring = one_minus_cos / one_minus_cos_max;
        assert!(ring < 1.0 + 1e-3, "outside the cone: {ring}");
        let turn = local.y.atan2(local.x) / (2.0 * PI) + 0.5;
        let bin = [ring, turn].map(|x| ((x * BINS as f64) as usize).min(BINS - 1));
        counts[bin[1] * BINS + bin[0]] += 1.0;
        pdf = f64::from(s.pdf);
        let hit = EmitterHit {
            shape: ShapeId(0),
            primitive: 0,
            parameters: [0.0; 2],
            instance: None,
            p: p + s.wi * s.segment(p).1,
            ng: -s.wi,
            uv: Vec2::ZERO,
            time: 0.0,
        };
        assert_eq!(lights.pdf(&geometry, LightId(0), p, &hit, s.wi), s.pdf);
    }
    // Rings of equal 1 − cos and equal turns are equal in solid angle.
    let solid_angle = 2.0 * PI * one_minus_cos_max / (BINS * BINS) as f64;
    let expected = vec![pdf * solid_angle * f64::from(SAMPLES); BINS * BINS];
    chi_squared(&counts, &expected, &format!("cone of {sin}"));
}

#[test]
fn directions_to_spheres_fill_their_cone() {
    let centre = Vec3::new(0.5, -1.0, 2.0);
    check_cone(centre, 1.0, centre + Vec3::new(0.3, 2.0, -1.0), 11);
    check_cone(centre, 1.0, centre + Vec3::Y * 1.0005, 12);
    check_cone(Vec3::ZERO, 0.01, Vec3::new(-3.0, 2.0, -1.0), 13);
}

#[test]
fn a_sphere_gives_its_analytic_irradiance() {
    // π L (r/d)² cos θ as long as it is above the horizon; to first order in rounding also at 10⁵ radii.
    for (seed, (distance, radius, tilt)) in
        [(1.05f32, 1.0f32, 0.0f32), (3.0, 1.0, 0.9), (1000.0, 0.01, 1.2), (2.0, 0.000_5, 0.3)].into_iter().enumerate()
    {
        let (geometry, lights) = one(sphere(Vec3::Z * distance, radius), false, false);
        let normal = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        let expected = PI * f64::from(radius / distance).powi(2) * f64::from(tilt.cos());
        irradiance(&geometry, &lights, 0, Vec3::ZERO, normal, SAMPLES, 20 + seed as u64).must_be(expected, "sphere");
    }
}

#[test]
fn from_inside_a_sphere_everything_glows() {
    for (seed, p) in [Vec3::ZERO, Vec3::new(0.7, 0.0, 0.0), Vec3::new(0.0, 0.97, 0.0)].into_iter().enumerate() {
        let (geometry, lights) = one(sphere(Vec3::ZERO, 1.0), false, true);
        irradiance(&geometry, &lights, 0, p, Vec3::Z, SAMPLES, 30 + seed as u64).must_be(PI, "inside");
        let stretched = stretched_sphere(Affine3A::from_scale(Vec3::new(1.0, 3.0, -1.2)), 1.0);
        // The map mirrors, so that building it would have said so.
        let (geometry, lights) = one(stretched, false, true);
        irradiance(&geometry, &lights, 0, p, Vec3::Z, SAMPLES, 40 + seed as u64).must_be(PI, "inside an ellipsoid");
        let (geometry, lights) = one(sphere(Vec3::ZERO, 1.0), false, false);
        assert!(lights.sample(&geometry, LightId(0), p, 0.0, [0.3, 0.6], 0.0).is_none(), "it emits outwards only");
    }
}

#[test]
fn flat_lights_give_their_form_factor() {
    let (w, l, h) = (2.0f64, 0.7, 1.3);
    let (a, b) = (w / h, l / h);
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    let expected = 0.5 * (term(a, b) + term(b, a));
    let (corner, x, y) = (Vec3::Z * h as f32, Vec3::X * w as f32, Vec3::Y * l as f32);
    let (geometry, lights) = one(quad(corner, y, x), false, false);
    irradiance(&geometry, &lights, 0, Vec3::ZERO, Vec3::Z, SAMPLES, 50).must_be(expected, "rectangle");
    let (geometry, lights) = one(patch([corner, corner + x, corner + y, corner + x + y]), false, true);
    irradiance(&geometry, &lights, 0, Vec3::ZERO, Vec3::Z, SAMPLES, 51).must_be(expected, "patch");
    let (r, inner) = (0.8f64, 0.3);
    let place = Affine3A::from_translation(corner);
    let (geometry, lights) = one(disk(place, r as f32, inner as f32, std::f32::consts::TAU), false, true);
    let factor = |r: f64| PI * r * r / (r * r + h * h);
    irradiance(&geometry, &lights, 0, Vec3::ZERO, Vec3::Z, SAMPLES, 52).must_be(factor(r) - factor(inner), "ring");
    // A whole disk that a scale of ½ made half as large, seen through its back by its second side.
    let (geometry, lights) = one(
        disk(place * Affine3A::from_scale(Vec3::splat(0.5)), 2.0 * r as f32, 0.0, std::f32::consts::TAU),
        true,
        false,
    );
    irradiance(&geometry, &lights, 0, Vec3::ZERO, Vec3::Z, SAMPLES, 53).must_be(factor(r), "disk");
}

#[test]
fn a_curved_patch_gives_its_integral() {
    let corners =
        [Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(-1.0, 1.0, 2.0), Vec3::new(1.0, 1.0, 1.2)];
    let (geometry, lights) = one(patch(corners), true, false);
    const STEPS: usize = 1000;
    let mut expected = 0.0;
    for k in 0..STEPS * STEPS {
        let uv = [k % STEPS, k / STEPS].map(|c| (c as f32 + 0.5) / STEPS as f32);
        let element = patch_area_vector(&corners, uv).as_dvec3() / (STEPS * STEPS) as f64;
        let q = point_at(&geometry.shapes[0].kind, 0, uv).as_dvec3();
        expected += element.dot(q.normalize()).abs() * q.normalize().z / q.length_squared();
    }
    irradiance(&geometry, &lights, 0, Vec3::ZERO, Vec3::Z, SAMPLES, 60).must_be(expected, "curved patch");
    // Power is π L A for both sides; the area once more, by finer steps.
    let area: f64 = (0..STEPS * STEPS)
        .map(|k| {
            f64::from(
                patch_area_vector(&corners, [k % STEPS, k / STEPS].map(|c| (c as f32 + 0.5) / STEPS as f32)).length(),
            )
        })
        .sum::<f64>()
        / (STEPS * STEPS) as f64;
    assert!((f64::from(lights.power(LightId(0))[0]) / (2.0 * PI * area) - 1.0).abs() < 1e-2);
}

#[test]
fn one_sided_lights_shine_to_the_side_of_their_normal_only() {
    let (geometry, lights) = one(quad(Vec3::ZERO, Vec3::X, Vec3::Y), false, false);
    let (front, back) = (Vec3::new(0.5, 0.5, 1.0), Vec3::new(0.5, 0.5, -1.0));
    let lit = |lights: &Lights, p| lights.sample(&geometry, LightId(0), p, 0.0, [0.4, 0.3], 0.2).is_some();
    assert!(lit(&lights, front) && !lit(&lights, back));
    assert_eq!(lights.emitted(LightId(0), Vec3::Z, Vec3::Z, Vec2::ZERO), Rgb::WHITE);
    assert_eq!(lights.emitted(LightId(0), Vec3::Z, -Vec3::Z, Vec2::ZERO), Rgb::BLACK);
    let (_, both) = one(quad(Vec3::ZERO, Vec3::X, Vec3::Y), true, false);
    assert!(lit(&both, front) && lit(&both, back));
    assert_eq!(both.emitted(LightId(0), Vec3::Z, -Vec3::Z, Vec2::ZERO), Rgb::WHITE);
    assert_eq!(both.power(LightId(0)), lights.power(LightId(0)) * 2.0);
}

#[test]
fn shadow_rays_end_before_the_light() {
    let mut stream = Stream::from_seed(70);
    for scale in [1e-3f32, 1.0, 1e4] {
        let centre = Vec3::new(3.0, -7.0, 11.0) * scale;
        let (geometry, lights) = one(sphere(centre, 0.5 * scale), false, false);
        let (flat_geometry, flat) = one(quad(centre, Vec3::X * scale, Vec3::Z * scale), true, false);
        for _ in 0..20_000 {
            let u = pair(&mut stream);
            let p = (Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32()) - 0.5) * 10.0 * scale;
            if let Some(s) = lights.sample(&geometry, LightId(0), p, 0.0, u, 0.0) {
                let to_centre = (centre - p).as_dvec3();
                let wi = s.wi.as_dvec3().normalize();
                let along = to_centre.dot(wi);
                let half = (f64::from(0.5 * scale)).powi(2) - (to_centre.length_squared() - along * along);
                let distance = f64::from(s.segment(p).1);
                if half >= 0.0 {
                    assert!(distance < along - half.sqrt(), "it would meet the sphere");
                }
                assert!(distance > 0.97 * (to_centre.length() - f64::from(0.5 * scale)), "too short");
            }
            if let Some(s) = flat.sample(&flat_geometry, LightId(0), p, 0.0, u, 0.0) {
                // From the receiver's point, and from where an offset has moved the ray's origin to.
                for origin in [p, p + Vec3::new(0.02, -0.05, 0.03) * scale] {
                    let (direction, distance) = s.segment(origin);
                    let t = f64::from(centre.y - origin.y) / f64::from(direction.y);
                    assert!(f64::from(distance) < t && f64::from(distance) > 0.98 * t, "{distance} of {t}");
                }
            }
        }
    }
}

#[test]
fn a_moving_emitter_is_sampled_where_it_is() {
    let (mut geometry, mut lights) = one(quad(Vec3::new(-1.0, -1.0, 0.0), Vec3::Y * 2.0, Vec3::X * 2.0), true, false);
    geometry.top_level.clear();
    geometry.prototypes.push(Prototype { shapes: vec![ShapeId(0)] });
    let key = |z: f64, scale: f64| {
        Box::new(
            Decomposed::new(&glam::DAffine3::from_scale_rotation_translation(
                glam::DVec3::new(scale, 1.0, 1.0),
                glam::DQuat::IDENTITY,
                glam::DVec3::Z * z,
            ))
            .expect("invertible"),
        )
    };
    let transform = MotionTransform::Moving { start: key(1.0, 1.0), end: key(3.0, 2.0) };
    geometry.instances.push(Instance { prototype: 0, transform });
    lights.area[0].instance = Some(InstanceId(0));
    let mut stream = Stream::from_seed(80);
    // Halfway it is a 3 × 2 rectangle at height 2: four times the form factor of a quarter.
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    let expected = 2.0 * (term(0.75, 0.5) + term(0.5, 0.75));
    let mut mean = Mean::default();
    for _ in 0..SAMPLES {
        let (u, part) = (pair(&mut stream), f64::from(stream.next_f32()));
        let s = lights.sample(&geometry, LightId(0), Vec3::ZERO, 0.5, u, part).expect("both sides shine");
        mean.add(f64::from(s.wi.z / s.pdf));
        let p = s.wi * (2.0 / s.wi.z);
        let parameters = [0.0; 2];
        let hit = EmitterHit {
            shape: ShapeId(0),
            primitive: 0,
            parameters,
            instance: Some(InstanceId(0)),
            p,
            ng: Vec3::Z,
            uv: Vec2::ZERO,
            time: 0.5,
        };
        assert!((lights.pdf(&geometry, LightId(0), Vec3::ZERO, &hit, s.wi) / s.pdf - 1.0).abs() < 1e-4);
    }
    mean.must_be(expected, "halfway");
}

#[test]
fn an_invisible_emitter_shines_by_sampling_alone() {
    let (geometry, mut lights) = one(quad(Vec3::ZERO, Vec3::X, Vec3::Y), true, false);
    lights.set_invisible(LightId(0));
    let s = lights.sample(&geometry, LightId(0), Vec3::Z, 0.0, [0.2, 0.7], 0.1).expect("it shines");
    assert!(s.is_delta && s.pdf > 0.0);
    let hit = hit_of_sample(&geometry, &lights.area[0], [0.2, 0.7], 0.1);
    assert_eq!(lights.pdf(&geometry, LightId(0), Vec3::Z, &hit, s.wi), 0.0);
}
