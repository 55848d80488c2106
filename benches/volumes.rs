//! How many density look-ups a second one core does while it tracks through a fire: the integrator's own free flights (delta tracking)
//! through its density alone (`flight`) and with its glow gathered on the way (`glow`, where a file has a temperature), and
//! transmittances (ratio tracking), along random chords of the grid's box.
//!
//!     cargo bench --bench volumes -- [--file FIRE.vdb] [--rays N] [--repetitions N] [--seed N] [--only KIND/DEPTH]
//!
//! Without a file, the largest fire of the project's shared data, or a fire made on the spot (a dense grid of 128³) where
//! there is none. A tentative collision is one look-up of the density, a point that gathers glow one of density and temperature. Rates are per processor second; intervals are 95 %
//! confidence intervals over the repetitions. `depth` is the optical depth of the densest voxels across the box.

mod common;

use std::path::{Path, PathBuf};

use common::{Estimate, argument, text_argument, time};
use glam::Vec3;
use lanternfish::geometry::Ray;
use lanternfish::integrator::flight::{PathState, PathWeight, sample_flight, transmittance};
use lanternfish::integrator::{Scratch, World};
use lanternfish::math::sampler::Stream;
use lanternfish::render::{Job, RenderSettings, Timings};
use lanternfish::scene::{Sources, Warnings};
use serde::Serialize;

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
    let source = file.as_ref().map_or("a fire made on the spot".to_owned(), |path| path.display().to_string());
    println!("{}\nseed {seed}, {count} rays\n{source}", common::command());

    let unit = build(file.as_deref(), 1.0, false);
    let (low, high) = unit.media[0].bounds().expect("a fire ends somewhere");
    println!("{}", unit.media[0].summary());
    let rays = chords(low, high, count, seed);
    let densest = rays.iter().flat_map(|ray| unit.media[0].majorants(ray.origin, ray.direction, 0.0, ray.t_max));
    let densest = densest.map(|segment| segment.majorant).fold(0.0, f32::max);

    let only = text_argument("only");
    let mut results = vec![];
    for depth in DEPTHS {
        let scale = depth / (densest * (high - low).max_element());
        let kinds = [("flight", flight as Track, false), ("glow", flight, true), ("transmittance", through, false)];
        for (kind, track, glows) in kinds {
            let is_wanted = only.as_ref().is_none_or(|only| *only == format!("{kind}/{depth}"));
            if !is_wanted || (glows && file.is_none()) {
                continue;
            }
            let world = build(file.as_deref(), scale, glows);
            let mut lookups = 0;
            let rates: Vec<f64> = (0..repetitions)
                .map(|_| {
                    let (steps, cpu, _) = time(|| run(&world, &rays, seed, track));
                    lookups = steps;
                    steps as f64 * 1e-6 / cpu
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
    let report = Report { command: common::command(), seed, source, rays: count, repetitions, results };
    common::write_json("bench-volumes", &report);
}

/// A world of nothing but the fire, which fills it from the camera on.
fn build(file: Option<&Path>, scale: f32, glows: bool) -> World {
    let glow = if glows { r#""string temperature" "temperature" "float temperaturescale" 1000"# } else { "" };
    let medium = match file {
        Some(path) => format!(
            r#"MakeNamedMedium "fire" "string type" "openvdb" "string filename" "{}" "string density" "density"
               {glow} "float scale" {scale}"#,
            std::path::absolute(path).expect("a path").display()
        ),
        None => made_up(scale),
    };
    let text =
        format!("{medium}\nMediumInterface \"\" \"fire\"\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let (scene, _) = lanternfish::render::load(&path, &mut sources, &mut warnings).expect("the scene is valid");
    let settings = RenderSettings::default();
    Job::prepare(&scene, &settings, Timings::default(), &mut warnings).expect("the scene builds").world
}

/// Tongues of fire in a box of 128³ voxels.
fn made_up(scale: f32) -> String {
    const N: usize = 128;
    let mut density = String::new();
    for i in 0..N * N * N {
        let [x, y, z] = [i % N, i / N % N, i / (N * N)].map(|k| k as f32 / N as f32 - 0.5);
        let sway = 0.12 * (14.0 * z).sin() + 0.05 * (41.0 * z + 9.0 * x).sin();
        let radius = ((x - sway).powi(2) + (y + 0.7 * sway).powi(2)).sqrt() / (0.28 - 0.2 * z);
        let value = (1.0 - radius).max(0.0) * (0.6 + 0.4 * (60.0 * x).sin() * (50.0 * y).cos() * (33.0 * z).sin());
        use std::fmt::Write as _;
        write!(density, "{value:.3} ").expect("strings grow");
    }
    format!(
        r#"MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" {N} "integer ny" {N} "integer nz" {N}
           "float density" [ {density} ] "float scale" {scale}"#
    )
}

/// Chords between random points of the box.
fn chords(low: Vec3, high: Vec3, count: u64, seed: u64) -> Vec<Ray> {
    let mut stream = Stream::from_seed(seed);
    let mut point = || {
        let mut u = || stream.next_f32();
        let mut p = Vec3::new(u(), u(), u());
        // On one of the six faces.
        let face = (u() * 6.0) as usize;
        p[face % 3] = (face / 3) as f32;
        low + (high - low) * p
    };
    let mut ends = std::iter::repeat_with(|| (point(), point())).filter(|(a, b)| a.distance(*b) > 0.0);
    let ray = |(a, b): (Vec3, Vec3)| {
        let t_max = a.distance(b);
        Ray { origin: a, direction: (b - a) / t_max, t_max, time: 0.0, opacity_seed: 0 }
    };
    (0..count).map(|_| ray(ends.next().expect("endless"))).collect()
}

type Track = fn(&World, &Ray, &mut Stream, &mut Scratch);

fn flight(world: &World, ray: &Ray, stream: &mut Stream, scratch: &mut Scratch) {
    let mut path = PathState { weight: PathWeight::START, regions: world.camera_regions.clone(), hero: 0, links: None };
    let vertex = sample_flight(world, ray, &mut path, true, stream, scratch, |weight, _, emission, _| {
        std::hint::black_box(weight.alone() * emission);
    });
    std::hint::black_box(vertex.is_some());
}

fn through(world: &World, ray: &Ray, stream: &mut Stream, scratch: &mut Scratch) {
    std::hint::black_box(transmittance(world, ray, &world.camera_regions, stream, scratch));
}

/// Tracks along every ray; the number of look-ups.
fn run(world: &World, rays: &[Ray], seed: u64, track: Track) -> u64 {
    let mut scratch = Scratch::default();
    let mut stream = Stream::from_seed(seed);
    for ray in rays {
        track(world, ray, &mut stream, &mut scratch);
    }
    let counters = scratch.counters;
    counters.flight_steps + counters.transmittance_steps + counters.emission_points
}
