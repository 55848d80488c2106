//! What the command line says of farms.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::frames::Frames;

/// `lanternfish farm`.
#[derive(Args, Debug)]
pub struct FarmArguments {
    /// Which scheduler.
    #[command(subcommand)]
    pub scheduler: Scheduler,
}

/// Schedulers.
#[derive(Debug, Subcommand)]
pub enum Scheduler {
    /// Render on a Slurm cluster: write batch scripts and submit them: an array of lessons, one of renders and one of merges, each waiting for the one before.
    Slurm(SlurmArguments),
    /// Write a job template of Open Job Description, for AWS Deadline Cloud and other schedulers that read it.
    Openjd(JobArguments),
}

/// What to render and how it is shared out.
#[derive(Args, Debug)]
pub struct JobArguments {
    /// The scene; with --frames, `####` in its name is the frame's number.
    pub scene: PathBuf,
    /// The OpenEXR file to write; with --frames, `####` in its name is the frame's number.
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: PathBuf,
    /// Divide the samples of each pixel into this many parts, each a task of its own; they are merged when all are there.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    pub parts: u32,
    /// Render frames A to B, both among them.
    #[arg(long, value_name = "A..B", value_parser = Frames::parse, allow_hyphen_values = true)]
    pub frames: Option<Frames>,
    /// The folder for what the farm needs, which all its machines must see [default: NAME.farm beside OUT.exr].
    #[arg(long, value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// The program on the farm's machines [default: this one].
    #[arg(long, value_name = "PATH")]
    pub program: Option<PathBuf>,
    /// Let each part learn for itself. Otherwise the first samples of each frame are a task of their own that its parts wait for: what it learns about the lights they all begin
    /// with, and no part has to build it again.
    #[arg(long)]
    pub no_lesson: bool,
    /// Keep the parts when they are merged.
    #[arg(long)]
    pub keep_parts: bool,
    /// Options of `lanternfish render` for every task.
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub options: Vec<String>,
}

/// `lanternfish farm slurm`.
#[derive(Args, Debug)]
pub struct SlurmArguments {
    /// What to render.
    #[command(flatten)]
    pub job: JobArguments,
    /// How many frames a task renders, one after the other.
    #[arg(long, value_name = "M", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), requires = "frames")]
    pub frames_per_task: u32,
    /// Write the scripts, say how to submit them, and submit nothing.
    #[arg(long)]
    pub dry_run: bool,
    /// An option of sbatch, written as it is behind `#SBATCH`, such as --partition=night. May be given several times.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<String>,
}
