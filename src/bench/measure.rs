//! One scene rendered by every method: by rising samples, seed by seed over all methods, each seed beginning with another one, so that
//! whatever else the machine does hits all alike.

use std::sync::atomic::AtomicBool;

use super::crops::Crops;
use super::curve::{Curve, Point, Run};
use super::error::Errors;
use super::hdr_flip::HdrFlip;
use super::method::Method;
use super::ratio::short;
use super::reference::{self, Reference, read};
use super::report::SceneReport;
use super::run::{Rendered, Task, render};
use super::settings::{Levels, Settings};
use super::subject::Subject;
use super::trim::{self, Squares};
use super::{BenchError, Watch};
use crate::report::compare::Side;
use crate::system::output::OutputError;

/// Samples a pixel that building costs as much as, roughly: for telling how far it is.
const BUILDING: f64 = 4.0;
/// No more samples a pixel than this, however much time there is.
const MOST_SPP: u32 = 1 << 20;

/// A method on its way.
struct Track {
    method: Method,
    /// Samples a pixel that are still wanted, the next one last; where time decides, the next one alone.
    next: Vec<u32>,
    points: Vec<(u32, Vec<Run>)>,
    /// Of the renders with most samples so far: the errors of pixels, by seed.
    squares: Vec<Squares>,
    /// Whether it gets fewer samples than the others: it is not asked for a picture then.
    is_cut: bool,
    /// The image of the first seed, with the most samples that all methods have.
    picture: Option<(u32, Side)>,
}

/// How much is to be done, in units of what `watch` is told: samples a pixel, or seconds.
pub fn work(subject: &Subject, settings: &Settings) -> f64 {
    let methods = subject.entry.methods.len() as f64;
    let points = match &settings.levels {
        Levels::Samples(list) => list.iter().map(|&spp| f64::from(spp) + BUILDING).sum(),
        Levels::Time(seconds) => 2.0 * seconds,
    };
    reference::work(subject, settings) + f64::from(settings.runs) * methods * points
}

/// Renders `subject` in every way and judges the images.
///
/// # Errors
/// Those of renders and of their images.
pub fn measure(
    subject: &Subject,
    settings: &Settings,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> Result<(SceneReport, Crops), BenchError> {
    let reference = Reference::of(subject, settings, watch, stop)?;
    let flip = HdrFlip::new(&reference.image);
    let own = reference.about.own_rmse;
    let (mut tracks, mut notes) = tracks(subject, settings, watch);
    let scratch = tempfile::tempdir().map_err(|error| OutputError::new(&std::env::temp_dir(), error))?;
    let output = scratch.path().join("render.exr");

    let (mut turn, mut backend) = (0, String::new());
    let mut is_common = true;
    while tracks.iter().any(|track| !track.next.is_empty()) {
        is_common &= tracks.iter().filter(|track| !track.is_cut).all(|track| !track.next.is_empty());
        // All that render now do so with as many samples, where they have that in common.
        let Some(spp) = tracks.iter().filter_map(|track| track.next.last().copied()).min() else { break };
        let mut level: Vec<(Vec<Run>, Vec<Squares>)> = tracks.iter().map(|_| (vec![], vec![])).collect();
        for seed in settings.seeds() {
            let count = tracks.len();
            for index in (0..count).map(|i| (i + turn) % count) {
                let track = &mut tracks[index];
                if track.next.last() != Some(&spp) {
                    continue;
                }
                let (method, resolution, threads) = (&track.method, settings.resolution, settings.threads);
                let task = Task { scene: &subject.file, method, resolution, threads, spp, seed, output: &output };
                let Rendered { cost, backend: traced_by } = render(&task, stop)?;
                backend = traced_by;
                let command = task.command();
                let image = read(&output, "the render")?;
                let (errors, squares) = Errors::of(&image, &reference, &flip);
                let work = match settings.levels {
                    Levels::Samples(_) => f64::from(spp) + BUILDING,
                    Levels::Time(_) => cost.wall_seconds,
                };
                let (scene, name, error) = (&subject.entry.name, &track.method.name, short(errors.rmse));
                let took = short(cost.wall_seconds);
                watch.done(work, &format!("{scene}, {name}, {spp} spp, seed {seed}: RMSE {error} in {took} s"));
                level[index].0.push(Run { seed, command, cost, errors });
                level[index].1.push(squares);
                if is_common && seed == 1 && !track.is_cut {
                    track.picture = Some((spp, image));
                }
            }
            turn += 1;
        }
        for (track, (runs, squares)) in tracks.iter_mut().zip(level).filter(|(_, (runs, _))| !runs.is_empty()) {
            track.next.pop();
            if let Levels::Time(seconds) = settings.levels
                && expected(&runs) <= seconds
                && spp < MOST_SPP
            {
                track.next.push(2 * spp);
            }
            track.points.push((spp, runs));
            track.squares = squares;
        }
    }

    let all: Vec<Vec<Squares>> = tracks.iter_mut().map(|track| std::mem::take(&mut track.squares)).collect();
    let kept = trim::kept(&all);
    let crops = Crops::of(
        &reference,
        &flip,
        &all,
        tracks.iter().filter_map(|track| {
            let (spp, image) = track.picture.as_ref()?;
            Some((track.method.name.as_str(), *spp, image))
        }),
    );
    let about = reference.about;
    let curves: Vec<Curve> = tracks
        .into_iter()
        .zip(&all)
        .map(|(track, squares)| {
            let points = track.points.into_iter().map(|(spp, runs)| Point::of(spp, runs, own)).collect();
            let trimmed: Vec<f64> = squares.iter().map(|image| trim::mean_of(&kept, image)).collect();
            Curve::of(track.method, points, &about, &trimmed)
        })
        .collect();
    if subject.warnings > 0 {
        notes.push(format!("loading it gives {} warnings, which a render of it lists", subject.warnings));
    }
    Ok((SceneReport::new(subject, about, backend, curves, notes), crops))
}

/// The methods that are measured, and what is to be said of those that are not, or not in full.
fn tracks(subject: &Subject, settings: &Settings, watch: &dyn Watch) -> (Vec<Track>, Vec<String>) {
    let mut notes = vec![];
    let mut tracks = vec![];
    for method in &subject.entry.methods {
        let mut next = match &settings.levels {
            Levels::Samples(list) => list.iter().rev().copied().collect(),
            Levels::Time(_) => vec![1],
        };
        let most = subject.entry.most_questions.filter(|_| method.is_exhaustive());
        let wanted = next.len();
        next.retain(|&spp| {
            let is_affordable = most.is_none_or(|most| subject.questions(spp) <= most);
            if !is_affordable {
                watch.skip(f64::from(settings.runs) * (f64::from(spp) + BUILDING));
            }
            is_affordable
        });
        let name = &method.name;
        let (lights, pixels) = (subject.lights, subject.bounds.area());
        match next.first() {
            None => notes.push(format!(
                "{name} is left out: it would ask {lights} lights at each vertex of {pixels} paths, even with one sample a pixel"
            )),
            Some(last) if next.len() < wanted => notes.push(format!(
                "{name} is measured up to {last} spp only: it asks {lights} lights at each vertex; ratios compare TTUV, which more samples \
                 hardly change"
            )),
            Some(_) => {}
        }
        if !next.is_empty() {
            let is_cut = next.len() < wanted;
            tracks.push(Track { method: method.clone(), next, points: vec![], squares: vec![], is_cut, picture: None });
        }
    }
    (tracks, notes)
}

/// Seconds that a render with twice the samples of these would take.
fn expected(runs: &[Run]) -> f64 {
    let seconds = runs.iter().map(|run| run.cost.wall_seconds + run.cost.render_seconds);
    seconds.sum::<f64>() / runs.len() as f64
}
