//! Batch scripts for Slurm: an array of lessons, an array of renders that waits for it, and an array of merges that waits for those.
//!
//! A script is a head, with the options for `sbatch` and what this job is, and a body that is the same for all jobs (`slurm_render.sh`,
//! `slurm_merge.sh`). Options of `sbatch` are as in its manual page; of several of one name the last one counts.

use super::{FarmError, FarmJob, NUMBERED};

/// Before its time is up by this many seconds, a task is told so and keeps a checkpoint.
const NOTICE: u32 = 60;

/// What Slurm takes beyond the job.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SlurmOptions {
    /// Options of `sbatch` of the user's, each the rest of a line that begins with `#SBATCH`. They overrule those of renders and lessons, but
    /// for the lessons' array; merges keep theirs.
    pub sbatch: Vec<String>,
}

impl SlurmOptions {
    /// Checks them, and the folder for the logs.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, job: &FarmJob) -> Result<(), FarmError> {
        if job.folder.contains('\\') {
            return Err(FarmError::Backslash(job.folder.clone()));
        }
        let is_option = |text: &str| text.starts_with('-') && !text.chars().any(char::is_control);
        match self.sbatch.iter().find(|text| !is_option(text)) {
            Some(text) => Err(FarmError::Sbatch(text.clone())),
            None => Ok(()),
        }
    }
}

/// The script that renders: a task of the array for each part of each few frames, the parts of the first frames first. Where there is a lesson it is to be submitted with a
/// dependency on that.
///
/// # Errors
/// Where a word has a zero byte in it.
pub fn render_script(job: &FarmJob, options: &SlurmOptions) -> Result<String, FarmError> {
    let label = job.label();
    let last = job.tasks() - 1;
    let own = [
        format!("--job-name={label}"),
        format!("--output={}/logs/%A_%a.log", job.folder.replace('%', "%%")),
        format!("--array=0-{last}"),
    ];
    let own = own.iter().chain(&of_renders(job)).map(|option| quoted(option)).collect::<Vec<_>>();
    let what = format!("# Renders {}: a task for each part of a frame.", shown(&job.output));
    let head = head(&what, own.into_iter().chain(options.sbatch.iter().cloned()));
    rendering(job, head, if job.has_lesson() { "taught" } else { "" })
}

/// The script that renders the lesson of each frame; `None` where there is none.
///
/// # Errors
/// Where a word has a zero byte in it.
pub fn lesson_script(job: &FarmJob, options: &SlurmOptions) -> Result<Option<String>, FarmError> {
    if !job.has_lesson() {
        return Ok(None);
    }
    let label = job.label();
    let last = job.chunks() - 1;
    let own = [
        format!("--job-name={label}-lesson"),
        format!("--output={}/logs/lesson-%A_%a.log", job.folder.replace('%', "%%")),
    ];
    let own = own.iter().chain(&of_renders(job)).map(|option| quoted(option)).collect::<Vec<_>>();
    let array = format!("--array=0-{last}");
    let what = format!("# Renders the first samples of {}, which teach the others.", shown(&job.output));
    let head = head(&what, own.into_iter().chain(options.sbatch.iter().cloned()).chain([array]));
    rendering(job, head, "teaches").map(Some)
}

/// Options of `sbatch` for all that renders.
fn of_renders(job: &FarmJob) -> [String; 4] {
    [
        "--open-mode=append".to_owned(),
        format!("--chdir={}", job.working_folder),
        "--requeue".to_owned(),
        format!("--signal=B:USR1@{NOTICE}"),
    ]
}

/// A script of tasks that render, behind its head. `lesson` is what they have to do with one.
fn rendering(job: &FarmJob, mut text: String, lesson: &str) -> Result<String, FarmError> {
    text += &facts(job)?;
    assign(&mut text, "scene", &job.scene)?;
    text += "# What the tasks have to do with a lesson.\n";
    assign(&mut text, "lesson", lesson)?;
    let granted =
        [("threads", "--threads"), ("memory", "--memory-limit")].into_iter().filter(|(_, name)| !job.has_option(name));
    let granted: Vec<&str> = granted.map(|(what, _)| what).collect();
    text += "# What is Slurm's to say; the rest is said by the options.\n";
    assign(&mut text, "granted", &granted.join(" "))?;
    text += "# The options of the render.\nset --";
    for word in &job.options {
        text += " ";
        text += &word_of(word)?;
    }
    Ok(text + "\n\n" + include_str!("slurm_render.sh"))
}

/// The script that merges the parts of each frame; `None` where there is one part. It is to be submitted with a dependency on the renders.
///
/// # Errors
/// Where a word has a zero byte in it.
pub fn merge_script(job: &FarmJob, options: &SlurmOptions) -> Result<Option<String>, FarmError> {
    if job.parts == 1 {
        return Ok(None);
    }
    let label = job.label();
    let last = job.chunks() - 1;
    let own = [
        format!("--job-name={label}-merge"),
        format!("--output={}/logs/merge-%A_%a.log", job.folder.replace('%', "%%")),
        "--open-mode=append".to_owned(),
        format!("--array=0-{last}"),
        "--requeue".to_owned(),
    ];
    let what = format!("# Merges the parts of {}.", shown(&job.output));
    let mut text = head(&what, options.sbatch.iter().cloned().chain(own.iter().map(|option| quoted(option))));
    text += &facts(job)?;
    text += "# This file: an image that is newer is this job's own.\n";
    assign(&mut text, "script", &format!("{}/{MERGE}", job.folder))?;
    assign(&mut text, "keep_parts", if job.keep_parts { "yes" } else { "" })?;
    text += "# The PNG to write beside, if any.\n";
    assign(&mut text, "png", job.png.as_deref().unwrap_or(""))?;
    text += "# Part 0 is the lesson of the others, where there is one.\n";
    text += &format!("first_part={}\n", u8::from(!job.has_lesson()));
    Ok(Some(text + "\n" + NUMBERED + "\n" + include_str!("slurm_merge.sh")))
}

/// The names of the scripts in the job's folder.
pub const RENDER: &str = "render.sh";
/// The same.
pub const LESSON: &str = "lesson.sh";
/// The same.
pub const MERGE: &str = "merge.sh";

/// The options of `sbatch` that make renders wait for the lessons, job `number`: for all of them, since Slurm pairs tasks of arrays only if they have the same numbers. Where a
/// lesson fails, the renders that it was for say so, and the others go on.
pub fn after_lessons(number: &str) -> Vec<String> {
    vec![format!("--dependency=afterany:{number}")]
}

/// The options of `sbatch` that make merges wait for the renders of job `number`, and that end them where one of those fails.
pub fn after_renders(number: &str) -> Vec<String> {
    vec![format!("--dependency=afterok:{number}"), "--kill-on-invalid-dep=yes".to_owned()]
}

/// The number of a job in what `sbatch --parsable` prints: `number` or `number;cluster`.
pub fn job_number(printed: &str) -> Option<&str> {
    let number = printed.trim().split(';').next()?;
    (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then_some(number)
}

fn head(what: &str, options: impl Iterator<Item = String>) -> String {
    let mut text = format!("#!/bin/sh\n{what} Written by `lanternfish farm slurm`.\n");
    for option in options {
        text += "#SBATCH ";
        text += &option;
        text += "\n";
    }
    text + "\n"
}

/// What both scripts know.
fn facts(job: &FarmJob) -> Result<String, FarmError> {
    let mut text = String::new();
    for (name, value) in [("program", &job.program), ("output", &job.output)] {
        assign(&mut text, name, value)?;
    }
    text += "# Part K of N is this folder and name, with K-of-N.exr behind; what part 0 teaches the others ends in .lesson.\n";
    assign(&mut text, "part_names", &format!("{}/parts/{}", job.folder, job.stem()))?;
    text += &format!("parts={}\n", job.parts);
    text += &match &job.frames {
        Some(frames) => {
            format!("first={} last={} frames_per_task={}\n", frames.start(), frames.end(), job.frames_per_task)
        }
        None => "first='' last='' frames_per_task=1\n".to_owned(),
    };
    Ok(text)
}

fn assign(text: &mut String, name: &str, value: &str) -> Result<(), FarmError> {
    *text += &format!("{name}={}\n", word_of(value)?);
    Ok(())
}

/// A word as `sh` reads it.
fn word_of(word: &str) -> Result<String, FarmError> {
    if word.is_empty() {
        return Ok("''".to_owned());
    }
    shlex::try_quote(word).map(std::borrow::Cow::into_owned).map_err(|_| FarmError::Word(word.to_owned()))
}

/// A word as `sbatch` reads it in a line that begins with `#SBATCH`.
fn quoted(word: &str) -> String {
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"-_=/.,:%@+".contains(&b);
    if word.bytes().all(is_plain) {
        return word.to_owned();
    }
    format!("\"{}\"", word.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A name for a comment.
fn shown(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}
