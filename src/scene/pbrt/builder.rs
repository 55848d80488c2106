//! Directives into a [`SceneDescription`]: the semantics of the pbrt-v4 file format (its documentation, "Describing the
//! scene"), one method per directive or kind of directive. References by name are checked in [`super::finish`].

mod declare;
mod defaults;
mod transforms;

use std::collections::HashMap;
use std::path::PathBuf;

use glam::{DMat4, DVec3};

use super::directive::{Block, Directive, advice, did_you_mean};
use super::lexer::{self, Token, TokenKind, shown};
use super::older::{UPGRADE, is_older};
use super::parameter::{self, Context};
use super::reader::Reader;
use super::state::{ATTRIBUTE_TARGETS, CurrentMaterial, GraphicsState, look_at};
use crate::math::spectrum::RgbColorSpace;
use crate::math::transform::Animated;
use crate::scene::{
    Entity, LightEntity, MaterialEntity, ObjectEntity, Param, ParamSet, SceneDescription, SceneError, SceneErrorKind,
    Span, SystemEntity, Warnings, locate,
};
use crate::system::memory::available;

/// The most attribute blocks within each other.
const DEEPEST_NESTING: usize = 1 << 16;

/// No memory is short for so few.
const FEW_ENTITIES: usize = 1 << 16;

/// Bytes on the heap of the parameters that shapes and lights have, or more.
const PARAMETERS: usize = 256;

/// Set in the index of a material or object while it still counts names: [`super::finish`] replaces it.
pub const BY_NAME: u32 = 1 << 31;

type Result<T> = std::result::Result<T, Box<SceneError>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Opened {
    Attribute,
    Object,
    Import,
}

struct Saved {
    opened: Opened,
    span: Span,
    state: GraphicsState,
}

/// Camera, film and the like, as far as stated.
#[derive(Default)]
pub struct Header {
    /// `Camera` with its transform and medium.
    pub camera: Option<(Entity, Animated, String)>,
    /// `Film`.
    pub film: Option<Entity>,
    /// `PixelFilter`.
    pub filter: Option<Entity>,
    /// `Sampler`.
    pub sampler: Option<Entity>,
    /// `Integrator`.
    pub integrator: Option<Entity>,
    /// `Option`s.
    pub options: Vec<Param>,
    /// The colour space in force at `Film`.
    pub film_color_space: Option<&'static str>,
    /// `TransformTimes`.
    pub times: Option<[f64; 2]>,
}

/// Names that something refers to, each with the first place that does.
#[derive(Default)]
pub struct References {
    /// In order of first use.
    pub list: Vec<(String, Span)>,
    index: HashMap<String, u32>,
}

impl References {
    /// The place of `name` in the list, adding it if new.
    pub fn add(&mut self, name: &str, span: Span) -> u32 {
        if let Some(&index) = self.index.get(name) {
            return index;
        }
        let index = self.list.len() as u32;
        self.list.push((name.to_owned(), span));
        self.index.insert(name.to_owned(), index);
        index
    }
}

/// The scene so far.
pub struct Builder<'a, 'b> {
    reader: Reader<'a>,
    warnings: &'b mut Warnings,
    base: PathBuf,
    world: bool,
    /// Whether something said that the file is of an older pbrt.
    is_older: bool,
    state: GraphicsState,
    stack: Vec<Saved>,
    /// Coordinate systems, with their places among the scene's; `camera` and `world` are there of themselves.
    systems: HashMap<String, (Animated, Option<usize>)>,
    object: Option<ObjectEntity>,
    object_names: HashMap<String, u32>,
    /// How deeply each object holds others.
    object_depths: Vec<u32>,
    /// The same of the one that is open.
    object_depth: u32,
    /// Named materials: name to index.
    pub(super) material_names: HashMap<String, u32>,
    /// Media: name to index.
    pub(super) medium_names: HashMap<String, u32>,
    /// Textures: (name, is spectrum) to index.
    pub(super) texture_names: HashMap<(String, bool), u32>,
    /// `NamedMaterial`s.
    pub(super) material_references: References,
    /// `MediumInterface`s.
    pub(super) medium_references: References,
    /// `ObjectInstance`s of objects that were not defined yet.
    pub(super) object_references: References,
    area_lights: Vec<(Option<Entity>, u32)>,
    pub(super) header: Header,
    pub(super) scene: SceneDescription,
}

impl<'a, 'b> Builder<'a, 'b> {
    /// An empty scene whose text comes from `reader`.
    pub fn new(reader: Reader<'a>, base: PathBuf, warnings: &'b mut Warnings) -> Self {
        let start = Span { line: 1, column: 1, length: 0, ..reader.here() };
        let entity = |directive: &str, kind: &str| Entity {
            kind: kind.into(),
            params: ParamSet::new(format!("{directive} \"{kind}\""), start, Vec::new()),
        };
        // pbrt-v4's defaults for what a file leaves out.
        let scene = SceneDescription {
            base: base.clone(),
            camera: entity("Camera", "perspective"),
            camera_transform: Animated::fixed(DMat4::IDENTITY),
            camera_medium: String::new(),
            film: entity("Film", "rgb"),
            film_color_space: "srgb",
            filter: entity("PixelFilter", "gaussian"),
            sampler: entity("Sampler", "zsobol"),
            integrator: entity("Integrator", "volpath"),
            options: ParamSet::new("Option", start, Vec::new()),
            transform_times: [0.0, 1.0],
            shapes: Vec::new(),
            objects: Vec::new(),
            instances: Vec::new(),
            lights: Vec::new(),
            area_lights: Vec::new(),
            materials: vec![MaterialEntity { name: None, entity: entity("Material", "diffuse") }],
            media: Vec::new(),
            textures: Vec::new(),
            systems: Vec::new(),
        };
        Self {
            reader,
            warnings,
            base,
            world: false,
            is_older: false,
            state: GraphicsState::default(),
            stack: Vec::new(),
            systems: HashMap::new(),
            object: None,
            object_names: HashMap::new(),
            object_depths: Vec::new(),
            object_depth: 0,
            material_names: HashMap::new(),
            medium_names: HashMap::new(),
            texture_names: HashMap::new(),
            material_references: References::default(),
            medium_references: References::default(),
            object_references: References::default(),
            area_lights: Vec::new(),
            header: Header::default(),
            scene,
        }
    }

    /// Reads everything and checks the names.
    ///
    /// # Errors
    /// The first error in the text.
    pub fn run(mut self) -> Result<SceneDescription> {
        loop {
            match self.reader.next()? {
                Some(token) => self.directive(&token)?,
                None => {
                    if !self.reader.leave_import() {
                        break;
                    }
                    let here = self.reader.here();
                    self.pop(Opened::Import, here)?;
                }
            }
        }
        for open in &self.stack {
            match open.opened {
                Opened::Object => return syntax(open.span, "this ObjectBegin is never ended"),
                // Harmless, and exporters do write such files.
                Opened::Attribute | Opened::Import => {
                    self.warnings.add(Some(open.span), "this block is never ended; the file's end ends it");
                }
            }
        }
        if !self.world {
            return syntax(self.reader.here(), "the file ends before WorldBegin");
        }
        for entity in self.area_lights.iter().filter_map(|(entity, _)| entity.as_ref()) {
            self.warnings.add(Some(entity.span()), "this AreaLightSource is in force at no shape: it lights nothing");
        }
        super::finish::finish(
            self.scene,
            self.header,
            &super::finish::Names {
                materials: &self.material_names,
                media: &self.medium_names,
                textures: &self.texture_names,
                objects: &self.object_names,
                material_references: &self.material_references.list,
                medium_references: &self.medium_references.list,
                object_references: &self.object_references.list,
            },
        )
    }

    fn directive(&mut self, token: &Token) -> Result<()> {
        let text = self.reader.text(token);
        if token.kind != TokenKind::Word {
            return syntax(token.span, format!("expected a directive, found {}", shown(text)));
        }
        let Some(directive) = Directive::from_name(text) else {
            if lexer::looks_like_number(text) {
                return syntax(token.span, format!("expected a directive, found the number {}", shown(text)));
            }
            return Err(syntax::<()>(token.span, format!("unknown directive {}", shown(text)))
                .unwrap_err()
                .help(advice(text)));
        };
        match directive.block() {
            Block::Header if self.world => {
                return syntax(token.span, format!("{} may stand only before WorldBegin", directive.name()));
            }
            Block::World if !self.world => {
                return syntax(token.span, format!("{} may stand only after WorldBegin", directive.name()));
            }
            _ => {}
        }
        self.execute(directive, token.span)
    }

    fn execute(&mut self, directive: Directive, span: Span) -> Result<()> {
        use Directive as D;
        match directive {
            D::Accelerator => {
                let entity = self.entity("Accelerator", span, None)?;
                // pbrt-v4's own change no image, whatever their parameters.
                if !matches!(entity.kind.as_str(), "bvh" | "kdtree") {
                    let message = format!("Accelerator \"{}\" is not known: no image depends on it", entity.kind);
                    self.warnings.add(Some(span), message);
                }
                Ok(())
            }
            D::ActiveTransform => self.active_transform(),
            D::AreaLightSource => {
                let entity = self.entity("AreaLightSource", span, Some("light"))?;
                self.state.area_light = Some(self.area_lights.len() as u32);
                store(&mut self.area_lights, (Some(entity), 0), PARAMETERS, span)
            }
            D::Attribute => self.attribute(),
            D::AttributeBegin => self.push(Opened::Attribute, span),
            D::AttributeEnd => self.pop(Opened::Attribute, span),
            D::Camera => self.camera(span),
            D::ColorSpace => {
                let (name, at) = self.reader.expect_string("a colour space's name")?;
                match RgbColorSpace::named(&name) {
                    Some(space) => self.state.color_space = space,
                    None => {
                        // As in pbrt-v4.
                        let known = did_you_mean(&name, &RgbColorSpace::NAMES);
                        let kept = format!("\"{}\" is kept", self.state.color_space.name);
                        self.warnings.add_fault(at, format!("unknown colour space \"{name}\": {known}"), &kept);
                    }
                }
                Ok(())
            }
            D::ConcatTransform => {
                let matrix = self.matrix(span)?;
                self.concat(matrix, span)
            }
            D::CoordSysTransform => {
                let (name, at) = self.reader.expect_string("a coordinate system's name")?;
                let Some((system, place)) = self.systems.get(&name) else {
                    // As in pbrt-v4.
                    let known: Vec<&str> = self.systems.keys().map(String::as_str).take(32).collect();
                    let what = format!("no coordinate system is called \"{name}\": {}", did_you_mean(&name, &known));
                    self.warnings.add_fault(at, what, "this CoordSysTransform is ignored");
                    return Ok(());
                };
                // Both keys, whichever are active, as in pbrt-v4.
                self.state.ctm.restore(system);
                if let Some(place) = *place {
                    self.scene.systems[place].is_used = true;
                }
                Ok(())
            }
            D::CoordinateSystem => {
                let (name, _) = self.reader.expect_string("a coordinate system's name")?;
                let system = SystemEntity { name: self.reader.name(&name), span, is_used: false };
                self.systems.insert(name, (*self.state.ctm.animated(), Some(self.scene.systems.len())));
                store(&mut self.scene.systems, system, 0, span)
            }
            D::Film => {
                self.header.film = Some(self.once(directive, span)?);
                self.header.film_color_space = Some(self.state.color_space.name);
                Ok(())
            }
            D::Identity => self.set(DMat4::IDENTITY, span),
            D::Import => self.include(true),
            D::Include => self.include(false),
            D::Integrator => {
                self.header.integrator = Some(self.once(directive, span)?);
                Ok(())
            }
            D::LightSource => {
                let entity = self.entity("LightSource", span, Some("light"))?;
                let medium = self.outside_medium();
                let medium = self.reader.name(&medium);
                let light = LightEntity { entity, transform: self.state.ctm.animated(), medium };
                store(&mut self.scene.lights, light, PARAMETERS, span)
            }
            D::LookAt => {
                let v: [f64; 9] = self.numbers(false)?;
                let [eye, target, up] = [0, 3, 6].map(|i| DVec3::from_slice(&v[i..i + 3]));
                let Some(matrix) = look_at(eye, target, up) else {
                    let what = "LookAt's eye and target coincide, or its up vector points along the view or is zero";
                    return Err(SceneError::at(span, SceneErrorKind::Parameter(what.into())));
                };
                self.concat(matrix, span)
            }
            D::MakeNamedMaterial => self.make_named_material(span),
            D::MakeNamedMedium => self.make_named_medium(span),
            D::Material => {
                let entity = self.entity("Material", span, Some("material"))?;
                self.state.material = CurrentMaterial::Index(self.scene.materials.len() as u32);
                store(&mut self.scene.materials, MaterialEntity { name: None, entity }, PARAMETERS, span)
            }
            D::MediumInterface => self.medium_interface(),
            D::NamedMaterial => {
                let (name, at) = self.reader.expect_string("a material's name")?;
                self.state.material = CurrentMaterial::Named(self.material_references.add(&name, at));
                Ok(())
            }
            D::ObjectBegin => self.object_begin(span),
            D::ObjectEnd => self.object_end(span),
            D::ObjectInstance => self.object_instance(span),
            D::Option => self.option(),
            D::PixelFilter => {
                self.header.filter = Some(self.once(directive, span)?);
                Ok(())
            }
            D::ReverseOrientation => {
                self.state.reverse_orientation ^= true;
                Ok(())
            }
            D::Rotate => {
                let [degrees, x, y, z]: [f64; 4] = self.numbers(false)?;
                let Some(axis) = DVec3::new(x, y, z).try_normalize() else {
                    let what = SceneErrorKind::Parameter("Rotate's axis is zero".into());
                    return Err(SceneError::at(span, what));
                };
                self.concat(DMat4::from_axis_angle(axis, degrees.to_radians()), span)
            }
            D::Sampler => {
                self.header.sampler = Some(self.once(directive, span)?);
                Ok(())
            }
            D::Scale => {
                let scale: [f64; 3] = self.numbers(false)?;
                self.concat(DMat4::from_scale(scale.into()), span)
            }
            D::Shape => self.shape(span),
            D::Texture => self.texture(span),
            D::Transform => {
                let matrix = self.matrix(span)?;
                self.set(matrix, span)
            }
            D::TransformBegin | D::TransformEnd => {
                let other = if directive == D::TransformBegin { "AttributeBegin" } else { "AttributeEnd" };
                let message = format!("{} is deprecated: write {other}", directive.name());
                self.warnings.add(Some(span), message);
                // It saves and restores the whole graphics state, as in pbrt-v4.
                match directive {
                    D::TransformBegin => self.push(Opened::Attribute, span),
                    _ => self.pop(Opened::Attribute, span),
                }
            }
            D::TransformTimes => {
                let times: [f64; 2] = self.numbers(false)?;
                if times[0] >= times[1] {
                    let message = "TransformTimes end before they have begun: nothing moves";
                    self.warnings.add(Some(span), message);
                }
                self.header.times = Some(times);
                Ok(())
            }
            D::Translate => {
                let offset: [f64; 3] = self.numbers(false)?;
                self.concat(DMat4::from_translation(offset.into()), span)
            }
            D::WorldBegin => {
                self.world = true;
                self.state.ctm = Default::default();
                self.systems.insert("world".into(), (*self.state.ctm.animated(), None));
                Ok(())
            }
        }
    }

    fn params(&mut self, owner: &str, span: Span, defaults: Option<&str>) -> Result<ParamSet> {
        let context = Context { color_space: self.state.color_space, base: &self.base };
        let list = parameter::parse_list(&mut self.reader, &context, self.warnings)?;
        let mut params = ParamSet::new(self.reader.name(owner), span, list);
        if let Some(slot) = defaults.and_then(|target| ATTRIBUTE_TARGETS.iter().position(|t| *t == target)) {
            params.add_defaults(&self.state.defaults[slot]);
        }
        Ok(params)
    }

    fn entity(&mut self, directive: &str, span: Span, defaults: Option<&str>) -> Result<Entity> {
        let (kind, _) = self.reader.expect_string("a type")?;
        self.notice_age(directive, &kind, span);
        let params = self.params(&format!("{directive} \"{kind}\""), span, defaults)?;
        Ok(Entity { kind: self.reader.name(&kind), params })
    }

    /// Says of the first type that only pbrt-v3 has that the scene is of that version.
    fn notice_age(&mut self, directive: &str, kind: &str, span: Span) {
        if !self.is_older && is_older(directive, kind) {
            self.is_older = true;
            let message = format!(
                "{directive} \"{kind}\" is of pbrt-v3: {UPGRADE}; what pbrt-v4 does not know is replaced or left out"
            );
            self.warnings.add(Some(span), message);
        }
    }

    /// The entity of a directive that a file states once; says so if not.
    fn once(&mut self, directive: Directive, span: Span) -> Result<Entity> {
        let given = match directive {
            Directive::Film => self.header.film.is_some(),
            Directive::PixelFilter => self.header.filter.is_some(),
            Directive::Sampler => self.header.sampler.is_some(),
            Directive::Integrator => self.header.integrator.is_some(),
            _ => self.header.camera.is_some(),
        };
        if given {
            self.warnings.add(Some(span), format!("{} is given twice; the later one counts", directive.name()));
        }
        self.entity(directive.name(), span, None)
    }

    fn camera(&mut self, span: Span) -> Result<()> {
        let entity = self.once(Directive::Camera, span)?;
        let transform = *self.state.ctm.animated();
        let inverse = Animated { start: transform.start.inverse(), end: transform.end.inverse() };
        if !(inverse.start.is_finite() && inverse.end.is_finite()) {
            let what = "the camera's transform cannot be inverted: it flattens space";
            return Err(SceneError::at(span, SceneErrorKind::Parameter(what.into())));
        }
        self.systems.insert("camera".into(), (inverse, None));
        self.header.camera = Some((entity, transform, self.outside_medium()));
        Ok(())
    }

    fn outside_medium(&self) -> String {
        self.state.medium_interface.as_ref().map(|m| m.outside.clone()).unwrap_or_default()
    }

    fn push(&mut self, opened: Opened, span: Span) -> Result<()> {
        if self.stack.len() >= DEEPEST_NESTING {
            let what = SceneErrorKind::Limit(format!("more than {DEEPEST_NESTING} blocks within each other"));
            return Err(SceneError::at(span, what));
        }
        self.stack.push(Saved { opened, span, state: self.state.clone() });
        Ok(())
    }

    fn pop(&mut self, closes: Opened, span: Span) -> Result<()> {
        let end = match closes {
            Opened::Attribute => "AttributeEnd",
            Opened::Object => "ObjectEnd",
            Opened::Import => "the end of the imported file",
        };
        let is_open = self.stack.last().is_some_and(|saved| saved.opened != Opened::Import);
        if closes == Opened::Attribute && !is_open {
            // As in pbrt-v4.
            self.warnings.add_fault(span, format!("{end} without its begin"), "it is ignored");
            return Ok(());
        }
        match self.stack.pop() {
            Some(saved) if saved.opened == closes => {
                self.state = saved.state;
                Ok(())
            }
            Some(saved) if closes == Opened::Import => {
                syntax(saved.span, "this block is not ended in the imported file")
            }
            Some(saved) if saved.opened != Opened::Import => {
                let line = saved.span.line;
                let opened = match saved.opened {
                    Opened::Object => "ObjectBegin",
                    _ => "AttributeBegin",
                };
                syntax(span, format!("{end} where the {opened} of line {line} is still open"))
            }
            _ => syntax(span, format!("{end} without its begin")),
        }
    }

    fn include(&mut self, import: bool) -> Result<()> {
        let (name, at) = self.reader.expect_string("a file's name")?;
        // pbrt looks beside the main scene file; a file moved together with its includer is found too.
        let beside_scene = locate(&self.base, &name);
        let path = if beside_scene.exists() { beside_scene } else { locate(&self.reader.folder(), &name) };
        if import {
            self.push(Opened::Import, at)?;
        }
        self.reader.include(&path, at, import, self.warnings)
    }
}

/// Adds `one` to `list`. Refuses where that is about to grow beyond the memory that is left: text that is included again and again costs the file
/// nothing and the memory much. Each of the list's `T` holds about `heap` bytes besides.
fn store<T>(list: &mut Vec<T>, one: T, heap: usize, span: Span) -> Result<()> {
    if list.len() == list.capacity() && list.len() >= FEW_ENTITIES {
        // By half: twice as much would mostly stay empty.
        let more = list.len() / 2;
        let needed = ((list.len() + more) * size_of::<T>() + more * heap) as u64;
        if available().is_some_and(|left| left < needed) || list.try_reserve_exact(more).is_err() {
            let what = format!("the scene fills the memory with {} shapes, instances, lights or materials", list.len());
            return Err(SceneError::at(span, SceneErrorKind::Limit(what)));
        }
    }
    list.push(one);
    Ok(())
}

fn syntax<T>(span: Span, message: impl Into<String>) -> Result<T> {
    Err(SceneError::at(span, SceneErrorKind::Syntax(message.into())))
}

fn overflow(span: Span) -> Result<()> {
    let what = "the current transformation's numbers become too large";
    Err(SceneError::at(span, SceneErrorKind::Parameter(what.into())))
}
