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
    /// The first samples, which teach those that go into so many parts; see [`lesson`].
    Lesson {
        /// How many parts.
        of: u32,
    },
    /// Part `number`, counted from 1, of so many that are as large as each other, but for one sample. Samples that taught it are in none of them.
    Part {
        /// Which.
        number: u32,
        /// Of how many.
        of: u32,
    },
}

/// How many of a pixel's samples are a lesson for the others, in a frame of so many pixels: 1 in 16, but 32 at most, as long as that is [`PATHS`]. The farm waits meanwhile, and the
/// parts may be many. In small images it is more, up to 1 in 8.
fn lesson(samples: u32, pixels: usize) -> u32 {
    let enough = u32::try_from(PATHS.div_ceil(pixels.max(1))).unwrap_or(u32::MAX);
    enough.min(samples.div_ceil(8)).max(samples.div_ceil(16).min(32))
}

/// A lesson of so many paths teaches all that matters: in `house`, at 96 × 54 pixels, parts that went by one of 166,000 had 1.03 times the RMSE of a render that went on learning for 512
/// samples a pixel.
const PATHS: usize = 1 << 22;

/// The share of the time that a lesson takes where time is what counts.
const SHARE_OF_TIME: u32 = 16;

/// A part that has no samples: there are more parts than samples a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmptyShare {
    /// Nothing is left to it.
    #[error("part {number} of {of} has no sample: a pixel has {samples}, so there can be {samples} parts at most")]
    Part {
        /// Which.
        number: u32,
        /// Of how many.
        of: u32,
        /// What they share.
        samples: u32,
    },
    /// The lesson would leave too few.
    #[error("a pixel has {samples} samples: with a lesson there can be {} parts at most, {samples} without (farm --no-lesson)", samples.saturating_sub(1))]
    Lesson {
        /// All that there are.
        samples: u32,
    },
}

impl Share {
    /// The number of the first sample, and how long to go on from there, of a render that as a whole has this `budget` in a scene that asks for `scene_spp` samples a pixel.
    /// The parts of a render of some time take that long each; their samples begin far from each other. A frame has so many `pixels`, and its first `taught` samples are those that taught what the render begins with.
    ///
    /// # Errors
    /// A part without samples.
    pub fn of(&self, budget: Budget, scene_spp: u32, pixels: usize, taught: u32) -> Result<(u32, Budget), EmptyShare> {
        let budget = if budget == Budget::Scene { Budget::Samples(scene_spp) } else { budget };
        match *self {
            Self::Whole => Ok((0, budget)),
            Self::Samples(Range { start, end }) => Ok((start, Budget::Samples(end - start))),
            Self::Lesson { of } => match budget {
                Budget::Samples(samples) => match lesson(samples, pixels).min(samples.saturating_sub(of)) {
                    0 => Err(EmptyShare::Lesson { samples }),
                    own => Ok((0, Budget::Samples(own))),
                },
                Budget::Time(time) => Ok((0, Budget::Time(time / SHARE_OF_TIME))),
                other => Ok((0, other)),
            },
            Self::Part { number, of } => {
                let part = |samples: u32, number| {
                    let samples = u64::from(samples.saturating_sub(taught));
                    taught + (samples * u64::from(number) / u64::from(of)) as u32
                };
                let Budget::Samples(samples) = budget else {
                    let first = part(MAX_SAMPLES, number - 1);
                    let none = EmptyShare::Part { number, of, samples: MAX_SAMPLES - taught.min(MAX_SAMPLES) };
                    return if taught < MAX_SAMPLES - of { Ok((first, budget)) } else { Err(none) };
                };
                let [first, end] = [number - 1, number].map(|number| part(samples, number));
                if first == end {
                    return Err(EmptyShare::Part { number, of, samples: samples.saturating_sub(taught) });
                }
                Ok((first, Budget::Samples(end - first)))
            }
        }
    }

    /// Which part of how many it is, for the image's header; the lesson is part 0.
    pub fn part(&self) -> Option<[u32; 2]> {
        match *self {
            Self::Whole | Self::Samples(_) => None,
            Self::Lesson { of } => Some([0, of]),
            Self::Part { number, of } => Some([number, of]),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn parts_are_disjoint_and_leave_nothing_out() {
        let all = [(64, 8), (100, 7), (5, 5), (1, 1), (u32::MAX >> 1, 4096)];
        let is_taught = |samples, parts| [false, true].into_iter().filter(move |taught| !taught || samples > parts);
        for (samples, parts, is_taught) in all.iter().flat_map(|&(s, p)| is_taught(s, p).map(move |t| (s, p, t))) {
            let mut next = 0;
            if is_taught {
                let (first, budget) =
                    Share::Lesson { of: parts }.of(Budget::Samples(samples), 1, 1 << 21, 0).expect("there are samples");
                let Budget::Samples(count) = budget else { panic!("a number of samples") };
                assert!(first == 0 && count == lesson(samples, 1 << 21));
                next = count;
            }
            let taught = next;
            for number in 1..=parts {
                let share = Share::Part { number, of: parts };
                let (first, budget) = share.of(Budget::Scene, samples, 9, taught).expect("there are enough samples");
                assert_eq!(first, next, "part {number} of {parts}");
                let Budget::Samples(count) = budget else { panic!("a number of samples") };
                assert!(count.abs_diff((samples - taught) / parts) <= 1);
                next += count;
            }
            assert_eq!(next, samples);
        }
        let none = |share: Share, taught| {
            let error = share.of(Budget::Samples(2), 64, 9, taught).expect_err("no sample");
            error.to_string()
        };
        let first = Share::Part { number: 1, of: 3 };
        let said =
            |left| format!("part 1 of 3 has no sample: a pixel has {left}, so there can be {left} parts at most");
        assert_eq!([0, 1, 64].map(|taught| none(first.clone(), taught)), [2, 1, 0].map(said));
        let said = "a pixel has 2 samples: with a lesson there can be 1 parts at most, 2 without (farm --no-lesson)";
        assert_eq!(none(Share::Lesson { of: 2 }, 0), said);
        // It makes room where it can.
        assert_eq!(Share::Lesson { of: 60 }.of(Budget::Samples(64), 1, 9, 0), Ok((0, Budget::Samples(4))));
    }

    #[test]
    fn lessons_are_long_enough_and_no_longer() {
        const HD: usize = 1920 * 1080;
        let of = [(1, HD), (16, HD), (128, HD), (1 << 20, HD), (64, 96 * 54), (512, 96 * 54), (1 << 20, 96 * 54)];
        assert_eq!(of.map(|(samples, pixels)| lesson(samples, pixels)), [1, 2, 8, 32, 8, 64, 810]);
    }

    #[test]
    fn timed_parts_begin_far_from_each_other() {
        let time = Budget::Time(Duration::from_secs(5));
        let starts: Vec<u32> = (1..=4)
            .map(|number| {
                let (first, budget) = Share::Part { number, of: 4 }.of(time, 64, 9, 0).expect("time is no number");
                assert_eq!(budget, time);
                first
            })
            .collect();
        assert_eq!(starts, [0, 1 << 22, 1 << 23, 3 << 22]);
        let lesson = Share::Lesson { of: 4 }.of(time, 64, 9, 0);
        assert_eq!(lesson, Ok((0, Budget::Time(Duration::from_secs(5) / 16))));
        let of_all = Share::Part { number: 1, of: 4 }.of(time, 64, 9, MAX_SAMPLES);
        assert!(of_all.is_err(), "samples that are never taken cannot be shared");
        let (first, _) = Share::Part { number: 1, of: 4 }.of(time, 64, 9, 9).expect("time is no number");
        assert_eq!(first, 9);
    }
}
