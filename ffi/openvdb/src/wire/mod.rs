//! What this side and the worker say to each other: first [`HELLO`], then frames of (kind, length, payload, checksum),
//! little-endian. Numbers that must come through exactly travel as bits.
//!
//! Neither side believes the other. A [`Receiver`] has a budget of memory for all that it takes in, checks every count, and
//! takes memory as data arrives: nothing that is sent can make it panic or fail to allocate.

mod grid;
mod new_grid;

use std::io::{self, Read, Write};

pub use grid::{receive_grid, send_grid};
pub use new_grid::{NewGrid, Part, receive_new_grid, send_new_grid};

/// What the worker says first: so that a program that is no worker is told apart from a crash.
pub const HELLO: [u8; 8] = *b"LFVDB\0\0\x02";

/// Texts (headers, errors) are no longer than this.
pub const MAX_TEXT: usize = 4 << 20;

/// What memory a text may take, once it is understood, for each of its bytes: `["",""],` is two strings.
const TEXT_FACTOR: u64 = 8;

/// Bytes that are taken in before they are checked, at most 12 times this, and a multiple of 8.
const PIECE: usize = 1 << 17;

/// Elements that room is made for at first.
const FIRST: usize = 1 << 22;

/// What a frame holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// What a grid is; its leaves and tiles follow.
    Header = 1,
    /// Low corners of leaves.
    Origins = 2,
    /// Values of leaves.
    Values = 3,
    /// Tiles.
    Tiles = 4,
    /// Why nothing comes of it: a letter for the kind of fault, then the reason in words.
    Error = 5,
    /// All was sent.
    End = 6,
}

impl Kind {
    fn from_byte(byte: u8) -> Option<Self> {
        [Self::Header, Self::Origins, Self::Values, Self::Tiles, Self::Error, Self::End]
            .into_iter()
            .find(|&kind| kind as u8 == byte)
    }
}

/// Why what was sent was not taken.
#[derive(Debug, thiserror::Error)]
pub enum WireError {
    /// The pipe failed or ended.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It makes no sense.
    #[error("{0}")]
    Bad(&'static str),
    /// It is more than the budget.
    #[error("more than is allowed")]
    TooMuch,
    /// There is no memory for it.
    #[error("out of memory")]
    Memory,
}

/// A hash of the payload that any lost, doubled or changed stretch upsets.
struct Checksum(u64);

impl Checksum {
    const FACTOR: u64 = 0xff51_afd7_ed55_8ccd;

    fn new(length: u64) -> Self {
        Self(0x9e37_79b9_7f4a_7c15 ^ length)
    }

    /// Only the last piece may have a length that is no multiple of 8.
    fn add(&mut self, piece: &[u8]) {
        let (words, rest) = piece.as_chunks::<8>();
        for word in words {
            self.0 = (self.0 ^ u64::from_le_bytes(*word)).wrapping_mul(Self::FACTOR).rotate_left(29);
        }
        for &byte in rest {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(Self::FACTOR).rotate_left(29);
        }
    }

    fn finish(self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}

/// Sends a frame.
pub fn send(out: &mut impl Write, kind: Kind, payload: &[u8]) -> io::Result<()> {
    let mut sum = Checksum::new(payload.len() as u64);
    sum.add(payload);
    out.write_all(&[kind as u8])?;
    out.write_all(&(payload.len() as u64).to_le_bytes())?;
    out.write_all(payload)?;
    out.write_all(&sum.finish().to_le_bytes())
}

/// How a frame begins.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// What it holds.
    pub kind: Kind,
    length: u64,
}

impl Head {
    /// How many elements it says that it holds.
    fn count<T>(self) -> Result<usize, WireError> {
        let bytes = usize::try_from(self.length).map_err(|_| WireError::TooMuch)?;
        if bytes.is_multiple_of(size_of::<T>()) {
            Ok(bytes / size_of::<T>())
        } else {
            Err(WireError::Bad("wrong count"))
        }
    }
}

/// Takes frames in.
pub struct Receiver<R> {
    input: R,
    budget: u64,
}

impl<R: Read> Receiver<R> {
    /// Takes what `input` gives: payloads of at most `budget` bytes in all.
    pub fn new(input: R, budget: u64) -> Self {
        Self { input, budget }
    }

    /// Whether the other side begins as a worker does.
    pub fn hello(&mut self) -> bool {
        let mut hello = [0u8; HELLO.len()];
        self.input.read_exact(&mut hello).is_ok() && hello == HELLO
    }

    fn spend(&mut self, bytes: u64) -> Result<(), WireError> {
        self.budget = self.budget.checked_sub(bytes).ok_or(WireError::TooMuch)?;
        Ok(())
    }

    /// The next frame's beginning; its payload must be taken next.
    pub fn head(&mut self) -> Result<Head, WireError> {
        let mut head = [0u8; 9];
        self.input.read_exact(&mut head)?;
        let [kind, length @ ..] = head;
        let kind = Kind::from_byte(kind).ok_or(WireError::Bad("unknown frame"))?;
        Ok(Head { kind, length: u64::from_le_bytes(length) })
    }

    /// The payload of a frame that holds a text.
    pub fn text(&mut self, head: Head) -> Result<Vec<u8>, WireError> {
        let length = usize::try_from(head.length).ok().filter(|&n| n <= MAX_TEXT).ok_or(WireError::TooMuch)?;
        self.spend((TEXT_FACTOR - 1) * head.length)?;
        self.elements(head, length)
    }

    /// The payload of a frame that holds `count` elements.
    pub fn elements<T: bytemuck::Pod>(&mut self, head: Head, count: usize) -> Result<Vec<T>, WireError> {
        if count.checked_mul(size_of::<T>()).is_none_or(|bytes| bytes as u64 != head.length) {
            return Err(WireError::Bad("wrong count"));
        }
        self.spend(head.length)?;
        let mut sum = Checksum::new(head.length);
        let mut elements: Vec<T> = Vec::new();
        while elements.len() < count {
            let start = elements.len();
            let piece = (count - start).min(PIECE);
            if elements.capacity() - start < piece {
                // Grows as data arrives: a false length takes no memory.
                let more = (count - start).min(start.max(FIRST));
                elements.try_reserve_exact(more).map_err(|_| WireError::Memory)?;
            }
            elements.resize(start + piece, T::zeroed());
            let bytes = bytemuck::cast_slice_mut(&mut elements[start..]);
            self.input.read_exact(bytes)?;
            sum.add(bytes);
        }
        let mut sent = [0u8; 8];
        self.input.read_exact(&mut sent)?;
        if u64::from_le_bytes(sent) == sum.finish() { Ok(elements) } else { Err(WireError::Bad("checksum differs")) }
    }

    /// The next frame, which must be one of `kind` with `count` elements.
    fn expect<T: bytemuck::Pod>(&mut self, kind: Kind, count: usize) -> Result<Vec<T>, WireError> {
        let head = self.head()?;
        if head.kind == kind { self.elements(head, count) } else { Err(WireError::Bad("frames out of order")) }
    }
}

/// `items` as another type; an error instead of an abort where there is no memory.
fn try_convert<A: Copy, B: From<A>>(items: &[A]) -> Result<Vec<B>, WireError> {
    let mut all = Vec::new();
    all.try_reserve_exact(items.len()).map_err(|_| WireError::Memory)?;
    all.extend(items.iter().map(|&item| B::from(item)));
    Ok(all)
}

#[cfg(test)]
mod tests;
