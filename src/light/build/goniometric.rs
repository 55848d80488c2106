//! Points whose intensity depends on the direction: `point` and `spot` with a photometric file, `goniometric`, `projection`.
//!
//! What a photometric file says is taken by `iesunits`: candela (1 cd has the luminance that an `I` of 1 has), watts (683 lm of green are one),
//! or relative (1 is the largest value). It multiplies I and `scale`; `power` replaces it: that is what the light emits in all, as for
//! every light.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Mat3, Vec3};

use super::{Builder, Result, power_scale, turn_and_stretch};
use crate::light::ies::IesProfile;
use crate::light::projection::Projection;
use crate::light::sphere_image::SphereImage;
use crate::light::{GoniometricLight, IntensityDistribution, PointLight};
use crate::math::{Frame, Rgb};
use crate::scene::{ParamSet, SceneError, SceneErrorKind};

/// Lumens of a watt of light of 555 nm.
const LUMENS_PER_WATT: f32 = 683.0;

/// A distribution and what to multiply I by.
pub(super) struct Luminaire {
    pub distribution: Arc<IntensityDistribution>,
    pub strength: f32,
}

impl Builder<'_> {
    /// What the photometric file of `params` makes of a point, or of a spot with these cosines.
    pub(super) fn luminaire(&mut self, params: &ParamSet, cone: Option<[f32; 2]>) -> Result<Option<Luminaire>> {
        let Some(profile) = self.profile(params)? else { return Ok(None) };
        let factor = units(params, &profile)?;
        let key = (Arc::as_ptr(&profile) as usize, cone.map(|cosines| cosines.map(f32::to_bits)));
        let distribution = self.files.luminaires.entry(key).or_insert_with(|| {
            Arc::new(match cone {
                None => IntensityDistribution::of_profile(profile),
                Some([cos_start, cos_end]) => IntensityDistribution::of_spot(profile, cos_start, cos_end),
            })
        });
        let distribution = distribution.clone();
        let strength = match params.float_opt("power")?.filter(|&power| power > 0.0) {
            None => factor,
            Some(power) => strength_for(params, power, &distribution)?,
        };
        Ok(Some(Luminaire { distribution, strength }))
    }

    /// A spot with a photometric file: along `axis`, turned about it so that the profile's +x is as near to the light's as it can be.
    pub(super) fn luminaire_in_cone(
        &mut self,
        params: &ParamSet,
        to_render: &DAffine3,
        p: Vec3,
        axis: Vec3,
        cosines: [f32; 2],
    ) -> Result<()> {
        let Some(Luminaire { distribution, strength }) = self.luminaire(params, Some(cosines))? else { return Ok(()) };
        let along = |v: DVec3| to_render.transform_vector3(v).normalize_or_zero().as_vec3();
        // Along the light's own x axis, what turned z into x has turned x into −z.
        let x = along(DVec3::X);
        let x = if x.dot(axis).abs() < 0.999_999 { x } else { along(DVec3::NEG_Z) };
        let frame = Frame::from_zx(axis, x);
        let y = frame.y * to_render.matrix3.determinant().signum() as f32;
        let intensity = self.emission(params, "I")? * strength;
        let to_local = Mat3::from_cols(frame.x, y, frame.z).transpose();
        self.lights.add_goniometric(GoniometricLight { p, intensity, to_local, distribution });
        Ok(())
    }

    /// An image around a point, with +y of the light's space up, as in pbrt-v4.
    pub(super) fn goniometric(&mut self, params: &ParamSet, to_render: &DAffine3) -> Result<()> {
        let p = to_render.translation.as_vec3();
        let (orthogonal, _) = turn_and_stretch(params, to_render)?;
        let Some(name) = params.string("filename")? else {
            self.warnings.add(Some(params.span), "no \"filename\": the light shines alike in all directions");
            let intensity = self.emission(params, "I")? * power_scale(params, 4.0 * PI)?;
            self.lights.add_point(PointLight { p, intensity });
            return Ok(());
        };
        let path = self.scene.resolve(name);
        let distribution = match self.files.spheres.get(&path) {
            Some(distribution) => distribution.clone(),
            None => {
                let mut colours = self.colours(params, name)?;
                // As in pbrt-v4, colour is the business of I.
                colours.pixels.iter_mut().for_each(|pixel| *pixel = [pixel.iter().sum::<f32>() / 3.0; 3]);
                let image: SphereImage = self.sphere_image(params, name, colours)?;
                let distribution = Arc::new(IntensityDistribution::of_image(image));
                self.files.spheres.insert(path, distribution.clone());
                distribution
            }
        };
        let strength = match params.float_opt("power")?.filter(|&power| power > 0.0) {
            None => 1.0,
            Some(power) => strength_for(params, power, &distribution)?,
        };
        let intensity = self.emission(params, "I")? * strength;
        let to_local = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::Y) * orthogonal.transpose();
        self.lights.add_goniometric(GoniometricLight { p, intensity, to_local, distribution });
        Ok(())
    }

    /// An image before a point. What stretches the light's space stretches the image, as in pbrt-v4.
    pub(super) fn projection(&mut self, params: &ParamSet, to_render: &DAffine3) -> Result<()> {
        let name = params.string("filename")?.ok_or_else(|| {
            let message = format!("{} needs an image: \"filename\"", params.owner);
            SceneError::at(params.span, SceneErrorKind::Parameter(message))
        })?;
        let fov = params.float("fov", 90.0)?;
        if !(fov > 0.0 && fov < 180.0) {
            return Err(params.wrong("fov", "above 0 and below 180 degrees"));
        }
        let slide = self.slide(params, name)?;
        let (orthogonal, stretch) = turn_and_stretch(params, to_render)?;
        // Lengths do not matter, only how they differ by direction.
        let size = stretch.determinant().abs().cbrt();
        let distribution = Arc::new(IntensityDistribution::of_projection(Projection::new(slide, fov, stretch / size)));
        let strength = match params.float_opt("power")?.filter(|&power| power > 0.0) {
            None => 1.0,
            Some(power) => strength_for(params, power, &distribution)?,
        };
        let intensity = self.non_negative(params, Rgb::splat(params.float("scale", 1.0)? * strength))?;
        let p = to_render.translation.as_vec3();
        self.lights.add_goniometric(GoniometricLight { p, intensity, to_local: orthogonal.transpose(), distribution });
        Ok(())
    }
}

/// What makes a distribution emit `power` in all.
fn strength_for(params: &ParamSet, power: f32, distribution: &IntensityDistribution) -> Result<f32> {
    let strength = power / distribution.integral().luminance();
    if strength.is_finite() {
        Ok(strength)
    } else {
        Err(params.wrong("power", "left out: the light is dark in all directions"))
    }
}

/// The factor on a profile's candela.
fn units(params: &ParamSet, profile: &IesProfile) -> Result<f32> {
    match params.string("iesunits")?.unwrap_or("candela") {
        "candela" => Ok(1.0),
        "watts" => Ok(1.0 / LUMENS_PER_WATT),
        "relative" => Ok(1.0 / profile.greatest().max(f32::MIN_POSITIVE)),
        _ => Err(params.wrong("iesunits", "\"candela\", \"watts\" or \"relative\"")),
    }
}
