//! `lanternfish render`: loads, renders, writes, and says what went wrong.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::arguments::RenderArguments;
use super::diagnostics::{print_error, print_message, print_warnings, warning_lines};
use super::{ExitStatus, progress};
use crate::film::exr::write_exr;
use crate::film::image::{check_writable, write_atomically, write_png};
use crate::geometry::trace::TraceError;
use crate::integrator::Counters;
use crate::render::stats::{Statistics, process_usage};
use crate::render::{Job, Outcome, RenderError, RenderSettings, load};
use crate::scene::{SceneErrorKind, Sources, Warnings};

/// Runs the command; messages go to the standard error output.
pub fn run(arguments: &RenderArguments) -> ExitStatus {
    let settings = arguments.settings();
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let result = render(&arguments.scene, &settings, &mut sources, &mut warnings);
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
                RenderError::Trace(TraceError::Missing(_)) | RenderError::Overlap { .. } => ExitStatus::Usage,
                RenderError::Trace(TraceError::Memory(_)) | RenderError::Threads(_) => ExitStatus::Limit,
                RenderError::Trace(TraceError::Geometry(_)) => ExitStatus::BadInput,
                _ => ExitStatus::Failed,
            }
        }
    }
}

fn render(
    path: &Path,
    settings: &RenderSettings,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let threads = settings.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let interrupt = interrupt_flag();

    let (job, outcome, seed, output) = pool.install(|| {
        let prepared = load(path, sources, warnings)
            .and_then(|(scene, timings)| Job::prepare(&scene, settings, timings, warnings));
        if !settings.quiet {
            print_warnings(warnings, sources);
        }
        let mut job = prepared?;
        let output = settings.output_path(path, job.film.filename.as_deref());
        refuse_overlap(path, &output, settings)?;
        for file in [Some(&output), settings.png_path(&output).as_ref(), settings.stats.as_ref()].into_iter().flatten()
        {
            check_writable(file).map_err(|error| output_error(file, &error.reason))?;
        }
        let seed = settings.seed.unwrap_or(job.scene_seed);
        let listener = progress::listener(settings.quiet);
        let outcome = job.render(seed, settings.budget, &interrupt, listener.as_ref());
        Ok::<_, RenderError>((job, outcome, seed, output))
    })?;
    if outcome.interrupted && outcome.film.sample_count() == 0 {
        eprintln!("interrupted before anything was rendered: no image is written");
        return Ok(ExitStatus::Interrupted);
    }

    let written = Instant::now();
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
        seconds: job.timings,
        cpu_seconds: 0.0,
        peak_memory: 0,
        counters: outcome.counters,
        plan: job.plan.clone(),
        warnings: warning_lines(warnings, sources),
    };
    (statistics.cpu_seconds, statistics.peak_memory) = process_usage();
    write_images(&output, settings, &job, &outcome, &statistics)?;
    statistics.seconds.write = written.elapsed().as_secs_f64();
    (statistics.cpu_seconds, statistics.peak_memory) = process_usage();
    if let Some(path) = &settings.stats {
        write_json(path, &statistics)?;
    }
    if !settings.quiet {
        summarise(&output, &statistics, &outcome);
    }
    Ok(if outcome.interrupted { ExitStatus::Interrupted } else { ExitStatus::Done })
}

/// The times as JSON, without that of writing the file they go into.
fn seconds_so_far(seconds: &crate::render::Timings) -> String {
    let mut value = serde_json::to_value(seconds).unwrap_or_default();
    if let Some(map) = value.as_object_mut() {
        map.remove("write");
    }
    value.to_string()
}

/// Refuses to write two things to one file, or over the scene.
fn refuse_overlap(scene: &Path, output: &Path, settings: &RenderSettings) -> Result<(), RenderError> {
    let png = settings.png_path(output);
    let files = [Some(scene), Some(output), png.as_deref(), settings.stats.as_deref()];
    // Files that are not there yet are told apart by their names.
    let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    let files: Vec<&Path> = files.into_iter().flatten().collect();
    for (i, file) in files.iter().enumerate() {
        // Devices such as /dev/null may take anything.
        if !file.starts_with("/dev") && files[..i].iter().any(|other| same(file, other)) {
            return Err(RenderError::Overlap { path: file.to_path_buf() });
        }
    }
    Ok(())
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
    if outcome.interrupted {
        attribute("lanternfish.interrupted", "the render was stopped; pixels differ in their sample counts".to_owned());
    }
    if job.film.sensor.is_biased() {
        attribute("lanternfish.biased", "maxcomponentvalue cuts bright samples".to_owned());
    }
    write_exr(output, &channels).map_err(|error| output_error(output, &error.reason))?;
    if let Some(png) = settings.png_path(output) {
        write_png(&png, &outcome.film.beauty(), 0.0).map_err(|error| output_error(&png, &error.reason))?;
    }
    Ok(())
}

fn write_json(path: &Path, statistics: &Statistics) -> Result<(), RenderError> {
    let text = serde_json::to_string_pretty(statistics).map_err(|error| output_error(path, &error.to_string()))?;
    write_atomically(path, |file| std::io::Write::write_all(file, text.as_bytes()).map_err(|error| error.to_string()))
        .map_err(|error| output_error(path, &error.reason))
}

fn output_error(path: &Path, reason: &str) -> RenderError {
    RenderError::Output { path: path.to_owned(), reason: reason.to_owned() }
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
    eprintln!("{line}");
    if let (count, Some(first)) = outcome.film.rejected() {
        eprintln!(
            "warning: {count} samples were NaN or infinite and left out, first at pixel {},{} sample {}",
            first.pixel[0], first.pixel[1], first.sample
        );
    }
    if outcome.interrupted {
        eprintln!("interrupted: the image holds what was done by then");
    }
}

/// The command line, for headers and statistics.
pub fn command_line() -> String {
    let quote = |argument: String| if argument.contains(' ') { format!("'{argument}'") } else { argument };
    std::env::args_os().map(|argument| quote(argument.to_string_lossy().into_owned())).collect::<Vec<_>>().join(" ")
}

/// Set by the first Ctrl-C or termination request; a second one ends the process at once.
fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = flag.clone();
    // Where no handler can be installed (there is one already), the default one ends the process: nothing is half-written.
    let _ = ctrlc::set_handler(move || {
        if set.swap(true, Ordering::Relaxed) {
            std::process::exit(ExitStatus::Interrupted as i32);
        }
    });
    flag
}

/// An error for something that is not a scene file but should be readable.
pub fn unreadable(path: &Path, reason: impl Into<String>) -> RenderError {
    RenderError::Scene(crate::scene::SceneError::new(SceneErrorKind::File {
        path: path.to_owned(),
        reason: reason.into(),
    }))
}
