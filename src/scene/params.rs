//! Parameter lists of pbrt's text format: `"type name" [values]`, typed getters, and a record of what was used.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{SceneError, SceneErrorKind, Warnings};
use super::name::Name;
use super::older::UPGRADE;
use super::source::Span;
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;

/// The values of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParamValue {
    /// `float`.
    Float(Vec<f32>),
    /// `integer`.
    Integer(Vec<i32>),
    /// `bool`.
    Bool(Vec<bool>),
    /// `string`.
    String(Vec<String>),
    /// `point2`, `vector2`.
    Vec2(Vec<[f32; 2]>),
    /// `point3`, `point`, `vector3`, `vector`, `normal3`, `normal`.
    Vec3(Vec<[f32; 3]>),
    /// `rgb`, `spectrum`, `blackbody`.
    Spectrum(Vec<Spectrum>),
    /// `texture`: a texture's name.
    Texture(String),
}

/// One parameter and where it was written.
#[derive(Debug)]
pub struct Param {
    /// The name without its type.
    pub name: Name,
    /// The type word as written.
    pub type_name: Name,
    /// The values.
    pub value: ParamValue,
    /// The place of the quoted declaration.
    pub span: Span,
    /// Set by `Attribute` for whatever takes it, and so shared.
    is_default: bool,
    used: AtomicBool,
}

impl Clone for Param {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            type_name: self.type_name.clone(),
            value: self.value.clone(),
            span: self.span,
            is_default: self.is_default,
            used: AtomicBool::new(self.used.load(Ordering::Relaxed)),
        }
    }
}

impl Param {
    /// A parameter that nobody has asked for yet.
    pub fn new(name: impl Into<Name>, type_name: impl Into<Name>, value: ParamValue, span: Span) -> Self {
        let used = AtomicBool::new(false);
        Self { name: name.into(), type_name: type_name.into(), value, span, is_default: false, used }
    }

    /// The same as a default: not every shape, say, takes every default, so none of them calls it unused.
    pub fn into_default(self) -> Self {
        Self { is_default: true, ..self }
    }

    /// Records that somebody has asked for it.
    pub fn mark_used(&self) {
        self.used.store(true, Ordering::Relaxed);
    }
}

/// A constant or the name of a texture.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureOr<T> {
    /// The value itself.
    Value(T),
    /// A texture's name, and where it was named.
    Texture(String, Span),
}

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// The parameters of one directive. Getters mark what they return as used; [`ParamSet::warn_unused`] names the rest.
#[derive(Clone, Debug)]
pub struct ParamSet {
    /// The directive and its type as written, for messages: `Shape "sphere"`.
    pub owner: Name,
    /// The place of the directive.
    pub span: Span,
    params: Vec<Arc<Param>>,
}

impl ParamSet {
    /// A list of parameters of `owner`, which stands at `span`.
    pub fn new(owner: impl Into<Name>, span: Span, params: Vec<Param>) -> Self {
        // Collected in place, the list would keep the room of all that it points to now.
        let mut shared = Vec::with_capacity(params.len());
        shared.extend(params.into_iter().map(Arc::new));
        Self { owner: owner.into(), span, params: shared }
    }

    /// Adds those of `defaults` (of `Attribute`) that are not given; the values stay shared.
    pub fn add_defaults(&mut self, defaults: &[Arc<Param>]) {
        for default in defaults {
            if !self.has(&default.name) {
                self.params.push(default.clone());
            }
        }
    }

    /// All parameters in the order written.
    pub fn iter(&self) -> impl Iterator<Item = &Param> {
        self.params.iter().map(Arc::as_ref)
    }

    /// The parameter `name` of whatever type; marks it used.
    pub fn get(&self, name: &str) -> Option<&Param> {
        let param = self.params.iter().find(|p| p.name == name)?;
        param.mark_used();
        Some(param)
    }

    /// Whether `name` was given; does not mark it used.
    pub fn has(&self, name: &str) -> bool {
        self.params.iter().any(|p| p.name == name)
    }

    /// The error for the value of `name`, which must be what `expected` says.
    pub fn wrong(&self, name: &str, expected: &str) -> Box<SceneError> {
        let span = self.params.iter().find(|p| p.name == name).map_or(self.span, |p| p.span);
        let message = format!("parameter \"{name}\" of {} must be {expected}", self.owner);
        SceneError::at(span, SceneErrorKind::Parameter(message))
    }

    /// Warns of the fault that the value of `name` is not what `expected` says, and says what is done `instead`.
    pub fn pass_over(&self, name: &str, expected: &str, instead: &str, warnings: &mut Warnings) {
        let span = self.get(name).map_or(self.span, |param| param.span);
        let what = format!("parameter \"{name}\" of {} must be {expected}", self.owner);
        warnings.add_fault(span, what, instead);
    }

    /// One float above 0, or `default`.
    pub fn positive(&self, name: &str, default: f32) -> Result<f32> {
        let value = self.float(name, default)?;
        if value > 0.0 { Ok(value) } else { Err(self.wrong(name, "above 0")) }
    }

    /// Warns that `name` is given but not heeded; `what` says what happens instead.
    pub fn warn_ignored(&self, name: &str, what: &str, warnings: &mut Warnings) {
        if let Some(param) = self.get(name) {
            warnings.add(Some(param.span), format!("parameter \"{name}\" of {} is ignored: {what}", self.owner));
        }
    }

    fn wrong_type<T>(&self, param: &Param, wanted: &str) -> Result<T> {
        let what =
            format!("parameter \"{}\" of {} has type {}, expected {wanted}", param.name, self.owner, param.type_name);
        let error = SceneError::at(param.span, SceneErrorKind::Parameter(what));
        // In pbrt-v3 the scale of a light is a colour.
        let is_old = param.name == "scale" && self.owner.contains("LightSource") && wanted == "float";
        let is_old = is_old && matches!(param.value, ParamValue::Spectrum(_));
        Err(if is_old { error.help(UPGRADE) } else { error })
    }

    fn one<'a, T>(&self, param: &'a Param, values: &'a [T]) -> Result<&'a T> {
        match values {
            [value] => Ok(value),
            _ => Err(SceneError::at(
                param.span,
                SceneErrorKind::Parameter(format!(
                    "parameter \"{}\" of {} takes one value, found {}",
                    param.name,
                    self.owner,
                    values.len()
                )),
            )),
        }
    }

    /// One float (an integer serves too), or `default` where it is not given.
    pub fn float(&self, name: &str, default: f32) -> Result<f32> {
        Ok(self.float_opt(name)?.unwrap_or(default))
    }

    /// One float, if given. NaN and infinities are refused by the parser's number syntax.
    pub fn float_opt(&self, name: &str) -> Result<Option<f32>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::Float(v) => Ok(Some(*self.one(param, v)?)),
            ParamValue::Integer(v) => Ok(Some(*self.one(param, v)? as f32)),
            _ => self.wrong_type(param, "float"),
        }
    }

    /// One integer, or `default`.
    pub fn integer(&self, name: &str, default: i32) -> Result<i32> {
        let Some(param) = self.get(name) else { return Ok(default) };
        match &param.value {
            ParamValue::Integer(v) => Ok(*self.one(param, v)?),
            _ => self.wrong_type(param, "integer"),
        }
    }

    /// One bool, or `default`.
    pub fn bool(&self, name: &str, default: bool) -> Result<bool> {
        let Some(param) = self.get(name) else { return Ok(default) };
        match &param.value {
            ParamValue::Bool(v) => Ok(*self.one(param, v)?),
            _ => self.wrong_type(param, "bool"),
        }
    }

    /// One string, if given.
    pub fn string(&self, name: &str) -> Result<Option<&str>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::String(v) => Ok(Some(self.one(param, v)?.as_str())),
            _ => self.wrong_type(param, "string"),
        }
    }

    /// A list of strings; empty where not given.
    pub fn strings(&self, name: &str) -> Result<&[String]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::String(v) => Ok(v),
            _ => self.wrong_type(param, "string"),
        }
    }

    /// One three-vector (point, vector or normal), if given.
    pub fn vec3(&self, name: &str) -> Result<Option<[f32; 3]>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::Vec3(v) => Ok(Some(*self.one(param, v)?)),
            _ => self.wrong_type(param, "point3, vector3 or normal3"),
        }
    }

    /// A list of three-vectors; empty where not given.
    pub fn vec3s(&self, name: &str) -> Result<&[[f32; 3]]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::Vec3(v) => Ok(v),
            _ => self.wrong_type(param, "point3, vector3 or normal3"),
        }
    }

    /// A list of two-vectors; empty where not given.
    pub fn vec2s(&self, name: &str) -> Result<&[[f32; 2]]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::Vec2(v) => Ok(v),
            _ => self.wrong_type(param, "point2 or vector2"),
        }
    }

    /// A list of floats; empty where not given.
    pub fn floats(&self, name: &str) -> Result<&[f32]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::Float(v) => Ok(v),
            _ => self.wrong_type(param, "float"),
        }
    }

    /// A list of integers; empty where not given.
    pub fn integers(&self, name: &str) -> Result<&[i32]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::Integer(v) => Ok(v),
            _ => self.wrong_type(param, "integer"),
        }
    }

    /// One spectrum, if given.
    pub fn spectrum(&self, name: &str) -> Result<Option<&Spectrum>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::Spectrum(v) if v.len() == 2 && param.type_name == "blackbody" => {
                let what = "pbrt-v3 takes a temperature and a scale";
                self.one(param, v).map(Some).map_err(|error| error.help(format!("{what}; {UPGRADE}")))
            }
            ParamValue::Spectrum(v) => Ok(Some(self.one(param, v)?)),
            _ => self.wrong_type(param, "rgb, spectrum or blackbody"),
        }
    }

    /// The first of one spectrum or several, if given: a warning tells of the others.
    pub fn first_spectrum(&self, name: &str, warnings: &mut Warnings) -> Result<Option<&Spectrum>> {
        match self.spectra(name)? {
            [first, _, ..] => {
                let span = self.get(name).map_or(self.span, |param| param.span);
                let message = format!("parameter \"{name}\" of {} takes one value: the first is used", self.owner);
                warnings.add(Some(span), message);
                Ok(Some(first))
            }
            _ => self.spectrum(name),
        }
    }

    /// A list of spectra; empty where not given.
    pub fn spectra(&self, name: &str) -> Result<&[Spectrum]> {
        let Some(param) = self.get(name) else { return Ok(&[]) };
        match &param.value {
            ParamValue::Spectrum(v) => Ok(v),
            _ => self.wrong_type(param, "rgb, spectrum or blackbody"),
        }
    }

    /// A float or a texture of floats, if given.
    pub fn float_texture(&self, name: &str) -> Result<Option<TextureOr<f32>>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::Texture(texture) => Ok(Some(TextureOr::Texture(texture.clone(), param.span))),
            _ => Ok(self.float_opt(name)?.map(TextureOr::Value)),
        }
    }

    /// A reflectance-like spectrum (or float) reduced to RGB, or a texture of them, if given.
    pub fn albedo_texture(&self, name: &str) -> Result<Option<TextureOr<Rgb>>> {
        let Some(param) = self.get(name) else { return Ok(None) };
        match &param.value {
            ParamValue::Texture(texture) => Ok(Some(TextureOr::Texture(texture.clone(), param.span))),
            ParamValue::Float(v) => Ok(Some(TextureOr::Value(Rgb::splat(*self.one(param, v)?)))),
            _ => Ok(self.spectrum(name)?.map(|s| TextureOr::Value(s.to_albedo()))),
        }
    }

    /// A list of defaults as `owner` stated them, which others share.
    pub fn of_defaults(owner: impl Into<Name>, span: Span, params: Vec<Arc<Param>>) -> Self {
        Self { owner: owner.into(), span, params }
    }

    /// Warns about every parameter that no getter was asked for, by name; never about defaults, as in pbrt-v4: programs state names and the like there.
    pub fn warn_unused(&self, warnings: &mut Warnings) {
        let unused = |p: &&Arc<Param>| !p.used.load(Ordering::Relaxed) && !p.is_default;
        for param in self.params.iter().filter(unused) {
            warnings.add(Some(param.span), format!("parameter \"{}\" of {} is not used", param.name, self.owner));
        }
    }
}
