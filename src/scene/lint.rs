//! What a scene states to no effect, and what looks like an oversight: for people who look after scenes, not for renders.

mod used;

use std::collections::HashSet;

use self::used::Used;
use super::{ObjectEntity, ParamValue, SceneDescription, Span, Warnings};

/// Adds warnings of definitions that nothing which is used refers to, and of what is seldom meant. Media are not among them: of those that are not used every render tells.
pub fn lint(scene: &SceneDescription, warnings: &mut Warnings) {
    let used = Used::of(scene);
    let materials = scene.materials.iter().enumerate().filter(|(index, _)| !used.materials.contains(index));
    let named = materials.filter_map(|(_, material)| Some((material.name.as_deref()?, material.entity.span())));
    unused("material", &named.collect::<Vec<_>>(), warnings);
    let textures = scene.textures.iter().enumerate().filter(|(index, _)| !used.textures.contains(index));
    let named = textures.map(|(_, texture)| (texture.name.as_str(), texture.entity.span()));
    unused("texture", &named.collect::<Vec<_>>(), warnings);
    for (index, object) in scene.objects.iter().enumerate() {
        if !used.objects.contains(&index) {
            warnings.add(Some(object.span), format!("object \"{}\" has no instance", object.name));
        } else if object.shapes.is_empty() && object.instances.is_empty() {
            warnings.add(Some(object.span), format!("object \"{}\" is empty", object.name));
        }
    }
    for system in scene.systems.iter().filter(|system| !system.is_used) {
        warnings.add(Some(system.span), format!("coordinate system \"{}\" is not used", system.name));
    }
    oversights(scene, &used, warnings);
}

/// Unused things of one kind, named up to here: libraries of materials leave a great many unused.
const MOST_NAMED: usize = 4;

/// One warning for all unused things of one kind, at the first of them.
fn unused(kind: &str, list: &[(&str, Span)], warnings: &mut Warnings) {
    let Some(&(first, span)) = list.first() else { return };
    if list.len() == 1 {
        warnings.add(Some(span), format!("{kind} \"{first}\" is not used"));
        return;
    }
    let named = list.iter().take(MOST_NAMED).map(|(name, at)| match at.file == span.file {
        true => format!("\"{name}\" (line {})", at.line),
        false => format!("\"{name}\""),
    });
    let others = list.len().saturating_sub(MOST_NAMED);
    let others = if others > 0 { format!(" and {others} more") } else { String::new() };
    let message = format!("{} {kind}s are not used: {}{others}", list.len(), named.collect::<Vec<_>>().join(", "));
    warnings.add(Some(span), message);
}

/// Adds a warning for each of the first few directives whose lights emit nothing: `places` are [`crate::light::Lights::dark_places`]. How many they are
/// every render tells that chooses among them.
pub fn lint_lights(places: &[Span], warnings: &mut Warnings) {
    for place in places {
        warnings.add(Some(*place), "a light that is stated here emits nothing");
    }
}

/// Adds a warning for each file that is not there and only named by what is not used, unless there is a warning at its place already: a render looks for
/// some of these files and not for others.
pub fn lint_files(scene: &SceneDescription, warnings: &mut Warnings) {
    let told: HashSet<Span> = warnings.list().iter().filter_map(|warning| warning.span).collect();
    let used = Used::of(scene);
    for param in used.unused_entities(scene).flat_map(|entity| entity.params.iter()) {
        let Some(path) = scene.file_of(param).filter(|_| !told.contains(&param.span)) else { continue };
        let reason = match std::fs::metadata(&path) {
            Ok(metadata) if metadata.is_file() => continue,
            Ok(_) => "not a file".to_owned(),
            Err(error) => error.to_string(),
        };
        warnings.add(Some(param.span), format!("cannot read {}: {reason}", path.display()));
    }
}

fn oversights(scene: &SceneDescription, used: &Used<'_>, warnings: &mut Warnings) {
    let is_shown = |(index, object): (usize, &ObjectEntity)| used.objects.contains(&index) && !object.shapes.is_empty();
    if scene.shapes.is_empty() && !scene.objects.iter().enumerate().any(is_shown) {
        warnings.add(None, "the scene shows no shapes");
    }
    // Media may glow; whether they do is known once they are built.
    if scene.lights.is_empty() && scene.area_lights.is_empty() && scene.media.is_empty() {
        warnings.add(None, "the scene has no lights: the image will be black");
    }
    for light in scene.area_lights.iter().chain(scene.lights.iter().map(|light| &light.entity)) {
        for param in light.params.iter().filter(|param| matches!(param.name.as_str(), "scale" | "power")) {
            if matches!(&param.value, ParamValue::Float(values) if values.iter().all(|value| *value == 0.0)) {
                warnings.add(Some(param.span), format!("\"{}\" is 0: this light gives none", param.name));
            }
        }
    }
    for shape in &scene.shapes {
        let material = &scene.materials[shape.material.0 as usize].entity;
        let is_interface = material.kind == "interface"
            || material.params.iter().any(|param| {
                param.name == "type"
                    && matches!(&param.value, ParamValue::String(v) if v.first().is_some_and(|v| v == "interface"))
            });
        let has_media = shape
            .medium_interface
            .as_ref()
            .is_some_and(|interface| !(interface.inside.is_empty() && interface.outside.is_empty()));
        if is_interface && !has_media && shape.area_light.is_none() {
            let message =
                "this shape has the material \"interface\" and no medium on either side: nothing of it is seen";
            warnings.add(Some(shape.entity.span()), message);
        }
    }
}
