//! How the state of a render lies in a file: eight bytes that tell its kind and version, then the length and the CRC-32 of the identity and of the state, then both. It
//! appears whole or not at all, in place of the one before.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::identity::Identity;
use crate::system::input::read_regular;
use crate::system::output::{OutputError, write_atomically};
use crate::system::rewrite::rewrite;

/// What such a file begins with.
pub type Magic = [u8; 8];

/// Length and CRC-32, twice.
const SUMS: usize = 2 * (8 + 4);

/// How often a file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Times {
    /// Once.
    One,
    /// Time and again, in place of the one before: see [`rewrite`].
    Many,
}

/// What is wrong with a file.
pub enum Fault {
    /// It cannot be read, or is damaged: in words.
    Unreadable(String),
    /// It is of something else: what differs.
    Other(String),
}

/// What a part comes to: counts and sums up what is written to it, and holds nothing.
#[derive(Default)]
struct Sums {
    length: u64,
    crc: crc32fast::Hasher,
}

impl Sums {
    fn of(pieces: &[impl AsRef<[u8]>]) -> Self {
        let mut sums = Self::default();
        pieces.iter().for_each(|piece| sums.add(piece.as_ref()));
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

/// Writes a state that has been copied out, in pieces.
pub fn write(
    path: &Path,
    magic: Magic,
    identity: &Identity,
    times: Times,
    state: &[impl AsRef<[u8]>],
) -> Result<(), OutputError> {
    let all = |file: &mut File| {
        state.iter().try_for_each(|piece| file.write_all(piece.as_ref())).map_err(|error| error.to_string())
    };
    write_parts(path, magic, identity, times, &Sums::of(state), all)
}

/// Writes a state from where it is, which takes no memory: `state` is called twice.
pub fn write_in_place(
    path: &Path,
    magic: Magic,
    identity: &Identity,
    times: Times,
    state: impl Fn(&mut dyn Write) -> Result<(), String>,
) -> Result<(), OutputError> {
    let mut sums = Sums::default();
    state(&mut sums).map_err(|error| OutputError::new(path, error))?;
    write_parts(path, magic, identity, times, &sums, |file| {
        let mut out = BufWriter::with_capacity(1 << 20, file);
        state(&mut out)?;
        out.flush().map_err(|error| error.to_string())
    })
}

fn write_parts(
    path: &Path,
    magic: Magic,
    identity: &Identity,
    times: Times,
    sums: &Sums,
    state: impl FnOnce(&mut File) -> Result<(), String>,
) -> Result<(), OutputError> {
    let identity = serde_json::to_vec(identity).map_err(|error| OutputError::new(path, error))?;
    let head = [&magic[..], &Sums::of(&[&identity]).to_bytes(), &sums.to_bytes(), &identity].concat();
    let whole = |file: &mut File| {
        file.write_all(&head).map_err(|error| error.to_string())?;
        state(file)
    };
    match times {
        Times::One => write_atomically(path, |file| whole(file.as_file_mut())),
        Times::Many => rewrite(path, whole),
    }
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
