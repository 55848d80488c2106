//! Farms: real schedulers on this machine run what `lanternfish farm` writes for them, tasks are killed midway, and the image is the one that
//! would have been without.
//!
//! What a test needs is installed by `tests/setup-farm.sh`; where it is not there the test says so and passes.

mod command;
mod openjd;
#[path = "../program/mod.rs"]
mod program;
mod slurm;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use lanternfish::film::ChannelImage;
use lanternfish::film::exr::read_exr_layers;

/// A program of this name in the folders of `PATH`, or in those where servers are.
fn find(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).chain(["/usr/sbin".into(), "/sbin".into()]).collect();
    folders.into_iter().map(|folder| folder.join(name)).find(|file| file.is_file())
}

/// A scene of many lamps in more pixels, and more samples, so that a part of it takes a second or two.
fn scene(samples: u32) -> String {
    let large = "\"integer xresolution\" 128 \"integer yresolution\" 96";
    let text = program::lamps().replace("\"integer xresolution\" 16 \"integer yresolution\" 12", large);
    text.replace("\"integer pixelsamples\" 4", &format!("\"integer pixelsamples\" {samples}"))
}

/// The pixels of an image, bit by bit.
fn pixels(path: &Path) -> Vec<(String, Vec<u32>)> {
    let ChannelImage { channels, .. } =
        read_exr_layers(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    channels.into_iter().map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect())).collect()
}

/// Runs the program, which must succeed.
fn lanternfish(folder: &Path, words: &[impl AsRef<OsStr>]) {
    let output = Command::new(program::PROGRAM).args(words).current_dir(folder).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Waits for something; what it is says the message.
#[track_caller]
fn wait<T>(what: &str, seconds: u64, mut found: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(seconds), "{what}: nothing for {seconds} s");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Whether something comes within so many seconds.
fn comes(seconds: u64, mut is_there: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !is_there() {
        if start.elapsed() > Duration::from_secs(seconds) {
            return false;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    true
}

/// The process of the program under test that has this word on its command line.
fn process_with(word: &str) -> Option<u32> {
    let program = Path::new(program::PROGRAM).canonicalize().ok()?;
    std::fs::read_dir("/proc").ok()?.filter_map(Result::ok).find_map(|entry| {
        let number = entry.file_name().to_str()?.parse().ok()?;
        let words = std::fs::read(entry.path().join("cmdline")).ok()?;
        let is_it = words.split(|b| *b == 0).any(|found| found == word.as_bytes());
        (is_it && std::fs::read_link(entry.path().join("exe")).ok()? == program).then_some(number)
    })
}

/// The process that has started another, if that is still there.
fn parent(process: u32) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("PPid:")?.trim().parse().ok())
}

/// Sends a signal to a process, if it is still there.
fn signal(process: u32, name: &str) {
    let status = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).status();
    status.expect("sh is there");
}
