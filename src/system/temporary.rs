//! Names of temporary files, which tell what they were to become and who writes them, and sweeping those whose writer is dead.
//!
//! A file on its way to `image.exr` is called `.lanternfish-image.exr-MACHINE-PROCESS-RANDOM` in the same folder, so no two writers ever share one, on whatever machines: that
//! holds on network file systems too, where locks do not always. Who is killed leaves his file. The next one who writes `image.exr` in that folder removes what is there
//! of processes that are dead, if they were of this machine since it was started and of this container (process numbers mean nothing elsewhere), and of any
//! others once nothing was written to it for a day. A writer that lives after all is not harmed by more than an error: its file is gone when it is to be renamed.

use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use rustix::io::Errno;
use rustix::process::{Pid, test_kill_process};

/// What all of them begin with.
const COMMON: &str = ".lanternfish-";

/// Names of files that are longer are cut: a name has 255 bytes at most.
const LONGEST: usize = 120;

/// What nobody has written to for so long is of nobody.
const FORGOTTEN: Duration = Duration::from_secs(24 * 3600);

/// What temporary files on their way to `target` begin with if this process writes them.
pub(super) fn prefix(target: &Path) -> String {
    format!("{}{}-{}-", of_target(target), machine(), std::process::id())
}

/// What all of them begin with, whoever writes them.
pub(super) fn of_target(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    if name.len() <= LONGEST {
        return format!("{COMMON}{name}-");
    }
    let end = (0..=LONGEST).rev().find(|&end| name.is_char_boundary(end)).unwrap_or(0);
    format!("{COMMON}{}~{:08x}-", &name[..end], crc32fast::hash(name.as_bytes()))
}

/// What tells this machine, since it was started, and this container from others: eight hexadecimal digits.
fn machine() -> &'static str {
    static MACHINE: OnceLock<String> = OnceLock::new();
    MACHINE.get_or_init(|| {
        let boot = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        let processes = std::fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
        format!("{:08x}", crc32fast::hash(format!("{boot} {} {name}", processes.display()).as_bytes()))
    })
}

/// Removes from `folder` what dead processes left on its way to `target`. `own` is a file that was just made there: it tells the time of the file system.
pub(super) fn sweep(folder: &Path, target: &Path, own: &Path) {
    let Ok(entries) = folder.read_dir() else { return };
    let start = of_target(target);
    let now = own.metadata().and_then(|metadata| metadata.modified());
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(writer) = name.to_str().and_then(|name| name.strip_prefix(&start)).and_then(Writer::of) else {
            continue;
        };
        let is_forgotten = || {
            let written = entry.metadata().and_then(|metadata| metadata.modified()).ok()?;
            Some(now.as_ref().ok()?.duration_since(written).ok()? > FORGOTTEN)
        };
        if writer.is_dead() || is_forgotten() == Some(true) {
            // Another one may sweep at the same time.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Who writes a temporary file.
struct Writer<'a> {
    machine: &'a str,
    process: i32,
}

impl<'a> Writer<'a> {
    /// From the end of a name: `MACHINE-PROCESS-RANDOM`.
    fn of(end: &'a str) -> Option<Self> {
        let mut parts = end.split('-');
        let (machine, process, random) = (parts.next()?, parts.next()?, parts.next()?);
        let is_one = machine.len() == 8 && !random.is_empty() && parts.next().is_none();
        process.parse().ok().filter(|_| is_one).map(|process| Self { machine, process })
    }

    /// Whether it is known that it is no more.
    fn is_dead(&self) -> bool {
        let is_gone = |pid| test_kill_process(pid) == Err(Errno::SRCH);
        self.machine == machine() && Pid::from_raw(self.process).is_some_and(is_gone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_dead_left_is_swept_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("a.exr");
        // A process that has ended, and was waited for.
        let mut child = std::process::Command::new("true").spawn().expect("true is there");
        let dead = child.id();
        child.wait().expect("it has ended");
        let (here, living) = (machine(), std::process::id());
        let make = |name: &str| {
            std::fs::write(folder.path().join(name), "half").expect("written");
            name.to_owned()
        };
        let gone = make(&format!(".lanternfish-a.exr-{here}-{dead}-Ab3dEf"));
        let old = make(&format!(".lanternfish-a.exr-00000000-{living}-Ab3dEf"));
        let before = std::time::SystemTime::now() - Duration::from_secs(25 * 3600);
        let file = std::fs::File::options().write(true).open(folder.path().join(&old)).expect("there");
        file.set_modified(before).expect("set");
        let mut kept = vec![
            make(&format!(".lanternfish-a.exr-{here}-{living}-Ab3dEf")),
            make(&format!(".lanternfish-a.exr-00000000-{dead}-Ab3dEf")),
            make(&format!(".lanternfish-a.exr.checkpoint-{here}-{dead}-Ab3dEf")),
            make(".lanternfish-a.exr-notes"),
            make("a.exr"),
            make("own"),
        ];
        sweep(folder.path(), &target, &folder.path().join("own"));
        let mut left: Vec<String> = folder
            .path()
            .read_dir()
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().into_string().expect("text"))
            .collect();
        left.sort();
        kept.sort();
        assert_eq!(left, kept, "{gone} and {old} should have gone");
    }

    #[test]
    fn long_names_fit_and_stay_apart() {
        let name = |end: &str| of_target(Path::new(&format!("/a/{}{end}", "ü".repeat(110))));
        assert!(name("1").len() < 160 && name("1") != name("2"), "{}", name("1"));
        assert_eq!(of_target(Path::new("b.exr")), ".lanternfish-b.exr-");
    }
}
