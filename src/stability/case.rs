//! What a case is, and how what it finds is judged.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::scene::{How, Shot};
use crate::film::Film;
use crate::integrator::Counters;
use crate::render::{Budget, Job, Silent, load};
use crate::scene::{Sources, Warnings};

/// The probability that a suite without faults fails.
pub const FAMILY_RATE: f64 = 1e-4;

/// Among so many comparisons of means it is split evenly (Bonferroni): at least as many as the suite makes.
pub const MOST_COMPARISONS: usize = 1000;

/// The relative error that f32 arithmetic may leave in the mean of an image.
pub const ROUNDING: f64 = 2e-5;

/// One case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its group and its name in it: `media.split`.
    pub name: &'static str,
    /// What it checks, in a sentence.
    pub checks: &'static str,
    /// About how long it takes on two cores, for the progress bar and [`Case::is_quick`].
    pub seconds: f32,
    /// Why it is known to fail, if it is.
    pub known: Option<&'static str>,
    /// Runs it.
    pub run: fn(&mut Trial) -> Result<(), Stop>,
}

impl Case {
    /// The part of its name before the dot.
    pub fn group(&self) -> &'static str {
        self.name.split('.').next().unwrap_or(self.name)
    }

    /// Whether it is quick enough for every run of the tests.
    pub fn is_quick(&self) -> bool {
        self.seconds <= 1.5
    }
}

/// Why a case ended before its end.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// It needs what is not there.
    Skipped(String),
    /// A scene could not be rendered.
    Failed(String),
    /// It was out of time.
    Interrupted,
}

/// A comparison and how it went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What was compared.
    pub what: String,
    /// Where what is expected comes from.
    pub source: String,
    /// What must be.
    pub expected: f64,
    /// What is.
    pub got: f64,
    /// The standard error of the difference, where sampling has a say.
    pub error: Option<f64>,
    /// The largest difference allowed.
    pub allowed: f64,
    /// Whether all is well.
    pub passes: bool,
    /// The file of the scene that was rendered last.
    pub scene: Option<String>,
    /// What else is to be said.
    pub note: String,
}

impl Row {
    /// How much of what is allowed the difference is; infinite where it fails for another reason.
    pub fn strain(&self) -> f64 {
        let apart = (self.got - self.expected).abs();
        match (self.passes, apart / self.allowed) {
            (true, share) if share.is_finite() => share,
            (true, _) => 0.0,
            (false, share) if share > 1.0 => share,
            (false, _) => f64::INFINITY,
        }
    }
}

/// A mean and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

/// A rendered scene.
pub struct Image {
    /// Its pixels.
    pub film: Film,
    /// What was done for it.
    pub counters: Counters,
}

impl Image {
    /// The mean of the pixels in the columns `from..to`, over the channels (whose errors are taken as one), with its standard error from
    /// the pixels' variances.
    pub fn columns(&self, from: usize, to: usize) -> Measured {
        let image = self.film.channels();
        let width = image.bounds.width() as usize;
        let sum = |layer: &str| {
            let of = |name: &str| {
                let values = image.channel(&format!("{layer}{name}")).unwrap_or_default().iter().enumerate();
                values.filter(|(i, _)| (from..to).contains(&(i % width))).map(|(_, v)| f64::from(*v)).sum::<f64>()
            };
            [of("R"), of("G"), of("B")]
        };
        let count = (image.bounds.area() / width * (to - from)) as f64;
        let mean = sum("").iter().sum::<f64>() / (3.0 * count);
        let error = sum("variance.").iter().map(|v| v.sqrt()).sum::<f64>() / (3.0 * count);
        Measured { mean, error }
    }

    /// The same of all pixels.
    pub fn mean(&self) -> Measured {
        self.columns(0, self.film.settings().bounds.width() as usize)
    }

    /// The relative RMSE of this image times `by` and another one.
    pub fn apart(&self, by: f64, other: &Self) -> f64 {
        let (a, b) = (self.film.beauty(), other.film.beauty());
        let squares: f64 =
            a.pixels.iter().zip(&b.pixels).map(|(x, y)| (f64::from(*x) * by - f64::from(*y)).powi(2)).sum();
        (squares / b.pixels.iter().map(|y| f64::from(*y).powi(2)).sum::<f64>()).sqrt()
    }
}

/// A scene that a case has rendered.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Its file in the case's folder.
    pub file: String,
    /// What the command line says to render it alike.
    pub flags: String,
}

/// A case under way.
pub struct Trial {
    /// A folder for its files, empty at first.
    pub folder: PathBuf,
    /// Set when it is out of time.
    pub interrupt: Arc<AtomicBool>,
    /// What it has found.
    pub rows: Vec<Row>,
    /// What it has rendered.
    pub rendered: Vec<Rendered>,
}

impl Trial {
    /// Renders a scene. Samples that are NaN or infinite, and media that were left out, fail the case; it goes on all the same.
    pub fn render(&mut self, shot: &Shot, world: &str, how: &How) -> Result<Image, Stop> {
        let file = format!("{}.pbrt", self.rendered.len() + 1);
        let path = self.folder.join(&file);
        let failed = |error: &dyn std::fmt::Display| Stop::Failed(format!("{file}: {error}"));
        std::fs::write(&path, shot.text(world)).map_err(|error| failed(&error))?;
        self.rendered.push(Rendered { file: file.clone(), flags: how.flags() });
        let mut warnings = Warnings::default();
        let job = load(&path, &mut Sources::default(), &mut warnings)
            .and_then(|(scene, timings)| Job::prepare(&scene, &how.settings(), timings, &mut warnings));
        let mut job = job.map_err(|error| failed(&error))?;
        let outcome = job.render(how.seed, Budget::Samples(how.spp), &self.interrupt, &Silent);
        if self.interrupt.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        self.accept(&file, &outcome.film);
        let overflows = outcome.counters.region_overflows as f64;
        if overflows > 0.0 {
            self.equal(&format!("media left out, {file}"), overflows, 0.0, 0.0, "there are fewer than 32 in any place");
        }
        Ok(Image { film: outcome.film, counters: outcome.counters })
    }

    /// Fails the case for any sample that a film had to leave out, and for any value of its channels that is not finite.
    pub fn accept(&mut self, what: &str, film: &Film) {
        if let (count, Some(first)) = film.rejected() {
            let [x, y] = first.pixel;
            self.equal(&format!("NaN or infinite samples, {what}"), count as f64, 0.0, 0.0, "none in any render");
            if let Some(row) = self.rows.last_mut() {
                row.note = format!("--replay {x},{y},{}", first.sample);
            }
        }
        let channels = film.channels();
        let bad = |values: &[f32]| values.iter().filter(|v| !v.is_finite()).count();
        let bad: usize = channels.channels.iter().map(|(_, values)| bad(values)).sum();
        if bad > 0 {
            self.equal(&format!("NaN or infinite values, {what}"), bad as f64, 0.0, 0.0, "none in any channel");
        }
    }

    /// `got` must be `expected` up to `allowed`.
    pub fn equal(&mut self, what: &str, got: f64, expected: f64, allowed: f64, source: &str) {
        let passes = (got - expected).abs() <= allowed;
        self.push(Row {
            what: what.to_owned(),
            source: source.to_owned(),
            expected,
            got,
            error: None,
            allowed,
            passes,
            scene: None,
            note: String::new(),
        });
    }

    /// `got` must be `expected`, but for its sampling error and an absolute `floor`. An error above `precision` (relative) fails too: then it
    /// would not say much.
    pub fn mean(&mut self, what: &str, got: Measured, expected: f64, precision: f64, floor: f64, source: &str) {
        let Measured { mean, error } = got;
        let allowed = critical_z() * error + floor;
        let is_vague = !(error <= precision * expected.abs() + floor);
        self.push(Row {
            what: what.to_owned(),
            source: source.to_owned(),
            expected,
            got: mean,
            error: Some(error),
            allowed,
            passes: (mean - expected).abs() <= allowed && !is_vague,
            scene: None,
            note: if is_vague { "the standard error is too large to tell".to_owned() } else { String::new() },
        });
    }

    /// The same with the usual floor, [`ROUNDING`].
    pub fn expect(&mut self, what: &str, got: Measured, expected: f64, precision: f64, source: &str) {
        self.mean(what, got, expected, precision, ROUNDING * expected.abs(), source);
    }

    /// Two means must be the same.
    pub fn agree(&mut self, what: &str, got: Measured, other: Measured, precision: f64, source: &str) {
        let both = Measured { mean: got.mean, error: got.error.hypot(other.error) };
        self.expect(what, both, other.mean, precision, source);
    }

    fn push(&mut self, row: Row) {
        self.rows.push(Row { scene: self.rendered.last().map(|scene| scene.file.clone()), ..row });
    }
}

/// How many standard errors a mean may be off: two-sided, at [`FAMILY_RATE`] over [`MOST_COMPARISONS`].
pub fn critical_z() -> f64 {
    Normal::standard().inverse_cdf(1.0 - FAMILY_RATE / MOST_COMPARISONS as f64 / 2.0)
}
