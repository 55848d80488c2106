//! Shapes that emit: `AreaLightSource "diffuse"`.
//!
//! An image (`filename`) over the shape's texture coordinates and a photometric file (`ies`) about its normal multiply L. What a mesh emits in
//! all, and so `power` (of each face, as in pbrt-v4), counts the image as it lies on the shape.

use std::collections::HashMap;
use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;

use super::{Builder, Result};
use crate::geometry::sampling::{ShapeSampler, round_sphere, similarity_scale};
use crate::geometry::{Geometry, InstanceId, MotionTransform, ShapeId, ShapeKind};
use crate::light::AreaLight;
use crate::light::area::extent;
use crate::light::area::pattern::{DirectionalEmission, EmissionImage, EmissionPattern, ImageMeans, ImageSums};
use crate::math::Rgb;
use crate::scene::{Entity, Param, Span};

impl Builder<'_> {
    /// One for each of `emitters`.
    pub(super) fn area_lights(&mut self, emitters: &[(ShapeId, u32)]) -> Result<()> {
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
            let emission = &emissions[&entity];
            let light = self.area_light(shape, places.get(&shape), emission, Some(directive.span()))?;
            self.lights.area.push(light);
        }
        Ok(())
    }

    fn area_emission(&mut self, directive: &Entity) -> Result<Emission> {
        let params = &directive.params;
        let mut emission = Emission::default();
        if directive.kind != "diffuse" {
            let message = format!("area light type \"{}\" is not supported: the shape does not emit", directive.kind);
            self.unsupported(params.span, message, "only \"diffuse\" area lights exist")?;
            // Said in one line.
            params.iter().for_each(Param::mark_used);
            return Ok(emission);
        }
        emission.two_sided = params.bool("twosided", false)?;
        emission.power = params.float_opt("power")?.filter(|&power| power > 0.0);
        emission.radiance = self.emission(params, "L")?;
        if let Some(name) = params.string("filename")? {
            self.warn_of_both(params);
            emission.image = Some(self.emission_image(params, name)?);
        }
        if let Some(profile) = self.profile(params)? {
            let scale = 1.0 / profile.greatest().max(f32::MIN_POSITIVE);
            let reference = params.vec3("iesreference")?.map_or(Vec3::X, Vec3::from);
            let reference = reference.try_normalize().ok_or_else(|| params.wrong("iesreference", "a direction"))?;
            emission.profile = Some(DirectionalEmission { profile, scale, reference });
        }
        Ok(emission)
    }

    fn area_light(
        &mut self,
        id: ShapeId,
        place: Option<&Placement>,
        emission: &Emission,
        span: Option<Span>,
    ) -> Result<AreaLight> {
        let shape = &self.geometry.shapes[id.0 as usize];
        let mut light = AreaLight {
            shape: id,
            instance: None,
            radiance: emission.radiance,
            pattern: None,
            mean: emission.radiance,
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
                (light.radiance, light.mean) = (Rgb::BLACK, Rgb::BLACK);
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
            (light.radiance, light.mean) = (Rgb::BLACK, Rgb::BLACK);
            return Ok(light);
        }
        let even = match transform {
            None => true,
            Some(MotionTransform::Fixed(m)) => similarity_scale(&m.matrix3).is_some(),
            Some(moving) => [0.0, 0.5, 1.0].iter().all(|&t| similarity_scale(&moving.at(t).matrix3).is_some()),
        };
        light.by_cone = even
            && shape.alpha.is_none()
            && !emission.varies()
            && matches!(&shape.kind, ShapeKind::Sphere(sphere) if round_sphere(sphere).is_some());
        light.area = extent::area(shape, transform.map(|t| t.at(0.0)).as_ref());
        light.bounds = extent::bounds(shape, transform);
        let means = light.sampler.as_ref().and_then(|sampler| {
            let (image, sums) = emission.image.as_ref()?;
            Some(ImageMeans::new(image, sums, shape, sampler))
        });
        // The mean factor on the radiance.
        let mut mean = means.as_ref().map_or(Rgb::WHITE, |means| means.overall);
        if emission.varies() {
            let pattern = emission.pattern(transform);
            mean *= pattern.directional_mean();
            light.pattern = Some(Arc::new(pattern));
        }
        if let Some(power) = emission.power {
            let power = power * self.emitting_faces(id, transform, span);
            let unit = PI * light.area * if light.two_sided { 2.0 } else { 1.0 };
            light.radiance *= power / if light.pattern.is_some() { unit * mean.luminance() } else { unit };
        }
        light.mean = if light.pattern.is_some() { light.radiance * mean } else { light.radiance };
        if !light.radiance.is_finite() || !light.mean.is_finite() || !light.area.is_finite() {
            self.dark(span, "an area light is too large or too small for its power: it is dark")?;
            (light.radiance, light.mean, light.sampler) = (Rgb::BLACK, Rgb::BLACK, None);
        }
        light.build_parts(shape, means.as_ref().map(|means| means.weights.as_slice()));
        Ok(light)
    }
}

impl Builder<'_> {
    /// How often `power` counts for a shape: in pbrt-v4 each face of a mesh, as it is stated, is a light of its own. Here all faces emit alike, so those that
    /// differ in size do not each emit what they would there, and that is said.
    fn emitting_faces(&mut self, id: ShapeId, transform: Option<&MotionTransform>, span: Option<Span>) -> f32 {
        // A displaced mesh has other faces, as many as its edges are short; one with faces of many corners has more.
        if let Some(&stated) = self.geometry.stated_faces.get(&id) {
            return stated.max(1) as f32;
        }
        let placed = transform.map(|t| t.at(0.0));
        let (mut count, mut least, mut greatest) = (0u32, f64::INFINITY, 0.0f64);
        let areas = extent::face_areas(&self.geometry.shapes[id.0 as usize], placed.as_ref());
        for area in areas.filter(|&area| area > 0.0) {
            (count, least, greatest) = (count + 1, least.min(area), greatest.max(area));
        }
        if greatest > 1.01 * least {
            let message = "\"power\" counts for each face of a mesh, as in pbrt-v4; its faces differ in size, and share the sum by area";
            self.tally.add(span, message);
        }
        count.max(1) as f32
    }
}

/// What a directive says of the shapes it stands before.
#[derive(Clone, Default)]
struct Emission {
    radiance: Rgb,
    power: Option<f32>,
    two_sided: bool,
    image: Option<(Arc<EmissionImage>, Arc<ImageSums>)>,
    /// The reference in the space that the shape stands in.
    profile: Option<DirectionalEmission>,
}

impl Emission {
    /// Whether the radiance depends on the point or the direction.
    fn varies(&self) -> bool {
        self.image.is_some() || self.profile.is_some()
    }

    /// What it depends on, for a shape placed by `transform`, where it has one: as it is at time 0.
    fn pattern(&self, transform: Option<&MotionTransform>) -> EmissionPattern {
        let mut pattern = EmissionPattern {
            image: self.image.as_ref().map(|(image, _)| image.clone()),
            profile: self.profile.clone(),
        };
        if let (Some(directional), Some(transform)) = (&mut pattern.profile, transform) {
            let turned = transform.at(0.0).transform_vector3(directional.reference);
            directional.reference = turned.normalize_or(directional.reference);
        }
        pattern
    }
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
