//! The commands that need no scene: `compare`, and `info` of an OpenEXR file.

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::ExitStatus;
use super::arguments::CompareArguments;
use super::render_outputs::refuse_overlap;
use crate::report::{CompareError, compare, info_exr, write_difference};

/// `lanternfish compare`: exit code 0 however much the images differ, 3 if they cannot be compared.
pub fn run_compare(arguments: &CompareArguments) -> ExitStatus {
    let comparison = match compare(&arguments.a, &arguments.b) {
        Ok(comparison) => comparison,
        Err(error) => return fail(&error, ExitStatus::BadInput),
    };
    if let Some(png) = &arguments.png {
        if let Err(error) = refuse_overlap(&[png], [&arguments.a, &arguments.b].into_iter().cloned()) {
            return fail(&error, ExitStatus::Usage);
        }
        if let Err(error) = write_difference(&arguments.a, &arguments.b, png) {
            let is_output = matches!(&error, CompareError::Output(_));
            return fail(&error, if is_output { ExitStatus::Failed } else { ExitStatus::BadInput });
        }
    }
    print_report(&comparison, arguments.json)
}

/// `lanternfish info` of an OpenEXR file.
pub fn run_info_exr(path: &Path, json: bool) -> ExitStatus {
    match info_exr(path) {
        Ok(info) => print_report(&info, json),
        Err(error) => fail(&error, ExitStatus::BadInput),
    }
}

/// Prints a report on the standard output, as text or as JSON. Whoever stopped reading does not make it an error.
pub fn print_report(report: &(impl Serialize + std::fmt::Display), json: bool) -> ExitStatus {
    let text = if json {
        match serde_json::to_string_pretty(report) {
            Ok(text) => text + "\n",
            Err(error) => return fail(&error, ExitStatus::Failed),
        }
    } else {
        report.to_string()
    };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => fail(&error, ExitStatus::Failed),
        _ => ExitStatus::Done,
    }
}

fn fail(error: &dyn std::fmt::Display, status: ExitStatus) -> ExitStatus {
    super::diagnostics::print_message(&error.to_string());
    status
}
