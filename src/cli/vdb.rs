//! `lanternfish info` of an OpenVDB file.

use std::path::Path;

use super::ExitStatus;
use super::diagnostics::print_message;
use super::images::print_report;
use crate::medium::grid::file::describe;

/// Lists every grid of the file, whether it can be used, and why not.
pub fn run_info_vdb(path: &Path, json: bool) -> ExitStatus {
    match describe(path) {
        Ok(summary) => print_report(&summary, json),
        Err(error) => {
            print_message(&error.to_string());
            ExitStatus::from(&error)
        }
    }
}
