//! Files into text: decompression by content, size limits, UTF-8 checked, Latin-1 put up with. One file's text is read once however often it
//! is included.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::scene::source::lines;
use crate::scene::{SceneError, SceneErrorKind};
use crate::system::input::{read_bounded, read_regular};
use crate::system::memory::available;

/// The most bytes that one file may hold, after decompression: 4 GiB.
pub const LARGEST_FILE: u64 = 4 << 30;

/// A compressed file may grow freely up to this size …
const UNSUSPICIOUS: u64 = 8 << 20;

/// … and beyond it by at most this factor. Scene text and meshes compress 3 to 20 fold, deflate's worst case is 1032.
const LARGEST_RATIO: u64 = 64;

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Whether something other than a regular file will do: a pipe, as in `zcat scene.gz | lanternfish render /dev/stdin`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// What the user named.
    Any,
    /// What a scene named: a pipe there could wait for ever.
    Regular,
}

/// The bytes of a file; gzip is recognised by its first two bytes and unpacked.
///
/// # Errors
/// `File` where it cannot be read or unpacked, `Limit` where it is larger than [`LARGEST_FILE`] or looks made to
/// explode.
pub fn read_bytes(path: &Path, source: Source) -> Result<Vec<u8>> {
    // Once as bytes and once as what is made of them; a pipe's length is not known, so that its bytes grow by doubling.
    let copies = if source == Source::Regular { 2 } else { 3 };
    let largest = available().map_or(LARGEST_FILE, |left| LARGEST_FILE.min(left / copies));
    let raw = match source {
        Source::Regular => read_regular(path, largest),
        Source::Any if path.is_dir() => Err(std::io::Error::other("it is a folder")),
        Source::Any => File::open(path).and_then(|file| read_bounded(file, largest)),
    };
    let raw = raw.map_err(|e| match e.kind() {
        std::io::ErrorKind::FileTooLarge if largest == LARGEST_FILE => too_large(path),
        std::io::ErrorKind::FileTooLarge => {
            let what = format!("{} holds more than the memory that is left takes", path.display());
            SceneError::new(SceneErrorKind::Limit(what))
        }
        _ => unreadable(path, e.to_string()),
    })?;
    if !raw.starts_with(&[0x1f, 0x8b]) {
        return Ok(raw);
    }
    let by_ratio = UNSUSPICIOUS.max((raw.len() as u64).saturating_mul(LARGEST_RATIO));
    // Read once as bytes, which grow by doubling.
    let fits = available().map_or(LARGEST_FILE, |left| left / 3);
    let allowed = by_ratio.min(LARGEST_FILE).min(fits);
    let mut bytes = Vec::new();
    MultiGzDecoder::new(raw.as_slice())
        .take(allowed + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| unreadable(path, format!("its gzip data is damaged or cut off ({e})")))?;
    match bytes.len() as u64 {
        size if size <= allowed => Ok(bytes),
        _ if allowed == LARGEST_FILE => Err(too_large(path)),
        _ if allowed == fits => Err(SceneError::new(SceneErrorKind::Limit(format!(
            "{} unpacks to more than the memory that is left takes",
            path.display()
        )))),
        _ => Err(SceneError::new(SceneErrorKind::Limit(format!(
            "{} unpacks to more than {LARGEST_RATIO} times its size; refused as it looks made to fill the memory",
            path.display()
        )))
        .help("if the file is meant to be so, unpack it with gunzip first")),
    }
}

/// A file's text, and of what is not UTF-8 the line and column of the first such byte.
pub enum Text {
    /// UTF-8, but for comments perhaps.
    Utf8(String),
    /// What is not UTF-8 of it is taken for Latin-1 (ISO 8859-1), in which every byte is a character.
    Latin1(String, [u32; 2]),
    /// No text. What it holds, with replacements, so that the caller can register the file before it reports the place.
    Binary(String, [u32; 2]),
}

/// How files begin that are not text, what they are, and what to do.
const OTHERS: [(&[u8], &str, &str); 8] = [
    (b"\xff\xfe", "UTF-16 text", UTF_16),
    (b"\xfe\xff", "UTF-16 text", UTF_16),
    (b"PK\x03\x04", "a zip archive", UNPACK),
    (b"\x1f\x8b", "packed by gzip twice", "unpack it with gunzip once"),
    (b"BZh", "packed by bzip2", UNPACK),
    (b"\xfd7zXZ\0", "packed by xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "packed by zstd", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
];
const UTF_16: &str = "save it as UTF-8, as with `iconv -f UTF-16 -t UTF-8`";
const UNPACK: &str = "unpack it: only text and gzip are read";

/// A file's text.
///
/// # Errors
/// As [`read_bytes`], and `File` for text of 16 bits and packed files.
pub fn read_text(path: &Path, source: Source) -> Result<Text> {
    let bytes = read_bytes(path, source)?;
    if let Some((_, what, help)) = OTHERS.iter().find(|(start, ..)| bytes.starts_with(start)) {
        return Err(unreadable(path, format!("it seems to be {what}")).help(*help));
    }
    Ok(String::from_utf8(bytes).map_or_else(|e| other_text(e.as_bytes()), Text::Utf8))
}

fn other_text(bytes: &[u8]) -> Text {
    let lossy = || String::from_utf8_lossy(bytes).into_owned();
    let Some(bad) = first_bad_outside_comments(bytes) else { return Text::Utf8(lossy()) };
    let valid = String::from_utf8_lossy(&bytes[..bad]);
    let (line, last) = lines(&valid).enumerate().last().unwrap_or((0, ""));
    let place = [line + 1, last.len() + 1].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    match bytes.contains(&0) {
        true => Text::Binary(lossy(), place),
        false => {
            let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
            for chunk in bytes.utf8_chunks() {
                text.push_str(chunk.valid());
                text.extend(chunk.invalid().iter().map(|&byte| char::from(byte)));
            }
            Text::Latin1(text, place)
        }
    }
}

/// The first byte that is not UTF-8 and does not stand behind a `#` on its line: comments may be in any encoding.
fn first_bad_outside_comments(bytes: &[u8]) -> Option<usize> {
    let mut start = 0;
    for line in bytes.split_inclusive(|&b| b == b'\n' || b == b'\r') {
        let mut quoted = false;
        let is_comment = |&b: &u8| {
            quoted ^= b == b'"';
            b == b'#' && !quoted
        };
        let comment = line.iter().position(is_comment).unwrap_or(line.len());
        if let Err(error) = std::str::from_utf8(&line[..comment]) {
            return Some(start + error.valid_up_to());
        }
        start += line.len();
    }
    None
}

/// The error for a file that cannot be read.
pub fn unreadable(path: &Path, reason: String) -> Box<SceneError> {
    SceneError::new(SceneErrorKind::File { path: path.to_owned(), reason })
}

fn too_large(path: &Path) -> Box<SceneError> {
    SceneError::new(SceneErrorKind::Limit(format!("{} holds more than 4 GiB", path.display())))
        .help("split it into several files and Include them, or move meshes into .ply files")
}
