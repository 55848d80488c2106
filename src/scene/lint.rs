//! What a scene states to no effect, and what looks like an oversight: for people who look after scenes, not for renders.

use std::collections::HashSet;

use super::{ObjectEntity, ParamSet, ParamValue, SceneDescription, ShapeEntity, Warnings};

/// Adds a warning for each definition that nothing refers to, and for what is seldom meant. Media are not among them: of those that are not used every
/// render tells.
pub fn lint(scene: &SceneDescription, warnings: &mut Warnings) {
    let used = Used::of(scene);
    for (index, material) in scene.materials.iter().enumerate() {
        let Some(name) = &material.name else { continue };
        if !used.materials.contains(&index) && !used.names_of_materials.contains(name.as_str()) {
            warnings.add(Some(material.entity.span()), format!("material \"{name}\" is not used"));
        }
    }
    for texture in &scene.textures {
        if !used.textures.contains(texture.name.as_str()) {
            warnings.add(Some(texture.entity.span()), format!("texture \"{}\" is not used", texture.name));
        }
    }
    for (index, object) in scene.objects.iter().enumerate() {
        if !used.objects.contains(&index) {
            warnings.add(Some(object.span), format!("object \"{}\" has no instance", object.name));
        } else if object.shapes.is_empty() && object.instances.is_empty() {
            warnings.add(Some(object.span), format!("object \"{}\" is empty", object.name));
        }
    }
    oversights(scene, &used, warnings);
}

/// What is referred to.
#[derive(Default)]
struct Used<'a> {
    materials: HashSet<usize>,
    /// By mixes.
    names_of_materials: HashSet<&'a str>,
    textures: HashSet<&'a str>,
    objects: HashSet<usize>,
}

impl<'a> Used<'a> {
    fn of(scene: &'a SceneDescription) -> Self {
        let mut used = Self::default();
        let instances = scene.instances.iter().chain(scene.objects.iter().flat_map(|object| &object.instances));
        used.objects.extend(instances.map(|instance| instance.object as usize));
        for shape in shapes(scene) {
            used.materials.insert(shape.material.0 as usize);
            used.textures_of(&shape.entity.params);
        }
        for light in &scene.lights {
            used.textures_of(&light.entity.params);
        }
        let entities = scene
            .area_lights
            .iter()
            .chain(scene.textures.iter().map(|texture| &texture.entity))
            .chain(scene.media.iter().map(|medium| &medium.entity));
        entities.for_each(|entity| used.textures_of(&entity.params));
        for material in &scene.materials {
            let params = &material.entity.params;
            used.textures_of(params);
            for param in params.iter().filter(|param| param.name == "materials") {
                if let ParamValue::String(names) = &param.value {
                    used.names_of_materials.extend(names.iter().map(String::as_str));
                }
            }
        }
        used
    }

    fn textures_of(&mut self, params: &'a ParamSet) {
        for param in params.iter() {
            if let ParamValue::Texture(name) = &param.value {
                self.textures.insert(name);
            }
        }
    }
}

fn shapes(scene: &SceneDescription) -> impl Iterator<Item = &ShapeEntity> {
    scene.shapes.iter().chain(scene.objects.iter().flat_map(|object| &object.shapes))
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
    let infinite: Vec<_> = scene.lights.iter().filter(|light| light.entity.kind == "infinite").collect();
    if let [_, second, ..] = infinite.as_slice() {
        let message = format!("there are {} infinite lights, which add up", infinite.len());
        warnings.add(Some(second.entity.span()), message);
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
