//! Every render as a line of CSV.

use serde::Serialize;

use super::report::Report;

/// A render; the names are the header's.
#[derive(Serialize)]
struct Line<'a> {
    scene: &'a str,
    lights: usize,
    method: &'a str,
    arguments: String,
    spp: u32,
    seed: u32,
    mse: f64,
    rmse: f64,
    gathered_rmse: f64,
    relative_mse: f64,
    hdr_flip: f64,
    mean_difference: f64,
    ttuv: f64,
    wall_seconds: f64,
    cpu_seconds: f64,
    cpu_seconds_rendering: f64,
    cpu_seconds_learning: f64,
    load_seconds: f64,
    build_seconds: f64,
    render_seconds: f64,
    peak_memory: f64,
    is_above_reference: bool,
    command: &'a str,
}

/// All renders of all scenes; numbers that are not known are `NaN`.
///
/// # Errors
/// What the crate `csv` says.
pub fn text(report: &Report) -> Result<Vec<u8>, String> {
    let mut writer = csv::Writer::from_writer(vec![]);
    for scene in &report.scenes {
        for curve in &scene.curves {
            for point in &curve.points {
                for run in &point.runs {
                    let (cost, errors) = (&run.cost, &run.errors);
                    let line = Line {
                        scene: &scene.name,
                        lights: scene.lights,
                        method: &curve.method.name,
                        arguments: curve.method.show(),
                        spp: point.spp,
                        seed: run.seed,
                        mse: errors.mse,
                        rmse: errors.rmse,
                        gathered_rmse: errors.gathered_rmse,
                        relative_mse: errors.relative_mse,
                        hdr_flip: errors.flip,
                        mean_difference: errors.difference,
                        ttuv: run.ttuv(),
                        wall_seconds: cost.wall_seconds,
                        cpu_seconds: cost.cpu_seconds,
                        cpu_seconds_rendering: cost.cpu_seconds_rendering,
                        cpu_seconds_learning: cost.cpu_seconds_learning,
                        load_seconds: cost.load_seconds,
                        build_seconds: cost.build_seconds,
                        render_seconds: cost.render_seconds,
                        peak_memory: cost.peak_memory,
                        is_above_reference: point.is_above_reference,
                        command: &run.command,
                    };
                    writer.serialize(line).map_err(|error| error.to_string())?;
                }
            }
        }
    }
    writer.into_inner().map_err(|error| error.to_string())
}
