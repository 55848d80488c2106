//! Emitters whose radiance varies: images over them, photometric profiles about their normal.

use std::f64::consts::PI;
use std::sync::Arc;

use super::super::area::pattern::{DirectionalEmission, EmissionImage, EmissionPattern, ImageMeans, ImageSums};
use super::super::ies::{IesProfile, Photometry, Table};
use super::*;

const SAMPLES: u32 = 200_000;

/// An image with a dark third, noise and a bright spot.
fn image(width: usize, height: usize) -> Arc<EmissionImage> {
    let mut stream = Stream::from_seed(3);
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|_| [stream.next_f32(), stream.next_f32(), 0.1]).collect();
    for (i, pixel) in pixels.iter_mut().enumerate() {
        if i % width < width / 3 {
            *pixel = [0.0; 3];
        }
    }
    pixels[width * (height / 2) + width - 2] = [20.0; 3];
    Arc::new(EmissionImage::new(width, height, pixels))
}

fn profile() -> DirectionalEmission {
    let vertical: Vec<f32> = (0..=18).map(|k| 5.0 * k as f32).collect();
    let horizontal: Vec<f32> = (0..=8).map(|k| 45.0 * k as f32).collect();
    let candela = horizontal
        .iter()
        .flat_map(|&h| vertical.iter().map(move |&v| (70.0 - v).max(0.0) * (1.5 + h.to_radians().cos())))
        .collect();
    let profile = Arc::new(IesProfile::new(&Table { photometry: Photometry::C, vertical, horizontal, candela }));
    DirectionalEmission { scale: 1.0 / profile.greatest(), profile, reference: Vec3::new(1.0, 0.0, 0.3).normalize() }
}

/// Gives the light 0 a pattern, as building it does.
fn paint(geometry: &Geometry, lights: &mut Lights, pattern: EmissionPattern) {
    let light = &mut lights.area[0];
    let shape = &geometry.shapes[0];
    let sampler = ShapeSampler::new(&shape.kind).expect("it has an area");
    light.sampler = Some(sampler.clone());
    let means = pattern.image.as_ref().map(|image| ImageMeans::new(image, &ImageSums::new(image), shape, &sampler));
    light.mean = light.radiance * means.as_ref().map_or(Rgb::WHITE, |m| m.overall) * pattern.directional_mean();
    (light.by_cone, light.parts) = (false, None);
    light.pattern = Some(Arc::new(pattern));
    light.build_parts(shape, means.as_ref().map(|m| m.weights.as_slice()));
}

/// A grid of `n` × `n` squares, two triangles each, over the unit square, with texture coordinates.
fn grid(n: usize) -> ShapeKind {
    let mut mesh = TriangleMesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let uv = Vec2::new(i as f32, j as f32) / n as f32;
            mesh.positions.push(Vec3::new(uv.x, uv.y, 0.2 * (5.0 * uv.x).sin()));
            mesh.uvs.push(uv);
        }
    }
    for k in 0..(n * n) as u32 {
        let (n, row) = (n as u32, (k / n as u32) * (n as u32 + 1));
        let a = row + k % n;
        mesh.indices.push([a, a + 1, a + n + 2]);
        mesh.indices.push([a, a + n + 2, a + n + 1]);
    }
    ShapeKind::Triangles(mesh)
}

fn shapes() -> Vec<(&'static str, ShapeKind)> {
    vec![
        ("patch", patch([Vec3::ZERO, Vec3::X * 2.0, Vec3::Y, Vec3::new(2.0, 1.0, 0.0)])),
        ("two triangles", grid(1)),
        ("eight triangles", grid(2)),
        ("many triangles", grid(9)),
        ("sphere", sphere(Vec3::new(0.5, 0.5, 0.0), 0.6)),
        ("disk", disk(Affine3A::from_scale(Vec3::new(1.0, 2.0, 1.0)), 0.7, 0.2, 5.0)),
    ]
}

#[test]
fn sampling_by_area_and_by_the_pattern_give_the_same_light() {
    for (seed, (what, kind)) in shapes().into_iter().enumerate() {
        let (geometry, mut lights) = one(kind, true, false);
        let sampler = ShapeSampler::new(&geometry.shapes[0].kind).expect("it has an area");
        paint(&geometry, &mut lights, EmissionPattern { image: Some(image(17, 9)), profile: Some(profile()) });
        let (p, normal) = (Vec3::new(0.3, 0.6, 1.5), Vec3::new(0.0, 0.6, -0.8));
        let found = irradiance(&geometry, &lights, 0, p, normal, SAMPLES, seed as u64);
        // The same by points chosen by area, radiance asked for as a ray does.
        let mut stream = Stream::from_seed(100 + seed as u64);
        let mut expected = Mean::default();
        for _ in 0..SAMPLES {
            let (u, part) = (pair(&mut stream), f64::from(stream.next_f32()));
            let point = sampler.sample(&geometry.shapes[0], u, part).expect("it has a normal").point;
            let to_light = point.p - p;
            let wi = to_light.normalize();
            let radiance = lights.emitted(LightId(0), point.ng, -wi, point.uv);
            let cosines = wi.dot(normal).max(0.0) * point.ng.dot(wi).abs();
            expected.add(f64::from(radiance[0] * cosines / to_light.length_squared() / point.pdf_area));
        }
        let error = found.error().hypot(expected.error());
        assert!(error < 0.03 * expected.mean, "{what}: too noisy to tell");
        let (found, expected) = (found.mean, expected.mean);
        assert!((found - expected).abs() < 4.5 * error, "{what}: {found} {expected} ± {error}");
    }
}

#[test]
fn the_pdf_of_a_hit_is_the_pdf_of_the_sample() {
    for (seed, (what, kind)) in shapes().into_iter().enumerate() {
        let (geometry, mut lights) = one(kind, true, false);
        paint(&geometry, &mut lights, EmissionPattern { image: Some(image(17, 9)), profile: None });
        let light = &lights.area[0];
        let (mut stream, mut seen) = (Stream::from_seed(seed as u64), 0);
        let p = Vec3::new(0.3, 0.6, 1.5);
        for _ in 0..5000 {
            let (u, part) = (pair(&mut stream), f64::from(stream.next_f32()));
            let sampler = light.sampler.as_ref().expect("it shines");
            let shape = &geometry.shapes[0];
            let sample = match &light.parts {
                None => sampler.sample(shape, u, part),
                Some(parts) => parts.sample(shape, sampler, None, p, u, part),
            };
            let sample = sample.expect("it has a normal");
            let Some(s) = lights.sample(&geometry, LightId(0), p, 0.0, u, part) else { continue };
            let hit = EmitterHit {
                shape: light.shape,
                primitive: sample.primitive,
                parameters: sample.parameters,
                instance: None,
                p: sample.point.p,
                ng: sample.point.ng,
                uv: sample.point.uv,
                time: 0.0,
            };
            let pdf = lights.pdf(&geometry, LightId(0), p, &hit, s.wi);
            assert!((pdf / s.pdf - 1.0).abs() < 2e-3, "{what}: {pdf} {}", s.pdf);
            assert_eq!(s.radiance, lights.emitted(LightId(0), hit.ng, -s.wi, hit.uv));
            seen += 1;
        }
        assert!(seen > 500, "{what}: {seen}");
    }
}

#[test]
fn triangles_are_chosen_by_their_part_of_the_image() {
    // 162 triangles, and 2: the dark third is never chosen, the bright texel's triangles are chosen more often than their area says.
    let (geometry, mut lights) = one(grid(9), false, false);
    paint(&geometry, &mut lights, EmissionPattern { image: Some(image(90, 90)), profile: None });
    let light = &lights.area[0];
    let (parts, sampler) = (light.parts.as_ref().expect("it has a tree"), light.sampler.as_ref().expect("it shines"));
    let shape = &geometry.shapes[0];
    let preference = |i: u32| parts.preference(shape, sampler, None, Vec3::new(0.5, 0.5, 4.0), i);
    let [mut dark, mut bright] = [0.0f32; 2];
    for i in 0..shape.primitive_count() {
        let square = [i / 2 % 9, i / 18];
        let value = preference(i);
        if square[0] < 2 {
            dark = dark.max(value);
        } else {
            assert!(value > 0.0, "{square:?}");
        }
        if square == [8, 4] {
            bright = bright.max(value);
        }
    }
    assert_eq!(dark, 0.0);
    assert!(bright > 1.5, "{bright}");
}

#[test]
fn power_is_the_integral_over_surface_and_directions() {
    for (seed, (what, kind)) in shapes().into_iter().enumerate() {
        let (geometry, mut lights) = one(kind, seed % 2 == 0, false);
        let sampler = ShapeSampler::new(&geometry.shapes[0].kind).expect("it has an area");
        paint(&geometry, &mut lights, EmissionPattern { image: Some(image(17, 9)), profile: Some(profile()) });
        let mut stream = Stream::from_seed(50 + seed as u64);
        let mut mean = Mean::default();
        for _ in 0..2 * SAMPLES {
            let (u, part) = (pair(&mut stream), f64::from(stream.next_f32()));
            let point = sampler.sample(&geometry.shapes[0], u, part).expect("it has a normal").point;
            let local = crate::math::warp::cosine_hemisphere(pair(&mut stream));
            let side = if stream.next_f32() < 0.5 { 1.0 } else { -1.0 };
            let wo = crate::math::frame::Frame::from_z(point.ng * side).to_world(local);
            let radiance = lights.emitted(LightId(0), point.ng, wo, point.uv);
            mean.add(f64::from(radiance[1] / point.pdf_area) * 2.0 * PI);
        }
        let power = f64::from(lights.power(LightId(0))[1]);
        let allowed = 4.5 * mean.error() + 0.01 * power;
        assert!((mean.mean - power).abs() < allowed, "{what}: {} ± {} {power}", mean.mean, mean.error());
    }
}

#[test]
fn the_top_row_is_at_v_1_and_edges_go_on() {
    let image = EmissionImage::new(2, 2, vec![[1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3]]);
    let at = |u: f32, v: f32| image.at(Vec2::new(u, v))[0];
    assert_eq!([at(0.25, 0.75), at(0.75, 0.75), at(0.25, 0.25), at(0.75, 0.25)], [1.0, 2.0, 3.0, 4.0]);
    assert_eq!([at(-9.0, 0.75), at(1.0, 0.0), at(0.0, 5.0)], [1.0, 4.0, 1.0]);
    assert_eq!(at(0.5, 0.5), 2.5);
    for strange in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
        assert!(at(strange, 0.5) >= 0.0 && at(0.5, strange) >= 0.0);
    }
}
