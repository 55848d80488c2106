//! Progress of a render on the standard error output: a bar on a terminal, a line now and then elsewhere. Where frames follow each other it goes over all of them.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::limit_arguments::Shown;
use super::log;
use super::machine_progress::{JsonLines, OpenJobLines};
use crate::render::progress::{Progress, ProgressState, Silent};

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Who listens to a render, as was asked for. By itself that is nobody with `quiet`, a bar on a terminal, plain lines otherwise.
pub fn listener(shown: Shown, quiet: bool) -> Box<dyn Progress> {
    match shown {
        Shown::Off => Box::new(Silent),
        Shown::Auto if quiet => Box::new(Silent),
        Shown::Openjd => Box::new(OpenJobLines::new(std::io::stdout())),
        Shown::Auto | Shown::Bar | Shown::Lines if log::is_json() => Box::new(JsonLines::new()),
        Shown::Auto if !std::io::stderr().is_terminal() => Box::new(Lines::new(std::io::stderr())),
        Shown::Auto | Shown::Bar => Box::new(Bar::new(ProgressDrawTarget::stderr())),
        Shown::Lines => Box::new(Lines::new(std::io::stderr())),
    }
}

/// Where a command is that renders one frame or several.
pub(super) struct Sequence {
    /// When the first frame's rendering began.
    started: Instant,
    index: usize,
    count: usize,
}

impl Sequence {
    pub fn new() -> Self {
        Self { started: Instant::now(), index: 0, count: 1 }
    }

    /// What comes now is frame `index` of `count`.
    pub fn frame(&mut self, index: usize, count: usize) {
        (self.index, self.count) = (index, count.max(1));
    }

    /// A frame's rendering begins.
    pub fn begin(&mut self) {
        if self.index == 0 {
            self.started = Instant::now();
        }
    }

    /// Whether no frame follows.
    pub fn is_last(&self) -> bool {
        self.index + 1 >= self.count
    }

    /// The share of all the work that is done, where this share of the frame is.
    pub fn overall(&self, fraction: f64) -> f64 {
        ((self.index as f64 + fraction.clamp(0.0, 1.0)) / self.count as f64).clamp(0.0, 1.0)
    }

    /// The time that the rest of all frames takes, where it can be told.
    pub fn time_left(&self, fraction: f64) -> Option<Duration> {
        time_left(self.overall(fraction), self.started.elapsed())
    }
}

/// What stands beside the percentage: frame, samples, error, time left.
pub(super) fn describe(state: &ProgressState, sequence: &Sequence) -> String {
    let mut text = match sequence {
        Sequence { count: 1, .. } => String::new(),
        Sequence { index, count, .. } => format!("frame {} of {count}, ", index + 1),
    };
    text += &format!("{:.0} spp", state.samples_per_pixel);
    if let Some(error) = state.error {
        text += &format!(", error {:.2} %", error * 100.0);
    }
    if let Some(left) = sequence.time_left(state.fraction) {
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

/// A duration as minutes and seconds, with hours if there are any.
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
    sequence: Mutex<Sequence>,
}

impl Bar {
    fn new(target: ProgressDrawTarget) -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        let style = ProgressStyle::with_template("{percent:>3} % [{bar:30}] {msg}").map(|s| s.progress_chars("=> "));
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, sequence: Mutex::new(Sequence::new()) }
    }

    fn show(&self, state: &ProgressState) {
        let sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
        self.bar.set_position((sequence.overall(state.fraction) * STEPS as f64) as u64);
        if state.samples_per_pixel > 0.0 {
            self.bar.set_message(describe(state, &sequence));
        }
    }
}

impl Progress for Bar {
    fn frame(&self, index: usize, count: usize) {
        self.sequence.lock().unwrap_or_else(PoisonError::into_inner).frame(index, count);
    }

    fn start(&self, _total_samples: Option<u64>) {
        self.sequence.lock().unwrap_or_else(PoisonError::into_inner).begin();
        self.show(&ProgressState::default());
    }

    fn update(&self, state: &ProgressState) {
        self.show(state);
    }

    fn finish(&self) {
        if self.sequence.lock().unwrap_or_else(PoisonError::into_inner).is_last() {
            self.bar.finish();
        }
    }
}

/// A line at each tenth, but no more than one a second.
struct Lines<W> {
    state: Mutex<LinesState<W>>,
}

struct LinesState<W> {
    out: W,
    sequence: Sequence,
    last: Option<Instant>,
    next_tenth: u32,
}

impl<W: Write> Lines<W> {
    fn new(out: W) -> Self {
        Self { state: Mutex::new(LinesState { out, sequence: Sequence::new(), last: None, next_tenth: 1 }) }
    }
}

impl<W: Write + Send> Progress for Lines<W> {
    fn frame(&self, index: usize, count: usize) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).sequence.frame(index, count);
    }

    fn start(&self, total_samples: Option<u64>) {
        let mut s = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        s.sequence.begin();
        if s.sequence.index == 0 {
            (s.last, s.next_tenth) = (None, 1);
        }
        if let Some(total) = total_samples {
            let _ = writeln!(s.out, "rendering {total} samples");
        }
    }

    fn update(&self, state: &ProgressState) {
        let mut s = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let overall = s.sequence.overall(state.fraction);
        let tenth = (overall * 10.0 + 1e-9) as u32;
        let is_early = s.last.is_some_and(|last| last.elapsed() < Duration::from_secs(1));
        if tenth < s.next_tenth || (is_early && tenth < 10) {
            return;
        }
        let line = format!("{:3.0} %: {}", overall * 100.0, describe(state, &s.sequence));
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
    fn tenths_are_those_of_all_frames() {
        let lines = Lines::new(Vec::new());
        for frame in 0..20 {
            lines.frame(frame, 20);
            lines.start(None);
            lines.update(&ProgressState { fraction: 0.5, samples_per_pixel: 2.0, error: None });
            lines.update(&ProgressState { fraction: 1.0, samples_per_pixel: 4.0, error: None });
        }
        let text = String::from_utf8(lines.state.into_inner().expect("unpoisoned").out).expect("text");
        assert_eq!(text, " 10 %: frame 2 of 20, 4 spp\n100 %: frame 20 of 20, 4 spp\n");
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
