//! What became of many runs, and one table of it by format, over all tests of this program. The table is written anew whenever a test adds to it:
//! `tests/run.sh` shows it at the end, since cargo shows nothing of tests that pass.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Mutex;
use std::time::Duration;

use super::Run;

/// The table's file.
const TABLE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/damaged-files.txt");

/// The rows so far, by format.
static ROWS: Mutex<BTreeMap<&'static str, Tally>> = Mutex::new(BTreeMap::new());

/// What became of many runs.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    runs: usize,
    refused: usize,
    /// Rendered with something in the place of a file, and told so.
    replaced: usize,
    crashed: usize,
    hung: usize,
    /// Of processor time.
    slowest: Duration,
    /// Bytes.
    largest: u64,
}

impl Tally {
    /// Counts a run that was given so much processor time. One that was ended for taking it hung.
    pub fn add(&mut self, run: &Run, allowed: Duration) {
        let hung = run.hung || run.code.is_none() && run.cpu >= allowed;
        self.runs += 1;
        self.refused += usize::from(matches!(run.code, Some(3 | 4)));
        self.replaced += usize::from(run.code == Some(0) && run.err.contains("cannot read"));
        self.crashed += usize::from(!matches!(run.code, Some(0 | 3 | 4)) && !hung);
        self.hung += usize::from(hung);
        self.slowest = self.slowest.max(run.cpu);
        self.largest = self.largest.max(run.memory);
    }

    fn join(&mut self, other: &Self) {
        self.runs += other.runs;
        self.refused += other.refused;
        self.replaced += other.replaced;
        self.crashed += other.crashed;
        self.hung += other.hung;
        self.slowest = self.slowest.max(other.slowest);
        self.largest = self.largest.max(other.largest);
    }

    fn row(&self, format: &str) -> String {
        let Self { runs, refused, replaced, crashed, hung, slowest, largest } = self;
        let (errors, seconds, mebibytes) = (refused + replaced, slowest.as_secs_f64(), largest >> 20);
        format!("{format:<10} {runs:>6} {errors:>7} {crashed:>8} {hung:>6} {seconds:>10.2} {mebibytes:>12}\n")
    }
}

/// In one line: runs, refused, crashed, hung, the slowest, the largest.
impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { runs, refused, replaced: _, crashed, hung, slowest, largest } = self;
        let (seconds, mebibytes) = (slowest.as_secs_f64(), largest >> 20);
        write!(f, "{runs:4} runs, {refused:4} refused, {crashed} crashed, {hung} hung, {seconds:.2} s, {mebibytes} MiB")
    }
}

/// Adds runs with files of a format to the table.
pub fn tell(format: &'static str, tally: &Tally) {
    let mut rows = ROWS.lock().expect("no test panics while it adds");
    rows.entry(format).or_default().join(tally);
    let mut text = "damaged       files  errors  crashes  hangs  slowest s  largest MiB\n".to_owned();
    let mut sum = Tally::default();
    for (format, tally) in rows.iter() {
        text += &tally.row(format);
        sum.join(tally);
    }
    text += &sum.row("sum");
    std::fs::write(TABLE, text).expect("the table can be written");
}
