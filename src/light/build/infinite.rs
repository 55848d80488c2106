//! `LightSource "infinite"`: constant, an image, or either through a portal.

use std::f32::consts::PI;

use glam::{DMat4, Mat3, Vec3};

use super::{Builder, Result};
use crate::light::environment::Environment;
use crate::light::sphere_image::{Layout, SphereImage};
use crate::light::{InfiniteLight, Portal};
use crate::math::Rgb;
use crate::scene::ParamSet;

impl Builder<'_> {
    /// Light from infinity, turned by `to_render`.
    pub(super) fn infinite(&mut self, params: &ParamSet, to_render: Mat3) -> Result<()> {
        let mut illuminance = params.float_opt("illuminance")?.filter(|&e| e > 0.0);
        let portal = self.portal(params)?;
        let name = params.string("filename")?;
        if name.is_none() && portal.is_none() {
            let radiance = self.sky(params)? * illuminance.map_or(1.0, |e| e / PI);
            self.lights.add_infinite(InfiniteLight::Constant(radiance));
            return Ok(());
        }
        let mut scale = self.sky(params)?;
        let image = match name {
            None => {
                scale *= illuminance.take().map_or(1.0, |e| e / PI);
                SphereImage::new(Layout::Octahedral, 1, 1, vec![[1.0; 3]])
            }
            Some(name) => {
                self.warn_of_both(params);
                let colours = self.colours(params, name)?;
                self.sphere_image(params, name, colours)?
            }
        };
        let light = match portal {
            None => self.environment(params, image, scale, to_render, illuminance),
            Some(corners) => {
                if let Some(wanted) = illuminance {
                    scale *= self.illuminance_factor(params, wanted, scale, image.upper_illuminance(scale));
                }
                let portal = Portal::new(image, scale, to_render, corners).ok_or_else(|| not_a_rectangle(params))?;
                InfiniteLight::Portal(Box::new(portal))
            }
        };
        self.lights.add_infinite(light);
        Ok(())
    }

    /// `L` times `scale`. Of several spectra the first counts, as in pbrt-v4 for this light alone: other programs add a scale to a temperature.
    fn sky(&mut self, params: &ParamSet) -> Result<Rgb> {
        let colour = params.first_spectrum("L", self.warnings)?.map_or(Rgb::WHITE, |spectrum| spectrum.to_illuminant());
        self.non_negative(params, colour * params.float("scale", 1.0)?)
    }

    fn environment(
        &mut self,
        params: &ParamSet,
        image: SphereImage,
        scale: Rgb,
        to_render: Mat3,
        illuminance: Option<f32>,
    ) -> InfiniteLight {
        let light = Environment::new(image, scale, to_render);
        match light.filter(|environment| !environment.mean_radiance().is_black()) {
            None => InfiniteLight::Constant(Rgb::BLACK),
            Some(mut environment) => {
                if let Some(wanted) = illuminance {
                    let found = environment.upper_illuminance();
                    let factor = self.illuminance_factor(params, wanted, scale, found);
                    if factor != 1.0 {
                        environment.scale_by(factor);
                    }
                }
                InfiniteLight::Image(Box::new(environment))
            }
        }
    }

    /// By what to multiply an image whose upper half gives the illuminance `found`, already times `scale`.
    fn illuminance_factor(&mut self, params: &ParamSet, wanted: f32, scale: Rgb, found: f32) -> f32 {
        let factor = wanted * scale.luminance() / found;
        if factor.is_finite() {
            return factor;
        }
        self.warnings.add(Some(params.span), "the image's upper half is dark: \"illuminance\" is ignored");
        1.0
    }

    /// The corners of `portal` in render space. They stand in world space, whatever transform is in force, as in pbrt-v4.
    fn portal(&self, params: &ParamSet) -> Result<Option<[Vec3; 4]>> {
        if params.get("portal").is_none() {
            return Ok(None);
        }
        let &[a, b, c, d] = params.vec3s("portal")? else {
            return Err(params.wrong("portal", "four points"));
        };
        let to_render = self.space.from_world(&DMat4::IDENTITY);
        Ok(Some([a, b, c, d].map(|p| to_render.transform_point3(Vec3::from(p).as_dvec3()).as_vec3())))
    }
}

fn not_a_rectangle(params: &ParamSet) -> Box<crate::scene::SceneError> {
    params.wrong("portal", "the corners of a rectangle, one after the other")
}
