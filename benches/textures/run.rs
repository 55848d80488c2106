//! One render of the gallery: a process of its own, and what it says of itself.

use std::path::Path;
use std::process::Command;

use serde::Serialize;
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_lanternfish");

/// What a render took.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// By the clock: all of it, and tracing alone.
    pub seconds: f64,
    pub rendering_seconds: f64,
    /// Processor seconds of the whole process.
    pub cpu_seconds: f64,
    /// The most that the process had in memory, in bytes.
    pub peak_memory: u64,
    /// What the cache of tiles did, unless all images fitted into memory.
    pub cache: Option<Cache>,
}

/// What the cache of tiles did.
#[derive(Clone, Copy, Debug, Serialize, serde::Deserialize)]
pub struct Cache {
    /// Bytes of tiles, at most.
    pub held: u64,
    pub lookups: u64,
    pub reads: u64,
    pub hit_rate: f64,
}

/// Renders `scene` to `output`.
pub fn render(scene: &Path, output: &Path, arguments: &[&str]) -> Cost {
    let statistics = output.with_extension("json");
    let run = Command::new(PROGRAM)
        .arg("render")
        .arg(scene)
        .args(["-q", "--strict", "--checkpoint", "off"])
        .args(arguments)
        .arg("-o")
        .arg(output)
        .arg("--stats")
        .arg(&statistics)
        .output()
        .unwrap_or_else(|error| fail(&format!("{PROGRAM}: {error}")));
    if !run.status.success() {
        fail(&format!("{}: {}", arguments.join(" "), String::from_utf8_lossy(&run.stderr)));
    }
    let text = std::fs::read_to_string(&statistics);
    let text = text.unwrap_or_else(|error| fail(&format!("{}: {error}", statistics.display())));
    let values: Value = serde_json::from_str(&text).expect("the program writes JSON");
    let number = |value: &Value| value.as_f64().expect("the statistics have it");
    let steps = values["seconds"].as_object().expect("the statistics have it");
    // Rendering holds the time to the first tile.
    let seconds = steps.iter().filter(|(name, _)| *name != "first_sample").map(|(_, step)| number(step)).sum();
    Cost {
        seconds,
        rendering_seconds: number(&values["seconds"]["render"]),
        cpu_seconds: number(&values["cpu_seconds"]),
        peak_memory: values["peak_memory"].as_u64().expect("the statistics have it"),
        cache: serde_json::from_value(values["texture_cache"].clone()).expect("the statistics have it"),
    }
}

/// Ends the benchmark with a message.
pub fn fail(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(1);
}
