//! Boundaries between dielectrics, smooth or rough, that reflect and refract. Sources: Walter et al. 2007; pbrt-v4, sections
//! 9.5 and 9.7. Single scattering among microfacets. Which side is inside is decided by the local frame: η is the inside's
//! index relative to the side of +z.

use glam::Vec3;

use super::fresnel;
use super::local::{LocalSample, Sides, Transport, same_hemisphere};
use super::microfacet::TrowbridgeReitz;
use crate::math::Rgb;

/// A dielectric boundary.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Roughness.
    pub distribution: TrowbridgeReitz,
    /// η_inside/η_outside.
    pub eta: f32,
}

/// How wo, wi and a microfacet's normal fit together.
struct Event {
    wm: Vec3,
    /// η_t/η_i along wo → wi; 1 for reflection.
    eta: f32,
    is_reflection: bool,
}

impl Dielectric {
    /// Whether both lobes are Dirac: a smooth surface, or none at all (η = 1).
    #[inline]
    pub fn is_specular(&self) -> bool {
        self.eta == 1.0 || self.distribution.is_smooth()
    }

    /// f(wo, wi); zero where [`Dielectric::is_specular`].
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Rgb {
        if self.is_specular() {
            return Rgb::BLACK;
        }
        match self.event(wo, wi) {
            Some(event) => Rgb::splat(self.evaluate_event(wo, wi, &event, transport)),
            None => Rgb::BLACK,
        }
    }

    /// The pdf of [`Dielectric::sample`] with the same `sides`.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, sides: Sides) -> f32 {
        if self.is_specular() {
            return 0.0;
        }
        self.event(wo, wi).map_or(0.0, |event| self.pdf_event(wo, wi, &event, sides))
    }

    /// Chooses between reflection and refraction by `uc` in proportion to the Fresnel terms, at a microfacet visible from wo.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: [f32; 2], sides: Sides, transport: Transport) -> Option<LocalSample> {
        if wo.z == 0.0 {
            return None;
        }
        if self.is_specular() {
            return self.sample_smooth(wo, uc, sides, transport);
        }
        let wm = self.distribution.sample_visible(wo, u);
        let (reflect, transmit) = sides.weights(fresnel::dielectric(wo.dot(wm), self.eta));
        if reflect + transmit == 0.0 {
            return None;
        }
        if uc < reflect / (reflect + transmit) {
            let wi = fresnel::reflect(wo, wm);
            if !same_hemisphere(wo, wi) {
                return None;
            }
            let event = Event { wm, eta: 1.0, is_reflection: true };
            let f = Rgb::splat(self.evaluate_event(wo, wi, &event, transport));
            Some(LocalSample::rough(wi, f, self.pdf_event(wo, wi, &event, sides)))
        } else {
            let (wi, eta) = fresnel::refract(wo, wm, self.eta)?;
            if wi.z * wo.z >= 0.0 {
                return None;
            }
            let event = Event { wm, eta, is_reflection: false };
            let f = Rgb::splat(self.evaluate_event(wo, wi, &event, transport));
            Some(LocalSample::rough(wi, f, self.pdf_event(wo, wi, &event, sides)).transmitted(eta))
        }
    }

    #[inline]
    fn sample_smooth(&self, wo: Vec3, uc: f32, sides: Sides, transport: Transport) -> Option<LocalSample> {
        let r = fresnel::dielectric(wo.z, self.eta);
        let (reflect, transmit) = sides.weights(r);
        if reflect + transmit == 0.0 {
            return None;
        }
        if uc < reflect / (reflect + transmit) {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            Some(LocalSample::specular(wi, Rgb::splat(r / wi.z.abs()), reflect / (reflect + transmit)))
        } else {
            let (wi, eta) = fresnel::refract(wo, Vec3::Z, self.eta)?;
            let scale = radiance_scale(transport, eta);
            let f = Rgb::splat((1.0 - r) * scale / wi.z.abs());
            Some(LocalSample::specular(wi, f, transmit / (reflect + transmit)).transmitted(eta))
        }
    }

    /// The generalised half vector (Walter et al. 2007, equations 13 and 16), unless it is seen from behind.
    #[inline]
    fn event(&self, wo: Vec3, wi: Vec3) -> Option<Event> {
        if wo.z == 0.0 || wi.z == 0.0 {
            return None;
        }
        let is_reflection = wo.z * wi.z > 0.0;
        let eta = if is_reflection {
            1.0
        } else if wo.z > 0.0 {
            self.eta
        } else {
            1.0 / self.eta
        };
        let wm = (wi * eta + wo).try_normalize()?;
        let wm = if wm.z < 0.0 { -wm } else { wm };
        if wm.dot(wi) * wi.z < 0.0 || wm.dot(wo) * wo.z < 0.0 {
            return None;
        }
        Some(Event { wm, eta, is_reflection })
    }

    #[inline]
    fn evaluate_event(&self, wo: Vec3, wi: Vec3, event: &Event, transport: Transport) -> f32 {
        let Event { wm, eta, is_reflection } = *event;
        let r = fresnel::dielectric(wo.dot(wm), self.eta);
        let dg = self.distribution.d(wm) * self.distribution.g(wo, wi);
        if is_reflection {
            dg * r / (4.0 * wi.z * wo.z).abs()
        } else {
            let (o, i) = (wo.dot(wm), wi.dot(wm));
            let denominator = (i + o / eta).powi(2) * wi.z * wo.z;
            dg * (1.0 - r) * (i * o / denominator).abs() * radiance_scale(transport, eta)
        }
    }

    #[inline]
    fn pdf_event(&self, wo: Vec3, wi: Vec3, event: &Event, sides: Sides) -> f32 {
        let Event { wm, eta, is_reflection } = *event;
        let (reflect, transmit) = sides.weights(fresnel::dielectric(wo.dot(wm), self.eta));
        if reflect + transmit == 0.0 {
            return 0.0;
        }
        let visible = self.distribution.visible(wo, wm) / (reflect + transmit);
        if is_reflection {
            visible * reflect / (4.0 * wo.dot(wm).abs())
        } else {
            let i = wi.dot(wm);
            visible * transmit * i.abs() / (i + wo.dot(wm) / eta).powi(2)
        }
    }
}

/// Refracted radiance is squeezed into η² less solid angle (pbrt-v4, section 9.5.2).
#[inline]
fn radiance_scale(transport: Transport, eta: f32) -> f32 {
    match transport {
        Transport::Radiance => 1.0 / (eta * eta),
        Transport::Importance => 1.0,
    }
}
