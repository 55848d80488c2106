//! The renders: in each round the scene as it is and some of its variants at the same time, on one processor, until enough is known of each.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use tempfile::NamedTempFile;

use super::processor::Processor;
use super::row::{LIMIT, ratio_of};
use super::variant::{self, Variant};
use crate::bench::method::Method;
use crate::bench::ratio::Ratio;
use crate::bench::reference::read;
use crate::bench::run::{Cost, Task, render, render_together};
use crate::bench::settings::Settings;
use crate::bench::subject::Subject;
use crate::bench::{BenchError, Watch};
use crate::system::memory::available;

/// Rounds where nothing is said.
const LEAST: u32 = 3;
const MOST: u32 = 12;
/// Processor seconds that a render of the scene as it is takes, without getting ready.
const SECONDS: f64 = 1.0;
/// Samples a pixel of the render that tells how many that makes; volumes learn from the first four.
const PILOT: u32 = 8;
/// Pixels where nothing is said: few, since cache points are built for each.
const PIXELS: f64 = 96.0 * 54.0;
/// Variants at the same time, at most.
const TOGETHER: usize = 3;

/// What is rendered.
pub struct Plan<'a> {
    /// A file that holds the scene as it is.
    plain: NamedTempFile,
    scene: &'a Path,
    folder: &'a Path,
    method: Method,
    resolution: [u32; 2],
    /// Samples a pixel.
    pub spp: u32,
    /// Rounds, at least and at most.
    rounds: [u32; 2],
    /// Variants at the same time.
    together: usize,
}

/// What was measured of a variant.
#[derive(Default)]
pub struct Trial {
    /// The costs without it and with it, round by round.
    pub rounds: Vec<[Cost; 2]>,
    /// Whether the images of the first round are alike to the last bit.
    pub is_same_image: bool,
}

impl<'a> Plan<'a> {
    /// Finds out how many samples it takes.
    ///
    /// # Errors
    /// Those of a render.
    pub fn of(
        subject: &'a Subject,
        settings: &Settings,
        folder: &'a Path,
        stop: &AtomicBool,
    ) -> Result<Self, BenchError> {
        let [width, height] = [subject.display.width(), subject.display.height()].map(f64::from);
        let scale = (PIXELS / (width * height)).sqrt().min(1.0);
        let smaller = [width, height].map(|length| (scale * length).round().max(1.0) as u32);
        let rounds = settings.lean.runs.map_or([LEAST, MOST], |runs| [runs; 2]);
        let mut plan = Self {
            plain: variant::plain(&subject.file)?,
            scene: &subject.file,
            folder,
            method: Method { name: String::new(), arguments: vec![] },
            resolution: settings.lean.resolution.unwrap_or(smaller),
            spp: PILOT,
            rounds,
            together: 1,
        };
        let output = plan.output(0);
        let cost = render(&plan.task(plan.plain.path(), &plan.method, 1, &output), stop)?.cost;
        let samples = f64::from(PILOT) * SECONDS / cost.cpu_seconds_rendering.max(0.01);
        plan.spp = settings.lean.spp.unwrap_or(samples.log2().round().clamp(2.0, 16.0).exp2() as u32);
        let left = available().map_or(f64::INFINITY, |bytes| bytes as f64);
        plan.together = (0.7 * left / cost.peak_memory - 1.0).clamp(1.0, TOGETHER as f64) as usize;
        Ok(plan)
    }

    /// Width and height of the images.
    pub fn pixels(&self) -> [u32; 2] {
        self.resolution
    }

    /// The command that renders the scene as it is.
    pub fn command(&self) -> String {
        self.task(self.scene, &self.method, 1, Path::new("")).command()
    }

    fn output(&self, slot: usize) -> PathBuf {
        self.folder.join(format!("render-{slot}.exr"))
    }

    fn task<'b>(&self, scene: &'b Path, method: &'b Method, seed: u32, output: &'b Path) -> Task<'b> {
        Task { scene, method, resolution: Some(self.resolution), threads: Some(1), spp: self.spp, seed, output }
    }
}

/// Who is told how far it is.
pub struct Progress<'a> {
    /// Who.
    pub watch: &'a dyn Watch,
    /// The scene's name.
    pub scene: &'a str,
    /// Units of work that as many rounds of a variant as there may be are.
    pub share: f64,
}

/// Renders until enough is known of every variant.
///
/// # Errors
/// Those of renders and their images.
pub fn measure(
    plan: &Plan,
    variants: &[Variant],
    progress: &Progress,
    stop: &AtomicBool,
) -> Result<Vec<Trial>, BenchError> {
    let _processor = Processor::alone();
    let [least, most] = plan.rounds;
    let share = progress.share / f64::from(most);
    let mut trials: Vec<Trial> = variants.iter().map(|_| Trial::default()).collect();
    for round in 1..=most {
        let is_open = |trial: &Trial, idle: bool| round <= least || !is_enough(&ratio_of(&trial.rounds), idle);
        let mut open: Vec<usize> =
            (0..variants.len()).filter(|&i| trials[i].rounds.len() as u32 == round - 1).collect();
        let count = open.len();
        open.retain(|&i| is_open(&trials[i], variants[i].is_idle));
        progress.watch.skip(share * f64::from(most - round + 1) * (count - open.len()) as f64);
        for group in open.chunks(plan.together) {
            let (costs, same) = together(plan, variants, group, round, stop)?;
            for (k, &index) in group.iter().enumerate() {
                let trial = &mut trials[index];
                trial.rounds.push([costs[0], costs[k + 1]]);
                if round == 1 {
                    trial.is_same_image = same[k];
                }
                let name = variants[index].system.name;
                progress.watch.done(share, &format!("{}: with and without {name}", progress.scene));
            }
        }
    }
    Ok(trials)
}

/// The costs of the scene as it is and of the variants in `group`, and whether the images of the latter are like that of the former.
fn together(
    plan: &Plan,
    variants: &[Variant],
    group: &[usize],
    round: u32,
    stop: &AtomicBool,
) -> Result<(Vec<Cost>, Vec<bool>), BenchError> {
    let outputs: Vec<PathBuf> = (0..=group.len()).map(|slot| plan.output(slot)).collect();
    let mut tasks = vec![plan.task(plan.plain.path(), &plan.method, round, &outputs[0])];
    for (&index, output) in group.iter().zip(&outputs[1..]) {
        let variant = &variants[index];
        let file = variant.file.as_ref().unwrap_or(&plan.plain);
        tasks.push(plan.task(file.path(), &variant.method, round, output));
    }
    // Another one begins each time.
    let first = round as usize % tasks.len();
    tasks.rotate_left(first);
    let mut costs: Vec<Cost> = render_together(&tasks, stop)?.into_iter().map(|rendered| rendered.cost).collect();
    costs.rotate_right(first);
    let without = read(&outputs[0], "the render")?;
    let same = outputs[1..].iter().map(|output| Ok(read(output, "the render")?.colour == without.colour));
    Ok((costs, same.collect::<Result<_, BenchError>>()?))
}

/// Whether more rounds would hardly say more. It is asked after every round, so an interval half as wide again has to be clear of the limit. What costs just the
/// limit is then found on either side of it with a probability of 5 % each, in place of 2.5 % of one look (simulated with normal ratios, 3 to 12 rounds).
fn is_enough(ratio: &Ratio, is_idle: bool) -> bool {
    let [low, high] = [ratio.low, ratio.high].map(|end| ratio.value * (end / ratio.value).powf(1.5));
    if is_idle { low > LIMIT || high <= LIMIT } else { high / low < 1.2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_end_where_the_verdict_is_beyond_doubt() {
        let ratio = |value: f64, factor: f64| Ratio { value, low: value / factor, high: value * factor };
        assert!(is_enough(&ratio(1.10, 1.03), true) && is_enough(&ratio(1.0, 1.005), true));
        assert!(!is_enough(&ratio(1.0, 1.009), true) && !is_enough(&ratio(1.03, 1.018), true));
        assert!(!is_enough(&ratio(f64::NAN, 1.0), true) && !is_enough(&ratio(2.0, 1.1), false));
        assert!(is_enough(&ratio(2.0, 1.03), false));
    }
}
