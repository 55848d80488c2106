//! Shapes, prototypes and instances in render space.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::media::MediaBuilder;
use crate::geometry::affine;
use crate::geometry::build::displacement::{Displacement, can_be_displaced, edge_length};
use crate::geometry::build::{Built, MAX_COORDINATE, ShapeBindings, build_shape};
use crate::geometry::extent::union;
use crate::geometry::{Geometry, Instance, MotionTransform, Prototype, ShapeId};
use crate::light::linking::LinkRequests;
use crate::light::{LightId, LinkSet};
use crate::material::footprint::Footprint;
use crate::material::texture::FloatInput;
use crate::material::{MaterialId, Materials, TexturePoint};
use crate::math::transform::{Animated, Decomposed, RenderSpace};
use crate::medium::Medium;
use crate::render::RenderError;
use crate::scene::{
    InstanceEntity, ParamSet, SceneDescription, SceneError, SceneErrorKind, ShapeEntity, Span, TextureOr, Warnings,
};
use crate::system::memory::available;

/// A part of an object definition with a motion of its own.
struct ObjectPart {
    prototype: u32,
    /// Part to object.
    transform: Animated,
    /// [`Geometry::instance_links`].
    links: [u32; 2],
}

impl ObjectPart {
    /// The part in an object's `instance`: what its shapes have from outside the object (`outer`), they have from there now (`links`).
    fn within(&self, instance: &InstanceEntity, outer: u32, links: u32) -> Self {
        let [from, to] = self.links;
        let transform = self.transform.after(&instance.transform);
        Self { prototype: self.prototype, transform, links: [from, if to == outer { links } else { to }] }
    }
}

/// Parts that one object may come to: objects that hold each other twice double them at every level.
const MOST_PARTS: usize = 1 << 19;

/// Determinants of instances' transforms whose inverses single precision holds.
const DETERMINANTS: RangeInclusive<f64> = 1e-36..=1e36;

/// The option that all lengths of edges are multiplied by (pbrt-v4).
const EDGE_SCALE: &str = "displacementedgescale";

/// Memory is looked at for more.
const MANY_INSTANCES: usize = 1 << 16;

/// Builds the geometry and gathers what it is bound to.
pub(super) struct GeometryBuilder<'a> {
    scene: &'a SceneDescription,
    space: RenderSpace,
    media: &'a MediaBuilder,
    materials: &'a mut Materials,
    links: &'a mut LinkRequests,
    strict: bool,
    warnings: &'a mut Warnings,
    /// What was built.
    pub out: Geometry,
    /// Where each instance was stated.
    spans: Vec<Span>,
    /// The box of each prototype, `None` for empty ones.
    boxes: Vec<Option<(Vec3, Vec3)>>,
    /// The parts of objects, by object and whether they are built for instances that move.
    parts: HashMap<(usize, bool), Rc<[ObjectPart]>>,
    /// Emitting shapes with their area light; the place is the light's number.
    pub emitters: Vec<(ShapeId, u32)>,
    /// Emitters that no ray can meet.
    pub invisible: Vec<LightId>,
}

impl<'a> GeometryBuilder<'a> {
    /// Has built nothing yet.
    pub fn new(
        scene: &'a SceneDescription,
        space: RenderSpace,
        media: &'a MediaBuilder,
        materials: &'a mut Materials,
        links: &'a mut LinkRequests,
        strict: bool,
        warnings: &'a mut Warnings,
    ) -> Self {
        let (out, spans, boxes, parts, emitters, invisible) = Default::default();
        Self { scene, space, media, materials, links, strict, warnings, out, spans, boxes, parts, emitters, invisible }
    }

    /// Builds all shapes and instances.
    pub fn build(&mut self) -> Result<(), RenderError> {
        let scene = self.scene;
        for entity in &scene.shapes {
            if entity.transform.is_animated() {
                let shapes = self.shapes(entity, &DAffine3::IDENTITY, true)?;
                let prototype = self.prototype(shapes);
                self.place(prototype, &entity.transform, [0; 2], entity.entity.span())?;
            } else {
                let shapes = self.shapes(entity, &self.space.from_world(&entity.transform.start), true)?;
                self.out.top_level.extend(shapes);
            }
        }
        for instance in &scene.instances {
            let parts = self.object_parts(instance)?;
            if *instance.transform != Animated::fixed(glam::DMat4::IDENTITY) && self.holds_grids(&parts) {
                let message = "the volumes inside an instance stay where MakeNamedMedium put them (as in pbrt-v4): only their boundary \
                               moves with it";
                self.warnings.add(Some(instance.span), message);
            }
            let (outer, links) = self.links_around(instance)?;
            for part in parts.iter() {
                let part = part.within(instance, outer, links);
                self.place(part.prototype, &part.transform, part.links, instance.span)?;
            }
        }
        self.check_local_rays()
    }

    /// Refuses instances in whose space a ray of this scene could start beyond what tracers hold.
    fn check_local_rays(&self) -> Result<(), RenderError> {
        let (low, high) = self.out.bounds();
        let reach = f64::from(low.abs().max(high.abs()).max_element());
        for (instance, &span) in self.out.instances.iter().zip(&self.spans) {
            for time in [0.0, 1.0] {
                let transform = instance.transform.at(time);
                let inverse = affine::linear(&transform).inverse().to_cols_array();
                let largest = inverse.into_iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
                let farthest = reach + affine::translation(&transform).abs().max_element();
                if !(largest * farthest.max(1.0) <= f64::from(MAX_COORDINATE)) {
                    let what = format!(
                        "an instance is so small in this scene that rays reach it from more than {MAX_COORDINATE:e} of its own units away"
                    );
                    return Err(SceneError::at(span, SceneErrorKind::Parameter(what)).into());
                }
            }
        }
        Ok(())
    }

    /// The parts of the object that `instance` shows: one prototype with all that does not move, one for each shape that moves within the
    /// object, and those of the objects that it holds. Instances are one level deep, so an instance within an object, or a moving shape in a
    /// moving instance, is flattened to one transform, or to one motion between the composed keys.
    ///
    /// What does not move of an object whose instances do is kept in render space, as pbrt-v4 does: translation and rotation of a
    /// moving instance are interpolated apart, and the point they turn about is render space's origin, the camera.
    fn object_parts(&mut self, instance: &InstanceEntity) -> Result<Rc<[ObjectPart]>, RenderError> {
        self.parts_of(instance.object as usize, instance.transform.is_animated(), instance.span)
    }

    fn parts_of(&mut self, object: usize, in_motion: bool, span: Span) -> Result<Rc<[ObjectPart]>, RenderError> {
        if let Some(parts) = self.parts.get(&(object, in_motion)) {
            return Ok(parts.clone());
        }
        let scene = self.scene;
        let pivot = if in_motion { self.space.origin } else { glam::DVec3::ZERO };
        let from_object = DAffine3::from_translation(-pivot);
        let outer = self.stated(&scene.objects[object].links)?;
        let links = [outer; 2];
        let (mut parts, mut still) = (vec![], vec![]);
        for entity in &scene.objects[object].shapes {
            if entity.transform.is_animated() {
                let shapes = self.shapes(entity, &DAffine3::IDENTITY, false)?;
                parts.push(ObjectPart { prototype: self.prototype(shapes), transform: *entity.transform, links });
            } else {
                let to_prototype = from_object * DAffine3::from_mat4(entity.transform.start);
                still.extend(self.shapes(entity, &to_prototype, false)?);
            }
        }
        if !still.is_empty() {
            let transform = Animated::fixed(glam::DMat4::from_translation(pivot));
            parts.push(ObjectPart { prototype: self.prototype(still), transform, links });
        }
        for inner in &scene.objects[object].instances {
            let held = self.parts_of(inner.object as usize, in_motion || inner.transform.is_animated(), inner.span)?;
            if parts.len() + held.len() > MOST_PARTS {
                let what =
                    format!("one object comes to more than {MOST_PARTS} parts, those of objects within it included");
                return Err(SceneError::at(span, SceneErrorKind::Limit(what)).into());
            }
            let (outer, links) = self.links_around(inner)?;
            parts.extend(held.iter().map(|part| part.within(inner, outer, links)));
        }
        let parts: Rc<[ObjectPart]> = parts.into();
        self.parts.insert((object, in_motion), parts.clone());
        Ok(parts)
    }

    /// The links that `Attribute` states around the definition of an instance's object, and those that the instance puts in their place.
    fn links_around(&mut self, instance: &InstanceEntity) -> Result<(u32, u32), RenderError> {
        let outer = &self.scene.objects[instance.object as usize].links;
        Ok((self.stated(outer)?, self.stated(if instance.links.is_some() { &instance.links } else { outer })?))
    }

    fn stated(&mut self, links: &Option<Arc<ParamSet>>) -> Result<u32, RenderError> {
        Ok(links.as_ref().map_or(Ok(LinkSet::ORDINARY), |params| self.links.add(params))?.0)
    }

    /// Whether some shape of the parts is the boundary of a medium given by grids.
    fn holds_grids(&self, parts: &[ObjectPart]) -> bool {
        let shapes = parts.iter().flat_map(|part| &self.out.prototypes[part.prototype as usize].shapes);
        let mut inside = shapes.filter_map(|id| {
            let interface = self.out.shapes[id.0 as usize].medium_interface?;
            self.media.interfaces[interface as usize].inside
        });
        inside.any(|medium| matches!(self.media.media[medium.0 as usize], Medium::Grid(_)))
    }

    fn prototype(&mut self, shapes: Vec<ShapeId>) -> u32 {
        self.boxes.push(shapes.iter().filter_map(|&id| self.out.shape_bounds(id)).reduce(union));
        self.out.prototypes.push(Prototype { shapes });
        self.out.prototypes.len() as u32 - 1
    }

    /// Adds an instance, unless there is nothing of it to see.
    fn place(&mut self, prototype: u32, transform: &Animated, links: [u32; 2], span: Span) -> Result<(), RenderError> {
        let Some((low, high)) = self.boxes[prototype as usize] else { return Ok(()) };
        let start = self.space.from_world(&transform.start);
        let transform = if transform.is_animated() {
            let end = self.space.from_world(&transform.end);
            let (Some(start), Some(end)) = (Decomposed::new(&start), Decomposed::new(&end)) else {
                let what = "a moving shape or instance is flattened to nothing at an end of its motion".to_owned();
                let error = SceneError::at(span, SceneErrorKind::Parameter(what));
                return Err(error
                    .help("both transformations of a motion must be such that they can be inverted")
                    .into());
            };
            // Each stretch keeps its sign, so only a change from one to the other passes a determinant of 0.
            if start.stretch.determinant() * end.stretch.determinant() < 0.0 {
                let what =
                    "a motion turns a shape or instance inside out, and flattens it to nothing on the way".to_owned();
                return Err(SceneError::at(span, SceneErrorKind::Parameter(what)).into());
            }
            MotionTransform::Moving { start: Box::new(start), end: Box::new(end) }
        } else if start.matrix3.determinant() == 0.0 {
            self.warnings.add(Some(span), "an instance is flattened to nothing: it is left out");
            return Ok(());
        } else {
            MotionTransform::Fixed(as_f32(&start))
        };
        let determinants = [0.0, 1.0].map(|time| affine::linear(&transform.at(time)).determinant().abs());
        if !determinants.iter().all(|determinant| DETERMINANTS.contains(determinant)) {
            let what = "an instance is shrunk or stretched beyond what rays can be followed into".to_owned();
            return Err(SceneError::at(span, SceneErrorKind::Parameter(what)).into());
        }
        let (low, high) = transform.bounds(low, high);
        if !(low.abs().max(high.abs()).max_element() <= MAX_COORDINATE) {
            let what = format!("an instance reaches beyond {MAX_COORDINATE:e} units");
            return Err(SceneError::at(span, SceneErrorKind::Parameter(what)).into());
        }
        let (count, capacity) = (self.out.instances.len(), self.out.instances.capacity());
        // A list that is full is copied to one twice as long.
        let needed = (2 * capacity * size_of::<Instance>()) as u64;
        if count == capacity && count > MANY_INSTANCES && available().is_some_and(|left| left < needed) {
            let what = format!("{count} instances fill the memory");
            return Err(SceneError::at(span, SceneErrorKind::Limit(what)).into());
        }
        if links[0] != links[1] {
            self.out.instance_links.resize(count, [0; 2]);
            self.out.instance_links.push(links);
        }
        self.out.instances.push(Instance { prototype, transform });
        self.spans.push(span);
        Ok(())
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
        let stated = entity.medium_interface.as_deref().filter(|_| !self.materials.is_fibre(material));
        let interface = stated.and_then(|names| self.media.numbers.get(names)).copied();
        let area_light = entity.area_light.filter(|_| may_emit);
        if is_boundary && area_light.is_some() {
            let message = "an area light on a shape of material \"interface\" is ignored";
            self.warnings.add(Some(entity.entity.span()), message);
        }
        if is_boundary && interface.is_none() {
            return Ok(vec![]);
        }
        // As in pbrt, an emitter with an alpha of 0 lights the scene but is not seen.
        let is_invisible = entity.entity.params.float_texture("alpha")? == Some(TextureOr::Value(0.0));
        let alpha = match entity.entity.params.float_texture("alpha")? {
            Some(value) => self.materials.alpha(value, self.scene, self.strict, self.warnings)?,
            None => None,
        };
        let links = self.links.add(&entity.entity.params)?.0;
        let bindings =
            ShapeBindings { material: material.0, light: None, medium_interface: interface, alpha, is_boundary, links };
        let scene = self.scene;
        let resolve = |name: &str| -> PathBuf { scene.resolve(name) };
        let heights = self.heights(entity)?;
        let (materials, origin) = (&*self.materials, self.space.origin);
        let height = heights.map(|(input, edge_length)| {
            // Textures in space are looked up where the shape's own transform places it, whatever instances do.
            let at = move |p: DVec3, n, uv| {
                materials
                    .height_at(input, &TexturePoint { p: (p - origin).as_vec3(), n, uv, footprint: Footprint::NONE })
            };
            (at, edge_length)
        });
        let displacement = height.as_ref().map(|(height, edge_length)| Displacement {
            height,
            to_world: [entity.transform.start, entity.transform.end].map(DAffine3::from_mat4),
            edge_length: *edge_length,
            span: entity.entity.params.get("displacement").map_or(entity.entity.span(), |param| param.span),
        });
        let shapes = build_shape(entity, to_space, &resolve, bindings, displacement.as_ref(), self.warnings)?;
        self.out.displaced += if displacement.is_some() { shapes.len() } else { 0 };
        let mut ids = vec![];
        for Built { mut shape, stated_faces } in shapes {
            let id = ShapeId(self.out.shapes.len() as u32);
            if let Some(light) = area_light.filter(|_| !is_boundary) {
                shape.light = Some(self.emitters.len() as u32);
                if is_invisible {
                    self.invisible.push(LightId(self.emitters.len() as u32));
                }
                self.emitters.push((id, light));
                if let Some(stated) = stated_faces {
                    self.out.stated_faces.insert(id, stated);
                }
            }
            self.out.shapes.push(shape);
            ids.push(id);
        }
        Ok(ids)
    }

    /// What displaces a mesh, and the longest edges that it is refined to.
    fn heights(&mut self, entity: &ShapeEntity) -> Result<Option<(FloatInput, f64)>, RenderError> {
        let params = &entity.entity.params;
        if !can_be_displaced(&entity.entity.kind) {
            return Ok(None);
        }
        let Some(value) = params.float_texture("displacement")? else { return Ok(None) };
        let edge_length = f64::from(edge_length(params)?) * f64::from(self.scene.options.positive(EDGE_SCALE, 1.0)?);
        let input = self.materials.height(value, self.scene, self.strict, self.warnings)?;
        Ok(input.map(|input| (input, edge_length)))
    }
}

fn as_f32(affine: &DAffine3) -> glam::Affine3A {
    glam::Affine3A { matrix3: affine.matrix3.as_mat3().into(), translation: affine.translation.as_vec3a() }
}
