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
    /// `NamedMaterial`s with their first places.
    pub material_references: &'a [(String, Span)],
    /// `MediumInterface`s likewise.
    pub medium_references: &'a [(String, Span)],
}

/// Completes the description.
///
/// # Errors
/// A name that refers to nothing, at the place that names it, and mixes of materials that contain themselves.
pub fn finish(mut scene: SceneDescription, header: Header, names: &Names) -> Result<SceneDescription> {
    let mut named = Vec::with_capacity(names.material_references.len());
    for (name, span) in names.material_references {
        named.push(*lookup(names.materials, name, "material", *span)?);
    }
    for (name, span) in names.medium_references {
        lookup(names.media, name, "medium", *span)?;
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
    scene.options = ParamSet::new("Option", scene.options.span, header.options);
    if let Some(times) = header.times {
        scene.transform_times = times;
    }
    Ok(scene)
}

fn lookup<'a, T>(names: &'a HashMap<String, T>, name: &str, what: &str, span: Span) -> Result<&'a T> {
    names.get(name).ok_or_else(|| undefined(what, name, span, names.keys().map(String::as_str)))
}

fn undefined<'a>(what: &str, name: &str, span: Span, known: impl Iterator<Item = &'a str>) -> Box<SceneError> {
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

/// The materials that a `mix` names exist, and none contains itself.
fn check_mixes(scene: &SceneDescription, names: &Names) -> Result<()> {
    let mut parts: Vec<(Vec<u32>, Option<Span>)> = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let mut list = (Vec::new(), None);
        let mixed = material.entity.params.iter().find(|p| p.name == "materials" && material.entity.kind == "mix");
        if let Some(param) = mixed
            && let ParamValue::String(mixed_names) = &param.value
        {
            list.1 = Some(param.span);
            for name in mixed_names {
                // pbrt-v4 takes "interface" for the absent material without a declaration.
                if name != "interface" || names.materials.contains_key(name) {
                    list.0.push(*lookup(names.materials, name, "material", param.span)?);
                }
            }
        }
        parts.push(list);
    }
    // Depth first without recursion: 0 not seen, 1 on the path, 2 done.
    let mut seen = vec![0u8; parts.len()];
    for root in 0..parts.len() {
        let mut path = vec![(root, 0usize)];
        while let Some((material, next)) = path.pop() {
            if next == 0 && seen[material] != 0 {
                continue;
            }
            seen[material] = 1;
            match parts[material].0.get(next) {
                None => seen[material] = 2,
                Some(&part) => {
                    let part = part as usize;
                    path.push((material, next + 1));
                    match seen[part] {
                        0 => path.push((part, 0)),
                        1 => {
                            let what = SceneErrorKind::Parameter("this mix contains itself".into());
                            let span = parts[material].1.unwrap_or(scene.materials[material].entity.span());
                            return Err(SceneError::at(span, what));
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    Ok(())
}
