//! What bad input must come to, and whether a run came to that: refused with exit code 3 and a message that names the file and the place, or
//! rendered; no panic, no hang, no more than 2 s of processor time, 1 GiB in memory or 4 GiB of addresses, and no file left behind by a refused scene.

use std::time::Duration;

use super::tally::{self, Tally};
use super::{Folder, HEAD};

/// Processor time that a run may take, in seconds, where nothing else is said.
const SECONDS: u32 = 2;

/// What a run may have in memory, in bytes.
const MOST_MEMORY: u64 = 1 << 30;

/// What a scene must come to.
#[derive(Clone, Copy, Debug)]
pub enum Fate {
    /// Exit code 3 and this in the message.
    Refused(&'static str),
    /// Exit code 4 and this in the message.
    Limit(&'static str),
    /// An image.
    Renders,
    /// An image and this in a warning.
    Warned(&'static str),
    /// Exit code 3, or an image with a warning that a block is never ended.
    Told,
    /// Either, as long as it is orderly.
    Orderly,
}
pub use Fate::*;

/// What went wrong in the cases of one test: all of them are told at its end.
#[derive(Default)]
pub struct Faults {
    list: Vec<String>,
    tally: Tally,
}

impl Drop for Faults {
    fn drop(&mut self) {
        let list = &self.list;
        assert!(std::thread::panicking() || list.is_empty(), "{} cases:\n{}", list.len(), list.join("\n----\n"));
    }
}

impl Faults {
    /// Renders `scene.pbrt` of the folder and checks what must hold of every run.
    pub fn render(&mut self, folder: &Folder, what: &str, fate: Fate) {
        self.render_within(folder, what, fate, SECONDS);
    }

    /// The same with its own limit of processor time, in seconds.
    pub fn render_within(&mut self, folder: &Folder, what: &str, fate: Fate, seconds: u32) {
        if let Err(fault) = render(folder, fate, (seconds, &[]), &mut self.tally) {
            self.list.push(format!("{what}: {fault}"));
        }
    }

    /// As [`Faults::render`], a small image whatever the scene says.
    pub fn render_small(&mut self, folder: &Folder, what: &str, fate: Fate) {
        if let Err(fault) = render(folder, fate, (SECONDS, &["--resolution", "16x9"]), &mut self.tally) {
            self.list.push(format!("{what}: {fault}"));
        }
    }

    /// What became of the runs so far; a new tally begins.
    pub fn tally(&mut self) -> Tally {
        std::mem::take(&mut self.tally)
    }

    /// Adds the runs so far, with damaged files of this format, to the table of all tests; a new tally begins.
    pub fn tell(&mut self, format: &'static str) {
        let tally = self.tally();
        println!("{format:<10} {tally}");
        tally::tell(format, &tally);
    }
}

/// Within so many seconds, with so many arguments more.
fn render(folder: &Folder, fate: Fate, (seconds, more): (u32, &[&str]), tally: &mut Tally) -> Result<(), String> {
    let before = folder.listing();
    let arguments =
        ["render", "scene.pbrt", "-o", "out.exr", "--stats", "out.json", "--png", "out.png", "--threads", "1"];
    let arguments = [&arguments, more].concat();
    let run = folder.start_within(&arguments, 4 << 20, seconds).end();
    let allowed = Duration::from_secs(seconds.into());
    tally.add(&run, allowed);
    let mut after = folder.listing();
    let flat = run.err.split_whitespace().collect::<Vec<_>>().join(" ");
    let check = |holds: bool, what: &str| match holds {
        true => Ok(()),
        false => Err(format!("{what}; it ended with {:?} and\n{}", run.code, run.err)),
    };
    check(!run.err.contains("panicked"), "it panicked")?;
    let mut written = 0;
    for file in ["out.exr", "out.json", "out.png"] {
        written += i32::from(after.remove(file).is_some());
        let _ = std::fs::remove_file(folder.path(file));
    }
    check(!run.hung, "it hung")?;
    check(run.cpu <= allowed, &format!("it took {:.2} s of processor time", run.cpu.as_secs_f64()))?;
    check(run.memory <= MOST_MEMORY, &format!("it had {} MiB in memory", run.memory >> 20))?;
    check(matches!(run.code, Some(0 | 3 | 4)), "neither done nor refused")?;
    check(written == if run.code == Some(0) { 3 } else { 0 }, "output is missing or left behind")?;
    check(before == after, "files were left behind")?;
    check(run.code == Some(0) || run.err.contains("error: "), "no message")?;
    // A place: scene.pbrt:4:1, or the file that is at fault.
    let placed =
        flat.contains("scene.pbrt:") || flat.contains("--> ") || flat.contains("junk:") || flat.contains("cannot read");
    let (code, needle) = match fate {
        Refused(needle) => (Some(3), needle),
        Limit(needle) => (Some(4), needle),
        Renders => (Some(0), ""),
        Warned(needle) => (Some(0), needle),
        Told if run.code == Some(0) => (Some(0), "never ended"),
        Told => (Some(3), ""),
        Orderly => (run.code, ""),
    };
    check(run.code == code, &format!("expected to end with {code:?}"))?;
    check(flat.contains(needle), &format!("expected {needle:?}"))?;
    check(run.code == Some(0) || placed, "no place")
}

/// Each text, after the usual head unless it is a whole scene, must come to its fate.
pub fn each(cases: &[(&str, Fate)]) {
    let folder = Folder::new("nonsense");
    let mut faults = Faults::default();
    for (text, fate) in cases {
        let text = if text.contains("WorldBegin") { (*text).to_owned() } else { format!("{HEAD}{text}\n") };
        folder.write("scene.pbrt", &text);
        faults.render(&folder, &text, *fate);
    }
}
