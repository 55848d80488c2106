//! `lanternfish info`: what is in a scene, a volume or an image; for a scene also what rendering it would build, and why.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use super::ExitStatus;
use super::arguments::InfoArguments;
use super::diagnostics::{print_warnings_before, warning_lines};
use super::images::{print_report, run_info_exr};
use super::render_command::report_end;
use crate::render::plan::Plan;
use crate::render::{Job, RenderError, RenderSettings, Timings, load};
use crate::scene::lint::{lint, lint_files, lint_lights};
use crate::scene::{SceneDescription, Sources, Warnings};

/// Runs the command: the kind of file is told by its ending.
pub fn run(arguments: &InfoArguments) -> ExitStatus {
    let path = arguments.file.as_path();
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => run_info_exr(path, arguments.json),
        Some("vdb" | "nvdb") => super::vdb::run_info_vdb(path, arguments.json),
        _ => {
            let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
            let result = scene(path, arguments, &mut sources, &mut warnings);
            report_end(result, &sources)
        }
    }
}

fn scene(
    path: &Path,
    &InfoArguments { json, strict, .. }: &InfoArguments,
    sources: &mut Sources,
    warnings: &mut Warnings,
) -> Result<ExitStatus, RenderError> {
    let prepared = load(path, sources, warnings).and_then(|(scene, timings)| {
        if strict {
            lint(&scene, warnings);
        }
        let job = Job::prepare(&scene, &RenderSettings { plan_only: true, ..Default::default() }, timings, warnings);
        if strict {
            lint_files(&scene, warnings);
            if let Ok(job) = &job {
                lint_lights(job.world.lights.dark_places(), warnings);
            }
        }
        Ok((scene, job?))
    });
    if !json {
        print_warnings_before(&prepared, warnings, sources);
    }
    let (scene, job) = prepared?;
    let report = SceneReport {
        file: path.display().to_string(),
        resolution: job.film.resolution,
        samples_per_pixel: job.scene_spp,
        max_depth: job.path.max_depth,
        statements: Statements::of(&scene),
        volumes: job.world.media.iter().map(|medium| medium.summary()).collect(),
        memory_bytes: job.plan.bytes(),
        plan: job.plan,
        seconds: job.timings,
        warnings: warning_lines(warnings, sources),
    };
    match print_report(&report, json) {
        ExitStatus::Done if strict && !report.warnings.is_empty() => Ok(ExitStatus::BadInput),
        status => Ok(status),
    }
}

/// How much of what the file states.
#[derive(Serialize)]
struct Statements {
    shapes: usize,
    objects: usize,
    instances: usize,
    lights: usize,
    area_lights: usize,
    materials: usize,
    textures: usize,
    media: usize,
}

impl Statements {
    fn of(scene: &SceneDescription) -> Self {
        Self {
            shapes: scene.shapes.len(),
            objects: scene.objects.len(),
            instances: scene.instances.len(),
            lights: scene.lights.len(),
            area_lights: scene.area_lights.len(),
            materials: scene.materials.len(),
            textures: scene.textures.len(),
            media: scene.media.len(),
        }
    }
}

#[derive(Serialize)]
struct SceneReport {
    file: String,
    resolution: [u32; 2],
    samples_per_pixel: u32,
    max_depth: u32,
    statements: Statements,
    volumes: Vec<String>,
    plan: Plan,
    memory_bytes: usize,
    seconds: Timings,
    warnings: Vec<String>,
}

impl fmt::Display for SceneReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.resolution;
        let Statements { shapes, objects, instances, lights, area_lights, materials, textures, media } =
            self.statements;
        writeln!(f, "{}", self.file)?;
        writeln!(
            f,
            "  image      {width} × {height}, {} spp, at most {} bounces",
            self.samples_per_pixel, self.max_depth
        )?;
        writeln!(f, "  states     {shapes} shapes, {objects} objects, {instances} instances")?;
        writeln!(
            f,
            "             {lights} lights, {area_lights} area lights, {materials} materials, {textures} textures, {media} media"
        )?;
        for volume in &self.volumes {
            writeln!(f, "  volume     {volume}")?;
        }
        writeln!(f, "  plan")?;
        for system in &self.plan.systems {
            let verdict = if system.built { "build    " } else { "leave out" };
            write!(f, "    {verdict} {:<28} {}", system.name, system.reason)?;
            match system.bytes {
                0 => writeln!(f)?,
                bytes => writeln!(f, " ({:.2} MiB)", bytes as f64 / f64::from(1 << 20))?,
            }
        }
        let Timings { parse, volumes_and_textures, geometry_load, geometry_build, lights, .. } = self.seconds;
        let load = parse + volumes_and_textures + geometry_load;
        writeln!(f, "  memory     about {:.1} MiB", self.memory_bytes as f64 / f64::from(1 << 20))?;
        writeln!(f, "  seconds    {load:.3} load, {geometry_build:.3} build, {lights:.3} lights")
    }
}
