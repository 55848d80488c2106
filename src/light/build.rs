//! From a scene's directives to [`Lights`]. Parameters, defaults and units as in pbrt-v4's file format: `scale` multiplies;
//! `power` and `illuminance` (photometric, in the unit that RGB (1, 1, 1) has as luminance 1) replace what L or I would give.
//!
//! Lights that move stand still where they start. What is not supported is named in a warning and left out.

use std::collections::HashMap;
use std::f32::consts::PI;

use glam::{DAffine3, DVec3, Mat3, Vec3};

use super::environment::{Environment, Layout};
use super::linking::LinkRequests;
use super::linking::labels::Labels;
use super::spot::cone_power;
use super::{AreaLight, DistantLight, InfiniteLight, Lights, PointLight, SpotLight};
use crate::film::image::{Encoding, Image, read_image};
use crate::geometry::sampling::{ShapeSampler, round_sphere, similarity_scale};
use crate::geometry::{Geometry, InstanceId, MotionTransform, ShapeId, ShapeKind};
use crate::math::Rgb;
use crate::math::transform::{Decomposed, RenderSpace};
use crate::scene::{Entity, LightEntity, ParamSet, SceneDescription, SceneError, SceneErrorKind, Span, Warnings};

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
        let (tally, lights) = (Tally::default(), Self::default());
        let mut builder = Builder { scene, geometry, space, strict, tally, warnings, lights };
        builder.area_lights(emitters)?;
        for (place, &(_, entity)) in emitters.iter().enumerate() {
            labels.set(place, labels.area(entity));
        }
        for light in &scene.lights {
            let label = labels.read(&light.entity.params)?;
            let place = builder.lights.len();
            builder.light(light)?;
            // Not if it was left out.
            if builder.lights.len() > place {
                labels.set(place, label);
            }
            light.entity.params.warn_unused(builder.warnings);
        }
        builder.tally.flush(builder.warnings);
        let mut lights = builder.lights;
        lights.set_linking(labels.link(links, strict, warnings)?);
        lights.points.shrink_to_fit();
        lights.spots.shrink_to_fit();
        lights.others.shrink_to_fit();
        Ok(lights)
    }
}

impl Builder<'_> {
    fn area_lights(&mut self, emitters: &[(ShapeId, u32)]) -> Result<()> {
        let mut emissions: HashMap<u32, Emission> = HashMap::new();
        let places = Placement::of(self.geometry, emitters);
        self.lights.area.reserve_exact(emitters.len());
        for &(shape, entity) in emitters {
            let directive = &self.scene.area_lights[entity as usize];
            if let std::collections::hash_map::Entry::Vacant(vacant) = emissions.entry(entity) {
                let emission = self.area_emission(directive)?;
                directive.params.warn_unused(self.warnings);
                vacant.insert(emission);
            }
            let emission = emissions[&entity];
            let light = self.area_light(shape, places.get(&shape), emission, Some(directive.span()))?;
            self.lights.area.push(light);
        }
        Ok(())
    }

    fn area_emission(&mut self, directive: &Entity) -> Result<Emission> {
        let params = &directive.params;
        let mut emission = Emission { radiance: Rgb::BLACK, power: None, two_sided: false };
        if directive.kind != "diffuse" {
            let message = format!("area light type \"{}\" is not supported: the shape does not emit", directive.kind);
            self.unsupported(params.span, message, "only \"diffuse\" area lights exist")?;
            return Ok(emission);
        }
        emission.two_sided = params.bool("twosided", false)?;
        emission.power = params.float_opt("power")?.filter(|&power| power > 0.0);
        let mut radiance = self.emission(params, "L")?;
        if let Some(name) = params.string("filename")? {
            let image = self.image(params, name)?;
            radiance *= mean_colour(&image);
            self.unsupported(
                params.span,
                format!(
                    "an image on an area light (\"{name}\") is not supported: it emits the image's mean everywhere"
                ),
                "give a constant L",
            )?;
        }
        emission.radiance = radiance;
        Ok(emission)
    }

    fn area_light(
        &mut self,
        id: ShapeId,
        place: Option<&Placement>,
        emission: Emission,
        span: Option<Span>,
    ) -> Result<AreaLight> {
        let shape = &self.geometry.shapes[id.0 as usize];
        let mut light = AreaLight {
            shape: id,
            instance: None,
            radiance: emission.radiance,
            two_sided: emission.two_sided,
            invisible: false,
            by_cone: false,
            sampler: None,
            parts: None,
            area: 0.0,
            bounds: Default::default(),
        };
        let transform = match place {
            None => None,
            Some(&Placement { first: Some(instance), count: 1 }) => {
                light.instance = Some(instance);
                Some(&self.geometry.instances[instance.0 as usize].transform)
            }
            Some(Placement { count, .. }) => {
                if *count > 1 {
                    self.dark(
                        span,
                        "an area light in an object that is instanced more than once is not supported: it is dark",
                    )?;
                }
                light.radiance = Rgb::BLACK;
                return Ok(light);
            }
        };
        light.sampler = ShapeSampler::new(&shape.kind);
        if light.sampler.is_none() {
            let message = match shape.kind {
                ShapeKind::Curves(_) => "curves cannot be area lights: they are dark",
                _ => "a shape without area cannot emit: it is dark",
            };
            self.dark(span, message)?;
            light.radiance = Rgb::BLACK;
            return Ok(light);
        }
        let even = match transform {
            None => true,
            Some(MotionTransform::Fixed(m)) => similarity_scale(&m.matrix3).is_some(),
            Some(moving) => [0.0, 0.5, 1.0].iter().all(|&t| similarity_scale(&moving.at(t).matrix3).is_some()),
        };
        light.by_cone = even
            && shape.alpha.is_none()
            && matches!(&shape.kind, ShapeKind::Sphere(sphere) if round_sphere(sphere).is_some());
        light.area = super::area::extent::area(shape, transform.map(|t| t.at(0.0)).as_ref());
        light.bounds = super::area::extent::bounds(shape, transform);
        if let Some(power) = emission.power {
            let unit = PI * light.area * if light.two_sided { 2.0 } else { 1.0 };
            light.radiance *= power / unit;
        }
        if !light.radiance.is_finite() || !light.area.is_finite() {
            self.dark(span, "an area light is too large or too small for its power: it is dark")?;
            (light.radiance, light.sampler) = (Rgb::BLACK, None);
        }
        light.build_parts(shape);
        Ok(light)
    }

    fn light(&mut self, light: &LightEntity) -> Result<()> {
        let params = &light.entity.params;
        let span = Some(params.span);
        if light.transform.is_animated() {
            self.tally.add(span, "a moving light is not supported: it stands still where it starts");
        }
        let to_render = self.space.from_world(&light.transform.start);
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
            "point" if params.has("P") => self.points(params, &to_render)?,
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
                let edge = params.float("conedeltaangle", 5.0)?.clamp(0.0, angle);
                let (cos_start, cos_end) = ((angle - edge).to_radians().cos(), angle.to_radians().cos());
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
                let decomposed = Decomposed::new(&to_render).ok_or_else(|| singular(params))?;
                let sign = to_render.matrix3.determinant().signum();
                let orthogonal = glam::DMat3::from_quat(decomposed.rotation) * sign;
                self.infinite(params, orthogonal.as_mat3())?;
            }
            kind => {
                let known = ["goniometric", "projection"].contains(&kind);
                let message = format!(
                    "light type \"{kind}\" is {}: the light is left out",
                    if known { "not supported" } else { "unknown" }
                );
                self.unsupported(
                    params.span,
                    message,
                    "supported are point, spot, distant, infinite and diffuse area lights",
                )?;
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
        let power = power_scale(params, 4.0 * PI)?;
        let colours = params.spectra("I")?;
        let one = if colours.len() <= 1 { Some(self.emission(params, "I")? * power) } else { None };
        if one.is_none() && colours.len() != positions.len() {
            let expected = format!("one value, or one for each of the {} positions of \"P\"", positions.len());
            return Err(params.wrong("I", &format!("{expected}, found {}", colours.len())));
        }
        let scale = power * params.float("scale", 1.0)?;
        self.lights.reserve_points(positions.len());
        for (i, position) in positions.iter().enumerate() {
            let p = to_render.transform_point3(Vec3::from(*position).as_dvec3()).as_vec3();
            let intensity = match one {
                Some(intensity) => intensity,
                None => self.non_negative(params, colours[i].to_illuminant() * scale)?,
            };
            self.lights.add_point(PointLight { p, intensity });
        }
        Ok(())
    }

    fn infinite(&mut self, params: &ParamSet, to_render: Mat3) -> Result<()> {
        let illuminance = params.float_opt("illuminance")?.filter(|&e| e > 0.0);
        if params.get("portal").is_some() {
            let message = "a portal is not supported: the light shines from everywhere".to_string();
            self.unsupported(params.span, message, "remove \"portal\"")?;
        }
        let Some(name) = params.string("filename")? else {
            let radiance = self.emission(params, "L")? * illuminance.map_or(1.0, |e| e / PI);
            self.lights.add_infinite(InfiniteLight::Constant(radiance));
            return Ok(());
        };
        let scale = self.emission(params, "L")?;
        let image = self.image(params, name)?;
        let layout = if image.width == image.height {
            Layout::Octahedral
        } else if image.width == 2 * image.height {
            self.warnings.add(
                Some(params.span),
                format!("\"{name}\" is twice as wide as high: taken as latitude and longitude (pbrt-v4 wants a square, equal-area image)"),
            );
            Layout::LatLong
        } else {
            let (w, h) = (image.width, image.height);
            let message = format!(
                "environment image \"{name}\" is {w}×{h}, neither square (equal-area) nor 2:1 (latitude, longitude)"
            );
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
        };
        let (pixels, bad) = rgb_pixels(&image);
        if bad > 0 {
            let message = format!("{bad} pixels of \"{name}\" are negative or not finite: taken as 0");
            if self.strict {
                return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
            }
            self.warnings.add(Some(params.span), message);
        }
        let light = Environment::new(layout, image.width, image.height, pixels, scale, to_render);
        let light = light.filter(|environment| !environment.mean_radiance().is_black());
        self.lights.add_infinite(match light {
            None => InfiniteLight::Constant(Rgb::BLACK),
            Some(mut environment) => {
                if let Some(wanted) = illuminance {
                    let factor = wanted * scale.luminance() / environment.upper_illuminance();
                    if factor.is_finite() {
                        environment.scale_by(factor);
                    } else {
                        self.warnings
                            .add(Some(params.span), "the image's upper half is dark: \"illuminance\" is ignored");
                    }
                }
                InfiniteLight::Image(Box::new(environment))
            }
        });
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

    fn image(&self, params: &ParamSet, name: &str) -> Result<Image> {
        read_image(&self.scene.resolve(name), Encoding::Auto).map_err(|error| {
            SceneError::at(params.span, SceneErrorKind::File { path: error.path, reason: error.reason })
        })
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

#[derive(Clone, Copy)]
struct Emission {
    radiance: Rgb,
    power: Option<f32>,
    two_sided: bool,
}

/// The instances that show a shape of a prototype.
struct Placement {
    first: Option<InstanceId>,
    count: usize,
}

impl Placement {
    /// For those emitters that belong to prototypes.
    fn of(geometry: &Geometry, emitters: &[(ShapeId, u32)]) -> HashMap<ShapeId, Self> {
        if geometry.prototypes.is_empty() {
            return HashMap::new();
        }
        let mut shown: Vec<(Option<InstanceId>, usize)> = vec![(None, 0); geometry.prototypes.len()];
        for (i, instance) in geometry.instances.iter().enumerate() {
            let (first, count) = &mut shown[instance.prototype as usize];
            first.get_or_insert(InstanceId(i as u32));
            *count += 1;
        }
        let emitting: std::collections::HashSet<ShapeId> = emitters.iter().map(|e| e.0).collect();
        let prototypes = geometry.prototypes.iter().zip(shown);
        prototypes
            .flat_map(|(prototype, (first, count))| {
                prototype.shapes.iter().map(move |&shape| (shape, Self { first, count }))
            })
            .filter(|(shape, _)| emitting.contains(shape))
            .collect()
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
}

fn direction(params: &ParamSet, vector: DVec3) -> Result<Vec3> {
    vector.try_normalize().map(|v| v.as_vec3().normalize()).ok_or_else(|| {
        let message = format!("\"from\" and \"to\" of {} are the same point", params.owner);
        SceneError::at(params.span, SceneErrorKind::Parameter(message))
    })
}

/// RGB triples with bad values set to 0, and how many pixels had any.
fn rgb_pixels(image: &Image) -> (Vec<[f32; 3]>, usize) {
    let mut bad = 0;
    let pixels = image
        .pixels
        .chunks_exact(image.channels.max(1))
        .map(|pixel| {
            let rgb = if pixel.len() >= 3 { [pixel[0], pixel[1], pixel[2]] } else { [pixel[0]; 3] };
            let good = |c: f32| c >= 0.0 && c.is_finite();
            bad += usize::from(!rgb.into_iter().all(good));
            rgb.map(|c| if good(c) { c } else { 0.0 })
        })
        .collect();
    (pixels, bad)
}

fn mean_colour(image: &Image) -> Rgb {
    let (pixels, _) = rgb_pixels(image);
    let sum = pixels.iter().fold([0.0f64; 3], |sum, p| std::array::from_fn(|c| sum[c] + f64::from(p[c])));
    Rgb::from(sum.map(|s| (s / pixels.len().max(1) as f64) as f32))
}
