//! References: what images are judged by, and how far that is off itself.
//!
//! Unless the user has one, it is rendered by asking every light at every vertex, with null tracking through media: nothing is learned, guessed or
//! left to a hierarchy, so it shares no flaw with what it judges. Where there are too many lights for that, the tree has to do. It is made in two
//! halves with seeds of their own, whose difference tells its error, and kept by all that it depends on.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::method::Method;
use super::run::{Task, render};
use super::settings::{Levels, Settings};
use super::subject::Subject;
use super::{BenchError, Watch};
use crate::film::ChannelImage;
use crate::film::exr::read_exr_layers;
use crate::report::compare::{Side, shape};

/// The seeds of the halves; those of what is judged are smaller.
const SEEDS: [u32; 2] = [1_000_000_007, 1_000_000_009];
/// Samples a pixel, in those of what is judged, where nothing is said; in a suite, whose time is limited, half of that.
const TIMES: u32 = 16;
/// Where lights × pixels × samples are more than this, asking every light takes longer than most would wait: about 10⁸ are asked in a second.
const MOST_QUESTIONS: f64 = 3e10;
/// From so many samples a pixel it is told what one takes.
const PILOT: u32 = 4;

/// What is taken for the truth.
pub struct Reference {
    /// Its image.
    pub image: Side,
    /// Its own mean square error at each pixel, by channel, where that is known: right on average only.
    pub own: Option<[Vec<f32>; 3]>,
    /// The same of what was gathered: all that is not seen without being scattered.
    pub own_gathered: Option<[Vec<f32>; 3]>,
    /// What it is worth.
    pub about: About,
}

/// What a reference is and is worth.
#[derive(Clone, Debug, Serialize)]
pub struct About {
    /// How it was made, and why so.
    pub how: String,
    /// Its files.
    pub files: Vec<PathBuf>,
    /// The commands that make them again; none for the user's own.
    pub commands: Vec<String>,
    /// Samples a pixel of all halves; 0 for the user's own.
    pub spp: u32,
    /// Mean over pixels and channels.
    pub mean: f64,
    /// Its own RMSE, where it is known.
    pub own_rmse: Option<f64>,
    /// The standard error of its mean, were the channels fully correlated.
    pub own_error_of_mean: Option<f64>,
    /// Mean of gathered light, where the image tells.
    pub gathered_mean: Option<f64>,
    /// Its standard error, where that is known.
    pub gathered_error_of_mean: Option<f64>,
}

impl Reference {
    /// The mean of two independent images of the same pixels; the half of their difference is what the mean is off by, on average of the square.
    pub fn of_halves([first, second]: &[Side; 2]) -> Self {
        let map = |of: fn(f32, f32) -> f32| -> [Vec<f32>; 3] {
            std::array::from_fn(|c| first.colour[c].iter().zip(&second.colour[c]).map(|(&a, &b)| of(a, b)).collect())
        };
        let own = map(|a, b| (0.5 * (a - b)).powi(2));
        let own_gathered = gathered(first).zip(gathered(second)).map(|(a, b)| {
            let half = |(a, b): (&f32, &f32)| (0.5 * (a - b)).powi(2);
            std::array::from_fn(|c| a[c].iter().zip(&b[c]).map(half).collect())
        });
        let gathered_error_of_mean =
            own_gathered.as_ref().map(|own| (3.0 * sum(own)).sqrt() / (3 * own[0].len()) as f64);
        let mean = |(a, b): (&f32, &f32)| 0.5 * a + 0.5 * b;
        let emission = first.emission.as_ref().zip(second.emission.as_ref());
        let emission = emission.map(|(a, b)| std::array::from_fn(|c| a[c].iter().zip(&b[c]).map(mean).collect()));
        let image = Side { colour: map(|a, b| 0.5 * a + 0.5 * b), variance: None, emission, ..first.clone() };
        let reference = Self::new(image, Some(own));
        Self { own_gathered, about: About { gathered_error_of_mean, ..reference.about }, ..reference }
    }

    fn new(image: Side, own: Option<[Vec<f32>; 3]>) -> Self {
        let values = 3.0 * image.bounds.area() as f64;
        let mean = sum(&image.colour) / values;
        let all = own.as_ref().map(sum);
        let gathered_mean = gathered(&image).map(|planes| sum(&planes) / values);
        let about = About {
            how: String::new(),
            files: vec![],
            commands: vec![],
            spp: 0,
            mean,
            own_rmse: all.map(|all| (all / values).sqrt()),
            own_error_of_mean: all.map(|all| (3.0 * all).sqrt() / values),
            gathered_mean,
            gathered_error_of_mean: None,
        };
        Self { image, own, own_gathered: None, about }
    }

    /// The one that `settings` ask for.
    ///
    /// # Errors
    /// Those of rendering it, and files that cannot be read or show other pixels.
    pub fn of(
        subject: &Subject,
        settings: &Settings,
        watch: &dyn Watch,
        stop: &AtomicBool,
    ) -> Result<Self, BenchError> {
        match &settings.reference {
            Some(path) => Self::own(path, subject, settings),
            None => Self::rendered(subject, settings, watch, stop),
        }
    }

    fn own(path: &Path, subject: &Subject, settings: &Settings) -> Result<Self, BenchError> {
        let file = read_exr_layers(path)?;
        // With the samples of one of the renders in it, it would flatter that one.
        let seed: Option<u32> = file.attribute("lanternfish.seed").and_then(|seed| seed.parse().ok());
        let shared = seed.filter(|seed| settings.seeds().any(|own| own == *seed));
        let mut image = side(path, file, "the reference")?;
        if image.bounds != subject.bounds || image.display != subject.display {
            return Err(BenchError::OtherPixels {
                path: path.to_owned(),
                found: image.shape(),
                scene: subject.file.display().to_string(),
                wanted: shape(subject.bounds, subject.display),
            });
        }
        let variance = image.variance.take();
        let known =
            if variance.is_some() { "by its layers variance.*" } else { "not known: it has no layers variance.*" };
        let mut reference = Self::new(image, variance);
        reference.about.how = format!("an image of yours, {}; its own error is {known}", path.display());
        if let Some(seed) = shared {
            let warning = format!("; it has the seed {seed}, as one of the renders: they may not be independent");
            reference.about.how += &warning;
        }
        reference.about.files = vec![path.to_owned()];
        Ok(reference)
    }

    fn rendered(
        subject: &Subject,
        settings: &Settings,
        watch: &dyn Watch,
        stop: &AtomicBool,
    ) -> Result<Self, BenchError> {
        let half = (samples(subject, settings, stop)? / 2).max(1);
        let (method, how) = choose(subject, 2 * half);
        let (mut commands, mut files, mut sides) = (vec![], vec![], vec![]);
        for (part, seed) in ["a", "b"].into_iter().zip(SEEDS) {
            let mut key = DefaultHasher::new();
            let (part_of, size) = (subject.bounds, subject.display);
            (&method.arguments, part_of.x1, part_of.y1, size.x1, size.y1).hash(&mut key);
            let output = place(subject, settings, &format!("{:08x}-{half}-{part}", key.finish() as u32));
            let task = task(subject, settings, &method, half, seed, &output);
            commands.push(task.command());
            let work = 0.5 * work(subject, settings);
            if output.is_file() {
                watch.skip(work);
            } else {
                let what = format!("{}: half of a reference, {half} spp, {}", subject.entry.name, method.show());
                watch.say(&what);
                let cost = render(&task, stop)?.cost;
                watch.done(work, &format!("{what}: {:.1} s", cost.wall_seconds));
            }
            sides.push(read(&output, "the reference")?);
            files.push(output);
        }
        let halves: [Side; 2] = sides.try_into().expect("there are two halves");
        let mut reference = Self::of_halves(&halves);
        reference.about = About { how, files, commands, spp: 2 * half, ..reference.about };
        Ok(reference)
    }
}

fn sum(planes: &[Vec<f32>; 3]) -> f64 {
    planes.iter().flatten().map(|&value| f64::from(value)).sum()
}

/// All of an image that is not seen without being scattered, where it says so.
pub fn gathered(image: &Side) -> Option<[Vec<f32>; 3]> {
    let emission = image.emission.as_ref()?;
    let rest = |c: usize| image.colour[c].iter().zip(&emission[c]).map(|(all, seen)| all - seen).collect();
    Some(std::array::from_fn(rest))
}

/// How much is to be done for it, in units of what is told to a [`Watch`]: samples a pixel, or seconds.
pub fn work(subject: &Subject, settings: &Settings) -> f64 {
    match (&settings.reference, settings.reference_spp, &settings.levels) {
        (Some(_), ..) => 0.0,
        (None, Some(spp), Levels::Samples(_)) => f64::from(spp),
        (None, None, Levels::Samples(list)) => {
            f64::from(times(subject)) * list.last().map_or(1.0, |&spp| f64::from(spp))
        }
        (None, _, Levels::Time(seconds)) => f64::from(TIMES) * seconds,
    }
}

/// How many times the samples of the longest render a reference has.
fn times(subject: &Subject) -> u32 {
    if subject.entry.most_questions.is_some() { TIMES / 2 } else { TIMES }
}

/// The file of a reference, by the content of its scene.
fn place(subject: &Subject, settings: &Settings, part: &str) -> PathBuf {
    let name = format!("{}-{:016x}-{part}.exr", subject.entry.name, subject.content);
    settings.out.join("references").join(name)
}

fn task<'a>(
    subject: &'a Subject,
    settings: &Settings,
    method: &'a Method,
    spp: u32,
    seed: u32,
    output: &'a Path,
) -> Task<'a> {
    let (resolution, threads) = (settings.resolution, settings.threads);
    Task { scene: &subject.file, method, resolution, threads, spp, seed, output }
}

/// Samples a pixel of a reference. Where seconds decide, both halves together take as long as so many of the longest renders.
fn samples(subject: &Subject, settings: &Settings, stop: &AtomicBool) -> Result<u32, BenchError> {
    let seconds = match (settings.reference_spp, &settings.levels) {
        (Some(spp), _) => return Ok(spp),
        (None, Levels::Samples(list)) => {
            return Ok(list.last().copied().unwrap_or(1).saturating_mul(times(subject)));
        }
        (None, Levels::Time(seconds)) => seconds,
    };
    let (method, _) = choose(subject, 1);
    let output = place(subject, settings, "pilot");
    let cost = render(&task(subject, settings, &method, PILOT, SEEDS[0], &output), stop)?.cost;
    // They were only a means.
    [output.clone(), output.with_extension("json")].iter().for_each(|file| drop(std::fs::remove_file(file)));
    let samples = f64::from(TIMES) * seconds * f64::from(PILOT) / cost.render_seconds.max(1e-3);
    // A power of two, so that it is seldom another one next time.
    Ok(samples.log2().floor().clamp(4.0, 20.0).exp2() as u32)
}

/// How the reference is made, and why so.
fn choose(subject: &Subject, spp: u32) -> (Method, String) {
    let method = |lights: &str| Method {
        name: lights.to_owned(),
        arguments: ["--lights", lights, "--volume-sampling", "null"].map(str::to_owned).to_vec(),
    };
    let questions = subject.questions(spp);
    if let Some(method) = &subject.entry.reference {
        (method.clone(), format!("as chosen ({}), in two halves", method.show()))
    } else if questions <= MOST_QUESTIONS {
        (
            method("optimal"),
            "by the exhaustive method, which asks every light at every vertex, in two halves".to_owned(),
        )
    } else {
        let lights = subject.lights;
        let why =
            format!("the exhaustive method would ask {lights} lights at each vertex, {questions:.1e} questions in all");
        (method("tree"), format!("by the tree, in two halves: {why}"))
    }
}

/// Reads the beauty of an OpenEXR file.
pub fn read(path: &Path, which: &'static str) -> Result<Side, BenchError> {
    side(path, read_exr_layers(path)?, which)
}

fn side(path: &Path, image: ChannelImage, which: &'static str) -> Result<Side, BenchError> {
    Side::new(image, which).map_err(|error| BenchError::Judge { path: path.to_owned(), error: Box::new(error) })
}
