//! Reading files that a scene names: regular files only, since a pipe that nobody writes to would never end, and none larger
//! than its reader can hold.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file and says how long it is.
///
/// # Errors
/// What the system says, and anything that is not a regular file (folders, pipes, devices).
pub fn open_regular(path: &Path) -> io::Result<(File, u64)> {
    let metadata = path.metadata()?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "it is a folder" } else { "it is not a regular file" };
        return Err(io::Error::other(what));
    }
    Ok((File::open(path)?, metadata.len()))
}

/// All bytes of a regular file of at most `limit` bytes; no more of them than it says that it has: some that say 0 and have no end pass for regular
/// files (those of `/proc`).
///
/// # Errors
/// As [`open_regular`]; `FileTooLarge` for more bytes than allowed.
pub fn read_regular(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let (file, length) = open_regular(path)?;
    if length > limit {
        return Err(too_large(limit));
    }
    let mut bytes = Vec::new();
    // All at once: a list that doubles would take up to three times as much on its way.
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX).saturating_add(1))?;
    read_into(bytes, file.take(length), limit)
}

/// All that `source` still gives, which must not be more than `limit` bytes.
///
/// # Errors
/// What the source says; `FileTooLarge` for more bytes than allowed.
pub fn read_bounded(source: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    read_into(Vec::new(), source, limit)
}

fn read_into(mut bytes: Vec<u8>, source: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    source.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

fn too_large(limit: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("it holds more than {limit} bytes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_hold_and_folders_are_no_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        std::fs::write(&path, b"12345").expect("written");
        assert_eq!(read_regular(&path, 5).expect("it fits"), b"12345");
        assert_eq!(read_regular(&path, 4).expect_err("it is larger").kind(), io::ErrorKind::FileTooLarge);
        assert!(read_regular(folder.path(), 5).is_err());
        assert!(read_bounded(&b"12345"[..], 4).is_err());
    }

    /// Such files may wait for something that never comes.
    #[cfg(target_os = "linux")]
    #[test]
    fn files_that_claim_to_be_empty_are() {
        assert_eq!(read_regular(Path::new("/proc/self/status"), 1 << 20).expect("it is there"), b"");
    }
}
