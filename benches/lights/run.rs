//! One render: a process of its own, and what it says of itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde::Serialize;
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lanternfish");

/// What a render shall do.
pub struct Task<'a> {
    pub scene: &'a Path,
    pub arguments: &'a [&'a str],
    pub size: &'a str,
    pub spp: u32,
    pub seed: u64,
    /// Where the image goes; the statistics go beside it.
    pub output: &'a Path,
}

/// What a render took.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// Processor seconds of the whole process, and of rendering alone.
    pub cpu_seconds: f64,
    pub rendering_seconds: f64,
    /// From starting the process to its end.
    pub wall_seconds: f64,
    /// By the clock: setting up lights and building what selects them.
    pub build_seconds: f64,
    /// Bytes.
    pub peak_memory: f64,
    /// Share of shadow rays that were blocked in each iteration.
    pub blocked: Vec<f64>,
    /// Whether cache points were built.
    pub has_cache: bool,
}

/// The file to render, after the library's gallery has written it to `folder`.
pub fn write_scene(folder: &Path, name: &str, lights: u64) -> PathBuf {
    let scene = lanternfish::gallery::find(name).expect("the names are the gallery's");
    scene.write(folder, Some(lights as u32)).unwrap_or_else(|error| fail(&error.to_string()))
}

pub fn render(task: &Task) -> Cost {
    let stats = task.output.with_extension("json");
    let start = Instant::now();
    let output = Command::new(PROGRAM)
        .arg("render")
        .arg(task.scene)
        .args([
            "-q",
            "--strict",
            "--resolution",
            task.size,
            "--spp",
            &task.spp.to_string(),
            "--seed",
            &task.seed.to_string(),
        ])
        .args(task.arguments)
        .arg("-o")
        .arg(task.output)
        .arg("--stats")
        .arg(&stats)
        .output()
        .unwrap_or_else(|error| fail(&format!("{PROGRAM}: {error}")));
    let wall_seconds = start.elapsed().as_secs_f64();
    if !output.status.success() {
        let reason = String::from_utf8_lossy(&output.stderr);
        fail(&format!("{} of {}: {reason}", task.arguments.join(" "), task.scene.display()));
    }
    let text = std::fs::read_to_string(&stats).unwrap_or_else(|error| fail(&format!("{}: {error}", stats.display())));
    let stats: Value = serde_json::from_str(&text).expect("the program writes JSON");
    let number = |value: &Value| value.as_f64().expect("the statistics have it");
    let seconds = &stats["seconds"];
    Cost {
        cpu_seconds: number(&stats["cpu_seconds"]),
        rendering_seconds: number(&stats["cpu_seconds_rendering"]),
        wall_seconds,
        build_seconds: number(&seconds["lights"]) + number(&seconds["cache_points"]),
        peak_memory: number(&stats["peak_memory"]),
        blocked: stats["iterations"].as_array().into_iter().flatten().map(|i| number(&i["blocked"])).collect(),
        has_cache: !stats["cache_points"].is_null(),
    }
}

impl Cost {
    /// What `factor` times as many samples would take.
    pub fn scaled(mut self, factor: f64) -> Self {
        let more = (factor - 1.0) * self.rendering_seconds;
        self.wall_seconds *= 1.0 + more / self.cpu_seconds;
        self.cpu_seconds += more;
        self.rendering_seconds += more;
        self
    }
}

/// Ends the benchmark with a message.
pub fn fail(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(1);
}
