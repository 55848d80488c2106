//! Progress of a render on the standard error output: a bar on a terminal, a line now and then elsewhere.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::render::progress::{Progress, ProgressState, Silent};

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Who listens to a render: nobody with `quiet`, a bar on a terminal, plain lines otherwise.
pub fn listener(quiet: bool) -> Box<dyn Progress> {
    if quiet {
        Box::new(Silent)
    } else if std::io::stderr().is_terminal() {
        Box::new(Bar::new(ProgressDrawTarget::stderr()))
    } else {
        Box::new(Lines::new(std::io::stderr()))
    }
}

/// What stands beside the percentage: samples, error, time left.
fn describe(state: &ProgressState, elapsed: Duration) -> String {
    let mut text = format!("{:.0} spp", state.samples_per_pixel);
    if let Some(error) = state.error {
        text += &format!(", error {:.2} %", error * 100.0);
    }
    if let Some(left) = time_left(state.fraction, elapsed) {
        text += &format!(", {} left", clock(left));
    }
    text
}

/// The time that the rest takes at the speed so far; `None` while too little is done to tell.
pub(super) fn time_left(fraction: f64, elapsed: Duration) -> Option<Duration> {
    if fraction < 0.001 || elapsed < Duration::from_millis(200) {
        return None;
    }
    Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - fraction.min(1.0)) / fraction).ok()
}

/// Hours, minutes and seconds.
pub(super) fn clock(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().round() as u64;
    let (hours, minutes) = (seconds / 3600, seconds / 60 % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{:02}", seconds % 60)
    } else {
        format!("{minutes}:{:02}", seconds % 60)
    }
}

struct Bar {
    bar: ProgressBar,
    started: Mutex<Instant>,
}

impl Bar {
    fn new(target: ProgressDrawTarget) -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{percent:>3} % [{bar:30}] {msg}").map(|s| s.progress_chars("=> "));
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, started: Mutex::new(Instant::now()) }
    }
}

impl Progress for Bar {
    fn start(&self, _total_samples: Option<u64>) {
        *self.started.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        self.bar.set_position(0);
    }

    fn update(&self, state: &ProgressState) {
        let elapsed = self.started.lock().unwrap_or_else(PoisonError::into_inner).elapsed();
        self.bar.set_message(describe(state, elapsed));
        self.bar.set_position((state.fraction.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    fn finish(&self) {
        self.bar.finish();
    }
}

/// A line at each tenth, but no more than one a second.
struct Lines<W> {
    state: Mutex<LinesState<W>>,
}

struct LinesState<W> {
    out: W,
    started: Instant,
    last: Option<Instant>,
    next_tenth: u32,
}

impl<W: Write> Lines<W> {
    fn new(out: W) -> Self {
        Self { state: Mutex::new(LinesState { out, started: Instant::now(), last: None, next_tenth: 1 }) }
    }
}

impl<W: Write + Send> Progress for Lines<W> {
    fn start(&self, total_samples: Option<u64>) {
        let mut s = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        (s.started, s.last, s.next_tenth) = (Instant::now(), None, 1);
        if let Some(total) = total_samples {
            let _ = writeln!(s.out, "rendering {total} samples");
        }
    }

    fn update(&self, state: &ProgressState) {
        let mut s = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let tenth = (state.fraction.clamp(0.0, 1.0) * 10.0 + 1e-9) as u32;
        let is_early = s.last.is_some_and(|last| last.elapsed() < Duration::from_secs(1));
        if tenth < s.next_tenth || (is_early && tenth < 10) {
            return;
        }
        let line = format!("{:3.0} %: {}", state.fraction * 100.0, describe(state, s.started.elapsed()));
        let _ = writeln!(s.out, "{line}");
        s.last = Some(Instant::now());
        s.next_tenth = tenth + 1;
    }

    fn finish(&self) {
        let mut s = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = s.out.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_at_tenths_and_end_with_the_last() {
        let lines = Lines::new(Vec::new());
        lines.start(Some(400));
        for i in 1..=100 {
            let error = Some(0.1 / f64::from(i).sqrt());
            lines.update(&ProgressState { fraction: f64::from(i) / 100.0, samples_per_pixel: f64::from(i), error });
        }
        lines.finish();
        let text = String::from_utf8(lines.state.into_inner().expect("unpoisoned").out).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines, ["rendering 400 samples", " 10 %: 10 spp, error 3.16 %", "100 %: 100 spp, error 1.00 %"]);
    }

    #[test]
    fn the_time_left_follows_the_speed_so_far() {
        assert_eq!(time_left(0.25, Duration::from_secs(10)), Some(Duration::from_secs(30)));
        assert_eq!(time_left(0.0, Duration::from_secs(10)), None);
        assert_eq!(
            (clock(Duration::from_secs(59)), clock(Duration::from_secs(3725))),
            ("0:59".into(), "1:02:05".into())
        );
    }

    #[test]
    fn a_bar_accepts_everything() {
        let bar = Bar::new(ProgressDrawTarget::hidden());
        bar.start(None);
        bar.update(&ProgressState { fraction: f64::NAN, samples_per_pixel: 0.0, error: None });
        bar.update(&ProgressState { fraction: 2.0, samples_per_pixel: 3.0, error: Some(0.5) });
        assert_eq!(bar.bar.position(), STEPS);
        bar.finish();
    }
}
