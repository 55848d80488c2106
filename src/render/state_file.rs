//! How the state of a render lies in a file: eight bytes that tell its kind and version, then the length and the CRC-32 of the identity and of the state, then both. It
//! appears whole or not at all, in place of the one before.

use std::io::Write;
use std::path::Path;

use super::identity::Identity;
use crate::system::input::read_regular;
use crate::system::output::{OutputError, write_atomically};

/// What such a file begins with.
pub type Magic = [u8; 8];

/// Length and CRC-32, twice.
const SUMS: usize = 2 * (8 + 4);

/// What is wrong with a file.
pub enum Fault {
    /// It cannot be read, or is damaged: in words.
    Unreadable(String),
    /// It is of something else: what differs.
    Other(String),
}

pub fn write(path: &Path, magic: Magic, identity: &Identity, state: &[u8]) -> Result<(), OutputError> {
    let identity = serde_json::to_vec(identity).map_err(|error| OutputError::new(path, error))?;
    let mut head = magic.to_vec();
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

/// The state of `identity` that the file holds.
pub fn read(path: &Path, magic: Magic, identity: &Identity) -> Result<Vec<u8>, Fault> {
    let fail = |reason: &dyn std::fmt::Display| Fault::Unreadable(reason.to_string());
    let mut bytes = read_regular(path, u64::MAX).map_err(|error| fail(&error))?;
    let damaged = || fail(&"the file is damaged");
    if !bytes.starts_with(&magic) {
        return Err(fail(&"it is no such file, or one of another version"));
    }
    let head = bytes.get(..magic.len() + SUMS).ok_or_else(damaged)?;
    let mut rest = &bytes[head.len()..];
    let mut parts = [&[][..]; 2];
    for (part, sums) in parts.iter_mut().zip(head[magic.len()..].chunks_exact(SUMS / 2)) {
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
        return Err(Fault::Other(what));
    }
    let state = bytes.len() - parts[1].len();
    Ok(bytes.split_off(state))
}
