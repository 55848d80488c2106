//! How a checkpoint lies in its file: [`MAGIC`], then the length and the CRC-32 of the identity and of the state, then both. It appears whole or not at all, in place of the
//! one before.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::Identity;
use super::state::Kept;
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

pub(super) fn write(path: &Path, identity: &Identity, state: &[u8]) -> Result<(), OutputError> {
    let identity = serde_json::to_vec(identity).map_err(|error| OutputError::new(path, error))?;
    let mut head = MAGIC.to_vec();
    for part in [identity.as_slice(), state] {
        head.extend((part.len() as u64).to_le_bytes());
        head.extend(crc32fast::hash(part).to_le_bytes());
    }
    write_atomically(path, |file| {
        let file = file.as_file_mut();
        [head.as_slice(), &identity, state]
            .into_iter()
            .try_for_each(|part| file.write_all(part))
            .map_err(|e| e.to_string())
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
