//! Points whose intensity depends on the direction: images around them, photometric profiles, projectors.

use std::sync::Arc;

use glam::Mat3;

use super::super::goniometric::IntensityDistribution;
use super::super::ies::{IesProfile, Photometry, Table};
use super::super::projection::{Projection, Slide};
use super::super::sphere_image::{Layout, SphereImage};
use super::super::tree::LightBounds;
use super::*;
use crate::math::equal_area::equal_area_square_to_sphere;
use crate::math::warp::uniform_sphere;

const SAMPLES: u32 = 1_000_000;

fn turned() -> Mat3 {
    Mat3::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, -0.7) * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0))
}

/// An image of noise with a dark corner and a bright pixel.
fn image(layout: Layout, height: usize) -> IntensityDistribution {
    let width = if layout == Layout::LatLong { 2 * height } else { height };
    let mut stream = Stream::from_seed(1);
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|_| [stream.next_f32(); 3]).collect();
    pixels[..width * 2].fill([0.0; 3]);
    pixels[width * (height - 3) + 5] = [30.0; 3];
    IntensityDistribution::of_image(SphereImage::new(layout, width, height, pixels))
}

fn luminaire() -> Arc<IesProfile> {
    let vertical: Vec<f32> = (0..=18).map(|k| 5.0 * k as f32).collect();
    let horizontal: Vec<f32> = (0..=12).map(|k| 30.0 * k as f32).collect();
    let value = |v: f32, h: f32| if v > 60.0 { 0.0 } else { 100.0 * (1.0 + (2.0 * h).to_radians().cos()) + v };
    let candela = horizontal.iter().flat_map(|&h| vertical.iter().map(move |&v| value(v, h))).collect();
    Arc::new(IesProfile::new(&Table { photometry: Photometry::C, vertical, horizontal, candela }))
}

fn slide(width: usize, height: usize) -> Arc<Slide> {
    let mut stream = Stream::from_seed(2);
    let next = |_| [stream.next_f32(), stream.next_f32(), if stream.next_f32() < 0.5 { 0.0 } else { 1.0 }];
    Arc::new(Slide::new(width, height, (0..width * height).map(next).collect()))
}

/// One of each kind.
pub(super) fn all() -> Vec<(&'static str, IntensityDistribution)> {
    let stretch = Mat3::from_diagonal(Vec3::new(1.4, 0.8, 1.0));
    vec![
        ("octahedral", image(Layout::Octahedral, 12)),
        ("profile", IntensityDistribution::of_profile(luminaire())),
        ("spot", IntensityDistribution::of_spot(luminaire(), 0.9, 0.7)),
        ("wide slide", IntensityDistribution::of_projection(Projection::new(slide(7, 3), 50.0, Mat3::IDENTITY))),
        ("high slide", IntensityDistribution::of_projection(Projection::new(slide(3, 5), 100.0, Mat3::IDENTITY))),
        ("stretched slide", IntensityDistribution::of_projection(Projection::new(slide(4, 4), 60.0, stretch))),
    ]
}

#[test]
fn they_emit_their_power() {
    for (seed, (what, distribution)) in all().into_iter().enumerate() {
        let distribution = Arc::new(distribution);
        let intensity = Rgb::new(2.0, 0.5, 1.0);
        let light = GoniometricLight { p: Vec3::ONE, intensity, to_local: turned().transpose(), distribution };
        let mut stream = Stream::from_seed(seed as u64);
        let mut means = [(); 3].map(|()| Mean::default());
        for _ in 0..SAMPLES {
            let w = uniform_sphere(pair(&mut stream));
            let intensity = light.sample(light.p + w).map_or(Rgb::BLACK, |s| s.radiance);
            (0..3).for_each(|c| means[c].add(f64::from(intensity[c]) * 4.0 * std::f64::consts::PI));
        }
        (0..3).for_each(|c| means[c].must_be(f64::from(light.power()[c]), what));
    }
}

#[test]
fn intensity_falls_off_with_the_square_of_distance_in_its_direction() {
    let distribution = Arc::new(IntensityDistribution::of_profile(luminaire()));
    let to_local = turned().transpose();
    let light = GoniometricLight { p: Vec3::new(1.0, 2.0, 3.0), intensity: Rgb::splat(0.5), to_local, distribution };
    for (v, h, distance) in [(10.0f32, 40.0f32, 2.0f32), (35.0, 200.0, 7.0), (5.0, 100.0, 0.3)] {
        let (sin, cos) = v.to_radians().sin_cos();
        let w = Vec3::new(sin * h.to_radians().cos(), sin * h.to_radians().sin(), cos);
        let p = light.p + turned() * w * distance;
        let s = light.sample(p).expect("it shines there");
        let expected = 0.5 * luminaire().candela(w) / (distance * distance);
        assert!((s.radiance[1] / expected - 1.0).abs() < 1e-3 && s.is_delta && s.pdf == 1.0);
        assert!(s.wi.distance(-(turned() * w)) < 1e-5);
    }
    assert!(light.sample(light.p - turned() * Vec3::Z).is_none(), "nothing goes up");
}

#[test]
fn a_slide_has_its_edges_at_its_field_of_view() {
    // Twice as wide as high: 40° is the height.
    let mut pixels = vec![[0.0; 3]; 8];
    pixels[0] = [1.0, 0.0, 0.0];
    pixels[7] = [0.0, 1.0, 0.0];
    pixels[3] = [0.0, 0.0, 1.0];
    let projection = Projection::new(Arc::new(Slide::new(4, 2, pixels)), 40.0, Mat3::IDENTITY);
    let tan = 20f32.to_radians().tan();
    let at = |x: f32, y: f32| projection.at(Vec3::new(x * tan, y * tan, 1.0).normalize());
    // Top left, bottom right, top right; +x is right and +y up.
    assert_eq!(at(-1.99, 0.99), Rgb::new(1.0, 0.0, 0.0));
    assert_eq!(at(1.99, -0.99), Rgb::new(0.0, 1.0, 0.0));
    assert_eq!(at(1.99, 0.01), Rgb::new(0.0, 0.0, 1.0));
    assert_eq!(at(-1.01, 0.99), Rgb::new(1.0, 0.0, 0.0));
    for outside in [at(-2.01, 0.99), at(-1.99, 1.01), at(-0.99, 0.5), projection.at(-Vec3::Z)] {
        assert_eq!(outside, Rgb::BLACK);
    }
    let (axis, cos) = projection.cone();
    let corner = Vec3::new(2.0 * tan, tan, 1.0).normalize().z;
    assert!(axis == Vec3::Z && cos <= corner && cos > corner - 1e-4);
}

#[test]
fn a_bright_pixel_of_an_image_is_where_pbrt_puts_it() {
    let mut pixels = vec![[0.0; 3]; 64];
    pixels[8 * 2 + 6] = [1.0; 3];
    let distribution = IntensityDistribution::of_image(SphereImage::new(Layout::Octahedral, 8, 8, pixels));
    let towards = equal_area_square_to_sphere(Vec2::new(6.5 / 8.0, 2.5 / 8.0));
    assert!((distribution.at(towards)[0] - 1.0).abs() < 1e-4 && distribution.at(-towards).is_black());
    let latitude = image(Layout::LatLong, 16);
    assert!((latitude.integral()[0] / image(Layout::LatLong, 16).integral()[0] - 1.0).abs() < 1e-6);
}

#[test]
fn bounds_and_contributions_hold_all_light() {
    let mut lights = Lights::default();
    let mut stream = Stream::from_seed(9);
    for (_, distribution) in all() {
        let distribution = Arc::new(distribution);
        let light =
            GoniometricLight { p: Vec3::X, intensity: Rgb::WHITE, to_local: turned().transpose(), distribution };
        lights.add_goniometric(light);
    }
    for id in lights.ids() {
        let bounds = LightBounds::of(&lights, id).expect("it shines");
        let node = super::super::tree::node::Node::new(&bounds, true, 0);
        let mut lit = 0;
        for _ in 0..20_000 {
            let p = Vec3::X + uniform_sphere(pair(&mut stream)) * (0.1 + 5.0 * stream.next_f32());
            let ns = uniform_sphere(pair(&mut stream));
            let Some(s) = lights.sample(&Geometry::default(), id, p, 0.0, [0.0; 2], 0.0) else { continue };
            lit += 1;
            assert!(node.importance(&Receiver::medium(p)) > 0.0);
            let expected = s.radiance.luminance() * s.wi.dot(ns).max(0.0);
            let receiver = Receiver::surface(p, ns, false);
            assert!((lights.contribution(id, &receiver) - expected).abs() <= 2e-3 * expected);
            assert!(expected == 0.0 || node.importance(&receiver) > 0.0);
        }
        assert!(lit > 300, "{lit}");
    }
}
