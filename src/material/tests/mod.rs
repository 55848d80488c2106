//! Tests of the scattering functions: samples against densities (χ²), energy (furnaces), reciprocity, quadrature.

mod build;
mod energy;
mod layered;
mod relief;
mod sampling;
mod textures;

use glam::Vec3;

use super::conductor::Conductor;
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::diffuse_transmission::DiffuseTransmission;
use super::fresnel;
use super::layered::Coated;
use super::microfacet::TrowbridgeReitz;
use super::thin_dielectric::ThinDielectric;
use super::{Bsdf, Lobe};
use crate::math::{Frame, Rgb};

/// A direction from its elevation's cosine and an azimuth.
fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

fn conductor(ax: f32, ay: f32, reflectance: f32) -> Conductor {
    Conductor {
        distribution: TrowbridgeReitz::new(ax, ay),
        eta: Rgb::WHITE,
        k: fresnel::k_from_reflectance(Rgb::splat(reflectance)),
    }
}

fn dielectric(ax: f32, ay: f32, eta: f32) -> Dielectric {
    Dielectric { distribution: TrowbridgeReitz::new(ax, ay), eta }
}

fn coated(alpha: f32, albedo: f32, thickness: f32, max_depth: u32, seed: u32) -> Coated<Diffuse> {
    Coated {
        top: dielectric(alpha, alpha, 1.5),
        base: Diffuse { reflectance: Rgb::splat(1.0) },
        thickness,
        albedo: Rgb::splat(albedo),
        phase: crate::math::phase::HenyeyGreenstein::new(0.3),
        max_depth,
        samples: 1,
        seed,
    }
}

/// Metal of 90 % under a coat; roughnesses of both.
fn coated_metal([coat, metal]: [f32; 2], albedo: f32, thickness: f32, max_depth: u32, seed: u32) -> Coated<Conductor> {
    let Coated { phase, samples, .. } = coated(coat, albedo, thickness, max_depth, seed);
    Coated {
        top: dielectric(coat, coat, 1.5),
        base: conductor(metal, metal, 0.9),
        thickness,
        albedo: Rgb::splat(albedo),
        phase,
        max_depth,
        samples,
        seed,
    }
}

/// In a frame that is not the identity, so that frames are tested too.
fn tilted(lobe: Lobe) -> (Bsdf, Frame) {
    let frame = Frame::from_zx(Vec3::new(0.3, -0.5, 0.7).normalize(), Vec3::X);
    (Bsdf::new(frame, lobe), frame)
}
