//! After the last directive: header values into the description, names into indices, and an error for each name that
//! nothing defines.

use std::collections::HashMap;

use super::builder::{BY_NAME, Header};
use super::directive::did_you_mean;
use crate::scene::{MaterialIndex, ParamSet, ParamValue, SceneDescription, SceneError, SceneErrorKind, Span};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// What is defined and what is referred to.
pub struct Names<'a> {
    /// Named materials: name to index.
    pub materials: &'a HashMap<String, u32>,
    /// Media: name to index.
    pub media: &'a HashMap<String, u32>,
    /// Textures: (name, is spectrum) to index.
    pub textures: &'a HashMap<(String, bool), u32>,
    /// Objects: name to index.
    pub objects: &'a HashMap<String, u32>,
    /// `NamedMaterial`s with their first places.
    pub material_references: &'a [(String, Span)],
    /// `MediumInterface`s likewise.
    pub medium_references: &'a [(String, Span)],
    /// `ObjectInstance`s that stand before the definition, likewise.
    pub object_references: &'a [(String, Span)],
}

/// Completes the description.
///
/// # Errors
/// A name that refers to nothing, at the place that names it.
pub fn finish(mut scene: SceneDescription, header: Header, names: &Names) -> Result<SceneDescription> {
    let mut named = Vec::with_capacity(names.material_references.len());
    for (name, span) in names.material_references {
        named.push(*lookup(names.materials, name, "material", *span)?);
    }
    for (name, span) in names.medium_references {
        lookup(names.media, name, "medium", *span)?;
    }
    let mut objects = Vec::with_capacity(names.object_references.len());
    for (name, span) in names.object_references {
        objects.push(*lookup(names.objects, name, "object", *span)?);
    }
    for instance in scene.instances.iter_mut().filter(|instance| instance.object & BY_NAME != 0) {
        instance.object = objects[(instance.object & !BY_NAME) as usize];
    }
    for shape in scene.shapes.iter_mut().chain(scene.objects.iter_mut().flat_map(|o| &mut o.shapes)) {
        let MaterialIndex(index) = shape.material;
        if index & BY_NAME != 0 {
            shape.material = MaterialIndex(named[(index & !BY_NAME) as usize]);
        }
        check_textures(&shape.entity.params, names)?;
    }
    for material in &scene.materials {
        check_textures(&material.entity.params, names)?;
    }
    // Also those that are declared later: pbrt-v4 takes images, and floats for spectra, wherever they stand.
    for texture in &scene.textures {
        check_textures(&texture.entity.params, names)?;
    }
    check_mixes(&scene, names)?;
    if let Some((entity, transform, medium)) = header.camera {
        scene.camera = entity;
        scene.camera_transform = transform;
        scene.camera_medium = medium;
    }
    for (place, stated) in [
        (&mut scene.film, header.film),
        (&mut scene.filter, header.filter),
        (&mut scene.sampler, header.sampler),
        (&mut scene.integrator, header.integrator),
    ] {
        if let Some(entity) = stated {
            *place = entity;
        }
    }
    if let Some(name) = header.film_color_space {
        scene.film_color_space = name;
    }
    scene.options = ParamSet::new("Option", scene.options.span, header.options);
    if let Some(times) = header.times {
        scene.transform_times = times;
    }
    Ok(scene)
}

fn lookup<'a, T>(names: &'a HashMap<String, T>, name: &str, what: &str, span: Span) -> Result<&'a T> {
    names.get(name).ok_or_else(|| undefined(what, name, span, names.keys().map(String::as_str)))
}

/// The error of a name that is none of the `known` ones.
pub fn undefined<'a>(what: &str, name: &str, span: Span, known: impl Iterator<Item = &'a str>) -> Box<SceneError> {
    let mut known: Vec<&str> = known.take(1024).collect();
    known.sort_unstable();
    let error = SceneError::at(span, SceneErrorKind::Undefined(format!("no {what} is called \"{name}\"")));
    match known.len() {
        0 => error.help(format!("this scene defines no {what} by name")),
        1..=16 => error.help(did_you_mean(name, &known)),
        _ => match did_you_mean(name, &known) {
            advice if advice.starts_with("did") => error.help(advice),
            _ => error,
        },
    }
}

fn check_textures(params: &ParamSet, names: &Names) -> Result<()> {
    for param in params.iter() {
        if let ParamValue::Texture(name) = &param.value
            && ![true, false].iter().any(|s| names.textures.contains_key(&(name.clone(), *s)))
        {
            return Err(undefined("texture", name, param.span, names.textures.keys().map(|(n, _)| n.as_str())));
        }
    }
    Ok(())
}

/// The materials that a `mix` names exist.
fn check_mixes(scene: &SceneDescription, names: &Names) -> Result<()> {
    for material in scene.materials.iter().filter(|material| material.entity.kind == "mix") {
        let params = material.entity.params.iter().filter(|param| param.name == "materials");
        for (param, mixed) in params.filter_map(|param| match &param.value {
            ParamValue::String(mixed) => Some((param, mixed)),
            _ => None,
        }) {
            for name in mixed {
                lookup(names.materials, name, "material", param.span)?;
            }
        }
    }
    Ok(())
}
