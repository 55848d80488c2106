//! The loop: iterations over the image until it is good enough, out of time, or told to stop.
//!
//! The image is rendered in passes over all pixels of 1, 1, 2, 4, 8 … samples. Within a pass each pixel belongs to one
//! tile and each tile to one thread, and every random number is addressed by pixel and sample, so the result does not depend on the
//! number of threads.

pub mod build;
pub mod memory;
pub mod mixing;
pub mod plan;
pub mod progress;
pub mod regions;
pub mod replay;
pub mod settings;
pub mod stats;
pub mod timing;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use crate::film::{Film, FilmSettings, PixelSamples, SampleResult};
use crate::geometry::Backend;
use crate::geometry::camera::Camera;
use crate::geometry::trace::TraceError;
use crate::integrator::in_scatter::equi_angular::EquiAngular;
use crate::integrator::path::MOST_BOUNCES;
use crate::integrator::{Counters, LightChoice, PathSettings, Scratch, World, trace_path};
use crate::math::sampler::{Dimension, SampleId, SamplePoint, mix};
use crate::scene::{Entity, SceneDescription, SceneError, Sources, Warnings};
use crate::system::output::OutputError;
use mixing::{Mixing, PixelEvidence, TileMix};
use plan::Plan;
use progress::Tracking;
pub use progress::{Progress, ProgressState, Silent};
pub use replay::{Replay, ReplayError};
pub use settings::{Budget, LightSelection, PngOutput, RenderSettings, VolumeLights, VolumeSampling};
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
    /// A name that promises another format than the file gets.
    #[error(
        "{path}: the image is written as OpenEXR; give -o a name that ends in .exr, and --png for a picture beside it"
    )]
    Ending {
        /// The file.
        path: PathBuf,
    },
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
    /// What was built and left out.
    pub plan: Plan,
    /// Seconds so far.
    pub timings: Timings,
    /// Samples a pixel that the scene file asks for.
    pub scene_spp: u32,
    /// The seed that the scene file asks for.
    pub scene_seed: u32,
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
    /// Whether it was stopped from outside.
    pub interrupted: bool,
}

/// Reads a scene file. `sources` and `warnings` are filled also where it fails.
pub fn load(
    path: &Path,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<(SceneDescription, Timings), RenderError> {
    let start = Instant::now();
    let scene = crate::scene::load(path, sources, warnings)?;
    Ok((scene, Timings { parse: start.elapsed().as_secs_f64(), ..Timings::default() }))
}

impl Job {
    /// Builds everything that rendering `scene` takes. Must run inside the pool that will render.
    pub fn prepare(
        scene: &SceneDescription,
        settings: &RenderSettings,
        mut timings: Timings,
        warnings: &mut Warnings,
    ) -> Result<Self, RenderError> {
        let film = FilmSettings::build(scene, &settings.film, warnings)?;
        let space = crate::math::transform::RenderSpace { origin: scene.camera_position() };
        let camera = Camera::build(scene, &film, &space, warnings)?;
        memory::check_film(scene, &film)?;
        let stated_depth = at_least(&scene.integrator, "maxdepth", 5, 0)?;
        let max_depth = settings.max_depth.unwrap_or(stated_depth).min(MOST_BOUNCES);
        let scene_spp = samples_per_pixel(scene, warnings)?;
        let scene_seed = scene.sampler.params.integer("seed", scene.options.integer("seed", 0)?)? as u32;
        warn_about_engine(scene, warnings)?;
        settings.warn_ignored(warnings);
        let backend = settings.backend.unwrap_or(Backend::DEFAULT);
        let mut world = build::build_world(scene, settings, backend, &mut timings, warnings)?;
        for defaults in &scene.defaults {
            defaults.warn_unused(warnings);
        }
        // Again, now that everything else is in memory.
        memory::check_film(scene, &film)?;
        let mut path = PathSettings { max_depth, light_candidates: 1 };
        let choice = build::ChoicePlan::of(&world.lights, &world.media, settings);
        if settings.plan_only {
            if choice.selector.is_some() {
                let choice = build::ChoicePlan { in_scatter: false, ..choice };
                build::choose_lights(&mut world, &choice, None, settings, warnings);
            }
        } else {
            let start = Instant::now();
            let builder = build::CacheBuilder {
                camera: &camera,
                film: &film,
                path: &path,
                seed: settings.seed.unwrap_or(scene_seed),
                settings: settings.cache,
                on_camera_rays: choice.in_scatter && choice.selector.is_some(),
            };
            if builder.on_camera_rays {
                world.equi_angular = Some(EquiAngular::new(&world.lights, world.extent));
            }
            let points = if choice.has_points() { builder.build(&world) } else { None };
            build::choose_lights(&mut world, &choice, points, settings, warnings);
            timings.cache_points = start.elapsed().as_secs_f64();
        }
        path.light_candidates =
            settings.light_candidates.unwrap_or_else(|| build::light_candidates(&world.light_choice, settings.lights));
        let is_known = world.equi_angular.is_some() || world.light_choice.cache_points().is_some();
        let draws = choice.in_scatter && (settings.plan_only || is_known);
        let in_scatter = draws.then_some(settings.volume_sampling);
        let plan = Plan::of(&world, &camera, draws, memory::of_film(&film));
        Ok(Self {
            world,
            camera,
            origin: space.origin,
            film,
            aovs: true,
            path,
            in_scatter,
            plan,
            timings,
            scene_spp,
            scene_seed,
            backend,
        })
    }

    /// Renders until `budget` is used up or `interrupt` is set. The samples of an unfinished pass are kept: each pixel then has its
    /// own count.
    pub fn render(&mut self, seed: u32, budget: Budget, interrupt: &AtomicBool, progress: &dyn Progress) -> Outcome {
        let start = Instant::now();
        let mut film = Film::new(self.film.clone(), self.aovs);
        let mut counters = Counters::default();
        let mut iterations = vec![];
        let limit = match budget {
            Budget::Scene => self.scene_spp,
            Budget::Samples(spp) => spp,
            Budget::Time(_) | Budget::Error(_) => MAX_SAMPLES,
        };
        let tracking = Tracking::new(budget, limit, self.film.bounds.area() as u64, start, progress);
        progress.start(tracking.total());
        let mut mixing = self.mixing();
        let mut done = 0;
        while done < limit && !interrupt.load(Ordering::Relaxed) {
            // 1, 1, 2, 4, 8 …: the image's sample count doubles.
            let mut pass = done.max(1).min(limit - done);
            if let (Budget::Time(budget), true) = (budget, done > 0) {
                let spent = start.elapsed().as_secs_f64();
                let affordable = (budget.as_secs_f64() - spent) / (spent / f64::from(done));
                if affordable < 1.0 {
                    break;
                }
                pass = pass.min(affordable as u32);
            }
            let learns = self.begin_pass(&mut mixing, done);
            let context = Pass { job: self, seed, samples: done..done + pass, interrupt, tracking: &tracking, learns };
            let [drawing, points] = mixing.summary();
            let done_now = context.run(&mut film, &mut mixing);
            counters += done_now;
            let mut iteration = Iteration::new(pass, &done_now);
            (iteration.in_scatter_regions, iteration.in_scatter_points) = (drawing, points);
            let is_interrupted = interrupt.load(Ordering::Relaxed);
            if !is_interrupted {
                done += pass;
            }
            if !is_interrupted && done < limit {
                let start = Instant::now();
                self.learn(&mut mixing, pass);
                iteration.learning = start.elapsed().as_secs_f64();
            }
            iterations.push(iteration);
            if is_interrupted {
                break;
            }
            let error = film.error_estimate();
            tracking.pass_ended(error);
            if let (Budget::Error(target), Some(error)) = (budget, error)
                && done >= MIN_SAMPLES_FOR_ERROR
                && error <= target
            {
                break;
            }
        }
        progress.finish();
        self.timings.first_sample = tracking.first_tile();
        self.timings.render = start.elapsed().as_secs_f64();
        Outcome { film, samples_per_pixel: done, counters, iterations, interrupted: interrupt.load(Ordering::Relaxed) }
    }

    /// How tiles sample scattering points before anything is known.
    fn mixing(&self) -> Mixing {
        let is_shared = matches!(self.world.light_choice, LightChoice::CachePoints(_));
        Mixing::new(self.film.bounds, self.in_scatter, is_shared)
    }

    /// A pass begins where `done` samples a pixel have been taken. Returns whether what earlier passes found has a say in it.
    fn begin_pass(&mut self, mixing: &mut Mixing, done: u32) -> bool {
        mixing.begin_pass(done);
        if !mixing.is_off() && self.world.equi_angular.is_none() {
            self.world.begin_scattering();
        }
        self.world.light_choice.learns() || mixing.adapts() && !mixing.is_off()
    }

    /// A pass of so many samples a pixel is over, and another one follows: takes over what it taught.
    fn learn(&mut self, mixing: &mut Mixing, pass: u32) {
        mixing.decide(pass);
        if mixing.is_off() {
            self.world.light_choice.end_scattering();
        }
        self.world.light_choice.learn(&self.world.lights);
    }
}

/// Samples a pixel at most, where time or error decide.
const MAX_SAMPLES: u32 = 1 << 24;

/// An error estimate from fewer samples a pixel than this is not trusted to stop a render.
const MIN_SAMPLES_FOR_ERROR: u32 = 8;

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

fn warn_about_engine(scene: &SceneDescription, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
    let kind = scene.integrator.kind.as_str();
    if !matches!(kind, "" | "volpath" | "path") {
        let message = format!("integrator \"{kind}\" is not here; the volumetric path tracer renders instead");
        warnings.add(Some(scene.integrator.span()), message);
    }
    let params = &scene.integrator.params;
    params.warn_ignored("lightsampler", "--lights chooses how lights are selected", warnings);
    if params.bool("regularize", false)? {
        params.warn_ignored("regularize", "paths are never regularised: that would bias the image", warnings);
    }
    scene.sampler.params.warn_ignored("randomization", "points are Owen-scrambled Sobol' points", warnings);
    scene.options.warn_unused(warnings);
    params.warn_unused(warnings);
    scene.sampler.params.warn_unused(warnings);
    Ok(())
}

/// One pass over all pixels.
struct Pass<'a> {
    job: &'a Job,
    seed: u32,
    samples: std::ops::Range<u32>,
    interrupt: &'a AtomicBool,
    tracking: &'a Tracking<'a>,
    /// Whether what earlier passes found has a say in it.
    learns: bool,
}

impl Pass<'_> {
    fn run(&self, film: &mut Film, mixing: &mut Mixing) -> Counters {
        let media = self.job.world.has_media();
        film.tiles_mut()
            .par_iter_mut()
            .zip(mixing.tiles_mut())
            .map_init(Scratch::default, |scratch, (tile, mix)| {
                if self.interrupt.load(Ordering::Relaxed) {
                    return Counters::default();
                }
                scratch.counters = Counters::default();
                let bounds = tile.bounds();
                // What rays share never leaves the tile.
                scratch.in_scatter.forget();
                mix.begin_pass(tile.mean_level());
                for pixel in bounds.pixels() {
                    let samples = if media {
                        self.pixel::<true>(pixel, mix, tile.level(pixel), scratch)
                    } else {
                        self.pixel::<false>(pixel, mix, 0.0, scratch)
                    };
                    tile.merge(pixel, &samples);
                }
                self.tracking.tile_ended(bounds.area() as u64 * self.samples.len() as u64);
                scratch.counters
            })
            .sum()
    }

    /// The addresses of a sample's random numbers, for its camera ray and for its path. The samples of a pixel are points of one sequence, each where
    /// the others are not. Where one pass learns from the one before that would be bias, so then paths have a sequence of their own in every
    /// pass. Camera rays need none: whatever was learned, the path along a ray is expected to bring what arrives along it, and the rays
    /// as such are spread evenly.
    fn sample_ids(&self, pixel: [u32; 2], sample: u32) -> [SampleId; 2] {
        let (first, of_all) = (self.samples.start, SampleId { seed: self.seed, pixel, sample });
        if first > 0 && self.learns {
            let seed = mix(u64::from(self.seed) << 32 | u64::from(first)) as u32;
            return [of_all, SampleId { seed, pixel, sample: sample - first }];
        }
        [of_all; 2]
    }

    /// One sample of a pixel.
    #[inline]
    fn sample<const MEDIA: bool>(&self, pixel: [u32; 2], sample: u32, scratch: &mut Scratch) -> SampleResult {
        let job = self.job;
        let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
        let [camera, random] = self.sample_ids(pixel, sample).map(SamplePoint::new);
        let [jitter_x, jitter_y, lens_u, lens_v] = camera.draw::<4>(0, Dimension::Camera);
        let [u_time] = camera.draw::<1>(0, Dimension::Time);
        let position = corner + Vec2::splat(0.5) + job.film.filter.sample([jitter_x, jitter_y]);
        let ray = job.camera.ray(position, [lens_u, lens_v], u_time);
        trace_path::<MEDIA>(&job.world, &job.path, ray, &random, scratch)
    }

    /// One pixel, in which `level` is what it has come to so far.
    fn pixel<const MEDIA: bool>(
        &self,
        pixel: [u32; 2],
        mix: &mut TileMix,
        level: f64,
        scratch: &mut Scratch,
    ) -> PixelSamples {
        let mut evidence = PixelEvidence::default();
        let before = if MEDIA { scratch.counters.work() } else { 0 };
        if MEDIA {
            let (count, mix) = mix.way_at(pixel);
            scratch.in_scatter.begin_pixel(count, mix);
        }
        let mut samples = PixelSamples::new(self.job.film.sensor);
        for sample in self.samples.clone() {
            // A pass of a long render may take minutes a tile: stopping must not wait for it.
            if self.interrupt.load(Ordering::Relaxed) {
                break;
            }
            let result = self.sample::<MEDIA>(pixel, sample, scratch);
            samples.add(sample, &result);
            if MEDIA && scratch.in_scatter.is_on() {
                evidence.add(&result, scratch);
            }
        }
        if MEDIA && scratch.in_scatter.is_on() {
            mix.add(&evidence, level);
            mix.add_work(scratch.counters.work() - before, scratch.in_scatter.work);
        }
        samples
    }
}
