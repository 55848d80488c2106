//! One render: a process of its own, and what it says of itself.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;

use super::method::Method;
use super::{BenchError, machine};

/// How often it is looked whether a render has ended: what wall-clock times are certain to.
const LOOK: Duration = Duration::from_millis(2);

/// What a render shall do.
pub struct Task<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// How.
    pub method: &'a Method,
    /// Width and height in place of the scene's.
    pub resolution: Option<[u32; 2]>,
    /// Threads.
    pub threads: Option<u32>,
    /// Samples a pixel.
    pub spp: u32,
    /// Seed.
    pub seed: u32,
    /// Where the image goes; the statistics and what it says go beside it.
    pub output: &'a Path,
}

/// What a render took. Seconds are those of the clock unless said.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// From starting the process to its end.
    pub wall_seconds: f64,
    /// Processor seconds of the whole process.
    pub cpu_seconds: f64,
    /// The same to its very end, with the programs that it started: the reader of .vdb files.
    pub cpu_seconds_with_helpers: f64,
    /// Processor seconds of rendering alone.
    pub cpu_seconds_rendering: f64,
    /// The part of them in which what passes taught was taken over: between passes, and most of it after the first few.
    pub cpu_seconds_learning: f64,
    /// Reading the scene, its volumes, textures and shapes.
    pub load_seconds: f64,
    /// Building acceleration structures, lights and what selects them.
    pub build_seconds: f64,
    /// Rendering, learning included.
    pub render_seconds: f64,
    /// The part of that in which what passes taught was taken over.
    pub learning_seconds: f64,
    /// Largest resident memory in bytes.
    pub peak_memory: f64,
}

/// What a render says of itself.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// What it took.
    pub cost: Cost,
    /// What traced its rays, with its version.
    pub backend: String,
}

/// Why a render gave nothing.
#[derive(Debug, thiserror::Error)]
#[error("this render {how}:\n{command}\n{reason}")]
pub struct RunError {
    /// What it did instead.
    pub how: String,
    /// The command.
    pub command: String,
    /// What it said.
    pub reason: String,
    /// Its exit code, if it ended by itself.
    pub code: Option<i32>,
}

impl Task<'_> {
    /// What makes the image, without where it goes.
    fn arguments(&self) -> Vec<String> {
        let mut arguments: Vec<String> =
            ["--spp", &self.spp.to_string(), "--seed", &self.seed.to_string()].map(str::to_owned).to_vec();
        if let Some([width, height]) = self.resolution {
            arguments.extend(["--resolution".to_owned(), format!("{width}x{height}")]);
        }
        if let Some(threads) = self.threads {
            arguments.extend(["--threads".to_owned(), threads.to_string()]);
        }
        arguments.extend(self.method.arguments.iter().cloned());
        arguments
    }

    /// The command that makes the image again.
    pub fn command(&self) -> String {
        let scene = self.scene.display().to_string();
        let scene = if scene.contains(' ') { format!("'{scene}'") } else { scene };
        format!("lanternfish render {scene} {}", self.arguments().join(" "))
    }

    fn error(&self, how: impl Into<String>, reason: impl Into<String>, code: Option<i32>) -> BenchError {
        let error = RunError { how: how.into(), command: self.command(), reason: reason.into(), code };
        BenchError::Render(error)
    }
}

/// Renders, until it is done or `stop` is set.
///
/// # Errors
/// [`BenchError::Render`] with what the render said, [`BenchError::Interrupted`].
pub fn render(task: &Task, stop: &AtomicBool) -> Result<Rendered, BenchError> {
    Ok(render_together(std::slice::from_ref(task), stop)?.remove(0))
}

/// Starts all of `tasks`, whose outputs must differ, and waits for them; what they took, in their order.
///
/// # Errors
/// Those of [`render`] for the first that fails; the others are ended.
pub fn render_together(tasks: &[Task], stop: &AtomicBool) -> Result<Vec<Rendered>, BenchError> {
    let mut ended = machine::children_cpu_seconds();
    let mut running = tasks.iter().map(Running::start).collect::<Result<Vec<_>, _>>()?;
    while running.iter().any(|running| running.rendered.is_none()) {
        for running in running.iter_mut().filter(|running| running.rendered.is_none()) {
            running.look(&mut ended)?;
        }
        if stop.load(Ordering::Relaxed) {
            return Err(BenchError::Interrupted);
        }
        std::thread::sleep(LOOK);
    }
    Ok(running.iter_mut().filter_map(|running| running.rendered.take()).collect())
}

/// A render on its way; dropped, it is ended.
struct Running<'a> {
    task: &'a Task<'a>,
    child: Child,
    start: Instant,
    stats: PathBuf,
    said: PathBuf,
    rendered: Option<Rendered>,
}

impl<'a> Running<'a> {
    fn start(task: &'a Task<'a>) -> Result<Self, BenchError> {
        let (stats, said) = (task.output.with_extension("json"), task.output.with_extension("log"));
        let fail = |error: &dyn std::fmt::Display| task.error("could not be started", error.to_string(), None);
        let program = std::env::current_exe().map_err(|error| fail(&error))?;
        let log = File::create(&said).map_err(|error| fail(&error))?;
        let start = Instant::now();
        let child = Command::new(program)
            .arg("render")
            .arg(task.scene)
            .args(task.arguments())
            .arg("--quiet")
            .arg("-o")
            .arg(task.output)
            .arg("--stats")
            .arg(&stats)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .map_err(|error| fail(&error))?;
        Ok(Self { task, child, start, stats, said, rendered: None })
    }

    /// Reads what it took if it has ended. `ended` are the processor seconds of all children that had ended before.
    fn look(&mut self, ended: &mut f64) -> Result<(), BenchError> {
        let task = self.task;
        let waited = self.child.try_wait();
        let waited = waited.map_err(|error| task.error("could not be waited for", error.to_string(), None))?;
        let Some(status) = waited else { return Ok(()) };
        let wall_seconds = self.start.elapsed().as_secs_f64();
        let before = std::mem::replace(ended, machine::children_cpu_seconds());
        if !status.success() {
            let reason = std::fs::read(&self.said).unwrap_or_default();
            let how =
                status.code().map_or(format!("was ended ({status})"), |code| format!("ended with exit code {code}"));
            return Err(task.error(how, String::from_utf8_lossy(&reason).trim_end(), status.code()));
        }
        let _ = std::fs::remove_file(&self.said);
        let text = std::fs::read_to_string(&self.stats)
            .map_err(|error| task.error("wrote no statistics", error.to_string(), None))?;
        let odd =
            || task.error("wrote statistics that cannot be read", text.chars().take(200).collect::<String>(), None);
        self.rendered = Some(rendered(&text, wall_seconds, *ended - before).ok_or_else(odd)?);
        Ok(())
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        if self.rendered.is_none() {
            // It may have ended by itself meanwhile.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

fn rendered(stats: &str, wall_seconds: f64, cpu_seconds_with_helpers: f64) -> Option<Rendered> {
    let stats: Value = serde_json::from_str(stats).ok()?;
    let sum = |names: &[&str]| names.iter().map(|name| stats["seconds"][name].as_f64()).sum::<Option<f64>>();
    let of_iterations = |name: &str| {
        let each = stats["iterations"].as_array()?.iter().map(|iteration| iteration[name].as_f64());
        each.sum::<Option<f64>>()
    };
    let cost = Cost {
        wall_seconds,
        cpu_seconds: stats["cpu_seconds"].as_f64()?,
        cpu_seconds_with_helpers,
        cpu_seconds_rendering: stats["cpu_seconds_rendering"].as_f64()?,
        cpu_seconds_learning: of_iterations("learning_cpu")?,
        load_seconds: sum(&["parse", "volumes_and_textures", "geometry_load"])?,
        build_seconds: sum(&["geometry_build", "lights", "cache_points"])?,
        render_seconds: sum(&["render"])?,
        learning_seconds: of_iterations("learning")?,
        peak_memory: stats["peak_memory"].as_f64()?,
    };
    Some(Rendered { cost, backend: stats["backend"].as_str()?.to_owned() })
}
