//! `lanternfish render`: loads, renders, writes, and says what went wrong.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use bytesize::ByteSize;

use super::arguments::RenderArguments;
use super::checkpoint_arguments::{CheckpointArguments, beside};
use super::diagnostics::{print_error, print_message, print_warnings, say, warning_lines};
use super::interrupt::Interrupts;
use super::{ExitStatus, progress};
use crate::film::exr::write_exr;
use crate::film::image::write_png;
use crate::film::{Film, RejectedSample};
use crate::geometry::trace::TraceError;
use crate::integrator::Counters;
use crate::integrator::path::MOST_BOUNCES;
use crate::material::mip_map::cache::TileCacheStatistics;
use crate::medium::regions::MAX_OVERLAP;
use crate::render::checkpoint::{self, CheckpointError, Identity, Keeper};
use crate::render::stats::Statistics;
use crate::render::{Budget, Job, Outcome, PngOutput, RenderError, RenderSettings, ReplayError, inputs, load};
use crate::report::cache_points::{write_picture, write_ply};
use crate::scene::{SceneErrorKind, Sources, Warnings};
use crate::system::clock::cpu_seconds;
use crate::system::memory::peak_memory;
use crate::system::output::{OutputError, check_writable, is_device, write_atomically};

/// Runs the command; messages go to the standard error output.
pub fn run(arguments: &RenderArguments) -> ExitStatus {
    let settings = arguments.settings();
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    if let Some(sample) = arguments.replay {
        let replayed = replay(&arguments.scene, &settings, sample, &arguments.passes, &mut sources, &mut warnings);
        return report_end(replayed, &sources);
    }
    let result = render(arguments, &settings, &mut sources, &mut warnings);
    report_end(result, &sources)
}

/// Prints an error, if there is one, and says how the process ends.
pub fn report_end(result: Result<ExitStatus, RenderError>, sources: &Sources) -> ExitStatus {
    match result {
        Ok(status) => status,
        Err(RenderError::Scene(error)) => {
            print_error(&error, sources);
            ExitStatus::from(&error.kind)
        }
        Err(error) => {
            print_message(&error.to_string());
            match error {
                RenderError::Trace(TraceError::Missing(_))
                | RenderError::Overlap { .. }
                | RenderError::Replay(ReplayError::Pixel(..) | ReplayError::Sample(..))
                | RenderError::Ending { .. } => ExitStatus::Usage,
                RenderError::Checkpoint(_) => ExitStatus::BadInput,
                RenderError::Replay(ReplayError::Interrupted) => ExitStatus::Interrupted,
                RenderError::Trace(TraceError::Memory(_)) | RenderError::Threads(_) => ExitStatus::Limit,
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
        let from = go_on_from(&arguments.checkpoints, &kept, &identity)?;
        let keeper = keeps.map(|interval| Keeper::new(kept, identity, interval, &interrupts.keep));
        let listener = progress::listener(settings.quiet);
        interrupts.rendering_begins();
        let before = cpu_seconds();
        let outcome = match &keeper {
            Some(keeper) => {
                job.render_kept(seed, settings.budget, &interrupts.stop, listener.as_ref(), keeper, from)?
            }
            None => job.render(seed, settings.budget, &interrupts.stop, listener.as_ref()),
        };
        Ok::<_, RenderError>((job, outcome, seed, output, keeper, cpu_seconds() - before))
    })?;
    let mut late = Warnings::default();
    job.world.materials.report_images(&mut late)?;
    if !settings.quiet {
        print_warnings(&late, sources);
    }
    let is_kept = keeper.as_ref().filter(|_| outcome.interrupted).map(Keeper::settle).transpose()?.is_some();
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
    let told = [warning_lines(&late, sources), after_the_fact(&outcome, replay.as_deref())].concat();
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
        warnings: [warning_lines(warnings, sources), told.clone()].concat(),
    };
    (statistics.cpu_seconds, statistics.peak_memory) = (cpu_seconds(), peak_memory());
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
        if is_kept {
            say(format!("{}: --resume goes on from here", beside(&output).display()));
        }
    }
    if let Some(keeper) = keeper.filter(|_| !outcome.interrupted) {
        keeper.forget();
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
    path: &Path,
    settings: &RenderSettings,
    sample: RejectedSample,
    passes: &[u32],
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads.unwrap_or(0)).build()?;
    let interrupts = Interrupts::listen();
    let replayed = pool.install(|| {
        let prepared = load(path, sources, warnings)
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
        let listener = progress::listener(settings.quiet);
        interrupts.rendering_begins();
        Ok::<_, RenderError>(job.replay(seed, sample, passes, limit, &interrupts.stop, listener.as_ref())?)
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

fn summarise(output: &Path, statistics: &Statistics, outcome: &Outcome) {
    let Counters { closest_rays, shadow_rays, flight_steps, transmittance_steps, .. } = statistics.counters;
    let rays = (closest_rays + shadow_rays) as f64;
    let mut line = format!(
        "{}: {} spp in {:.1} s, {:.2} Mray/s",
        output.display(),
        statistics.samples_per_pixel,
        statistics.seconds.render,
        rays / statistics.seconds.render.max(1e-9) * 1e-6
    );
    if flight_steps + transmittance_steps > 0 {
        let steps = (flight_steps + transmittance_steps) as f64;
        line += &format!(", {:.2} Mstep/s in media", steps / statistics.seconds.render.max(1e-9) * 1e-6);
    }
    if let Some(error) = statistics.error {
        line += &format!(", error {:.2} %", error * 100.0);
    }
    say(line);
    if let Some(TileCacheStatistics { limit, held, hit_rate, .. }) = statistics.texture_cache {
        let (limit, held) = (ByteSize(limit), ByteSize(held));
        say(format!(
            "textures: at most {held} of tiles in memory, of {limit}; {:.2} % of look-ups found theirs",
            100.0 * hit_rate
        ));
    }
    if outcome.interrupted {
        say("interrupted: the image holds what was done by then");
    }
}

/// What only rendering could tell to be wrong.
fn after_the_fact(outcome: &Outcome, replay: Option<&str>) -> Vec<String> {
    let mut warnings = vec![];
    warnings.extend(of_rejected(&outcome.film, replay).map(|fault| format!("warning: {fault}")));
    let cut = outcome.counters.cut_paths;
    if cut > 0 {
        let share = 100.0 * cut as f64 / outcome.counters.paths as f64;
        warnings.push(format!(
            "warning: {cut} paths ({share:.2} %) were ended after {MOST_BOUNCES} bounces: the image is too dark by what they would have brought"
        ));
    }
    let overflows = outcome.counters.region_overflows;
    if overflows > 0 {
        warnings.push(format!(
            "warning: the image is wrong: {overflows} times a path met more than {MAX_OVERLAP} media in one place and left one out"
        ));
    }
    warnings
}

/// What a film has to say of samples that were left out, if there are any.
fn of_rejected(film: &Film, replay: Option<&str>) -> Option<String> {
    let (count, first) = film.rejected();
    let RejectedSample { pixel: [x, y], sample } = first?;
    let mut text = if count == 1 {
        format!("1 sample was NaN or infinite and left out: pixel {x},{y} sample {sample}")
    } else {
        format!("{count} samples were NaN or infinite and left out, first at pixel {x},{y} sample {sample}")
    };
    if let Some(replay) = replay {
        text += &format!("; this replays it: {replay}");
    }
    Some(text)
}

/// The command that replays a sample of the render that `arguments` (the program's name included) asked for. `passes` are told where
/// they do not follow from the samples a pixel.
fn replay_command(
    mut arguments: impl Iterator<Item = String>,
    RejectedSample { pixel: [x, y], sample }: RejectedSample,
    passes: impl Iterator<Item = u32>,
) -> String {
    // The program and the word `render`. Before all other arguments there is no place where an option would be taken for something else.
    let mut words: Vec<String> = arguments.by_ref().take(2).collect();
    words.extend(["--replay".to_owned(), format!("{x},{y},{sample}")]);
    let passes: Vec<String> = passes.map(|pass| pass.to_string()).collect();
    if !passes.is_empty() {
        words.extend(["--passes".to_owned(), passes.join(",")]);
    }
    in_words(words.into_iter().chain(arguments))
}

fn lossy(argument: std::ffi::OsString) -> String {
    argument.to_string_lossy().into_owned()
}

/// Arguments as one would type them into a shell.
fn in_words(arguments: impl Iterator<Item = String>) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%^".contains(c);
    let quote = |argument: String| {
        let needs = argument.is_empty() || !argument.chars().all(is_plain);
        if needs { format!("'{}'", argument.replace('\'', "'\\''")) } else { argument }
    };
    arguments.map(quote).collect::<Vec<_>>().join(" ")
}

/// The command line, for headers and statistics.
pub fn command_line() -> String {
    in_words(std::env::args_os().map(lossy))
}

/// An error for something that is not a scene file but should be readable.
pub fn unreadable(path: &Path, reason: impl Into<String>) -> RenderError {
    RenderError::Scene(crate::scene::SceneError::new(SceneErrorKind::File {
        path: path.to_owned(),
        reason: reason.into(),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::film_settings;
    use crate::film::{FilmOverrides, PixelSamples, SampleResult, Sensor};
    use crate::math::Rgb;

    /// A sample that is not finite, in whichever of its values, is counted, located, and told with the command that replays it.
    #[test]
    fn samples_left_out_are_told_with_the_command_that_replays_them() {
        let overrides = FilmOverrides { resolution: Some([40, 20]), crop: None };
        let mut film = Film::new(film_settings(vec![], &overrides), true);
        assert_eq!(of_rejected(&film, None), None);
        let mut samples = PixelSamples::new(Sensor::default());
        samples.add(8, &SampleResult::default());
        samples.add(9, &SampleResult { albedo: Rgb::splat(f32::NAN), ..SampleResult::default() });
        film.tiles_mut()[2].merge([35, 7], &samples);
        let (count, first) = film.rejected();
        let first = first.expect("one was left out");
        assert_eq!((count, first.pixel, first.sample), (1, [35, 7], 9));
        let words = ["lanternfish", "render", "my scene.pbrt", "--seed", "7", "--png"].map(str::to_owned);
        let command = replay_command(words.clone().into_iter(), first, [].into_iter());
        assert_eq!(command, "lanternfish render --replay 35,7,9 'my scene.pbrt' --seed 7 --png");
        let text = of_rejected(&film, Some(&command)).expect("told");
        assert!(text.starts_with("1 sample was NaN or infinite and left out: pixel 35,7 sample 9"), "{text}");
        assert!(text.ends_with(&command), "{text}");
        let timed = replay_command(words.into_iter(), first, [1, 1, 2, 4, 3].into_iter());
        assert!(timed.contains(" --replay 35,7,9 --passes 1,1,2,4,3 'my"), "{timed}");
        // Another tile has one that comes earlier.
        let mut samples = PixelSamples::new(Sensor::default());
        samples.add(3, &SampleResult { beauty: Rgb::splat(f32::INFINITY), ..SampleResult::default() });
        film.tiles_mut()[5].merge([33, 17], &samples);
        let text = of_rejected(&film, None).expect("told");
        assert_eq!(text, "2 samples were NaN or infinite and left out, first at pixel 33,17 sample 3");
    }

    #[test]
    fn quoted_words_reach_the_program_as_they_were() {
        let words = ["a b", "it's", "", "$HOME", "*.pbrt", "plain-1.0,x=y", "a;b", "µ"].map(str::to_owned);
        let line = format!("for i in {}; do printf '%s|' \"$i\"; done", in_words(words.clone().into_iter()));
        let out = std::process::Command::new("sh").args(["-c", &line]).output().expect("a shell");
        assert_eq!(String::from_utf8(out.stdout).expect("text"), words.join("|") + "|");
    }
}
