//! Emissive meshes whose primitives a hierarchy chooses among: the same light, the pdf that says how, and less noise.

use glam::Mat3;

use super::*;
use crate::geometry::sampling::triangle_corners;
use crate::geometry::{Instance, MotionTransform, Prototype};
use crate::math::transform::Decomposed;

/// A ring in the xy plane: a tube of radius `tube` around a circle of radius `ring`, of `around` × `across` quadrilaterals. Normals point out of
/// the tube.
fn torus(ring: f32, tube: f32, around: u32, across: u32) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let mut positions = vec![];
    for i in 0..around {
        for k in 0..across {
            let (a, b) = [(i, around), (k, across)].map(|(i, n)| std::f32::consts::TAU * i as f32 / n as f32).into();
            let r = ring + tube * b.cos();
            positions.push(Vec3::new(r * a.cos(), r * a.sin(), tube * b.sin()));
        }
    }
    let at = |i: u32, k: u32| (i % around) * across + k % across;
    let cells = (0..around).flat_map(|i| (0..across).map(move |k| (i, k)));
    let indices = cells.map(|(i, k)| [at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)]).collect();
    (positions, indices)
}

fn triangle_ring(around: u32, across: u32) -> ShapeKind {
    let (positions, quads) = torus(10.0, 0.1, around, across);
    let indices = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [c, b, d]]).collect();
    ShapeKind::Triangles(TriangleMesh { positions, indices, ..Default::default() })
}

fn patch_ring(around: u32, across: u32) -> ShapeKind {
    let (positions, indices) = torus(10.0, 0.1, around, across);
    ShapeKind::Bilinear(BilinearMesh { positions, indices, ..Default::default() })
}

/// The same lights, primitives chosen by area.
fn by_area(geometry: &Geometry, lights: &Lights) -> Lights {
    let mut other = Lights::default();
    for light in &lights.area {
        let sampler = ShapeSampler::new(&geometry.shapes[light.shape.0 as usize].kind);
        other.area.push(AreaLight { sampler, parts: None, ..light.clone() });
    }
    other
}

/// Points close to the ring, within it and far from it.
const POINTS: [Vec3; 5] = [
    Vec3::new(10.3, 0.0, 0.05),
    Vec3::new(0.0, 9.0, 0.5),
    Vec3::new(1.0, 2.0, 0.0),
    Vec3::new(7.0, 7.2, -1.0),
    Vec3::new(30.0, -50.0, 40.0),
];

#[test]
fn the_tree_gives_the_light_that_a_choice_by_area_gives() {
    for (seed, (kind, two_sided, flip)) in [
        (triangle_ring(40, 5), false, false),
        (patch_ring(40, 5), false, false),
        (patch_ring(20, 3), true, true),
        (triangle_ring(40, 5), false, true),
    ]
    .into_iter()
    .enumerate()
    {
        let (geometry, lights) = one(kind, two_sided, flip);
        assert!(lights.area[0].parts.is_some() && lights.area[0].sampler.as_ref().is_some_and(|s| s.memory() == 0));
        let plain = by_area(&geometry, &lights);
        for (i, p) in POINTS.into_iter().enumerate() {
            let seed = (10 * seed + i) as u64;
            let n = Vec3::new(-0.3, 0.2, 0.9).normalize();
            let a = irradiance(&geometry, &lights, 0, p, n, 200_000, seed);
            let b = irradiance(&geometry, &plain, 0, p, n, 800_000, 1000 + seed);
            let error = a.error().hypot(b.error());
            assert!((a.mean - b.mean).abs() <= 4.5 * error + 2e-5 * b.mean, "{p}: {} {} ± {error}", a.mean, b.mean);
            assert!(error < 0.1 * b.mean || b.mean == 0.0, "{error} of {}", b.mean);
        }
    }
}

/// Where a sample of the light lies on its shape: primitive and parameters, found by what is nearest.
fn nearest(mesh: &TriangleMesh, p: Vec3) -> (u32, [f32; 2]) {
    let distance = |i: &u32| {
        let [a, b, c] = triangle_corners(mesh, *i);
        let n = (b - a).cross(c - a);
        let inside = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).cross(p - from).dot(n) / n.length_squared());
        let outside = inside.iter().fold(0.0f32, |least, &w| least.min(w)).abs();
        (p - a).dot(n.normalize()).abs() + outside
    };
    let best = (0..mesh.indices.len() as u32).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("it has some");
    (best, [0.3, 0.3])
}

#[test]
fn the_pdf_of_a_hit_is_the_pdf_of_the_sample() {
    let stretched = Affine3A::from_mat3_translation(
        Mat3::from_cols(Vec3::new(0.5, 0.1, 0.0), Vec3::new(-0.4, 0.3, 0.2), Vec3::new(0.0, 0.5, -1.5)),
        Vec3::new(1.0, 2.0, 3.0),
    );
    for (seed, transform) in [None, Some(stretched)].into_iter().enumerate() {
        let (mut geometry, mut lights) = one(triangle_ring(30, 4), true, false);
        if let Some(m) = transform {
            geometry.top_level.clear();
            geometry.prototypes.push(Prototype { shapes: vec![ShapeId(0)] });
            geometry.instances.push(Instance { prototype: 0, transform: MotionTransform::Fixed(m) });
            lights.area[0].instance = Some(InstanceId(0));
        }
        let m = transform.unwrap_or(Affine3A::IDENTITY);
        let ShapeKind::Triangles(mesh) = &geometry.shapes[0].kind else { unreachable!() };
        let mut stream = Stream::from_seed(seed as u64);
        let p = m.transform_point3(Vec3::new(9.0, 1.0, 0.6));
        let (mut counts, mut expected) = (vec![0.0; mesh.indices.len()], vec![0.0; mesh.indices.len()]);
        const SAMPLES: u32 = 20_000;
        let mut compared = 0;
        for _ in 0..SAMPLES {
            let (u, part) = (pair(&mut stream), selector::choice(stream.next_f32(), stream.next_f32()));
            let s = lights.sample(&geometry, LightId(0), p, 0.0, u, part).expect("both sides shine");
            let LightEnd::Point { p: end, ng, .. } = s.end else { panic!("it ends on a triangle") };
            let (primitive, parameters) = nearest(mesh, m.inverse().transform_point3(end));
            counts[primitive as usize] += 1.0;
            let hit = hit(primitive, parameters, end, ng, transform.map(|_| InstanceId(0)));
            let pdf = lights.pdf(&geometry, LightId(0), p, &hit, s.wi);
            // A point near an edge may be taken for the neighbour's.
            compared += usize::from((pdf / s.pdf - 1.0).abs() < 2e-3);
        }
        assert!(compared > SAMPLES as usize * 97 / 100, "{compared}");
        // ∫ pdf over each triangle, by its middle and the weights of a quadrature with 36 points.
        for i in 0..mesh.indices.len() as u32 {
            let [a, b, c] = triangle_corners(mesh, i).map(|v| m.transform_point3(v));
            let normal = (b - a).cross(c - a);
            let ng = normal.normalize();
            const STEPS: u32 = 6;
            for k in 0..STEPS * STEPS {
                let [mut u, mut v] = [k % STEPS, k / STEPS].map(|i| (i as f32 + 0.5) / STEPS as f32);
                if u + v > 1.0 {
                    (u, v) = (1.0 - v, 1.0 - u);
                }
                let q = a + (b - a) * u + (c - a) * v;
                let wi = (q - p).normalize();
                let hit = hit(i, [u, v], q, ng, transform.map(|_| InstanceId(0)));
                let area = f64::from(0.5 * normal.length()) / f64::from(STEPS * STEPS);
                let per_area =
                    lights.pdf(&geometry, LightId(0), p, &hit, wi) * ng.dot(wi).abs() / (q - p).length_squared();
                expected[i as usize] += f64::from(SAMPLES) * f64::from(per_area) * area;
            }
        }
        chi_squared(&counts, &expected, "primitives");
    }
}

fn hit(primitive: u32, parameters: [f32; 2], p: Vec3, ng: Vec3, instance: Option<InstanceId>) -> EmitterHit {
    EmitterHit { shape: ShapeId(0), primitive, parameters, instance, p, ng, uv: Vec2::ZERO, time: 0.0 }
}

#[test]
fn a_moving_mesh_is_seen_where_it_is() {
    let (mut geometry, mut lights) = one(triangle_ring(40, 5), false, false);
    geometry.top_level.clear();
    geometry.prototypes.push(Prototype { shapes: vec![ShapeId(0)] });
    let key = |z: f64, angle: f64| {
        let scale = glam::DVec3::new(1.0, 0.8, 1.2);
        let rotation = glam::DQuat::from_rotation_x(angle);
        let m = glam::DAffine3::from_scale_rotation_translation(scale, rotation, glam::DVec3::Z * z);
        Box::new(Decomposed::new(&m).expect("invertible"))
    };
    let transform = MotionTransform::Moving { start: key(1.0, 0.0), end: key(3.0, 1.0) };
    geometry.instances.push(Instance { prototype: 0, transform });
    lights.area[0].instance = Some(InstanceId(0));
    let plain = by_area(&geometry, &lights);
    let estimate = |lights: &Lights, p: Vec3, seed| {
        let mut stream = Stream::from_seed(seed);
        let mut mean = Mean::default();
        for _ in 0..300_000 {
            let part = selector::choice(stream.next_f32(), stream.next_f32());
            let s = lights.sample(&geometry, LightId(0), p, 0.7, pair(&mut stream), part);
            mean.add(s.map_or(0.0, |s| f64::from(s.radiance[0] / s.pdf)));
        }
        mean
    };
    for (seed, p) in [Vec3::new(0.0, 0.0, 2.0), Vec3::new(9.5, 0.5, 2.0)].into_iter().enumerate() {
        let (a, b) = (estimate(&lights, p, seed as u64), estimate(&plain, p, 10 + seed as u64));
        let error = a.error().hypot(b.error());
        assert!((a.mean - b.mean).abs() <= 4.5 * error && error < 0.05 * b.mean, "{} {} ± {error}", a.mean, b.mean);
        assert!(a.error() < b.error(), "{} {}", a.error(), b.error());
    }
}

#[test]
fn near_a_long_light_the_tree_is_far_less_noisy() {
    let (geometry, lights) = one(triangle_ring(200, 5), false, false);
    let plain = by_area(&geometry, &lights);
    let (n, p) = (Vec3::Z, Vec3::new(10.0, 0.0, -0.5));
    let [a, b] = [&lights, &plain].map(|lights| irradiance(&geometry, lights, 0, p, n, 100_000, 5));
    assert!(a.error() < 0.25 * b.error(), "{} {}", a.error(), b.error());
    let bytes = lights.memory() - size_of::<AreaLight>() * lights.area.capacity();
    assert!(bytes <= 74 * 2000, "{bytes}");
    let few = one(quad(Vec3::ZERO, Vec3::X, Vec3::Y), false, false).1;
    assert!(few.area[0].parts.is_none(), "two triangles need no tree");
}

/// Prints variance × time by area over that by tree: `cargo test --lib light::tests::mesh_tree::figures -- --ignored --nocapture`.
#[test]
#[ignore = "prints figures"]
fn figures() {
    for (name, around, across) in
        [("16", 4, 2), ("32", 8, 2), ("64", 16, 2), ("128", 32, 2), ("2000", 200, 5), ("20000", 1000, 10)]
    {
        let (geometry, lights) = one(triangle_ring(around, across), false, false);
        let plain = by_area(&geometry, &lights);
        for p in [
            Vec3::new(10.0, 0.0, -0.5),
            Vec3::new(9.0, 0.0, -2.0),
            Vec3::new(0.0, 0.0, -5.0),
            Vec3::new(3.0, 5.0, -60.0),
        ] {
            let [a, b] = [&lights, &plain].map(|lights| {
                let start = cpu_time::ThreadTime::now();
                let mean = irradiance(&geometry, lights, 0, p, Vec3::Z, 200_000, 5);
                (mean.error().powi(2), start.elapsed().as_secs_f64() * 5000.0)
            });
            println!(
                "{name} triangles, lit at {p}: by area {:.0} ns, by tree {:.0} ns a sample; variance {:.1} times",
                b.1,
                a.1,
                b.0 / a.0
            );
        }
    }
}
