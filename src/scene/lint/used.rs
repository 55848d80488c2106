//! What of a scene is used: what its shapes, lights, media and camera refer to, and what that refers to in turn. What only unused things refer to
//! is not used either.

use std::collections::{HashMap, HashSet};

use crate::scene::{Entity, InstanceEntity, ParamSet, ParamValue, SceneDescription, ShapeEntity};

/// What is used, by its place in the description's lists.
#[derive(Default)]
pub struct Used<'a> {
    /// Objects that are instanced, by the scene or by an object that is.
    pub objects: HashSet<usize>,
    /// Materials of shapes that are shown, and what such materials mix.
    pub materials: HashSet<usize>,
    /// Textures of what is used.
    pub textures: HashSet<usize>,
    /// Media around what is used.
    pub media: HashSet<&'a str>,
}

impl<'a> Used<'a> {
    /// Follows all references from what the scene shows.
    pub fn of(scene: &'a SceneDescription) -> Self {
        let mut used = Self::default();
        used.follow_instances(scene);
        let mut names = Names::of(scene);
        let objects = used.objects.iter().map(|&index| &scene.objects[index]);
        for shape in scene.shapes.iter().chain(objects.flat_map(|object| &object.shapes)) {
            names.textures_of(&shape.entity.params);
            names.materials.push(shape.material.0 as usize);
            if let Some(light) = shape.area_light {
                names.textures_of(&scene.area_lights[light as usize].params);
            }
            used.media.extend(media_of(shape));
        }
        for light in &scene.lights {
            names.textures_of(&light.entity.params);
            used.media.insert(&light.medium);
        }
        names.textures_of(&scene.camera.params);
        used.media.insert(&scene.camera_medium);
        for medium in scene.media.iter().filter(|medium| used.media.contains(medium.name.as_str())) {
            names.textures_of(&medium.entity.params);
        }
        used.follow_names(scene, names);
        used
    }

    /// The entities that are not used, with what they name.
    pub fn unused_entities(&self, scene: &'a SceneDescription) -> impl Iterator<Item = &'a Entity> {
        let objects = scene.objects.iter().enumerate().filter(|(index, _)| !self.objects.contains(index));
        let shapes = objects.flat_map(|(_, object)| &object.shapes).map(|shape| &shape.entity);
        let materials = scene.materials.iter().enumerate().filter(|(index, _)| !self.materials.contains(index));
        let textures = scene.textures.iter().enumerate().filter(|(index, _)| !self.textures.contains(index));
        let media = scene.media.iter().filter(|medium| !self.media.contains(medium.name.as_str()));
        shapes
            .chain(materials.map(|(_, material)| &material.entity))
            .chain(textures.map(|(_, texture)| &texture.entity))
            .chain(media.map(|medium| &medium.entity))
    }

    fn follow_instances(&mut self, scene: &SceneDescription) {
        let mut open: Vec<&InstanceEntity> = scene.instances.iter().collect();
        while let Some(instance) = open.pop() {
            let object = instance.object as usize;
            if self.objects.insert(object) {
                open.extend(&scene.objects[object].instances);
            }
        }
    }

    fn follow_names(&mut self, scene: &'a SceneDescription, mut names: Names<'a>) {
        let mut by_name: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, texture) in scene.textures.iter().enumerate() {
            // One of floats and one of spectra may have the same name.
            by_name.entry(&texture.name).or_default().push(index);
        }
        while let Some(index) = names.materials.pop() {
            if self.materials.insert(index) {
                names.textures_of(&scene.materials[index].entity.params);
                names.mixed_by(&scene.materials[index].entity.params);
            }
        }
        while let Some(name) = names.textures.pop() {
            for &index in by_name.get(name).into_iter().flatten() {
                if self.textures.insert(index) {
                    names.textures_of(&scene.textures[index].entity.params);
                }
            }
        }
    }
}

/// The media on the two sides of a shape.
fn media_of(shape: &ShapeEntity) -> impl Iterator<Item = &str> {
    shape.medium_interface.iter().flat_map(|sides| [sides.inside.as_str(), sides.outside.as_str()])
}

/// References that are still to be followed.
struct Names<'a> {
    by_name: HashMap<&'a str, usize>,
    materials: Vec<usize>,
    textures: Vec<&'a str>,
}

impl<'a> Names<'a> {
    fn of(scene: &'a SceneDescription) -> Self {
        let named = scene.materials.iter().enumerate();
        let by_name = named.filter_map(|(index, material)| Some((material.name.as_deref()?, index))).collect();
        Self { by_name, materials: vec![], textures: vec![] }
    }

    fn textures_of(&mut self, params: &'a ParamSet) {
        for param in params.iter() {
            if let ParamValue::Texture(name) = &param.value {
                self.textures.push(name);
            }
        }
    }

    /// Materials that a mix names.
    fn mixed_by(&mut self, params: &ParamSet) {
        for param in params.iter().filter(|param| param.name == "materials") {
            if let ParamValue::String(names) = &param.value {
                self.materials.extend(names.iter().filter_map(|name| self.by_name.get(name.as_str())));
            }
        }
    }
}
