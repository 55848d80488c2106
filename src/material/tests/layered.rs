//! Layers: samples against evaluation, energy, reciprocity, and a coated mirror against the exact sum.

use super::*;
use crate::material::base::Base;
use crate::math::chi2::Moments;
use crate::math::sampler::Stream;
use crate::math::warp;

fn numbers(rng: &mut Stream) -> [f32; 3] {
    [rng.next_f32(), rng.next_f32(), rng.next_f32()]
}

/// ∫ f cos h dω found from `sample` equals that found from `evaluate` with cosine-distributed directions, for h = 1 and
/// h = the cosine to a fixed direction.
fn agree<B: Base>(name: &str, i: u64, lobe: impl Fn(u32) -> Coated<B>) {
    let wo = direction(0.6, 0.3);
    let axis = direction(0.5, 2.0);
    let mut rng = Stream::from_seed(100 + i);
    let [mut plain, mut towards] = [0, 1].map(|_| Moments::default());
    for seed in 0..150_000 {
        let lobe = lobe(seed);
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
    plain.assert_mean(&format!("{name}, {i}"), 0.0);
    towards.assert_mean(&format!("{name}, {i}, weighted"), 0.0);
}

#[test]
fn layered_samples_and_evaluation_agree() {
    for (i, (alpha, albedo)) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.7), (0.0, 0.7)].into_iter().enumerate() {
        agree("layered", i as u64, |seed| coated(alpha, albedo, 0.2, 10, seed));
    }
}

#[test]
fn coated_metal_samples_and_evaluation_agree() {
    let cases = [
        ([0.0, 0.3], 0.0),
        ([0.3, 0.0], 0.0),
        ([0.3, 0.3], 0.0),
        ([0.2, 0.5], 0.7),
        ([0.0, 0.0], 0.7),
        ([0.3, 0.0], 0.7),
    ];
    for (i, (roughness, albedo)) in cases.into_iter().enumerate() {
        agree("coated metal", 20 + i as u64, |seed| coated_metal(roughness, albedo, 0.2, 10, seed));
    }
}

/// Under a smooth, clear or absorbing coat a mirror reflects R + T²ρτ² / (1 − Rρτ²) in one direction, where τ is the transmittance of the coat.
#[test]
fn a_coated_mirror_reflects_the_sum_of_all_bounces() {
    for (i, thickness) in [0.0f32, 0.3].into_iter().enumerate() {
        for (j, cos) in [1.0f32, 0.6, 0.2].into_iter().enumerate() {
            let wo = direction(cos, 0.7);
            let mut rng = Stream::from_seed((10 * i + j) as u64);
            let mut energy = Moments::default();
            for seed in 0..40_000 {
                let lobe = coated_metal([0.0; 2], 0.0, thickness, 1000, seed);
                assert!(lobe.is_specular());
                let u = numbers(&mut rng);
                let sample = lobe.sample(wo, u[0], [u[1], u[2]]);
                energy.add(sample.map_or(0.0, |s| {
                    assert!(s.is_specular && !s.pdf_is_proportional && !s.is_transmission, "{s:?}");
                    assert!((s.wi - Vec3::new(-wo.x, -wo.y, wo.z)).length() < 1e-4, "{s:?}");
                    f64::from(s.weight()[0])
                }));
            }
            let lobe = coated_metal([0.0; 2], 0.0, thickness, 1000, 0);
            let inside = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
            let r = fresnel::dielectric(cos, 1.5);
            let metal = fresnel::conductor(inside, lobe.base.eta, lobe.base.k)[0] * (-2.0 * thickness / inside).exp();
            let expected = r + (1.0 - r).powi(2) * metal / (1.0 - r * metal);
            energy.assert_mean(&format!("thickness {thickness}, cos {cos}"), f64::from(expected));
            assert!((lobe.albedo(wo)[0] - expected).abs() < 1e-5);
            let elsewhere = direction(0.5, 3.0);
            assert_eq!((lobe.evaluate(wo, elsewhere), lobe.pdf(wo, elsewhere)), (Rgb::BLACK, 0.0));
        }
    }
}

/// Rough layers over metal never give back more than they get; what is scattered into the surface is lost at every bounce.
#[test]
fn coated_metal_gains_nothing() {
    for (i, roughness) in [[0.0, 0.3], [0.3, 0.0], [0.5, 0.5]].into_iter().enumerate() {
        for cos in [1.0, 0.3] {
            let wo = direction(cos, 0.4);
            let mut rng = Stream::from_seed(70 + i as u64);
            let mut energy = Moments::default();
            for seed in 0..20_000 {
                let u = numbers(&mut rng);
                let sample = coated_metal(roughness, 0.0, 0.01, 100, seed).sample(wo, u[0], [u[1], u[2]]);
                energy.add(sample.map_or(0.0, |s| f64::from(s.weight()[0])));
            }
            assert!(energy.mean() < 1.0 && energy.mean() > 0.25, "{roughness:?} {cos}: {}", energy.mean());
        }
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
fn coated_metal_pdf_estimates_integrate_to_at_most_one() {
    for roughness in [[0.0, 0.3], [0.3, 0.0], [0.3, 0.3]] {
        let wo = direction(0.7, 0.2);
        let mut rng = Stream::from_seed(12);
        let mut total = Moments::default();
        for seed in 0..200_000 {
            let wi = warp::uniform_sphere([rng.next_f32(), rng.next_f32()]);
            let pdf = coated_metal(roughness, 0.0, 0.1, 10, seed).pdf(wo, wi);
            total.add(f64::from(pdf / warp::UNIFORM_SPHERE_PDF));
        }
        let error = (total.variance() / total.n).sqrt();
        assert!(total.mean() < 1.0 + 6.0 * error && total.mean() > 0.4, "{roughness:?}: {} ± {error}", total.mean());
    }
}
