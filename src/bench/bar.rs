//! What was set out to be reached, and whether it was.

use serde::Serialize;

use super::ratio::Ratio;
use super::table::Table;

/// Which side of a number is the good one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Bound {
    /// Not less than this.
    AtLeast(f64),
    /// Not more than this.
    AtMost(f64),
    /// Neither less than the first nor more than the second.
    Within(f64, f64),
}

/// A number that was set out to be reached.
#[derive(Clone, Debug, Serialize)]
pub struct Bar {
    /// Of what, and where.
    pub name: String,
    /// What it shall be.
    pub bound: Bound,
    /// What it is.
    pub measured: Ratio,
    /// The judgement in words.
    pub verdict: &'static str,
}

impl Bar {
    /// Judges what was measured: beyond doubt if the whole confidence interval lies on one side.
    pub fn new(name: String, bound: Bound, measured: Ratio) -> Self {
        let (is_met, is_certain) = match bound {
            Bound::AtLeast(least) => (measured.value >= least, measured.low >= least || measured.high < least),
            Bound::AtMost(most) => (measured.value <= most, measured.high <= most || measured.low > most),
            Bound::Within(least, most) => (
                measured.value >= least && measured.value <= most,
                measured.low >= least && measured.high <= most || measured.high < least || measured.low > most,
            ),
        };
        let verdict = match (is_met, is_certain) {
            _ if measured.value.is_nan() => "unknown: the reference is too noisy",
            (true, true) => "met",
            (true, false) => "met, but not beyond doubt",
            (false, true) => "not met",
            (false, false) => "not met, but not beyond doubt",
        };
        Self { name, bound, measured, verdict }
    }
}

/// All of them.
pub fn table(bars: &[Bar]) -> Table {
    let mut table = Table::new("bars", &["what", "bar", "measured", "verdict"]);
    table.notes.push("measured: geometric mean (of slopes the mean) and 95 % confidence interval".to_owned());
    table.rows.extend(bars.iter().map(|bar| {
        let bound = match bar.bound {
            Bound::AtLeast(least) => format!("≥ {least}"),
            Bound::AtMost(most) => format!("≤ {most}"),
            Bound::Within(least, most) => format!("{least} to {most}"),
        };
        vec![bar.name.clone(), bound, bar.measured.show(), bar.verdict.to_owned()]
    }));
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_tell_doubt() {
        let verdict = |bound, value, low, high| Bar::new(String::new(), bound, Ratio { value, low, high }).verdict;
        assert_eq!(verdict(Bound::AtLeast(2.0), 3.0, 2.5, 4.0), "met");
        assert_eq!(verdict(Bound::AtLeast(2.0), 3.0, 1.5, 4.0), "met, but not beyond doubt");
        assert_eq!(verdict(Bound::AtMost(2.0), 3.0, 1.5, 4.0), "not met, but not beyond doubt");
        assert_eq!(verdict(Bound::AtMost(2.0), 3.0, 2.5, 4.0), "not met");
        let within = Bound::Within(-0.55, -0.45);
        assert_eq!(verdict(within, -0.5, -0.54, -0.46), "met");
        assert_eq!(verdict(within, -0.5, -0.54, -0.4), "met, but not beyond doubt");
        assert_eq!(verdict(within, -0.44, -0.5, -0.4), "not met, but not beyond doubt");
        assert_eq!(verdict(within, -0.7, -0.8, -0.6), "not met");
        assert!(verdict(Bound::AtMost(2.0), f64::NAN, 2.5, 4.0).starts_with("unknown"));
    }
}
