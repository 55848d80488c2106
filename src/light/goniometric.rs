//! Lights from a point whose intensity depends on the direction: an image around it (pbrt-v4's `goniometric`), the measured data of a luminaire
//! (an IES file), also within the cone of a spot, or a slide before it (`projection`). 72 bytes each; what many lights share is kept once.
//!
//! Source: Pharr, Jakob, Humphreys (4th ed.) sections 12.2.2 and 12.2.3.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Mat3, Vec3};

use super::ies::IesProfile;
use super::projection::Projection;
use super::sphere_image::SphereImage;
use super::spot::falloff;
use super::{LightSample, point};
use crate::math::Rgb;
use crate::math::warp::uniform_cone;

/// Where the intensity comes from.
#[derive(Debug)]
enum Form {
    /// An image on the sphere.
    Image(SphereImage),
    /// A photometric profile.
    Profile(Arc<IesProfile>),
    /// The same within a cone around +z.
    Spot { profile: Arc<IesProfile>, cos_start: f32, cos_end: f32 },
    /// A slide.
    Projection(Projection),
}

/// Intensity by direction, in a space of its own.
#[derive(Debug)]
pub struct IntensityDistribution {
    form: Form,
    integral: Rgb,
    axis: Vec3,
    cos_end: f32,
}

impl IntensityDistribution {
    fn new(form: Form, integral: Rgb, (axis, cos_end): (Vec3, f32)) -> Self {
        Self { form, integral, axis, cos_end }
    }

    /// What an image around the sphere says.
    pub fn of_image(image: SphereImage) -> Self {
        let integral = image.mean() * (4.0 * PI);
        Self::new(Form::Image(image), integral, (Vec3::Z, -1.0))
    }

    /// The candela of `profile`.
    pub fn of_profile(profile: Arc<IesProfile>) -> Self {
        let (flux, cone) = (profile.flux(), profile.cone());
        Self::new(Form::Profile(profile), Rgb::splat(flux), cone)
    }

    /// The candela of `profile` times the falloff of a spot along +z ([`super::SpotLight::falloff`]).
    pub fn of_spot(profile: Arc<IesProfile>, cos_start: f32, cos_end: f32) -> Self {
        let form = Form::Spot { profile, cos_start, cos_end };
        let mut distribution = Self::new(form, Rgb::BLACK, (Vec3::Z, cos_end));
        // Midpoints of rings of one solid angle, cut into sectors.
        const RINGS: usize = 512;
        const SECTORS: usize = 128;
        let solid_angle = f64::from(TAU * (1.0 - cos_end)) / (RINGS * SECTORS) as f64;
        let mut sum = 0.0;
        for k in 0..RINGS * SECTORS {
            let u = [(k / SECTORS) as f32 + 0.5, (k % SECTORS) as f32 + 0.5];
            let w = uniform_cone([u[0] / RINGS as f32, u[1] / SECTORS as f32], 1.0 - cos_end);
            sum += f64::from(distribution.at(w)[0]);
        }
        distribution.integral = Rgb::splat((sum * solid_angle) as f32);
        distribution
    }

    /// What a projector shows.
    pub fn of_projection(projection: Projection) -> Self {
        let (integral, cone) = (projection.integral(), projection.cone());
        Self::new(Form::Projection(projection), integral, cone)
    }

    /// The value in the unit direction `w`.
    #[inline]
    pub fn at(&self, w: Vec3) -> Rgb {
        match &self.form {
            Form::Image(image) => image.at(w),
            Form::Profile(profile) => Rgb::splat(profile.candela(w)),
            Form::Spot { profile, cos_start, cos_end } => {
                Rgb::splat(profile.candela(w) * falloff(w.z, *cos_start, *cos_end))
            }
            Form::Projection(projection) => projection.at(w),
        }
    }

    /// The integral over the sphere.
    pub fn integral(&self) -> Rgb {
        self.integral
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        size_of::<Self>()
            + match &self.form {
                Form::Image(image) => image.memory(),
                Form::Profile(profile) | Form::Spot { profile, .. } => profile.memory(),
                Form::Projection(projection) => projection.memory(),
            }
    }
}

/// A point that radiates by a distribution.
#[derive(Clone, Debug)]
pub struct GoniometricLight {
    /// Where, in render space.
    pub p: Vec3,
    /// Intensity (W/sr) where the distribution is 1.
    pub intensity: Rgb,
    /// Render space to the distribution's: orthogonal, perhaps a reflection.
    pub to_local: Mat3,
    /// Shared among lights that differ in nothing but place, orientation and strength.
    pub distribution: Arc<IntensityDistribution>,
}

impl GoniometricLight {
    /// The intensity in the unit direction `w` of render space, away from the light.
    #[inline]
    pub fn intensity_towards(&self, w: Vec3) -> Rgb {
        self.intensity * self.distribution.at((self.to_local * w).normalize_or(Vec3::Z))
    }

    /// The only direction there is.
    #[inline]
    pub fn sample(&self, p: Vec3) -> Option<LightSample> {
        point::towards(self.p, p, |w| self.intensity_towards(w))
    }

    /// Φ.
    pub fn power(&self) -> Rgb {
        self.intensity * self.distribution.integral
    }

    /// Unit axis of a cone that holds all its light, in render space.
    #[inline]
    pub fn axis(&self) -> Vec3 {
        (self.to_local.transpose() * self.distribution.axis).normalize_or(Vec3::Z)
    }

    /// Cosine of that cone's half angle; −1 for the whole sphere.
    #[inline]
    pub fn cos_end(&self) -> f32 {
        self.distribution.cos_end
    }

    /// The mean intensity within the cone, as luminance.
    pub fn mean_intensity(&self) -> f32 {
        self.power().luminance() / (TAU * (1.0 - self.cos_end())).max(f32::MIN_POSITIVE)
    }

    /// Over what angle, in radians, the intensity may well change: 0 where it jumps.
    pub fn detail(&self) -> f32 {
        match self.distribution.form {
            Form::Projection(_) => 0.0,
            _ => 1.0 / 16.0,
        }
    }
}
