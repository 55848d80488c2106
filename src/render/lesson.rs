//! What a render has learned, in a file for other renders of the scene: cache points with what they know of lights and what hides them, how scattering points are drawn, how
//! camera rays are split.
//!
//! Whoever begins with it is unbiased only if it takes other samples than those that taught: what is learned from a bright sample, and then weighs that sample, is bias. So
//! the file says which samples those were.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::mixing::Mixing;
use super::splitting::Splitting;
use super::state_file::{self, Fault, Magic, Times};
use crate::cache_points::kept::{KeptPoints, KeptPointsRef};
use crate::system::output::OutputError;

/// What such files begin with; the digit is the version.
const MAGIC: Magic = *b"LFLEARN3";

/// Samples, by number, of a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Taken {
    /// Of the random numbers.
    pub seed: u32,
    /// The first one.
    pub first: u32,
    /// One past the last.
    pub end: u32,
}

impl Taken {
    /// Whether there are samples that are of both.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.seed == other.seed && self.first < other.end && other.first < self.end
    }
}

/// The number of the first sample of `seed` that is not among `taken`.
pub fn first_untaken(taken: &[Taken], seed: u32) -> u32 {
    let mut own: Vec<&Taken> = taken.iter().filter(|taken| taken.seed == seed).collect();
    own.sort_by_key(|taken| taken.first);
    own.iter().fold(0, |end, taken| if taken.first <= end { end.max(taken.end) } else { end })
}

impl std::fmt::Display for Taken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "samples {}..{} of seed {}", self.first, self.end, self.seed)
    }
}

/// Why what was learned cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LessonError {
    /// The file cannot be read, or is damaged.
    #[error("cannot use what was learned, {path}: {reason}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// In words.
        reason: String,
    },
    /// It was learned in another scene.
    #[error("cannot use what was learned, {path}: {what} is not the same")]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// The same samples would be weighed by what they taught.
    #[error(
        "{path} was learned from {taken}, which this render takes too: that would bias the image; take others by --part, --samples or --seed"
    )]
    Overlap {
        /// The file.
        path: PathBuf,
        /// Which.
        taken: Taken,
    },
}

/// All that was learned, as it is read.
#[derive(Deserialize)]
pub struct Lesson {
    /// What lights are chosen by, where cache points choose.
    pub points: Option<KeptPoints>,
    /// How scattering points are drawn.
    pub mixing: Mixing,
    /// How camera rays are split.
    pub splitting: Option<Splitting>,
    /// What taught it.
    pub taken: Vec<Taken>,
    /// Whether those are samples of the frame that its parts leave to it ([`super::Share::Lesson`]).
    pub is_of_frame: bool,
}

/// The same, where it is.
#[derive(Serialize)]
pub struct LessonRef<'a> {
    /// See [`Lesson::points`].
    pub points: Option<KeptPointsRef<'a>>,
    /// See [`Lesson::mixing`].
    pub mixing: &'a Mixing,
    /// See [`Lesson::splitting`].
    pub splitting: &'a Option<Splitting>,
    /// See [`Lesson::taken`].
    pub taken: &'a [Taken],
    /// See [`Lesson::is_of_frame`].
    pub is_of_frame: bool,
}

impl LessonRef<'_> {
    /// Writes it to a file.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, path: &Path, identity: &Identity) -> Result<(), OutputError> {
        let bytes = postcard::to_stdvec(self).map_err(|error| OutputError::new(path, error))?;
        state_file::write(path, MAGIC, identity, Times::One, &[bytes])
    }
}

impl Lesson {
    /// Reads what was learned in the scene `identity`.
    ///
    /// # Errors
    /// A file that cannot be read, is damaged, or is of another scene.
    pub fn read(path: &Path, identity: &Identity) -> Result<Self, LessonError> {
        let unreadable = |reason| LessonError::Unreadable { path: path.to_owned(), reason };
        let bytes = state_file::read(path, MAGIC, identity).map_err(|fault| match fault {
            Fault::Unreadable(reason) => unreadable(reason),
            Fault::Other(what) => LessonError::Other { path: path.to_owned(), what },
        })?;
        postcard::from_bytes(&bytes).map_err(|error| unreadable(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_begin_behind_what_taught() {
        let taken = |seed, first, end| Taken { seed, first, end };
        let all = [taken(3, 8, 16), taken(3, 0, 8), taken(4, 0, 99), taken(3, 20, 24), taken(3, 4, 6)];
        assert_eq!([3, 4, 5].map(|seed| first_untaken(&all, seed)), [16, 99, 0]);
    }
}
