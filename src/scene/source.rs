//! Where in which file something was said.

use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of a scene, by its place in [`Sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FileId(pub u32);

/// A stretch of text: file, line and column (both from 1), and length in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// Line, counted from 1.
    pub line: u32,
    /// Column in bytes, counted from 1.
    pub column: u32,
    /// Length in bytes.
    pub length: u32,
}

/// The files that a scene was read from, kept for messages that show an excerpt.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<(PathBuf, Arc<str>)>,
}

impl Sources {
    /// Adds a file and its (decompressed) text.
    pub fn add(&mut self, path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> FileId {
        self.files.push((path.into(), text.into()));
        FileId(self.files.len() as u32 - 1)
    }

    /// The file's path as the user or an Include named it, made relative to the including file.
    pub fn path(&self, file: FileId) -> &Path {
        &self.files[file.0 as usize].0
    }

    /// The paths of all files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(path, _)| path.as_path())
    }

    /// The texts of all files, in the order in which they were read.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(_, text)| &**text)
    }

    /// The file's text.
    pub fn text(&self, file: FileId) -> &Arc<str> {
        &self.files[file.0 as usize].1
    }

    /// The text of one line (counted from 1), without its end; empty where there is none.
    pub fn line(&self, file: FileId, line: u32) -> &str {
        lines(self.text(file)).nth(line as usize - 1).unwrap_or("")
    }
}

/// The lines of a text, without their ends: "\n", "\r\n", or "\r" alone. Behind the last end there is one more, perhaps empty.
pub fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways() {
        let found: Vec<&str> = lines("a\nb\r\nc\rd\r\r\n\n").collect();
        assert_eq!(found, ["a", "b", "c", "d", "", "", ""]);
        let mut sources = Sources::default();
        let file = sources.add("a", "a\rb\r\nc");
        assert_eq!([1, 2, 3, 4].map(|line| sources.line(file, line)), ["a", "b", "c", ""]);
    }
}
