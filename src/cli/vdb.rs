//! `lanternfish info` of a volume: OpenVDB's files and NanoVDB's.

use std::path::Path;

use super::ExitStatus;
use super::diagnostics::print_message;
use super::images::print_report;
use crate::medium::grid::{file, nanovdb};

/// Lists every grid of the file, whether it can be used, and why not.
pub fn run_info_vdb(path: &Path, json: bool) -> ExitStatus {
    let is_nanovdb = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("nvdb"));
    match if is_nanovdb { nanovdb::describe(path) } else { file::describe(path) } {
        Ok(summary) => print_report(&summary, json),
        Err(error) => {
            print_message(&error.to_string());
            ExitStatus::from(&error)
        }
    }
}
