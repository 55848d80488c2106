//! Blur over neighbouring points: what makes a single nearest point safe to use. Source: Li et al. 2024, section 3.1.5 (far lights) and
//! section 3.2 (visibility).

use glam::Vec3;
use rayon::prelude::*;

use super::hierarchy::{Cluster, Hierarchy};
use super::neighbours::{Neighbour, NeighbourSearch};
use super::table::BINS;

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

/// Pairs of entries of which one holds the other, both lists in order: calls `pair` with their places.
pub fn for_each_overlap(own: &[Cluster], other: &[Cluster], mut pair: impl FnMut(usize, usize)) {
    let (mut i, mut j) = (0, 0);
    while i < own.len() && j < other.len() {
        if own[i].key <= other[j].last() && other[j].key <= own[i].last() {
            pair(i, j);
        }
        // The one that ends first cannot meet anything more.
        if own[i].last() <= other[j].last() { i += 1 } else { j += 1 }
    }
}

/// Adds `weight` times the energies of a neighbour's entries to those of `own`. An entry that is part of one of `own` goes there; one that
/// holds several of `own` is shared out by their strengths. What `own` does not hold (it is near there) is left out.
pub fn add_energy(
    hierarchy: &Hierarchy,
    own: &[Cluster],
    sums: &mut [[f32; BINS]],
    (other, energy): (&[Cluster], &[[f32; BINS]]),
    weight: f32,
) {
    for_each_overlap(own, other, |i, j| {
        let share = if own[i].holds(&other[j]) {
            1.0
        } else {
            let whole = hierarchy.strength(&other[j]);
            if whole > 0.0 { (hierarchy.strength(&own[i]) / whole).min(1.0) } else { 0.0 }
        };
        for (sum, energy) in sums[i].iter_mut().zip(energy[j]) {
            *sum += weight * share * energy;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Lights, PointLight};
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
        // Eight lights: the root, its halves, and so on down.
        let mut lights = Lights::default();
        (0..8).for_each(|i| {
            lights.add_point(PointLight { p: Vec3::X * i as f32, intensity: Rgb::WHITE });
        });
        let hierarchy = Hierarchy::new(&lights);
        let halves = |c: &Cluster| hierarchy.children(c).expect("several lights");
        let [a, b] = halves(&hierarchy.roots().next().expect("a root"));
        let ([aa, ab], [ba, bb]) = (halves(&a), halves(&b));
        let [baa, bab] = halves(&ba);
        let own = [a, baa, bab, bb];
        let other = [aa, ab, ba];
        let mut found = vec![];
        for_each_overlap(&own, &other, |i, j| found.push((i, j)));
        assert_eq!(found, [(0, 0), (0, 1), (1, 2), (2, 2)]);
    }
}
