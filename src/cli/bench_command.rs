//! `lanternfish bench`: error against run time, method by method.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};

use super::ExitStatus;
use super::arguments::{Arguments, BenchArguments, Command};
use super::diagnostics::{print_message, say};
use super::interrupt::Interrupts;
use super::progress::{clock, time_left};
use super::render_command::report_end;
use super::render_report::command_line;
use crate::bench::{BenchError, Settings, Watch, method, write};
use crate::render::RenderSettings;

/// The methods that have names, for the help.
pub fn list() -> String {
    format!(
        "Methods: {}; your own are NAME=ARGS, such as --methods 'few=--lights cache-points --cache-entries 32'",
        method::names()
    )
}

/// Runs the command.
pub fn run(arguments: &BenchArguments) -> ExitStatus {
    let interrupts = Interrupts::listen();
    let settings = match Settings::check(arguments.request(command_line())).and_then(check_methods) {
        Ok(settings) => settings,
        Err(error) => return fail(error),
    };
    let watch: Box<dyn Watch> =
        if arguments.quiet { Box::new(crate::bench::watch::Nobody) } else { Box::new(Shown::new()) };
    // From here on there are renders to end.
    interrupts.rendering(true);
    match crate::bench::run(&settings, watch.as_ref(), &interrupts.stop) {
        Ok(report) => {
            if !arguments.quiet {
                let written = format!("\nwritten: {}\n", settings.out.join(write::PAGE).display());
                let _ = std::io::stdout().lock().write_all((report.text() + &written).as_bytes());
            }
            ExitStatus::Done
        }
        Err(error) => fail(error),
    }
}

/// The arguments of every method must be those of a render, and leave what the benchmark decides alone.
fn check_methods(settings: Settings) -> Result<Settings, BenchError> {
    for method in settings.methods() {
        let words = ["lanternfish", "render", "scene.pbrt"].into_iter().map(str::to_owned);
        let refuse = |what: String| Err(BenchError::Usage(format!("method \"{}\": {what}", method.name)));
        let parsed = match Arguments::try_parse_from(words.chain(method.arguments.iter().cloned())) {
            Ok(Arguments { command: Command::Render(parsed) }) => parsed.settings(),
            Ok(_) => return refuse("these are no arguments of a render".to_owned()),
            Err(error) => {
                let text = error.to_string();
                return refuse(text.lines().next().unwrap_or("").trim_start_matches("error: ").to_owned());
            }
        };
        let RenderSettings { output, png, budget, seed, threads, film, stats, debug_cache_points, .. } = &parsed;
        let default = RenderSettings::default();
        let is_free = output.is_none() && png.is_none() && stats.is_none() && debug_cache_points.is_none();
        let is_ours = *budget == default.budget && seed.is_none() && threads.is_none() && *film == default.film;
        if !is_free || !is_ours || parsed.quiet {
            return refuse(
                "the benchmark itself says which samples, seed, threads, resolution and files a render has".to_owned(),
            );
        }
    }
    Ok(settings)
}

/// Prints an error and says how the process ends.
fn fail(error: BenchError) -> ExitStatus {
    if let BenchError::Scene { error, sources } = error {
        return report_end(Err(*error), &sources);
    }
    print_message(&error.to_string());
    match error {
        BenchError::Usage(_) => ExitStatus::Usage,
        BenchError::Image(_) | BenchError::Judge { .. } | BenchError::OtherPixels { .. } => ExitStatus::BadInput,
        BenchError::Interrupted => ExitStatus::Interrupted,
        BenchError::Render(error) => {
            [ExitStatus::Usage, ExitStatus::BadInput, ExitStatus::Limit, ExitStatus::Interrupted]
                .into_iter()
                .find(|status| error.code == Some(*status as i32))
                .unwrap_or(ExitStatus::Failed)
        }
        BenchError::Scene { .. } | BenchError::Output(_) | BenchError::Gallery(_) => ExitStatus::Failed,
    }
}

/// A bar on a terminal, lines elsewhere, both on the standard error output.
struct Shown {
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

struct State {
    begun: Instant,
    total: f64,
    done: f64,
    last: Option<Instant>,
}

/// Lines are no closer than this.
const PAUSE: Duration = Duration::from_secs(2);
/// Steps of the bar.
const STEPS: f64 = 1000.0;

impl Shown {
    fn new() -> Self {
        let style = ProgressStyle::with_template("{percent:>3} % [{bar:30}] {msg}").map(|s| s.progress_chars("=> "));
        let bar = std::io::stderr()
            .is_terminal()
            .then(|| ProgressBar::new(STEPS as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())));
        Self { bar, state: Mutex::new(State { begun: Instant::now(), total: 1.0, done: 0.0, last: None }) }
    }
}

impl Watch for Shown {
    fn begin(&self, total: f64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        *state = State { begun: Instant::now(), total, done: 0.0, last: None };
    }

    fn done(&self, work: f64, line: &str) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += work;
        let fraction = (state.done / state.total.max(1e-9)).clamp(0.0, 1.0);
        let left = time_left(fraction, state.begun.elapsed());
        let left = left.map_or(String::new(), |left| format!("; {} left", clock(left)));
        match &self.bar {
            Some(bar) => {
                bar.set_position((fraction * STEPS) as u64);
                bar.set_message(format!("{line}{left}"));
            }
            None if state.last.is_none_or(|last| last.elapsed() >= PAUSE) => {
                state.last = Some(Instant::now());
                say(format!("{:3.0} %: {line}{left}", 100.0 * fraction));
            }
            None => {}
        }
    }

    fn skip(&self, work: f64) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).total -= work;
    }

    fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.set_message(line.to_owned()),
            None => say(line),
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
