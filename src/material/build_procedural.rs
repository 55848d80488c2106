//! From `Texture` directives to textures that are computed: `mix`, `directionmix`, `bilerp`, `checkerboard`, `dots`, `fbm`, `wrinkled`, `windy`,
//! `marble`. Names, defaults and meanings are those of pbrt-v4's file format.

use glam::{Affine3A, Vec2, Vec3};

use super::build_texture::{Result, TextureBuilder};
use super::procedural::{Marble, NoiseKind, NoiseTexture, Weight};
use super::texture::{FloatTexture, RgbTexture};
use super::texture_mapping::Mapping2d;
use crate::math::Rgb;
use crate::math::transform::RenderSpace;
use crate::scene::{ParamSet, SceneError, SceneErrorKind, TextureEntity, TextureOr, Warnings};

/// Beyond these octaves noise is finer than single precision.
const MOST_OCTAVES: i32 = 32;

impl TextureBuilder<'_> {
    /// The texture that `texture` states, or `None` for kinds that are not known.
    pub(super) fn procedural_float(&mut self, texture: &TextureEntity) -> Result<Option<FloatTexture>> {
        let params = &texture.entity.params;
        let built = match texture.entity.kind.as_str() {
            "bilerp" => {
                let corner = |name: &str, default: f32| params.float(name, default);
                let corners = [corner("v00", 0.0)?, corner("v10", 0.0)?, corner("v01", 1.0)?, corner("v11", 1.0)?];
                FloatTexture::Bilinear(self.mapping(texture)?, corners)
            }
            "fbm" => self.noise(texture, |omega, octaves| NoiseKind::Fbm { omega, octaves })?,
            "wrinkled" => self.noise(texture, |omega, octaves| NoiseKind::Wrinkled { omega, octaves })?,
            "windy" => {
                let to_texture = self.to_texture(texture)?;
                FloatTexture::Noise(NoiseTexture { to_texture, kind: NoiseKind::Windy })
            }
            _ => {
                let Some((weight, [a, b])) = self.blend(texture)? else { return Ok(None) };
                let a = self.float(params.float_texture(a.0)?, a.1)?;
                let b = self.float(params.float_texture(b.0)?, b.1)?;
                FloatTexture::Blend(a, b, weight)
            }
        };
        Ok(Some(built))
    }

    /// The same for textures of colours.
    pub(super) fn procedural_rgb(&mut self, texture: &TextureEntity) -> Result<Option<RgbTexture>> {
        let params = &texture.entity.params;
        let built = match texture.entity.kind.as_str() {
            "bilerp" => {
                let corner = |name: &str, default: f32| match params.albedo_texture(name)? {
                    Some(TextureOr::Value(value)) => Ok(value),
                    None => Ok(Rgb::splat(default)),
                    Some(TextureOr::Texture(..)) => Err(params.wrong(name, "a colour, not a texture")),
                };
                let corners = [corner("v00", 0.0)?, corner("v10", 0.0)?, corner("v01", 1.0)?, corner("v11", 1.0)?];
                RgbTexture::Bilinear(self.mapping(texture)?, corners)
            }
            "marble" => RgbTexture::Marble(Marble {
                to_texture: self.to_texture(texture)?,
                scale: params.float("scale", 1.0)?,
                variation: params.float("variation", 0.2)?,
                omega: params.float("roughness", 0.5)?,
                octaves: octaves(params, self.warnings)?,
            }),
            _ => {
                let Some((weight, [a, b])) = self.blend(texture)? else { return Ok(None) };
                let a = self.rgb(params.albedo_texture(a.0)?, Rgb::splat(a.1))?;
                let b = self.rgb(params.albedo_texture(b.0)?, Rgb::splat(b.1))?;
                RgbTexture::Blend(a, b, weight)
            }
        };
        Ok(Some(built))
    }

    /// What two textures are weighed by, and for both the parameter's name and default.
    #[allow(clippy::type_complexity)]
    fn blend(&mut self, texture: &TextureEntity) -> Result<Option<(Weight, [(&'static str, f32); 2])>> {
        let params = &texture.entity.params;
        let in_order = [("tex1", 0.0), ("tex2", 1.0)];
        let blend = match texture.entity.kind.as_str() {
            "mix" => {
                let amount = self.float(params.float_texture("amount")?, 0.5)?;
                (Weight::Input(amount), in_order)
            }
            "directionmix" => {
                let stated = Vec3::from_array(params.vec3("dir")?.unwrap_or([0.0, 1.0, 0.0]));
                let to_render = self.to_texture(texture)?.inverse();
                let Some(direction) = to_render.transform_vector3(stated).try_normalize() else {
                    return Err(params.wrong("dir", "a direction, not 0"));
                };
                // The first counts where the surface faces that way.
                (Weight::Direction(direction), in_order)
            }
            "checkerboard" => {
                let weight = match params.integer("dimension", 2)? {
                    2 => Weight::Squares(self.mapping(texture)?),
                    3 => Weight::Cubes(self.to_texture(texture)?),
                    _ => return Err(params.wrong("dimension", "2 or 3")),
                };
                (weight, [("tex1", 1.0), ("tex2", 0.0)])
            }
            "dots" => (Weight::Dots(self.mapping(texture)?), [("outside", 0.0), ("inside", 1.0)]),
            _ => return Ok(None),
        };
        Ok(Some(blend))
    }

    fn noise(&mut self, texture: &TextureEntity, kind: impl Fn(f32, u32) -> NoiseKind) -> Result<FloatTexture> {
        let params = &texture.entity.params;
        let kind = kind(params.float("roughness", 0.5)?, octaves(params, self.warnings)?);
        Ok(FloatTexture::Noise(NoiseTexture { to_texture: self.to_texture(texture)?, kind }))
    }

    /// How a texture over two dimensions lies on surfaces.
    pub(super) fn mapping(&mut self, texture: &TextureEntity) -> Result<Mapping2d> {
        let params = &texture.entity.params;
        let number = |name: &str, default: f32| params.float(name, default);
        let delta = || -> Result<Vec2> { Ok(Vec2::new(number("udelta", 0.0)?, number("vdelta", 0.0)?)) };
        match params.string("mapping")? {
            None | Some("uv") => {
                let scale = Vec2::new(number("uscale", 1.0)?, number("vscale", 1.0)?);
                Ok(Mapping2d::Uv { scale, delta: delta()? })
            }
            Some("planar") => {
                let axis = |name: &str, default: Vec3| -> Result<Vec3> {
                    Ok(params.vec3(name)?.map_or(default, Vec3::from_array))
                };
                let axes = [axis("v1", Vec3::X)?, axis("v2", Vec3::Y)?];
                Ok(Mapping2d::Planar { to_texture: self.to_texture(texture)?, axes, delta: delta()? })
            }
            Some("spherical") => Ok(Mapping2d::Spherical(self.to_texture(texture)?)),
            Some("cylindrical") => Ok(Mapping2d::Cylindrical(self.to_texture(texture)?)),
            Some(other) => {
                let expected = format!("uv, planar, spherical or cylindrical, found \"{other}\"");
                params.pass_over("mapping", &expected, "u and v as they are, are taken", self.warnings);
                Ok(Mapping2d::IDENTITY)
            }
        }
    }

    /// From render space to the space in which `texture` was declared.
    fn to_texture(&self, texture: &TextureEntity) -> Result<Affine3A> {
        let space = RenderSpace { origin: self.scene.camera_position() };
        let inverse = space.from_world(&texture.transform.start).inverse();
        if !inverse.is_finite() {
            let params = &texture.entity.params;
            let message = format!("{}: its transformation cannot be inverted", params.owner);
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
        }
        Ok(Affine3A::from_mat3_translation(inverse.matrix3.as_mat3(), inverse.translation.as_vec3()))
    }
}

fn octaves(params: &ParamSet, warnings: &mut Warnings) -> Result<u32> {
    let octaves = params.integer("octaves", 8)?;
    if !(1..=MOST_OCTAVES).contains(&octaves) {
        params.pass_over("octaves", &format!("from 1 to {MOST_OCTAVES}"), "the nearer of these is taken", warnings);
    }
    Ok(octaves.clamp(1, MOST_OCTAVES) as u32)
}
