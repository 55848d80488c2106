//! Checkpoints: all that a render has come to, in a file, so that it can go on from there and end with the very same bits.
//!
//! A pass is a loop over tiles, each of which belongs to one thread. When a checkpoint is due, tiles that were begun are finished and no other is begun; then everything
//! stands still: pixels, what the passes learned for later ones (cache points, how scattering points are drawn, how camera rays are split), which tiles of the pass are done,
//! counters, seconds. That is copied out at once and written by a thread of its own while the render goes on. `state.rs` is what is kept.

mod state;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use state::Kept;
pub(super) use state::{KeptRef, OpenPass, Rest, RestRef};

use super::identity::Identity;
use super::state_file::{self, Fault, Magic, Times};
use crate::system::memory;
use crate::system::output::OutputError;
use crate::system::rewrite::drop_spare;

/// What checkpoints begin with; the digit is the version.
const MAGIC: Magic = *b"LFCHECK5";

/// Why a render cannot go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be read, or is damaged.
    #[error("cannot go on from the checkpoint {path}: {reason}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// In words.
        reason: String,
    },
    /// The checkpoint is of another render.
    #[error("the checkpoint {path} is of another render: {what} is not the same")]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
}

/// Reads a checkpoint of the render `identity`; `None` where there is no such file.
///
/// # Errors
/// A file that cannot be read, is damaged, or is of another render.
pub fn read(path: &Path, identity: &Identity) -> Result<Option<Kept>, CheckpointError> {
    let unreadable = |reason| CheckpointError::Unreadable { path: path.to_owned(), reason };
    if !path.exists() {
        return Ok(None);
    }
    let bytes = state_file::read(path, MAGIC, identity).map_err(|fault| match fault {
        Fault::Unreadable(reason) => unreadable(reason),
        Fault::Other(what) => CheckpointError::Other { path: path.to_owned(), what },
    })?;
    Kept::from_bytes(&bytes).map(Some).map_err(unreadable)
}

/// How often a render is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// After so many samples a pixel, on average.
    Samples(u32),
    /// After so much time.
    Time(Duration),
}

impl Default for Interval {
    fn default() -> Self {
        Self::Time(Duration::from_secs(15 * 60))
    }
}

/// Keeps a render in a file.
pub struct Keeper<'a> {
    path: PathBuf,
    identity: Identity,
    interval: Interval,
    /// Set where a checkpoint is asked for out of turn; it is taken back here.
    asked: &'a AtomicBool,
    writer: Mutex<Writer>,
}

#[derive(Default)]
struct Writer {
    thread: Option<JoinHandle<Written>>,
    failed: Option<OutputError>,
    /// The memory of the copy before, for the next one: none where memory is limited.
    spare: Vec<Vec<u8>>,
}

/// What became of a checkpoint, and the memory of its copy.
struct Written {
    result: Result<(), OutputError>,
    pieces: Vec<Vec<u8>>,
}

/// When the next checkpoint is due.
#[derive(Clone, Copy, Debug)]
pub(super) enum Due {
    Samples(u64),
    At(Instant),
}

impl<'a> Keeper<'a> {
    /// Keeps the render of that identity in the file `path`, every `interval` and where `asked` is set.
    pub fn new(path: PathBuf, identity: Identity, interval: Interval, asked: &'a AtomicBool) -> Self {
        Self { path, identity, interval, asked, writer: Mutex::default() }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// When the next one is due after `samples` over all of so many pixels.
    pub(super) fn next(&self, samples: u64, pixels: u64) -> Due {
        match self.interval {
            Interval::Samples(every) => Due::Samples(samples + u64::from(every) * pixels),
            Interval::Time(every) => {
                let now = Instant::now();
                Due::At(now.checked_add(every).unwrap_or(now + Duration::from_secs(1 << 30)))
            }
        }
    }

    /// Whether it is time, after `samples` over all pixels.
    #[inline]
    pub(super) fn is_due(&self, due: Due, samples: u64) -> bool {
        self.asked.load(Ordering::Relaxed)
            || match due {
                Due::Samples(at) => samples >= at,
                Due::At(at) => Instant::now() >= at,
            }
    }

    /// Copies out what there is and begins to write it. Waits for the one before. Where a limit on memory leaves no room for the copy it is written at once, and
    /// the render waits.
    pub(super) fn keep(&self, state: &KeptRef<'_>) {
        self.asked.store(false, Ordering::Relaxed);
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        writer.join();
        let (path, identity) = (self.path.clone(), self.identity.clone());
        if !has_room_for_copy(state) {
            writer.failed =
                state_file::write_in_place(&path, MAGIC, &identity, Times::Many, |out| state.write_to(out)).err();
            return;
        }
        let pieces = match state.to_pieces(std::mem::take(&mut writer.spare)) {
            Ok(pieces) => pieces,
            Err(reason) => {
                writer.failed = Some(OutputError::new(&path, reason));
                return;
            }
        };
        writer.thread = Some(std::thread::spawn(move || {
            let result = state_file::write(&path, MAGIC, &identity, Times::Many, &pieces);
            Written { result, pieces: if memory::limit().is_some() { vec![] } else { pieces } }
        }));
    }

    /// Waits until everything is written; no more is to come.
    ///
    /// # Errors
    /// Why the last checkpoint was not written; those before it may have been.
    pub fn settle(&self) -> Result<(), OutputError> {
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        writer.join();
        writer.spare = vec![];
        drop_spare(&self.path);
        writer.failed.take().map_or(Ok(()), Err)
    }

    /// The render has ended well: the file is of no use any more.
    pub fn forget(&self) {
        let _ = self.settle();
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Whether the limit on the memory of the process, if it has one, leaves room for a copy of the state.
fn has_room_for_copy(state: &KeptRef<'_>) -> bool {
    memory::limit().is_none()
        || match (memory::available(), state.length()) {
            (Some(left), Ok(length)) => length + length / 8 < left,
            _ => true,
        }
}

impl Writer {
    fn join(&mut self) {
        if let Some(thread) = self.thread.take() {
            self.failed = match thread.join() {
                Ok(Written { result, pieces }) => {
                    self.spare = pieces;
                    result.err()
                }
                Err(_) => Some(OutputError::new(Path::new("checkpoint"), "the thread that wrote it ended")),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::film_settings;
    use crate::film::{Film, FilmOverrides};
    use crate::integrator::Counters;
    use crate::render::mixing::Mixing;

    /// What is written from where it is is what its copy would be.
    #[test]
    fn both_ways_of_writing_are_one() {
        let bounds = crate::film::PixelBounds { x0: 0, y0: 0, x1: 40, y1: 30 };
        let (mixing, splitting) = (Mixing::new(bounds, None, false), None);
        let rest = RestRef {
            mixing: &mixing,
            splitting: &splitting,
            learned: None,
            counters: Counters::default(),
            iterations: &[],
            done: 7,
            pass: None,
            seconds: 1.5,
        };
        // More tiles than one task copies.
        let size = FilmOverrides { resolution: Some([300, 200]), crop: None };
        let film = Film::new(film_settings(vec![], &size), true);
        let state = KeptRef { tiles: film.tiles(), rest };
        let folder = tempfile::tempdir().expect("a folder");
        let [copied, in_place] = ["copied", "in-place"].map(|name| folder.path().join(name));
        let identity = Identity::named("a test");
        // In fresh memory, and in that of a larger copy.
        let fresh = state.to_pieces(vec![]).expect("there is memory");
        let pieces = state.to_pieces(vec![vec![1; 9]; fresh.len() + 2]).expect("there is memory");
        assert!(fresh == pieces && pieces.len() > 3);
        assert_eq!(state.length(), Ok(pieces.concat().len() as u64));
        state_file::write(&copied, MAGIC, &identity, Times::Many, &pieces).expect("written");
        state_file::write_in_place(&in_place, MAGIC, &identity, Times::Many, |out| state.write_to(out))
            .expect("written");
        let bytes = std::fs::read(&copied).expect("it is there");
        assert_eq!(std::fs::read(&in_place).expect("it is there"), bytes);
        let kept = read(&in_place, &identity).expect("whole").expect("there");
        assert_eq!((kept.tiles.len(), kept.rest.done), (film.tiles().len(), 7));
    }
}
