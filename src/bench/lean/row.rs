//! What was found of one system: what it costs a scene that does not need it.

use serde::Serialize;

use super::rounds::Trial;
use super::variant::Variant;
use crate::bench::estimate::Estimate;
use crate::bench::ratio::Ratio;
use crate::bench::run::Cost;

/// An idle system may cost so many times the processor time of a sample without it.
pub const LIMIT: f64 = 1.01;

/// What leaving a system out saves.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The system.
    pub system: &'static str,
    /// Why the scene leaves it out.
    pub reason: String,
    /// What makes the scene need it, in words.
    pub how: &'static str,
    /// Arguments of the render with it.
    pub arguments: Vec<String>,
    /// The file with it, beside the scene's; empty if arguments are enough.
    pub text: String,
    /// Whether the images with it and without it are alike to the last bit.
    pub is_same_image: bool,
    /// Processor seconds until the first sample and after the last one, with those of helping programs.
    pub start_seconds: Pair,
    /// Processor microseconds of a sample.
    pub sample_microseconds: Pair,
    /// How many times the processor time of a sample without it.
    pub sample_ratio: Ratio,
    /// Largest resident memory in bytes, without that of helping programs.
    pub peak_memory: Pair,
    /// What that comes to.
    pub verdict: Verdict,
    /// The costs without it and with it, round by round.
    pub rounds: Vec<[Cost; 2]>,
}

/// A number without and with a system, and by how much it is more with it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pair {
    /// Without.
    pub without: Estimate,
    /// With.
    pub with: Estimate,
    /// The difference, pair by pair.
    pub more: Estimate,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The system does something: what it costs is what leaving it out saves.
    InUse,
    /// Idle, it costs at most 1 % of a sample.
    Free,
    /// Idle, it costs more than 1 % of a sample.
    Costs,
    /// The interval has 1 % in it.
    Uncertain,
}

impl Verdict {
    /// Of a ratio of processor times.
    fn of(ratio: &Ratio, is_idle: bool) -> Self {
        match ratio {
            _ if !is_idle => Self::InUse,
            Ratio { high, .. } if *high <= LIMIT => Self::Free,
            Ratio { low, .. } if *low > LIMIT => Self::Costs,
            _ => Self::Uncertain,
        }
    }

    /// In words.
    pub const fn show(self) -> &'static str {
        match self {
            Self::InUse => "in use",
            Self::Free => "idle: at most 1 %",
            Self::Costs => "idle: more than 1 %",
            Self::Uncertain => "idle: too uncertain",
        }
    }
}

impl Row {
    /// Of these rounds, of so many samples each.
    pub fn of(variant: &Variant, trial: Trial, samples: f64) -> Self {
        let Trial { rounds, is_same_image } = trial;
        let sample_ratio = ratio_of(&rounds);
        // Helpers are told of to a hundredth of a second only.
        let all = |cost: &Cost| if variant.has_helper { cost.cpu_seconds_with_helpers } else { cost.cpu_seconds };
        Self {
            system: variant.system.name,
            reason: variant.reason.clone(),
            how: variant.system.how,
            arguments: variant.method.arguments.clone(),
            text: variant.text.clone(),
            is_same_image,
            start_seconds: Pair::of(&rounds, |cost| all(cost) - cost.cpu_seconds_rendering),
            sample_microseconds: Pair::of(&rounds, |cost| 1e6 * cost.cpu_seconds_rendering / samples),
            sample_ratio,
            peak_memory: Pair::of(&rounds, |cost| cost.peak_memory),
            verdict: Verdict::of(&sample_ratio, variant.is_idle),
            rounds,
        }
    }
}

impl Pair {
    fn of(rounds: &[[Cost; 2]], of: impl Fn(&Cost) -> f64) -> Self {
        let each = |of: &dyn Fn(&[Cost; 2]) -> f64| Estimate::of(&rounds.iter().map(of).collect::<Vec<_>>());
        Self {
            without: each(&|[without, _]| of(without)),
            with: each(&|[_, with]| of(with)),
            more: each(&|[without, with]| of(with) - of(without)),
        }
    }
}

/// How many times the processor time of rendering without it.
pub fn ratio_of(rounds: &[[Cost; 2]]) -> Ratio {
    Ratio::of(rounds.iter().map(|[without, with]| with.cpu_seconds_rendering / without.cpu_seconds_rendering))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_need_the_whole_interval() {
        let verdict = |low: f64, high: f64| Verdict::of(&Ratio { value: (low * high).sqrt(), low, high }, true);
        assert_eq!([verdict(0.99, 1.005), verdict(1.02, 1.3)], [Verdict::Free, Verdict::Costs]);
        assert_eq!([verdict(0.99, 1.02), verdict(f64::NAN, f64::NAN)], [Verdict::Uncertain; 2]);
        let used = Verdict::of(&Ratio { value: 2.0, low: 1.9, high: 2.1 }, false);
        assert_eq!(used, Verdict::InUse);
    }

    #[test]
    fn what_is_more_is_told_pair_by_pair() {
        let cost = |seconds| Cost {
            cpu_seconds_rendering: seconds,
            ..super::super::super::curve::tests::run(1, 1.0, 1.0).cost
        };
        let rounds = [[cost(1.0), cost(1.1)], [cost(2.0), cost(2.2)]];
        let ratio = ratio_of(&rounds);
        assert!((ratio.value - 1.1).abs() < 1e-12 && (ratio.high - 1.1).abs() < 1e-12, "{ratio:?}");
        let pair = Pair::of(&rounds, |cost| cost.cpu_seconds_rendering);
        assert!((pair.more.mean - 0.15).abs() < 1e-12 && pair.without.mean == 1.5, "{pair:?}");
    }
}
