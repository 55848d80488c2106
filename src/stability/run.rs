//! Runs a case in threads of its own, with a limit of time: a hang is a verdict, and so is a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde::Serialize;
use tempfile::TempDir;

use super::case::{Case, Rendered, Row, Stop, Trial};

/// How cases are run.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Threads that render; 0 for one per processor.
    pub threads: usize,
    /// Time for a case.
    pub time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self { threads: 0, time: Duration::from_secs(120) }
    }
}

/// How long a case that is out of time may take to notice.
const GRACE: Duration = Duration::from_secs(3);

/// What became of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// All is well.
    Pass,
    /// It is not.
    Fail,
    /// It is not, as is known.
    Known,
    /// It needs what is not there.
    Skipped,
}

impl Verdict {
    /// As people read it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "FAIL",
            Self::Known => "known",
            Self::Skipped => "skipped",
        }
    }
}

/// A case that has been run.
#[derive(Debug, Serialize)]
pub struct CaseReport {
    /// Its name.
    pub name: &'static str,
    /// Its group.
    pub group: &'static str,
    /// What it checks.
    pub checks: &'static str,
    /// What became of it.
    pub verdict: Verdict,
    /// Why, where the comparisons do not tell.
    pub reason: Option<String>,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Its comparisons.
    pub rows: Vec<Row>,
    /// What it has rendered.
    #[serde(skip)]
    pub rendered: Vec<Rendered>,
    /// Where the scenes are.
    #[serde(skip)]
    pub folder: Option<Arc<TempDir>>,
}

impl CaseReport {
    /// The comparison that came closest to failing, or failed most.
    pub fn worst(&self) -> Option<&Row> {
        self.rows.iter().max_by(|a, b| a.strain().total_cmp(&b.strain()))
    }
}

/// Runs a case.
pub fn run(case: &Case, limits: Limits) -> CaseReport {
    let start = Instant::now();
    let mut report = CaseReport {
        name: case.name,
        group: case.group(),
        checks: case.checks,
        verdict: Verdict::Fail,
        reason: None,
        seconds: 0.0,
        rows: vec![],
        rendered: vec![],
        folder: None,
    };
    let folder = match TempDir::new() {
        Ok(folder) => Arc::new(folder),
        Err(error) => {
            report.reason = Some(format!("no folder for temporary files: {error}"));
            return report;
        }
    };
    let interrupt = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let (run, threads) = (case.run, limits.threads);
    // If it hangs for good it keeps its folder and its threads until the process ends.
    let (its_folder, its_interrupt) = (folder.clone(), interrupt.clone());
    std::thread::spawn(move || {
        let mut trial = Trial {
            folder: PathBuf::from(its_folder.path()),
            interrupt: its_interrupt,
            rows: vec![],
            rendered: vec![],
        };
        let end = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
            // Whatever a panic leaves of the trial is only read.
            Ok(pool) => catch_unwind(AssertUnwindSafe(|| pool.install(|| run(&mut trial)))).unwrap_or_else(|panic| {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a message");
                Err(Stop::Failed(format!("it panicked: {text}")))
            }),
            Err(error) => Err(Stop::Failed(format!("cannot start threads: {error}"))),
        };
        // Nobody listens any more if it was given up.
        let _ = sender.send((end, trial.rows, trial.rendered));
        drop(its_folder);
    });
    let received = receiver.recv_timeout(limits.time).or_else(|error| match error {
        RecvTimeoutError::Timeout => {
            interrupt.store(true, Ordering::Relaxed);
            receiver.recv_timeout(GRACE).map(|(_, rows, rendered)| (Err(Stop::Interrupted), rows, rendered))
        }
        RecvTimeoutError::Disconnected => Err(error),
    });
    let (end, rows, rendered) = received.unwrap_or((Err(Stop::Interrupted), vec![], vec![]));
    let passes = rows.iter().all(|row| row.passes);
    (report.verdict, report.reason) = match end {
        Ok(()) if rows.is_empty() => (Verdict::Fail, Some("it compared nothing".to_owned())),
        Ok(()) if passes => (Verdict::Pass, None),
        Ok(()) => (Verdict::Fail, None),
        Err(Stop::Skipped(reason)) if passes => (Verdict::Skipped, Some(reason)),
        Err(Stop::Skipped(_)) => (Verdict::Fail, None),
        Err(Stop::Failed(reason)) => (Verdict::Fail, Some(reason)),
        Err(Stop::Interrupted) => {
            (Verdict::Fail, Some(format!("it was not done after {:.0} s", limits.time.as_secs_f64())))
        }
    };
    if let Some(known) = case.known {
        (report.verdict, report.reason) = match report.verdict {
            Verdict::Fail => (
                Verdict::Known,
                Some([Some(known), report.reason.as_deref()].into_iter().flatten().collect::<Vec<_>>().join("; ")),
            ),
            Verdict::Pass => (Verdict::Fail, Some(format!("it passes, though it is listed as known to fail: {known}"))),
            other => (other, report.reason),
        };
    }
    (report.rows, report.rendered, report.folder) = (rows, rendered, Some(folder));
    report.seconds = start.elapsed().as_secs_f64();
    report
}
