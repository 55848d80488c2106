//! The statistics of a render, as `--stats` writes them.

use serde::Serialize;

use super::plan::Plan;
use super::timing::Timings;
use crate::cache_points::CacheStatistics;
use crate::integrator::Counters;
use crate::material::mip_map::cache::TileCacheStatistics;

/// Everything that a render reports about itself.
#[derive(Clone, Debug, Serialize)]
pub struct Statistics {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// The scene file.
    pub scene: String,
    /// The frame's number, where it is one of a sequence.
    pub frame: Option<i32>,
    /// Which part of how many of the frame's samples was taken.
    pub part: Option<String>,
    /// The seed.
    pub seed: u32,
    /// Threads used.
    pub threads: usize,
    /// `embree` or `native`, and the library's version.
    pub backend: String,
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// The number of the first sample of each pixel.
    pub first_sample: u32,
    /// Samples per pixel reached.
    pub samples_per_pixel: u32,
    /// Estimated relative error of the image (see [`crate::film::Film::error_estimate`]).
    pub error: Option<f64>,
    /// Samples dropped because they were NaN or infinite.
    pub non_finite_samples: u64,
    /// The first of them.
    pub first_non_finite_sample: Option<crate::film::RejectedSample>,
    /// The command that replays it.
    pub replay: Option<String>,
    /// Wall-clock seconds.
    pub seconds: Timings,
    /// Processor seconds of the whole process.
    pub cpu_seconds: f64,
    /// Those of them that went into tracing and learning: neither into getting ready nor into writing images.
    pub cpu_seconds_rendering: f64,
    /// Largest resident memory of the process in bytes.
    pub peak_memory: u64,
    /// What the cache of texture tiles did, where images do not fit into memory.
    pub texture_cache: Option<TileCacheStatistics>,
    /// Rays, steps and vertices.
    pub counters: Counters,
    /// What was done in each iteration over the image.
    pub iterations: Vec<Iteration>,
    /// How cache points were built, where they were.
    pub cache_points: Option<CacheStatistics>,
    /// What was built, and why.
    pub plan: Plan,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// One iteration over the image.
#[derive(Clone, Copy, Debug, Serialize, serde::Deserialize)]
pub struct Iteration {
    /// Samples a pixel.
    pub samples: u32,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// The share of them that was blocked: it falls as visibility is learned.
    pub blocked: f64,
    /// The share of the image's regions where in-scatter sampling draws points, and how many of them for a path there.
    pub in_scatter_regions: f64,
    /// See there.
    pub in_scatter_points: f64,
    /// The mean number of rays that a sample sends out besides its path to find what shines straight into the camera.
    pub view_rays: f64,
    /// Wall-clock seconds that taking over what it taught took.
    pub learning: f64,
    /// And processor seconds.
    pub learning_cpu: f64,
}

impl Iteration {
    /// What `counters` of an iteration of `samples` a pixel come to.
    pub fn new(samples: u32, counters: &Counters) -> Self {
        let shadow_rays = counters.shadow_rays;
        let blocked = counters.shadow_rays_blocked as f64 / shadow_rays.max(1) as f64;
        Self {
            samples,
            shadow_rays,
            blocked,
            in_scatter_regions: 0.0,
            in_scatter_points: 0.0,
            view_rays: 0.0,
            learning: 0.0,
            learning_cpu: 0.0,
        }
    }
}
