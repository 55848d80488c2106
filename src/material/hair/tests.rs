//! Hair against a smooth cylinder traced in three dimensions, energy, samples against density, and reciprocity where it holds.

use super::*;
use crate::math::chi2::{assert_sphere, integrate_sphere};
use crate::math::sampler::Stream;

/// Some directions, with offsets from the fibre's middle.
fn views() -> Vec<(Vec3, f32)> {
    let mut views = vec![];
    for (sin, phi) in [(0.0f32, 1.6f32), (0.5, 0.3), (-0.7, 2.5), (0.95, -1.0)] {
        let cos = (1.0 - sin * sin).sqrt();
        for h in [0.0, 0.3, -0.6, 0.95] {
            views.push((Vec3::new(sin, cos * phi.cos(), cos * phi.sin()), h));
        }
    }
    views
}

/// The directions in which a smooth cylinder of radius 1 along x sends on light that leaves it for `wo`, traced backwards: reflected, passed, and
/// passed after one reflection within.
fn cylinder(wo: Vec3, h: f32, eta: f32) -> [Vec3; 3] {
    let side = Vec3::new(0.0, wo.y, wo.z).normalize();
    let mut n = side.cross(Vec3::X) * h + side * (1.0 - h * h).sqrt();
    let (mut inside, _) = fresnel::refract(wo, n, eta).expect("it goes in");
    let mut out = [fresnel::reflect(wo, n); 3];
    for direction in &mut out[1..] {
        // Across, on the unit circle.
        let across = Vec3::new(0.0, inside.y, inside.z);
        n -= across * (2.0 * n.dot(across) / across.length_squared());
        *direction = fresnel::refract(-inside, n, eta).expect("what came in goes out").0;
        inside = fresnel::reflect(-inside, n);
    }
    out
}

#[test]
fn a_smooth_fibre_is_a_cylinder_of_glass() {
    for (wo, h) in views() {
        let hair = Hair::new(h, 1.55, Rgb::splat(0.1), 0.01, 0.01, 0.0);
        let shares = hair.outgoing(wo).shares();
        for (p, expected) in cylinder(wo, h, 1.55).into_iter().enumerate() {
            // The middle of the term's samples.
            let uc = shares[..p].iter().sum::<f32>() + 0.5 * shares[p];
            let sample = hair.sample(wo, uc, [0.0, 0.5]).expect("a direction");
            assert!((sample.wi - expected).length() < 2e-3, "{wo} {h}, p {p}: {} {expected}", sample.wi);
        }
    }
}

#[test]
fn attenuation_is_that_of_the_way_through() {
    for (wo, h) in views() {
        let sigma_a = Rgb::new(0.0, 0.2, 1.0);
        let side = Vec3::new(0.0, wo.y, wo.z).normalize();
        let n = side.cross(Vec3::X) * h + side * (1.0 - h * h).sqrt();
        let (inside, _) = fresnel::refract(wo, n, 1.55).expect("it goes in");
        let across = Vec3::new(0.0, inside.y, inside.z);
        let way = -2.0 * n.dot(across) / across.length_squared();
        let f = fresnel::dielectric(wo.dot(n), 1.55);
        let found = Hair::new(h, 1.55, sigma_a, 0.3, 0.3, 2.0).outgoing(wo).attenuation;
        for c in 0..3 {
            let passed = (-sigma_a[c] * way).exp();
            let tt = (1.0 - f) * (1.0 - f) * passed;
            for (p, expected) in [f, tt, tt * passed * f].into_iter().enumerate() {
                assert!((found[p][c] - expected).abs() < 1e-4, "{wo} {h}, p {p}: {found:?} {expected}");
            }
            let sum: f32 = found.iter().map(|a| a[c]).sum();
            assert!(sum <= 1.0 + 1e-5 && (c > 0 || (sum - 1.0).abs() < 1e-5), "{sum}");
        }
    }
}

/// Without absorption everything comes out again: each sample weighs 1, and f integrates to 1.
#[test]
fn white_furnace() {
    let mut rng = Stream::from_seed(1);
    for (beta_m, beta_n, alpha) in [(0.1, 0.1, 2.0), (0.3, 0.3, 0.0), (0.3, 0.6, 8.0), (0.9, 1.0, 2.0)] {
        for (i, (wo, h)) in views().into_iter().enumerate() {
            let hair = Hair::new(h, 1.55, Rgb::BLACK, beta_m, beta_n, alpha);
            for _ in 0..300 {
                let u = [rng.next_f32(), rng.next_f32()];
                let sample = hair.sample(wo, rng.next_f32(), u).expect("a direction");
                if sample.wi.z.abs() > 1e-4 {
                    assert!((sample.weight()[0] - 1.0).abs() < 2e-3, "{wo} {h}: {sample:?}");
                }
            }
            if i % 5 == 0 && beta_m > 0.1 {
                let whole = integrate_sphere(|wi| f64::from(hair.evaluate(wo, wi)[1] * wi.z.abs()));
                assert!((whole - 1.0).abs() < 4e-3, "β {beta_m} {beta_n}, α {alpha}, {wo} {h}: {whole}");
            }
        }
    }
}

#[test]
fn samples_follow_their_pdf() {
    for (i, (wo, h)) in views().into_iter().enumerate().step_by(3) {
        for (j, (beta_m, beta_n, alpha)) in [(0.25, 0.3, 2.0), (0.6, 0.5, 5.0), (1.0, 1.0, 0.0)].into_iter().enumerate()
        {
            let hair = Hair::new(h, 1.55, Rgb::new(0.1, 0.3, 1.0), beta_m, beta_n, alpha);
            let mut rng = Stream::from_seed((10 * i + j) as u64);
            let sample = || {
                let uc = rng.next_f32();
                Some(hair.sample(wo, uc, [rng.next_f32(), rng.next_f32()])?.wi)
            };
            assert_sphere(&format!("{wo} {h} {beta_m}"), 100_000, sample, |wi| f64::from(hair.pdf(wo, wi)));
        }
    }
}

/// The offset belongs to the direction that light leaves in, and so does its attenuation: turned round, f is the same only where both
/// directions have the same angle to the fibre, the offset is on the other side and no scales are tilted.
#[test]
fn it_is_reciprocal_at_equal_angles_to_the_fibre() {
    let mut rng = Stream::from_seed(4);
    for (wo, h) in views() {
        let hair = |h: f32| Hair::new(h, 1.55, Rgb::splat(0.2), 0.4, 0.4, 0.0);
        for i in 0..20 {
            let (sin, cos) = (TAU * rng.next_f32()).sin_cos();
            let across = (1.0 - wo.x * wo.x).sqrt();
            let wi = Vec3::new(if i % 2 == 0 { wo.x } else { -wo.x }, across * cos, across * sin);
            let there = hair(h).evaluate(wo, wi)[0] * wi.z.abs();
            let back = hair(-h).evaluate(wi, wo)[0] * wo.z.abs();
            assert!((there - back).abs() < 1e-3 * there + 1e-6, "{wo} {wi} {h}: {there} {back}");
        }
    }
}

#[test]
fn scales_turn_highlights_towards_the_root() {
    // R leaves at −θ_o + 2α, TT at −θ_o − α, TRT at −θ_o − 4α.
    let wo = Vec3::new(0.3, 0.0, (1.0f32 - 0.09).sqrt());
    let hair = Hair::new(0.2, 1.55, Rgb::splat(0.1), 0.01, 0.01, 3.0);
    let shares = hair.outgoing(wo).shares();
    for (p, times) in [2.0, -1.0, -4.0].into_iter().enumerate() {
        let uc = shares[..p].iter().sum::<f32>() + 0.5 * shares[p];
        let sample = hair.sample(wo, uc, [0.0, 0.5]).expect("a direction");
        let expected = (-0.3f32).asin().to_degrees() + times * 3.0;
        assert!((sample.wi.x.asin().to_degrees() - expected).abs() < 0.05, "{p}: {sample:?} {expected}");
    }
}

#[test]
fn extremes_are_finite() {
    let odd = [Vec3::X, -Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::new(1.0, 1e-20, 1e-20), Vec3::new(0.6, 0.8, 1e-30)];
    for h in [-1.0, 0.0, 1.0, 7.0] {
        for (eta, sigma_a, beta, alpha) in [
            (1.55, Rgb::splat(1e30), 0.0, 2.0),
            (1.0, Rgb::BLACK, 1.0, 90.0),
            (0.5, Rgb::WHITE, 0.01, -90.0),
            (100.0, Rgb::splat(f32::MAX), 0.3, 0.0),
        ] {
            let hair = Hair::new(h, eta, sigma_a, beta, beta, alpha);
            for wo in odd {
                assert!(hair.albedo(wo).is_finite());
                for wi in odd {
                    let (f, pdf) = (hair.evaluate(wo, wi), hair.pdf(wo, wi));
                    assert!(f.is_finite() && pdf.is_finite() && pdf >= 0.0, "{h} {eta} {wo} {wi}: {f:?} {pdf}");
                }
                for u in [0.0, 0.5, ONE_MINUS_EPSILON] {
                    let sample = hair.sample(wo, u, [u; 2]).expect("a direction");
                    assert!(sample.wi.is_finite() && sample.f.is_finite() && sample.pdf.is_finite(), "{sample:?}");
                }
            }
        }
    }
}
