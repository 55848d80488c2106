//! What a checkpoint holds.

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

/// The same, where it is.
#[derive(Serialize)]
pub struct KeptRef<'a> {
    pub tiles: &'a [FilmTile],
    pub mixing: &'a Mixing,
    pub splitting: &'a Option<Splitting>,
    pub learned: Option<LearnedRef<'a>>,
    pub counters: Counters,
    pub iterations: &'a [Iteration],
    pub done: u32,
    pub pass: Option<&'a OpenPass>,
    pub seconds: f64,
}

impl KeptRef<'_> {
    /// As bytes.
    ///
    /// # Errors
    /// In words; too little memory among them.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        // All at once: a list that doubles as it grows would be copied several times, and the render waits for it.
        let mut bytes = vec![];
        let length = usize::try_from(self.length()?).map_err(|error| error.to_string())?;
        bytes.try_reserve_exact(length).map_err(|error| error.to_string())?;
        self.write_to(&mut bytes)?;
        Ok(bytes)
    }

    /// How many they are.
    ///
    /// # Errors
    /// In words.
    pub fn length(&self) -> Result<u64, String> {
        let mut count = Count(0);
        self.write_to(&mut count).map(|()| count.0)
    }

    /// The same bytes, to where they go.
    ///
    /// # Errors
    /// What that says.
    pub fn write_to(&self, out: &mut dyn std::io::Write) -> Result<(), String> {
        postcard::to_io(self, out).map(drop).map_err(|error| error.to_string())
    }
}

/// Counts what is written to it.
struct Count(u64);

impl std::io::Write for Count {
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
