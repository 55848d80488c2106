//! Image backgrounds: the maps, lookups across edges, and directions in proportion to the image.

use std::f64::consts::PI;

use glam::Mat3;

use super::super::sphere_image::{Layout, SphereImage};
use super::*;
use crate::math::equal_area::{equal_area_sphere_to_square, equal_area_square_to_sphere};
use crate::math::warp::uniform_sphere;

/// An image of noise with a sun `peak` times as bright, and a black stretch.
fn sky(layout: Layout, height: usize, peak: f32, to_render: Mat3) -> Environment {
    let width = if layout == Layout::LatLong { 2 * height } else { height };
    let mut stream = Stream::from_seed(height as u64);
    let mut pixels: Vec<[f32; 3]> =
        (0..width * height).map(|_| [stream.next_f32(), stream.next_f32(), stream.next_f32()]).collect();
    pixels[width * 3..width * 6].fill([0.0; 3]);
    pixels[width * (height - 3) + 5] = [peak; 3];
    Environment::new(SphereImage::new(layout, width, height, pixels), Rgb::new(1.0, 0.5, 2.0), to_render)
        .expect("it is not black")
}

fn turned() -> Mat3 {
    Mat3::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, -0.7) * Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0))
}

#[test]
fn the_octahedral_map_is_pbrts() {
    // Values worked out by hand from Clarberg's formulas: the centre is +z, the corners are −z, edges' middles the equator.
    let cases = [
        (Vec2::new(0.5, 0.5), Vec3::Z),
        (Vec2::new(0.0, 0.0), -Vec3::Z),
        (Vec2::new(1.0, 0.0), -Vec3::Z),
        (Vec2::new(1.0, 0.5), Vec3::X),
        (Vec2::new(0.0, 0.5), -Vec3::X),
        (Vec2::new(0.5, 1.0), Vec3::Y),
        (Vec2::new(0.5, 0.0), -Vec3::Y),
        (Vec2::new(0.25, 0.5), Vec3::new(-0.661_437_8, 0.0, 0.75)),
        (Vec2::new(0.875, 0.875), Vec3::new(0.467_707_2, 0.467_707_2, -0.75)),
    ];
    for (square, direction) in cases {
        let there = equal_area_square_to_sphere(square);
        assert!(there.distance(direction) < 1e-6, "{square}: {there}");
    }
    let mut stream = Stream::from_seed(1);
    for _ in 0..10_000 {
        let square = Vec2::from_array(pair(&mut stream));
        let direction = equal_area_square_to_sphere(square);
        assert!((direction.length() - 1.0).abs() < 1e-6);
        let back = equal_area_sphere_to_square(direction);
        assert!(equal_area_square_to_sphere(back).distance(direction) < 2e-6, "{square} {back}");
    }
}

#[test]
fn a_bright_pixel_is_where_pbrt_puts_it() {
    // 4 × 4: the second row from the top, the last column, lies at (0.875, 0.375) of the square: towards +x and a little −y.
    let mut pixels = vec![[0.0; 3]; 16];
    pixels[4 + 3] = [1.0; 3];
    let environment = Environment::new(SphereImage::new(Layout::Octahedral, 4, 4, pixels), Rgb::WHITE, Mat3::IDENTITY)
        .expect("it shines");
    let towards = equal_area_square_to_sphere(Vec2::new(0.875, 0.375));
    assert!(towards.x > 0.9 && towards.y < -0.2 && towards.z.abs() < 0.1);
    assert!((environment.radiance(towards)[0] - 1.0).abs() < 1e-4);
    assert_eq!(environment.radiance(-towards)[0], 0.0);
    // Latitude and longitude: the top row is +z, column u is φ = 2πu from +x over +y.
    let mut pixels = vec![[0.0; 3]; 32];
    pixels[8 + 2] = [1.0; 3];
    let environment = Environment::new(SphereImage::new(Layout::LatLong, 8, 4, pixels), Rgb::WHITE, Mat3::IDENTITY)
        .expect("it shines");
    let (theta, phi) = (1.5 / 4.0 * std::f32::consts::PI, 2.5 / 8.0 * std::f32::consts::TAU);
    let towards = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
    assert!((environment.radiance(towards)[0] - 1.0).abs() < 1e-4);
}

#[test]
fn the_octahedral_lookup_has_no_seams() {
    let environment = sky(Layout::Octahedral, 16, 1.0, Mat3::IDENTITY);
    let mut stream = Stream::from_seed(2);
    for _ in 0..20_000 {
        let along = stream.next_f32();
        let side = (stream.next_f32() * 4.0) as u32;
        let edge = match side {
            0 => Vec2::new(along, 1e-6),
            1 => Vec2::new(along, 1.0 - 1e-6),
            2 => Vec2::new(1e-6, along),
            _ => Vec2::new(1.0 - 1e-6, along),
        };
        // The two halves of an edge are one line on the sphere.
        let fold = if side < 2 { Vec2::new(1.0 - edge.x, edge.y) } else { Vec2::new(edge.x, 1.0 - edge.y) };
        let (a, b) = (equal_area_square_to_sphere(edge), equal_area_square_to_sphere(fold));
        assert!(a.distance(b) < 1e-2);
        assert!((environment.radiance(a) - environment.radiance(b)).map(f32::abs).max_channel() < 0.02, "{edge}");
    }
}

fn check_density(layout: Layout, peak: f32, samples: u32, seed: u64) {
    const HEIGHT: usize = 16;
    let width = if layout == Layout::LatLong { 2 * HEIGHT } else { HEIGHT };
    let environment = sky(layout, HEIGHT, peak, turned());
    let mut counts = vec![0.0; width * HEIGHT];
    let mut stream = Stream::from_seed(seed);
    let mut strays = 0;
    let mut mean = Mean::default();
    let back = turned().transpose();
    for _ in 0..samples {
        let (direction, pdf) = environment.sample(pair(&mut stream), f64::from(stream.next_f32())).expect("it shines");
        strays += u32::from((environment.pdf(direction) / pdf - 1.0).abs() > 1e-4);
        let local = back * direction;
        let square = match layout {
            Layout::Octahedral => equal_area_sphere_to_square(local),
            Layout::LatLong => {
                let u = local.y.atan2(local.x) / std::f32::consts::TAU;
                Vec2::new(u - u.floor(), local.z.clamp(-1.0, 1.0).acos() / std::f32::consts::PI)
            }
        };
        let x = ((square.x * width as f32) as usize).min(width - 1);
        let y = ((square.y * HEIGHT as f32) as usize).min(HEIGHT - 1);
        counts[y * width + x] += 1.0;
        mean.add(f64::from(environment.radiance(direction)[1] / pdf));
    }
    // Rounding may put a direction into the next pixel, where the pdf is another.
    assert!(strays <= samples / 10_000, "{strays} of {samples}");
    let expected: Vec<f64> = (0..width * HEIGHT)
        .map(|i| {
            let centre =
                Vec2::new(((i % width) as f32 + 0.5) / width as f32, ((i / width) as f32 + 0.5) / HEIGHT as f32);
            let (direction, solid_angle) = match layout {
                Layout::Octahedral => (equal_area_square_to_sphere(centre), 4.0 * PI / (width * HEIGHT) as f64),
                Layout::LatLong => {
                    let (theta, phi) = (centre.y * std::f32::consts::PI, centre.x * std::f32::consts::TAU);
                    let edge = |y: usize| (y as f64 / HEIGHT as f64 * PI).cos();
                    let row = edge(i / width) - edge(i / width + 1);
                    (
                        Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()),
                        row * 2.0 * PI / width as f64,
                    )
                }
            };
            f64::from(environment.pdf(turned() * direction)) * solid_angle * f64::from(samples)
        })
        .collect();
    let total: f64 = expected.iter().sum::<f64>() / f64::from(samples);
    assert!((total - 1.0).abs() < 1e-5, "the pdf integrates to {total}");
    chi_squared(&counts, &expected, &format!("{layout:?} with a sun of {peak}"));
    // The pdf is positive wherever there is light, so the estimate is not biased; the mean by even directions instead:
    let mut even = Mean::default();
    if peak <= 1.0 {
        for _ in 0..samples {
            let direction = uniform_sphere(pair(&mut stream));
            let radiance = environment.radiance(direction);
            assert!(radiance.is_black() || environment.pdf(direction) > 0.0);
            even.add(f64::from(radiance[1]) * 4.0 * PI);
        }
        let error = mean.error().hypot(even.error());
        assert!((mean.mean - even.mean).abs() < 4.5 * error, "{} {} ± {error}", mean.mean, even.mean);
    }
    if layout == Layout::Octahedral {
        // All cells being equal, bilinear lookups keep the image's mean.
        mean.must_be(4.0 * PI * f64::from(environment.mean_radiance()[1]), "mean of the sky");
    }
}

#[test]
fn directions_follow_the_image() {
    check_density(Layout::Octahedral, 1.0, 400_000, 3);
    check_density(Layout::LatLong, 1.0, 400_000, 4);
}

#[test]
fn directions_follow_an_image_with_a_sun() {
    check_density(Layout::Octahedral, 1e5, 4_000_000, 5);
    check_density(Layout::LatLong, 1e5, 4_000_000, 6);
}

#[test]
fn a_lone_sun_lights_its_neighbours_cells_too() {
    let mut pixels = vec![[0.0; 3]; 64];
    pixels[0] = [1.0; 3];
    let environment = Environment::new(SphereImage::new(Layout::Octahedral, 8, 8, pixels), Rgb::WHITE, Mat3::IDENTITY)
        .expect("it shines");
    let mut stream = Stream::from_seed(7);
    let mut mean = Mean::default();
    for _ in 0..200_000 {
        let (direction, pdf) = environment.sample(pair(&mut stream), f64::from(stream.next_f32())).expect("it shines");
        mean.add(f64::from(environment.radiance(direction)[0] / pdf));
    }
    mean.must_be(4.0 * PI / 64.0, "one pixel");
}

#[test]
fn the_irradiance_estimate_is_near_the_integral() {
    let mut pixels = vec![[0.2; 3]; 64 * 64];
    pixels[..64 * 20].fill([1.0; 3]);
    let environment = Environment::new(SphereImage::new(Layout::Octahedral, 64, 64, pixels), Rgb::WHITE, turned())
        .expect("it shines");
    let mut stream = Stream::from_seed(8);
    for _ in 0..20 {
        let normal = uniform_sphere(pair(&mut stream));
        let mut mean = Mean::default();
        for _ in 0..20_000 {
            let direction = uniform_sphere(pair(&mut stream));
            mean.add(f64::from(environment.radiance(direction)[0] * direction.dot(normal).max(0.0)) * 4.0 * PI);
        }
        assert!((f64::from(environment.irradiance(normal)) / mean.mean - 1.0).abs() < 0.1);
    }
}

#[test]
fn an_image_without_light_is_no_light() {
    assert!(
        Environment::new(SphereImage::new(Layout::Octahedral, 2, 2, vec![[0.0; 3]; 4]), Rgb::WHITE, Mat3::IDENTITY)
            .is_none()
    );
    let single =
        Environment::new(SphereImage::new(Layout::Octahedral, 1, 1, vec![[1.0; 3]]), Rgb::WHITE, Mat3::IDENTITY)
            .expect("it shines");
    assert!((single.pdf(Vec3::X) * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-5);
}
