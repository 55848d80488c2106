//! How often lights were tried from a point and how often they arrived. Source: Li et al. 2024, section 3.2.

use std::sync::atomic::{AtomicU32, Ordering};

/// How often an entry was tried and how often its light arrived, in parts of a try ([`TRY`]). Integers, so the order of threads does not matter.
#[derive(Debug, Default)]
pub struct Counter {
    attempts: AtomicU32,
    successes: AtomicU32,
}

/// Parts of one try. An entry that is split passes on a few of them to each part.
const TRY: u32 = 16;

/// From so many tries on, both counts are halved between iterations, so that they never overflow.
const MANY_TRIES: u32 = 1 << 24;

impl Counter {
    /// After so many attempts and successes.
    pub fn new(counts: [f32; 2]) -> Self {
        let [attempts, successes] = counts.map(|n| AtomicU32::new((n * TRY as f32).round() as u32));
        Self { attempts, successes }
    }

    /// One more.
    #[inline]
    pub fn record(&self, success: bool) {
        self.attempts.fetch_add(TRY, Ordering::Relaxed);
        if success {
            self.successes.fetch_add(TRY, Ordering::Relaxed);
        }
    }

    /// Halves both counts where they are large.
    pub fn limit(&mut self) {
        if *self.attempts.get_mut() >= TRY * MANY_TRIES {
            *self.attempts.get_mut() /= 2;
            *self.successes.get_mut() /= 2;
        }
    }

    /// Whether there was any attempt.
    #[inline]
    pub fn is_tried(&self) -> bool {
        self.attempts.load(Ordering::Relaxed) > 0
    }

    /// Attempts and successes so far.
    pub fn get(&self) -> [f32; 2] {
        [&self.attempts, &self.successes].map(|n| n.load(Ordering::Relaxed) as f32 * (1.0 / TRY as f32))
    }
}

/// Lists of counters as bytes, for `#[serde(with = "plain")]`: most were never touched, and one by one they would take as long to write as an image.
pub mod plain {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{AtomicU32, Counter, Ordering};
    use crate::system::plain_bytes;

    /// Counters that are copied at a time.
    const BLOCK: usize = 1 << 14;

    #[derive(Serialize, Deserialize)]
    struct Block(#[serde(with = "plain_bytes")] Vec<[u32; 2]>);

    /// Writes the list block by block.
    ///
    /// # Errors
    /// What the serializer says.
    pub fn serialize<S: Serializer>(list: &[Counter], serializer: S) -> Result<S::Ok, S::Error> {
        let copy = |c: &Counter| [&c.attempts, &c.successes].map(|n| n.load(Ordering::Relaxed));
        serializer.collect_seq(list.chunks(BLOCK).map(|block| Block(block.iter().map(copy).collect())))
    }

    /// Reads such a list.
    ///
    /// # Errors
    /// What the deserializer says.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Counter>, D::Error> {
        let blocks = Vec::<Block>::deserialize(deserializer)?;
        let counter = |[attempts, successes]: [u32; 2]| Counter {
            attempts: AtomicU32::new(attempts),
            successes: AtomicU32::new(successes),
        };
        Ok(blocks.into_iter().flat_map(|block| block.0).map(counter).collect())
    }
}
