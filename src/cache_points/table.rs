//! What the points know: for each a list of lights and clusters, in arrays without pointers.
//!
//! A list is in order of places ([`super::hierarchy`]), so the entry that holds a light is found by one binary search. Near lights are entries
//! like the others, marked because they are evaluated at the vertex. What the sensors receive of an entry is kept as a fluence and, for
//! each plane, a share of it in 255ths, rounded up: selection needs no more, and probabilities follow from these very numbers. An
//! entry takes [`ENTRY`] bytes.

use std::ops::Range;

use rayon::prelude::*;

use super::counter::{self, Counter};
use super::gather::Gathered;
use super::hierarchy::{Cluster, Hierarchy};
use crate::system::plain_bytes;

/// Sensors at a point: planes that face +x, −x, +y, −y, +z, −z, and one that receives from everywhere.
pub const BINS: usize = 7;
/// The sensor that receives from everywhere.
pub const OMNIDIRECTIONAL: usize = 6;
/// The sensors that are planes.
pub const PLANES: usize = 6;

/// What each sensor receives: irradiance of planes, fluence of the omnidirectional one.
pub type Sensors = [f32; BINS];

/// An entry: a cluster less its number of lights, which follows from where the next entry begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Entry {
    first: u32,
    node: u32,
}

/// What the sensors of some entries receive.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Energies {
    /// Fluence of each entry, unoccluded. (With 8 significant bits, as bfloat16, errors and times are the same and `house` takes 0.95 times the memory at 960 × 540
    /// pixels, but lights of 1e-41 W have no fluence left, and an image is not the same at any brightness any more.)
    #[serde(with = "plain_bytes")]
    pub fluence: Vec<f32>,
    /// Irradiance of each plane in 255ths of the fluence: [`PLANES`] rows of a point's entries, at [`PLANES`] times its offset.
    #[serde(with = "plain_bytes")]
    pub shares: Vec<u8>,
}

/// The lists of all points.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Table {
    /// Where each point's list starts, and where the last one ends.
    #[serde(with = "plain_bytes")]
    pub offsets: Vec<u32>,
    #[serde(with = "plain_bytes")]
    entries: Vec<Entry>,
    /// One past the last place of all lights, where lists leave no light out; `None` where entries are single lights and others are left out.
    end: Option<u32>,
    /// What became of the entries.
    #[serde(with = "counter::plain")]
    pub counters: Vec<Counter>,
    /// Learned visibility weights W.
    #[serde(with = "plain_bytes")]
    pub visibility: Vec<f32>,
    /// What sensors receive of the entries.
    pub energies: Energies,
    #[serde(with = "plain_bytes")]
    near_offsets: Vec<u32>,
    #[serde(with = "plain_bytes")]
    near: Vec<u16>,
}

/// Lists are made for this many points at a time, so that what each takes while it is made does not add up.
const PIECE: usize = 2048;

/// Bytes that an entry takes.
pub const ENTRY: usize = size_of::<Entry>() + size_of::<Counter>() + 2 * size_of::<f32>() + PLANES * size_of::<u8>();

/// The entries of one point.
#[derive(Clone, Copy, Debug)]
pub struct List<'a> {
    entries: &'a [Entry],
    end: Option<u32>,
}

impl List<'_> {
    /// How many there are.
    #[inline]
    pub const fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Entry `k`.
    #[inline]
    pub fn get(&self, k: usize) -> Cluster {
        let Entry { first, node } = self.entries[k];
        let count = match self.end {
            Some(end) => self.entries.get(k + 1).map_or(end, |next| next.first) - first,
            None => 1,
        };
        Cluster { first, count, node }
    }

    /// How many entries from `i` on are those of `other` from `j` on, up to `most`, which the other list must have.
    #[inline]
    pub fn same_from(&self, i: usize, other: &List, j: usize, most: usize) -> usize {
        let pairs = self.entries[i..].iter().zip(&other.entries[j..j + most]);
        let mut same = pairs.take_while(|(a, b)| a == b).count();
        // An entry ends where the next one begins.
        if same > 0 && self.get(i + same - 1) != other.get(j + same - 1) {
            same -= 1;
        }
        same
    }

    /// All of them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Cluster> {
        (0..self.len()).map(|k| self.get(k))
    }

    /// The number of the first entry that begins at `place` or after it.
    pub fn from_place(&self, place: u32) -> usize {
        self.entries.partition_point(|entry| entry.first < place)
    }

    /// [`List::from_place`] where it is known to be one of `range` or its end.
    #[inline]
    pub fn from_place_within(&self, range: Range<usize>, place: u32) -> usize {
        range.start + self.entries[range].partition_point(|entry| entry.first < place)
    }

    /// The numbers of the entries that have places in `cluster`, where it holds them or one of them holds it, and none before `start` does. One after the
    /// other is looked at: for clusters in order that is quicker than to search for each.
    #[inline]
    pub fn overlapping_from(&self, start: usize, cluster: &Cluster) -> Range<usize> {
        let behind = |k: usize| self.get(k).end() <= cluster.first;
        let start = (start..self.len()).find(|&k| !behind(k)).unwrap_or(self.len());
        let ahead = |k: usize| self.entries[k].first >= cluster.end();
        start..(start..self.len()).find(|&k| ahead(k)).unwrap_or(self.len())
    }

    /// The number of the entry that holds `place`.
    #[inline]
    pub fn find(&self, place: u32) -> Option<usize> {
        let k = self.entries.partition_point(|entry| entry.first <= place).checked_sub(1)?;
        self.get(k).covers(place).then_some(k)
    }
}

/// The entries of point `point` in arrays with one number for each.
#[inline]
pub fn range(offsets: &[u32], point: u32) -> Range<usize> {
    offsets[point as usize] as usize..offsets[point as usize + 1] as usize
}

impl Table {
    /// How often entries were tried, all together.
    pub fn tries(&self) -> f64 {
        self.counters.iter().map(|counter| f64::from(counter.get()[0])).sum()
    }

    /// Whether its arrays belong together.
    pub fn is_whole(&self) -> bool {
        let entries = self.entries.len();
        let lists = |offsets: &[u32], end: usize| {
            offsets.is_sorted() && offsets.first() == Some(&0) && offsets.last() == Some(&(end as u32))
        };
        lists(&self.offsets, entries)
            && [self.counters.len(), self.visibility.len(), self.energies.fluence.len()] == [entries; 3]
            && self.energies.shares.len() == PLANES * entries
            && (self.near_offsets.is_empty() || lists(&self.near_offsets, self.near.len()))
    }

    /// Whether it is one of so many points and of these lights.
    pub fn is_of(&self, points: usize, hierarchy: &Hierarchy) -> bool {
        let is_weight = |weights: &[f32]| weights.iter().all(|w| w.is_finite() && *w >= 0.0);
        let fits = self.is_whole()
            && [self.offsets.len(), self.near_offsets.len()] == [points + 1; 2]
            && self.end.is_none_or(|end| end == hierarchy.places())
            && is_weight(&self.visibility)
            && is_weight(&self.energies.fluence);
        let spans = hierarchy.spans();
        let is_list = |point: u32| {
            let entries = &self.entries[range(&self.offsets, point)];
            let ends = entries.iter().skip(1).map(|entry| entry.first).chain(self.end);
            entries.len() <= usize::from(u16::MAX)
                && entries.is_sorted_by(|a, b| a.first < b.first)
                && entries.iter().zip(ends).all(|(entry, end)| entry.first < end)
                && (self.end.is_none() || entries.first().is_none_or(|entry| entry.first == 0))
                && self.list(point).iter().all(|cluster| hierarchy.has(&spans, &cluster))
                && self.near(point).iter().all(|&k| usize::from(k) < entries.len())
        };
        fits && (0..points as u32).all(is_list)
    }

    /// The lists of `count` points, each from `gather` for its number, with the counters that its entries begin with (missing ones at 0). `end` is
    /// one past the last place if no list leaves any out. No energies are known yet.
    pub fn gathered(count: usize, end: Option<u32>, gather: impl Fn(u32) -> (Gathered, Vec<Counter>) + Sync) -> Self {
        let mut table = Self { offsets: vec![0], end, near_offsets: vec![0], ..Self::default() };
        for start in (0..count).step_by(PIECE) {
            let piece = start as u32..(start + PIECE).min(count) as u32;
            let lists: Vec<_> = piece.into_par_iter().map(&gather).collect();
            lists.into_iter().for_each(|(gathered, counters)| table.push(&gathered, counters));
        }
        table
    }

    fn push(&mut self, gathered: &Gathered, counters: Vec<Counter>) {
        self.entries.extend(gathered.clusters.iter().map(|c| Entry { first: c.first, node: c.node }));
        self.offsets.push(self.entries.len() as u32);
        self.counters.extend(counters);
        self.counters.resize_with(self.entries.len(), Counter::default);
        self.visibility.resize(self.entries.len(), 1.0);
        self.near.extend_from_slice(&gathered.near);
        self.near_offsets.push(self.near.len() as u32);
    }

    /// The entries of `point`.
    #[inline]
    pub fn list(&self, point: u32) -> List<'_> {
        List { entries: &self.entries[range(&self.offsets, point)], end: self.end }
    }

    /// Which entries of `point` are near.
    #[inline]
    pub fn near(&self, point: u32) -> &[u16] {
        &self.near[range(&self.near_offsets, point)]
    }

    /// Fluences and shares of planes of the entries of `point`.
    #[inline]
    pub fn energies(&self, point: u32) -> (&[f32], &[u8]) {
        self.energies.of(range(&self.offsets, point))
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.offsets)
            + ENTRY * self.entries.len()
            + size_of_val(&*self.near_offsets)
            + size_of_val(&*self.near)
    }
}

impl Energies {
    /// For `count` entries, all 0.
    pub fn new(count: usize) -> Self {
        Self { fluence: vec![0.0; count], shares: vec![0; PLANES * count] }
    }

    /// Fluences and shares of a point's entries.
    #[inline]
    pub fn of(&self, entries: Range<usize>) -> (&[f32], &[u8]) {
        (&self.fluence[entries.clone()], &self.shares[PLANES * entries.start..PLANES * entries.end])
    }

    /// The lists of all points, to be filled.
    pub fn split(&mut self, offsets: &[u32]) -> Vec<(&mut [f32], &mut [u8])> {
        let fluence = split_lists(&mut self.fluence, offsets, 1);
        fluence.into_iter().zip(split_lists(&mut self.shares, offsets, PLANES)).collect()
    }
}

/// More than this is not kept of a fluence.
const MOST_FLUENCE: f32 = f32::MAX / 4.0;

/// Writes what the sensors receive of entry `k` of a point.
pub fn pack(sensors: &Sensors, k: usize, fluence: &mut [f32], shares: &mut [u8]) {
    let (planes, count) = (&sensors[..PLANES], fluence.len());
    let most = planes.iter().copied().fold(0.0, f32::max);
    let all = if sensors[OMNIDIRECTIONAL] > 0.0 { sensors[OMNIDIRECTIONAL] } else { most };
    for (row, &energy) in planes.iter().enumerate() {
        // At least 1 where there is anything.
        shares[row * count + k] = if energy > 0.0 { (energy / all * 255.0).clamp(1.0, 255.0).ceil() as u8 } else { 0 };
    }
    // So that what several sensors give together is finite.
    fluence[k] = all.min(MOST_FLUENCE);
}

/// What the sensors receive of entry `k`, as it was kept.
pub fn unpack(k: usize, fluence: &[f32], shares: &[u8]) -> Sensors {
    let count = fluence.len();
    std::array::from_fn(|bin| match bin {
        OMNIDIRECTIONAL => fluence[k],
        row => fluence[k] * (f32::from(shares[row * count + k]) * (1.0 / 255.0)),
    })
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::light::{LightId, Lights, PointLight};
    use crate::math::Rgb;
    use crate::math::sampler::Stream;

    /// A list that cuts the hierarchy at random; without some of its entries, where lists may leave lights out.
    fn list(hierarchy: &Hierarchy, stream: &mut Stream, leaves_out: bool) -> Vec<Cluster> {
        let mut clusters = vec![];
        let mut open: Vec<Cluster> = hierarchy.roots().collect();
        while let Some(cluster) = open.pop() {
            let children = hierarchy.children(&cluster);
            if children.is_empty() || (!leaves_out && stream.next_f32() < 0.2) {
                clusters.push(cluster);
            } else {
                open.extend(children);
            }
        }
        clusters.retain(|_| !leaves_out || stream.next_f32() < 0.5);
        clusters.sort_unstable_by_key(|cluster| cluster.first);
        clusters
    }

    #[test]
    fn entries_are_found_where_they_are() {
        let mut lights = Lights::default();
        let mut stream = Stream::from_seed(11);
        for _ in 0..100 {
            let p = Vec3::from([(); 3].map(|()| stream.next_f32()));
            lights.add_point(PointLight { p, intensity: Rgb::WHITE });
        }
        let hierarchy = Hierarchy::new(&lights, true);
        for round in 0..200 {
            let leaves_out = round % 2 == 1;
            let lists = [(); 2].map(|()| list(&hierarchy, &mut stream, leaves_out));
            let end = (!leaves_out).then(|| hierarchy.places());
            let gathered = |p: u32| (Gathered { clusters: lists[p as usize].clone(), near: vec![] }, vec![]);
            let table = Table::gathered(2, end, gathered);
            let own = table.list(0);
            let mut first = 0;
            for theirs in table.list(1).iter() {
                let meets = |k: &usize| {
                    let own = own.get(*k);
                    own.first < theirs.end() && theirs.first < own.end()
                };
                let expected: Vec<usize> = (0..own.len()).filter(meets).collect();
                let found = own.overlapping_from(first, &theirs);
                assert_eq!(found.clone().collect::<Vec<_>>(), expected, "{theirs:?}");
                first = found.start;
            }
            for id in lights.ids() {
                let place = hierarchy.place(&lights, LightId(id.0)).expect("it shines");
                let holds = (0..own.len()).find(|&k| own.get(k).covers(place));
                assert_eq!(own.find(place), holds);
                let range = own.from_place(place / 2)..own.len();
                assert_eq!(own.from_place_within(range, place), own.from_place(place));
            }
        }
    }
}
