//! Whether a sample costs the same however many lights there are: one geometry, uneven ground with fluted pillars, under few and under very many
//! point lights of the same power in all, strewn over the same space.

use std::f32::consts::TAU;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use lanternfish::bench::estimate::Estimate;
use lanternfish::bench::ratio::{Ratio, show};
use lanternfish::bench::table::Table;
use lanternfish::math::sampler::Stream;
use serde::Serialize;

use super::mesh::{bumps, write_mesh};
use super::run::{Cost, Task, fail, render};
use super::settings::Settings;
use super::variants::DEFAULTS;

#[derive(Serialize)]
pub struct ManyResult {
    pub few: Timed,
    pub many: Timed,
    /// Processor seconds of rendering, many over few.
    pub ratio: Ratio,
}

#[derive(Serialize)]
pub struct Timed {
    pub lights: u64,
    pub costs: Vec<Cost>,
}

impl ManyResult {
    pub fn counts(&self) -> [u64; 2] {
        [self.few.lights, self.many.lights]
    }
}

/// Seed by seed, both numbers in turn.
pub fn measure(folder: &Path, counts: [u64; 2], settings: &Settings) -> ManyResult {
    let files = counts.map(|lights| {
        let path = folder.join(format!("pillars-{lights}.pbrt"));
        write(folder, &path, lights).unwrap_or_else(|error| fail(&format!("{}: {error}", path.display())));
        path
    });
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let (size, spp, output) = (settings.size.as_str(), settings.spp, scratch.path().join("render.exr"));
    let mut costs = [vec![], vec![]];
    for seed in settings.seeds() {
        for index in 0..2 {
            let (scene, arguments) = (files[index].as_path(), DEFAULTS.arguments);
            costs[index].push(render(&Task { scene, arguments, size, spp, seed, output: &output }));
        }
    }
    let [few, many] = costs;
    let ratio = Ratio::of(many.iter().zip(&few).map(|(m, f)| m.rendering_seconds / f.rendering_seconds));
    let timed = |index: usize, costs| Timed { lights: counts[index], costs };
    ManyResult { few: timed(0, few), many: timed(1, many), ratio }
}

/// The ground, 120 by 120.
fn ground(u: f32, v: f32) -> [f32; 3] {
    [120.0 * (u - 0.5), 120.0 * (v - 0.5), 0.4 * bumps(4.0 * u, 4.0 * v) - 0.3]
}

/// A pillar 5 high, with 20 flutes and a little thicker below.
fn pillar(u: f32, v: f32) -> [f32; 3] {
    let radius = 0.5 - 0.08 * v - 0.03 * (20.0 * TAU * u).cos().abs();
    [radius * (TAU * u).cos(), radius * (TAU * u).sin(), 5.0 * v - 1.0]
}

fn write(folder: &Path, path: &Path, lights: u64) -> io::Result<()> {
    write_mesh(&folder.join("ground.ply"), 400, ground)?;
    write_mesh(&folder.join("pillar.ply"), 120, pillar)?;
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(
        out,
        r#"LookAt 0 -30 12  0 0 0  0 0 1
Camera "perspective" "float fov" 50
Sampler "zsobol"
Integrator "volpath" "integer maxdepth" 5
Film "rgb" "integer xresolution" 320 "integer yresolution" 180
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "plymesh" "string filename" "ground.ply"
ObjectBegin "pillar"
  Shape "plymesh" "string filename" "pillar.ply"
ObjectEnd"#
    )?;
    for index in 0..144 {
        let (x, y) = (4 * (index % 12) - 22, 4 * (index / 12) - 22);
        writeln!(out, "AttributeBegin Translate {x} {y} 0 ObjectInstance \"pillar\" AttributeEnd")?;
    }
    let mut stream = Stream::from_seed(1);
    let intensity = 2000.0 / lights as f64;
    for _ in 0..lights {
        let [x, y, z] = [stream.next_f32(), stream.next_f32(), stream.next_f32()];
        let (x, y, z) = (48.0 * x - 24.0, 48.0 * y - 24.0, 0.2 + 4.0 * z);
        writeln!(
            out,
            "LightSource \"point\" \"point3 from\" [ {x:.4} {y:.4} {z:.4} ] \"rgb I\" [ {intensity:.4e} {intensity:.4e} {intensity:.4e} ]"
        )?;
    }
    out.flush()
}

pub fn table(result: &ManyResult) -> Table {
    let header = ["lights", "rendering CPU s", "all CPU s", "wall s", "build s", "MiB"];
    let mut table = Table::new("one geometry, more lights", &header);
    table.notes.push(format!("rendering CPU s, many over few: {}", result.ratio.show()));
    for timed in [&result.few, &result.many] {
        let of =
            |quantity: fn(&Cost) -> f64| show(&Estimate::of(&timed.costs.iter().map(quantity).collect::<Vec<_>>()));
        table.rows.push(vec![
            timed.lights.to_string(),
            of(|cost| cost.rendering_seconds),
            of(|cost| cost.cpu_seconds),
            of(|cost| cost.wall_seconds),
            of(|cost| cost.build_seconds),
            of(|cost| cost.peak_memory / (1u64 << 20) as f64),
        ]);
    }
    table
}
