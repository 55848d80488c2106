//! Files that appear whole or not at all: written under a temporary name in the same folder, flushed to the disk, renamed. What a process that was killed left of the
//! same file goes when it is written the next time (`temporary.rs`).

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

use super::temporary;

/// Files under a temporary name right now, for [`exit_at_once`].
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {reason}")]
pub struct OutputError {
    /// The file.
    pub path: PathBuf,
    /// In words.
    pub reason: String,
}

impl OutputError {
    /// `path` could not be written because of `reason`.
    pub fn new(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self { path: path.to_owned(), reason: reason.to_string() }
    }
}

/// What stands where a file is to be written.
pub(super) enum Target {
    /// Nothing, or a file that will be replaced: its real place, behind any symbolic links.
    File(PathBuf),
    /// A device, such as `/dev/null`: it is written to, not replaced.
    Device,
}

impl Target {
    pub fn of(path: &Path) -> io::Result<Self> {
        match path.metadata() {
            Ok(metadata) if metadata.is_dir() => Err(io::Error::other("it is a folder")),
            Ok(metadata) if metadata.is_file() => Ok(Self::File(path.canonicalize()?)),
            Ok(metadata) if is_character_device(&metadata) => Ok(Self::Device),
            Ok(_) => Err(io::Error::other("it is neither a file nor a device")),
            Err(error) if error.kind() == io::ErrorKind::NotFound && names_a_folder(path) => {
                Err(io::Error::other("there is no such folder"))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::File(end_of_links(path))),
            Err(error) => Err(error),
        }
    }
}

/// Where its temporary files lie.
pub(super) fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn names_a_folder(path: &Path) -> bool {
    path.file_name().is_none() || path.as_os_str().to_string_lossy().ends_with('/')
}

/// Where symbolic links that end at nothing lead.
fn end_of_links(path: &Path) -> PathBuf {
    const MOST: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST {
        let Ok(next) = path.read_link() else { break };
        path = path.parent().unwrap_or(Path::new("")).join(next);
    }
    path
}

/// Whether `path` is a device such as `/dev/null`, which takes anything.
pub fn is_device(path: &Path) -> bool {
    path.metadata().is_ok_and(|metadata| is_character_device(&metadata))
}

#[cfg(unix)]
fn is_character_device(metadata: &std::fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_char_device(&metadata.file_type())
}

#[cfg(not(unix))]
fn is_character_device(_: &std::fs::Metadata) -> bool {
    false
}

/// A temporary file that [`exit_at_once`] knows of.
pub(super) struct Unfinished {
    /// `None` once it has its final name.
    file: Option<NamedTempFile>,
    name: PathBuf,
}

impl Unfinished {
    /// Beside `target`, with its permissions if it is there, else with those that new files get.
    pub fn beside(target: &Path) -> io::Result<Self> {
        let folder = folder_of(target);
        if !folder.is_dir() {
            return Err(io::Error::new(io::ErrorKind::NotFound, format!("there is no folder {}", folder.display())));
        }
        let unfinished = Self::within(target, |builder, folder| builder.tempfile_in(folder))?;
        temporary::sweep(folder, target, &unfinished.name);
        if let (Ok(metadata), Some(file)) = (target.metadata(), &unfinished.file) {
            file.as_file().set_permissions(metadata.permissions())?;
        }
        Ok(unfinished)
    }

    /// On its way to `target`, in the same folder, made by `make`.
    pub fn within(
        target: &Path,
        make: impl FnOnce(&tempfile::Builder<'_, '_>, &Path) -> io::Result<NamedTempFile>,
    ) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        let prefix = temporary::prefix(target);
        builder.prefix(&prefix);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        // Made and noted under one lock, so that it is known as long as it is there.
        let mut known = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
        let file = make(&builder, folder_of(target))?;
        let name = file.path().to_owned();
        known.push(name.clone());
        Ok(Self { file: Some(file), name })
    }

    pub fn file(&mut self) -> &mut NamedTempFile {
        self.file.as_mut().expect("it is there until it is persisted")
    }

    /// Gives it its final name.
    pub fn persist(mut self, target: &Path) -> io::Result<()> {
        let file = self.file.take().expect("it is persisted once");
        file.persist(target).map(drop).map_err(|error| error.error)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // Removed first, forgotten after.
        drop(self.file.take());
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).retain(|known| *known != self.name);
    }
}

/// Creates `path` whole or not at all. `write` fills the temporary file that it is given, through its handle or by its name. An existing
/// file is replaced and keeps its permissions; a symbolic link is followed; a device is written to.
///
/// # Errors
/// What `write` or the system says; nothing is left behind then.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut NamedTempFile) -> Result<(), String>,
) -> Result<(), OutputError> {
    let fail = |e: &dyn std::fmt::Display| OutputError::new(path, e);
    match Target::of(path).map_err(|e| fail(&e))? {
        Target::Device => {
            let elsewhere = |builder: &tempfile::Builder<'_, '_>, _: &Path| builder.tempfile_in(std::env::temp_dir());
            let mut unfinished = Unfinished::within(path, elsewhere).map_err(|e| fail(&e))?;
            write(unfinished.file()).map_err(|e| fail(&e))?;
            let copy = || -> io::Result<()> {
                let mut written = File::open(&unfinished.name)?;
                io::copy(&mut written, &mut File::options().write(true).open(path)?).map(drop)
            };
            copy().map_err(|e| fail(&e))
        }
        Target::File(target) => {
            let mut unfinished = Unfinished::beside(&target).map_err(|e| fail(&e))?;
            write(unfinished.file()).map_err(|e| fail(&e))?;
            unfinished.file().flush().map_err(|e| fail(&e))?;
            // Writers that went by the name may have left another file under it than the handle's.
            File::open(&unfinished.name).and_then(|file| file.sync_all()).map_err(|e| fail(&e))?;
            unfinished.persist(&target).map_err(|e| fail(&e))
        }
    }
}

/// Whether [`write_atomically`] could write to `path` now: better known before hours of work than after.
///
/// # Errors
/// Why it could not.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    let check = || -> io::Result<()> {
        match Target::of(path)? {
            Target::Device => File::options().write(true).open(path).map(drop),
            Target::File(target) => Unfinished::beside(&target).map(drop),
        }
    };
    check().map_err(|e| OutputError::new(path, e))
}

/// Ends the process at once, without what [`write_atomically`] is writing at this moment.
pub fn exit_at_once(code: i32) -> ! {
    // Held to the end, so that a writer whose file is taken away here waits instead of ending the process with an error of its own.
    let mut unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    for path in unfinished.drain(..) {
        let _ = std::fs::remove_file(path);
    }
    // Destructors of C++ libraries do not expect threads that still work.
    signal_hook::low_level::exit(code)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn put(path: &Path, text: &str) -> Result<(), OutputError> {
        write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|e| e.to_string()))
    }

    fn listing(folder: &Path) -> usize {
        std::fs::read_dir(folder).expect("a folder").count()
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        assert!(write_atomically(&path, |_| Err("no".into())).is_err());
        assert_eq!(listing(folder.path()), 0);
        assert!(put(&folder.path().join("no/such/folder/a"), "a").is_err());
        assert!(put(folder.path(), "a").is_err());
        assert!(check_writable(&folder.path().join("new/")).is_err());
    }

    /// Several that write the same file with `put` at once do not meet: each puts a whole one there, and whoever reads it finds a whole one.
    pub fn writers_do_not_meet(path: &Path, put: impl Fn(&Path, &str) -> Result<(), OutputError> + Sync) {
        let check = |text: &str| {
            let first = text.chars().next().expect("it is not empty");
            assert!(text.len() == 100_000 && text.chars().all(|letter| letter == first));
        };
        std::thread::scope(|threads| {
            for letter in ["a", "b", "c"] {
                let (put, text) = (&put, letter.repeat(100_000));
                threads.spawn(move || (0..20).for_each(|_| put(path, &text).expect("written")));
            }
        });
        check(&std::fs::read_to_string(path).expect("there"));
    }

    #[test]
    fn writers_of_one_file_do_not_meet() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        std::thread::scope(|threads| {
            threads.spawn(|| writers_do_not_meet(&path, put));
            threads.spawn(|| {
                for _ in 0..200 {
                    let Ok(text) = std::fs::read_to_string(&path) else { continue };
                    assert_eq!(text.len(), 100_000);
                }
            });
        });
        assert_eq!(listing(folder.path()), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        put(&file, "one").expect("written");
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o640)).expect("set");
        symlink("file", &link).expect("linked");
        check_writable(&link).expect("writable");
        put(&link, "two").expect("written");
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&file).expect("there"), b"two");
        assert_eq!(file.metadata().expect("there").permissions().mode() & 0o777, 0o640);
        std::fs::remove_file(&file).expect("removed");
        put(&link, "three").expect("written");
        assert!(link.is_symlink() && std::fs::read(&file).expect("there") == b"three", "a link to nothing yet");
        assert_eq!(listing(folder.path()), 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_not_replaced() {
        let null = Path::new("/dev/null");
        check_writable(null).expect("writable");
        put(null, "nothing").expect("written");
        assert!(is_device(null));
    }

    #[test]
    fn a_file_written_by_name_counts() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        write_atomically(&path, |file| std::fs::write(file.path(), "by name").map_err(|e| e.to_string()))
            .expect("written");
        assert_eq!(std::fs::read(&path).expect("there"), b"by name");
    }
}
