//! The statistics of a render, as `--stats` writes them.

use serde::Serialize;

use super::plan::Plan;
use super::timing::Timings;
use crate::integrator::Counters;

/// Everything that a render reports about itself.
#[derive(Clone, Debug, Serialize)]
pub struct Statistics {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// The scene file.
    pub scene: String,
    /// The seed.
    pub seed: u32,
    /// Threads used.
    pub threads: usize,
    /// `embree` or `native`, and the library's version.
    pub backend: String,
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// Samples per pixel reached.
    pub samples_per_pixel: u32,
    /// Estimated relative error of the image (see [`crate::film::Film::error_estimate`]).
    pub error: Option<f64>,
    /// Samples dropped because they were NaN or infinite.
    pub non_finite_samples: u64,
    /// The first of them.
    pub first_non_finite_sample: Option<crate::film::RejectedSample>,
    /// Wall-clock seconds.
    pub seconds: Timings,
    /// Processor seconds of the whole process.
    pub cpu_seconds: f64,
    /// Largest resident memory of the process in bytes.
    pub peak_memory: u64,
    /// Rays, steps and vertices.
    pub counters: Counters,
    /// What was built, and why.
    pub plan: Plan,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
}

/// The process's processor seconds and largest resident memory so far, from `/proc`; zeros where that is missing.
pub fn process_usage() -> (f64, u64) {
    // Fields 14 and 15 of /proc/self/stat are user and system time in clock ticks, 100 a second on Linux.
    let seconds = std::fs::read_to_string("/proc/self/stat")
        .ok()
        .and_then(|stat| {
            let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
            Some((fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?) / 100.0)
        })
        .unwrap_or(0.0);
    let peak = std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|status| {
            let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
            line.split_whitespace().nth(1)?.parse::<u64>().ok()
        })
        .unwrap_or(0)
        * 1024;
    (seconds, peak)
}
