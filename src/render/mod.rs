//! The loop: iterations over the image until it is good enough, out of time, or told to stop.
//!
//! The image is rendered in passes over all pixels of 1, 1, 2, 4, 8 … samples. Within a pass each pixel belongs to one
//! tile and each tile to one thread, and every random number is addressed by pixel and sample, so the result does not depend on the
//! number of threads.

pub mod build;
pub mod checkpoint;
mod course;
mod gbuffer;
pub mod identity;
mod inputs;
pub mod lesson;
pub mod memory;
pub mod merge;
pub mod mixing;
mod pass;
pub mod plan;
mod prepare;
pub mod progress;
pub mod regions;
pub mod replay;
pub mod settings;
pub mod share;
pub mod splitting;
mod state_file;
pub mod stats;
pub mod timing;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use glam::DVec3;

use crate::cache_points::CachePoints;
use crate::film::{Film, FilmSettings, FilmTile};
use crate::geometry::Backend;
use crate::geometry::camera::Camera;
use crate::geometry::differentials::SampleShare;
use crate::geometry::trace::TraceError;
use crate::integrator::{Counters, LightChoice, PathSettings, World};
use crate::scene::{SceneDescription, SceneError, Sources, Warnings};
use crate::system::output::OutputError;
use crate::system::taken;
use checkpoint::{CheckpointError, Keeper, Kept};
use course::{Course, MAX_SAMPLES};
use identity::Identity;
pub use inputs::inputs;
use lesson::{LessonError, LessonRef, Taken};
pub use memory::ExhaustedMemory;
use mixing::Mixing;
pub use pass::Guides;
use plan::Plan;
pub use prepare::seed_of;
pub use progress::{Progress, ProgressState, Silent};
pub use replay::{Replay, ReplayError};
pub use settings::{
    Budget, LightSelection, PngOutput, RenderSettings, SamplerKind, TextureLevels, ViewRays, VolumeLights,
    VolumeSampling,
};
pub use share::{EmptyShare, Share};
use splitting::Splitting;
use stats::Iteration;
pub use timing::Timings;

/// Why a render ended without an image.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The input was at fault.
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    /// No acceleration structure.
    #[error("cannot trace rays: {0}")]
    Trace(#[from] TraceError),
    /// More memory than is allowed.
    #[error(transparent)]
    Memory(#[from] ExhaustedMemory),
    /// An output file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Two outputs, or an output and the scene, are one file.
    #[error(
        "{path} is asked for twice: outputs must differ from each other and from the files that the scene is made of"
    )]
    Overlap {
        /// The file.
        path: PathBuf,
    },
    /// Frames that would all go to one file.
    #[error("{path} has no place for the number of the frame: write #### where it shall stand")]
    NoPlace {
        /// The file.
        path: PathBuf,
    },
    /// A lesson that nobody would learn from.
    #[error("part 0 is the lesson of the others: it takes --save-cache, and parts 1 to {0} --load-cache")]
    Lessonless(u32),
    /// A name that promises another format than the file gets.
    #[error(
        "{path}: the image is written as OpenEXR; give -o a name that ends in .exr, and --png for a picture beside it"
    )]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// A render that cannot go on from its checkpoint.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// What another render learned cannot be used.
    #[error(transparent)]
    Lesson(#[from] LessonError),
    /// A part of a frame that has none of its samples.
    #[error(transparent)]
    Share(#[from] EmptyShare),
    /// A sample that is not one of the image's was to be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// No thread pool.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// A scene made ready to render.
pub struct Job {
    /// What paths meet.
    pub world: World,
    /// Where they start.
    pub camera: Camera,
    /// The point of the scene that is the origin of render space.
    pub origin: DVec3,
    /// The image.
    pub film: FilmSettings,
    /// Whether the image has layers besides the beauty.
    pub aovs: bool,
    /// The path's rules.
    pub path: PathSettings,
    /// How scattering points are sampled, where in-scatter sampling is there.
    pub in_scatter: Option<VolumeSampling>,
    /// Whether camera rays are split where that pays.
    pub splits_views: bool,
    /// Whether the samples of a pixel know nothing of each other.
    pub is_independent: bool,
    /// What part of a pixel each sample stands for, where textures have levels of detail.
    pub texture_share: Option<SampleShare>,
    /// What was built and left out.
    pub plan: Plan,
    /// Seconds so far.
    pub timings: Timings,
    /// Samples a pixel that the scene file asks for.
    pub scene_spp: u32,
    /// The number of the first sample that is taken of each pixel.
    pub first_sample: u32,
    /// When to stop: never [`Budget::Scene`].
    pub budget: Budget,
    /// The seed that the scene file asks for.
    pub scene_seed: u32,
    /// That of the random numbers.
    pub seed: u32,
    /// Whether the last pass is learned from as well: for other renders.
    pub teaches: bool,
    /// Whether it is the lesson of a frame's parts.
    pub is_lesson: bool,
    /// Whether nothing more is learned than was known before the first pass.
    pub is_frozen: bool,
    /// The samples that taught it what it begins with.
    pub taught_by: Vec<Taken>,
    /// What its first pass goes by, where another render has taught it.
    taught: Option<Guides>,
    /// The backend in use.
    pub backend: Backend,
}

/// An image and how it came about.
pub struct Outcome {
    /// The pixels.
    pub film: Film,
    /// Samples a pixel of the last complete pass.
    pub samples_per_pixel: u32,
    /// What was done.
    pub counters: Counters,
    /// What was done in each iteration.
    pub iterations: Vec<Iteration>,
    /// What a further pass would go by.
    pub guides: Guides,
    /// Whether it was stopped from outside.
    pub interrupted: bool,
}

/// Reads a scene file. `sources` and `warnings` are filled also where it fails.
pub fn load(
    path: &Path,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<(SceneDescription, Timings), RenderError> {
    taken::begin("scene files");
    let start = Instant::now();
    let scene = crate::scene::load(path, sources, warnings)?;
    Ok((scene, Timings { parse: start.elapsed().as_secs_f64(), ..Timings::default() }))
}

impl Job {
    /// The samples that a render has taken; of one that was stopped, those that it may have.
    pub fn taken(&self, outcome: &Outcome) -> Taken {
        let most = if outcome.interrupted { self.budget } else { Budget::Samples(outcome.samples_per_pixel) };
        may_take(self.seed, self.first_sample, most)
    }

    /// Writes what was learned, for other renders of the scene `identity`.
    ///
    /// # Errors
    /// What the system says.
    pub fn write_lesson(&self, outcome: &Outcome, path: &Path, identity: &Identity) -> Result<(), OutputError> {
        let taken = [self.taught_by.as_slice(), &[self.taken(outcome)]].concat();
        let points = self.world.light_choice.cache_points().map(CachePoints::kept);
        let Guides { mixing, splitting } = &outcome.guides;
        LessonRef { points, mixing, splitting, taken: &taken, is_of_frame: self.is_lesson }.write(path, identity)
    }

    /// Renders until `budget` is used up or `interrupt` is set. The samples of an unfinished pass are kept: each pixel then has its
    /// own count.
    pub fn render(&mut self, seed: u32, budget: Budget, interrupt: &AtomicBool, progress: &dyn Progress) -> Outcome {
        let course = Course::new(self);
        course.run(self, seed, budget, interrupt, progress, None)
    }

    /// The same with a `keeper` of checkpoints: where `interrupt` is set tiles that were begun are finished, and all is kept. `from` is what was kept of the
    /// same render before.
    ///
    /// # Errors
    /// A checkpoint that does not fit this scene.
    pub fn render_kept(
        &mut self,
        seed: u32,
        budget: Budget,
        interrupt: &AtomicBool,
        progress: &dyn Progress,
        keeper: &Keeper,
        from: Option<Kept>,
    ) -> Result<Outcome, CheckpointError> {
        let course = match from {
            None => Course::new(self),
            Some(kept) => Course::from(self, kept).ok_or_else(|| CheckpointError::Unreadable {
                path: keeper.path().to_owned(),
                reason: "it does not fit this scene".to_owned(),
            })?,
        };
        Ok(course.run(self, seed, budget, interrupt, progress, Some(keeper)))
    }

    /// What the first pass goes by.
    fn guides(&self, film: &Film) -> Guides {
        if let Some(taught) = &self.taught {
            return taught.clone();
        }
        let is_shared = matches!(self.world.light_choice, LightChoice::CachePoints(_));
        let tiles = film.tiles().iter().map(FilmTile::bounds);
        let has_sky = !self.world.lights.infinite().is_empty();
        let mixing = Mixing::new(self.film.bounds, self.in_scatter, is_shared);
        Guides { mixing, splitting: self.splits_views.then(|| Splitting::new(tiles, self.film.bounds, has_sky)) }
    }

    /// A pass begins where `done` samples a pixel have been taken. Returns whether what earlier passes found has a say in its paths.
    fn begin_pass(&mut self, guides: &mut Guides, done: u32) -> bool {
        let mixing = &mut guides.mixing;
        if !self.is_frozen {
            mixing.begin_pass(done);
        }
        if !mixing.is_off() && self.world.equi_angular.is_none() {
            self.world.begin_scattering();
        }
        !self.is_frozen && (self.world.light_choice.learns() || mixing.adapts() && !mixing.is_off())
    }

    /// A pass of so many samples a pixel is over, and another one follows: takes over what it taught.
    fn learn(&mut self, guides: &mut Guides, pass: u32) {
        if let Some(splitting) = &mut guides.splitting {
            splitting.decide();
        }
        if self.is_frozen {
            return;
        }
        guides.mixing.decide(pass);
        if guides.mixing.is_off() {
            self.world.light_choice.end_scattering();
        }
        self.world.light_choice.learn(&self.world.lights);
    }
}

/// The samples that a render may come to take.
fn may_take(seed: u32, first: u32, budget: Budget) -> Taken {
    let most = match budget {
        Budget::Samples(samples) => samples,
        Budget::Scene | Budget::Time(_) | Budget::Error(_) => MAX_SAMPLES,
    };
    Taken { seed, first, end: first.saturating_add(most) }
}
