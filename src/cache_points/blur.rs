//! Blur over neighbouring points: what makes a single nearest point safe to use. Source: Li et al. 2024, section 3.1.5 (far lights) and
//! section 3.2 (visibility).

use glam::Vec3;
use rayon::prelude::*;

use super::hierarchy::{Cluster, Hierarchy};
use super::neighbours::{Neighbour, NeighbourSearch};
use super::table::{Energies, List, Sensors, Table, pack, unpack};
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
        let (own_fluence, own_shares) = table.energies(point);
        let mut sums: Vec<Sensors> = (0..own.len()).map(|k| unpack(k, own_fluence, own_shares)).collect();
        let mut weights = vec![1.0; own.len()];
        for &(neighbour, weight) in blur.of(point) {
            let (other_fluence, other_shares) = table.energies(neighbour);
            let near = table.near(neighbour);
            // Parts of one entry count once together.
            let mut last = None;
            for_each_overlap(own, table.list(neighbour), |(i, a), (j, b)| {
                if near.binary_search(&(j as u16)).is_ok() {
                    return;
                }
                let share = if a.holds(&b) { 1.0 } else { share(hierarchy, lights, &a, &b) };
                let theirs = unpack(j, other_fluence, other_shares);
                sums[i].iter_mut().zip(theirs).for_each(|(sum, energy)| *sum += weight * share * energy);
                if last.replace(i) != Some(i) {
                    weights[i] += weight;
                }
            });
        }
        for (k, (sensors, weight)) in sums.iter_mut().zip(weights).enumerate() {
            sensors.iter_mut().for_each(|energy| *energy = (*energy / weight).min(f32::MAX));
            pack(sensors, k, fluence, shares);
        }
    });
    out
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
        let hierarchy = Hierarchy::new(&lights);
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
