//! What the points know: for each its near lights and its far lights, in arrays without pointers.
//!
//! Lists are in order of keys ([`super::hierarchy`]), so the entry that holds a light is found by one binary search.

use std::sync::atomic::{AtomicU32, Ordering};

use super::hierarchy::Cluster;

/// Sensors at a point: planes that face +x, −x, +y, −y, +z, −z, and one that receives from everywhere.
pub const BINS: usize = 7;
/// The sensor that receives from everywhere.
pub const OMNIDIRECTIONAL: usize = 6;

/// How often an entry was tried and how often its light arrived. Integers, so the order of threads does not matter.
#[derive(Debug, Default)]
pub struct Counter {
    attempts: AtomicU32,
    successes: AtomicU32,
}

impl Counter {
    /// One more.
    #[inline]
    pub fn record(&self, success: bool) {
        self.attempts.fetch_add(1, Ordering::Relaxed);
        if success {
            self.successes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Attempts and successes so far.
    pub fn get(&self) -> [u32; 2] {
        [self.attempts.load(Ordering::Relaxed), self.successes.load(Ordering::Relaxed)]
    }
}

/// The lights near to each point: evaluated at the vertex itself.
#[derive(Debug, Default)]
pub struct NearLights {
    /// Where each point's list starts, and where the last one ends.
    pub offsets: Vec<u32>,
    /// The lights, in order.
    pub clusters: Vec<Cluster>,
    /// What became of them.
    pub counters: Vec<Counter>,
    /// Learned visibility weights W.
    pub visibility: Vec<f32>,
}

/// The lights far from each point.
#[derive(Debug, Default)]
pub struct FarLights {
    /// Where each point's list starts, and where the last one ends.
    pub offsets: Vec<u32>,
    /// Lights and clusters, in order.
    pub clusters: Vec<Cluster>,
    /// What each sensor receives of them, unoccluded: irradiance of planes, fluence of the omnidirectional one.
    pub energy: Vec<[f32; BINS]>,
    /// What became of them.
    pub counters: Vec<Counter>,
    /// Learned visibility weights W.
    pub visibility: Vec<f32>,
    /// Running sums of energy × W for each sensor: [`BINS`] rows of a point's entries, at [`BINS`] times its offset.
    pub sums: Vec<f32>,
}

/// The entries of point `point`.
#[inline]
pub fn range(offsets: &[u32], point: u32) -> std::ops::Range<usize> {
    offsets[point as usize] as usize..offsets[point as usize + 1] as usize
}

impl NearLights {
    /// The place of the light of key `key` in the list of `point`.
    #[inline]
    pub fn find(&self, point: u32, key: u64) -> Option<usize> {
        let entries = range(&self.offsets, point);
        self.clusters[entries.clone()].binary_search_by_key(&key, |c| c.key).ok().map(|k| entries.start + k)
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.offsets)
            + size_of_val(&*self.clusters)
            + size_of_val(&*self.counters)
            + size_of_val(&*self.visibility)
    }
}

impl FarLights {
    /// The place of the entry that holds the light of key `key` in the list of `point`.
    #[inline]
    pub fn find(&self, point: u32, key: u64) -> Option<usize> {
        let entries = range(&self.offsets, point);
        let after = self.clusters[entries.clone()].partition_point(|c| c.key <= key);
        let place = entries.start + after.checked_sub(1)?;
        self.clusters[place].covers(key).then_some(place)
    }

    /// The running sums of `point` for one sensor.
    #[inline]
    pub fn sums_of(&self, point: u32, bin: usize) -> &[f32] {
        let entries = range(&self.offsets, point);
        let start = BINS * entries.start + bin * entries.len();
        &self.sums[start..start + entries.len()]
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.offsets)
            + size_of_val(&*self.clusters)
            + size_of_val(&*self.energy)
            + size_of_val(&*self.counters)
            + size_of_val(&*self.visibility)
            + size_of_val(&*self.sums)
    }
}

/// The list of each point, to be filled: `data` cut up at `offsets`, with `rows` numbers for each entry.
pub fn split_lists<'a, T>(mut data: &'a mut [T], offsets: &[u32], rows: usize) -> Vec<&'a mut [T]> {
    let split = |pair: &[u32]| {
        let (list, rest) = std::mem::take(&mut data).split_at_mut(rows * (pair[1] - pair[0]) as usize);
        data = rest;
        list
    };
    offsets.windows(2).map(split).collect()
}

/// Bytes that an entry of [`FarLights`] takes.
pub const FAR_ENTRY: usize = size_of::<Cluster>() + size_of::<Counter>() + (1 + 2 * BINS) * size_of::<f32>();
