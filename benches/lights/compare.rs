//! One scene rendered in every way with every seed. Seed by seed over all ways, each seed beginning with another one, so that whatever else the
//! machine does hits all alike.

use std::io::Write;
use std::path::{Path, PathBuf};

use lanternfish::bench::estimate::Estimate;
use lanternfish::bench::ratio::Ratio;
use lanternfish::bench::trim;
use serde::Serialize;

use super::error::{Errors, Picture};
use super::reference::{About, Reference};
use super::run::{Cost, Task, render, write_scene};
use super::settings::Settings;
use super::variants::{self, OPTIMAL, Variant};

#[derive(Serialize)]
pub struct SceneResult {
    pub scene: String,
    pub lights: u64,
    pub file: PathBuf,
    pub reference: About,
    pub ways: Vec<Way>,
}

/// All renders of one variant.
#[derive(Serialize)]
pub struct Way {
    pub variant: Variant,
    /// Samples a pixel that were taken; costs and errors are scaled to those of all others.
    pub spp: u32,
    pub runs: Vec<Run>,
}

#[derive(Clone, Serialize)]
pub struct Run {
    pub seed: u64,
    pub cost: Cost,
    pub errors: Errors,
}

impl Run {
    /// RMSE² × minutes of processor time.
    pub fn ttuv(&self) -> f64 {
        self.errors.rmse.powi(2) * self.cost.cpu_seconds / 60.0
    }

    /// The same with the relative error.
    pub fn relative_ttuv(&self) -> f64 {
        self.errors.relative_mse * self.cost.cpu_seconds / 60.0
    }

    /// The same with the trimmed error.
    pub fn trimmed_ttuv(&self) -> f64 {
        self.errors.rmse_trimmed.powi(2) * self.cost.cpu_seconds / 60.0
    }
}

/// A number of one render.
pub type Quantity = fn(&Run) -> f64;

impl Way {
    pub fn estimate(&self, quantity: Quantity) -> Estimate {
        Estimate::of(&self.runs.iter().map(quantity).collect::<Vec<_>>())
    }

    /// How many times `other`'s number is this way's, seed by seed.
    pub fn ratio(&self, other: &Self, quantity: Quantity) -> Ratio {
        Ratio::of(self.runs.iter().zip(&other.runs).map(|(a, b)| quantity(a) / quantity(b)))
    }
}

impl SceneResult {
    pub fn way(&self, variant: Variant) -> Option<&Way> {
        self.ways.iter().find(|way| way.variant == variant)
    }
}

/// The variants that `settings` ask for, each once.
fn wanted(scene: &str, settings: &Settings) -> Vec<Variant> {
    let sampling = settings.sampling;
    let columns = if settings.columns { variants::columns(sampling) } else { vec![variants::defaults(sampling)] };
    let ablations = if settings.ablations { variants::ablations(scene, sampling) } else { vec![] };
    let is_wanted = |variant: &Variant| !settings.without.iter().any(|name| name == variant.name);
    columns.into_iter().chain(ablations).filter(is_wanted).collect()
}

pub fn measure(folder: &Path, name: &str, lights: u64, settings: &Settings) -> SceneResult {
    let file = write_scene(&folder.join(format!("{name}-{lights}")), name, lights);
    let reference = Reference::of(folder, &file, (name, lights), settings);
    let mut ways: Vec<Way> = wanted(name, settings)
        .into_iter()
        .map(|variant| {
            let spp = if variant == OPTIMAL { settings.optimal_spp(lights) } else { settings.spp };
            Way { variant, spp, runs: vec![] }
        })
        .collect();
    let mut squares = vec![vec![]; ways.len()];
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let output = scratch.path().join("render.exr");
    for (turn, seed) in settings.seeds().enumerate() {
        let count = ways.len();
        for index in (0..count).map(|i| (i + turn) % count) {
            let Way { variant, spp, runs } = &mut ways[index];
            let (arguments, size) = (variant.arguments, settings.size.as_str());
            let cost = render(&Task { scene: &file, arguments, size, spp: *spp, seed, output: &output });
            let (errors, of_pixels) = Errors::of(&Picture::read(&output), reference.halves.each_ref());
            squares[index].push(of_pixels);
            let factor = f64::from(settings.spp) / f64::from(*spp);
            runs.push(Run { seed, cost: cost.scaled(factor), errors: errors.scaled(factor) });
            print!(".");
            let _ = std::io::stdout().flush();
        }
    }
    println!();
    let kept = trim::kept(&squares);
    for (way, squares) in ways.iter_mut().zip(&squares) {
        let factor = f64::from(settings.spp) / f64::from(way.spp);
        for (run, squares) in way.runs.iter_mut().zip(squares) {
            run.errors.rmse_trimmed = (trim::mean_of(&kept, squares) / factor).sqrt();
        }
    }
    SceneResult { scene: name.to_owned(), lights, file, reference: reference.about, ways }
}
