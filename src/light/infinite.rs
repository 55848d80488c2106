//! Light from all around: constant, or an image on the sphere ([`super::environment`]), or as much of it as comes through a portal
//! ([`super::portal`]). Source: pbrt-v4 section 12.5.

use std::f32::consts::PI;

use glam::Vec3;

use super::environment::Environment;
use super::portal::Portal;
use super::{LightEnd, LightSample, Receiver};
use crate::math::Rgb;
use crate::math::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};

/// A background that lights the scene.
#[derive(Debug)]
pub enum InfiniteLight {
    /// The same radiance from everywhere.
    Constant(Rgb),
    /// An image.
    Image(Box<Environment>),
    /// An image or a constant, through a portal.
    Portal(Box<Portal>),
}

impl InfiniteLight {
    /// The radiance that arrives at `p` from the unit direction `direction`.
    #[inline]
    pub fn radiance(&self, p: Vec3, direction: Vec3) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(environment) => environment.radiance(direction),
            Self::Portal(portal) => portal.radiance(p, direction),
        }
    }

    /// The solid-angle pdf with which [`InfiniteLight::sample`] from `p` takes `direction`.
    #[inline]
    pub fn pdf(&self, p: Vec3, direction: Vec3) -> f32 {
        match self {
            Self::Constant(_) => UNIFORM_SPHERE_PDF,
            Self::Image(environment) => environment.pdf(direction),
            Self::Portal(portal) => portal.pdf(p, direction),
        }
    }

    /// A direction from `p`: uniform, or in proportion to the image. `u_part` supplies the bits that `u` lacks.
    pub fn sample(&self, p: Vec3, u: [f32; 2], u_part: f64) -> Option<LightSample> {
        let (wi, pdf) = match self {
            Self::Constant(_) => (uniform_sphere(u), UNIFORM_SPHERE_PDF),
            Self::Image(environment) => environment.sample(u, u_part)?,
            Self::Portal(portal) => portal.sample(p, u, u_part)?,
        };
        let radiance = self.radiance(p, wi);
        if radiance.is_black() {
            return None;
        }
        Some(LightSample { wi, end: LightEnd::Infinity, radiance, pdf, is_delta: false })
    }

    /// Whether nothing comes from anywhere.
    pub fn is_dark(&self) -> bool {
        match self {
            Self::Constant(radiance) => radiance.is_black(),
            Self::Image(environment) => environment.mean_radiance().is_black(),
            Self::Portal(portal) => portal.power().is_black(),
        }
    }

    /// Φ in watts: as far as it enters the sphere around the scene, whose great circle has the area `disk`; or the portal.
    pub fn power(&self, disk: f32) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance * (4.0 * PI * disk),
            Self::Image(environment) => environment.mean_radiance() * (4.0 * PI * disk),
            Self::Portal(portal) => portal.power(),
        }
    }

    /// An estimate of the luminance that `receiver` gets: irradiance, or fluence in a medium.
    #[inline]
    pub fn contribution(&self, receiver: &Receiver) -> f32 {
        if let Self::Portal(portal) = self {
            return portal.contribution(receiver);
        }
        match *receiver {
            Receiver::Surface { ns, two_sided: false, .. } => self.irradiance(ns),
            Receiver::Surface { ns, two_sided: true, .. } => self.irradiance(ns) + self.irradiance(-ns),
            Receiver::Medium { .. } => {
                4.0 * PI
                    * match self {
                        Self::Constant(radiance) => radiance.luminance(),
                        Self::Image(environment) => environment.mean_radiance().luminance(),
                        Self::Portal(_) => 0.0,
                    }
            }
        }
    }

    /// The same for a surface with this unit normal; portals know it by place only.
    #[inline]
    fn irradiance(&self, normal: Vec3) -> f32 {
        match self {
            Self::Constant(radiance) => radiance.luminance() * PI,
            Self::Image(environment) => environment.irradiance(normal),
            Self::Portal(_) => 0.0,
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        match self {
            Self::Constant(_) => 0,
            Self::Image(environment) => size_of::<Environment>() + environment.memory(),
            Self::Portal(portal) => size_of::<Portal>() + portal.memory(),
        }
    }
}
