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
use crate::integrator::in_scatter::equi_angular::EquiAngular;
use crate::integrator::path::MOST_BOUNCES;
use crate::integrator::{Counters, LightChoice, PathSettings, World};
use crate::scene::{Entity, Param, ParamSet, SceneDescription, SceneError, Sources, Warnings};
use crate::system::output::OutputError;
use crate::system::taken;
use checkpoint::{CheckpointError, Keeper, Kept};
use course::{Course, MAX_SAMPLES};
use identity::Identity;
pub use inputs::inputs;
use lesson::{Lesson, LessonError, LessonRef, Taken};
pub use memory::ExhaustedMemory;
use mixing::Mixing;
pub use pass::Guides;
use plan::Plan;
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
    /// Builds everything that rendering `scene` takes. Must run inside the pool that will render.
    pub fn prepare(
        scene: &SceneDescription,
        settings: &RenderSettings,
        timings: Timings,
        warnings: &mut Warnings,
    ) -> Result<Self, RenderError> {
        Self::prepare_taught(scene, settings, timings, warnings, None)
    }

    /// The same with what another render of the scene has learned, in [`RenderSettings::load_cache`].
    ///
    /// # Errors
    /// Also what was learned of other lights, or from samples that this render takes.
    pub fn prepare_taught(
        scene: &SceneDescription,
        settings: &RenderSettings,
        mut timings: Timings,
        warnings: &mut Warnings,
        lesson: Option<Lesson>,
    ) -> Result<Self, RenderError> {
        let film = FilmSettings::build(scene, &settings.film, warnings)?;
        let space = crate::math::transform::RenderSpace { origin: scene.camera_position() };
        let camera = Camera::build(scene, &film, &space, warnings)?;
        memory::check_film(scene, &film)?;
        let stated_depth = at_least(&scene.integrator, "maxdepth", 5, 0)?;
        let max_depth = settings.max_depth.unwrap_or(stated_depth).min(MOST_BOUNCES);
        let scene_spp = samples_per_pixel(scene, warnings)?;
        let scene_seed = seed_of(scene)?;
        warn_about_engine(scene, warnings)?;
        settings.warn_ignored(warnings);
        let backend = settings.backend.unwrap_or(Backend::DEFAULT);
        let mut world = build::build_world(scene, settings, &film, backend, &mut timings, warnings)?;
        for defaults in &scene.defaults {
            defaults.warn_unused(warnings);
        }
        // Again, now that everything else is in memory.
        memory::check_film(scene, &film)?;
        let (first_sample, budget) = settings.share.of(settings.budget, scene_spp)?;
        let seed = settings.seed(scene_seed);
        let path_of_lesson = || settings.load_cache.clone().unwrap_or_default();
        let mut lesson = lesson;
        let taught_by = lesson.as_mut().map_or_else(Vec::new, |lesson| std::mem::take(&mut lesson.taken));
        let own = taken(seed, first_sample, budget);
        if let Some(&taken) = taught_by.iter().find(|taken| taken.overlaps(&own)) {
            return Err(LessonError::Overlap { path: path_of_lesson(), taken }.into());
        }
        let texture_share = settings.texture_share(scene_spp).filter(|_| world.materials.has_levels());
        let mut path = PathSettings { max_depth, light_candidates: 1 };
        let choice = build::ChoicePlan::of(&world.lights, &world.media, settings);
        if settings.plan_only {
            if choice.selector.is_some() {
                let choice = build::ChoicePlan { in_scatter: false, ..choice };
                build::choose_lights(&mut world, &choice, None, settings, warnings);
            }
        } else {
            taken::begin("cache points");
            let start = Instant::now();
            let builder = build::CacheBuilder {
                camera: &camera,
                film: &film,
                path: &path,
                seed,
                settings: memory::for_cache_points(settings.cache),
                texture_share,
                on_camera_rays: choice.in_scatter && choice.selector.is_some(),
            };
            if builder.on_camera_rays {
                world.equi_angular = Some(EquiAngular::new(&world.lights, world.extent));
            }
            let kept = lesson.as_mut().and_then(|lesson| lesson.points.take());
            let points = match kept.filter(|_| choice.has_points()) {
                Some(kept) => {
                    let points = CachePoints::from_kept(&world.lights, kept, settings.cache);
                    let unfit = || LessonError::Unreadable {
                        path: path_of_lesson(),
                        reason: "it does not fit the lights of this scene".to_owned(),
                    };
                    Some(points.ok_or_else(unfit)?)
                }
                None if choice.has_points() => builder.build(&world),
                None => None,
            };
            if let Some(points) = &points {
                memory::warn_few_candidates(points.statistics(), settings.cache, warnings);
            }
            build::choose_lights(&mut world, &choice, points, settings, warnings);
            timings.cache_points = start.elapsed().as_secs_f64();
        }
        taken::begin("film");
        path.light_candidates =
            settings.light_candidates.unwrap_or_else(|| build::light_candidates(&world.light_choice, settings.lights));
        let is_known = world.equi_angular.is_some() || world.light_choice.cache_points().is_some();
        let draws = choice.in_scatter && (settings.plan_only || is_known);
        let in_scatter = draws.then_some(settings.volume_sampling);
        let is_independent = match settings.sampler {
            SamplerKind::Scene => scene.sampler.kind == "independent",
            SamplerKind::Sobol => false,
            SamplerKind::Independent => true,
        };
        let splits_views = settings.view_rays == ViewRays::Auto && world.shines();
        let plan = Plan::of(&world, &camera, draws, splits_views, &film);
        let mut job = Self {
            world,
            camera,
            origin: space.origin,
            film,
            aovs: true,
            path,
            in_scatter,
            splits_views,
            is_independent,
            texture_share,
            plan,
            timings,
            scene_spp,
            first_sample,
            budget,
            scene_seed,
            seed,
            teaches: settings.save_cache.is_some(),
            taught_by,
            taught: None,
            backend,
        };
        if let Some(Lesson { mixing, splitting, .. }) = lesson {
            let mut guides = job.guides(&Film::new(job.film.clone(), false));
            // Those of an image of another size are of no use.
            if guides.restore(mixing, splitting) {
                job.taught = Some(guides);
            }
        }
        Ok(job)
    }

    /// The samples that a render has taken; of one that was stopped, those that it may have.
    pub fn taken(&self, outcome: &Outcome) -> Taken {
        let most = if outcome.interrupted { self.budget } else { Budget::Samples(outcome.samples_per_pixel) };
        taken(self.seed, self.first_sample, most)
    }

    /// Writes what was learned, for other renders of the scene `identity`.
    ///
    /// # Errors
    /// What the system says.
    pub fn write_lesson(&self, outcome: &Outcome, path: &Path, identity: &Identity) -> Result<(), OutputError> {
        let taken = [self.taught_by.as_slice(), &[self.taken(outcome)]].concat();
        let points = self.world.light_choice.cache_points().map(CachePoints::kept);
        let Guides { mixing, splitting } = &outcome.guides;
        LessonRef { points, mixing, splitting, taken: &taken }.write(path, identity)
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
        mixing.begin_pass(done);
        if !mixing.is_off() && self.world.equi_angular.is_none() {
            self.world.begin_scattering();
        }
        self.world.light_choice.learns() || mixing.adapts() && !mixing.is_off()
    }

    /// A pass of so many samples a pixel is over, and another one follows: takes over what it taught.
    fn learn(&mut self, guides: &mut Guides, pass: u32) {
        guides.mixing.decide(pass);
        if guides.mixing.is_off() {
            self.world.light_choice.end_scattering();
        }
        if let Some(splitting) = &mut guides.splitting {
            splitting.decide();
        }
        self.world.light_choice.learn(&self.world.lights);
    }
}

/// The seed that the scene's sampler or its options ask for.
///
/// # Errors
/// Seeds that are no integers.
pub fn seed_of(scene: &SceneDescription) -> Result<u32, Box<SceneError>> {
    Ok(scene.sampler.params.integer("seed", scene.options.integer("seed", 0)?)? as u32)
}

/// The samples that a render may come to take.
fn taken(seed: u32, first: u32, budget: Budget) -> Taken {
    let most = match budget {
        Budget::Samples(samples) => samples,
        Budget::Scene | Budget::Time(_) | Budget::Error(_) => MAX_SAMPLES,
    };
    Taken { seed, first, end: first.saturating_add(most) }
}

/// The integer parameter `name` of `entity`, which must not be below `least`.
fn at_least(entity: &Entity, name: &str, default: i32, least: i32) -> Result<u32, Box<SceneError>> {
    let value = entity.params.integer(name, default)?;
    if value < least {
        return Err(entity.params.wrong(name, &format!("at least {least}, found {value}")));
    }
    Ok(value as u32)
}

/// Samples a pixel that the scene's `Sampler` asks for, with the defaults of pbrt-v4's samplers.
fn samples_per_pixel(scene: &SceneDescription, warnings: &mut Warnings) -> Result<u32, Box<SceneError>> {
    let sampler = &scene.sampler;
    if sampler.kind != "stratified" {
        return at_least(sampler, "pixelsamples", 16, 1);
    }
    let (x, y) = (at_least(sampler, "xsamples", 4, 1)?, at_least(sampler, "ysamples", 4, 1)?);
    sampler.params.warn_ignored("jitter", "points are Owen-scrambled Sobol' points", warnings);
    x.checked_mul(y).ok_or_else(|| sampler.params.wrong("xsamples", "such that xsamples × ysamples is below 2^32"))
}

/// pbrt-v4's samplers.
const SAMPLERS: [&str; 8] = ["", "halton", "independent", "paddedsobol", "pmj02bn", "sobol", "stratified", "zsobol"];

/// Says of pbrt-v4's options what is not done; of those that change no image, nothing.
fn options(options: &ParamSet, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
    for name in [
        "displacementedgescale",
        "disabletexturefiltering",
        "disablewavelengthjitter",
        "pixelstats",
        "rendercoordsys",
        "wavefront",
    ] {
        options.get(name);
    }
    for (name, why) in [
        ("disablepixeljitter", "samples are spread over their pixels"),
        ("forcediffuse", "materials are what they are"),
    ] {
        if options.bool(name, false)? {
            options.warn_ignored(name, why, warnings);
        }
    }
    for name in ["msereferenceimage", "msereferenceout"] {
        options.warn_ignored(name, "`lanternfish compare` measures errors", warnings);
    }
    options.warn_unused(warnings);
    Ok(())
}

fn warn_about_engine(scene: &SceneDescription, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
    let kind = scene.integrator.kind.as_str();
    let params = &scene.integrator.params;
    if !matches!(kind, "" | "volpath" | "path") {
        let message = format!("integrator \"{kind}\" is not here; the volumetric path tracer renders instead");
        warnings.add(Some(scene.integrator.span()), message);
        // Said in one line.
        params.iter().for_each(Param::mark_used);
    }
    let sampler = scene.sampler.kind.as_str();
    if !SAMPLERS.contains(&sampler) {
        let message = format!("sampler \"{sampler}\" is not known; points are Owen-scrambled Sobol' points");
        warnings.add(Some(scene.sampler.span()), message);
    }
    params.warn_ignored("lightsampler", "--lights chooses how lights are selected", warnings);
    if matches!(kind, "" | "volpath" | "path") && params.bool("regularize", false)? {
        params.warn_ignored("regularize", "paths are never regularised: that would bias the image", warnings);
    }
    scene.sampler.params.warn_ignored("randomization", "points are Owen-scrambled Sobol' points", warnings);
    options(&scene.options, warnings)?;
    params.warn_unused(warnings);
    scene.sampler.params.warn_unused(warnings);
    Ok(())
}
