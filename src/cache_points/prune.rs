//! Coincident candidates merge into one. Source: Li et al. 2024, section 3.1.2.
//!
//! The paper's radius is 1e-5 of its units; here it is a share of the candidates' box, so that a scene may be scaled.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::neighbours::NeighbourSearch;
use super::seed::Candidate;

/// Neighbours looked at.
pub const NEIGHBOURS: usize = 20;

/// Closer than this share of the candidates' box is one place.
const COINCIDENT: f32 = 1e-6;

/// Removes candidates that lie where one of lower index lies; returns how many. `candidates` are in spatial order.
pub fn prune_coincident(candidates: &mut Vec<Candidate>) -> usize {
    let before = candidates.len();
    // Thousands in the very same place would each see only twenty of the others.
    candidates.dedup_by_key(|c| c.p);
    let search = NeighbourSearch::new(candidates.iter().map(|c| c.p));
    let radius = COINCIDENT * super::order::UnitSpace::around(candidates.iter().map(|c| c.p)).extent;
    let losers: Vec<AtomicBool> = candidates.iter().map(|_| AtomicBool::new(false)).collect();
    (0..candidates.len() as u32).into_par_iter().for_each(|index| {
        let coincident = search.of(index, NEIGHBOURS).into_iter().take_while(|n| n.distance <= radius);
        keep_lowest(index, coincident.map(|n| n.index), &losers);
    });
    let mut marks = losers.iter();
    candidates.retain(|_| !marks.next().is_some_and(|mark| mark.load(Ordering::Relaxed)));
    before - candidates.len()
}

/// Of `index` and `others` the lowest survives; the rest are marked. Marks are only ever set, so their order does not matter.
fn keep_lowest(index: u32, others: impl Iterator<Item = u32> + Clone, losers: &[AtomicBool]) {
    let lowest = others.clone().fold(index, u32::min);
    for loser in others.chain([index]).filter(|&i| i != lowest) {
        losers[loser as usize].store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn one_of_each_place_is_left() {
        let at = |x: f32| Candidate { p: Vec3::new(x, 0.0, 0.0), normal: Vec3::ZERO };
        let mut list: Vec<Candidate> = [0.0, 0.0, 1e-9, 0.5, 0.5, 1.0].map(at).to_vec();
        assert_eq!(prune_coincident(&mut list), 3);
        assert_eq!(list.iter().map(|c| c.p.x).collect::<Vec<_>>(), [0.0, 0.5, 1.0]);
        let mut crowd = vec![at(2.0); 1000];
        crowd.push(at(3.0));
        assert_eq!(prune_coincident(&mut crowd), 999);
    }
}
