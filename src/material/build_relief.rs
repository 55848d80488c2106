//! `normalmap` and `displacement` of materials. The image of normals is read as linear whatever its format, as in pbrt-v4, and repeats. Where a
//! material has both, the map is used.

use super::build_texture::TextureBuilder;
use super::image_texture::{Filter, ImageMap, Wrap};
use super::relief::Relief;
use super::texture::FloatInput;
use super::texture_mapping::Mapping2d;
use crate::film::image::Encoding;
use crate::scene::{ParamSet, SceneError, SceneErrorKind};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// The relief that a material's parameters state.
pub(super) fn relief(params: &ParamSet, builder: &mut TextureBuilder) -> Result<Relief> {
    if let Some(file) = params.string("normalmap")? {
        params.warn_ignored("displacement", "the material has a \"normalmap\" too", builder.warnings);
        return normals(file, params, builder);
    }
    let Some(displacement) = params.float_texture("displacement")? else { return Ok(Relief::None) };
    let height = builder.float(Some(displacement), 0.0)?;
    // A height that is the same everywhere has no slope.
    if matches!(height, FloatInput::Constant(_)) {
        return Ok(Relief::None);
    }
    Ok(Relief::Heights { height, step: builder.textures.step(height) })
}

fn normals(file: &str, params: &ParamSet, builder: &mut TextureBuilder) -> Result<Relief> {
    let span = params.get("normalmap").map_or(params.span, |param| param.span);
    let Some(image) = builder.image(file, Encoding::Linear, span, "the surface stays as it is")? else {
        return Ok(Relief::None);
    };
    if image.is_grey() {
        let reason = "a map of normals has red, green and blue, but this image is grey".to_owned();
        let path = builder.scene.resolve(file);
        return Err(SceneError::at(span, SceneErrorKind::File { path, reason }));
    }
    Ok(Relief::Normals(ImageMap {
        image,
        wrap: Wrap::Repeat,
        filter: Filter::Bilinear,
        mapping: Mapping2d::IDENTITY,
        scale: 1.0,
        invert: false,
        to_rec709: None,
    }))
}
