//! From `Material` and `MakeNamedMaterial` directives to [`Materials`]. What the parameters of each type mean is in `build_kind.rs` and
//! `build_relief.rs`.

use std::sync::Arc;

use super::build_kind::{Names, material};
use super::build_relief::relief;
use super::build_texture::{Loader, TextureBuilder};
use super::kinds::Material;
use super::mip_map::memory::{TextureMemory, TextureSettings};
use super::relief::Relief;
use super::texture::{FloatInput, Textures};
use super::{Alpha, MaterialId, Materials, Traits};
use crate::scene::{SceneDescription, SceneError, SceneErrorKind, TextureOr, Warnings};

type Result<T> = std::result::Result<T, Box<SceneError>>;

impl Materials {
    /// Builds the materials of a scene, whose images take as much memory as `images` says: that of index i in [`SceneDescription::materials`] becomes `MaterialId(i)`.
    ///
    /// # Errors
    /// Parameters of a wrong type, names that refer to nothing, mixes or textures that contain themselves; under `strict` also
    /// image files that cannot be read.
    pub fn build(
        scene: &SceneDescription,
        images: TextureSettings,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let memory = Arc::new(TextureMemory::new(images, strict));
        let mut textures = Textures::default();
        let mut loader = Loader::new(scene);
        let mut list = Vec::with_capacity(scene.materials.len());
        let mut reliefs = Vec::with_capacity(scene.materials.len());
        let mut has_texture = Vec::with_capacity(scene.materials.len());
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
                memory: &memory,
                open: vec![],
                is_textured: false,
            };
            let material = material(entity, &names, &mut builder)?;
            // The parts of a mix have reliefs of their own, and a boundary between media has nothing to shade.
            let is_shaded = !matches!(material, Material::Mix { .. } | Material::Interface);
            reliefs.push(if is_shaded { relief(&entity.entity.params, &mut builder)? } else { Relief::None });
            list.push(material);
            has_texture.push(builder.is_textured);
            entity.entity.params.warn_unused(warnings);
        }
        let own = |k: usize| {
            let has_relief = !matches!(reliefs[k], Relief::None);
            Traits {
                is_transmissive: list[k].is_transmissive(),
                is_fibre: matches!(list[k], Material::Hair(_)),
                is_textured: has_texture[k] || has_relief,
                has_relief,
            }
        };
        let traits = traits(&list, own, scene)?;
        if reliefs.iter().all(|relief| matches!(relief, Relief::None)) {
            reliefs = Vec::new();
        }
        Ok(Self { list, traits, reliefs, textures, alphas: Vec::new(), loader, memory })
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
        let Self { textures, loader, memory, .. } = self;
        let mut builder =
            TextureBuilder { scene, strict, warnings, textures, loader, memory, open: vec![], is_textured: false };
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

/// What holds for each material, of which `own` tells what it is by itself. Refuses mixes that contain themselves. Every mix is followed once: linear in their number.
fn traits(list: &[Material], own: impl Fn(usize) -> Traits, scene: &SceneDescription) -> Result<Vec<Traits>> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done(Traits),
    }
    let done = |state: State| if let State::Done(traits) = state { traits } else { Traits::default() };
    let mut states = vec![State::New; list.len()];
    for start in 0..list.len() {
        // (material, its next child): an explicit stack, since a file may nest as deeply as it likes.
        let mut stack = vec![(start, 0)];
        while let Some((place, child)) = stack.pop() {
            let Material::Mix { materials, .. } = &list[place] else {
                states[place] = State::Done(own(place));
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
                    let parts = materials.map(|part| done(states[part.0 as usize]));
                    states[place] = State::Done(parts.into_iter().fold(own(place), Traits::or));
                }
            }
        }
    }
    Ok(states.into_iter().map(done).collect())
}
