//! How a checkpoint lies in its file: [`MAGIC`], then the length and the CRC-32 of the identity and of the state, then both. It appears whole or not at all, in place of the
//! one before.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::Identity;
use super::state::{Kept, KeptRef};
use crate::system::input::read_regular;
use crate::system::output::{OutputError, write_atomically};

/// What such files begin with; the digit is the version.
const MAGIC: [u8; 8] = *b"LFCHECK1";

/// Length and CRC-32, twice.
const SUMS: usize = 2 * (8 + 4);

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

/// What a part comes to: counts and sums up what is written to it, and holds nothing.
#[derive(Default)]
struct Sums {
    length: u64,
    crc: crc32fast::Hasher,
}

impl Sums {
    fn of(part: &[u8]) -> Self {
        let mut sums = Self::default();
        sums.add(part);
        sums
    }

    fn add(&mut self, bytes: &[u8]) {
        self.length += bytes.len() as u64;
        self.crc.update(bytes);
    }

    fn to_bytes(&self) -> [u8; SUMS / 2] {
        let mut bytes = [0; SUMS / 2];
        bytes[..8].copy_from_slice(&self.length.to_le_bytes());
        bytes[8..].copy_from_slice(&self.crc.clone().finalize().to_le_bytes());
        bytes
    }
}

impl Write for Sums {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.add(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes a checkpoint whose state has been copied out.
pub(super) fn write(path: &Path, identity: &Identity, state: &[u8]) -> Result<(), OutputError> {
    write_parts(path, identity, &Sums::of(state), |file| file.write_all(state).map_err(|error| error.to_string()))
}

/// Bytes of a state.
pub(super) fn length(state: &KeptRef<'_>) -> Result<u64, String> {
    let mut sums = Sums::default();
    state.write_to(&mut sums).map(|()| sums.length)
}

/// Writes a checkpoint from the state where it is, which takes no memory, but the render has to wait for it.
pub(super) fn write_in_place(path: &Path, identity: &Identity, state: &KeptRef<'_>) -> Result<(), OutputError> {
    let mut sums = Sums::default();
    state.write_to(&mut sums).map_err(|error| OutputError::new(path, error))?;
    write_parts(path, identity, &sums, |file| {
        let mut out = BufWriter::with_capacity(1 << 20, file);
        state.write_to(&mut out)?;
        out.flush().map_err(|error| error.to_string())
    })
}

fn write_parts(
    path: &Path,
    identity: &Identity,
    sums: &Sums,
    state: impl FnOnce(&mut std::fs::File) -> Result<(), String>,
) -> Result<(), OutputError> {
    let identity = serde_json::to_vec(identity).map_err(|error| OutputError::new(path, error))?;
    let head = [&MAGIC[..], &Sums::of(&identity).to_bytes(), &sums.to_bytes(), &identity].concat();
    write_atomically(path, |file| {
        let file = file.as_file_mut();
        file.write_all(&head).map_err(|error| error.to_string())?;
        state(file)
    })
}

/// Reads a checkpoint of the render `identity`; `None` where there is no such file.
///
/// # Errors
/// A file that cannot be read, is damaged, or is of another render.
pub fn read(path: &Path, identity: &Identity) -> Result<Option<Kept>, CheckpointError> {
    let fail = |reason: &dyn std::fmt::Display| CheckpointError::Unreadable {
        path: path.to_owned(),
        reason: reason.to_string(),
    };
    if !path.exists() {
        return Ok(None);
    }
    let bytes = read_regular(path, u64::MAX).map_err(|error| fail(&error))?;
    let damaged = || fail(&"the file is damaged");
    let head = bytes.get(..MAGIC.len() + SUMS).ok_or_else(damaged)?;
    if !head.starts_with(&MAGIC) {
        return Err(fail(&"it is no checkpoint of this version"));
    }
    let mut rest = &bytes[head.len()..];
    let mut parts = [&[][..]; 2];
    for (part, sums) in parts.iter_mut().zip(head[MAGIC.len()..].chunks_exact(SUMS / 2)) {
        let (length, sum) = sums.split_at(8);
        let length = u64::from_le_bytes(length.try_into().map_err(|_| damaged())?);
        let length = usize::try_from(length).ok().filter(|&n| n <= rest.len()).ok_or_else(damaged)?;
        (*part, rest) = rest.split_at(length);
        if crc32fast::hash(part).to_le_bytes() != sum {
            return Err(damaged());
        }
    }
    if !rest.is_empty() {
        return Err(damaged());
    }
    let found: Identity = serde_json::from_slice(parts[0]).map_err(|error| fail(&error))?;
    if let Some(what) = found.difference(identity) {
        return Err(CheckpointError::Other { path: path.to_owned(), what });
    }
    Kept::from_bytes(parts[1]).map(Some).map_err(|reason| fail(&reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::Counters;
    use crate::render::mixing::Mixing;

    /// What is written from where it is is what its copy would be.
    #[test]
    fn both_ways_of_writing_are_one() {
        let bounds = crate::film::PixelBounds { x0: 0, y0: 0, x1: 40, y1: 30 };
        let (mixing, splitting) = (Mixing::new(bounds, None, false), None);
        let state = KeptRef {
            tiles: &[],
            mixing: &mixing,
            splitting: &splitting,
            learned: None,
            counters: Counters::default(),
            iterations: &[],
            done: 7,
            pass: None,
            seconds: 1.5,
        };
        let folder = tempfile::tempdir().expect("a folder");
        let [copied, in_place] = ["copied", "in-place"].map(|name| folder.path().join(name));
        let identity = Identity::named("a test");
        let body = state.to_bytes().expect("there is memory");
        assert_eq!(length(&state), Ok(body.len() as u64));
        write(&copied, &identity, &body).expect("written");
        write_in_place(&in_place, &identity, &state).expect("written");
        let bytes = std::fs::read(&copied).expect("it is there");
        assert_eq!(std::fs::read(&in_place).expect("it is there"), bytes);
        assert_eq!(read(&in_place, &identity).expect("whole").expect("there").done, 7);
    }
}
