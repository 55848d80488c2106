//! Environments through portals: form factors, densities, what lies beside.

use std::f64::consts::PI;

use glam::Mat3;

use super::super::portal::Portal;
use super::super::sphere_image::{Layout, SphereImage};
use super::*;
use crate::math::warp::uniform_sphere;

/// Two by one, before the origin at the height 1.5, open upwards.
const CORNERS: [Vec3; 4] =
    [Vec3::new(-0.5, 0.2, 1.5), Vec3::new(-0.5, 1.2, 1.5), Vec3::new(1.5, 1.2, 1.5), Vec3::new(1.5, 0.2, 1.5)];

fn constant(radiance: f32, corners: [Vec3; 4]) -> Option<Portal> {
    let image = SphereImage::new(Layout::Octahedral, 1, 1, vec![[radiance; 3]]);
    Portal::new(image, Rgb::WHITE, Mat3::IDENTITY, corners)
}

fn sky() -> Portal {
    let mut stream = Stream::from_seed(4);
    let mut pixels: Vec<[f32; 3]> = (0..32 * 32).map(|_| [stream.next_f32(), stream.next_f32(), 0.2]).collect();
    pixels[32 * 17 + 14] = [400.0, 300.0, 200.0];
    let turned = Mat3::from_euler(glam::EulerRot::XYZ, 0.2, -0.4, 1.0);
    Portal::new(SphereImage::new(Layout::Octahedral, 32, 32, pixels), Rgb::new(1.0, 0.5, 2.0), turned, CORNERS)
        .expect("it is a rectangle")
}

/// Up is the side that (p₃ − p₀) × (p₁ − p₀) points to.
fn lights(portal: Portal) -> Lights {
    let mut lights = Lights::default();
    lights.add_infinite(InfiniteLight::Portal(Box::new(portal)));
    lights
}

/// Irradiance over radiance at the origin with normal +z of a rectangle from (0, 0, h) to (w, l, h).
fn corner_factor(w: f64, l: f64, h: f64) -> f64 {
    let (a, b) = (w / h, l / h);
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    0.5 * (term(a, b) + term(b, a))
}

/// The same for `CORNERS`.
fn factor() -> f64 {
    let h = 1.5;
    let up_to = |y: f64| corner_factor(0.5, y, h) + corner_factor(1.5, y, h);
    up_to(1.2) - up_to(0.2)
}

#[test]
fn a_constant_sky_gives_the_form_factor() {
    let lights = lights(constant(3.0, CORNERS).expect("it is a rectangle"));
    irradiance(&Geometry::default(), &lights, 0, Vec3::ZERO, Vec3::Z, 200_000, 1).must_be(3.0 * factor(), "portal");
    // From beside, from behind, and from beyond its plane nothing is seen.
    assert!(!lights.background(LightId(0), Vec3::ZERO, Vec3::new(0.3, 0.5, 1.5).normalize()).is_black());
    for (p, w) in [
        (Vec3::ZERO, Vec3::new(-0.6, 0.5, 1.5)),
        (Vec3::ZERO, Vec3::new(0.3, 0.5, -1.5)),
        (Vec3::Z * 2.0, Vec3::new(0.3, 0.5, 1.5)),
        (Vec3::Z * 2.0, Vec3::new(0.3, 0.5, -0.5)),
    ] {
        assert!(lights.background(LightId(0), p, w.normalize()).is_black());
        assert_eq!(lights.background_pdf(LightId(0), p, w.normalize()), 0.0);
    }
    assert!(lights.sample(&Geometry::default(), LightId(0), Vec3::Z * 2.0, 0.0, [0.5; 2], 0.5).is_none());
    let [a, b, c, d] = CORNERS;
    assert!(constant(1.0, [a, c, b, d]).is_none() && constant(1.0, [a, a, c, d]).is_none());
    assert!(constant(1.0, [a, b, c, d + Vec3::X * 0.1]).is_none());
}

#[test]
fn directions_follow_the_image_within_the_window() {
    let portal = sky();
    for (seed, p) in [Vec3::ZERO, Vec3::new(0.4, 0.7, 1.3), Vec3::new(-6.0, 4.0, 1.0)].into_iter().enumerate() {
        // χ² over bins of the rectangle: the expected counts by quadrature of the pdf.
        const BINS: usize = 24;
        const STEPS: usize = 12;
        let n = 30_000u32;
        let mut counts = vec![0.0; BINS * BINS];
        let mut stream = Stream::from_seed(10 + seed as u64);
        let mut mean = Mean::default();
        let (mut strays, mut black) = (0, 0);
        for _ in 0..n {
            let part = f64::from(stream.next_f32());
            let (w, pdf) = portal.sample(p, pair(&mut stream), part).expect("it is seen");
            strays += u32::from((portal.pdf(p, w) / pdf - 1.0).abs() > 1e-3);
            let q = p + w * ((1.5 - p.z) / w.z);
            let bin = [(q.x + 0.5) / 2.0, q.y - 0.2].map(|t| ((t * BINS as f32) as usize).min(BINS - 1));
            counts[bin[1] * BINS + bin[0]] += 1.0;
            let radiance = portal.radiance(p, w);
            black += u32::from(radiance.is_black());
            mean.add(f64::from(radiance[0] / pdf));
        }
        // Rounding may put a direction into the next cell, or beyond the edge.
        assert!(strays <= n / 2000 && black <= n / 2000, "{strays} {black} of {n}");
        let mut expected = vec![0.0; BINS * BINS];
        let mut fluence = 0.0;
        for k in 0..(BINS * STEPS) * (BINS * STEPS) {
            let cell = [k % (BINS * STEPS), k / (BINS * STEPS)];
            let [s, t] = cell.map(|c| (c as f32 + 0.5) / (BINS * STEPS) as f32);
            let to = Vec3::new(-0.5 + 2.0 * s, 0.2 + t, 1.5) - p;
            let w = to.normalize();
            let solid_angle = f64::from(w.z / to.length_squared()) * 2.0 / ((BINS * STEPS) as f64).powi(2);
            expected[cell[1] / STEPS * BINS + cell[0] / STEPS] +=
                f64::from(portal.pdf(p, w)) * solid_angle * f64::from(n);
            fluence += f64::from(portal.radiance(p, w)[0]) * solid_angle;
        }
        let total: f64 = expected.iter().sum::<f64>() / f64::from(n);
        assert!((total - 1.0).abs() < 0.01, "the pdf integrates to {total}");
        // Quadrature knows a bin to about a percent, a small part of what χ² sees.
        expected.iter_mut().for_each(|e| *e /= total);
        chi_squared(&counts, &expected, &format!("portal from {p}"));
        assert!((mean.mean / fluence - 1.0).abs() < 0.01 + 4.5 * mean.error() / fluence, "{} {fluence}", mean.mean);
    }
}

#[test]
fn it_lets_its_power_through() {
    let portal = sky();
    let mut stream = Stream::from_seed(5);
    let mut mean = Mean::default();
    for _ in 0..400_000 {
        let w = uniform_sphere(pair(&mut stream));
        // From just beneath the whole half is seen.
        let q = Vec3::new(0.5, 0.7, 1.5 - 1e-6);
        let seen = if w.z > 0.0 { portal.radiance(q, w) } else { Rgb::BLACK };
        mean.add(f64::from(seen[0] * w.z) * 4.0 * PI * 2.0);
    }
    let power = f64::from(portal.power()[0]);
    assert!((mean.mean - power).abs() < 4.5 * mean.error() + 0.01 * power, "{} ± {} {power}", mean.mean, mean.error());
}

#[test]
fn its_contribution_is_near_what_arrives_and_never_misses_any() {
    let lights = lights(sky());
    let mut stream = Stream::from_seed(6);
    for k in 0..400 {
        let p = (Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32()) - 0.5) * 4.0;
        let ns = uniform_sphere(pair(&mut stream));
        let receiver = Receiver::surface(p, ns, false);
        let found = f64::from(lights.contribution(LightId(0), &receiver));
        let mean = irradiance(&Geometry::default(), &lights, 0, p, ns, 400, k);
        assert!(mean.mean <= 0.0 || found > 0.0, "{p} {ns}: {}", mean.mean);
        let fluence = f64::from(lights.contribution(LightId(0), &Receiver::medium(p)));
        assert!(fluence >= 0.999 * found);
        assert!((fluence > 0.0) == (p.z < 1.5), "{p} {fluence}");
    }
}
