//! The suite's results: lines for a terminal, and a page, a table and JSON for a folder.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use super::case::{FAMILY_RATE, MOST_COMPARISONS, critical_z};
use super::run::{CaseReport, Verdict};
use crate::system::output::{OutputError, write_atomically};

/// All of a run.
#[derive(Debug, Serialize)]
pub struct SuiteReport {
    /// This program's version.
    pub version: &'static str,
    /// What was built in.
    pub features: Vec<&'static str>,
    /// The probability that a suite without faults fails.
    pub false_alarm_rate: f64,
    /// Among how many comparisons it is split.
    pub comparisons: usize,
    /// How many standard errors a mean may be off.
    pub critical_z: f64,
    /// Wall-clock seconds of all cases.
    pub seconds: f64,
    /// The cases.
    pub cases: Vec<CaseReport>,
}

impl SuiteReport {
    /// The report of these cases.
    pub fn new(cases: Vec<CaseReport>) -> Self {
        let features = [("embree", cfg!(feature = "embree")), ("openvdb", cfg!(feature = "openvdb"))];
        Self {
            version: env!("CARGO_PKG_VERSION"),
            features: features.into_iter().filter(|(_, is_in)| *is_in).map(|(name, _)| name).collect(),
            false_alarm_rate: FAMILY_RATE,
            comparisons: MOST_COMPARISONS,
            critical_z: critical_z(),
            seconds: cases.iter().map(|case| case.seconds).sum(),
            cases,
        }
    }

    /// How many cases came to this.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.cases.iter().filter(|case| case.verdict == verdict).count()
    }

    /// Numbers of cases, in words.
    pub fn summary(&self) -> String {
        let rows: usize = self.cases.iter().map(|case| case.rows.len()).sum();
        let mut text = format!("{} cases of {rows} comparisons in {:.0} s:", self.cases.len(), self.seconds);
        let counts = [
            (Verdict::Pass, "pass"),
            (Verdict::Fail, "fail"),
            (Verdict::Known, "fail as known"),
            (Verdict::Skipped, "were skipped"),
        ];
        let counts = counts.map(|(verdict, words)| (self.count(verdict), words));
        let told = counts.iter().filter(|(count, words)| *count > 0 || *words == "pass");
        text += &told.map(|(count, words)| format!(" {count} {words}")).collect::<Vec<_>>().join(",");
        text
    }

    /// Writes `stability.html`, `stability.json` and `stability.csv` to a folder, and the scenes of cases that fail to `scenes/CASE` in it.
    pub fn write(&self, folder: &Path) -> Result<(), OutputError> {
        let json = serde_json::to_string_pretty(self).map_err(|error| OutputError::new(folder, error))?;
        for (name, text) in [("stability.html", self.html()), ("stability.json", json), ("stability.csv", self.csv())] {
            write_text(&folder.join(name), text.as_bytes())?;
        }
        for case in self.cases.iter().filter(|case| matches!(case.verdict, Verdict::Fail | Verdict::Known)) {
            let Some(from) = &case.folder else { continue };
            let to = folder.join("scenes").join(case.name);
            std::fs::create_dir_all(&to).map_err(|error| OutputError::new(&to, error))?;
            let files = std::fs::read_dir(from.path()).map_err(|error| OutputError::new(from.path(), error))?;
            for file in files.flatten() {
                let bytes = std::fs::read(file.path()).map_err(|error| OutputError::new(&file.path(), error))?;
                write_text(&to.join(file.file_name()), &bytes)?;
            }
        }
        Ok(())
    }

    fn csv(&self) -> String {
        let field = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let mut csv =
            String::from("case,verdict,seconds,what,expected,got,standard_error,allowed,passes,source,note\n");
        for case in &self.cases {
            let head = format!("{},{},{:.3}", case.name, case.verdict.word(), case.seconds);
            if case.rows.is_empty() {
                let _ = writeln!(csv, "{head},,,,,,,,{}", field(case.reason.as_deref().unwrap_or_default()));
            }
            for row in &case.rows {
                let error = row.error.map_or(String::new(), |error| error.to_string());
                let _ = writeln!(
                    csv,
                    "{head},{},{},{},{error},{},{},{},{}",
                    field(&row.what),
                    row.expected,
                    row.got,
                    row.allowed,
                    row.passes,
                    field(&row.source),
                    field(&row.note)
                );
            }
        }
        csv
    }

    fn html(&self) -> String {
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Lanternfish: stability</title>\n<style>{STYLE}</style></head><body>\n\
             <h1>Stability</h1>\n<p>{}. Lanternfish {}, built with {}.</p>\n\
             <p>Where sampling has a say, a mean may be off by {:.2} standard errors, besides what single precision may add: a suite without faults \
             fails with a probability of {:e} at most. Any NaN or infinity is a failure, and so is not being done in time.</p>\n\
             <table><thead><tr><th>case</th><th>expected</th><th>got</th><th>allowed difference</th><th>verdict</th></tr></thead>\n",
            escape(&self.summary()),
            self.version,
            if self.features.is_empty() {
                "neither embree nor openvdb".to_owned()
            } else {
                self.features.join(" and ")
            },
            self.critical_z,
            self.false_alarm_rate
        );
        for case in &self.cases {
            let _ = writeln!(
                html,
                "<tbody><tr class=\"case {}\"><th>{}</th><td colspan=\"3\">{}{}</td><td>{} in {:.1} s</td></tr>",
                case.verdict.word().to_lowercase(),
                escape(case.name),
                escape(case.checks),
                case.reason.as_ref().map_or(String::new(), |reason| format!("<br><strong>{}</strong>", escape(reason))),
                case.verdict.word(),
                case.seconds
            );
            for row in &case.rows {
                let error = row.error.map_or(String::new(), |error| format!(" ± {}", number(error)));
                let note = [row.source.as_str(), row.note.as_str()].map(escape);
                let _ = writeln!(
                    html,
                    "<tr class=\"{}\"><td>{}</td><td>{}<br><small>{}</small></td><td>{}{error}</td><td>{}</td><td>{} <small>{}</small></td></tr>",
                    if row.passes { "pass" } else { "fail" },
                    escape(&row.what),
                    number(row.expected),
                    note[0],
                    number(row.got),
                    number(row.allowed),
                    if row.passes { "pass" } else { "FAIL" },
                    note[1]
                );
            }
            html += "</tbody>\n";
        }
        html + "</table></body></html>\n"
    }
}

const STYLE: &str = "body{font:14px/1.4 sans-serif;max-width:75em;margin:2em auto;padding:0 1em}table{border-collapse:collapse;width:100%}\
td,th{text-align:left;vertical-align:top;padding:.2em .6em;border-bottom:1px solid #ddd}small{color:#666}tr.case{background:#eef}\
tr.case.fail,tr.fail td{background:#fcc}tr.case.known{background:#fec}tr.case.skipped{background:#eee}";

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn write_text(path: &Path, text: &[u8]) -> Result<(), OutputError> {
    write_atomically(path, |file| file.write_all(text).map_err(|error| error.to_string()))
}

/// A number in as many digits as say something.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        format!("{x:.6}")
    } else {
        format!("{x:.4e}")
    }
}

/// The head of the table on a terminal.
pub fn head() -> String {
    format!(
        "{:<26} {:>12} {:>24} {:>12}  {:<7} {:>6}",
        "case (its tightest row)", "expected", "got", "allowed ±", "verdict", "s"
    )
}

/// A case's line in it, with lines for what fails.
pub fn line(case: &CaseReport) -> String {
    let worst = case.worst();
    let cell = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    let got = worst.map_or_else(
        || "–".to_owned(),
        |row| number(row.got) + &row.error.map_or(String::new(), |error| format!(" ± {error:.1e}")),
    );
    let mut text = format!(
        "{:<26} {:>12} {got:>24} {:>12}  {:<7} {:>6.1}",
        case.name,
        cell(worst.map(|row| row.expected)),
        cell(worst.map(|row| row.allowed)),
        case.verdict.word(),
        case.seconds
    );
    if let Some(reason) = &case.reason {
        text += &format!("\n    {reason}");
    }
    for row in case.rows.iter().filter(|row| !row.passes) {
        let error = row.error.map_or(String::new(), |error| format!(" ± {}", number(error)));
        text += &format!(
            "\n    {}: expected {} ± {} ({}), got {}{error}",
            row.what,
            number(row.expected),
            number(row.allowed),
            row.source,
            number(row.got)
        );
        if !row.note.is_empty() {
            text += &format!("; {}", row.note);
        }
    }
    text
}

/// How to repeat a case that failed, and the scenes it failed with, which are in `folder`.
pub fn repeat(case: &CaseReport, folder: &Path) -> String {
    let mut text = format!("to repeat it: lanternfish stability --case {} --out {}", case.name, folder.display());
    let mut told: Vec<&str> = vec![];
    for row in case.rows.iter().filter(|row| !row.passes) {
        let scene = case.rendered.iter().find(|scene| Some(&scene.file) == row.scene.as_ref());
        let Some(scene) = scene.filter(|scene| !told.contains(&scene.file.as_str())) else { continue };
        told.push(&scene.file);
        let file = folder.join("scenes").join(case.name).join(&scene.file);
        text += &format!("\n    lanternfish render {} {}", file.display(), scene.flags);
        if row.note.starts_with("--replay") {
            text += &format!(" {}", row.note);
        }
    }
    text
}
