//! Which light a number stands for: its type, and its place in the array of that type.
//!
//! Lights of one type mostly come in long runs. While there are few runs only those are kept, so that millions of lights need no table from
//! which every look at one of them would have to wait for memory.

use prefetch_index::prefetch_index;

/// The types of lights that are not shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    Point,
    Spot,
    Goniometric,
    Distant,
    Infinite,
    Volume,
    Moving,
}

impl Kind {
    /// By their numbers; the last one once more, so that 3 bits tell one.
    const ALL: [Self; 8] = [
        Self::Point,
        Self::Spot,
        Self::Goniometric,
        Self::Distant,
        Self::Infinite,
        Self::Volume,
        Self::Moving,
        Self::Moving,
    ];
    const COUNT: usize = 7;
}

/// More runs than these are searched no faster than a table is looked up in.
const MOST_RUNS: usize = 8;

/// Lights of one type, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    /// The first one's number.
    first: u32,
    kind: Kind,
    /// Its place in the array of its type.
    index: u32,
}

/// The types and places of all lights, by number.
#[derive(Clone, Debug, Default)]
pub(super) struct Handles {
    len: usize,
    of_kind: [u32; Kind::COUNT],
    /// Used while `table` is empty.
    runs: Vec<Run>,
    table: Vec<Handle>,
}

/// A type (3 bits) and a place in its array (29 bits).
#[derive(Clone, Copy, Debug)]
struct Handle(u32);

impl Handle {
    const INDEX_BITS: u32 = 29;

    fn new((kind, index): (Kind, u32)) -> Self {
        Self((kind as u32) << Self::INDEX_BITS | index)
    }

    #[inline]
    fn get(self) -> (Kind, u32) {
        (Kind::ALL[(self.0 >> Self::INDEX_BITS) as usize], self.0 & ((1 << Self::INDEX_BITS) - 1))
    }
}

impl Handles {
    pub fn len(&self) -> usize {
        self.len
    }

    /// Adds a light that is the next in the array of its type.
    pub fn push(&mut self, kind: Kind) {
        let index = self.of_kind[kind as usize];
        self.of_kind[kind as usize] += 1;
        if !self.table.is_empty() {
            self.table.push(Handle::new((kind, index)));
        } else if self.runs.last().is_none_or(|run| run.kind != kind) {
            self.runs.push(Run { first: self.len as u32, kind, index });
            if self.runs.len() > MOST_RUNS {
                self.table = (0..=self.len).map(|light| Handle::new(self.in_runs(light))).collect();
                self.runs = vec![];
            }
        }
        self.len += 1;
    }

    /// The light with this number, below [`Handles::len`].
    #[inline]
    pub fn get(&self, light: usize) -> (Kind, usize) {
        let (kind, index) = if self.table.is_empty() { self.in_runs(light) } else { self.table[light].get() };
        (kind, index as usize)
    }

    #[inline]
    fn in_runs(&self, light: usize) -> (Kind, u32) {
        let light = light as u32;
        let later = self.runs.iter().skip(1).take_while(|run| run.first <= light).count();
        let run = &self.runs[later];
        (run.kind, run.index + (light - run.first))
    }

    /// Has fetched what [`Handles::get`] reads, if that may be far.
    #[inline]
    pub fn fetch(&self, light: usize) {
        prefetch_index(&self.table, light);
    }

    /// Gives back room that is not used.
    pub fn shrink_to_fit(&mut self) {
        self.table.shrink_to_fit();
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.runs.capacity() * size_of::<Run>() + self.table.capacity() * size_of::<Handle>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any sequence of types, short runs and long, has each light where a plain count puts it.
    #[test]
    fn runs_and_tables_say_the_same() {
        const KINDS: [Kind; 8] = Kind::ALL;
        for runs in 0..=3 * MOST_RUNS {
            let mut handles = Handles::default();
            let mut expected = vec![];
            let mut counts = [0; Kind::COUNT];
            for run in 0..runs {
                for _ in 0..1 + run * run % 7 {
                    let kind = KINDS[run * 5 % Kind::COUNT];
                    handles.push(kind);
                    expected.push((kind, counts[kind as usize]));
                    counts[kind as usize] += 1;
                }
            }
            assert_eq!(handles.len(), expected.len());
            assert_eq!(handles.table.is_empty(), runs <= MOST_RUNS, "{runs} runs");
            let got: Vec<_> = (0..handles.len()).map(|light| handles.get(light)).collect();
            assert_eq!(got, expected, "{runs} runs");
        }
    }
}
