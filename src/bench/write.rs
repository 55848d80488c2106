//! The files of a report. Each appears whole or not at all.

use std::io::Write;
use std::path::Path;

use super::report::Report;
use super::{csv, lean, page, plots};
use crate::system::output::{OutputError, write_atomically};

/// The page.
pub const PAGE: &str = "index.html";
/// The same in numbers.
pub const JSON: &str = "results.json";
/// Every render, a line each.
pub const CSV: &str = "results.csv";
/// Every render with and without what scenes leave out, a line each.
pub const LEAN: &str = "lean.csv";
/// The folder of plots as PNG.
pub const PLOTS: &str = "plots";

/// Makes the folder of the results and those in it.
///
/// # Errors
/// What the system says.
pub fn make_folders(out: &Path) -> Result<(), OutputError> {
    for folder in ["references", PLOTS].map(|name| out.join(name)) {
        std::fs::create_dir_all(&folder).map_err(|error| OutputError::new(&folder, error))?;
    }
    Ok(())
}

/// Writes all of it.
///
/// # Errors
/// What cannot be written.
pub fn write(report: &Report, out: &Path) -> Result<(), OutputError> {
    let json = serde_json::to_vec_pretty(report).map_err(|error| OutputError::new(&out.join(JSON), error))?;
    put(&out.join(JSON), &json)?;
    put(&out.join(CSV), &csv::text(report).map_err(|error| OutputError::new(&out.join(CSV), error))?)?;
    if !report.lean.is_empty() {
        let path = out.join(LEAN);
        put(&path, &lean::tables::csv(&report.lean).map_err(|error| OutputError::new(&path, error))?)?;
    }
    for scene in &report.scenes {
        for plot in plots::of(scene) {
            let path = out.join(PLOTS).join(format!("{}-{}.png", scene.name, plot.name));
            put(&path, &plot.png().map_err(|error| OutputError::new(&path, error))?)?;
        }
    }
    put(&out.join(PAGE), page::html(report).as_bytes())
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomically(path, |file| file.write_all(bytes).map_err(|error| error.to_string()))
}
