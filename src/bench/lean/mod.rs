//! What it saves to leave out what a scene does not need: for each system that a scene leaves out, the scene as it is against the same scene made to
//! need that system, by something tiny out of its sight or by arguments.
//!
//! Processor time alone is not enough to see 1 %: on shared machines the same render takes a tenth more or less from one second to the next. So the
//! renders that are compared run at the same time, with a thread each, on the same processor, which the system deals out to them in slices of
//! milliseconds: whatever else happens hits all of them alike. Their ratio varies by about 1 % from round to round then.

mod facts;
mod place;
mod processor;
mod rounds;
mod row;
mod systems;
pub mod tables;
mod variant;

use std::sync::atomic::AtomicBool;

use serde::Serialize;

pub use facts::Facts;
pub use row::{Row, Verdict};

use super::settings::{Levels, Settings};
use super::subject::Subject;
use super::{BenchError, Watch};
use crate::system::output::OutputError;

/// When it is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum When {
    /// Not at all.
    #[default]
    Off,
    /// After each scene's errors.
    Also,
    /// Alone: no errors, no reference.
    Only,
}

/// What was measured of a scene.
#[derive(Debug, Serialize)]
pub struct LeanReport {
    /// The scene's name.
    pub scene: String,
    /// Width and height of the images.
    pub pixels: [u32; 2],
    /// Samples a pixel of each render.
    pub spp: u32,
    /// The command that renders the scene as it is.
    pub command: String,
    /// A row for each system that the scene leaves out.
    pub rows: Vec<Row>,
    /// What was not measured, and why.
    pub notes: Vec<String>,
}

/// How much is to be done for a scene, in units of what `watch` is told; nothing but a guess before it is done.
pub fn work(subject: &Subject, settings: &Settings) -> f64 {
    let each = match settings.levels {
        Levels::Samples(_) => 64.0,
        Levels::Time(_) => 6.0,
    };
    each * systems::left_out(&subject.facts).count() as f64
}

/// Measures `subject` with and without each system that it leaves out.
///
/// # Errors
/// Those of renders, and of files that cannot be written: those of the variants are beside the scene's while it is measured.
pub fn measure(
    subject: &Subject,
    settings: &Settings,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> Result<LeanReport, BenchError> {
    let scratch = tempfile::tempdir().map_err(|error| OutputError::new(&std::env::temp_dir(), error))?;
    let (variants, notes) = variant::of(subject, scratch.path())?;
    let plan = rounds::Plan::of(subject, settings, scratch.path(), stop)?;
    let share = work(subject, settings) / variants.len().max(1) as f64;
    let progress = rounds::Progress { watch, scene: &subject.entry.name, share };
    let trials = rounds::measure(&plan, &variants, &progress, stop)?;
    let pixels = plan.pixels();
    let samples = f64::from(plan.spp) * f64::from(pixels[0]) * f64::from(pixels[1]);
    let rows = variants.iter().zip(trials).map(|(variant, trial)| Row::of(variant, trial, samples)).collect();
    Ok(LeanReport { scene: subject.entry.name.clone(), pixels, spp: plan.spp, command: plan.command(), rows, notes })
}
