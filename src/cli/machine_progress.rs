//! Progress of a render for machines: lines of JSON on the standard error output, or the lines that Open Job Description asks of the processes that it runs, on the
//! standard output (openjd-specifications, "How Jobs Are Run", section "Stdout/Stderr Messages": `openjd_progress`, `openjd_status`, `openjd_fail`).

use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::log::{self, Level};
use super::progress::{Sequence, describe};
use crate::render::progress::{Progress, ProgressState};

/// At most one report in this time, which is two lines of Open Job Description.
const PAUSE: Duration = Duration::from_secs(1);

/// Where nothing has changed there is a report all the same: who watches knows that the process lives.
const LONGEST: Duration = Duration::from_secs(60);

/// What a report in JSON says besides its message.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Report {
    /// Of the whole command, 0 to 1.
    progress: f64,
    samples_per_pixel: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds_left: Option<f64>,
}

struct State<W> {
    out: W,
    sequence: Sequence,
    last: Option<Instant>,
    /// In hundredths, what the last report said.
    told: Option<u32>,
}

impl<W> State<W> {
    fn new(out: W) -> Mutex<Self> {
        Mutex::new(Self { out, sequence: Sequence::new(), last: None, told: None })
    }

    /// Whether a report is due. The end is told whenever it comes.
    fn is_due(&mut self, overall: f64) -> bool {
        let hundredth = (overall * 100.0) as u32;
        let since = self.last.map(|last| last.elapsed());
        let is_early = since.is_some_and(|since| since < PAUSE) && overall < 1.0;
        let is_news = self.told != Some(hundredth) || since.is_some_and(|since| since >= LONGEST);
        if is_early || !is_news {
            return false;
        }
        (self.last, self.told) = (Some(Instant::now()), Some(hundredth));
        true
    }
}

fn locked<T>(state: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line of JSON at each hundredth, but no more than one a second.
pub(super) struct JsonLines(Mutex<State<()>>);

impl JsonLines {
    pub fn new() -> Self {
        Self(State::new(()))
    }
}

impl Progress for JsonLines {
    fn frame(&self, index: usize, count: usize) {
        locked(&self.0).sequence.frame(index, count);
    }

    fn start(&self, _total_samples: Option<u64>) {
        locked(&self.0).sequence.begin();
    }

    fn update(&self, state: &ProgressState) {
        let mut s = locked(&self.0);
        let progress = s.sequence.overall(state.fraction);
        if s.is_due(progress) {
            let seconds_left = s.sequence.time_left(state.fraction).map(|left| left.as_secs_f64().round());
            let report = Report {
                progress: (progress * 1e4).round() * 1e-4,
                samples_per_pixel: (state.samples_per_pixel * 100.0).round() * 0.01,
                error: state.error,
                seconds_left,
            };
            let message = format!("{:.0} %: {}", progress * 100.0, describe(state, &s.sequence));
            log::write_json(Level::Info, &message, Some(report));
        }
    }

    fn finish(&self) {}
}

/// Open Job Description's lines, to whatever takes them.
pub(super) struct OpenJobLines<W>(Mutex<State<W>>);

impl<W: Write> OpenJobLines<W> {
    pub fn new(out: W) -> Self {
        Self(State::new(out))
    }
}

impl<W: Write + Send> Progress for OpenJobLines<W> {
    fn frame(&self, index: usize, count: usize) {
        locked(&self.0).sequence.frame(index, count);
    }

    fn start(&self, _total_samples: Option<u64>) {
        locked(&self.0).sequence.begin();
    }

    fn update(&self, state: &ProgressState) {
        let mut s = locked(&self.0);
        let overall = s.sequence.overall(state.fraction);
        if s.is_due(overall) {
            let status = describe(state, &s.sequence);
            let lines = format!("openjd_progress: {:.1}\nopenjd_status: {status}\n", overall * 100.0);
            let _ = s.out.write_all(lines.as_bytes()).and_then(|()| s.out.flush());
        }
    }

    fn finish(&self) {}
}

/// The line that tells why a command failed.
pub(super) fn fail_line(message: &str) -> String {
    format!("openjd_fail: {}\n", message.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Prints it. That nobody reads it is no error.
pub(super) fn print_fail(message: &str) {
    let _ = std::io::stdout().lock().write_all(fail_line(message).as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(fraction: f64) -> ProgressState {
        ProgressState { fraction, samples_per_pixel: 8.0 * fraction, error: None }
    }

    #[test]
    fn open_job_lines_are_few_and_go_over_all_frames() {
        let lines = OpenJobLines::new(Vec::new());
        for frame in 0..4 {
            lines.frame(frame, 4);
            lines.start(Some(100));
            (0..=1000).for_each(|i| lines.update(&at(f64::from(i) / 1000.0)));
            lines.finish();
        }
        let text = String::from_utf8(lines.0.into_inner().expect("unpoisoned").out).expect("text");
        // All of it takes less than a second: the first, and the end of the last.
        let expected = "openjd_progress: 0.0\nopenjd_status: frame 1 of 4, 0 spp\nopenjd_progress: 100.0\nopenjd_status: frame 4 of 4, 8 spp\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_failure_is_one_line() {
        assert_eq!(fail_line("cannot read a:\n  no such file"), "openjd_fail: cannot read a: no such file\n");
    }
}
