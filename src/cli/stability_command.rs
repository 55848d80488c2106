//! `lanternfish stability`: runs the stability suite, says what became of each case, and writes it down.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::ExitStatus;
use super::arguments::StabilityArguments;
use super::diagnostics::{print_message, say};
use super::interrupt::Interrupts;
use super::progress::{clock, time_left};
use crate::stability::report::{SuiteReport, head, line, repeat};
use crate::stability::run::{Limits, Verdict, run as run_case};
use crate::stability::{Case, cases};

/// The names of all cases, a group a line.
fn names() -> String {
    let mut text = String::from("known cases:");
    let mut group = "";
    for case in cases() {
        text += if case.group() == group { " " } else { "\n  " };
        group = case.group();
        text += case.name;
    }
    text
}

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Runs the command. Failures of cases end it with 1, names that no case has with 2.
pub fn run(arguments: &StabilityArguments) -> ExitStatus {
    if arguments.list {
        for case in cases() {
            let _ = writeln!(std::io::stdout(), "{:<26} {}", case.name, case.checks);
        }
        return ExitStatus::Done;
    }
    let unknown =
        arguments.case.iter().filter(|name| cases().all(|case| case.name != **name && case.group() != **name));
    let unknown: Vec<String> = unknown.map(|name| format!("\"{name}\"")).collect();
    if !unknown.is_empty() {
        print_message(&format!("no case is called {}", unknown.join(" or ")));
        say(names());
        return ExitStatus::Usage;
    }
    let is_wanted = |case: &Case| {
        arguments.case.is_empty() || arguments.case.iter().any(|name| case.name == name || case.group() == name)
    };
    let wanted: Vec<&Case> = cases().filter(|case| is_wanted(case)).collect();
    // Clap asks for it unless the cases are only listed.
    let Some(out) = arguments.out.as_deref() else { return ExitStatus::Usage };
    if let Err(error) = std::fs::create_dir_all(out) {
        print_message(&format!("{}: {error}", out.display()));
        return ExitStatus::Failed;
    }
    Interrupts::listen();

    let target =
        if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(STEPS), target);
    let style = ProgressStyle::with_template("{percent:>3} % [{bar:30}] {msg}").map(|s| s.progress_chars("=> "));
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let mut limits = Limits { threads: arguments.threads.unwrap_or(0) as usize, ..Limits::default() };
    if let Some(seconds) = arguments.time_limit {
        limits.time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    }
    let all: f64 = wanted.iter().map(|case| f64::from(case.seconds)).sum();
    let (start, mut done) = (Instant::now(), 0.0);
    let print = |text: String| bar.suspend(|| drop(writeln!(std::io::stdout(), "{text}")));
    print(head());
    let mut reports = vec![];
    for case in wanted {
        let fraction = done / all;
        let left = time_left(fraction, start.elapsed()).map_or(String::new(), |left| format!(", {} left", clock(left)));
        bar.set_position((fraction * STEPS as f64) as u64);
        bar.set_message(format!("{}{left}", case.name));
        let report = run_case(case, limits);
        print(line(&report));
        if matches!(report.verdict, Verdict::Fail | Verdict::Known) {
            print(format!("    {}", repeat(&report, out)));
        }
        reports.push(report);
        done += f64::from(case.seconds);
    }
    bar.finish_and_clear();
    let report = SuiteReport::new(reports);
    let _ = writeln!(std::io::stdout(), "{}", report.summary());
    if let Err(error) = report.write(out) {
        print_message(&error.to_string());
        return ExitStatus::Failed;
    }
    if report.count(Verdict::Fail) > 0 { ExitStatus::Failed } else { ExitStatus::Done }
}
