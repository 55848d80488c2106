//! `lanternfish render`: loads, renders, writes, and says what went wrong.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::arguments::RenderArguments;
use super::checkpoint_arguments::{CheckpointArguments, beside};
use super::diagnostics::{print_error, print_message, print_warnings, say, warning_lines};
use super::interrupt::Interrupts;
use super::limit_arguments::Shown;
use super::machine_progress::print_fail;
use super::memory_guard::MemoryGuard;
use super::render_report::{after_the_fact, command_line, conclude, lossy, of_rejected, replay_command, summarise};
use super::{ExitStatus, progress};
use crate::film::RejectedSample;
use crate::film::exr::write_exr;
use crate::film::image::write_png;
use crate::geometry::trace::TraceError;
use crate::render::checkpoint::{self, CheckpointError, Identity, Keeper};
use crate::render::stats::Statistics;
use crate::render::{Budget, Job, Outcome, PngOutput, RenderError, RenderSettings, ReplayError, inputs, load, memory};
use crate::report::cache_points::{write_picture, write_ply};
use crate::scene::{SceneErrorKind, Sources, Warnings};
use crate::system::clock::cpu_seconds;
use crate::system::memory::{limit, peak_memory};
use crate::system::output::{OutputError, check_writable, is_device, write_atomically};

/// Runs the command; messages go to the standard error output.
pub fn run(arguments: &RenderArguments) -> ExitStatus {
    let settings = arguments.settings();
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let result = arguments.limits.apply().and_then(|()| match arguments.replay {
        Some(sample) => replay(arguments, &settings, sample, &mut sources, &mut warnings),
        None => render(arguments, &settings, &mut sources, &mut warnings),
    });
    if let Err(error) = &result {
        tell_farm(arguments.limits.progress, error, &sources);
    }
    report_end(result, &sources)
}

/// Tells whoever listens for it that the render has failed.
fn tell_farm(shown: Shown, error: &RenderError, sources: &Sources) {
    if shown == Shown::Openjd {
        print_fail(&match error {
            RenderError::Scene(error) => error.one_line(sources),
            other => other.to_string(),
        });
    }
}

/// Prints an error, if there is one, and says how the process ends.
pub fn report_end(result: Result<ExitStatus, RenderError>, sources: &Sources) -> ExitStatus {
    match result {
        Ok(status) => status,
        Err(RenderError::Scene(mut error)) => {
            if let (SceneErrorKind::Limit(_), Some(account)) = (&error.kind, memory::account()) {
                error.help = Some(error.help.map_or(account.clone(), |help| format!("{help}; {account}")));
            }
            print_error(&error, sources);
            ExitStatus::from(&error.kind)
        }
        Err(error) => {
            let account = memory::account().filter(|_| matches!(error, RenderError::Trace(TraceError::Memory(_))));
            print_message(&account.map_or(error.to_string(), |account| format!("{error}; {account}")));
            match error {
                RenderError::Trace(TraceError::Missing(_))
                | RenderError::Overlap { .. }
                | RenderError::Replay(ReplayError::Pixel(..) | ReplayError::Sample(..))
                | RenderError::Ending { .. } => ExitStatus::Usage,
                RenderError::Checkpoint(_) => ExitStatus::BadInput,
                RenderError::Replay(ReplayError::Interrupted) => ExitStatus::Interrupted,
                RenderError::Trace(TraceError::Memory(_)) | RenderError::Memory(_) | RenderError::Threads(_) => {
                    ExitStatus::Limit
                }
                RenderError::Trace(TraceError::Geometry(_)) => ExitStatus::BadInput,
                _ => ExitStatus::Failed,
            }
        }
    }
}

fn render(
    arguments: &RenderArguments,
    settings: &RenderSettings,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let path = arguments.scene.as_path();
    // What the command line names is known to be wrong before a scene is read.
    if let Some(wrong) = settings.output.as_deref().filter(|path| is_other_picture(path)) {
        return Err(RenderError::Ending { path: wrong.to_owned() });
    }
    let named_png = settings.png.as_ref().and_then(|png| match png {
        PngOutput::File(path) => Some(path.as_path()),
        PngOutput::Beside => None,
    });
    let debug = debug_files(settings);
    let named = [settings.output.as_deref(), named_png, settings.stats.as_deref()];
    for file in named.into_iter().flatten().chain(debug.iter().map(PathBuf::as_path)) {
        check_writable(file)?;
    }
    let threads = settings.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let interrupts = Interrupts::listen();
    if let Some(time) = arguments.checkpoints.exit_at {
        interrupts.stop_after(time);
    }
    let shown = arguments.limits.progress;
    let guard = MemoryGuard::watch(&interrupts, move |error| {
        tell_farm(shown, error, &Sources::default());
        print_message(&error.to_string());
    });

    let (job, outcome, seed, output, keeper, cpu_seconds_rendering) = pool.install(|| {
        let prepared = load(path, sources, warnings).and_then(|(scene, timings)| {
            let job = Job::prepare(&scene, settings, timings, warnings)?;
            Ok((job, inputs(&scene, sources)))
        });
        if !settings.quiet {
            print_warnings(warnings, sources);
        }
        let (mut job, inputs) = prepared?;
        if let Some(cache) = job.world.light_choice.cache_points().filter(|_| !settings.quiet) {
            let statistics = cache.statistics();
            let (points, seconds) = (statistics.points, statistics.seconds.total());
            say(format!("{points} cache points over {} lights, built in {seconds:.1} s", job.world.lights.len()));
        }
        let output = settings.output_path(path, job.film.filename.as_deref());
        let png = settings.png_path(&output);
        let images = [Some(output.as_path()), png.as_deref(), settings.stats.as_deref()];
        let outputs: Vec<&Path> = images.into_iter().flatten().chain(debug.iter().map(PathBuf::as_path)).collect();
        let kept = beside(&output);
        let keeps = arguments.checkpoints.checkpoint.0.filter(|_| !is_device(&output));
        let checkpoint = keeps.is_some().then_some(kept.as_path());
        let all: Vec<&Path> = outputs.iter().copied().chain(checkpoint).collect();
        refuse_overlap(&all, inputs.iter().cloned())?;
        for file in all {
            check_writable(file)?;
        }
        let seed = settings.seed.unwrap_or(job.scene_seed);
        let budget = if settings.budget == Budget::Scene { Budget::Samples(job.scene_spp) } else { settings.budget };
        let identity = Identity::new(sources, &inputs, settings, budget, seed, &job.world.tracer.name());
        let points = job.world.light_choice.cache_points();
        let identity = match points.and_then(|points| memory::few_candidates(points.statistics(), settings.cache)) {
            Some(few) => identity.and("the candidates for cache points that --memory-limit leaves", few),
            None => identity,
        };
        let from = go_on_from(&arguments.checkpoints, &kept, &identity)?;
        let keeper = keeps.map(|interval| Keeper::new(kept, identity, interval, &interrupts.keep));
        let listener = progress::listener(shown, settings.quiet);
        interrupts.rendering_begins();
        guard.rendering_begins(&job.world.materials);
        let before = cpu_seconds();
        let outcome = match &keeper {
            Some(keeper) => {
                job.render_kept(seed, settings.budget, &interrupts.stop, listener.as_ref(), keeper, from)?
            }
            None => job.render(seed, settings.budget, &interrupts.stop, listener.as_ref()),
        };
        Ok::<_, RenderError>((job, outcome, seed, output, keeper, cpu_seconds() - before))
    })?;
    guard.writing_begins();
    let mut late = Warnings::default();
    job.world.materials.report_images(&mut late)?;
    if !settings.quiet {
        print_warnings(&late, sources);
    }
    let kept = keeper.as_ref().map(Keeper::settle);
    if outcome.interrupted && outcome.film.sample_count() == 0 {
        say("interrupted before anything was rendered: no image is written");
        return Ok(ExitStatus::Interrupted);
    }

    let written = Instant::now();
    let replay = outcome.film.rejected().1.map(|first| {
        let is_timed = matches!(settings.budget, Budget::Time(_));
        let passes = is_timed.then(|| outcome.iterations.iter().map(|iteration| iteration.samples));
        replay_command(std::env::args_os().map(lossy), first, passes.into_iter().flatten())
    });
    let unkept = kept.as_ref().and_then(|kept| kept.as_ref().err()).map(|error| format!("warning: {error}"));
    let told = [after_the_fact(&outcome, replay.as_deref()), unkept.into_iter().collect()].concat();
    let mut statistics = Statistics {
        command: command_line(),
        version: env!("CARGO_PKG_VERSION"),
        scene: path.display().to_string(),
        seed,
        threads: pool.current_num_threads(),
        backend: job.world.tracer.name(),
        resolution: job.film.resolution,
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
    (statistics.cpu_seconds, statistics.peak_memory) = (cpu_seconds(), peak_memory());
    if limit().is_some() {
        // What they took is needed for writing.
        job.world.materials.shed_images(u64::MAX);
    }
    write_images(&output, settings, &job, &outcome, &statistics)?;
    write_cache_points(&debug, &job, &outcome)?;
    statistics.seconds.write = written.elapsed().as_secs_f64();
    (statistics.cpu_seconds, statistics.peak_memory) = (cpu_seconds(), peak_memory());
    if let Some(path) = &settings.stats {
        write_json(path, &statistics)?;
    }
    if !settings.quiet {
        for warning in told {
            say(warning);
        }
        summarise(&output, &statistics, &outcome);
        if outcome.interrupted && matches!(kept, Some(Ok(()))) {
            say(format!("{}: --resume goes on from here", beside(&output).display()));
        }
        conclude(&output, &statistics, &outcome);
    }
    if let Some(keeper) = keeper.filter(|_| !outcome.interrupted) {
        keeper.forget();
    }
    if let Some(exhausted) = guard.stopped() {
        return Err(exhausted.into());
    }
    Ok(if outcome.interrupted { ExitStatus::Interrupted } else { ExitStatus::Done })
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

/// Renders one sample again and prints how it comes about.
fn replay(
    arguments: &RenderArguments,
    settings: &RenderSettings,
    sample: RejectedSample,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads.unwrap_or(0)).build()?;
    let interrupts = Interrupts::listen();
    let replayed = pool.install(|| {
        let prepared = load(&arguments.scene, sources, warnings)
            .and_then(|(scene, timings)| Job::prepare(&scene, settings, timings, warnings));
        if !settings.quiet {
            print_warnings(warnings, sources);
        }
        let mut job = prepared?;
        let limit = match settings.budget {
            Budget::Scene => Some(job.scene_spp),
            Budget::Samples(spp) => Some(spp),
            Budget::Time(_) | Budget::Error(_) => None,
        };
        let seed = settings.seed.unwrap_or(job.scene_seed);
        let listener = progress::listener(arguments.limits.progress, settings.quiet);
        interrupts.rendering_begins();
        Ok::<_, RenderError>(job.replay(seed, sample, &arguments.passes, limit, &interrupts.stop, listener.as_ref())?)
    })?;
    let _ = write!(std::io::stdout(), "{replayed}");
    Ok(ExitStatus::Done)
}

/// The times as JSON, without that of writing the file they go into.
fn seconds_so_far(seconds: &crate::render::Timings) -> String {
    let mut value = serde_json::to_value(seconds).unwrap_or_default();
    if let Some(map) = value.as_object_mut() {
        map.remove("write");
    }
    value.to_string()
}

/// Whether a name says that it is a picture of another kind than OpenEXR.
fn is_other_picture(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_ascii_lowercase());
    ending.is_some_and(|e| ["png", "jpg", "jpeg", "tif", "tiff", "tga", "hdr", "bmp"].iter().any(|known| e == *known))
}

/// Refuses to write two things to one file, or over an input.
pub fn refuse_overlap(outputs: &[&Path], mut inputs: impl Iterator<Item = PathBuf>) -> Result<(), RenderError> {
    // Files that are not there yet are told apart by their folder and name.
    let place = |path: &Path| {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let beside = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
        path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_owned())
    };
    // Devices such as /dev/null may take anything.
    let places: Vec<(&Path, PathBuf)> =
        outputs.iter().filter(|path| !is_device(path)).map(|&path| (path, place(path))).collect();
    for (i, (path, at)) in places.iter().enumerate() {
        if places[..i].iter().any(|(_, other)| other == at) {
            return Err(RenderError::Overlap { path: path.to_path_buf() });
        }
    }
    match inputs.find_map(|input| places.iter().find(|(_, at)| *at == place(&input)).map(|(path, _)| *path)) {
        Some(path) => Err(RenderError::Overlap { path: path.to_path_buf() }),
        None => Ok(()),
    }
}

fn write_images(
    output: &Path,
    settings: &RenderSettings,
    job: &Job,
    outcome: &Outcome,
    statistics: &Statistics,
) -> Result<(), RenderError> {
    let mut channels = outcome.film.channels();
    let mut attribute = |name: &str, value: String| channels.attributes.push((name.to_owned(), value));
    attribute("lanternfish.command", statistics.command.clone());
    attribute("lanternfish.version", statistics.version.to_owned());
    attribute("lanternfish.scene", statistics.scene.clone());
    attribute("lanternfish.seed", statistics.seed.to_string());
    attribute("lanternfish.samplesPerPixel", statistics.samples_per_pixel.to_string());
    attribute("lanternfish.backend", statistics.backend.clone());
    attribute("lanternfish.plan", job.plan.summary());
    attribute("lanternfish.seconds", seconds_so_far(&statistics.seconds));
    if let Some(fault) = of_rejected(&outcome.film, statistics.replay.as_deref()) {
        attribute("lanternfish.nonFinite", fault);
    }
    if outcome.interrupted {
        attribute("lanternfish.interrupted", "the render was stopped; pixels differ in their sample counts".to_owned());
    }
    write_exr(output, &channels)?;
    if let Some(png) = settings.png_path(output) {
        write_png(&png, &outcome.film.beauty(), 0.0)?;
    }
    Ok(())
}

/// The picture of the cache points and the PLY file beside it, if they were asked for.
fn debug_files(settings: &RenderSettings) -> Vec<PathBuf> {
    settings.debug_cache_points.iter().flat_map(|path| [path.clone(), path.with_extension("ply")]).collect()
}

fn write_cache_points(files: &[PathBuf], job: &Job, outcome: &Outcome) -> Result<(), RenderError> {
    let [picture, ply] = files else { return Ok(()) };
    let Some(cache) = job.world.light_choice.cache_points() else {
        say(
            "no cache points were built: there is no picture of them (--lights cache-points builds them wherever there are two lights)",
        );
        return Ok(());
    };
    let points: Vec<_> = cache.points().collect();
    let (beauty, tracer) = (outcome.film.beauty(), &job.world.tracer);
    write_picture(picture, &beauty, job.film.bounds, &job.camera, tracer, &points)?;
    Ok(write_ply(ply, &points)?)
}

fn write_json(path: &Path, statistics: &Statistics) -> Result<(), RenderError> {
    let text = serde_json::to_string_pretty(statistics).map_err(|error| OutputError::new(path, error))?;
    Ok(write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?)
}

/// An error for something that is not a scene file but should be readable.
pub fn unreadable(path: &Path, reason: impl Into<String>) -> RenderError {
    RenderError::Scene(crate::scene::SceneError::new(SceneErrorKind::File {
        path: path.to_owned(),
        reason: reason.into(),
    }))
}
