//! From a scene's directives to [`Lights`]. Parameters, defaults and units as in pbrt-v4's file format: `scale` multiplies;
//! `power` and `illuminance` (photometric, in the unit that RGB (1, 1, 1) has as luminance 1) replace what L or I would give.
//!
//! Lights from a point may move; those from infinity stay as they start. What is not supported is named in a warning and left out. Shapes that emit are built in
//! `build/area.rs`, light from infinity in `build/infinite.rs`, points whose intensity depends on the direction in
//! `build/goniometric.rs`; `build/files.rs` reads what they name, each file once.

mod area;
mod files;
mod goniometric;
mod infinite;

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Mat3, Vec3};
use rayon::prelude::*;

use self::files::Files;
use super::linking::LinkRequests;
use super::linking::labels::Labels;
use super::moving::{Exposure, MovingLight, Punctual};
use super::spot::cone_power;
use super::{DistantLight, GoniometricLight, LightId, Lights, PointLight, SpotLight};
use crate::geometry::camera::shutter;
use crate::geometry::{Geometry, ShapeId};
use crate::math::Rgb;
use crate::math::transform::{Decomposed, RenderSpace};
use crate::scene::{LightEntity, Param, ParamSet, SceneDescription, SceneError, SceneErrorKind, Span, Warnings};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Warnings that may concern millions of lights: said once each, with the first place and a count.
#[derive(Default)]
struct Tally {
    order: Vec<(&'static str, Option<Span>, usize)>,
}

impl Tally {
    fn add(&mut self, span: Option<Span>, message: &'static str) {
        match self.order.iter_mut().find(|entry| entry.0 == message) {
            Some(entry) => entry.2 += 1,
            None => self.order.push((message, span, 1)),
        }
    }

    fn flush(self, warnings: &mut Warnings) {
        for (message, span, count) in self.order {
            let more = if count > 1 { format!(" ({} more like this)", count - 1) } else { String::new() };
            warnings.add(span, format!("{message}{more}"));
        }
    }
}

struct Builder<'a> {
    scene: &'a SceneDescription,
    geometry: &'a Geometry,
    space: &'a RenderSpace,
    strict: bool,
    tally: Tally,
    warnings: &'a mut Warnings,
    files: Files,
    lights: Lights,
}

impl Lights {
    /// The lights of `scene`: first one for each of `emitters` (a shape and its place in [`SceneDescription::area_lights`]), in that
    /// order, dark where the shape cannot emit; then the `LightSource` directives of supported types. With `strict`, what would be
    /// left out is an error. `links` is what the scene's objects ask for.
    ///
    /// Call [`Lights::set_scene_bounds`] afterwards, and [`Lights::set_opacity`] and [`Lights::set_invisible`] where they apply.
    pub fn build(
        scene: &SceneDescription,
        geometry: &Geometry,
        space: &RenderSpace,
        emitters: &[(ShapeId, u32)],
        links: &LinkRequests,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let mut labels = Labels::of_areas(scene)?;
        let (tally, files, lights) = (Tally::default(), Files::default(), Self::default());
        let mut builder = Builder { scene, geometry, space, strict, tally, warnings, files, lights };
        builder.area_lights(emitters)?;
        for (place, &(_, entity)) in emitters.iter().enumerate() {
            labels.set(place, labels.area(entity));
            if builder.lights.is_dark(LightId(place as u32)) {
                builder.lights.note_dark(scene.area_lights[entity as usize].span());
            }
        }
        for light in &scene.lights {
            let label = labels.read(&light.entity.params)?;
            let place = builder.lights.len();
            builder.light(light)?;
            // Not if it was left out.
            if builder.lights.len() > place {
                (place..builder.lights.len()).for_each(|place| labels.set(place, label));
            }
            builder.note_dark(place, light.entity.span());
            light.entity.params.warn_unused(builder.warnings);
        }
        builder.tally.flush(builder.warnings);
        let mut lights = builder.lights;
        lights.set_linking(labels.link(links, strict, warnings)?);
        lights.points.shrink_to_fit();
        lights.spots.shrink_to_fit();
        lights.goniometrics.shrink_to_fit();
        lights.moving.shrink_to_fit();
        lights.others.shrink_to_fit();
        Ok(lights)
    }
}

impl Builder<'_> {
    /// A light that moves: what it is in its own space, and how that is placed.
    fn moving(&mut self, light: &LightEntity) -> Result<()> {
        let params = &light.entity.params;
        let key = |world| Decomposed::new(&self.space.from_world(world)).ok_or_else(|| singular(params));
        let [start, end] = [key(&light.transform.start)?, key(&light.transform.end)?];
        if start.stretch.determinant() * end.stretch.determinant() < 0.0 {
            let message =
                format!("the motion of {} turns it inside out, and flattens it to nothing on the way", params.owner);
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message))
                .help("mirror both transformations of the motion, or neither"));
        }
        // What is stretched at the start is so in its own space; from there it is only carried and turned.
        let stretch = DAffine3 { matrix3: start.stretch, translation: DVec3::ZERO };
        let others = std::mem::take(&mut self.lights);
        let built = self.light_at(light, &stretch);
        let alone = std::mem::replace(&mut self.lights, others);
        built?;
        let unstretched = start.stretch.inverse();
        let [start, end] = [start, end].map(|key| Decomposed { stretch: key.stretch * unstretched, ..key });
        let exposure = Arc::new(Exposure::new(&start, &end, shutter(self.scene)?));
        let still: Vec<Punctual> = alone.punctual().collect();
        let moving = still.into_par_iter().map(|still| MovingLight::new(still, exposure.clone()));
        for light in moving.collect::<Vec<_>>() {
            self.lights.add_moving(light);
        }
        Ok(())
    }

    /// Remembers `span` if one of the lights from number `first` on is dark.
    fn note_dark(&mut self, first: usize, span: Span) {
        if (first..self.lights.len()).any(|light| self.lights.is_dark(LightId(light as u32))) {
            self.lights.note_dark(span);
        }
    }

    fn light(&mut self, light: &LightEntity) -> Result<()> {
        let params = &light.entity.params;
        let span = Some(params.span);
        let moves = light.transform.is_animated();
        if moves && ["point", "spot", "goniometric", "projection"].contains(&light.entity.kind.as_str()) {
            return self.moving(light);
        }
        if moves {
            self.tally.add(span, "a moving light from infinity is not supported: it stays as it starts");
        }
        self.light_at(light, &self.space.from_world(&light.transform.start))
    }

    fn light_at(&mut self, light: &LightEntity, to_render: &DAffine3) -> Result<()> {
        let params = &light.entity.params;
        if !(to_render.matrix3.determinant().abs() > 0.0
            && to_render.matrix3.is_finite()
            && to_render.translation.is_finite())
        {
            return Err(singular(params));
        }
        let point = |name: &str, default: DVec3| -> Result<DVec3> {
            Ok(params.vec3(name)?.map_or(default, |p| Vec3::from(p).as_dvec3()))
        };
        match light.entity.kind.as_str() {
            "point" if params.has("P") => self.points(params, to_render)?,
            "point" if params.has("ies") => {
                let from = params.vec3("from")?.unwrap_or_default();
                self.points_at(params, to_render, &[from])?;
            }
            "point" => {
                let p = to_render.transform_point3(point("from", DVec3::ZERO)?).as_vec3();
                let intensity = self.emission(params, "I")? * power_scale(params, 4.0 * PI)?;
                self.lights.add_point(PointLight { p, intensity });
            }
            "spot" => {
                let (from, to) = (point("from", DVec3::ZERO)?, point("to", DVec3::Z)?);
                let p = to_render.transform_point3(from).as_vec3();
                let axis = direction(params, to_render.transform_vector3(to - from))?;
                let angle = params.float("coneangle", 30.0)?.clamp(0.0, 180.0);
                // An edge wider than the cone begins at an angle below 0, on the other side of the axis, as in pbrt-v4; one that would begin outside
                // of the cone is hard.
                let edge = params.float("conedeltaangle", 5.0)?.clamp(0.0, 180.0);
                let cos_end = angle.to_radians().cos();
                let cos_start = (angle - edge).to_radians().cos().max(cos_end);
                if params.has("ies") {
                    self.luminaire_in_cone(params, to_render, p, axis, [cos_start, cos_end])?;
                    return Ok(());
                }
                let intensity = self.emission(params, "I")? * power_scale(params, cone_power(cos_start, cos_end))?;
                self.lights.add_spot(SpotLight { p, axis, intensity, cos_start, cos_end });
            }
            "distant" => {
                let (from, to) = (point("from", DVec3::ZERO)?, point("to", DVec3::Z)?);
                let wi = direction(params, to_render.transform_vector3(from - to))?;
                let illuminance = params.float_opt("illuminance")?.filter(|&e| e > 0.0).unwrap_or(1.0);
                let irradiance = self.emission(params, "L")? * illuminance;
                self.lights.add_distant(DistantLight { wi, irradiance });
            }
            "infinite" => {
                let (orthogonal, _) = turn_and_stretch(params, to_render)?;
                self.infinite(params, orthogonal)?;
            }
            "goniometric" => self.goniometric(params, to_render)?,
            "projection" => self.projection(params, to_render)?,
            kind => {
                let message = format!("light type \"{kind}\" is unknown: the light is left out");
                let help = "there are point, spot, goniometric, projection, distant, infinite and diffuse area lights";
                self.unsupported(params.span, message, help)?;
                // Said in one line.
                params.iter().for_each(Param::mark_used);
            }
        }
        Ok(())
    }

    /// A point light at each position of `P`: all of one intensity, or each of its own.
    fn points(&mut self, params: &ParamSet, to_render: &DAffine3) -> Result<()> {
        let positions = params.vec3s("P")?;
        if positions.is_empty() {
            return Err(params.wrong("P", "at least one position"));
        }
        if params.has("from") {
            return Err(params.wrong("from", "left out where \"P\" says where the lights are"));
        }
        self.points_at(params, to_render, positions)
    }

    /// A light at each of `positions`, as it is or with the photometric file that is named.
    fn points_at(&mut self, params: &ParamSet, to_render: &DAffine3, positions: &[[f32; 3]]) -> Result<()> {
        let luminaire = self.luminaire(params, None)?;
        let power = match &luminaire {
            None => power_scale(params, 4.0 * PI)?,
            Some(luminaire) => luminaire.strength,
        };
        let colours = params.spectra("I")?;
        let one = if colours.len() <= 1 { Some(self.emission(params, "I")? * power) } else { None };
        if one.is_none() && colours.len() != positions.len() {
            let expected = format!("one value, or one for each of the {} positions of \"P\"", positions.len());
            return Err(params.wrong("I", &format!("{expected}, found {}", colours.len())));
        }
        let scale = power * params.float("scale", 1.0)?;
        if luminaire.is_none() {
            self.lights.reserve_points(positions.len());
        }
        let to_local = match &luminaire {
            None => Mat3::IDENTITY,
            Some(_) => turn_and_stretch(params, to_render)?.0.transpose(),
        };
        for (i, position) in positions.iter().enumerate() {
            let p = to_render.transform_point3(Vec3::from(*position).as_dvec3()).as_vec3();
            let intensity = match one {
                Some(intensity) => intensity,
                None => self.non_negative(params, colours[i].to_illuminant() * scale)?,
            };
            match &luminaire {
                None => self.lights.add_point(PointLight { p, intensity }),
                Some(luminaire) => {
                    let distribution = luminaire.distribution.clone();
                    self.lights.add_goniometric(GoniometricLight { p, intensity, to_local, distribution })
                }
            };
        }
        Ok(())
    }

    /// The colour parameter `name` (white by default) times `scale`.
    fn emission(&mut self, params: &ParamSet, name: &str) -> Result<Rgb> {
        let colour = params.spectrum(name)?.map_or(Rgb::WHITE, |spectrum| spectrum.to_illuminant());
        self.non_negative(params, colour * params.float("scale", 1.0)?)
    }

    /// Emission that must be finite; what of it is negative becomes 0.
    fn non_negative(&mut self, params: &ParamSet, emission: Rgb) -> Result<Rgb> {
        if !emission.is_finite() {
            let message = format!("the emission of {} is not finite", params.owner);
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
        }
        if emission.min_channel() < 0.0 {
            self.tally.add(Some(params.span), "negative emission is taken as 0");
        }
        Ok(Rgb(emission.0.max(Vec3::ZERO)))
    }

    fn dark(&mut self, span: Option<Span>, message: &'static str) -> Result<()> {
        if self.strict {
            let kind = SceneErrorKind::Unsupported(message.to_string());
            return Err(span.map_or_else(
                || SceneError::new(SceneErrorKind::Unsupported(message.to_string())),
                |s| SceneError::at(s, kind),
            ));
        }
        self.tally.add(span, message);
        Ok(())
    }

    fn unsupported(&mut self, span: Span, message: String, help: &str) -> Result<()> {
        if self.strict {
            return Err(SceneError::at(span, SceneErrorKind::Unsupported(message)).help(help));
        }
        self.warnings.add(Some(span), message);
        Ok(())
    }
}

/// `power` relative to what unit emission gives, or 1.
fn power_scale(params: &ParamSet, unit: f32) -> Result<f32> {
    Ok(params.float_opt("power")?.filter(|&power| power > 0.0).map_or(1.0, |power| power / unit))
}

fn singular(params: &ParamSet) -> Box<SceneError> {
    SceneError::at(
        params.span,
        SceneErrorKind::Parameter(format!("the transform of {} cannot be inverted", params.owner)),
    )
    .help("no axis may be scaled to nothing")
}

/// The orthogonal part of a transform, perhaps a reflection, and the symmetric stretch that goes before it.
fn turn_and_stretch(params: &ParamSet, to_render: &DAffine3) -> Result<(Mat3, Mat3)> {
    let decomposed = Decomposed::new(to_render).ok_or_else(|| singular(params))?;
    let sign = to_render.matrix3.determinant().signum();
    let orthogonal = glam::DMat3::from_quat(decomposed.rotation) * sign;
    Ok((orthogonal.as_mat3(), (decomposed.stretch * sign).as_mat3()))
}

fn direction(params: &ParamSet, vector: DVec3) -> Result<Vec3> {
    vector.try_normalize().map(|v| v.as_vec3().normalize()).ok_or_else(|| {
        let message = format!("\"from\" and \"to\" of {} are the same point", params.owner);
        SceneError::at(params.span, SceneErrorKind::Parameter(message))
    })
}
