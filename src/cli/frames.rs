//! Sequences of frames, and their numbers in the names of files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// No more frames than this are rendered by one command.
const MOST: i64 = 1 << 20;

/// Frames by number, the last one included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    first: i32,
    last: i32,
}

impl Frames {
    /// Reads `A..B`, or `A` for one frame.
    ///
    /// # Errors
    /// In words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (a, b) = text.split_once("..").unwrap_or((text, text));
        let frames = a.trim().parse().ok().zip(b.trim().parse().ok()).map(|(first, last)| Self { first, last });
        let is_whole = |frames: &Self| (1..=MOST).contains(&(i64::from(frames.last) - i64::from(frames.first) + 1));
        frames.filter(is_whole).ok_or_else(|| {
            format!("expected A..B, the numbers of the first and the last frame, such as 1..240; at most {MOST} frames")
        })
    }

    /// Their numbers.
    pub fn numbers(self) -> impl ExactSizeIterator<Item = i32> {
        // There are few enough.
        (0..(i64::from(self.last) - i64::from(self.first) + 1) as usize).map(move |i| self.first + i as i32)
    }
}

/// Whether a file's name, or the folder's it is in, has a place for the frame's number.
pub fn has_place(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().contains(&b'#')
}

/// `path` with each stretch of `#` replaced by the number of the frame, in at least as many digits.
pub fn numbered(path: &Path, frame: i32) -> PathBuf {
    let Some(text) = path.to_str() else { return path.to_owned() };
    let mut name = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('#') {
        name += &rest[..at];
        let after = rest[at..].trim_start_matches('#');
        let digits = rest.len() - at - after.len();
        name += &format!("{frame:0width$}", width = digits + usize::from(frame < 0));
        rest = after;
    }
    name += rest;
    name.into()
}

/// `path` with the frame's number, in at least four digits, before its ending, unless that is there.
pub fn with_number(path: PathBuf, frame: i32) -> PathBuf {
    let mut name: OsString = path.file_stem().unwrap_or_default().to_owned();
    let text = name.to_string_lossy();
    let stem = text.trim_end_matches(|c: char| c.is_ascii_digit());
    if text[stem.len()..].parse() == Ok(frame.unsigned_abs()) && (frame >= 0 || stem.ends_with('-')) {
        return path;
    }
    name.push(numbered(Path::new(".####"), frame));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_with_the_last() {
        let numbers = |text| Frames::parse(text).map(|frames| frames.numbers().collect::<Vec<_>>());
        assert_eq!(numbers("1..3"), Ok(vec![1, 2, 3]));
        assert_eq!(numbers("-1..1"), Ok(vec![-1, 0, 1]));
        assert_eq!(numbers("7"), Ok(vec![7]));
        for wrong in ["", "..", "1..", "3..1", "1..=3", "a", "1..2000000", "-2147483648..2147483647"] {
            assert!(Frames::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_take_the_place_of_marks() {
        let name = |text: &str, frame| numbered(Path::new(text), frame).display().to_string();
        assert_eq!(name("shot.####.exr", 7), "shot.0007.exr");
        assert_eq!(name("shot.####.exr", 12345), "shot.12345.exr");
        assert_eq!(name("a##/b#.exr", -3), "a-03/b-3.exr");
        assert_eq!(name("plain.exr", 7), "plain.exr");
        let with = |text: &str, frame| with_number(text.into(), frame).display().to_string();
        assert_eq!(with("a/b.exr", 12), "a/b.0012.exr");
        assert_eq!(with("a/b.012.exr", 12), "a/b.012.exr");
        assert_eq!(with("b12", 2), "b12.0002");
        assert_eq!(with("b-12.exr", -12), "b-12.exr");
        assert_eq!(with("b12.exr", -12), "b12.-0012.exr");
    }
}
