//! `lanternfish try`: renders scenes in processes of their own and says what became of each, a row a scene.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus as Ended, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::ExitStatus;
use super::arguments::TryArguments;
use super::diagnostics::print_message;
use super::interrupt::Interrupts;
use crate::system::input::read_regular;

/// How often it is looked whether a render has ended.
const LOOK: Duration = Duration::from_millis(5);
/// What a file is searched for `WorldBegin` in: exporters write the world after a short header.
const MAX_HEADER: u64 = 1 << 20;
/// Folders within folders beyond this are not looked into: links may lead in circles.
const DEEPEST: usize = 16;

/// What became of a scene.
#[derive(Debug, Serialize)]
struct Trial {
    scene: PathBuf,
    /// From starting the process to its end.
    seconds: f64,
    /// Largest resident memory in bytes, if it got to its end.
    peak_memory: Option<u64>,
    /// `None` where the render did not get to its end.
    warnings: Option<Vec<String>>,
    /// Samples that were NaN or infinite.
    non_finite_samples: u64,
    /// Exit code; `None` if it was ended by a signal or by the limit.
    code: Option<i32>,
    /// "ok", or what went wrong, in a line.
    verdict: String,
}

/// Runs the command: 0 if all scenes work, else 3.
pub fn run(arguments: &TryArguments) -> ExitStatus {
    let scenes = match find(&arguments.paths) {
        Ok(scenes) => scenes,
        Err(message) => {
            print_message(&message);
            return ExitStatus::BadInput;
        }
    };
    let temporary = match tempfile::tempdir() {
        Ok(folder) => folder,
        Err(error) => {
            print_message(&format!("no folder for the images can be made: {error}"));
            return ExitStatus::Failed;
        }
    };
    let out = arguments.out.as_deref().unwrap_or(temporary.path());
    if let Err(error) = std::fs::create_dir_all(out) {
        print_message(&format!("{}: {error}", out.display()));
        return ExitStatus::Failed;
    }
    let stop = Interrupts::listen();
    stop.rendering(true);
    let say = |line: String| {
        if !arguments.json {
            // That nobody reads it is no error.
            let _ = writeln!(std::io::stdout(), "{line}");
        }
    };
    let widest = scenes.iter().map(|scene| scene.display().to_string().chars().count()).max().unwrap_or(0).max(5);
    say(format!("{:widest$}  {:>8}  {:>8}  {:>8}  verdict", "scene", "seconds", "MiB", "warnings"));
    let mut trials = Vec::new();
    for (number, scene) in scenes.iter().enumerate() {
        let trial = render(scene, &out.join(output_name(number, scene)), arguments, &stop.stop);
        let count = |n: Option<u64>| n.map_or("-".to_owned(), |n| n.to_string());
        say(format!(
            "{:widest$}  {:>8.2}  {:>8}  {:>8}  {}",
            scene.display().to_string(),
            trial.seconds,
            count(trial.peak_memory.map(|bytes| bytes >> 20)),
            count(trial.warnings.as_ref().map(|list| list.len() as u64)),
            trial.verdict
        ));
        trials.push(trial);
        if stop.stop.load(Ordering::Relaxed) {
            return ExitStatus::Interrupted;
        }
    }
    let failed = trials.iter().filter(|trial| trial.verdict != OK).count();
    say(format!("{} of {} scenes work", trials.len() - failed, trials.len()));
    if arguments.json
        && let Ok(text) = serde_json::to_string_pretty(&trials)
    {
        let _ = writeln!(std::io::stdout(), "{text}");
    }
    if failed == 0 { ExitStatus::Done } else { ExitStatus::BadInput }
}

const OK: &str = "ok";

/// A file name for the scene's image that no other scene has.
fn output_name(number: usize, scene: &Path) -> String {
    let name = scene.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let stem = name.trim_end_matches(".gz").trim_end_matches(".pbrt");
    format!("{:03}-{stem}.exr", number + 1)
}

fn render(scene: &Path, image: &Path, arguments: &TryArguments, stop: &AtomicBool) -> Trial {
    let start = Instant::now();
    let (stats, log) = (image.with_extension("json"), image.with_extension("log"));
    let ended = start_and_wait(scene, image, &stats, &log, arguments, stop);
    let seconds = start.elapsed().as_secs_f64();
    let statistics: serde_json::Value = std::fs::read(&stats)
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .unwrap_or(serde_json::Value::Null);
    let lines = |value: &serde_json::Value| -> Option<Vec<String>> {
        value.as_array().map(|list| list.iter().filter_map(|line| line.as_str().map(str::to_owned)).collect())
    };
    let non_finite_samples = statistics["non_finite_samples"].as_u64().unwrap_or(0);
    let (code, verdict) = match ended {
        Ok(status) if status.success() && non_finite_samples > 0 => {
            (status.code(), format!("{non_finite_samples} samples are not finite"))
        }
        Ok(status) if status.success() => (status.code(), OK.to_owned()),
        Ok(status) => (status.code(), reason(status, &log)),
        Err(message) => (None, message),
    };
    Trial {
        scene: scene.to_owned(),
        seconds,
        peak_memory: statistics["peak_memory"].as_u64(),
        warnings: lines(&statistics["warnings"]),
        non_finite_samples,
        code,
        verdict,
    }
}

/// The first error in what the render said.
fn reason(status: Ended, log: &Path) -> String {
    let said = std::fs::read(log).unwrap_or_default();
    let said = String::from_utf8_lossy(&said);
    let mut lines = said.lines();
    let error = lines.find(|line| line.starts_with("error")).map(str::to_owned);
    // An excerpt begins with its place.
    let place = lines.next().and_then(|line| line.trim_start().strip_prefix("--> ")).map(|place| format!(" ({place})"));
    match (error, status.code()) {
        (Some(error), _) => format!("{error}{}", place.unwrap_or_default()),
        (None, Some(code)) => format!("ended with exit code {code}"),
        (None, None) => format!("crashed: {status}"),
    }
}

fn start_and_wait(
    scene: &Path,
    image: &Path,
    stats: &Path,
    log: &Path,
    arguments: &TryArguments,
    stop: &AtomicBool,
) -> Result<Ended, String> {
    let fail = |error: std::io::Error| format!("could not be started: {error}");
    let mut command = Command::new(std::env::current_exe().map_err(fail)?);
    command.arg("render").arg(scene).args(["--spp", &arguments.spp.to_string(), "--quiet", "-o"]).arg(image);
    command.arg("--png").arg(image.with_extension("png")).arg("--stats").arg(stats);
    if let Some([width, height]) = arguments.resolution {
        command.args(["--resolution", &format!("{width}x{height}")]);
    }
    if arguments.strict {
        command.arg("--strict");
    }
    let log = File::create(log).map_err(fail)?;
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log).spawn().map_err(fail)?;
    let start = Instant::now();
    let limit = Duration::try_from_secs_f64(arguments.time_limit).unwrap_or(Duration::MAX);
    loop {
        if let Some(status) = child.try_wait().map_err(fail)? {
            return Ok(status);
        }
        let is_late = start.elapsed() > limit;
        if is_late || stop.load(Ordering::Relaxed) {
            // It may have ended by itself meanwhile.
            let _ = child.kill();
            let _ = child.wait();
            return Err(if is_late { format!("not done after {} s", arguments.time_limit) } else { "stopped".into() });
        }
        std::thread::sleep(LOOK);
    }
}

/// The scenes that `paths` name: files as they are, of folders all scenes in them, in order of their names.
fn find(paths: &[PathBuf]) -> Result<Vec<PathBuf>, String> {
    let mut scenes = Vec::new();
    for path in paths {
        if path.is_dir() {
            let before = scenes.len();
            search(path, 0, &mut scenes).map_err(|error| format!("{}: {error}", path.display()))?;
            if scenes.len() == before {
                return Err(format!("{}: there are no scenes in it", path.display()));
            }
            scenes[before..].sort();
        } else {
            scenes.push(path.clone());
        }
    }
    Ok(scenes)
}

fn search(folder: &Path, depth: usize, scenes: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if depth < DEEPEST {
                search(&path, depth + 1, scenes)?;
            }
            continue;
        }
        let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().to_ascii_lowercase());
        if name.ends_with(".pbrt.gz") || (name.ends_with(".pbrt") && has_world(&path)) {
            scenes.push(path);
        }
    }
    Ok(())
}

/// Whether the file is a scene of its own. One too large to be looked through is.
fn has_world(path: &Path) -> bool {
    let word = b"WorldBegin";
    match read_regular(path, MAX_HEADER) {
        Ok(bytes) => bytes.windows(word.len()).any(|part| part == word),
        Err(error) => error.kind() == std::io::ErrorKind::FileTooLarge,
    }
}
