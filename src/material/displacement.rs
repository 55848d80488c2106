//! Heights of displaced meshes: textures of floats, evaluated where points of a mesh are before they move.

use super::build_texture::TextureBuilder;
use super::texture::FloatInput;
use super::{Materials, TexturePoint};
use crate::scene::{SceneDescription, SceneError, TextureOr, Warnings};

impl Materials {
    /// What a shape's `displacement` is looked up in; `None` where it is 0 everywhere.
    ///
    /// # Errors
    /// As [`Materials::build`].
    pub fn height(
        &mut self,
        value: TextureOr<f32>,
        scene: &SceneDescription,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Option<FloatInput>, Box<SceneError>> {
        let Self { textures, loader, memory, .. } = self;
        let mut builder =
            TextureBuilder { scene, strict, warnings, textures, loader, memory, open: vec![], is_textured: false };
        let input = builder.float(Some(value), 0.0)?;
        Ok(Some(input).filter(|input| *input != FloatInput::Constant(0.0)))
    }

    /// The height at a point.
    pub fn height_at(&self, input: FloatInput, at: &TexturePoint) -> f32 {
        input.evaluate(&self.textures, at)
    }
}
