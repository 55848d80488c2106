//! Samples follow their pdf, and carry the f and pdf that evaluation gives.

use glam::Vec3;

use super::*;
use crate::math::chi2::{Moments, assert_sphere};
use crate::math::sampler::Stream;
use crate::math::warp;

const COSINES: [f32; 4] = [1.0, 0.7, 0.2, -0.5];
const ALPHAS: [(f32, f32); 4] = [(0.15, 0.15), (0.3, 0.3), (0.8, 0.8), (0.2, 0.6)];

fn rough_lobes() -> Vec<(String, Lobe)> {
    let mut lobes = vec![("diffuse".to_owned(), Lobe::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) }))];
    for (ax, ay) in ALPHAS {
        lobes.push((format!("conductor {ax} {ay}"), Lobe::Conductor(conductor(ax, ay, 0.9))));
        for eta in [1.5, 0.75] {
            lobes.push((format!("dielectric {eta} {ax} {ay}"), Lobe::Dielectric(dielectric(ax, ay, eta))));
        }
    }
    lobes
}

fn numbers(rng: &mut Stream) -> [f32; 3] {
    [rng.next_f32(), rng.next_f32(), rng.next_f32()]
}

#[test]
fn samples_follow_their_pdf() {
    for (i, (name, lobe)) in rough_lobes().into_iter().enumerate() {
        let (bsdf, frame) = tilted(lobe);
        for (j, cos) in COSINES.into_iter().enumerate() {
            let wo = frame.to_world(direction(cos, 0.6));
            let mut rng = Stream::from_seed((i * 10 + j) as u64);
            let sample = || Some(frame.to_local(bsdf.sample(wo, numbers(&mut rng))?.wi));
            let pdf = |wi| f64::from(bsdf.pdf(wo, frame.to_world(wi)));
            assert_sphere(&format!("{name}, cos {cos}"), 100_000, sample, pdf);
        }
    }
}

#[test]
fn samples_carry_what_evaluation_gives() {
    for (name, lobe) in rough_lobes() {
        let (bsdf, frame) = tilted(lobe);
        let mut rng = Stream::from_seed(7);
        let mut checked = 0;
        for i in 0..2000 {
            let wo = frame.to_world(direction([0.9, 0.3, -0.6][i % 3], 0.1 * i as f32));
            let Some(sample) = bsdf.sample(wo, numbers(&mut rng)) else { continue };
            let (f, pdf) = (bsdf.evaluate(wo, sample.wi), bsdf.pdf(wo, sample.wi));
            // Refraction near the horizon is ill-conditioned in f32.
            if frame.to_local(sample.wi).z.abs() < 0.02 {
                continue;
            }
            let near = |a: f32, b: f32| (a - b).abs() <= 5e-3 * a.abs().max(b.abs()) + 1e-6;
            assert!(near(f[0], sample.f[0]) && near(pdf, sample.pdf), "{name}: {sample:?} {f:?} {pdf} {i}");
            let sides = frame.to_local(wo).z * frame.to_local(sample.wi).z;
            assert_eq!(sample.is_transmission, sides < 0.0);
            assert!(!sample.is_transmission || bsdf.is_transmissive());
            checked += 1;
        }
        assert!(checked > 1000, "{name}: {checked}");
    }
}

#[test]
fn reflection_is_reciprocal_and_refraction_is_adjoint() {
    let mut rng = Stream::from_seed(3);
    for (name, lobe) in rough_lobes() {
        for _ in 0..500 {
            let [a, b] = [0, 1].map(|_| warp::uniform_sphere([rng.next_f32(), rng.next_f32()]));
            let (there, back) = match &lobe {
                Lobe::Diffuse(l) => (l.evaluate(a, b)[0], l.evaluate(b, a)[0]),
                Lobe::Conductor(l) => (l.evaluate(a, b)[0], l.evaluate(b, a)[0]),
                Lobe::Dielectric(l) => {
                    (l.evaluate(a, b, Transport::Radiance)[0], l.evaluate(b, a, Transport::Importance)[0])
                }
                _ => unreachable!(),
            };
            assert!((there - back).abs() <= 2e-3 * there.abs() + 1e-5, "{name}: {a} {b}: {there} {back}");
        }
    }
}

use super::super::local::Transport;

#[test]
fn smooth_lobes_are_specular_and_share_by_fresnel() {
    let (bsdf, frame) = tilted(Lobe::Dielectric(dielectric(5e-4, 0.0, 1.5)));
    assert!(bsdf.is_specular());
    let wo = frame.to_world(direction(0.6, 1.0));
    let r = fresnel::dielectric(0.6, 1.5);
    let reflected = bsdf.sample(wo, [r * 0.99, 0.5, 0.5]).unwrap();
    let refracted = bsdf.sample(wo, [r * 1.01, 0.5, 0.5]).unwrap();
    assert!(reflected.is_specular && !reflected.is_transmission && reflected.eta == 1.0);
    assert!(refracted.is_specular && refracted.is_transmission && refracted.eta == 1.5);
    let weight = |s: &crate::material::BsdfSample| s.f[0] * frame.to_local(s.wi).z.abs() / s.pdf;
    assert!((weight(&reflected) - 1.0).abs() < 1e-5 && (weight(&refracted) - 1.0 / 2.25).abs() < 1e-5);
    assert_eq!(bsdf.evaluate(wo, reflected.wi), Rgb::BLACK);
    assert_eq!(bsdf.pdf(wo, reflected.wi), 0.0);
    let (mirror, _) = tilted(Lobe::Conductor(conductor(0.0, 0.0, 0.8)));
    let sample = mirror.sample(wo, [0.5; 3]).unwrap();
    let local = frame.to_local(sample.wi);
    assert!((local - Vec3::new(-1.0, -1.0, 1.0) * frame.to_local(wo)).length() < 1e-5);
}

/// ∫ f cos h dω found from `sample` equals that found from `evaluate` with cosine-distributed directions, for h = 1 and
/// h = the cosine to a fixed direction.
#[test]
fn layered_samples_and_evaluation_agree() {
    for (i, (alpha, albedo)) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.7), (0.0, 0.7)].into_iter().enumerate() {
        let wo = direction(0.6, 0.3);
        let axis = direction(0.5, 2.0);
        let mut rng = Stream::from_seed(100 + i as u64);
        let [mut plain, mut towards] = [0, 1].map(|_| Moments::default());
        for seed in 0..150_000 {
            let lobe = coated(alpha, albedo, 0.2, 10, seed);
            let u = numbers(&mut rng);
            // Twice the same integral; only the difference, of expectation 0, is kept. Dirac reflection is not in f.
            let sampled = lobe.sample(wo, u[0], [u[1], u[2]]).filter(|s| !s.is_specular);
            let mut difference = [0.0; 2];
            if let Some(s) = sampled {
                let weight = f64::from(s.weight()[0]);
                difference = [weight, weight * f64::from(s.wi.dot(axis).abs())];
            }
            let wi = warp::cosine_hemisphere([rng.next_f32(), rng.next_f32()]);
            let f = f64::from(lobe.evaluate(wo, wi)[0]) * std::f64::consts::PI;
            plain.add(difference[0] - f);
            towards.add(difference[1] - f * f64::from(wi.dot(axis).abs()));
        }
        plain.assert_mean(&format!("layered {alpha} {albedo}"), 0.0);
        towards.assert_mean(&format!("layered {alpha} {albedo}, weighted"), 0.0);
    }
}

#[test]
fn layered_estimates_are_reciprocal_reproducible_and_uncorrelated() {
    let (a, b) = (direction(0.9, 0.0), direction(0.4, 2.0));
    let lobe = coated(0.3, 0.5, 0.5, 10, 5);
    assert_eq!(lobe.evaluate(a, b), lobe.evaluate(a, b));
    assert_eq!(lobe.pdf(a, b), lobe.pdf(a, b));
    assert_ne!(lobe.evaluate(a, b), coated(0.3, 0.5, 0.5, 10, 6).evaluate(a, b));
    let [mut difference, mut f, mut pdf, mut product] = [0, 1, 2, 3].map(|_| Moments::default());
    for seed in 0..200_000 {
        let lobe = coated(0.3, 0.5, 0.5, 10, seed);
        let value = f64::from(lobe.evaluate(a, b)[0]);
        let density = f64::from(lobe.pdf(a, b));
        difference.add(value - f64::from(lobe.evaluate(b, a)[0]));
        f.add(value);
        pdf.add(density);
        product.add(value * density);
    }
    difference.assert_mean("reciprocity", 0.0);
    product.assert_mean("independence of f and pdf", f.mean() * pdf.mean());
}

#[test]
fn layered_pdf_estimates_integrate_to_at_most_one() {
    for alpha in [0.0, 0.3] {
        let wo = direction(0.7, 0.2);
        let mut rng = Stream::from_seed(11);
        let mut total = Moments::default();
        for seed in 0..200_000 {
            let wi = warp::uniform_sphere([rng.next_f32(), rng.next_f32()]);
            total.add(f64::from(coated(alpha, 0.0, 0.1, 10, seed).pdf(wo, wi) / warp::UNIFORM_SPHERE_PDF));
        }
        let error = (total.variance() / total.n).sqrt();
        assert!(total.mean() < 1.0 + 6.0 * error && total.mean() > 0.5, "{} ± {error}", total.mean());
    }
}

#[test]
fn odd_directions_neither_panic_nor_give_nan() {
    let mut lobes = rough_lobes();
    lobes.push(("nothing".into(), Lobe::Passthrough));
    lobes.push(("coated".into(), Lobe::CoatedDiffuse(coated(0.3, 0.5, 0.1, 10, 1))));
    lobes.push(("extreme".into(), Lobe::Dielectric(dielectric(1e-3, 1.0, 1.5))));
    lobes.push(("mirror".into(), Lobe::Conductor(conductor(0.0, 0.0, 1.0))));
    let odd = [Vec3::X, Vec3::Z, -Vec3::Z, direction(1e-7, 0.0), direction(-1e-7, 1.0), direction(1e-20, 3.0)];
    for (name, lobe) in lobes {
        let bsdf = Bsdf::new(Frame::from_z(Vec3::Z), lobe);
        for wo in odd {
            for wi in odd {
                assert!(bsdf.evaluate(wo, wi).is_finite(), "{name} {wo} {wi}");
                assert!(bsdf.pdf(wo, wi) >= 0.0, "{name} {wo} {wi}");
            }
            for u in [0.0, 0.5, crate::math::ONE_MINUS_EPSILON] {
                if let Some(sample) = bsdf.sample(wo, [u; 3]) {
                    assert!(
                        sample.f.is_finite() && sample.pdf > 0.0 && sample.wi.is_finite(),
                        "{name} {wo} {sample:?}"
                    );
                }
            }
            assert!(bsdf.albedo(wo).is_finite());
        }
    }
}
