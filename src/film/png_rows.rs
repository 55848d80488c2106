//! PNG files read row by row, for images that are too large to be held as a whole: what [`super::stored_image`] reads at once, to the last bit.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageBuffer};
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::image::ImageError;
use super::stored_image::{StoredImage, of_decoded};
use crate::system::input::open_regular;

/// What reading takes besides rows: what is unpacked a piece at a time.
const BESIDES: usize = 1 << 20;

/// What the decoder may take for what is said of an image besides its pixels; files that mean no harm come nowhere near.
const MOST_SAID: usize = 16 << 20;

/// An open file.
pub struct PngRows {
    path: PathBuf,
    reader: png::Reader<BufReader<File>>,
    row: Vec<u8>,
    /// Rows still to come.
    left: usize,
    /// As stored: 1 (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGBA).
    stored: usize,
    /// Whether values have two bytes.
    is_wide: bool,
}

impl PngRows {
    /// Bytes that reading rows of an image so wide takes.
    pub fn bytes(width: usize) -> u64 {
        // Rows of four values, of two bytes as read, with the one before, and of four as given.
        (BESIDES + 64 * width) as u64
    }

    /// Opens a PNG file of `width` × `height` pixels whose rows come one after the other; `None` for all other files.
    pub fn open(path: &Path, [width, height]: [usize; 2]) -> Option<Self> {
        let (file, _) = open_regular(path).ok()?;
        let limits = Limits { bytes: MOST_SAID + Self::bytes(width) as usize };
        let mut decoder = Decoder::new_with_limits(BufReader::with_capacity(1 << 16, file), limits);
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        decoder.set_transformations(Transformations::EXPAND);
        let reader = decoder.read_info().ok()?;
        let info = reader.info();
        if info.interlaced || [info.width as usize, info.height as usize] != [width, height] {
            return None;
        }
        let (colour, depth) = reader.output_color_type();
        let stored = match colour {
            ColorType::Grayscale => 1,
            ColorType::GrayscaleAlpha => 2,
            ColorType::Rgb => 3,
            ColorType::Rgba => 4,
            ColorType::Indexed => return None,
        };
        let is_wide = match depth {
            BitDepth::Eight => false,
            BitDepth::Sixteen => true,
            _ => return None,
        };
        let row = vec![0; reader.output_line_size(info.width)?];
        Some(Self { path: path.to_owned(), reader, row, left: height, stored, is_wide })
    }

    /// 1 (grey), 3 (RGB) or 4 (RGBA), as [`Self::next_row`] gives them.
    pub fn channels(&self) -> usize {
        if self.stored == 2 { 4 } else { self.stored }
    }

    /// Whether rows hold bytes and no alpha, so that none of them tells how another is to be held.
    pub fn is_plain(&self) -> bool {
        !self.is_wide && self.stored % 2 == 1
    }

    /// The next row, as an image of height 1.
    ///
    /// # Errors
    /// A file that is damaged or cut short; rows beyond the last.
    pub fn next_row(&mut self) -> Result<StoredImage, ImageError> {
        let Self { path, reader, row, left, stored, is_wide } = self;
        let is_there = reader.read_row(row).map_err(|error| ImageError::new(path, error))?.is_some();
        if !is_there {
            return Err(ImageError::new(path, "it has fewer rows than its header says"));
        }
        *left = left.saturating_sub(1);
        if *left == 0 {
            // What still comes must be sound too.
            reader.read_row(row).map_err(|error| ImageError::new(path, error)).map(drop)?;
        }
        let width = reader.info().width;
        let wide = || row.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect::<Vec<u16>>();
        let decoded = match (*stored, *is_wide) {
            (1, false) => ImageBuffer::from_raw(width, 1, row.clone()).map(DynamicImage::ImageLuma8),
            (2, false) => ImageBuffer::from_raw(width, 1, row.clone()).map(DynamicImage::ImageLumaA8),
            (3, false) => ImageBuffer::from_raw(width, 1, row.clone()).map(DynamicImage::ImageRgb8),
            (_, false) => ImageBuffer::from_raw(width, 1, row.clone()).map(DynamicImage::ImageRgba8),
            (1, true) => ImageBuffer::from_raw(width, 1, wide()).map(DynamicImage::ImageLuma16),
            (2, true) => ImageBuffer::from_raw(width, 1, wide()).map(DynamicImage::ImageLumaA16),
            (3, true) => ImageBuffer::from_raw(width, 1, wide()).map(DynamicImage::ImageRgb16),
            (_, true) => ImageBuffer::from_raw(width, 1, wide()).map(DynamicImage::ImageRgba16),
        };
        // The crate's own way from there on: its rounding is not everywhere that of a division.
        decoded.map(of_decoded).ok_or_else(|| ImageError::new(path, "its rows are of another length"))
    }
}
