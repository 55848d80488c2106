//! Blur over neighbouring points: what makes a single nearest point safe to use. Source: Li et al. 2024, section 3.1.5 (far lights) and
//! section 3.2 (visibility).

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::hierarchy::{Cluster, Hierarchy};
use super::neighbours::{Neighbour, NeighbourSearch};
use super::table::{BINS, Energies, List, OMNIDIRECTIONAL, PLANES, Sensors, Table, pack, unpack};
use crate::light::Lights;

/// Neighbours blurred over: the kissing number 12, and 4 because radii vary.
pub const NEIGHBOURS: usize = 16;

/// A neighbour's number and its weight, the point's own weight being 1.
pub type Weighted = (u32, f32);

/// The neighbours of every point, with weights.
#[derive(Debug)]
pub struct BlurWeights {
    /// Where each point's neighbours start; none has more than [`NEIGHBOURS`].
    offsets: Vec<u32>,
    neighbours: Vec<Weighted>,
}

impl BlurWeights {
    /// For `points`.
    pub fn new(points: &[Vec3]) -> Self {
        let search = NeighbourSearch::new(points.iter().copied());
        let lists: Vec<Vec<Weighted>> =
            (0..points.len() as u32).into_par_iter().map(|i| weights(&search.of(i, NEIGHBOURS))).collect();
        let mut offsets = vec![0];
        offsets.extend(lists.iter().scan(0, |sum, list| {
            *sum += list.len() as u32;
            Some(*sum)
        }));
        Self { offsets, neighbours: lists.concat() }
    }

    /// The neighbours of a point.
    pub fn of(&self, point: u32) -> &[Weighted] {
        &self.neighbours[self.offsets[point as usize] as usize..self.offsets[point as usize + 1] as usize]
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.offsets) + size_of_val(&*self.neighbours)
    }
}

/// 1 for the nearest, 1/16 for the farthest, mix(1, 1/16, d² / d_far²) between them.
fn weights(neighbours: &[Neighbour]) -> Vec<Weighted> {
    let farthest = neighbours.last().map_or(0.0, |n| n.distance);
    let weight = |(k, n): (usize, &Neighbour)| {
        let square = if farthest > 0.0 { (n.distance / farthest).powi(2) } else { 0.0 };
        (n.index, if k == 0 { 1.0 } else { 1.0 + (1.0 / 16.0 - 1.0) * square })
    };
    neighbours.iter().enumerate().map(weight).collect()
}

/// Pairs of entries of which one holds the other, both lists in order: calls `pair` with their numbers and clusters.
pub fn for_each_overlap(own: List, other: List, mut pair: impl FnMut((usize, Cluster), (usize, Cluster))) {
    let (mut i, mut j) = (0, 0);
    while i < own.len() && j < other.len() {
        let (a, b) = (own.get(i), other.get(j));
        if a.first < b.end() && b.first < a.end() {
            pair((i, a), (j, b));
        }
        // The one that ends first cannot meet anything more.
        if a.end() <= b.end() { i += 1 } else { j += 1 }
    }
}

/// What the sensors receive, averaged over each point and its neighbours (section 3.1.5), not in place. A neighbour's entry that is part of one
/// of the point's own goes there; one that holds several of them is shared out by their strengths.
/// What is near to the neighbour is left out: there it may be stronger than all else by any factor.
pub fn blurred(hierarchy: &Hierarchy, lights: &Lights, blur: &BlurWeights, table: &Table) -> Energies {
    let mut out = Energies::new(table.energies.fluence.len());
    out.split(&table.offsets).into_par_iter().enumerate().for_each(|(point, (fluence, shares))| {
        let point = point as u32;
        let own = table.list(point);
        let mut sums = Sums::new(own.len());
        sums.add((0, 0..own.len()), table.energies(point), 1.0);
        for &(neighbour, weight) in blur.of(point) {
            let (theirs, energies) = (table.list(neighbour), table.energies(neighbour));
            let mut near = table.near(neighbour);
            // Parts of one entry count once together.
            let mut last = None;
            let (mut i, mut j) = (0, 0);
            while i < own.len() && j < theirs.len() {
                // Far lights are mostly told apart in the same way all around.
                let passed = near.iter().take_while(|&&k| usize::from(k) < j).count();
                near = &near[passed..];
                let most = near.first().map_or(theirs.len(), |&k| usize::from(k)) - j;
                let same = own.same_from(i, &theirs, j, most);
                if same > 0 {
                    sums.add((i, j..j + same), energies, weight);
                    (i, j) = (i + same, j + same);
                    continue;
                }
                let (a, b) = (own.get(i), theirs.get(j));
                if most > 0 && a.first < b.end() && b.first < a.end() {
                    let share = if a.holds(&b) { 1.0 } else { share(hierarchy, lights, &a, &b) };
                    sums.add_one(i, unpack(j, energies.0, energies.1), weight * share);
                    if last.replace(i) != Some(i) {
                        sums.weights[i] += weight;
                    }
                }
                if a.end() <= b.end() { i += 1 } else { j += 1 }
            }
        }
        for k in 0..own.len() {
            pack(&sums.mean(k), k, fluence, shares);
        }
    });
    out
}

/// Weighted sums of what the sensors receive of a point's entries: a row for each sensor, so that the processor takes several entries at once.
struct Sums {
    rows: [Vec<f32>; BINS],
    weights: Vec<f32>,
}

impl Sums {
    fn new(count: usize) -> Self {
        Self { rows: std::array::from_fn(|_| vec![0.0; count]), weights: vec![0.0; count] }
    }

    /// Adds what another point, or the point itself, knows of as many entries, from its entry `j` on to those from `i` on.
    fn add(&mut self, (i, theirs): (usize, Range<usize>), (fluence, shares): (&[f32], &[u8]), weight: f32) {
        let (count, own) = (fluence.len(), i..i + theirs.len());
        let of = &fluence[theirs.clone()];
        for (row, sums) in self.rows[..PLANES].iter_mut().enumerate() {
            let shares = &shares[row * count..][theirs.clone()];
            for ((sum, energy), share) in sums[own.clone()].iter_mut().zip(of).zip(shares) {
                *sum += weight * (energy * (f32::from(*share) * (1.0 / 255.0)));
            }
        }
        self.rows[OMNIDIRECTIONAL][own.clone()].iter_mut().zip(of).for_each(|(sum, energy)| *sum += weight * energy);
        self.weights[own].iter_mut().for_each(|sum| *sum += weight);
    }

    /// Adds to entry `i` alone, but for its weight.
    fn add_one(&mut self, i: usize, sensors: Sensors, weight: f32) {
        self.rows.iter_mut().zip(sensors).for_each(|(sums, energy)| sums[i] += weight * energy);
    }

    fn mean(&self, i: usize) -> Sensors {
        std::array::from_fn(|row| (self.rows[row][i] / self.weights[i]).min(f32::MAX))
    }
}

/// The share of `whole` that is `part`.
pub fn share(hierarchy: &Hierarchy, lights: &Lights, part: &Cluster, whole: &Cluster) -> f32 {
    let all = hierarchy.strength(lights, whole);
    if all > 0.0 { (hierarchy.strength(lights, part) / all).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::gather::Gathered;
    use super::*;
    use crate::light::PointLight;
    use crate::math::Rgb;

    #[test]
    fn weights_fall_from_1_to_a_sixteenth() {
        let row = |k: u32| Neighbour { index: k, distance: 1.0 + k as f32 };
        let found = weights(&[row(0), row(1), row(2), row(3)]);
        assert_eq!((found[0], found[3]), ((0, 1.0), (3, 1.0 / 16.0)));
        assert!((found[1].1 - (1.0 - 15.0 / 16.0 * 0.25)).abs() < 1e-6);
        assert!(weights(&[]).is_empty());
        assert_eq!(weights(&[Neighbour { index: 3, distance: 0.0 }; 2]), [(3, 1.0), (3, 1.0)]);
    }

    #[test]
    fn overlaps_are_all_found() {
        // Eight lights: two leaves under a root.
        let mut lights = Lights::default();
        (0..8).for_each(|i| {
            lights.add_point(PointLight { p: Vec3::X * i as f32, intensity: Rgb::WHITE });
        });
        let hierarchy = Hierarchy::new(&lights, true);
        let [a, b] = [0..4, 4..8].map(|places| -> Vec<Cluster> {
            places.map(|place| hierarchy.leaf(place).expect("eight lights")).collect()
        });
        let root = hierarchy.roots().next().expect("lights");
        let gathered = |clusters| Gathered { clusters, near: vec![] };
        // All alone; four alone and the rest in one; all in one.
        let rest = Cluster { first: 4, count: 4, ..root };
        let lists = [[&a[..], &b].concat(), [&a[..], &[rest]].concat(), vec![root]].map(gathered);
        let table = Table::gathered(3, Some(hierarchy.places()), |point| (lists[point as usize].clone(), vec![]));
        let pairs = |own, other| {
            let mut found = vec![];
            for_each_overlap(table.list(own), table.list(other), |(i, _), (j, _)| found.push((i, j)));
            found
        };
        let paired: Vec<_> = (0..8).map(|i| (i, i.min(4))).collect();
        assert_eq!(pairs(0, 1), paired);
        assert_eq!(pairs(1, 0), paired.iter().map(|&(i, j)| (j, i)).collect::<Vec<_>>());
        assert_eq!(pairs(0, 2), (0..8).map(|i| (i, 0)).collect::<Vec<_>>());
    }
}
