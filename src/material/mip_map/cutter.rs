//! An image cut into the tiles of all its levels while its rows arrive, from the top: of each level no more is held than the rows of one row of tiles.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use super::level::{Halving, Level, TILE};
use super::texels::{Format, Texels};

/// Rows that a level holds at once: those of its tiles, and those before that the next level still waits with.
const BAND: usize = TILE + 4;

/// Writes tiles to a file, each level's from its start on.
pub struct Cutter<'a> {
    file: &'a File,
    format: &'a Format,
    stages: Vec<Stage>,
}

/// A level in the making.
struct Stage {
    level: Level,
    /// Where its tiles begin in the file.
    start: u64,
    /// How the next level is made of it.
    halving: Option<Halving>,
    /// Rows of it, the first of them number `first`.
    band: Texels,
    first: usize,
    held: usize,
    /// Rows of the next level that are made.
    made: usize,
    /// The latest of them.
    row: Texels,
    /// A row of tiles.
    tiles: Vec<u8>,
}

impl<'a> Cutter<'a> {
    /// Bytes that cutting an image of `levels` takes, whose texels take `texel_bytes`.
    pub fn bytes(levels: &[Level], texel_bytes: usize) -> u64 {
        let rows = |level: &Level| BAND.min(level.height) + TILE + 1;
        let one = |level: &Level| (rows(level) * (level.width + TILE) * texel_bytes) as u64;
        levels.iter().map(one).sum()
    }

    /// For an image of `levels`, whose tiles begin at `starts` in `file`.
    pub fn new(file: &'a File, levels: &[Level], starts: &[u64], format: &'a Format) -> Self {
        let rows = |count: usize, width: usize| Texels::zeroed(format.kind, count * width * format.channels);
        let stages = levels.iter().zip(starts).enumerate().map(|(i, (&level, &start))| {
            let next = levels.get(i + 1);
            Stage {
                level,
                start,
                halving: next.map(|next| Halving::new(&level, next)),
                band: rows(BAND.min(level.height), level.width),
                first: 0,
                held: 0,
                made: 0,
                row: rows(1, next.map_or(0, |next| next.width)),
                tiles: vec![0; level.tiles_across() * level.tile_texels() * format.texel_bytes()],
            }
        });
        Self { file, format, stages: stages.collect() }
    }

    /// Takes the next row of the image, as its texels are in memory.
    ///
    /// # Errors
    /// What the system says: a full disk.
    pub fn push(&mut self, row: &[u8]) -> io::Result<()> {
        push(&mut self.stages, self.file, self.format, row)
    }
}

fn push(stages: &mut [Stage], file: &File, format: &Format, row: &[u8]) -> io::Result<()> {
    let Some((stage, rest)) = stages.split_first_mut() else { return Ok(()) };
    stage.take(row);
    let received = stage.first + stage.held;
    let is_full = received.is_multiple_of(TILE);
    if is_full || received == stage.level.height {
        stage.write_tiles(file, format, (received - 1) / TILE)?;
    }
    while stage.make_row(format) {
        push(rest, file, format, stage.row.as_bytes())?;
    }
    if is_full {
        stage.make_way(row.len());
    }
    Ok(())
}

impl Stage {
    fn take(&mut self, row: &[u8]) {
        let at = self.held * row.len();
        self.band.as_bytes_mut()[at..at + row.len()].copy_from_slice(row);
        self.held += 1;
    }

    fn write_tiles(&mut self, file: &File, format: &Format, number: usize) -> io::Result<()> {
        let (level, across) = (&self.level, self.level.tiles_across());
        let size = level.tile_texels() * format.texel_bytes();
        for (x, tile) in self.tiles.chunks_exact_mut(size).enumerate() {
            level.cut(&self.band, self.first, number * across + x, format, tile);
        }
        file.write_all_at(&self.tiles, self.start + (number * across * size) as u64)
    }

    /// Makes the next row of the next level, if all of what it covers is there.
    fn make_row(&mut self, format: &Format) -> bool {
        let Some(halving) = &self.halving else { return false };
        let is_there = halving.rows(self.made).is_some_and(|rows| rows.end <= self.first + self.held);
        if is_there {
            halving.row(&self.band, self.first, self.made, format, &mut self.row, 0);
            self.made += 1;
        }
        is_there
    }

    /// Lets rows go that nobody needs any more; a row takes so many bytes.
    fn make_way(&mut self, row: usize) {
        let needed = self.halving.as_ref().and_then(|halving| halving.rows(self.made)).map(|rows| rows.start);
        let end = self.first + self.held;
        let first = needed.map_or(end, |needed| needed.min(end));
        self.band.as_bytes_mut().copy_within((first - self.first) * row..self.held * row, 0);
        (self.first, self.held) = (first, end - first);
    }
}
