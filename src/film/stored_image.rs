//! Image files as they are stored: bytes stay bytes, until somebody wants light.
//!
//! Formats are told by content: PNG, JPEG, TGA, BMP, QOI, GIF, PNM and Radiance HDR through the crate `image`, OpenEXR through [`super::exr`],
//! PFM by [`super::pfm`]. TGA has no signature, so what nothing else claims is tried as TGA if it is named so.

use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

use exr::meta::MetaData;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::image::{Encoding, Image, ImageError, MAX_PIXELS};
use crate::math::spectrum::ToRec709;
use crate::system::input::{open_regular, read_regular};
use crate::system::memory::available;

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

/// What tells OpenEXR files.
const EXR: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// The values of an image as its file has them.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 255 stands for 1.
    Bytes(Vec<u8>),
    /// Of files of 16-bit integers (65535 stands for 1) and of floats.
    Floats(Vec<f32>),
}

/// An image as its file has it, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredImage {
    /// Width in pixels, at least 1.
    pub width: usize,
    /// Height in pixels, at least 1.
    pub height: usize,
    /// 1 (grey), 3 (RGB) or 4 (RGBA).
    pub channels: usize,
    /// `width × height × channels` values.
    pub values: Values,
    /// Whether the file holds floats.
    pub is_float: bool,
}

impl StoredImage {
    /// The encoding of this file's values, where `stated` may leave that to the file.
    pub fn encoding(&self, stated: Encoding) -> Encoding {
        match stated {
            Encoding::Auto if self.is_float => Encoding::Linear,
            Encoding::Auto => Encoding::Srgb,
            encoding => encoding,
        }
    }

    /// In linear floats. Alpha is never decoded.
    pub fn decoded(self, stated: Encoding) -> Image {
        let encoding = self.encoding(stated);
        let Self { width, height, channels, values, .. } = self;
        let pixels = match values {
            Values::Bytes(bytes) => {
                // Of bytes there are 256.
                let table: [f32; 256] = std::array::from_fn(|byte| encoding.to_linear(from_byte(byte as u8)));
                let is_alpha = |place: usize| channels == 4 && place % 4 == 3;
                let linear = |(place, byte): (usize, u8)| {
                    if is_alpha(place) { from_byte(byte) } else { table[usize::from(byte)] }
                };
                bytes.into_iter().enumerate().map(linear).collect()
            }
            Values::Floats(mut floats) => {
                decode(&mut floats, channels, encoding);
                floats
            }
        };
        Image { width, height, channels, pixels }
    }

    /// Whether it is RGBA, and opaque all over.
    pub fn is_opaque(&self) -> bool {
        self.channels == 4
            && match &self.values {
                Values::Bytes(bytes) => bytes.iter().skip(3).step_by(4).all(|&alpha| alpha == u8::MAX),
                Values::Floats(floats) => floats.iter().skip(3).step_by(4).all(|&alpha| alpha == 1.0),
            }
    }

    /// Makes RGBA into RGB if it is opaque all over, as many exporters write (pbrt-v4 does so with its textures).
    pub fn drop_opaque_alpha(&mut self) {
        fn without<T: Copy>(values: &[T]) -> Vec<T> {
            values.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect()
        }
        if self.is_opaque() {
            self.values = match &self.values {
                Values::Bytes(bytes) => Values::Bytes(without(bytes)),
                Values::Floats(floats) => Values::Floats(without(floats)),
            };
            self.channels = 3;
        }
    }
}

/// What a byte stands for.
#[inline]
pub fn from_byte(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

/// Makes stored values linear; alpha, which is the fourth of four channels, stays.
pub fn decode(values: &mut [f32], channels: usize, encoding: Encoding) {
    if encoding == Encoding::Linear {
        return;
    }
    for (i, value) in values.iter_mut().enumerate() {
        if channels < 4 || i % 4 != 3 {
            *value = encoding.to_linear(*value);
        }
    }
}

/// What the beginning of an image file says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageHeader {
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// Bytes that a pixel takes in memory, at most.
    pub pixel_bytes: usize,
    /// Whether it has no colours.
    pub is_grey: bool,
    /// From its primaries (OpenEXR's `chromaticities`) to Rec. 709.
    pub to_rec709: ToRec709,
}

impl ImageHeader {
    /// What is to be said of the file `path`, where its primaries are no good.
    pub fn warning(&self, path: &Path) -> Option<String> {
        let what = "its \"chromaticities\" make no space of colours: its colours are taken to be in Rec. 709";
        (self.to_rec709 == ToRec709::NoSpace).then(|| format!("{}: {what}", path.display()))
    }
}

/// Reads PNG, JPEG, TGA, BMP, QOI, GIF, PNM, Radiance HDR, PFM or OpenEXR, by content. Grey with alpha becomes RGBA. Of an OpenEXR file it takes `R G B (A)`,
/// or `Y`, or the only channel there is.
pub fn read_stored(path: &Path) -> Result<StoredImage, ImageError> {
    read_stored_within(path, 0)
}

/// [`read_stored`] where so many bytes are known to be left, whatever the system says: memory that was given back may still count as taken.
pub fn read_stored_within(path: &Path, room: u64) -> Result<StoredImage, ImageError> {
    let bytes = read_regular(path, MAX_BYTES).map_err(|e| ImageError::new(path, e))?;
    from_bytes(path, bytes, room)
}

/// [`read_stored`] of a file that is already in memory; `path` is for messages and for telling TGA.
pub fn read_stored_bytes(path: &Path, bytes: Vec<u8>) -> Result<StoredImage, ImageError> {
    from_bytes(path, bytes, 0)
}

fn from_bytes(path: &Path, bytes: Vec<u8>, room: u64) -> Result<StoredImage, ImageError> {
    if bytes.starts_with(&EXR) {
        from_exr(path, &bytes)
    } else if is_pfm(&bytes) {
        let Image { width, height, channels, pixels } =
            super::pfm::read_pfm(&bytes).map_err(|reason| ImageError::new(path, reason))?;
        Ok(StoredImage { width, height, channels, values: Values::Floats(pixels), is_float: true })
    } else {
        from_others(path, bytes, room)
    }
}

/// Reads only as much of a file as tells its size, and refuses what [`read_stored`] surely refuses.
pub fn read_header(path: &Path) -> Result<ImageHeader, ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    let (file, length) = open_regular(path).map_err(|e| fail(&e))?;
    if length > MAX_BYTES {
        return Err(fail(&format!("it holds more than {MAX_BYTES} bytes")));
    }
    let mut source = BufReader::new(file);
    let start = source.fill_buf().map_err(|e| fail(&e))?;
    let mut to_rec709 = ToRec709::Same;
    let (width, height, pixel_bytes, is_grey) = if start.starts_with(&EXR) {
        let meta = MetaData::read_from_buffered(&mut source, false).map_err(|e| fail(&e))?;
        let Some(first) = meta.headers.first() else { return Err(fail(&"the file holds no image")) };
        // Four channels at most are used, of floats at most.
        let channels = &first.channels.list;
        // As `from_exr` takes them.
        let is_grey = !["R", "G", "B"].iter().all(|name| channels.iter().any(|channel| channel.name.eq(name)));
        if let Some(space) = first.shared_attributes.chromaticities.filter(|_| !is_grey) {
            let [red, green, blue, white] =
                [space.red, space.green, space.blue, space.white].map(|xy| [f64::from(xy.x()), f64::from(xy.y())]);
            to_rec709 = ToRec709::from_chromaticities([red, green, blue], white);
        }
        (first.layer_size.width(), first.layer_size.height(), 4 * channels.len().min(4), is_grey)
    } else if is_pfm(start) {
        let mut head = vec![];
        source.take(128).read_to_end(&mut head).map_err(|e| fail(&e))?;
        let ([width, height], channels) = super::pfm::read_size(&head).map_err(|reason| fail(&reason))?;
        (width, height, 4 * channels, channels < 3)
    } else {
        let decoder = decoder(path, source, 0)?;
        let (width, height) = decoder.dimensions();
        let colour = decoder.color_type();
        let value_bytes = if colour.bytes_per_pixel() == colour.channel_count() { 1 } else { 4 };
        let channels = if colour.has_alpha() { 4 } else { usize::from(colour.channel_count()) };
        (width as usize, height as usize, value_bytes * channels, !colour.has_color())
    };
    check_size(path, width, height)?;
    // A value takes a byte at least.
    check_expansion(width * height * pixel_bytes.min(4), length).map_err(|e| fail(&e))?;
    Ok(ImageHeader { width, height, pixel_bytes, is_grey, to_rec709 })
}

fn is_pfm(start: &[u8]) -> bool {
    start.starts_with(b"PF") || start.starts_with(b"Pf")
}

fn check_size(path: &Path, width: usize, height: usize) -> Result<(), ImageError> {
    match width.saturating_mul(height) {
        1..=MAX_PIXELS => Ok(()),
        _ => Err(ImageError::new(path, format!("{width} × {height} pixels; from 1 to {MAX_PIXELS} are read"))),
    }
}

fn from_exr(path: &Path, bytes: &[u8]) -> Result<StoredImage, ImageError> {
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
    check_size(path, width, height)?;
    Ok(StoredImage { width, height, channels: planes.len(), values: Values::Floats(pixels), is_float: true })
}

/// Everything that the crate `image` reads.
fn from_others(path: &Path, bytes: Vec<u8>, room: u64) -> Result<StoredImage, ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    if bytes.starts_with(&[0xff, 0xd8]) && is_cut_short(&bytes) {
        return Err(fail(&"the JPEG file is cut short"));
    }
    if bytes.starts_with(b"GIF8") {
        super::gif::check_first_frame(&bytes).map_err(|e| fail(&e))?;
    }
    let length = bytes.len() as u64;
    let decoder = decoder(path, Cursor::new(bytes), room)?;
    let (width, height) = decoder.dimensions();
    check_size(path, width as usize, height as usize)?;
    let values = width as usize * height as usize * usize::from(decoder.color_type().channel_count());
    check_expansion(values, length).map_err(|e| fail(&e))?;
    Ok(of_decoded(DynamicImage::from_decoder(decoder).map_err(|e| refuse(path, &e))?))
}

/// What the crate `image` has read, as it is held here.
pub(super) fn of_decoded(decoded: DynamicImage) -> StoredImage {
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let is_float = matches!(decoded, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let colour = decoded.color();
    let (channels, values) = match decoded {
        DynamicImage::ImageLuma8(image) => (1, Values::Bytes(image.into_raw())),
        DynamicImage::ImageRgb8(image) => (3, Values::Bytes(image.into_raw())),
        DynamicImage::ImageRgba8(image) => (4, Values::Bytes(image.into_raw())),
        image @ DynamicImage::ImageLumaA8(_) => (4, Values::Bytes(image.into_rgba8().into_raw())),
        image if colour.has_alpha() => (4, Values::Floats(image.into_rgba32f().into_raw())),
        image if colour.has_color() => (3, Values::Floats(image.into_rgb32f().into_raw())),
        // Through RGB, because the crate turns colours into luminance but greys into exact greys.
        image => (1, Values::Floats(image.into_rgb32f().into_raw().chunks_exact(3).map(|p| p[0]).collect())),
    };
    StoredImage { width, height, channels, values, is_float }
}

fn refuse(path: &Path, error: &image::ImageError) -> ImageError {
    match error {
        image::ImageError::Limits(_) => ImageError::limit(path, error),
        _ => ImageError::new(path, error),
    }
}

fn decoder<'a>(
    path: &Path,
    source: impl BufRead + Seek + 'a,
    room: u64,
) -> Result<Box<dyn ImageDecoder + 'a>, ImageError> {
    let fail = |e: &dyn std::fmt::Display| ImageError::new(path, e);
    let mut reader = ImageReader::new(source).with_guessed_format().map_err(|e| fail(&e))?;
    if reader.format().is_none() {
        let is_tga = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
        if !is_tga {
            return Err(fail(&"not a PNG, JPEG, TGA, BMP, QOI, GIF, PNM, Radiance HDR, PFM or OpenEXR file"));
        }
        reader.set_format(ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    // Decoded once and turned into floats once.
    limits.max_alloc = Some(available().map_or(MAX_BYTES, |left| MAX_BYTES.min((left / 2).max(room))));
    reader.limits(limits);
    Ok(Box::new(reader.into_decoder().map_err(|e| refuse(path, &e))?))
}

/// Whether a JPEG lacks its end-of-image marker after its last start-of-scan marker: the decoder would fill up with grey.
/// Compressed data cannot contain either marker by chance (ITU-T T.81, B.1.1.5).
fn is_cut_short(jpeg: &[u8]) -> bool {
    let last = |marker: u8| jpeg.windows(2).rposition(|pair| pair == [0xff, marker]);
    last(0xd9) < last(0xda).or(Some(0))
}
