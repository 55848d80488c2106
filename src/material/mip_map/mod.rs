//! Images on surfaces as MIP maps: every level of detail, in memory where all of them fit, else tile by tile as they are looked up.
//!
//! Sources: Williams 1983, "Pyramidal Parametrics" (levels); Peachey 1990, "Texture on Demand", and Christensen et al. 2006, "Ray Tracing for the Movie 'Cars'",
//! section 5.3 (tiles read as needed and dropped again). `level.rs` cuts an image into levels and tiles, `texels.rs` holds values, `cache.rs` holds tiles,
//! `cutter.rs` and
//! `tile_file.rs` bring them to disk, `memory.rs` decides between the two.

pub mod cache;
mod cutter;
pub mod level;
pub mod memory;
#[cfg(test)]
mod tests;
pub mod texels;
mod tile_file;

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use glam::Mat3;

use crate::film::image::{Encoding, ImageError};
use crate::film::png_rows::PngRows;
use crate::film::stored_image::{ImageHeader, read_stored_within};
use crate::scene::Span;
use cache::{TileCache, TileKey};
use cutter::Cutter;
use level::Level;
use memory::{Fault, TextureMemory};
use texels::{Format, Kind, Texels};
use tile_file::{Place, TileFile};

/// An image at all levels of detail.
#[derive(Debug)]
pub struct MipMap {
    path: PathBuf,
    encoding: Encoding,
    /// Where the scene names it.
    span: Span,
    /// What happens where it cannot be read, in words.
    instead: &'static str,
    levels: Box<[Level]>,
    /// At most.
    texel_bytes: usize,
    is_grey: bool,
    to_rec709: Option<Mat3>,
    /// Tells it from all others of this process.
    number: u32,
    texels: OnceLock<Source>,
    memory: Arc<TextureMemory>,
}

/// Where the texels are.
#[derive(Debug)]
enum Source {
    /// All in memory: tile after tile of each level.
    Resident(Format, Box<[Texels]>),
    /// In a file, the tiles of late in memory.
    Tiles(TileFile),
    /// Nowhere: the file could not be read.
    Missing,
}

/// Why an image was not cut into tiles.
#[derive(Debug, thiserror::Error)]
enum CutError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ImageError),
    /// Its tiles cannot be written.
    #[error(transparent)]
    Write(#[from] std::io::Error),
}

/// A MIP map whose texels can be looked at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    map: &'a MipMap,
    source: &'a Source,
    /// 1 (grey), 3 (RGB) or 4 (RGBA).
    pub channels: usize,
}

impl MipMap {
    /// The image of a file whose header has been read; its texels are not read before somebody looks at them, or [`TextureMemory::settle`] says so.
    pub fn new(
        path: PathBuf,
        encoding: Encoding,
        span: Span,
        instead: &'static str,
        header: &ImageHeader,
        memory: &Arc<TextureMemory>,
    ) -> Self {
        static NUMBERS: AtomicU32 = AtomicU32::new(1);
        Self {
            path,
            encoding,
            span,
            instead,
            levels: Level::all(header.width, header.height).into(),
            texel_bytes: header.pixel_bytes,
            is_grey: header.is_grey,
            to_rec709: header.to_rec709.matrix(),
            number: NUMBERS.fetch_add(1, Ordering::Relaxed),
            texels: OnceLock::new(),
            memory: memory.clone(),
        }
    }

    /// An image that no file holds.
    #[cfg(test)]
    pub fn in_memory(image: crate::film::image::Image) -> Self {
        use crate::film::stored_image::{StoredImage, Values};
        let crate::film::image::Image { width, height, channels, pixels } = image;
        let header = ImageHeader {
            width,
            height,
            pixel_bytes: 4 * channels,
            is_grey: channels < 3,
            to_rec709: crate::math::spectrum::ToRec709::Same,
        };
        let span = Span { file: crate::scene::FileId(0), line: 1, column: 1, length: 1 };
        let memory = Arc::new(TextureMemory::new(Default::default(), true));
        let map = Self::new(PathBuf::new(), Encoding::Linear, span, "", &header, &memory);
        let values = Values::Floats(pixels);
        let (rows, format) =
            Texels::of(StoredImage { width, height, channels, values, is_float: true }, Encoding::Linear);
        map.texels.set(map.resident_levels(rows, format)).expect("it is new");
        map
    }

    /// From the primaries of the image to Rec. 709, where it has others.
    pub fn to_rec709(&self) -> Option<Mat3> {
        self.to_rec709
    }

    /// Width of the image.
    pub fn width(&self) -> usize {
        self.levels[0].width
    }

    /// Height of the image.
    pub fn height(&self) -> usize {
        self.levels[0].height
    }

    /// Whether it has no colours, by its header.
    pub fn is_grey(&self) -> bool {
        self.is_grey
    }

    /// Bytes of all levels, at most.
    pub fn whole(&self) -> u64 {
        self.levels.iter().map(|level| (level.texels() * self.texel_bytes) as u64).sum()
    }

    /// Bytes of its largest tile, at most.
    pub fn largest_tile(&self) -> usize {
        self.levels[0].tile_texels() * self.texel_bytes
    }

    /// Bytes that it holds for as long as it is there.
    pub fn resident(&self) -> usize {
        match self.texels.get() {
            Some(Source::Resident(_, levels)) => levels.iter().map(|level| level.as_bytes().len()).sum(),
            _ => 0,
        }
    }

    /// Reads the texels, unless that was done; `None` where they cannot be read.
    #[inline]
    pub fn view(&self) -> Option<View<'_>> {
        let source = self.texels.get().unwrap_or_else(|| self.first_view());
        let channels = match source {
            Source::Resident(format, _) => format.channels,
            Source::Tiles(file) => file.format().channels,
            Source::Missing => return None,
        };
        Some(View { map: self, source, channels })
    }

    #[cold]
    fn first_view(&self) -> &Source {
        self.texels.get_or_init(|| {
            self.read().unwrap_or_else(|fault| {
                self.memory.note(fault);
                Source::Missing
            })
        })
    }

    fn unreadable(&self, reason: String) -> Fault {
        Fault::Unreadable { path: self.path.clone(), span: self.span, reason, instead: self.instead }
    }

    fn place(&self) -> Place<'_> {
        Place { folder: self.memory.folder(), image: &self.path, encoding: self.encoding, levels: &self.levels }
    }

    /// Its rows, if its file gives them one after the other.
    fn rows(&self) -> Option<PngRows> {
        PngRows::open(&self.path, [self.width(), self.height()])
    }

    /// Bytes that cutting it into tiles takes where its rows come one after the other.
    fn bytes_in_rows(&self) -> u64 {
        PngRows::bytes(self.width()) + Cutter::bytes(&self.levels, self.texel_bytes)
    }

    /// Bytes that cutting it takes where it has to be read as a whole: the image as it was read, and as much again for what is made of it.
    fn bytes_at_once(&self) -> u64 {
        2 * self.whole()
    }

    /// Whether its tiles are not there yet, and it has to be read as a whole to make them.
    fn is_cut_at_once(&self) -> bool {
        self.place().kept().is_none() && self.rows().is_none()
    }

    fn read(&self) -> Result<Source, Fault> {
        if self.memory.cache().is_none() {
            let (rows, format) = self.read_at_once(0)?;
            return Ok(self.resident_levels(rows, format));
        }
        if let Some(kept) = self.place().kept() {
            return Ok(Source::Tiles(kept));
        }
        // Whether alpha or halves are needed, rows say only when all of them are read: small images are not read twice for that.
        let is_small = self.bytes_at_once() <= self.memory.cutting_limit();
        let takes_less = self.bytes_in_rows() < self.bytes_at_once();
        if let Some(rows) = self.rows().filter(|rows| takes_less && (!is_small || rows.is_plain())) {
            return self.cut(self.bytes_in_rows(), || self.cut_in_rows(rows));
        }
        self.cut(self.bytes_at_once(), || self.cut_at_once())
    }

    /// Lets `cut` make the tiles, once there is room for the bytes that it takes.
    fn cut(&self, bytes: u64, cut: impl FnOnce() -> Result<TileFile, Fault>) -> Result<Source, Fault> {
        let _room = self.memory.room(bytes);
        if !self.memory.has_left(bytes) {
            return Err(self.exhausted(bytes));
        }
        let made = cut()?;
        self.memory.was_cut(bytes);
        Ok(Source::Tiles(made))
    }

    fn exhausted(&self, bytes: u64) -> Fault {
        Fault::NoMemory { path: self.path.clone(), span: self.span, bytes }
    }

    /// All of the image, where so many bytes are known to be left.
    fn read_at_once(&self, room: u64) -> Result<(Texels, Format), Fault> {
        let mut image = read_stored_within(&self.path, room).map_err(|error| {
            if error.is_limit { self.exhausted(self.bytes_at_once()) } else { self.unreadable(error.reason) }
        })?;
        if (image.width, image.height) != (self.width(), self.height()) {
            return Err(self.unreadable("it has changed while it was in use".to_owned()));
        }
        image.drop_opaque_alpha();
        let (mut rows, format) = Texels::of(image, self.encoding);
        self.tell_mended(rows.mend());
        Ok((rows, format))
    }

    fn tell_mended(&self, bad: usize) {
        if bad > 0 {
            self.memory.note(Fault::NotFinite { path: self.path.clone(), span: self.span, count: bad });
        }
    }

    fn cut_at_once(&self) -> Result<TileFile, Fault> {
        let (rows, format) = self.read_at_once(self.bytes_at_once())?;
        let row = self.width() * format.texel_bytes();
        self.make(format, |cutter| rows.as_bytes().chunks_exact(row).try_for_each(|row| Ok(cutter.push(row)?)))
    }

    fn cut_in_rows(&self, mut rows: PngRows) -> Result<TileFile, Fault> {
        let unreadable = |error: ImageError| self.unreadable(error.reason);
        let (mut drops_alpha, mut kind) = (false, Kind::Bytes);
        if !rows.is_plain() {
            (drops_alpha, kind) = self.survey(rows).map_err(unreadable)?;
            let again = || self.unreadable("it has changed while it was in use".to_owned());
            rows = self.rows().ok_or_else(again)?;
        }
        let channels = rows.channels() - usize::from(drops_alpha);
        let encoding = if kind == Kind::Bytes { self.encoding } else { Encoding::Linear };
        let mut bad = 0;
        let made = self.make(Format::new(channels, kind, encoding), |cutter| {
            for _ in 0..self.height() {
                let mut row = rows.next_row()?;
                if drops_alpha {
                    row.drop_opaque_alpha();
                }
                if row.channels != channels {
                    return Err(ImageError::new(&self.path, "it has changed while it was in use").into());
                }
                let mut row = Texels::in_kind(row, self.encoding, Some(kind));
                bad += row.mend();
                cutter.push(row.as_bytes())?;
            }
            Ok(())
        });
        self.tell_mended(bad);
        made
    }

    /// Whether all rows are opaque, and how all of them can be held.
    fn survey(&self, mut rows: PngRows) -> Result<(bool, Kind), ImageError> {
        let (mut is_opaque, mut kind) = (true, Kind::Bytes);
        for _ in 0..self.height() {
            let row = rows.next_row()?;
            is_opaque &= row.is_opaque();
            // Texels of the alpha that goes count too: it is 1.
            kind = match (kind, Texels::in_kind(row, self.encoding, None)) {
                (_, Texels::Floats(_)) => Kind::Floats,
                (Kind::Floats, _) => Kind::Floats,
                (_, Texels::Halves(_)) => Kind::Halves,
                (kind, Texels::Bytes(_)) => kind,
            };
        }
        Ok((is_opaque, kind))
    }

    /// The file of tiles of rows that `rows` hands over.
    fn make(&self, format: Format, rows: impl FnOnce(&mut Cutter) -> Result<(), CutError>) -> Result<TileFile, Fault> {
        self.place().make(format, rows).map_err(|error| match error {
            CutError::Read(error) => self.unreadable(error.reason),
            CutError::Write(error) => Fault::NoRoom {
                path: self.path.clone(),
                folder: self.memory.folder().map_or_else(std::env::temp_dir, PathBuf::from),
                reason: error.to_string(),
            },
        })
    }

    /// All levels in memory, from the image in rows.
    fn resident_levels(&self, mut rows: Texels, format: Format) -> Source {
        let mut levels = Vec::with_capacity(self.levels.len());
        for (i, level) in self.levels.iter().enumerate() {
            let tile_bytes = level.tile_texels() * format.texel_bytes();
            let mut tiles = Texels::zeroed(format.kind, level.texels() * format.channels);
            for (number, tile) in tiles.as_bytes_mut().chunks_exact_mut(tile_bytes).enumerate() {
                level.cut(&rows, 0, number, &format, tile);
            }
            levels.push(tiles);
            if let Some(next) = self.levels.get(i + 1) {
                rows = level.halved(&rows, next, &format);
            }
        }
        Source::Resident(format, levels.into())
    }
}

impl View<'_> {
    /// All levels, the image itself first.
    #[inline]
    pub fn levels(&self) -> &[Level] {
        &self.map.levels
    }

    /// The linear values of a texel of the level `number`, row 0 on top; 0 for channels that there are not.
    #[inline]
    pub fn texel(&self, number: usize, x: usize, y: usize) -> [f32; 4] {
        let level = &self.map.levels[number];
        let (tile, at) = level.place(x, y);
        match self.source {
            Source::Resident(format, levels) => levels[number].get(tile * level.tile_texels() + at, format),
            Source::Tiles(file) => self.cached(file, number, level, tile, at),
            Source::Missing => [0.0; 4],
        }
    }

    #[inline(never)]
    fn cached(&self, file: &TileFile, number: usize, level: &Level, tile: usize, at: usize) -> [f32; 4] {
        let key = TileKey { map: self.map.number, tile: (level.first_tile + tile) as u32 };
        let read = || file.read(number, level, tile);
        let cache: Option<&TileCache> = self.map.memory.cache();
        let found = cache.map(|cache| cache.with(key, read, |texels| texels.get(at, file.format())));
        match found {
            Some(Ok(values)) => values,
            Some(Err(error)) => {
                self.map.memory.note(self.map.unreadable(error.to_string()));
                [0.0; 4]
            }
            // Texels are in a file only where there is a cache.
            None => [0.0; 4],
        }
    }
}
