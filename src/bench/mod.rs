//! Error against run time: scenes rendered by several methods, with more and more samples, in independent runs, and judged by a reference.
//!
//! Every render is a process of its own and says by itself what it took. What is measured is the beauty (R, G, B) of the whole image. The error
//! of the reference is measured too and taken off all that is said of the renders ([`error`]); what is smaller than it is not claimed. What it saves to
//! leave out what a scene does not need is measured beside it ([`lean`]).

pub mod bar;
pub mod bias;
pub mod crops;
pub mod csv;
pub mod curve;
pub mod error;
pub mod estimate;
pub mod goals;
pub mod hdr_flip;
pub mod lean;
pub mod machine;
pub mod measure;
pub mod method;
pub mod page;
pub mod plots;
pub mod ratio;
pub mod reference;
pub mod report;
pub mod run;
pub mod settings;
pub mod slope;
pub mod subject;
pub mod suite;
pub mod table;
pub mod tables;
pub mod trim;
pub mod watch;
pub mod write;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::film::image::ImageError;
use crate::gallery::GalleryError;
use crate::render::RenderError;
use crate::report::CompareError;
use crate::scene::Sources;
use crate::system::output::OutputError;

pub use lean::When;
pub use measure::measure;
pub use report::Report;
pub use settings::{Request, Settings};
pub use watch::Watch;

/// Why nothing, or no more, was measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// What was asked for makes no sense.
    #[error("{0}")]
    Usage(String),
    /// A scene cannot be loaded.
    #[error("{error}")]
    Scene {
        /// What is wrong with it.
        error: Box<RenderError>,
        /// For an excerpt.
        sources: Box<Sources>,
    },
    /// A render failed.
    #[error(transparent)]
    Render(#[from] run::RunError),
    /// An image cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An image cannot be judged.
    #[error("{path}: {error}")]
    Judge {
        /// The image.
        path: PathBuf,
        /// Why.
        error: Box<CompareError>,
    },
    /// The reference shows other pixels than the renders.
    #[error("the reference {path} shows {found}; the renders of {scene} show {wanted}")]
    OtherPixels {
        /// The reference.
        path: PathBuf,
        /// What it shows.
        found: String,
        /// The scene.
        scene: String,
        /// What the renders show.
        wanted: String,
    },
    /// Something cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A scene of the gallery cannot be written.
    #[error(transparent)]
    Gallery(#[from] GalleryError),
    /// It was stopped from outside.
    #[error("interrupted")]
    Interrupted,
}

/// Measures all that `settings` ask for and writes the report to their folder, anew after each scene: what is done is not lost if the rest fails.
///
/// # Errors
/// See [`BenchError`].
pub fn run(settings: &Settings, watch: &dyn Watch, stop: &AtomicBool) -> Result<Report, BenchError> {
    write::make_folders(&settings.out)?;
    let subjects =
        settings.entries.iter().map(|entry| subject::Subject::of(entry, settings)).collect::<Result<Vec<_>, _>>()?;
    let mut report = Report::new(settings);
    let when = settings.lean.when;
    let work = |subject| {
        let errors = if when == When::Only { 0.0 } else { measure::work(subject, settings) };
        errors + if when == When::Off { 0.0 } else { lean::work(subject, settings) }
    };
    watch.begin(subjects.iter().map(work).sum());
    for subject in &subjects {
        if when != When::Only {
            let (scene, pictures) = measure(subject, settings, watch, stop)?;
            report.add(scene, pictures);
        }
        if when != When::Off {
            report.lean.push(lean::measure(subject, settings, watch, stop)?);
        }
        write::write(&report, &settings.out)?;
    }
    watch.finish();
    Ok(report)
}
