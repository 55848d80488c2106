//! From what the scene file says to the [`World`] that paths meet. Builds only what the scene needs: media that nothing refers
//! to are not loaded, boundaries that separate nothing are left out, and so are lights that cannot emit.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, Vec3};

use super::RenderError;
use super::regions::camera_regions;
use super::settings::{LightSelection, RenderSettings};
use super::timing::Timings;
use crate::geometry::build::{ShapeBindings, build_shape};
use crate::geometry::{Backend, Geometry, Instance, MotionTransform, Prototype, ShapeId, Tracer};
use crate::integrator::World;
use crate::light::selector::{LightSelector, SelectorKind};
use crate::light::{LightId, Lights};
use crate::material::{MaterialId, Materials};
use crate::math::transform::{Animated, Decomposed, RenderSpace};
use crate::medium::build::build_medium;
use crate::medium::regions::Interface;
use crate::medium::{Medium, MediumId};
use crate::scene::{MediumInterface, SceneDescription, SceneError, SceneErrorKind, ShapeEntity, TextureOr, Warnings};

/// Up to this many lights, `auto` asks every light at every vertex: dear, and cheaper than the samples it saves. In the scene
/// `pier` (some 700 lights, fog) a sample takes 5 times as long as by power, and error² × time is a sixth.
const OPTIMAL_UP_TO: usize = 1024;

/// Builds the world of `scene` for `settings`. `timings` receives the seconds of each step.
pub fn build_world(
    scene: &SceneDescription,
    settings: &RenderSettings,
    backend: Backend,
    timings: &mut Timings,
    warnings: &mut Warnings,
) -> Result<World, RenderError> {
    let space = RenderSpace { origin: scene.camera_position() };

    let start = Instant::now();
    let mut materials = Materials::build(scene, settings.strict, warnings)?;
    let media = MediaBuilder::build(scene, &materials, &space, settings.strict, warnings)?;
    timings.volumes_and_textures = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut builder = GeometryBuilder {
        scene,
        space,
        media: &media,
        materials: &mut materials,
        strict: settings.strict,
        warnings,
        out: Default::default(),
        emitters: vec![],
        invisible: vec![],
    };
    builder.build()?;
    let (geometry, emitters, invisible) = (Arc::new(builder.out), builder.emitters, builder.invisible);
    timings.geometry_load = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let materials = Arc::new(materials);
    let has_opacity = geometry.shapes.iter().any(|shape| shape.has_opacity());
    let opacity = has_opacity.then(|| materials.clone() as Arc<dyn crate::geometry::trace::Opacity>);
    let tracer = Tracer::build(geometry.clone(), opacity, backend)?;
    timings.geometry_build = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let mut lights = Lights::build(scene, &geometry, &space, &emitters, settings.strict, warnings)?;
    if lights.len() > 1 {
        // The power of distant and infinite lights depends on the scene's size: it matters only in a choice.
        let (low, high) = geometry.bounds();
        lights.set_scene_bounds(low, high);
    }
    for light in invisible {
        lights.set_invisible(light);
    }
    if has_opacity {
        lights.set_opacity(materials.clone());
    }
    let selector = build_selector(&lights, settings.lights, warnings);
    timings.lights = start.elapsed().as_secs_f64();

    let mut world = World {
        geometry,
        tracer,
        materials,
        lights,
        selector,
        media: media.media,
        volume_files: media.volume_files,
        interfaces: media.interfaces,
        camera_regions: Default::default(),
    };
    if world.has_media() {
        world.camera_regions = camera_regions(&world, Vec3::ZERO, media.camera);
    }
    Ok(world)
}

/// The selector asked for; `auto` decides by the number of lights.
fn build_selector(lights: &Lights, wanted: LightSelection, warnings: &mut Warnings) -> LightSelector {
    let kind = match wanted {
        LightSelection::Uniform => SelectorKind::Uniform,
        LightSelection::Power => SelectorKind::Power,
        LightSelection::Optimal => SelectorKind::Optimal,
        LightSelection::Auto if lights.len() <= OPTIMAL_UP_TO => SelectorKind::Optimal,
        LightSelection::Auto => SelectorKind::Power,
    };
    LightSelector::build(kind, lights, warnings)
}

/// The media that the scene uses, and the interfaces between them.
struct MediaBuilder {
    media: Vec<Medium>,
    /// How many of them were read from OpenVDB files.
    volume_files: usize,
    interfaces: Vec<Interface>,
    numbers: HashMap<MediumInterface, u32>,
    camera: Option<MediumId>,
}

impl MediaBuilder {
    fn build(
        scene: &SceneDescription,
        materials: &Materials,
        space: &RenderSpace,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Self, RenderError> {
        let mut built =
            Self { media: vec![], volume_files: 0, interfaces: vec![], numbers: HashMap::new(), camera: None };
        let mut ids: HashMap<&str, MediumId> = HashMap::new();
        let shapes = scene.shapes.iter().chain(scene.objects.iter().flat_map(|object| &object.shapes));
        // An opaque surface's media are never seen from within: only boundaries and surfaces that transmit count.
        let used: Vec<&MediumInterface> = shapes
            .filter(|shape| materials.is_transmissive(MaterialId(shape.material.0)))
            .filter_map(|shape| shape.medium_interface.as_ref())
            .collect();
        let mut load = |name: &str, media: &mut Vec<Medium>, warnings: &mut Warnings| -> Result<_, RenderError> {
            if name.is_empty() {
                return Ok(None);
            }
            let key = scene.media.iter().rev().find(|medium| medium.name == name);
            let entity = key
                .ok_or_else(|| SceneError::new(SceneErrorKind::Undefined(format!("no medium is named \"{name}\""))))?;
            if let Some(id) = ids.get(entity.name.as_str()) {
                return Ok(Some(*id));
            }
            let matrix = space.from_world(&entity.transform.start);
            media.push(build_medium(entity, &matrix, scene, strict, warnings)?);
            let id = MediumId(media.len() as u32 - 1);
            ids.insert(&entity.name, id);
            Ok(Some(id))
        };
        for interface in used {
            if interface.inside == interface.outside || built.numbers.contains_key(interface) {
                continue;
            }
            let inside = load(&interface.inside, &mut built.media, warnings)?;
            let outside = load(&interface.outside, &mut built.media, warnings)?;
            built.interfaces.push(Interface { inside, outside });
            built.numbers.insert(interface.clone(), built.interfaces.len() as u32 - 1);
        }
        built.camera = load(&scene.camera_medium, &mut built.media, warnings)?;
        for medium in &scene.media {
            if ids.contains_key(medium.name.as_str()) && medium.entity.kind == "openvdb" {
                built.volume_files += 1;
            }
            if !ids.contains_key(medium.name.as_str()) {
                let message = format!("medium \"{}\" is not used and was not loaded", medium.name);
                warnings.add(Some(medium.entity.span()), message);
            }
        }
        Ok(built)
    }
}

/// A part of an object definition with a motion of its own.
struct ObjectPart {
    prototype: u32,
    /// Part to object.
    transform: Animated,
}

/// Shapes, prototypes and instances in render space.
struct GeometryBuilder<'a> {
    scene: &'a SceneDescription,
    space: RenderSpace,
    media: &'a MediaBuilder,
    materials: &'a mut Materials,
    strict: bool,
    warnings: &'a mut Warnings,
    out: Geometry,
    /// Emitting shapes with their area light; the place is the light's number.
    emitters: Vec<(ShapeId, u32)>,
    /// Emitters that no ray can meet.
    invisible: Vec<LightId>,
}

impl GeometryBuilder<'_> {
    fn build(&mut self) -> Result<(), RenderError> {
        let scene = self.scene;
        for entity in &scene.shapes {
            if entity.transform.is_animated() {
                let shapes = self.shapes(entity, &DAffine3::IDENTITY, true)?;
                let transform = self.motion(&entity.transform)?;
                let prototype = self.prototype(shapes);
                self.out.instances.push(Instance { prototype, transform });
            } else {
                let shapes = self.shapes(entity, &self.space.from_world(&entity.transform.start), true)?;
                self.out.top_level.extend(shapes);
            }
        }
        let mut parts = HashMap::new();
        for instance in &scene.instances {
            let key = (instance.object as usize, instance.transform.is_animated());
            if let Entry::Vacant(vacant) = parts.entry(key) {
                vacant.insert(self.object_parts(key.0, key.1)?);
            }
            for part in &parts[&key] {
                let transform = self.motion(&part.transform.after(&instance.transform))?;
                self.out.instances.push(Instance { prototype: part.prototype, transform });
            }
        }
        Ok(())
    }

    /// The prototypes of an object definition: one with all that does not move, and one for each shape that moves within the
    /// object. Instances are one level deep, so a moving shape in a moving instance is flattened to one motion between the
    /// composed keys.
    ///
    /// What does not move of an object whose instances do is kept in render space, as pbrt-v4 does: translation and rotation of a
    /// moving instance are interpolated apart, and the point they turn about is render space's origin, the camera.
    fn object_parts(&mut self, object: usize, in_motion: bool) -> Result<Vec<ObjectPart>, RenderError> {
        let scene = self.scene;
        let pivot = if in_motion { self.space.origin } else { glam::DVec3::ZERO };
        let from_object = DAffine3::from_translation(-pivot);
        let (mut parts, mut still) = (vec![], vec![]);
        for entity in &scene.objects[object].shapes {
            if entity.transform.is_animated() {
                let shapes = self.shapes(entity, &DAffine3::IDENTITY, false)?;
                parts.push(ObjectPart { prototype: self.prototype(shapes), transform: entity.transform });
            } else {
                let to_prototype = from_object * DAffine3::from_mat4(entity.transform.start);
                still.extend(self.shapes(entity, &to_prototype, false)?);
            }
        }
        if !still.is_empty() {
            let transform = Animated::fixed(glam::DMat4::from_translation(pivot));
            parts.push(ObjectPart { prototype: self.prototype(still), transform });
        }
        Ok(parts)
    }

    fn prototype(&mut self, shapes: Vec<ShapeId>) -> u32 {
        self.out.prototypes.push(Prototype { shapes });
        self.out.prototypes.len() as u32 - 1
    }

    fn motion(&self, transform: &Animated) -> Result<MotionTransform, RenderError> {
        let start = self.space.from_world(&transform.start);
        if !transform.is_animated() {
            return Ok(MotionTransform::Fixed(as_f32(&start)));
        }
        let end = self.space.from_world(&transform.end);
        Ok(MotionTransform::Moving { start: Box::new(Decomposed::new(&start)), end: Box::new(Decomposed::new(&end)) })
    }

    /// Adds the shapes that one directive stands for.
    fn shapes(
        &mut self,
        entity: &ShapeEntity,
        to_space: &DAffine3,
        may_emit: bool,
    ) -> Result<Vec<ShapeId>, RenderError> {
        let material = MaterialId(entity.material.0);
        let is_boundary = self.materials.is_interface(material);
        let interface = entity.medium_interface.as_ref().and_then(|names| self.media.numbers.get(names)).copied();
        if is_boundary && interface.is_none() {
            return Ok(vec![]);
        }
        let area_light = entity.area_light.filter(|_| may_emit);
        if is_boundary && area_light.is_some() {
            let message = "an area light on a shape of material \"interface\" is ignored";
            self.warnings.add(Some(entity.entity.span()), message);
        }
        // As in pbrt, an emitter with an alpha of 0 lights the scene but is not seen.
        let is_invisible = entity.entity.params.float_texture("alpha")? == Some(TextureOr::Value(0.0));
        let alpha = match entity.entity.params.float_texture("alpha")? {
            Some(value) => self.materials.alpha(value, self.scene, self.strict, self.warnings)?,
            None => None,
        };
        let bindings =
            ShapeBindings { material: material.0, light: None, medium_interface: interface, alpha, is_boundary };
        let scene = self.scene;
        let resolve = |name: &str| -> PathBuf { scene.resolve(name) };
        let shapes = build_shape(entity, to_space, &resolve, bindings, self.warnings)?;
        let mut ids = vec![];
        for mut shape in shapes {
            let id = ShapeId(self.out.shapes.len() as u32);
            if let Some(light) = area_light.filter(|_| !is_boundary) {
                shape.light = Some(self.emitters.len() as u32);
                if is_invisible {
                    self.invisible.push(LightId(self.emitters.len() as u32));
                }
                self.emitters.push((id, light));
            }
            self.out.shapes.push(shape);
            ids.push(id);
        }
        Ok(ids)
    }
}

fn as_f32(affine: &DAffine3) -> glam::Affine3A {
    glam::Affine3A { matrix3: affine.matrix3.as_mat3().into(), translation: affine.translation.as_vec3a() }
}
