//! How well lights are selected: the table of Li et al. 2024 ("Cache Points for Production-Scale Occlusion-Aware Many-Lights Sampling and
//! Volumetric Scattering", section 5) for the project's own scenes, and what each part of it is worth.
//!
//!     cargo bench --bench lights -- [--scenes a,b|none] [--lights-of scene=N,…] [--size WxH] [--spp N] [--seeds N] [--first-seed N]
//!                                   [--reference-spp N] [--optimal-spp N] [--without "a,b"] [--no-columns] [--no-ablations] [--sampling]
//!                                   [--repetitions N] [--many [--few-lights N] [--many-lights N]]
//!
//! Every render is a process of its own. TTUV ("time to unit variance") is RMSE² × minutes; its minutes are processor time, which hardly notices
//! who else uses the machine, of the whole process. Intervals are 95 % confidence intervals over independent seeds, ratios are
//! paired by seed. `--many` compares 5,000 lights with 5,000,000. `--optimal-spp` lets the slow `optimal` take fewer samples and scales what it
//! measures, as with more than 100,000 lights it does by itself (a quarter of the samples); `--without` leaves out what it names. `--sampling` compares ways of sampling scattering points
//! instead (Li et al. 2024, section 4.2), on scenes with media. Writes `target/bench-lights.json`, and `.html` beside it with the same tables and plots.

mod bars;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod error;
mod lamp;
mod many;
#[path = "../common/mesh.rs"]
#[allow(dead_code, reason = "its scenes belong to another benchmark")]
mod mesh;
mod page;
mod plots;
mod reference;
mod run;
mod settings;
mod summary;
mod variants;

use std::path::{Path, PathBuf};

use lanternfish::bench::bar::{self, Bar};
use lanternfish::bench::machine::machine;
use lanternfish::bench::table::Table;
use serde::Serialize;
use settings::Settings;

#[derive(Serialize)]
struct Report {
    about: Vec<String>,
    scenes: Vec<compare::SceneResult>,
    many: Option<many::ManyResult>,
    lamp: Option<lamp::LampResult>,
    bars: Vec<Bar>,
    tables: Vec<Table>,
}

fn main() {
    let settings = Settings::from_command_line();
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("target");
    let folder = target.join("bench-lights");
    std::fs::create_dir_all(folder.join("references")).unwrap_or_else(|error| run::fail(&error.to_string()));
    let about = about(&settings);
    about.iter().for_each(|line| println!("{line}"));

    let (mut tables, mut pictures, mut scenes) = (vec![], vec![], vec![]);
    let mut show = |table: Table| {
        table.print();
        tables.push(table);
    };
    for (name, lights) in settings.scenes.iter().filter(|(name, _)| name != "lamp") {
        let result = compare::measure(&folder, name, *lights, &settings);
        summary::tables(&result, &settings).into_iter().for_each(&mut show);
        pictures.extend(plots::of(&result));
        scenes.push(result);
    }
    let lamp = settings.scenes.iter().any(|(name, _)| name == "lamp").then(|| lamp::measure(&folder, &settings));
    lamp.iter().map(lamp::table).for_each(&mut show);
    let many = settings.many.map(|counts| many::measure(&folder, counts, &settings));
    many.iter().map(many::table).for_each(&mut show);
    let bars = bars::bars(&scenes, many.as_ref(), lamp.as_ref());
    show(bar::table(&bars));

    page::write(&target.join("bench-lights.html"), &about, &tables, &pictures);
    common::write_json("bench-lights", &Report { about, scenes, many, lamp, bars, tables });
}

/// Command, seeds, scenes, machine, version.
fn about(settings: &Settings) -> Vec<String> {
    let scenes: Vec<String> = settings.scenes.iter().map(|(name, lights)| format!("{name} {lights}")).collect();
    let seeds: Vec<String> = settings.seeds().map(|seed| seed.to_string()).collect();
    vec![
        common::command(),
        format!("scenes and lights: {}; files: target/bench-lights/NAME-LIGHTS/NAME.pbrt", scenes.join(", ")),
        format!("{} at {} samples a pixel, seeds {}", settings.size, settings.spp, seeds.join(", ")),
        format!("machine: {}", machine()),
        format!("lanternfish {}{}", env!("CARGO_PKG_VERSION"), commit().map_or(String::new(), |c| format!(", {c}"))),
    ]
}

/// The commit, where git knows it; "-dirty" where files were changed since.
fn commit() -> Option<String> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let output =
        std::process::Command::new("git").arg("-C").arg(folder).args(["describe", "--always", "--dirty"]).output();
    let text = String::from_utf8(output.ok().filter(|output| output.status.success())?.stdout).ok()?;
    Some(format!("commit {}", text.trim()))
}
