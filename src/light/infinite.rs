//! Light from all around: constant, or an image on the sphere ([`super::environment`]). Source: pbrt-v4 section 12.5.

use glam::Vec3;

use super::environment::Environment;
use super::{LightEnd, LightSample};
use crate::math::Rgb;
use crate::math::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};

/// A background that lights the scene.
#[derive(Debug)]
pub enum InfiniteLight {
    /// The same radiance from everywhere.
    Constant(Rgb),
    /// An image.
    Image(Box<Environment>),
}

impl InfiniteLight {
    /// The radiance that arrives from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(environment) => environment.radiance(direction),
        }
    }

    /// The solid-angle pdf with which [`InfiniteLight::sample`] takes `direction`.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        match self {
            Self::Constant(_) => UNIFORM_SPHERE_PDF,
            Self::Image(environment) => environment.pdf(direction),
        }
    }

    /// A direction: uniform, or in proportion to the image. `u_part` supplies the bits that `u` lacks.
    pub fn sample(&self, u: [f32; 2], u_part: f64) -> Option<LightSample> {
        let (wi, pdf) = match self {
            Self::Constant(_) => (uniform_sphere(u), UNIFORM_SPHERE_PDF),
            Self::Image(environment) => environment.sample(u, u_part)?,
        };
        let radiance = self.radiance(wi);
        if radiance.is_black() {
            return None;
        }
        Some(LightSample { wi, end: LightEnd::Infinity, radiance, pdf, is_delta: false })
    }

    /// The mean radiance over the sphere.
    pub fn mean_radiance(&self) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(environment) => environment.mean_radiance(),
        }
    }

    /// An estimate of the luminance that a surface with this unit normal receives (irradiance).
    #[inline]
    pub fn irradiance(&self, normal: Vec3) -> f32 {
        match self {
            Self::Constant(radiance) => radiance.luminance() * std::f32::consts::PI,
            Self::Image(environment) => environment.irradiance(normal),
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        match self {
            Self::Constant(_) => 0,
            Self::Image(environment) => size_of::<Environment>() + environment.memory(),
        }
    }
}
