//! Textures: values that vary over a surface, and material inputs that are either a number or a texture.
//!
//! A texture is a small tree whose nodes refer to each other by place in [`Textures`]. Adding a kind means one variant in
//! [`FloatTexture`] or [`RgbTexture`], one arm in its `evaluate`, and one arm in `build_texture.rs`.

use std::sync::Arc;

use glam::Vec2;

use super::TexturePoint;
use super::image_texture::ImageMap;
use super::procedural::{Marble, NoiseTexture, Weight};
use super::texture_mapping::Mapping2d;
use crate::math::Rgb;

/// The step of the texture coordinates over which a texture's slope is taken, unless its images say how fine they are (pbrt-v4, section
/// 10.5.4).
const STEP: f32 = 0.0005;

/// A float texture, by its place in [`Textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FloatTextureId(pub u32);

/// An RGB texture, by its place in [`Textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RgbTextureId(pub u32);

/// A float that a material asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatInput {
    /// The same everywhere: no lookup.
    Constant(f32),
    /// Looked up.
    Texture(FloatTextureId),
}

/// A colour that a material asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RgbInput {
    /// The same everywhere: no lookup.
    Constant(Rgb),
    /// Looked up.
    Texture(RgbTextureId),
}

/// Textures of floats.
#[derive(Debug)]
pub enum FloatTexture {
    /// One input times another.
    Scale(FloatInput, FloatInput),
    /// An image; of several channels: the grey, else alpha where there is one, else their mean.
    Image(Arc<ImageMap>),
    /// One input, and as much of another as the weight says.
    Blend(FloatInput, FloatInput, Weight),
    /// Linear between its values at (0, 0), (1, 0), (0, 1) and (1, 1).
    Bilinear(Mapping2d, [f32; 4]),
    /// Sums of noise.
    Noise(NoiseTexture),
}

/// Textures of colours: reflectances and other coefficients.
#[derive(Debug)]
pub enum RgbTexture {
    /// A colour times a float.
    Scale(RgbInput, FloatInput),
    /// An image.
    Image(Arc<ImageMap>),
    /// One input, and as much of another as the weight says.
    Blend(RgbInput, RgbInput, Weight),
    /// Linear between its values at (0, 0), (1, 0), (0, 1) and (1, 1).
    Bilinear(Mapping2d, [Rgb; 4]),
    /// Veins.
    Marble(Marble),
}

/// All textures in use.
#[derive(Debug, Default)]
pub struct Textures {
    /// Of floats, with the image look-ups that one look-up takes.
    floats: Vec<(FloatTexture, u32)>,
    /// Of colours, likewise.
    rgbs: Vec<(RgbTexture, u32)>,
}

impl FloatInput {
    /// The value at `point`.
    #[inline]
    pub fn evaluate(&self, textures: &Textures, point: &TexturePoint) -> f32 {
        match *self {
            Self::Constant(value) => value,
            Self::Texture(id) => textures.float(id, point),
        }
    }
}

impl RgbInput {
    /// The value at `point`.
    #[inline]
    pub fn evaluate(&self, textures: &Textures, point: &TexturePoint) -> Rgb {
        match *self {
            Self::Constant(value) => value,
            Self::Texture(id) => textures.rgb(id, point),
        }
    }
}

impl Textures {
    /// Adds a texture, a look-up of which comes to so many of images.
    pub fn add_float(&mut self, texture: FloatTexture, lookups: u32) -> FloatTextureId {
        self.floats.push((texture, lookups));
        FloatTextureId(self.floats.len() as u32 - 1)
    }

    /// Adds a texture, a look-up of which comes to so many of images.
    pub fn add_rgb(&mut self, texture: RgbTexture, lookups: u32) -> RgbTextureId {
        self.rgbs.push((texture, lookups));
        RgbTextureId(self.rgbs.len() as u32 - 1)
    }

    /// Image look-ups in one look-up of `input`.
    pub fn float_lookups(&self, input: FloatInput) -> u32 {
        match input {
            FloatInput::Constant(_) => 0,
            FloatInput::Texture(id) => self.floats[id.0 as usize].1,
        }
    }

    /// Image look-ups in one look-up of `input`.
    pub fn rgb_lookups(&self, input: RgbInput) -> u32 {
        match input {
            RgbInput::Constant(_) => 0,
            RgbInput::Texture(id) => self.rgbs[id.0 as usize].1,
        }
    }

    /// A step of the texture coordinates, above 0, over which the slope of `input` may be taken: half a texel of its finest image.
    pub fn step(&self, input: FloatInput) -> Vec2 {
        let finest = self.finest(input);
        if finest.is_finite() { finest } else { Vec2::splat(STEP) }
    }

    /// Infinite for what is the same everywhere.
    fn finest(&self, input: FloatInput) -> Vec2 {
        let FloatInput::Texture(id) = input else { return Vec2::INFINITY };
        match &self.floats[id.0 as usize].0 {
            FloatTexture::Scale(texture, scale) => self.finest(*texture).min(self.finest(*scale)),
            FloatTexture::Image(map) => map.half_texel(),
            FloatTexture::Blend(a, b, weight) => {
                let amount = if let Weight::Input(amount) = weight { self.finest(*amount) } else { Vec2::INFINITY };
                self.finest(*a).min(self.finest(*b)).min(amount)
            }
            FloatTexture::Bilinear(..) | FloatTexture::Noise(_) => Vec2::INFINITY,
        }
    }

    fn float(&self, id: FloatTextureId, point: &TexturePoint) -> f32 {
        match &self.floats[id.0 as usize].0 {
            FloatTexture::Scale(texture, scale) => texture.evaluate(self, point) * scale.evaluate(self, point),
            FloatTexture::Image(map) => map.float(point),
            FloatTexture::Blend(a, b, weight) => match weight.at(self, point) {
                0.0 => a.evaluate(self, point),
                1.0 => b.evaluate(self, point),
                w => (1.0 - w) * a.evaluate(self, point) + w * b.evaluate(self, point),
            },
            FloatTexture::Bilinear(mapping, [a, b, c, d]) => {
                let st = mapping.at(point);
                let row = |a: f32, b: f32| (1.0 - st.x) * a + st.x * b;
                (1.0 - st.y) * row(*a, *b) + st.y * row(*c, *d)
            }
            FloatTexture::Noise(noise) => noise.at(point),
        }
    }

    fn rgb(&self, id: RgbTextureId, point: &TexturePoint) -> Rgb {
        match &self.rgbs[id.0 as usize].0 {
            RgbTexture::Scale(texture, scale) => texture.evaluate(self, point) * scale.evaluate(self, point),
            RgbTexture::Image(map) => map.rgb(point),
            RgbTexture::Blend(a, b, weight) => match weight.at(self, point) {
                0.0 => a.evaluate(self, point),
                1.0 => b.evaluate(self, point),
                w => a.evaluate(self, point) * (1.0 - w) + b.evaluate(self, point) * w,
            },
            RgbTexture::Bilinear(mapping, [a, b, c, d]) => {
                let st = mapping.at(point);
                a.lerp(*b, st.x).lerp(c.lerp(*d, st.x), st.y)
            }
            RgbTexture::Marble(marble) => marble.at(point),
        }
    }

    /// Whether `input` depends on more than the surface's own coordinates.
    pub fn is_spatial(&self, input: FloatInput) -> bool {
        let over = |mapping: &Mapping2d| !matches!(mapping, Mapping2d::Uv { .. });
        let FloatInput::Texture(id) = input else { return false };
        match &self.floats[id.0 as usize].0 {
            FloatTexture::Scale(a, b) => self.is_spatial(*a) || self.is_spatial(*b),
            FloatTexture::Image(map) => over(&map.mapping),
            FloatTexture::Bilinear(mapping, _) => over(mapping),
            FloatTexture::Noise(_) => true,
            FloatTexture::Blend(a, b, weight) => {
                let weighed = match weight {
                    Weight::Input(amount) => self.is_spatial(*amount),
                    Weight::Squares(mapping) | Weight::Dots(mapping) => over(mapping),
                    Weight::Direction(_) | Weight::Cubes(_) => true,
                };
                weighed || self.is_spatial(*a) || self.is_spatial(*b)
            }
        }
    }

    /// Bytes of the textures themselves, without images.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.floats) + size_of_val(&*self.rgbs)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.floats.len() + self.rgbs.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
