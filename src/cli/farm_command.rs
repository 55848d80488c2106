//! `lanternfish farm`: checks what is to be rendered, writes what a scheduler reads, and hands it over.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};

use clap::Parser;

use super::ExitStatus;
use super::arguments::{Arguments, Command};
use super::diagnostics::{print_message, say};
use super::farm_arguments::{FarmArguments, JobArguments, Scheduler, SlurmArguments};
use super::frames::{has_place, numbered};
use crate::farm::slurm::{self, SlurmOptions};
use crate::farm::{FarmError, FarmJob, default_folder, openjd, plain_name};
use crate::system::output::{OutputError, check_writable, write_atomically};

/// Why nothing was handed over.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Job(#[from] FarmError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{}: {reason}", path.display())]
    Scene { path: PathBuf, reason: std::io::Error },
    #[error("{0}")]
    Other(String),
    /// The command line's parser has said it.
    #[error("the options of the render are wrong")]
    Options(clap::Error),
}

/// Runs the command.
pub fn run(arguments: &FarmArguments) -> ExitStatus {
    let done = match &arguments.scheduler {
        Scheduler::Slurm(arguments) => to_slurm(arguments),
        Scheduler::Openjd(arguments) => to_openjd(arguments),
    };
    match done {
        Ok(()) => ExitStatus::Done,
        Err(Failure::Options(error)) => {
            let _ = error.print();
            ExitStatus::Usage
        }
        Err(failure) => {
            print_message(&failure.to_string());
            match failure {
                Failure::Job(_) => ExitStatus::Usage,
                Failure::Scene { .. } => ExitStatus::BadInput,
                _ => ExitStatus::Failed,
            }
        }
    }
}

/// The job, where all that can be known before a task runs is right. The scheduler gives `more` options.
fn prepare(arguments: &JobArguments, frames_per_task: u32, more: &[&str]) -> Result<FarmJob, Failure> {
    let frames = arguments.frames.map(|frames| {
        let mut numbers = frames.numbers();
        let first = numbers.next().unwrap_or(0);
        first..=numbers.last().unwrap_or(first)
    });
    let output = if frames.is_some() { with_place(arguments.output.clone()) } else { arguments.output.clone() };
    let folder = arguments.folder.clone().unwrap_or_else(|| default_folder(&output));
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(unknown("this program"))?,
    };
    let mut job = FarmJob {
        program: plain_name(&program)?,
        scene: plain_name(&arguments.scene)?,
        output: plain_name(&output)?,
        folder: plain_name(&folder)?,
        working_folder: plain_name(&std::env::current_dir().map_err(unknown("this folder"))?)?,
        parts: arguments.parts,
        frames,
        frames_per_task,
        teaches: !arguments.no_lesson,
        keep_parts: arguments.keep_parts,
        options: arguments.options.clone(),
        png: None,
    };
    job.hand_over_png()?;
    job.check()?;
    check_options(&job, more)?;
    let first = |name: &str| match &job.frames {
        Some(frames) => numbered(Path::new(name), *frames.start()),
        None => PathBuf::from(name),
    };
    let scene = first(&job.scene);
    let found = File::open(&scene).and_then(|file| file.metadata());
    match found {
        Ok(metadata) if metadata.is_dir() => {
            return Err(Failure::Scene { path: scene, reason: std::io::ErrorKind::IsADirectory.into() });
        }
        Err(reason) => return Err(Failure::Scene { path: scene, reason }),
        Ok(_) => {}
    }
    check_writable(&first(&job.output))?;
    job.png.iter().try_for_each(|png| check_writable(&first(png)))?;
    Ok(job)
}

/// The image's name with a place for the number of the frame, which names of parts take over.
fn with_place(output: PathBuf) -> PathBuf {
    if output.file_name().is_some_and(|name| has_place(Path::new(name))) {
        return output;
    }
    let mut name = output.file_stem().unwrap_or_default().to_owned();
    name.push(".####");
    if let Some(ending) = output.extension() {
        name.push(".");
        name.push(ending);
    }
    output.with_file_name(name)
}

fn unknown(what: &'static str) -> impl Fn(std::io::Error) -> Failure {
    move |error| Failure::Other(format!("{what} cannot be found: {error}"))
}

/// Whether `render` would take the command line of the first task, which has `more` words on it: better known now than by a thousand tasks.
fn check_options(job: &FarmJob, more: &[&str]) -> Result<(), Failure> {
    let mut words = vec!["lanternfish", "render", &job.scene, "--recover", "-o", &job.output];
    words.extend(job.options.iter().map(String::as_str));
    let frames = job.frames.as_ref().map(|frames| format!("--frames={}", frames.start()));
    words.extend(frames.as_deref());
    if job.parts > 1 {
        words.extend(["--part", "1/2"]);
    }
    words.extend(more);
    match Arguments::try_parse_from(words) {
        Ok(Arguments { command: Command::Render(_) }) => Ok(()),
        Ok(_) => Err(Failure::Other("this is no render".to_owned())),
        Err(error) => Err(Failure::Options(error)),
    }
}

fn make_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| Failure::Other(format!("{}: {error}", path.display())))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    Ok(write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?)
}

/// A line on the standard output. That nobody reads it is no error.
fn tell(line: impl std::fmt::Display) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A command line as a person would type it.
fn typed<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    shlex::try_join(words).unwrap_or_default()
}

fn to_slurm(arguments: &SlurmArguments) -> Result<(), Failure> {
    let job = prepare(&arguments.job, arguments.frames_per_task, &[])?;
    let options = SlurmOptions { sbatch: arguments.sbatch.clone() };
    options.check(&job)?;
    let folder = Path::new(&job.folder);
    make_folder(&folder.join("logs"))?;
    if job.parts > 1 {
        make_folder(&folder.join("parts"))?;
    }
    let (tasks, chunks) = (job.tasks(), job.chunks());
    // What runs, in this order, each with what it waits for.
    let stages = [
        (slurm::LESSON, slurm::lesson_script(&job, &options)?, chunks, "teach"),
        (slurm::RENDER, Some(slurm::render_script(&job, &options)?), tasks, "render"),
        (slurm::MERGE, slurm::merge_script(&job, &options)?, chunks, "merge"),
    ];
    let stages: Vec<Stage> = stages
        .into_iter()
        .filter_map(|(name, text, tasks, does)| Some(Stage { path: folder.join(name), text: text?, tasks, does }))
        .collect();
    stages.iter().try_for_each(|stage| write(&stage.path, &stage.text))?;
    let mut numbers: Vec<String> = vec![];
    for stage in &stages {
        let Stage { path, tasks, does, .. } = stage;
        let options = numbers.last().map_or(vec![], |number| match *does {
            "render" => slurm::after_lessons(number),
            _ => slurm::after_renders(number),
        });
        if arguments.dry_run {
            let path = path.to_string_lossy();
            let words = ["sbatch"].into_iter().chain(options.iter().map(String::as_str)).chain([path.as_ref()]);
            let after = if options.is_empty() { "" } else { ", with the NUMBER of that job" };
            tell(format!("{tasks} tasks {does}{after}: {}", typed(words)));
            numbers.push("NUMBER".to_owned());
            continue;
        }
        match submit(path, &options, *tasks) {
            Ok(number) => {
                tell(format!("job {number}: {tasks} tasks {does}"));
                numbers.push(number);
            }
            Err(failure) => {
                // Parts that nothing merges would be of no use.
                numbers.iter().for_each(|number| cancel(number));
                return Err(failure);
            }
        }
    }
    if arguments.dry_run {
        return Ok(());
    }
    tell(format!("logs: {}", folder.join("logs").display()));
    Ok(())
}

/// An array of tasks.
struct Stage {
    path: PathBuf,
    text: String,
    tasks: u64,
    does: &'static str,
}

fn cancel(number: &str) {
    let ended = Process::new("scancel").arg(number).stdin(Stdio::null()).status();
    let is_ended = ended.is_ok_and(|status| status.success());
    say(format!("job {number} is {}", if is_ended { "cancelled" } else { "still there: cancel it with scancel" }));
}

/// Hands a script to `sbatch`, which says on the error output what it does not like; the number of its job.
fn submit(script: &Path, options: &[String], tasks: u64) -> Result<String, Failure> {
    let mut command = Process::new("sbatch");
    command.arg("--parsable").args(options).arg(script).stdin(Stdio::null()).stderr(Stdio::inherit());
    let output = command.output().map_err(|error| {
        Failure::Other(format!(
            "sbatch cannot be started: {error}; --dry-run only writes the scripts, to be submitted elsewhere"
        ))
    })?;
    let printed = String::from_utf8_lossy(&output.stdout);
    match slurm::job_number(&printed).filter(|_| output.status.success()) {
        Some(number) => Ok(number.to_owned()),
        // Slurm's own limit unless configured otherwise (MaxArraySize).
        None if tasks > 1000 => Err(Failure::Other(format!(
            "sbatch has not taken {}: it has {tasks} tasks, and many clusters take 1000 at most; --frames-per-task makes them fewer",
            script.display()
        ))),
        None => Err(Failure::Other(format!("sbatch has not taken {}", script.display()))),
    }
}

fn to_openjd(arguments: &JobArguments) -> Result<(), Failure> {
    let job = prepare(arguments, 1, &["--progress", "openjd"])?;
    let (template, values) = openjd::template(&job)?;
    let folder = Path::new(&job.folder);
    make_folder(folder)?;
    let path = folder.join(openjd::TEMPLATE);
    for (path, text) in [
        (path.clone(), serde_json::to_string_pretty(&template)),
        (folder.join(openjd::VALUES), serde_json::to_string_pretty(&openjd::bundle_values(&values))),
    ] {
        write(&path, &(text.map_err(|error| Failure::Other(error.to_string()))? + "\n"))?;
    }
    // The template has the other values as defaults.
    let paths: Vec<String> = values.iter().take(2).map(|(name, value)| format!("{name}={value}")).collect();
    let path = path.to_string_lossy();
    let words = ["openjd", "run", &path, "-p", &paths[0], "-p", &paths[1]];
    tell(format!("on this machine: {}", typed(words)));
    tell(format!("on Deadline Cloud: {}", typed(["deadline", "bundle", "submit", &job.folder])));
    Ok(())
}
