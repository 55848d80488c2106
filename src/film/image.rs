//! Image files read into memory (textures, environments, images to compare), and PNG pictures for people.
//!
//! Formats are told by content: PNG, JPEG, TGA and Radiance HDR through the crate `image`, OpenEXR through [`super::exr`],
//! PFM by [`super::pfm`]. TGA has no signature, so what nothing else claims is tried as TGA if it is named so.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits};

use crate::system::input::read_regular;
use crate::system::memory::available;
use crate::system::output::{OutputError, write_atomically};

/// No image may have more pixels than this.
pub const MAX_PIXELS: usize = 1 << 28;

/// No decoder may allocate more than this many bytes: four 32-bit floats for each of [`MAX_PIXELS`].
const MAX_BYTES: u64 = (MAX_PIXELS as u64) << 4;

/// A file may hold this many values freely …
const UNSUSPICIOUS: usize = 1 << 26;

/// … and more if each of its bytes stands for no more than this many of them. Pictures take a value to a few bytes; those of one colour all over are what
/// files made to fill the memory look like.
const MOST_A_BYTE: usize = 256;

/// Refuses what a few bytes blow up to.
pub(super) fn check_expansion(values: usize, bytes: u64) -> Result<(), String> {
    let allowed = MOST_A_BYTE.saturating_mul(usize::try_from(bytes).unwrap_or(usize::MAX)).max(UNSUSPICIOUS);
    if values <= allowed {
        return Ok(());
    }
    Err(format!("{values} values in a file of {bytes} bytes: refused as it looks made to fill the memory"))
}

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

impl Image {
    /// Makes RGBA into RGB if it is opaque all over, as many exporters write (pbrt-v4 does so with its textures).
    pub fn drop_opaque_alpha(&mut self) {
        if self.channels == 4 && self.pixels.iter().skip(3).step_by(4).all(|&alpha| alpha == 1.0) {
            self.pixels = self.pixels.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
            self.channels = 3;
        }
    }
}

/// Why an image could not be read.
#[derive(Debug, thiserror::Error)]
#[error("image {path}: {reason}")]
pub struct ImageError {
    /// The file.
    pub path: PathBuf,
    /// In words.
    pub reason: String,
}

impl ImageError {
    fn new(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string() }
    }
}

/// Reads PNG, JPEG, TGA, Radiance HDR, PFM or OpenEXR, by content. Grey with alpha becomes RGBA; alpha is never decoded.
/// Of an OpenEXR file it takes `R G B (A)`, or `Y`, or the only channel there is.
pub fn read_image(path: &Path, encoding: Encoding) -> Result<Image, ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    let bytes = read_regular(path, MAX_BYTES).map_err(|e| fail(&e))?;
    read_image_bytes(path, bytes, encoding)
}

/// [`read_image`] of a file that is already in memory; `path` is for messages and for telling TGA.
pub fn read_image_bytes(path: &Path, bytes: Vec<u8>, encoding: Encoding) -> Result<Image, ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    let (mut image, stored) = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        (from_exr(path, &bytes)?, Stored::Floats)
    } else if bytes.starts_with(b"PF") || bytes.starts_with(b"Pf") {
        (super::pfm::read_pfm(&bytes).map_err(|reason| fail(&reason))?, Stored::Floats)
    } else {
        decode(path, bytes)?
    };
    let encoding = match encoding {
        Encoding::Auto if stored == Stored::Floats => Encoding::Linear,
        encoding => encoding,
    };
    if encoding != Encoding::Linear {
        // Of bytes there are 256.
        let table: [f32; 256] = std::array::from_fn(|byte| encoding.to_linear(from_byte(byte as u8)));
        let channels = image.channels;
        for (i, value) in image.pixels.iter_mut().enumerate() {
            if channels < 4 || i % 4 != 3 {
                *value = match stored {
                    Stored::Bytes => table[usize::from(to_byte(*value))],
                    _ => encoding.to_linear(*value),
                };
            }
        }
    }
    Ok(image)
}

fn from_exr(path: &Path, bytes: &[u8]) -> Result<Image, ImageError> {
    let file = super::exr::read_exr_bytes(path, bytes)?;
    let names: &[&str] = if file.rgb("").is_some() {
        if file.channel("A").is_some() { &["R", "G", "B", "A"] } else { &["R", "G", "B"] }
    } else if file.channel("Y").is_some() {
        &["Y"]
    } else if let [(only, _)] = file.channels.as_slice() {
        &[only.as_str()]
    } else {
        let found: Vec<&str> = file.channels.iter().map(|(name, _)| name.as_str()).collect();
        return Err(ImageError::new(path, format!("no channels R, G, B or Y among {}", found.join(", "))));
    };
    let planes: Vec<&[f32]> = names.iter().filter_map(|name| file.channel(name)).collect();
    let pixels = (0..file.bounds.area()).flat_map(|i| planes.iter().map(move |plane| plane[i])).collect();
    let (width, height) = (file.bounds.width() as usize, file.bounds.height() as usize);
    Ok(Image { width, height, channels: planes.len(), pixels })
}

/// What a file's values are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stored {
    Bytes,
    Words,
    Floats,
}

/// A byte as a value in 0..=1.
fn from_byte(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

/// Everything that the crate `image` reads; also says what the file held.
fn decode(path: &Path, bytes: Vec<u8>) -> Result<(Image, Stored), ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    if bytes.starts_with(&[0xff, 0xd8]) && is_cut_short(&bytes) {
        return Err(fail(&"the JPEG file is cut short"));
    }
    let length = bytes.len() as u64;
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fail(&e))?;
    if reader.format().is_none() {
        let is_tga = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
        if !is_tga {
            return Err(fail(&"not a PNG, JPEG, TGA, Radiance HDR, PFM or OpenEXR file"));
        }
        reader.set_format(ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    // Decoded once and turned into floats once.
    limits.max_alloc = Some(available().map_or(MAX_BYTES, |left| MAX_BYTES.min(left / 2)));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| fail(&e))?;
    let (width, height) = decoder.dimensions();
    let pixels = width as usize * height as usize;
    if pixels == 0 || pixels > MAX_PIXELS {
        return Err(fail(&format!("{width} × {height} pixels; from 1 to {MAX_PIXELS} are read")));
    }
    let channels = usize::from(decoder.color_type().channel_count());
    check_expansion(pixels * channels, length).map_err(|e| fail(&e))?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|e| fail(&e))?;
    let colour = decoded.color();
    let stored = match colour.bytes_per_pixel() / colour.channel_count() {
        1 => Stored::Bytes,
        2 => Stored::Words,
        _ => Stored::Floats,
    };
    let (channels, pixels) = match (colour.has_color(), colour.has_alpha(), decoded) {
        // The crate would go through three channels.
        (_, _, DynamicImage::ImageLuma8(grey)) => (1, grey.into_raw().into_iter().map(from_byte).collect()),
        (false, false, grey) => (1, grey.into_rgb32f().into_raw().chunks_exact(3).map(|p| p[0]).collect()),
        (true, false, colours) => (3, colours.into_rgb32f().into_raw()),
        (_, true, colours) => (4, colours.into_rgba32f().into_raw()),
    };
    Ok((Image { width: width as usize, height: height as usize, channels, pixels }, stored))
}

/// Whether a JPEG lacks its end-of-image marker after its last start-of-scan marker: the decoder would fill up with grey.
/// Compressed data cannot contain either marker by chance (ITU-T T.81, B.1.1.5).
fn is_cut_short(jpeg: &[u8]) -> bool {
    let last = |marker: u8| jpeg.windows(2).rposition(|pair| pair == [0xff, marker]);
    last(0xd9) < last(0xda).or(Some(0))
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
