//! How many density look-ups a second one core does while it tracks through a fire: the integrator's own free flights (delta tracking)
//! through its density alone (`flight`) and with its glow gathered on the way (`glow`, where a file has a temperature), and
//! transmittances (ratio tracking), along random chords of the grid's box. Then the same rays against the plainest tracker there is
//! (`reference.rs`); what empty space costs (`empty.rs`); and how often paths ask cache points (`lookups.rs`).
//!
//!     cargo bench --bench volumes -- [--file FIRE.vdb] [--rays N] [--repetitions N] [--seed N] [--only KIND/DEPTH|reference|empty|lookups]
//!
//! Without a file, the largest fire of the project's shared data, or a fire made on the spot (a dense grid of 128³) where
//! there is none. A tentative collision is one look-up of the density,
//! a point that gathers glow one of density and of temperature. Rates are per processor second; intervals are 95 %
//! confidence intervals over the repetitions. `depth` is the optical depth of the densest voxels across the box.

mod against;
#[path = "../common/mod.rs"]
mod common;
mod empty;
mod lookups;
mod reference;
mod scene;
mod track;

use lanternfish::bench::estimate::Estimate;
use std::path::{Path, PathBuf};

use common::{argument, text_argument, time};
use serde::Serialize;
use track::{Track, flight, run, through};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Optical depths of the densest voxels across the box.
const DEPTHS: [f32; 3] = [10.0, 100.0, 1000.0];

const SHARED_FIRE: &str = "../shared/data/vdb/blender/fire128_blosc_f16_0035.vdb";

#[derive(Serialize)]
struct Report {
    command: String,
    seed: u64,
    source: String,
    rays: u64,
    repetitions: u64,
    results: Vec<Measured>,
    against_reference: Vec<against::AgainstReference>,
    empty_space: Vec<empty::EmptyResult>,
    cache_lookups: Vec<lookups::LookupResult>,
}

#[derive(Serialize)]
struct Measured {
    kind: &'static str,
    depth: f32,
    lookups: u64,
    lookups_per_ray: f64,
    /// Million look-ups a second on one core.
    rate: Estimate,
}

fn main() {
    let (seed, count) = (argument("seed", 1), argument("rays", 20_000));
    let repetitions = argument("repetitions", 7).max(1);
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHARED_FIRE);
    let file = text_argument("file").map(PathBuf::from).or_else(|| shared.is_file().then_some(shared));
    let file = file.filter(|_| cfg!(feature = "openvdb"));
    let file = file.as_deref();
    let source = file.map_or("a fire made on the spot".to_owned(), |path| path.display().to_string());
    println!("{}\nseed {seed}, {count} rays\n{source}", common::command());

    let unit = scene::fire(file, 1.0, false);
    let (low, high) = unit.media[0].bounds().expect("a fire ends somewhere");
    println!("{}", unit.media[0].summary());
    let rays = scene::chords(low, high, count, seed);
    let densest = scene::densest(&unit.media[0], &rays);
    let scale_of = |depth: f32| depth / (densest * (high - low).max_element());

    let only = text_argument("only");
    let is_wanted = |part: &str| only.as_ref().is_none_or(|only| only == part);
    let mut results = vec![];
    for depth in DEPTHS {
        let kinds = [("flight", flight as Track, false), ("glow", flight, true), ("transmittance", through, false)];
        for (kind, track, glows) in kinds {
            if !is_wanted(&format!("{kind}/{depth}")) || (glows && file.is_none()) {
                continue;
            }
            let world = scene::fire(file, scale_of(depth), glows);
            let mut lookups = 0;
            let rates: Vec<f64> = (0..repetitions)
                .map(|_| {
                    let (tracked, cpu, _) = time(|| run(&world, &rays, seed, track));
                    lookups = tracked.steps;
                    tracked.steps as f64 * 1e-6 / cpu
                })
                .collect();
            let rate = Estimate::of(&rates);
            let lookups_per_ray = lookups as f64 / count as f64;
            println!(
                "{kind:>13}, depth {depth:6}: {} million look-ups a second a core ({lookups_per_ray:.1} a ray)",
                rate.show(2)
            );
            results.push(Measured { kind, depth, lookups, lookups_per_ray, rate });
        }
    }

    let mut against_reference = vec![];
    if is_wanted("reference")
        && let Some(dense) = reference::Dense::fire(file)
    {
        for depth in DEPTHS {
            let world = scene::fire(file, scale_of(depth), false);
            // σ_a and σ_s are 1 where a scene does not say otherwise.
            let extinction = 2.0 * scale_of(depth);
            for (kind, track) in [("flight", flight as Track), ("transmittance", through)] {
                let turns = (seed, repetitions);
                against_reference.push(against::measure(
                    (kind, depth),
                    (&world, track),
                    (&dense, extinction),
                    &rays,
                    turns,
                ));
            }
        }
    }
    let empty_space = if is_wanted("empty") { empty::measure(count, seed, repetitions) } else { vec![] };
    let cache_lookups = if is_wanted("lookups") { lookups::measure(seed) } else { vec![] };
    let command = common::command();
    let report = Report {
        command,
        seed,
        source,
        rays: count,
        repetitions,
        results,
        against_reference,
        empty_space,
        cache_lookups,
    };
    common::write_json("bench-volumes", &report);
}
