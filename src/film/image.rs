//! Image files read into memory (textures, environments, images to compare), and PNG pictures for people.
//!
//! Which formats there are, and how their files become numbers, is in [`super::stored_image`].

use std::path::{Path, PathBuf};

use image::ImageEncoder;

use super::stored_image::{read_stored, read_stored_bytes};
use crate::system::output::{OutputError, write_atomically};

/// No image may have more pixels than this.
pub const MAX_PIXELS: usize = 1 << 28;

/// How stored values become linear ones.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Encoding {
    /// By the file's type: sRGB for files of 8 or 16-bit integers, linear for float ones.
    #[default]
    Auto,
    /// Already linear.
    Linear,
    /// The sRGB transfer function.
    Srgb,
    /// A power: linear = stored^γ.
    Gamma(f32),
}

impl Encoding {
    /// The linear value of a stored one. `Auto` counts as sRGB here; negative values keep their sign.
    pub fn to_linear(self, stored: f32) -> f32 {
        match self {
            Self::Linear => stored,
            Self::Auto | Self::Srgb => srgb_to_linear(stored),
            Self::Gamma(gamma) => stored.abs().powf(gamma).copysign(stored),
        }
    }
}

/// The sRGB transfer function's inverse (IEC 61966-2-1), odd about 0.
pub fn srgb_to_linear(encoded: f32) -> f32 {
    let v = encoded.abs();
    let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

/// The sRGB transfer function (IEC 61966-2-1), odd about 0.
pub fn linear_to_srgb(linear: f32) -> f32 {
    let v = linear.abs();
    let encoded = if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// An image in linear floats, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// 1 (grey), 3 (RGB) or 4 (RGBA).
    pub channels: usize,
    /// `width × height × channels` values.
    pub pixels: Vec<f32>,
}

/// Why an image could not be read.
#[derive(Debug, thiserror::Error)]
#[error("image {path}: {reason}")]
pub struct ImageError {
    /// The file.
    pub path: PathBuf,
    /// In words.
    pub reason: String,
    /// Whether nothing is wrong with the file, but with what the process's limit on memory leaves.
    pub is_limit: bool,
}

impl ImageError {
    pub(crate) fn new(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string(), is_limit: false }
    }

    /// There is too little memory. That is told apart only where the process has a limit of its own.
    pub(super) fn limit(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self { is_limit: crate::system::memory::limit().is_some(), ..Self::new(path, reason) }
    }
}

/// Reads PNG, JPEG, TGA, BMP, QOI, GIF, PNM, Radiance HDR, PFM or OpenEXR, by content. Grey with alpha becomes RGBA; alpha is never decoded.
/// Of an OpenEXR file it takes `R G B (A)`, or `Y`, or the only channel there is.
pub fn read_image(path: &Path, encoding: Encoding) -> Result<Image, ImageError> {
    Ok(read_stored(path)?.decoded(encoding))
}

/// [`read_image`] of a file that is already in memory; `path` is for messages and for telling TGA.
pub fn read_image_bytes(path: &Path, bytes: Vec<u8>, encoding: Encoding) -> Result<Image, ImageError> {
    Ok(read_stored_bytes(path, bytes)?.decoded(encoding))
}

/// Writes a PNG of 8 bits a channel, sRGB encoded: linear values are scaled by 2^`exposure`, clipped to 0..=1 (NaN becomes
/// 0) and rounded. One channel becomes grey, three RGB, four RGBA (alpha is not scaled).
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), OutputError> {
    let colour = match image.channels {
        1 => image::ExtendedColorType::L8,
        3 => image::ExtendedColorType::Rgb8,
        4 => image::ExtendedColorType::Rgba8,
        n => return Err(OutputError::new(path, format!("a PNG has 1, 3 or 4 channels, not {n}"))),
    };
    let scale = exposure.exp2();
    let encode = |(i, &value): (usize, &f32)| {
        let is_alpha = image.channels == 4 && i % 4 == 3;
        to_byte(if is_alpha { value } else { linear_to_srgb((value * scale).clamp(0.0, 1.0)) })
    };
    let bytes: Vec<u8> = image.pixels.iter().enumerate().map(encode).collect();
    write_atomically(path, |out| {
        image::codecs::png::PngEncoder::new(out)
            .write_image(&bytes, image.width as u32, image.height as u32, colour)
            .map_err(|e| e.to_string())
    })
}

/// A PNG in memory, of rows of red, green and blue bytes, sRGB encoded.
///
/// # Errors
/// In words; a wrong number of bytes among them.
pub fn encode_png(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, String> {
    if rgb.len() != 3 * width as usize * height as usize {
        return Err(format!("{} bytes are not {width} × {height} pixels", rgb.len()));
    }
    let mut png = vec![];
    image::codecs::png::PngEncoder::new(&mut png)
        .write_image(rgb, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|error| error.to_string())?;
    Ok(png)
}

/// The nearest of 0..=255 for a value in 0..=1; NaN gives 0.
pub(crate) fn to_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}
