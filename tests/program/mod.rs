//! What the tests of the built program share: folders of files, runs under limits, and what must hold of every run.

#![allow(dead_code)] // each test binary uses its part

pub mod faults;
pub mod tally;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use wait4::{ResUse, Wait4};

/// The program under test.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_lanternfish");

/// A lamp over a floor, 16 × 12 pixels, 4 samples each: the smallest scene that has something of everything surfaces need.
pub const LAMP: &str = r#"LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 16 "integer yresolution" 12
Sampler "zsobol" "integer pixelsamples" 4
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 5 5]
  Translate 0 2 0
  Shape "sphere" "float radius" 0.5
AttributeEnd
Material "diffuse" "rgb reflectance" [0.5 0.4 0.3]
Shape "trianglemesh" "point3 P" [-5 -1 -5  5 -1 -5  5 -1 5  -5 -1 5] "integer indices" [0 1 2 0 2 3]
"#;

/// The directives before `WorldBegin` of a small quick image, with it.
pub const HEAD: &str = r#"LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 8 "integer yresolution" 6
Sampler "zsobol" "integer pixelsamples" 2
WorldBegin
LightSource "point" "point3 from" [1 2 -3]
"#;

/// A folder for one test, removed when dropped.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}-{number}", std::process::id()));
        fs::create_dir_all(&path).expect("a folder for the test");
        Self(path)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        fs::write(self.path(name), content).expect("the file can be written");
        self
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).expect("the file is JSON")
    }

    /// Names and sizes of everything in the folder, hidden files too.
    pub fn listing(&self) -> BTreeMap<String, u64> {
        let entries = fs::read_dir(&self.0).expect("the folder is there").map(|e| e.expect("an entry"));
        entries.map(|e| (e.file_name().to_string_lossy().into_owned(), e.metadata().map_or(0, |m| m.len()))).collect()
    }

    /// Runs the program in this folder.
    pub fn run(&self, arguments: &[&str]) -> Run {
        self.start(arguments).end()
    }

    /// Starts the program in this folder: at most 4 GiB of address space and 10 s of processor time.
    pub fn start(&self, arguments: &[&str]) -> Running {
        self.start_within(arguments, 4 << 20, 10)
    }

    /// The same with its own limits: KiB of address space, seconds of processor time.
    pub fn start_within(&self, arguments: &[&str], kib: u64, seconds: u32) -> Running {
        self.start_by(&format!("ulimit -v {kib}; ulimit -t {seconds}; exec \"$@\""), arguments)
    }

    /// Starts the program in this folder by a script for `sh`, which finds the command as `"$@"`.
    pub fn start_by(&self, script: &str, arguments: &[&str]) -> Running {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        // Beside the folder, so that its listing shows only what the program did.
        let beside = |kind: &str| self.0.with_extension(format!("{number}.{kind}"));
        let (out, err) = (beside("out"), beside("err"));
        let file = |path: &Path| Stdio::from(fs::File::create(path).expect("output is collected"));
        let child = Command::new("sh")
            .args(["-c", script, "sh", PROGRAM])
            .args(arguments)
            .current_dir(&self.0)
            .stdin(Stdio::null())
            .stdout(file(&out))
            .stderr(file(&err))
            .spawn()
            .expect("sh is there");
        Running { child, out, err }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A run that has not ended.
pub struct Running {
    pub child: Child,
    out: PathBuf,
    err: PathBuf,
}

/// Nothing may hang: no run may take longer than this by the clock, however busy the machine.
const PATIENCE: Duration = Duration::from_secs(120);

impl Running {
    /// The error output so far.
    pub fn errors(&self) -> String {
        String::from_utf8_lossy(&fs::read(&self.err).unwrap_or_default()).into_owned()
    }

    /// Sends a signal by name; `sh` has made way for the program, so it is the program's own. False where it has ended already.
    pub fn signal(&self, name: &str) -> bool {
        let status = Command::new("sh").args(["-c", &format!("kill -{name} {}", self.child.id())]).status();
        status.expect("sh is there").success()
    }

    /// Interrupts it as Ctrl-C does; by a request to terminate where the tests run in the background of a shell, whose children ignore
    /// the former.
    pub fn interrupt(&self) -> bool {
        self.signal(if is_ignored(2) { "TERM" } else { "INT" })
    }

    /// Waits for the end.
    pub fn end(mut self) -> Run {
        let start = Instant::now();
        let mut hung = false;
        while !self.is_over() {
            hung = start.elapsed() > PATIENCE;
            if hung {
                let _ = self.child.kill();
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let ResUse { status, rusage } = self.child.wait4().expect("a child that has ended can be waited for");
        let take = |path: &Path| {
            let text = String::from_utf8_lossy(&fs::read(path).unwrap_or_default()).into_owned();
            let _ = fs::remove_file(path);
            text
        };
        let cpu = rusage.utime + rusage.stime;
        Run { code: status.code(), out: take(&self.out), err: take(&self.err), memory: rusage.maxrss, cpu, hung }
    }

    /// Whether it has ended; what it took is there to be asked for until it is waited for.
    fn is_over(&self) -> bool {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap_or_default();
        // "123 (name) Z": a zombie. The name may hold anything.
        stat.rsplit_once(") ").is_none_or(|(_, rest)| rest.starts_with(['Z', 'X']))
    }
}

/// How a run ended. No code: a signal ended it.
#[derive(Debug)]
pub struct Run {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
    /// The most that it, or any process that it started, had in memory at once, in bytes.
    pub memory: u64,
    /// Processor time, with that of the processes that it started.
    pub cpu: Duration,
    /// It did not end, and was made to.
    pub hung: bool,
}

impl Run {
    /// Fails unless the run ended with this code.
    #[track_caller]
    pub fn code(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{}\n{}", self.out, self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        self
    }

    /// Fails unless the error output has this in it.
    #[track_caller]
    pub fn says(self, what: &str) -> Self {
        // Messages are wrapped to the width of a terminal.
        let words: String = self.err.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(what), "expected {what:?} in\n{}", self.err);
        self
    }
}

/// A generator for seeded damage (SplitMix64: Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.draw() % n.max(1) as u64) as usize
    }
}

/// `bytes` with one to four things wrong: bytes changed, removed, repeated or put in.
pub fn damage(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(24)).min(bytes.len());
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.draw() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            4 => bytes[at..end].fill(b'9'),
            _ => {
                let words = ["-1", "1e38", "nan", "inf", "99999999999", "\"", "[", "]", "\0", "\u{fffd}"];
                bytes.splice(at..at, words[random.below(words.len())].bytes());
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

/// Whether this process ignores a signal, which the processes that it starts inherit.
pub fn is_ignored(signal: u32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// With lamps enough that which of them are hidden is learned.
pub fn lamps() -> String {
    let lamp = |i: i32| {
        let (x, y, z) = (i % 7 - 3, f64::from(i % 5) - 0.9, f64::from(i % 6) - 2.0);
        format!("LightSource \"point\" \"rgb I\" [0.4 0.3 0.2] \"point3 from\" [{x} {y} {z}]\n")
    };
    LAMP.to_owned() + &(0..40).map(lamp).collect::<String>()
}
