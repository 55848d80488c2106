//! How much of a render's time goes into the ray backend itself. In one run, for each scene and backend: record the rays that
//! the renderer traces, then take turns rendering and tracing just those rays again, in the same order.
//!
//!     cargo bench --bench rays -- [--scene cavern|hills] [--backend embree|native] [--triangles N] [--size N] [--spp N]
//!                                 [--repetitions N] [--seed N] [--only render|rays]
//!
//! Times are processor seconds of all threads; intervals are 95 % confidence intervals over the repetitions. The share is the
//! mean of the repetitions' own ratios. `--only` repeats one of the two for a profiler.

mod common;
#[path = "common/mesh.rs"]
mod mesh;

use lanternfish::bench::estimate::Estimate;
use std::sync::atomic::AtomicBool;

use common::{argument, text_argument, time};
use lanternfish::geometry::recording::{Query, RecordingTracer};
use lanternfish::geometry::{Backend, Ray, Tracer};
use lanternfish::render::{Budget, Job, Outcome, RenderSettings, Silent, Timings};
use lanternfish::scene::{SceneDescription, Sources, Warnings};
use rayon::prelude::*;
use serde::Serialize;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

#[derive(Serialize)]
struct Report {
    command: String,
    seed: u32,
    triangles: u64,
    spp: u32,
    repetitions: u64,
    results: Vec<Measured>,
}

#[derive(Serialize)]
struct Measured {
    scene: String,
    backend: String,
    threads: usize,
    paths: u64,
    closest_rays: usize,
    shadow_rays: usize,
    /// Million rays a processor second.
    closest_rate: Estimate,
    occlusion_rate: Estimate,
    replay_rate: Estimate,
    render_rate: Estimate,
    /// Million rays a second by the clock on the wall.
    replay_wall_rate: Estimate,
    render_wall_rate: Estimate,
    /// Time of the replayed rays over the time of the render.
    share: Estimate,
}

/// How often to do what.
struct Settings {
    seed: u32,
    spp: u32,
    repetitions: u64,
}

fn main() {
    let settings = Settings {
        seed: argument("seed", 1) as u32,
        spp: argument("spp", 4) as u32,
        repetitions: argument("repetitions", 7).max(1),
    };
    let (triangles, size) = (argument("triangles", 1_000_000), argument("size", 160));
    let scenes = text_argument("scene").map_or(mesh::SCENES.map(str::to_owned).to_vec(), |name| vec![name]);
    let backends = match text_argument("backend").as_deref() {
        Some("embree") => vec![Backend::Embree],
        Some("native") => vec![Backend::Native],
        Some(other) => {
            eprintln!("--backend {other}: embree or native");
            std::process::exit(2);
        }
        None if Backend::DEFAULT == Backend::Embree => vec![Backend::Embree, Backend::Native],
        None => vec![Backend::Native],
    };
    println!("{}\nseed {}, {triangles} triangles, {} samples a pixel", common::command(), settings.seed, settings.spp);

    let mut results = vec![];
    for name in &scenes {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = mesh::write_scene(folder.path(), name, triangles, size).expect("the scene can be written");
        let (scene, _) = lanternfish::render::load(&path, &mut Sources::default(), &mut Warnings::default())
            .expect("the scene is valid");
        for &backend in &backends {
            if let Some(what) = text_argument("only") {
                repeat_one(&scene, backend, &settings, &what);
                continue;
            }
            let all = std::thread::available_parallelism().map_or(1, usize::from);
            for threads in if all > 1 { vec![1, all] } else { vec![1] } {
                let measured = measure(name, &scene, backend, threads, &settings);
                measured.print();
                results.push(measured);
            }
        }
    }
    let Settings { seed, spp, repetitions } = settings;
    let report = Report { command: common::command(), seed, triangles, spp, repetitions, results };
    if !report.results.is_empty() {
        common::write_json("bench-rays", &report);
    }
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn prepare(scene: &SceneDescription, backend: Backend) -> Job {
    let settings = RenderSettings { backend: Some(backend), ..RenderSettings::default() };
    Job::prepare(scene, &settings, Timings::default(), &mut Warnings::default()).expect("the scene builds")
}

fn render(job: &mut Job, settings: &Settings) -> Outcome {
    job.render(settings.seed, Budget::Samples(settings.spp), &AtomicBool::new(false), &Silent)
}

/// The rays of the render, in the order of one thread.
fn record(mut job: Job, settings: &Settings) -> (Job, Outcome, Vec<(Query, Ray)>) {
    let tracer = job.world.tracer;
    job.world.tracer = Tracer::Recording(Box::new(RecordingTracer::new(tracer)));
    let outcome = pool(1).install(|| render(&mut job, settings));
    let Tracer::Recording(recorder) = job.world.tracer else { unreachable!("it was put there") };
    let (tracer, queries) = recorder.finish();
    job.world.tracer = tracer;
    (job, outcome, queries)
}

/// Asks everything again; the number of hits.
fn replay(tracer: &Tracer, queries: &[(Query, Ray)]) -> usize {
    let one = |(query, ray): &(Query, Ray)| match query {
        Query::Closest => usize::from(tracer.closest(ray).is_some()),
        Query::Occlusion => usize::from(tracer.occluded(ray)),
    };
    queries.par_chunks(4096).map(|chunk| chunk.iter().map(one).sum::<usize>()).sum()
}

fn measure(name: &str, scene: &SceneDescription, backend: Backend, threads: usize, settings: &Settings) -> Measured {
    let pool = pool(threads);
    let job = pool.install(|| prepare(scene, backend));
    let (mut job, recorded, queries) = record(job, settings);
    let of = |kind| queries.iter().copied().filter(|(query, _)| *query == kind).collect::<Vec<_>>();
    let (closest, shadow) = (of(Query::Closest), of(Query::Occlusion));
    assert_eq!(recorded.counters.closest_rays as usize, closest.len(), "every ray was recorded");
    assert_eq!(recorded.counters.shadow_rays as usize, shadow.len(), "every shadow ray was recorded");

    let million = |count: usize, seconds: f64| count as f64 * 1e-6 / seconds;
    let mut rates = [(); 7].map(|()| Vec::<f64>::new());
    for repetition in 0..settings.repetitions {
        let mut times = [(0.0, 0.0); 4];
        // Whoever goes first in one repetition goes last in the next.
        let order = if repetition % 2 == 0 { [0, 1, 2, 3] } else { [3, 2, 1, 0] };
        for what in order {
            let ((), cpu, wall) = pool.install(|| {
                time(|| match what {
                    0 => {
                        let counters = render(&mut job, settings).counters;
                        assert_eq!(counters, recorded.counters, "the render traces the very rays recorded");
                    }
                    1 => _ = std::hint::black_box(replay(&job.world.tracer, &queries)),
                    2 => _ = std::hint::black_box(replay(&job.world.tracer, &closest)),
                    _ => {
                        let blocked = replay(&job.world.tracer, &shadow) as u64;
                        assert_eq!(blocked, recorded.counters.shadow_rays_blocked, "the same rays are blocked");
                    }
                })
            });
            times[what] = (cpu, wall);
        }
        let [rendering, rays, near, dark] = times;
        let values = [
            million(closest.len(), near.0),
            million(shadow.len(), dark.0),
            million(queries.len(), rays.0),
            million(queries.len(), rendering.0),
            million(queries.len(), rays.1),
            million(queries.len(), rendering.1),
            rays.0 / rendering.0,
        ];
        rates.iter_mut().zip(values).for_each(|(list, value)| list.push(value));
    }
    let [closest_rate, occlusion_rate, replay_rate, render_rate, replay_wall_rate, render_wall_rate, share] =
        rates.map(|values| Estimate::of(&values));
    Measured {
        scene: name.to_owned(),
        backend: job.world.tracer.name(),
        threads,
        paths: recorded.counters.paths,
        closest_rays: closest.len(),
        shadow_rays: shadow.len(),
        closest_rate,
        occlusion_rate,
        replay_rate,
        render_rate,
        replay_wall_rate,
        render_wall_rate,
        share,
    }
}

/// For a profiler: one of the two, again and again, on one thread.
fn repeat_one(scene: &SceneDescription, backend: Backend, settings: &Settings, what: &str) {
    pool(1).install(|| {
        let mut job = prepare(scene, backend);
        if what == "render" {
            (0..settings.repetitions).for_each(|_| drop(render(&mut job, settings)));
            return;
        }
        let (job, _, queries) = record(job, settings);
        for _ in 0..settings.repetitions {
            std::hint::black_box(replay(&job.world.tracer, &queries));
        }
    });
}

impl Measured {
    fn print(&self) {
        println!("\n{} · {} · {} thread(s)", self.scene, self.backend, self.threads);
        println!("  {} paths, {} closest-hit rays, {} shadow rays", self.paths, self.closest_rays, self.shadow_rays);
        println!(
            "  (a) backend alone, million rays a CPU second: closest {}, occlusion {}, both in order {}",
            self.closest_rate.show(3),
            self.occlusion_rate.show(3),
            self.replay_rate.show(3)
        );
        println!("  (b) renderer, million rays a CPU second: {}", self.render_rate.show(3));
        println!(
            "      by the clock: backend {}, renderer {}",
            self.replay_wall_rate.show(3),
            self.render_wall_rate.show(3)
        );
        println!("  share of the render's CPU time that these rays take: {} %", {
            let percent = Estimate { mean: 100.0 * self.share.mean, half_width: 100.0 * self.share.half_width };
            percent.show(1)
        });
    }
}
