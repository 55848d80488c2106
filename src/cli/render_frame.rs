//! One frame of `lanternfish render`: loaded, rendered, written, and what there is to say about it.

use std::borrow::Cow;
use std::path::Path;
use std::time::Instant;

use super::ExitStatus;
use super::checkpoint_arguments::{CheckpointArguments, beside};
use super::diagnostics::{print_warnings, print_warnings_before, say, warning_lines};
use super::interrupt::Interrupts;
use super::memory_guard::Guarded;
use super::render_outputs::{Origin, Outputs, possible_name};
use super::render_report::{after_the_fact, command_line, conclude, lossy, replay_command, summarise};
use crate::render::checkpoint::{self, CheckpointError, Keeper};
use crate::render::identity::Identity;
use crate::render::lesson::Lesson;
use crate::render::memory::few_candidates;
use crate::render::stats::Statistics;
use crate::render::{Budget, Job, Progress, RenderError, RenderSettings, inputs, load, seed_of};
use crate::scene::{Sources, Warnings};
use crate::system::clock::cpu_seconds;
use crate::system::memory::{limit, peak_memory};

/// What all frames of a command share.
pub struct Studio<'a> {
    /// What the command line says of checkpoints.
    pub checkpoints: &'a CheckpointArguments,
    /// The threads.
    pub pool: &'a rayon::ThreadPool,
    /// What was asked for meanwhile.
    pub interrupts: &'a Interrupts,
    /// Who holds the limit on memory.
    pub guard: &'a Guarded,
    /// Who is told how far a frame is.
    pub listener: &'a dyn Progress,
}

impl Studio<'_> {
    /// Renders the scene file `path`. `sources` and `warnings` are filled also where it fails.
    ///
    /// # Errors
    /// Why there is no image.
    pub fn render(
        &self,
        path: &Path,
        settings: &RenderSettings,
        sources: &mut Sources,
        warnings: &mut Warnings,
    ) -> Result<ExitStatus, RenderError> {
        let Self { checkpoints, pool, interrupts, guard, listener } = self;
        // The seconds of a sequence's earlier frames are theirs.
        let cpu_before = if settings.frame.is_some() { cpu_seconds() } else { 0.0 };
        let prepared = pool.install(|| {
            let loaded = load(path, sources, warnings);
            if loaded.is_err() && !settings.quiet {
                print_warnings_before(&loaded, warnings, sources);
            }
            let (scene, timings) = loaded?;
            let inputs = inputs(&scene, sources);
            let mut named = scene.film.params.string("filename")?.map(Cow::from);
            if settings.output.is_none() {
                named = named.map(|name| possible_name(name, &scene.film.params, warnings));
            }
            let outputs = Outputs::new(settings, path, named.as_deref(), checkpoints.checkpoint.0.is_some());
            let all = inputs.iter().chain(&settings.load_cache).cloned();
            outputs.check(all.clone())?;
            let scene_seed = seed_of(&scene)?;
            let origin = Origin {
                render: Identity::of_render(sources, &all.collect::<Vec<_>>(), settings, scene_seed),
                frame: Identity::of_frame(sources, &inputs, settings),
                lesson: Identity::of_lesson(sources, &inputs, settings),
            };
            if checkpoints.recover && outputs.are_done(&origin) {
                if let Some(checkpoint) = &outputs.checkpoint {
                    let _ = std::fs::remove_file(checkpoint);
                }
                say(format!("{}: is there already, of this very render", outputs.image.display()));
                return Ok(None);
            }
            let taught = settings.load_cache.as_ref().map(|path| Lesson::read(path, &origin.lesson)).transpose()?;
            let job = Job::prepare_taught(&scene, settings, timings, warnings, taught);
            if !settings.quiet {
                print_warnings_before(&job, warnings, sources);
            }
            Ok::<_, RenderError>(Some((job?, outputs, origin)))
        })?;
        let Some((mut job, outputs, origin)) = prepared else { return Ok(ExitStatus::Done) };
        if let Some(cache) = job.world.light_choice.cache_points().filter(|_| !settings.quiet) {
            let statistics = cache.statistics();
            let (points, seconds) = (statistics.points, statistics.seconds.total());
            let how = if statistics.are_loaded { "loaded" } else { "built" };
            say(format!("{points} cache points over {} lights, {how} in {seconds:.1} s", job.world.lights.len()));
        }
        let kept = beside(&outputs.image);
        let points = job.world.light_choice.cache_points();
        let identity = match points.and_then(|points| few_candidates(points.statistics(), settings.cache)) {
            Some(few) => origin.render.clone().and("the candidates for cache points that --memory-limit leaves", few),
            None => origin.render.clone(),
        };
        let from = go_on_from(checkpoints, &kept, &identity)?;
        let interval = checkpoints.checkpoint.0.filter(|_| outputs.checkpoint.is_some());
        let keeper = interval.map(|interval| Keeper::new(kept.clone(), identity, interval, &interrupts.keep));
        let (seed, budget) = (job.seed, job.budget);
        interrupts.rendering(true);
        guard.rendering_begins(&job.world.materials);
        let before = cpu_seconds();
        let outcome = pool.install(|| match &keeper {
            Some(keeper) => job.render_kept(seed, budget, &interrupts.stop, *listener, keeper, from),
            None => Ok(job.render(seed, budget, &interrupts.stop, *listener)),
        })?;
        let cpu_seconds_rendering = cpu_seconds() - before;
        guard.writing_begins();

        let mut late = Warnings::default();
        job.world.materials.report_images(&mut late)?;
        if !settings.quiet {
            print_warnings(&late, sources);
        }
        let is_kept = keeper.as_ref().map(Keeper::settle);
        if outcome.interrupted && outcome.film.sample_count() == 0 {
            say("interrupted before anything was rendered: no image is written");
            return Ok(ExitStatus::Interrupted);
        }

        let written = Instant::now();
        let replay = outcome.film.rejected().1.map(|first| {
            let is_timed = matches!(settings.budget, Budget::Time(_));
            let passes = is_timed.then(|| outcome.iterations.iter().map(|iteration| iteration.samples));
            replay_command(std::env::args_os().map(lossy), first, passes.into_iter().flatten(), settings.frame)
        });
        let unkept = is_kept.as_ref().and_then(|kept| kept.as_ref().err()).map(|error| format!("warning: {error}"));
        let told = [after_the_fact(&outcome, replay.as_deref()), unkept.into_iter().collect()].concat();
        let mut statistics = Statistics {
            command: command_line(),
            version: env!("CARGO_PKG_VERSION"),
            scene: path.display().to_string(),
            frame: settings.frame,
            part: settings.share.part().map(|[number, of]| format!("{number}/{of}")),
            seed,
            threads: pool.current_num_threads(),
            backend: job.world.tracer.name(),
            resolution: job.film.resolution,
            first_sample: job.first_sample,
            samples_per_pixel: outcome.samples_per_pixel,
            error: outcome.film.error_estimate(),
            non_finite_samples: outcome.film.rejected().0,
            first_non_finite_sample: outcome.film.rejected().1,
            replay,
            seconds: job.timings,
            cpu_seconds: 0.0,
            cpu_seconds_rendering,
            peak_memory: 0,
            texture_cache: job.world.materials.texture_cache(),
            counters: outcome.counters,
            iterations: outcome.iterations.clone(),
            cache_points: job.world.light_choice.cache_points().map(|cache| cache.statistics().clone()),
            plan: job.plan.clone(),
            warnings: [warning_lines(warnings, sources), warning_lines(&late, sources), told.clone()].concat(),
        };
        (statistics.cpu_seconds, statistics.peak_memory) = (cpu_seconds() - cpu_before, peak_memory());
        if limit().is_some() {
            // What they took is needed for writing.
            job.world.materials.shed_images(u64::MAX);
        }
        outputs.write(&origin, &job, &outcome, &statistics)?;
        statistics.seconds.write = written.elapsed().as_secs_f64();
        (statistics.cpu_seconds, statistics.peak_memory) = (cpu_seconds() - cpu_before, peak_memory());
        outputs.write_statistics(&statistics)?;
        if !settings.quiet {
            for warning in told {
                say(warning);
            }
            summarise(&outputs.image, &statistics, &outcome);
            if outcome.interrupted && matches!(is_kept, Some(Ok(()))) {
                say(format!("{}: --resume goes on from here", kept.display()));
            }
            conclude(&outputs.image, &statistics, &outcome);
        }
        if let Some(keeper) = keeper.filter(|_| !outcome.interrupted) {
            keeper.forget();
        }
        if let Some(exhausted) = guard.stopped() {
            return Err(exhausted.into());
        }
        Ok(if outcome.interrupted { ExitStatus::Interrupted } else { ExitStatus::Done })
    }
}

/// What was kept of this render, where it is to go on from there.
fn go_on_from(
    arguments: &CheckpointArguments,
    path: &Path,
    identity: &Identity,
) -> Result<Option<checkpoint::Kept>, RenderError> {
    if !arguments.resume && !arguments.recover {
        return Ok(None);
    }
    match checkpoint::read(path, identity) {
        Ok(None) if arguments.resume => {
            Err(CheckpointError::Unreadable { path: path.to_owned(), reason: "there is no such file".to_owned() }
                .into())
        }
        Err(error) if arguments.recover => {
            say(format!("warning: {error}; rendering from the start"));
            Ok(None)
        }
        found => Ok(found?),
    }
}
