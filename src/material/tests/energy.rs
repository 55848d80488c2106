//! Energy: furnaces, and rough dielectrics against quadrature in another measure.

use super::super::local::{Sides, Transport};
use super::*;
use crate::math::chi2::{Moments, integrate_sphere};
use crate::math::sampler::Stream;

const COSINES: [f32; 4] = [1.0, 0.8, 0.5, 0.15];

#[test]
fn microfacet_normals_project_to_one() {
    for (ax, ay) in [(0.15, 0.15), (0.5, 0.5), (1.0, 1.0), (0.2, 0.7)] {
        let d = TrowbridgeReitz::new(ax, ay);
        let area = integrate_sphere(|m| f64::from(if m.z > 0.0 { d.d(m) * m.z } else { 0.0 }));
        assert!((area - 1.0).abs() < 2e-3, "{ax} {ay}: {area}");
    }
}

/// Heitz 2014, equation 18 (weak white furnace): with masking alone, a mirror of microfacets reflects everything, be it
/// into the surface.
#[test]
fn weak_furnace() {
    for (ax, ay) in [(0.2, 0.2), (0.5, 0.5), (0.9, 0.9), (0.2, 0.7)] {
        let d = TrowbridgeReitz::new(ax, ay);
        for cos in COSINES {
            let wo = direction(cos, 0.4);
            let energy = integrate_sphere(|wi| {
                let Some(wm) = (wo + wi).try_normalize().filter(|wm| wm.z > 0.0) else { return 0.0 };
                f64::from(d.d(wm) * d.g1(wo) / (4.0 * wo.z))
            });
            assert!((energy - 1.0).abs() < 3e-3, "α {ax} {ay}, cos {cos}: {energy}");
        }
    }
}

/// Mirrors and smooth boundaries lose nothing; rough ones do not gain.
#[test]
fn furnaces_of_single_scattering() {
    let mut rng = Stream::from_seed(5);
    for cos in COSINES {
        let wo = direction(cos, 0.4);
        let mut energy = |lobe: &Lobe| {
            let mut sum = Moments::default();
            for _ in 0..20_000 {
                let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
                let sample = match lobe {
                    Lobe::Diffuse(lobe) => lobe.sample(wo, [u[1], u[2]]),
                    Lobe::Conductor(lobe) => lobe.sample(wo, [u[1], u[2]]),
                    Lobe::ThinDielectric(lobe) => lobe.sample(wo, u[0]),
                    Lobe::DiffuseTransmission(lobe) => lobe.sample(wo, u[0], [u[1], u[2]]),
                    Lobe::Dielectric(lobe) => lobe.sample(wo, u[0], [u[1], u[2]], Sides::Both, Transport::Importance),
                    _ => unreachable!(),
                };
                sum.add(sample.map_or(0.0, |s| f64::from(s.weight()[0])));
            }
            sum
        };
        let white = Lobe::Diffuse(Diffuse { reflectance: Rgb::WHITE });
        let [reflectance, transmittance] = [0.3, 0.7].map(Rgb::splat);
        for (lobe, expected) in [
            (white, 1.0),
            (Lobe::ThinDielectric(ThinDielectric { eta: 1.5 }), 1.0),
            (Lobe::DiffuseTransmission(DiffuseTransmission { reflectance, transmittance }), 1.0),
            (Lobe::Dielectric(dielectric(0.0, 0.0, 1.5)), 1.0),
            (Lobe::Conductor(conductor(0.0, 0.0, 1.0)), 0.9996),
        ] {
            let energy = energy(&lobe);
            assert!((energy.mean() - expected).abs() < 4e-4, "{lobe:?} {cos}: {}", energy.mean());
        }
        for lobe in [Lobe::Conductor(conductor(0.5, 0.5, 1.0)), Lobe::Dielectric(dielectric(0.5, 0.5, 1.5))] {
            let energy = energy(&lobe);
            assert!(energy.mean() < 1.0 + 1e-3 && energy.mean() > 0.6, "{lobe:?} {cos}: {}", energy.mean());
        }
    }
}

/// ∫ f |cos| over directions (through the half-vector Jacobians) equals the integral over visible normals (without them).
#[test]
fn rough_dielectrics_against_quadrature_over_normals() {
    for (ax, ay) in [(0.25, 0.25), (0.6, 0.6), (0.2, 0.6)] {
        for eta in [1.5, 1.0 / 1.5] {
            let lobe = dielectric(ax, ay, eta);
            for cos in [0.9, 0.4, -0.7] {
                let wo = direction(cos, 0.4);
                let share = |transmit: bool| {
                    let over_directions = integrate_sphere(|wi| {
                        if (wi.z * wo.z < 0.0) != transmit {
                            return 0.0;
                        }
                        f64::from(lobe.evaluate(wo, wi, Transport::Importance)[0] * wi.z.abs())
                    });
                    let over_normals = integrate_sphere(|wm| {
                        if wm.z <= 0.0 || wo.dot(wm) * wo.z <= 0.0 {
                            return 0.0;
                        }
                        let r = fresnel::dielectric(wo.dot(wm), eta);
                        let (wi, share) = if transmit {
                            let Some((wi, _)) = fresnel::refract(wo, wm, eta) else { return 0.0 };
                            (wi, 1.0 - r)
                        } else {
                            (fresnel::reflect(wo, wm), r)
                        };
                        if (wi.z * wo.z < 0.0) != transmit {
                            return 0.0;
                        }
                        let d = &lobe.distribution;
                        f64::from(d.visible(wo, wm) * share * d.g(wo, wi) / d.g1(wo))
                    });
                    (over_directions, over_normals)
                };
                for transmit in [false, true] {
                    let (a, b) = share(transmit);
                    assert!((a - b).abs() < 4e-3, "α {ax} {ay} η {eta} cos {cos} transmit {transmit}: {a} {b}");
                }
            }
        }
    }
}

/// A coat that absorbs nothing over a white base gives back everything, if walks may be long.
#[test]
fn coated_white_furnace() {
    for (i, (alpha, albedo, thickness)) in [(0.0, 0.0, 0.0), (0.0, 1.0, 0.5), (0.0, 1.0, 3.0)].into_iter().enumerate() {
        for cos in COSINES {
            let wo = direction(cos, 0.4);
            let mut rng = Stream::from_seed(40 + i as u64);
            let mut energy = Moments::default();
            for seed in 0..50_000 {
                let u = [rng.next_f32(), rng.next_f32(), rng.next_f32()];
                let sample = coated(alpha, albedo, thickness, 2000, seed).sample(wo, u[0], [u[1], u[2]]);
                energy.add(sample.map_or(0.0, |s| f64::from(s.weight()[0])));
            }
            energy.assert_mean(&format!("coated {alpha} {albedo} {thickness}, cos {cos}"), 1.0);
        }
    }
}
