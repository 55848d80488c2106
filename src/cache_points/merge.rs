//! Similarity merge: where lighting hardly changes, few points are enough. Source: Li et al. 2024, section 3.1.4.
//!
//! The paper lets every candidate mark all but the lowest within its radius. Where lighting is the same all over, a candidate that is
//! marked itself marks the next one, and long chains leave places far from any point. **Ours:** only candidates that survive mark
//! others, in order, so every candidate ends up within the radius of a point.

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::neighbours::{Neighbour, NeighbourSearch};
use super::seed::Candidate;
use crate::geometry::camera::PixelSpan;

/// Neighbours compared.
pub const NEIGHBOURS: usize = 20;
/// No radius becomes smaller than this share of the first guess.
const LEAST_SHARE: f32 = 0.25;
/// Nor smaller than so many pixels look at its place.
const LEAST_PIXELS: f32 = 3.0;

/// One light, or a cluster of lights, in a signature: its place in the hierarchy and its share of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// The first place of the cluster and how many there are.
    pub places: [u32; 2],
    /// Of 1.
    pub share: f32,
}

/// Entries of a signature at most.
pub const SIGNATURE: usize = 24;

/// The lights of a candidate, in order of places; the shares add up to 1.
pub type Signature = ArrayVec<Share, SIGNATURE>;

/// How alike two light sets are: 1 for the same, 0 for nothing in common.
///
/// M = 2 Σ_{e ∈ A∩B} S(e) / (|A| + |B|), S(e) = 1 − |P_B − P_A| / (P_A + P_B).
pub fn similarity(a: &[Share], b: &[Share]) -> f32 {
    if a.is_empty() && b.is_empty() {
        return 1.0;
    }
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while let (Some(p), Some(q)) = (a.get(i), b.get(j)) {
        if p.places == q.places {
            let both = p.share + q.share;
            sum += if both > 0.0 { 1.0 - (q.share - p.share).abs() / both } else { 1.0 };
        }
        i += usize::from(p.places <= q.places);
        j += usize::from(q.places <= p.places);
    }
    2.0 * sum / (a.len() + b.len()) as f32
}

/// What decides about merging besides the lights.
#[derive(Clone, Copy, Debug)]
pub struct MergeSettings {
    /// What one pixel spans; the camera is at the origin.
    pub pixel: PixelSpan,
    /// **Ours:** points on surfaces that face different ways are less alike (the paper's section 6: "merging ignores the surface normal").
    pub normals: bool,
}

/// The first guess of a radius: the mean distance to the neighbours. 0 where there are none.
pub fn mean_distance(neighbours: &[Neighbour]) -> f32 {
    let sum: f32 = neighbours.iter().map(|n| n.distance).sum();
    sum / neighbours.len().max(1) as f32
}

/// Merges candidates whose lights are alike. Returns the radii of those that are left, in order.
pub fn merge_similar(candidates: &mut Vec<Candidate>, signatures: &[Signature], settings: MergeSettings) -> Vec<f32> {
    let search = NeighbourSearch::new(candidates.iter().map(|c| c.p));
    let reach: Vec<(f32, ArrayVec<u32, NEIGHBOURS>)> = (0..candidates.len() as u32)
        .into_par_iter()
        .map(|index| {
            let neighbours = search.of(index, NEIGHBOURS);
            let first = mean_distance(&neighbours);
            let own = &candidates[index as usize];
            let alike = |n: &Neighbour| {
                let lights = similarity(&signatures[index as usize], &signatures[n.index as usize]);
                if settings.normals { lights * facing(own.normal, candidates[n.index as usize].normal) } else { lights }
            };
            let mean = neighbours.iter().map(alike).sum::<f32>() / neighbours.len().max(1) as f32;
            let PixelSpan { width, angle } = settings.pixel;
            let pixels = LEAST_PIXELS * width + LEAST_PIXELS * angle * own.p.length();
            let radius = (first * mean).max(LEAST_SHARE * first).max(pixels);
            // With normals, what faces away is never merged away.
            let within = neighbours.iter().filter(|n| {
                let faces = !settings.normals || facing(own.normal, candidates[n.index as usize].normal) > 0.0;
                n.distance <= radius && faces
            });
            (radius, within.map(|n| n.index).collect())
        })
        .collect();
    let mut survives = vec![true; candidates.len()];
    for index in 0..candidates.len() {
        if survives[index] {
            reach[index].1.iter().filter(|&&n| n as usize > index).for_each(|&n| survives[n as usize] = false);
        }
    }
    let mut marks = survives.iter();
    candidates.retain(|_| marks.next().is_some_and(|&survives| survives));
    reach.iter().zip(&survives).filter(|(_, survives)| **survives).map(|((radius, _), _)| *radius).collect()
}

/// How much two sides agree: 1 for the same or where one has none, 0 from a right angle on.
fn facing(a: Vec3, b: Vec3) -> f32 {
    if a == Vec3::ZERO || b == Vec3::ZERO { 1.0 } else { a.dot(b).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(shares: &[(u32, f32)]) -> Vec<Share> {
        shares.iter().map(|&(place, share)| Share { places: [place, 1], share }).collect()
    }

    #[test]
    fn similarity_is_that_of_the_paper() {
        let a = list(&[(1, 0.5), (4, 0.25), (9, 0.25)]);
        assert_eq!(similarity(&a, &a), 1.0);
        assert_eq!(similarity(&a, &list(&[(2, 1.0)])), 0.0);
        // One in common, 0.5 against 1: S = 1 − 0.5 / 1.5.
        let b = list(&[(1, 1.0)]);
        assert!((similarity(&a, &b) - 2.0 * (2.0 / 3.0) / 4.0).abs() < 1e-6);
        assert_eq!(similarity(&[], &[]), 1.0);
        assert_eq!(similarity(&[], &b), 0.0);
    }

    /// A row of places, each lit by a light of its own if `mixed`, else all by one.
    fn row(count: u32, mixed: bool) -> (Vec<Candidate>, Vec<Signature>) {
        let row = (0..count).map(|i| Candidate::in_space(Vec3::new(1.0 + i as f32, 0.0, 0.0))).collect();
        let light = |i: u32| if mixed { i } else { 0 };
        let signature = |i| Signature::from_iter([Share { places: [light(i), 1], share: 1.0 }]);
        (row, (0..count).map(signature).collect())
    }

    #[test]
    fn alike_merges_unlike_stays() {
        let settings = MergeSettings { pixel: PixelSpan { width: 0.0, angle: 0.0 }, normals: false };
        let (mut alike, signatures) = row(200, false);
        let radii = merge_similar(&mut alike, &signatures, settings);
        assert!(alike.len() < 50 && radii.len() == alike.len(), "{}", alike.len());
        assert!(alike.windows(2).all(|pair| pair[1].p.x - pair[0].p.x <= 11.0), "no place is far from all points");
        // 10 neighbours on either side are 5.5 away on average.
        assert!((radii[radii.len() / 2] - 5.5).abs() < 1e-3, "{radii:?}");
        let (mut unlike, signatures) = row(200, true);
        merge_similar(&mut unlike, &signatures, settings);
        assert!(unlike.len() > alike.len());
    }

    #[test]
    fn what_is_smaller_than_pixels_merges() {
        let settings = MergeSettings { pixel: PixelSpan { width: 0.0, angle: 0.1 }, normals: false };
        let (mut unlike, signatures) = row(200, true);
        let radii = merge_similar(&mut unlike, &signatures, settings);
        assert!(radii.iter().zip(&unlike).all(|(&radius, c)| radius >= 0.3 * c.p.x));
    }
}
