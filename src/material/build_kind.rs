//! From one `Material` or `MakeNamedMaterial` directive to a [`Material`], with pbrt-v4's parameters and defaults.
//!
//! A type that is not known is named in a warning and stands for a 50 % grey `diffuse`; of `subsurface` and `measured` the warning says what stands
//! for them.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use super::MaterialId;
use super::build_texture::TextureBuilder;
use super::kinds::{Coat, Fibre, HairColour, Material, Matter, Metal, Roughness};
use super::texture::{FloatInput, RgbInput};
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;
use crate::medium::build::measured_matter;
use crate::medium::measured::MeasuredMatter;
use crate::scene::{MaterialEntity, Param, ParamSet, ParamValue, SceneError, SceneErrorKind, TextureOr};

/// Named materials; of several with one name, the last.
pub(super) type Names<'a> = HashMap<&'a str, MaterialId>;

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// The wavelength of the sodium D lines (nm), at which indices of refraction are quoted.
const SODIUM_D: f32 = 589.3;

/// Steps of walks under the boundary of matter that light comes out of again: it may be as white as milk.
const SUBSURFACE_DEPTH: u32 = 100;

/// The roughness of what stands for measured materials.
const MEASURED_ROUGHNESS: f32 = 0.3;

/// pbrt-v4's default matter, per millimetre.
const SIGMA_A: Rgb = Rgb::new(0.0011, 0.0024, 0.014);
const SIGMA_S: Rgb = Rgb::new(2.55, 3.21, 3.77);

/// The material that a directive states.
pub(super) fn material(entity: &MaterialEntity, names: &Names, builder: &mut TextureBuilder) -> Result<Material> {
    let params = &entity.entity.params;
    // `MakeNamedMaterial` states its type as a parameter.
    let stated = params.string("type")?;
    let kind = if entity.entity.kind.is_empty() { stated.unwrap_or("") } else { entity.entity.kind.as_str() };
    let half = Rgb::splat(0.5);
    Ok(match kind {
        "diffuse" => Material::Diffuse { reflectance: builder.rgb(params.albedo_texture("reflectance")?, half)? },
        "diffusetransmission" => diffuse_transmission(params, builder)?,
        "conductor" => {
            Material::Conductor { metal: metal(params, "", builder)?, roughness: roughness(params, "", builder)? }
        }
        "dielectric" => Material::Dielectric {
            eta: builder.float(index_of_refraction(params, "eta")?, 1.5)?,
            roughness: roughness(params, "", builder)?,
        },
        "thindielectric" => Material::ThinDielectric { eta: builder.float(index_of_refraction(params, "eta")?, 1.5)? },
        "coateddiffuse" => Material::CoatedDiffuse {
            coat: coat(params, "", builder)?,
            reflectance: builder.rgb(params.albedo_texture("reflectance")?, half)?,
        },
        "coatedconductor" => Material::CoatedConductor {
            coat: coat(params, "interface.", builder)?,
            metal: metal(params, "conductor.", builder)?,
            roughness: roughness(params, "conductor.", builder)?,
        },
        "hair" => Material::Hair(hair(params, builder)?),
        "subsurface" => subsurface(params, builder)?,
        "measured" => measured(params, builder),
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
            // Said in one line: what its parameters are called does not matter.
            params.iter().for_each(Param::mark_used);
            Material::Diffuse { reflectance: RgbInput::Constant(half) }
        }
    })
}

fn diffuse_transmission(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Material> {
    let quarter = Rgb::splat(0.25);
    let reflectance = builder.rgb(params.albedo_texture("reflectance")?, quarter)?;
    let transmittance = builder.rgb(params.albedo_texture("transmittance")?, quarter)?;
    let scale = params.float("scale", 1.0)?;
    if scale < 0.0 {
        return Err(params.wrong("scale", &format!("at least 0, found {scale}")));
    }
    if let (RgbInput::Constant(r), RgbInput::Constant(t)) = (reflectance, transmittance)
        && ((r + t) * scale).max_channel() > 1.0 + 1e-5
    {
        let message = format!("{} sends on more light than it receives", params.owner);
        builder.warnings.add(Some(params.span), message);
    }
    Ok(Material::DiffuseTransmission { reflectance, transmittance, scale })
}

/// The layer over a base; `prefix` is that of its index and roughness.
fn coat(params: &ParamSet, prefix: &str, builder: &mut TextureBuilder) -> Result<Coat> {
    Ok(Coat {
        roughness: roughness(params, prefix, builder)?,
        thickness: builder.float(params.float_texture("thickness")?, 0.01)?,
        eta: builder.float(index_of_refraction(params, &format!("{prefix}eta"))?, 1.5)?,
        g: within(params, "g", 0.0, -1.0..=1.0, builder)?,
        albedo: builder.rgb(params.albedo_texture("albedo")?, Rgb::BLACK)?,
        max_depth: count(params, "maxdepth", 10)?,
        samples: count(params, "nsamples", 1)?,
    })
}

fn hair(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Fibre> {
    // As in pbrt-v4, of several descriptions of the colour the first of these is heeded; "color" is another name for "reflectance".
    let reflectance = if params.has("reflectance") { "reflectance" } else { "color" };
    let stated = ["sigma_a", reflectance, "eumelanin", "pheomelanin"].into_iter().find(|name| params.has(name));
    let colour = match stated {
        Some("sigma_a") => {
            let sigma_a = builder.rgb(coefficient(params, "sigma_a")?, Rgb::BLACK)?;
            not_negative(params, "sigma_a", sigma_a)?;
            HairColour::Absorption(sigma_a)
        }
        Some(name) if name == reflectance => {
            HairColour::Reflectance(builder.rgb(params.albedo_texture(reflectance)?, Rgb::BLACK)?)
        }
        _ => {
            let brown = if stated.is_none() { 1.3 } else { 0.0 };
            let most = 0.0..=f32::MAX;
            HairColour::Pigments {
                eumelanin: within(params, "eumelanin", brown, most.clone(), builder)?,
                pheomelanin: within(params, "pheomelanin", 0.0, most, builder)?,
            }
        }
    };
    if let Some(heeded) = stated.filter(|name| !name.ends_with("melanin")) {
        for name in ["reflectance", "color", "eumelanin", "pheomelanin"].into_iter().filter(|name| *name != heeded) {
            params.warn_ignored(name, &format!("\"{heeded}\" is given too"), builder.warnings);
        }
    }
    Ok(Fibre {
        colour,
        eta: builder.float(index_of_refraction(params, "eta")?, 1.55)?,
        beta_m: within(params, "beta_m", 0.3, 0.0..=1.0, builder)?,
        beta_n: within(params, "beta_n", 0.3, 0.0..=1.0, builder)?,
        alpha: within(params, "alpha", 2.0, -90.0..=90.0, builder)?,
    })
}

/// A boundary over a diffuse base with the albedo of the matter; see `subsurface.rs`.
fn subsurface(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Material> {
    let message = "material type \"subsurface\" is done as \"coateddiffuse\" of the albedo that its matter comes to: light leaves where it enters";
    builder.warnings.add(Some(params.span), message);
    let by_coefficients = ["sigma_a", "sigma_s"].map(|name| params.has(name));
    if by_coefficients[0] != by_coefficients[1] {
        let message = format!("{} takes \"sigma_a\" and \"sigma_s\" together", params.owner);
        return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
    }
    if by_coefficients[0] && params.has("reflectance") {
        let message = format!("both \"reflectance\" and \"sigma_a\" are given for {}", params.owner);
        return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)).help("leave one out"));
    }
    let measured = measured_matter(params, "name", builder.warnings)?;
    // How far light goes does not matter where it leaves at once.
    for name in ["mfp", "scale"] {
        params.get(name);
    }
    if measured.is_some() {
        // Scattering was measured as if it went to all sides alike.
        for name in ["reflectance", "sigma_a", "sigma_s", "g"] {
            params.warn_ignored(name, "\"name\" is given too", builder.warnings);
        }
    }
    let matter = match (measured, params.albedo_texture("reflectance")?) {
        (Some(MeasuredMatter { absorption, scattering }), _) => Matter::Coefficients {
            sigma_a: RgbInput::Constant(absorption),
            sigma_s: RgbInput::Constant(scattering),
            g: FloatInput::Constant(0.0),
        },
        (None, Some(reflectance)) => Matter::Reflectance(builder.rgb(Some(reflectance), Rgb::BLACK)?),
        (None, None) => {
            let sigma_a = builder.rgb(coefficient(params, "sigma_a")?, SIGMA_A)?;
            let sigma_s = builder.rgb(coefficient(params, "sigma_s")?, SIGMA_S)?;
            let g = within(params, "g", 0.0, -1.0..=1.0, builder)?;
            not_negative(params, "sigma_a", sigma_a)?;
            not_negative(params, "sigma_s", sigma_s)?;
            Matter::Coefficients { sigma_a, sigma_s, g }
        }
    };
    let coat = Coat {
        thickness: FloatInput::Constant(0.0),
        max_depth: SUBSURFACE_DEPTH,
        ..clear_coat(roughness(params, "", builder)?, builder.float(index_of_refraction(params, "eta")?, 1.33)?)
    };
    Ok(Material::Subsurface { coat, matter })
}

/// Grey and glossy, whatever was measured.
fn measured(params: &ParamSet, builder: &mut TextureBuilder) -> Material {
    params.get("filename");
    let message = format!(
        "material type \"measured\" is done as grey \"coateddiffuse\" of roughness {MEASURED_ROUGHNESS}: the file is not read"
    );
    builder.warnings.add(Some(params.span), message);
    let rough = FloatInput::Constant(MEASURED_ROUGHNESS);
    let roughness = Roughness { u: rough, v: rough, remap: true };
    let coat = clear_coat(roughness, FloatInput::Constant(1.5));
    Material::CoatedDiffuse { coat, reflectance: RgbInput::Constant(Rgb::splat(0.5)) }
}

/// `coateddiffuse`'s defaults.
fn clear_coat(roughness: Roughness, eta: FloatInput) -> Coat {
    Coat {
        roughness,
        thickness: FloatInput::Constant(0.01),
        eta,
        g: FloatInput::Constant(0.0),
        albedo: RgbInput::Constant(Rgb::BLACK),
        max_depth: 10,
        samples: 1,
    }
}

/// `reflectance`, or `eta` and `k` with this prefix.
fn metal(params: &ParamSet, prefix: &str, builder: &mut TextureBuilder) -> Result<Metal> {
    let [name_eta, name_k] = ["eta", "k"].map(|name| format!("{prefix}{name}"));
    if params.has("reflectance") {
        for name in [&name_eta, &name_k] {
            if params.has(name) {
                let message = format!("both \"reflectance\" and \"{name}\" are given for {}", params.owner);
                return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)).help("leave one out"));
            }
        }
        return Ok(Metal::Reflectance(builder.rgb(params.albedo_texture("reflectance")?, Rgb::splat(0.5))?));
    }
    let eta = builder.rgb(coefficient(params, &name_eta)?, copper("metal-Cu-eta"))?;
    let k = builder.rgb(coefficient(params, &name_k)?, copper("metal-Cu-k"))?;
    Ok(Metal::Index { eta, k })
}

/// `roughness`, or `uroughness` and `vroughness`, with this prefix.
fn roughness(params: &ParamSet, prefix: &str, builder: &mut TextureBuilder) -> Result<Roughness> {
    let stated = |name: &str| params.float_texture(&format!("{prefix}{name}"));
    let both = stated("roughness")?;
    let u = stated("uroughness")?.or_else(|| both.clone());
    let v = stated("vroughness")?.or(both);
    let remap = params.bool("remaproughness", true)?;
    Ok(Roughness { u: builder.float(u, 0.0)?, v: builder.float(v, 0.0)?, remap })
}

/// One of the two spectra of copper, the default metal.
fn copper(name: &str) -> Rgb {
    Spectrum::named(name).expect("the spectra of copper are built in").to_unbounded()
}

/// A float that must lie in `range`, or a texture of floats.
fn within(
    params: &ParamSet,
    name: &str,
    default: f32,
    range: RangeInclusive<f32>,
    builder: &mut TextureBuilder,
) -> Result<FloatInput> {
    let input = builder.float(params.float_texture(name)?, default)?;
    match input {
        FloatInput::Constant(value) if !range.contains(&value) => {
            let (low, high) = range.into_inner();
            let allowed = if high == f32::MAX { format!("at least {low}") } else { format!("from {low} to {high}") };
            Err(params.wrong(name, &format!("{allowed}, found {value}")))
        }
        input => Ok(input),
    }
}

fn not_negative(params: &ParamSet, name: &str, input: RgbInput) -> Result<()> {
    match input {
        RgbInput::Constant(value) if value.min_channel() < 0.0 => Err(params.wrong(name, "at least 0")),
        _ => Ok(()),
    }
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
