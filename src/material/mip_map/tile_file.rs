//! A MIP map's tiles in a file, each where its number says: written once, read tile by tile.
//!
//! The file begins with [`MAGIC`], the length of a header and that header as JSON; from [`DATA`] on (or the next multiple of it) tiles follow, level by level.
//! Without a folder to keep such files in, each is a temporary one that has no name and goes with the process.

use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Read, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::cutter::Cutter;
use super::level::Level;
use super::texels::{Format, Kind, Texels};
use crate::film::image::Encoding;
use crate::system::output::write_atomically;

/// What such files begin with; the digit is the version.
const MAGIC: [u8; 8] = *b"LFTILES1";

/// Data begins at a multiple of this.
const DATA: u64 = 4096;

/// No header is longer.
const LONGEST_HEADER: u32 = 1 << 20;

/// What a file's texels are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    /// Of which image, in which state and encoding.
    source: String,
    width: usize,
    height: usize,
    channels: usize,
    kind: Kind,
    /// As this machine orders bytes.
    little_endian: bool,
}

/// An open file of tiles.
#[derive(Debug)]
pub struct TileFile {
    file: File,
    format: Format,
    /// Where each level begins.
    starts: Box<[u64]>,
}

/// A file of tiles that is there, or is to be made.
pub struct Place<'a> {
    /// Where such files are kept, if they are.
    pub folder: Option<&'a Path>,
    /// The image.
    pub image: &'a Path,
    /// How its bytes are encoded, as far as stated.
    pub encoding: Encoding,
    /// Its levels.
    pub levels: &'a [Level],
}

impl Place<'_> {
    /// What tells this image, as it is now, from all others.
    fn source(&self) -> io::Result<String> {
        let path = self.image.canonicalize()?;
        let metadata = path.metadata()?;
        let changed = metadata.modified()?.duration_since(std::time::UNIX_EPOCH).map_err(io::Error::other)?;
        Ok(format!("{} {} {} {:?}", path.display(), metadata.len(), changed.as_nanos(), self.encoding))
    }

    /// The name of its file within a folder. Two images may come to one by chance: the header tells them apart, and they take turns.
    fn name(&self, folder: &Path, source: &str) -> PathBuf {
        let mut hasher = DefaultHasher::new();
        source.hash(&mut hasher);
        folder.join(format!("{:016x}.tiles", hasher.finish()))
    }

    /// The file, if it was kept from another time and is sound.
    pub fn kept(&self) -> Option<TileFile> {
        let source = self.source().ok()?;
        let mut file = File::open(self.name(self.folder?, &source)).ok()?;
        let mut start = [0; 12];
        file.read_exact(&mut start).ok()?;
        let (magic, length) = start.split_at(8);
        let length = u32::from_le_bytes(length.try_into().ok()?);
        if magic != MAGIC || length > LONGEST_HEADER {
            return None;
        }
        let mut text = vec![0; length as usize];
        file.read_exact(&mut text).ok()?;
        let header: Header = serde_json::from_slice(&text).ok()?;
        let Header { channels, kind, .. } = header;
        if !matches!(channels, 1 | 3 | 4) || header != self.header(source, channels, kind) {
            return None;
        }
        let format = Format::new(channels, kind, self.encoding_of(kind));
        let starts = self.starts(text.len(), &format);
        let sound = file.metadata().ok()?.len() == *starts.last()?;
        sound.then_some(TileFile { file, format, starts })
    }

    /// Bytes are stored encoded, everything else is linear.
    fn encoding_of(&self, kind: Kind) -> Encoding {
        if kind == Kind::Bytes { self.encoding } else { Encoding::Linear }
    }

    fn header(&self, source: String, channels: usize, kind: Kind) -> Header {
        let Level { width, height, .. } = self.levels[0];
        Header { source, width, height, channels, kind, little_endian: cfg!(target_endian = "little") }
    }

    /// Where each level begins, and where the last one ends.
    fn starts(&self, header: usize, format: &Format) -> Box<[u64]> {
        let mut start = (12 + header as u64).next_multiple_of(DATA);
        let first = start;
        let ends = self.levels.iter().map(|level| {
            start += (level.texels() * format.texel_bytes()) as u64;
            start
        });
        std::iter::once(first).chain(ends).collect()
    }

    /// Writes all levels of an image, whose rows `rows` hands over from the top.
    ///
    /// # Errors
    /// What the system says: a full disk, a folder that may not be written to; and what `rows` says.
    pub fn make<E: From<io::Error>>(
        &self,
        format: Format,
        rows: impl FnOnce(&mut Cutter) -> Result<(), E>,
    ) -> Result<TileFile, E> {
        let source = self.source()?;
        let header = self.header(source.clone(), format.channels, format.kind);
        let header = serde_json::to_vec(&header).map_err(io::Error::other)?;
        let starts = self.starts(header.len(), &format);
        let file = match self.folder {
            None => {
                let mut file = tempfile::tempfile()?;
                write_header(&mut file, &header)?;
                rows(&mut Cutter::new(&file, self.levels, &starts, &format))?;
                file
            }
            Some(folder) => {
                std::fs::create_dir_all(folder)?;
                let path = self.name(folder, &source);
                let mut failed = None;
                let write = |file: &mut tempfile::NamedTempFile| {
                    write_header(file.as_file_mut(), &header).map_err(|error| error.to_string())?;
                    rows(&mut Cutter::new(file.as_file(), self.levels, &starts, &format)).map_err(|error| {
                        failed = Some(error);
                        String::new()
                    })
                };
                match (write_atomically(&path, write), failed) {
                    (Err(_), Some(error)) => return Err(error),
                    (Err(error), None) => return Err(io::Error::other(error).into()),
                    (Ok(()), _) => File::open(path)?,
                }
            }
        };
        Ok(TileFile { file, format, starts })
    }
}

/// Writes what comes before the tiles.
fn write_header(file: &mut File, header: &[u8]) -> io::Result<()> {
    file.write_all(&[&MAGIC, &(header.len() as u32).to_le_bytes()[..], header].concat())
}

impl TileFile {
    /// How its texels are read.
    pub fn format(&self) -> &Format {
        &self.format
    }

    /// Reads a tile of the level `number`, which is `level`.
    ///
    /// # Errors
    /// What the system says.
    pub fn read(&self, number: usize, level: &Level, tile: usize) -> io::Result<Texels> {
        let mut texels = Texels::zeroed(self.format.kind, level.tile_texels() * self.format.channels);
        let bytes = texels.as_bytes_mut();
        self.file.read_exact_at(bytes, self.starts[number] + (tile * bytes.len()) as u64)?;
        if self.format.kind != Kind::Bytes {
            texels.mend();
        }
        Ok(texels)
    }
}
