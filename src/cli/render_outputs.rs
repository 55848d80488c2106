//! The files that a render writes: which there are, whether they can be written, and what goes into them.

use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::checkpoint_arguments::beside;
use super::diagnostics::say;
use super::frames::with_number;
use super::render_report::of_rejected;
use crate::film::exr::{read_exr_attributes, write_exr};
use crate::film::image::write_png;
use crate::render::identity::Identity;
use crate::render::merge::{attributes, taken_text};
use crate::render::stats::Statistics;
use crate::render::{Job, Outcome, RenderError, RenderSettings, Timings};
use crate::report::cache_points::{write_picture, write_ply};
use crate::scene::{ParamSet, Warnings, with_slashes};
use crate::system::output::{OutputError, check_writable, is_device, write_atomically};

/// Where each output goes.
pub struct Outputs {
    /// The image.
    pub image: PathBuf,
    png: Option<PathBuf>,
    stats: Option<PathBuf>,
    /// The picture of the cache points and the PLY file beside it.
    cache_points: Option<[PathBuf; 2]>,
    /// What was learned.
    lesson: Option<PathBuf>,
    /// What it goes on from, where it keeps that.
    pub checkpoint: Option<PathBuf>,
}

/// The output that a film names, as it can be here. Exporters write the whole path of a file on another machine: where there is no such folder, the file's
/// own name is left, with a warning.
pub fn possible_name<'a>(name: Cow<'a, str>, film: &ParamSet, warnings: &mut Warnings) -> Cow<'a, str> {
    let slashed = with_slashes(&name);
    let path = Path::new(&*slashed);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let Some(own) = path.file_name().and_then(|own| own.to_str()) else { return name };
    match folder {
        None => name,
        Some(folder) if folder.is_dir() => slashed.into_owned().into(),
        Some(folder) => {
            let span = film.get("filename").map(|param| param.span);
            let message = format!(
                "there is no folder {} for the image: it goes to the current one, as {own}; -o names another place",
                folder.display()
            );
            warnings.add(span, message);
            own.to_owned().into()
        }
    }
}

/// What an image is of, for its header.
pub struct Origin {
    /// The render, to tell whether it has been done.
    pub render: Identity,
    /// The frame, to tell which parts belong together.
    pub frame: Identity,
    /// What is learned, to tell where it is of use.
    pub lesson: Identity,
}

impl Outputs {
    /// Of a render of the file `scene`, which names the output `named`; `keeps` is whether there are checkpoints.
    pub fn new(settings: &RenderSettings, scene: &Path, named: Option<&str>, keeps: bool) -> Self {
        let image = match (settings.output_path(scene, named), settings.frame) {
            (path, Some(frame)) if settings.output.is_none() => with_number(path, frame),
            (path, _) => path,
        };
        let png = settings.png_path(&image);
        let cache_points = settings.debug_cache_points.as_ref().map(|path| [path.clone(), path.with_extension("ply")]);
        let checkpoint = (keeps && !is_device(&image)).then(|| beside(&image));
        Self {
            image,
            png,
            stats: settings.stats.clone(),
            cache_points,
            lesson: settings.save_cache.clone(),
            checkpoint,
        }
    }

    /// All that are there in the end.
    fn results(&self) -> impl Iterator<Item = &Path> {
        let some = [Some(&self.image), self.png.as_ref(), self.stats.as_ref(), self.lesson.as_ref()];
        some.into_iter().flatten().chain(self.cache_points.iter().flatten()).map(PathBuf::as_path)
    }

    /// Checks that all can be written, each to a file of its own that is none of the `inputs`.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check(&self, inputs: impl Iterator<Item = PathBuf>) -> Result<(), RenderError> {
        let all: Vec<&Path> = self.results().chain(self.checkpoint.as_deref()).collect();
        refuse_overlap(&all, inputs)?;
        Ok(all.into_iter().try_for_each(check_writable)?)
    }

    /// Whether all are there, of this very render.
    pub fn are_done(&self, origin: &Origin) -> bool {
        let attributes = read_exr_attributes(&self.image).unwrap_or_default();
        let value = |name: &str| attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
        let is_this = value(attributes::RENDER) == Some(&origin.render.digest());
        is_this && value(attributes::INTERRUPTED).is_none() && self.results().all(Path::is_file)
    }

    /// Writes all but the statistics.
    ///
    /// # Errors
    /// The first that cannot be written.
    pub fn write(
        &self,
        origin: &Origin,
        job: &Job,
        outcome: &Outcome,
        statistics: &Statistics,
    ) -> Result<(), RenderError> {
        let mut channels = outcome.film.channels();
        let mut attribute = |name: &str, value: String| channels.attributes.push((name.to_owned(), value));
        attribute("lanternfish.command", statistics.command.clone());
        attribute("lanternfish.version", statistics.version.to_owned());
        attribute("lanternfish.scene", statistics.scene.clone());
        attribute(attributes::SEED, statistics.seed.to_string());
        attribute(attributes::SAMPLES_PER_PIXEL, statistics.samples_per_pixel.to_string());
        attribute(attributes::SAMPLES, taken_text(&[job.taken(outcome)]));
        if let Some(part) = &statistics.part {
            attribute(attributes::PART, part.clone());
        }
        if let Some(frame) = statistics.frame {
            attribute("lanternfish.frame", frame.to_string());
        }
        attribute(attributes::FRAME, origin.frame.to_text());
        attribute(attributes::RENDER, origin.render.digest());
        attribute("lanternfish.backend", statistics.backend.clone());
        attribute("lanternfish.plan", job.plan.summary());
        attribute("lanternfish.seconds", seconds_so_far(&statistics.seconds));
        if let Some(fault) = of_rejected(&outcome.film, statistics.replay.as_deref()) {
            attribute(attributes::NON_FINITE, fault);
        }
        if outcome.interrupted {
            let what = "the render was stopped; pixels differ in their sample counts";
            attribute(attributes::INTERRUPTED, what.to_owned());
        }
        // The image comes last: where it is, all else is.
        if let Some(png) = &self.png {
            write_png(png, &outcome.film.beauty(), 0.0)?;
        }
        self.write_cache_points(job, outcome)?;
        // Parts must not begin with a lesson that is to go on.
        let is_half = outcome.interrupted && job.is_lesson;
        if let Some(path) = self.lesson.as_ref().filter(|_| !is_half) {
            job.write_lesson(outcome, path, &origin.lesson)?;
        }
        Ok(write_exr(&self.image, channels)?)
    }

    fn write_cache_points(&self, job: &Job, outcome: &Outcome) -> Result<(), RenderError> {
        let Some([picture, ply]) = &self.cache_points else { return Ok(()) };
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

    /// Writes the statistics, if they were asked for.
    ///
    /// # Errors
    /// Where they cannot be written.
    pub fn write_statistics(&self, statistics: &Statistics) -> Result<(), RenderError> {
        let Some(path) = &self.stats else { return Ok(()) };
        let text = serde_json::to_string_pretty(statistics).map_err(|error| OutputError::new(path, error))?;
        Ok(write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))?)
    }
}

/// The times as JSON, without that of writing the file they go into.
fn seconds_so_far(seconds: &Timings) -> String {
    let mut value = serde_json::to_value(seconds).unwrap_or_default();
    if let Some(map) = value.as_object_mut() {
        map.remove("write");
    }
    value.to_string()
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
