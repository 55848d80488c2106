//! One light and nothing to choose: what the machinery for many costs where it is not wanted.

use std::path::Path;

use lanternfish::bench::ratio::Ratio;
use lanternfish::bench::table::Table;
use serde::Serialize;

use super::run::{Cost, Task, render, write_scene};
use super::settings::Settings;

#[derive(Serialize)]
pub struct LampResult {
    pub auto: Vec<Cost>,
    pub uniform: Vec<Cost>,
    /// `auto` over `uniform`.
    pub wall: Ratio,
    pub cpu: Ratio,
    /// Whether `auto` built cache points, which it should not.
    pub has_cache: bool,
}

pub fn measure(folder: &Path, settings: &Settings) -> LampResult {
    let scene = write_scene(&folder.join("lamp-1"), "lamp", 1);
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let (size, spp, output) = (settings.size.as_str(), settings.spp, scratch.path().join("render.exr"));
    let mut costs = [vec![], vec![]];
    for repetition in 0..settings.repetitions {
        // Whoever goes first in one repetition goes last in the next.
        for turn in 0..2 {
            let index = (turn + repetition as usize) % 2;
            let arguments = [&["--lights", "auto"], &["--lights", "uniform"]][index];
            let seed = settings.first_seed + repetition;
            costs[index].push(render(&Task { scene: &scene, arguments, size, spp, seed, output: &output }));
        }
    }
    let [auto, uniform] = costs;
    let ratio = |of: fn(&Cost) -> f64| Ratio::of(auto.iter().zip(&uniform).map(|(a, u)| of(a) / of(u)));
    let (wall, cpu) = (ratio(|cost| cost.wall_seconds), ratio(|cost| cost.cpu_seconds));
    let has_cache = auto.iter().any(|cost| cost.has_cache);
    LampResult { auto, uniform, wall, cpu, has_cache }
}

pub fn table(result: &LampResult) -> Table {
    let mut table = Table::new("lamp, 1 light: auto over uniform", &["", "ratio"]);
    table.notes.push(format!("{} pairs, taking turns at going first", result.auto.len()));
    let built = if result.has_cache { "built" } else { "not built" };
    for (name, value) in [
        ("wall time", result.wall.show()),
        ("CPU time", result.cpu.show()),
        ("cache points with auto", built.to_owned()),
    ] {
        table.rows.push(vec![name.to_owned(), value]);
    }
    table
}
