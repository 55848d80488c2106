//! `lanternfish render`: its frames one after the other, a sample of one again, and what went wrong.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::arguments::RenderArguments;
use super::diagnostics::{print_error, print_message, print_warnings_before, say};
use super::frames::{Frames, has_place, numbered};
use super::interrupt::Interrupts;
use super::limit_arguments::Shown;
use super::log;
use super::machine_progress::print_fail;
use super::memory_guard::MemoryGuard;
use super::render_frame::Studio;
use super::{ExitStatus, progress};
use crate::film::RejectedSample;
use crate::geometry::trace::TraceError;
use crate::render::identity::Identity;
use crate::render::lesson::Lesson;
use crate::render::{Budget, Job, PngOutput, RenderError, RenderSettings, ReplayError, Share, inputs, load, memory};
use crate::scene::{SceneErrorKind, Sources, Warnings};
use crate::system::output::check_writable;

/// Runs the command; messages go to the standard error output.
pub fn run(arguments: &RenderArguments) -> ExitStatus {
    let settings = arguments.settings();
    let shown = arguments.limits.progress;
    let fails = |error| end_of_render(Err(error), shown, &Sources::default());
    if let Err(error) = arguments.limits.apply() {
        return fails(error);
    }
    let Some(sample) = arguments.replay else {
        return render(arguments, &settings).unwrap_or_else(fails);
    };
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let frame = arguments.share.frames.and_then(|frames| frames.numbers().next());
    let (scene, settings) = of_frame(&arguments.scene, &settings, frame);
    let replayed = replay(&scene, &settings, sample, arguments, &mut sources, &mut warnings);
    end_of_render(replayed, shown, &sources)
}

/// The end of a render, told to whoever listens for it too.
fn end_of_render(result: Result<ExitStatus, RenderError>, shown: Shown, sources: &Sources) -> ExitStatus {
    if let Err(error) = &result {
        tell_farm(shown, error, sources);
    }
    report_end(result, sources)
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
                | RenderError::Replay(ReplayError::Pixel(..) | ReplayError::Sample { .. })
                | RenderError::Share(_)
                | RenderError::NoPlace { .. }
                | RenderError::Lessonless(_)
                | RenderError::Ending { .. } => ExitStatus::Usage,
                RenderError::Checkpoint(_) | RenderError::Lesson(_) => ExitStatus::BadInput,
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

/// Renders all frames, up to the first that cannot be.
fn render(arguments: &RenderArguments, settings: &RenderSettings) -> Result<ExitStatus, RenderError> {
    // What the command line names is known to be wrong before a scene is read.
    if let Some(wrong) = settings.output.as_deref().filter(|path| is_other_picture(path)) {
        return Err(RenderError::Ending { path: wrong.to_owned() });
    }
    if let (Share::Lesson { of }, None) = (&settings.share, &settings.save_cache) {
        return Err(RenderError::Lessonless(*of));
    }
    let frames: Vec<Option<i32>> =
        arguments.share.frames.map_or(vec![None], |frames: Frames| frames.numbers().map(Some).collect());
    let named_png = settings.png.as_ref().and_then(|png| match png {
        PngOutput::File(path) => Some(path),
        PngOutput::Beside => None,
    });
    let picture = settings.debug_cache_points.as_ref();
    let named = [settings.output.as_ref(), named_png, settings.stats.as_ref(), picture, settings.save_cache.as_ref()];
    for file in named.into_iter().flatten() {
        if frames.len() > 1 && !has_place(file) {
            return Err(RenderError::NoPlace { path: file.clone() });
        }
        check_writable(&frames[0].map_or(file.clone(), |frame| numbered(file, frame)))?;
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
    let listener = progress::listener(shown, settings.quiet);
    let studio = Studio {
        checkpoints: &arguments.checkpoints,
        pool: &pool,
        interrupts: &interrupts,
        guard: &guard,
        listener: listener.as_ref(),
    };
    for (i, &frame) in frames.iter().enumerate() {
        let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
        log::set_frame(frame.map(i64::from));
        listener.frame(i, frames.len());
        if let Some(frame) = frame.filter(|_| frames.len() > 1 && !settings.quiet) {
            say(format!("frame {frame}, {} of {}", i + 1, frames.len()));
        }
        let (scene, settings) = of_frame(&arguments.scene, settings, frame);
        interrupts.rendering(false);
        guard.preparing_begins();
        let result = studio.render(&scene, &settings, &mut sources, &mut warnings);
        let status = end_of_render(result, shown, &sources);
        if status != ExitStatus::Done {
            return Ok(status);
        }
    }
    Ok(ExitStatus::Done)
}

/// The scene and settings of a frame: its number stands where names have a place for it.
fn of_frame(scene: &Path, settings: &RenderSettings, frame: Option<i32>) -> (PathBuf, RenderSettings) {
    let Some(frame) = frame else { return (scene.to_owned(), settings.clone()) };
    let named = |path: &Option<PathBuf>| path.as_ref().map(|path| numbered(path, frame));
    let settings = RenderSettings {
        output: named(&settings.output),
        png: settings.png.clone().map(|png| match png {
            PngOutput::File(path) => PngOutput::File(numbered(&path, frame)),
            PngOutput::Beside => png,
        }),
        stats: named(&settings.stats),
        debug_cache_points: named(&settings.debug_cache_points),
        save_cache: named(&settings.save_cache),
        load_cache: named(&settings.load_cache),
        frame: Some(frame),
        ..settings.clone()
    };
    (numbered(scene, frame), settings)
}

/// Renders one sample again and prints how it comes about.
fn replay(
    path: &Path,
    settings: &RenderSettings,
    sample: RejectedSample,
    arguments: &RenderArguments,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads.unwrap_or(0)).build()?;
    let interrupts = Interrupts::listen();
    let replayed = pool.install(|| {
        let prepared = load(path, sources, warnings).and_then(|(scene, timings)| {
            let identity = || Identity::of_lesson(sources, &inputs(&scene, sources), settings);
            let taught = settings.load_cache.as_ref().map(|path| Lesson::read(path, &identity())).transpose()?;
            Job::prepare_taught(&scene, settings, timings, warnings, taught)
        });
        if !settings.quiet {
            print_warnings_before(&prepared, warnings, sources);
        }
        let mut job = prepared?;
        let limit = match job.budget {
            Budget::Samples(spp) => Some(spp),
            Budget::Scene | Budget::Time(_) | Budget::Error(_) => None,
        };
        let listener = progress::listener(arguments.limits.progress, settings.quiet);
        interrupts.rendering(true);
        Ok::<_, RenderError>(job.replay(
            job.seed,
            sample,
            &arguments.passes,
            limit,
            &interrupts.stop,
            listener.as_ref(),
        )?)
    })?;
    let _ = write!(std::io::stdout(), "{replayed}");
    Ok(ExitStatus::Done)
}

/// Whether a name says that it is a picture of another kind than OpenEXR.
fn is_other_picture(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_ascii_lowercase());
    ending.is_some_and(|e| ["png", "jpg", "jpeg", "tif", "tiff", "tga", "hdr", "bmp"].iter().any(|known| e == *known))
}

/// An error for something that is not a scene file but should be readable.
pub fn unreadable(path: &Path, reason: impl Into<String>) -> RenderError {
    RenderError::Scene(crate::scene::SceneError::new(SceneErrorKind::File {
        path: path.to_owned(),
        reason: reason.into(),
    }))
}
