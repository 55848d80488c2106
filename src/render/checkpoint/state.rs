//! What a checkpoint holds.

use std::io::Write;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::cache_points::{Learned, LearnedRef};
use crate::film::FilmTile;
use crate::integrator::Counters;
use crate::render::mixing::Mixing;
use crate::render::splitting::Splitting;
use crate::render::stats::Iteration;

/// A pass that is not over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenPass {
    /// Its samples: the first, and one past the last.
    pub samples: [u32; 2],
    /// Whether what earlier passes found has a say in its paths.
    pub learns: bool,
    /// The first sample of the step of it that is not over.
    pub step: u32,
    /// Which tiles are done with that.
    pub ended: Vec<bool>,
    /// What was done in them.
    pub counters: Counters,
    /// Of the mixing as the pass began: the share of regions that draw points, and how many.
    pub points: [f64; 2],
    /// Of the splitting as the pass began: the mean number of rays.
    pub view_rays: f64,
}

/// All that a render has come to, as it is read.
#[derive(Deserialize)]
pub struct Kept {
    /// The pixels.
    pub tiles: Vec<FilmTile>,
    /// Everything else.
    pub rest: Rest,
}

/// What there is besides pixels.
#[derive(Deserialize)]
pub struct Rest {
    /// How scattering points are drawn.
    pub mixing: Mixing,
    /// How camera rays are split.
    pub splitting: Option<Splitting>,
    /// What cache points know.
    pub learned: Option<Learned>,
    /// What was done in the passes that are over.
    pub counters: Counters,
    /// And in each of them.
    pub iterations: Vec<Iteration>,
    /// Samples a pixel of the passes that are over.
    pub done: u32,
    /// The pass that is not.
    pub pass: Option<OpenPass>,
    /// Seconds of rendering.
    pub seconds: f64,
}

/// [`Kept`], where it is.
#[derive(Serialize)]
pub struct KeptRef<'a> {
    pub tiles: &'a [FilmTile],
    pub rest: RestRef<'a>,
}

/// [`Rest`], where it is.
#[derive(Serialize)]
pub struct RestRef<'a> {
    pub mixing: &'a Mixing,
    pub splitting: &'a Option<Splitting>,
    pub learned: Option<LearnedRef<'a>>,
    pub counters: Counters,
    pub iterations: &'a [Iteration],
    pub done: u32,
    pub pass: Option<&'a OpenPass>,
    pub seconds: f64,
}

/// Tiles that one task copies: some megabytes.
const TILES: usize = 128;

/// Memory that one task has cleared, in bytes.
const PIECE: usize = 1 << 23;
/// The least that the system clears at a time.
const PAGE: usize = 4096;

impl KeptRef<'_> {
    /// A copy, as bytes in pieces: those of [`KeptRef::write_to`]. The render waits for it, so that all threads copy. The pieces of the copy before are used again where they are
    /// given: the system need not clear memory for them, which takes as long as copying.
    ///
    /// # Errors
    /// In words; too little memory among them.
    pub fn to_pieces(&self, mut before: Vec<Vec<u8>>) -> Result<Vec<Vec<u8>>, String> {
        before.resize_with(2 + self.tiles.len().div_ceil(TILES), Vec::new);
        let [length, tiles @ .., rest] = &mut before[..] else {
            return Err("there are at least two pieces".to_owned());
        };
        // A list is its length, then one element after the other.
        copy(length, |out| one(&self.tiles.len(), out))?;
        let copy_tiles = || {
            let pieces = tiles.par_iter_mut().zip(self.tiles.par_chunks(TILES));
            pieces.try_for_each(|(piece, tiles)| copy(piece, |out| each(tiles, out)))
        };
        let (tiles_done, rest_done) = rayon::join(copy_tiles, || copy(rest, |out| one(&self.rest, out)));
        tiles_done.and(rest_done)?;
        Ok(before)
    }

    /// How many they are.
    ///
    /// # Errors
    /// In words.
    pub fn length(&self) -> Result<u64, String> {
        length(|out| one(self, out))
    }

    /// The same bytes, to where they go.
    ///
    /// # Errors
    /// What that says.
    pub fn write_to(&self, out: &mut dyn Write) -> Result<(), String> {
        one(self, out)
    }
}

fn one(value: &impl Serialize, out: &mut dyn Write) -> Result<(), String> {
    postcard::to_io(value, out).map(drop).map_err(|error| error.to_string())
}

fn each(list: &[impl Serialize], out: &mut dyn Write) -> Result<(), String> {
    list.iter().try_for_each(|value| one(value, out))
}

fn length(write: impl Fn(&mut dyn Write) -> Result<(), String>) -> Result<u64, String> {
    let mut count = Count(0);
    write(&mut count).map(|()| count.0)
}

/// Copies what `write` writes to `bytes`, whose memory grows at once where it must: a list that doubles as it grows would be copied several times.
fn copy(bytes: &mut Vec<u8>, write: impl Fn(&mut dyn Write) -> Result<(), String>) -> Result<(), String> {
    let before = bytes.capacity();
    bytes.clear();
    let length = usize::try_from(length(&write)?).map_err(|error| error.to_string())?;
    bytes.try_reserve_exact(length).map_err(|error| error.to_string())?;
    // New memory is found and cleared by the system when it is first written to: here by all threads.
    if bytes.capacity() > before && length > PIECE {
        bytes.spare_capacity_mut().par_chunks_mut(PIECE).for_each(|piece| {
            piece.iter_mut().step_by(PAGE).for_each(|byte| {
                byte.write(0);
            });
        });
    }
    write(bytes)
}

/// Counts what is written to it.
struct Count(u64);

impl Write for Count {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Kept {
    /// From bytes.
    ///
    /// # Errors
    /// In words.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        postcard::from_bytes(bytes).map_err(|error| error.to_string())
    }
}
