//! Which of a frame's samples a render takes: all, or a part of them that others take the rest of.
//!
//! The samples of a pixel are numbered, and their random numbers follow from their numbers. So renders of disjoint ranges take different samples, and points of one
//! sequence still: together they are spread over pixel and lens as the samples of a single render are, and over lights too where nothing is learned.

use std::ops::Range;

use super::Budget;
use super::course::MAX_SAMPLES;

/// A part of a frame's samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Share {
    /// All of them.
    #[default]
    Whole,
    /// Those of these numbers, of which there must be some.
    Samples(Range<u32>),
    /// Part `number`, counted from 1, of so many that are as large as each other, but for one sample.
    Part {
        /// Which.
        number: u32,
        /// Of how many.
        of: u32,
    },
}

/// A part that has no samples: there are more parts than samples a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("part {number} of {of} has no sample: a pixel has {samples}, so there can be {samples} parts at most")]
pub struct EmptyShare {
    number: u32,
    of: u32,
    samples: u32,
}

impl Share {
    /// The number of the first sample, and how long to go on from there, of a render that as a whole has this `budget` in a scene that asks for `scene_spp` samples a pixel.
    /// The parts of a render of some time take that long each; their samples begin far from each other.
    ///
    /// # Errors
    /// A part without samples.
    pub fn of(&self, budget: Budget, scene_spp: u32) -> Result<(u32, Budget), EmptyShare> {
        let budget = if budget == Budget::Scene { Budget::Samples(scene_spp) } else { budget };
        match *self {
            Self::Whole => Ok((0, budget)),
            Self::Samples(Range { start, end }) => Ok((start, Budget::Samples(end - start))),
            Self::Part { number, of } => {
                let part = |samples: u32, number| (u64::from(samples) * u64::from(number) / u64::from(of)) as u32;
                let Budget::Samples(samples) = budget else { return Ok((part(MAX_SAMPLES, number - 1), budget)) };
                let [first, end] = [number - 1, number].map(|number| part(samples, number));
                if first == end {
                    return Err(EmptyShare { number, of, samples });
                }
                Ok((first, Budget::Samples(end - first)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn parts_are_disjoint_and_leave_nothing_out() {
        for (samples, parts) in [(64, 8), (100, 7), (5, 5), (1, 1), (u32::MAX >> 1, 4096)] {
            let mut next = 0;
            for number in 1..=parts {
                let share = Share::Part { number, of: parts };
                let (first, budget) = share.of(Budget::Scene, samples).expect("there are enough samples");
                assert_eq!(first, next, "part {number} of {parts}");
                let Budget::Samples(count) = budget else { panic!("a number of samples") };
                assert!(count.abs_diff(samples / parts) <= 1);
                next += count;
            }
            assert_eq!(next, samples);
        }
        let none = Share::Part { number: 1, of: 3 }.of(Budget::Samples(2), 64);
        assert_eq!(none, Err(EmptyShare { number: 1, of: 3, samples: 2 }));
    }

    #[test]
    fn timed_parts_begin_far_from_each_other() {
        let time = Budget::Time(Duration::from_secs(5));
        let starts: Vec<u32> = (1..=4)
            .map(|number| {
                let (first, budget) = Share::Part { number, of: 4 }.of(time, 64).expect("time is no number");
                assert_eq!(budget, time);
                first
            })
            .collect();
        assert_eq!(starts, [0, 1 << 22, 1 << 23, 3 << 22]);
    }
}
