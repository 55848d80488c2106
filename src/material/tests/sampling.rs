//! Samples follow their pdf, and carry the f and pdf that evaluation gives.

use glam::Vec3;

use super::*;
use crate::material::hair::Hair;
use crate::math::chi2::assert_sphere;
use crate::math::sampler::Stream;
use crate::math::warp;

const COSINES: [f32; 4] = [1.0, 0.7, 0.2, -0.5];
const ALPHAS: [(f32, f32); 4] = [(0.15, 0.15), (0.3, 0.3), (0.8, 0.8), (0.2, 0.6)];

fn rough_lobes() -> Vec<(String, Lobe)> {
    let mut lobes = vec![("diffuse".to_owned(), Lobe::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) }))];
    for (reflectance, transmittance) in [(0.25, 0.25), (0.7, 0.1), (0.0, 0.4), (0.4, 0.0)] {
        let [reflectance, transmittance] = [reflectance, transmittance].map(|c| Rgb::new(c, 0.5 * c, c));
        let lobe = Lobe::DiffuseTransmission(DiffuseTransmission { reflectance, transmittance });
        lobes.push((format!("both sides {reflectance:?} {transmittance:?}"), lobe));
    }
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
                Lobe::DiffuseTransmission(l) => (l.evaluate(a, b)[0], l.evaluate(b, a)[0]),
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

#[test]
fn odd_directions_neither_panic_nor_give_nan() {
    let mut lobes = rough_lobes();
    lobes.push(("nothing".into(), Lobe::Passthrough));
    lobes.push(("coated".into(), Lobe::CoatedDiffuse(coated(0.3, 0.5, 0.1, 10, 1))));
    for roughness in [[0.0, 0.0], [0.3, 0.0], [0.0, 0.3], [0.3, 0.3]] {
        for albedo in [0.0, 0.5] {
            let lobe = Lobe::CoatedConductor(coated_metal(roughness, albedo, 0.1, 10, 1));
            lobes.push((format!("coated metal {roughness:?} {albedo}"), lobe));
        }
    }
    lobes.push(("pane".into(), Lobe::ThinDielectric(ThinDielectric { eta: 1.5 })));
    lobes.push(("hair".into(), Lobe::Hair(Hair::new(0.4, 1.55, Rgb::splat(0.2), 0.1, 0.1, 2.0))));
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
