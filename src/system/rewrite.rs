//! A file that is written time and again, whole or not at all each time: two files take turns. What was there before becomes the spare one and is written over the next time but one.
//!
//! Written over, a large file costs little more than copying its bytes. A new one takes memory that the system must find and clear, and room on the disk; the old one gives both back
//! at the same time. On a virtual machine whose free memory goes back to its host a gigabyte cost two seconds of processor time so, and a tenth of that written over.

use std::fs::{self, File};
use std::io::{self, Seek};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;

use super::output::{OutputError, Target, Unfinished, folder_of, write_atomically};
use super::temporary;

/// Writes `path` whole or not at all, as [`write_atomically`] does, and keeps what was there for the next time, beside it: until [`drop_spare`].
///
/// # Errors
/// What `write` or the system says; what was there is left as it was then.
pub fn rewrite(path: &Path, write: impl FnOnce(&mut File) -> Result<(), String>) -> Result<(), OutputError> {
    let fail = |e: &dyn std::fmt::Display| OutputError::new(path, e);
    let Target::File(target) = Target::of(path).map_err(|e| fail(&e))? else {
        return write_atomically(path, |file| write(file.as_file_mut()));
    };
    let mut unfinished = match claimed(&target) {
        Ok(claimed) => claimed,
        Err(_) => Unfinished::beside(&target).map_err(|e| fail(&e))?,
    };
    let file = unfinished.file().as_file_mut();
    write(file).map_err(|e| fail(&e))?;
    let end = |file: &mut File| -> io::Result<()> {
        // What it was may have been longer.
        let length = file.stream_position()?;
        file.set_len(length)?;
        file.sync_all()
    };
    end(file).map_err(|e| fail(&e))?;
    let old = Unfinished::within(&target, |builder, folder| builder.make_in(folder, |name| linked(&target, name)));
    unfinished.persist(&target).map_err(|e| fail(&e))?;
    // Where there was none, or there are no links, the next one is a new file. The old one is written over only once the disk knows that the name is the new one's.
    if let Ok(mut old) = old
        && is_nobodys(old.file().as_file())
        && File::open(folder_of(&target)).and_then(|folder| folder.sync_all()).is_ok()
    {
        let _ = old.persist(&spare(&target));
    }
    Ok(())
}

/// Whether it is a file that has one name: one that has others is somebody's copy.
fn is_nobodys(file: &File) -> bool {
    file.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.nlink() == 1)
}

/// Removes what [`rewrite`] has kept.
pub fn drop_spare(path: &Path) {
    if let Ok(Target::File(target)) = Target::of(path) {
        let _ = fs::remove_file(spare(&target));
    }
}

/// Where the spare file lies while nobody writes to it: in one place for all processes, so that whoever goes on with the work of one that was killed finds it.
fn spare(target: &Path) -> PathBuf {
    target.with_file_name(temporary::of_target(target) + "spare")
}

/// The spare file under a name of this process's own: of several that want it one gets it.
fn claimed(target: &Path) -> io::Result<Unfinished> {
    let spare = spare(target);
    let open = |name: &Path| {
        // Nothing that lies there under its name is followed or waited for.
        let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
        let file = File::options().read(true).write(true).custom_flags(flags.bits() as i32).open(name)?;
        if !is_nobodys(&file) {
            return Err(io::Error::other("it is not what was left there"));
        }
        file.set_permissions(target.metadata()?.permissions())?;
        Ok(file)
    };
    Unfinished::within(target, |builder, folder| {
        builder.make_in(folder, |name| {
            fs::rename(&spare, name)?;
            or_removed(name, open(name))
        })
    })
}

/// `target` under a second name.
fn linked(target: &Path, name: &Path) -> io::Result<File> {
    fs::hard_link(target, name)?;
    or_removed(name, File::open(name))
}

/// The file that was opened; where it was not its name goes.
fn or_removed(name: &Path, opened: io::Result<File>) -> io::Result<File> {
    opened.inspect_err(|_| drop(fs::remove_file(name)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::super::output::tests::writers_do_not_meet;
    use super::*;

    fn put(path: &Path, text: &str) -> Result<(), OutputError> {
        rewrite(path, |file| file.write_all(text.as_bytes()).map_err(|e| e.to_string()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("text")).collect();
        names.sort();
        names
    }

    #[test]
    fn two_files_take_turns() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        let mut inodes = vec![];
        put(&path, "begun").expect("written");
        let private = std::os::unix::fs::PermissionsExt::from_mode(0o600);
        fs::set_permissions(&path, private).expect("set");
        for text in ["a long one", "b", "longer than all before", "c", ""] {
            put(&path, text).expect("written");
            assert_eq!(fs::read_to_string(&path).expect("there"), text);
            inodes.push(path.metadata().expect("there").ino());
            assert_eq!(path.metadata().expect("there").mode() & 0o777, 0o600);
        }
        assert!(inodes[0] != inodes[1] && inodes[..3] == inodes[2..], "{inodes:?}");
        assert_eq!(names(folder.path()), [".lanternfish-x-spare", "x"]);
        drop_spare(&path);
        assert_eq!(names(folder.path()), ["x"]);
    }

    #[test]
    fn what_fails_leaves_what_was_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        for text in ["one", "two"] {
            put(&path, text).expect("written");
        }
        let failed = rewrite(&path, |file| {
            file.write_all(b"half").map_err(|e| e.to_string())?;
            Err("the disk is full".to_owned())
        });
        assert!(failed.expect_err("it failed").to_string().ends_with("the disk is full"));
        assert_eq!(fs::read_to_string(&path).expect("there"), "two");
        assert_eq!(names(folder.path()), ["x"]);
        assert!(put(&folder.path().join("none/x"), "a").is_err());
    }

    /// A copy that somebody made without copying.
    #[test]
    fn what_has_another_name_is_not_written_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        put(&path, "one").expect("written");
        fs::hard_link(&path, folder.path().join("copy")).expect("linked");
        for text in ["two", "three", "four"] {
            put(&path, text).expect("written");
        }
        assert_eq!(fs::read_to_string(folder.path().join("copy")).expect("there"), "one");
    }

    /// What somebody else put where the spare file lies is left alone.
    #[test]
    fn links_under_the_name_of_the_spare_are_not_followed() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, other) = (folder.path().join("x"), folder.path().join("other"));
        put(&path, "one").expect("written");
        fs::write(&other, "not mine").expect("written");
        std::os::unix::fs::symlink(&other, spare(&path)).expect("linked");
        put(&path, "two").expect("written");
        assert_eq!(fs::read_to_string(&path).expect("there"), "two");
        assert_eq!(fs::read_to_string(&other).expect("there"), "not mine");
        drop_spare(&path);
        assert_eq!(names(folder.path()), ["other", "x"]);
    }

    #[test]
    fn writers_of_one_file_do_not_meet() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x");
        writers_do_not_meet(&path, put);
        drop_spare(&path);
        assert_eq!(names(folder.path()), ["x"]);
    }
}
