//! From `Material` and `MakeNamedMaterial` directives to [`Materials`], with pbrt-v4's parameters and defaults.
//!
//! A type that is not known is named in a warning and stands for a 50 % grey `diffuse`.

use std::collections::HashMap;

use super::build_texture::{Loader, TextureBuilder};
use super::texture::{FloatInput, RgbInput, Textures};
use super::{Alpha, Coat, Material, MaterialId, Materials, Metal, Roughness};
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;
use crate::scene::{
    MaterialEntity, ParamSet, ParamValue, SceneDescription, SceneError, SceneErrorKind, TextureOr, Warnings,
};

/// Named materials; of several with one name, the last.
type Names<'a> = HashMap<&'a str, MaterialId>;

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// The wavelength of the sodium D lines (nm), at which indices of refraction are quoted.
const SODIUM_D: f32 = 589.3;

impl Materials {
    /// Builds the materials of a scene: that of index i in [`SceneDescription::materials`] becomes `MaterialId(i)`.
    ///
    /// # Errors
    /// Parameters of a wrong type, names that refer to nothing, mixes or textures that contain themselves; under `strict` also
    /// image files that cannot be read.
    pub fn build(scene: &SceneDescription, strict: bool, warnings: &mut Warnings) -> Result<Self> {
        let mut textures = Textures::default();
        let mut loader = Loader::new(scene);
        let mut list = Vec::with_capacity(scene.materials.len());
        let names: Names = scene
            .materials
            .iter()
            .zip(0..)
            .filter_map(|(m, place)| Some((m.name.as_deref()?, MaterialId(place))))
            .collect();
        for entity in &scene.materials {
            let mut builder = TextureBuilder {
                scene,
                strict,
                warnings: &mut *warnings,
                textures: &mut textures,
                loader: &mut loader,
                open: Vec::new(),
            };
            list.push(material(entity, &names, &mut builder)?);
            entity.entity.params.warn_unused(warnings);
        }
        let transmissive = transmissive(&list, scene)?;
        Ok(Self { list, transmissive, textures, alphas: Vec::new(), loader })
    }

    /// The number to store in [`crate::geometry::Shape::alpha`] for a shape's `alpha`; `None` where it is a constant of 1 or
    /// more, so that the shape is opaque.
    ///
    /// # Errors
    /// As [`Materials::build`].
    pub fn alpha(
        &mut self,
        value: TextureOr<f32>,
        scene: &SceneDescription,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Option<u32>> {
        let Self { textures, loader, .. } = self;
        let mut builder = TextureBuilder { scene, strict, warnings, textures, loader, open: Vec::new() };
        let input = builder.float(Some(value), 1.0)?;
        if matches!(input, FloatInput::Constant(alpha) if alpha >= 1.0) {
            return Ok(None);
        }
        let known = self.alphas.iter().position(|alpha| alpha.input == input);
        let number = known.unwrap_or_else(|| {
            self.alphas.push(Alpha { input, is_spatial: self.textures.is_spatial(input) });
            self.alphas.len() - 1
        });
        Ok(Some(number as u32))
    }
}

fn material(entity: &MaterialEntity, names: &Names, builder: &mut TextureBuilder) -> Result<Material> {
    let params = &entity.entity.params;
    // `MakeNamedMaterial` states its type as a parameter.
    let stated = params.string("type")?;
    let kind = if entity.entity.kind.is_empty() { stated.unwrap_or("") } else { &entity.entity.kind };
    let half = Rgb::splat(0.5);
    Ok(match kind {
        "diffuse" => Material::Diffuse { reflectance: builder.rgb(params.albedo_texture("reflectance")?, half)? },
        "conductor" => Material::Conductor { metal: metal(params, builder)?, roughness: roughness(params, builder)? },
        "dielectric" => Material::Dielectric {
            eta: builder.float(index_of_refraction(params, "eta")?, 1.5)?,
            roughness: roughness(params, builder)?,
        },
        "coateddiffuse" => Material::CoatedDiffuse(Coat {
            reflectance: builder.rgb(params.albedo_texture("reflectance")?, half)?,
            roughness: roughness(params, builder)?,
            thickness: builder.float(params.float_texture("thickness")?, 0.01)?,
            eta: builder.float(index_of_refraction(params, "eta")?, 1.5)?,
            g: match builder.float(params.float_texture("g")?, 0.0)? {
                FloatInput::Constant(g) if !(-1.0..=1.0).contains(&g) => {
                    return Err(params.wrong("g", &format!("from -1 to 1, found {g}")));
                }
                g => g,
            },
            albedo: builder.rgb(params.albedo_texture("albedo")?, Rgb::BLACK)?,
            max_depth: count(params, "maxdepth", 10)?,
            samples: count(params, "nsamples", 1)?,
        }),
        "mix" => {
            let parts = params.strings("materials")?;
            let [first, second] = parts else {
                let span = params.get("materials").map_or(params.span, |p| p.span);
                let message = format!("{} takes two \"materials\", found {}", params.owner, parts.len());
                return Err(SceneError::at(span, SceneErrorKind::Parameter(message)));
            };
            let materials = [named(first, params, names)?, named(second, params, names)?];
            Material::Mix { materials, amount: builder.float(params.float_texture("amount")?, 0.5)? }
        }
        "interface" | "none" | "" => Material::Interface,
        other => {
            let message = format!("material type \"{other}\" is not supported: grey \"diffuse\" is used instead");
            builder.warnings.add(Some(params.span), message);
            Material::Diffuse { reflectance: RgbInput::Constant(half) }
        }
    })
}

fn metal(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Metal> {
    if params.has("reflectance") {
        for name in ["eta", "k"] {
            if params.has(name) {
                let message = format!("both \"reflectance\" and \"{name}\" are given for {}", params.owner);
                return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)).help("leave one out"));
            }
        }
        return Ok(Metal::Reflectance(builder.rgb(params.albedo_texture("reflectance")?, Rgb::splat(0.5))?));
    }
    let eta = builder.rgb(coefficient(params, "eta")?, copper("metal-Cu-eta"))?;
    let k = builder.rgb(coefficient(params, "k")?, copper("metal-Cu-k"))?;
    Ok(Metal::Index { eta, k })
}

fn roughness(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Roughness> {
    let both = params.float_texture("roughness")?;
    let u = params.float_texture("uroughness")?.or_else(|| both.clone());
    let v = params.float_texture("vroughness")?.or(both);
    let remap = params.bool("remaproughness", true)?;
    Ok(Roughness { u: builder.float(u, 0.0)?, v: builder.float(v, 0.0)?, remap })
}

/// One of the two spectra of copper, the default metal.
fn copper(name: &str) -> Rgb {
    Spectrum::named(name).expect("the spectra of copper are built in").to_unbounded()
}

/// A spectrum that is not bounded by 1, or a texture of it.
fn coefficient(params: &ParamSet, name: &str) -> Result<Option<TextureOr<Rgb>>> {
    match params.get(name).map(|param| &param.value) {
        Some(ParamValue::Spectrum(_)) => Ok(params.spectrum(name)?.map(|s| TextureOr::Value(s.to_unbounded()))),
        _ => params.albedo_texture(name),
    }
}

/// A float, a texture of floats, or a spectrum, of which the value at the sodium D line is taken: an RGB renderer has no
/// dispersion.
fn index_of_refraction(params: &ParamSet, name: &str) -> Result<Option<TextureOr<f32>>> {
    match params.get(name).map(|param| &param.value) {
        Some(ParamValue::Spectrum(_)) => Ok(params.spectrum(name)?.map(|spectrum| {
            TextureOr::Value(match spectrum {
                Spectrum::Samples(samples) => at_wavelength(samples, SODIUM_D),
                other => other.to_unbounded().mean(),
            })
        })),
        _ => params.float_texture(name),
    }
}

/// Linear interpolation between samples (of rising wavelength); the ends extend.
fn at_wavelength(samples: &[(f32, f32)], wavelength: f32) -> f32 {
    let after = samples.partition_point(|&(l, _)| l < wavelength);
    match (after.checked_sub(1).and_then(|i| samples.get(i)), samples.get(after)) {
        (Some(&(l0, v0)), Some(&(l1, v1))) => v0 + (v1 - v0) * ((wavelength - l0) / (l1 - l0)),
        (Some(&(_, v)), None) | (None, Some(&(_, v))) => v,
        (None, None) => 1.0,
    }
}

/// More layers' bounces or walks than this take longer than anyone waits.
const MOST: i32 = 1000;

fn count(params: &ParamSet, name: &str, default: i32) -> Result<u32> {
    match params.integer(name, default)? {
        value @ 1..=MOST => Ok(value as u32),
        value => Err(params.wrong(name, &format!("from 1 to {MOST}, found {value}"))),
    }
}

fn named(name: &str, params: &ParamSet, names: &Names) -> Result<MaterialId> {
    names.get(name).copied().ok_or_else(|| {
        let span = params.get("materials").map_or(params.span, |p| p.span);
        let error = SceneErrorKind::Undefined(format!("there is no material named \"{name}\""));
        SceneError::at(span, error).help("\"materials\" takes names given by MakeNamedMaterial")
    })
}

/// Which materials let light through. Refuses mixes that contain themselves. Every mix is followed once: linear in their number.
fn transmissive(list: &[Material], scene: &SceneDescription) -> Result<Vec<bool>> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done(bool),
    }
    let mut states = vec![State::New; list.len()];
    for start in 0..list.len() {
        // (material, its next child): an explicit stack, since a file may nest as deeply as it likes.
        let mut stack = vec![(start, 0)];
        while let Some((place, child)) = stack.pop() {
            let Material::Mix { materials, .. } = &list[place] else {
                states[place] = State::Done(matches!(list[place], Material::Interface | Material::Dielectric { .. }));
                continue;
            };
            if child == 0 {
                match states[place] {
                    State::Done(_) => continue,
                    State::Open => {
                        let params = &scene.materials[place].entity.params;
                        let span = params.get("materials").map_or(params.span, |param| param.span);
                        let message = format!("{} contains itself", params.owner);
                        return Err(SceneError::at(span, SceneErrorKind::Parameter(message)));
                    }
                    State::New => states[place] = State::Open,
                }
            }
            match materials.get(child) {
                Some(next) => {
                    stack.push((place, child + 1));
                    stack.push((next.0 as usize, 0));
                }
                None => {
                    let parts = materials.map(|part| states[part.0 as usize] == State::Done(true));
                    states[place] = State::Done(parts[0] || parts[1]);
                }
            }
        }
    }
    Ok(states.into_iter().map(|state| state == State::Done(true)).collect())
}
