//! Nearest neighbours among candidates or points, by a k-d tree (crate `kiddo`) in unit space.

use std::num::NonZero;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::order::UnitSpace;

/// A neighbour and its distance in render space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Which one.
    pub index: u32,
    /// How far away.
    pub distance: f32,
}

/// A k-d tree over a list of points.
pub struct NeighbourSearch {
    tree: ImmutableKdTree<f32, 3>,
    points: Vec<[f32; 3]>,
    extent: f32,
}

impl NeighbourSearch {
    /// A tree over `points`, which are finite and fewer than 2³².
    pub fn new(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let space = UnitSpace::around(points.clone());
        let points: Vec<[f32; 3]> = points.map(|p| space.to_unit(p).to_array()).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).expect("fewer than 2^32 points");
        Self { tree, points, extent: space.extent }
    }

    /// The up to `count` points nearest to point `index`, itself left out, sorted by distance and then by number.
    pub fn of(&self, index: u32, count: usize) -> Vec<Neighbour> {
        // One more: the point itself is among them, unless enough others lie in the same place.
        let most = NonZero::new(count + 1).expect("above 0");
        let found = self.tree.query(&self.points[index as usize]).nearest_n::<SquaredEuclidean<f32>>(most).execute();
        let mut neighbours: Vec<Neighbour> = found
            .into_iter()
            .filter(|item| item.item != index)
            .map(|item| Neighbour { index: item.item, distance: item.distance.sqrt() * self.extent })
            .collect();
        neighbours.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
        neighbours.truncate(count);
        neighbours
    }

    /// The point nearest to `p` of unit space.
    pub fn nearest(&self, p: Vec3) -> u32 {
        self.tree.query(&p.to_array()).nearest_one::<SquaredEuclidean<f32>>().execute().item
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::Stream;

    #[test]
    fn neighbours_are_the_nearest() {
        let mut stream = Stream::from_seed(1);
        let mut points: Vec<Vec3> =
            (0..500).map(|_| Vec3::from([(); 3].map(|()| stream.next_f32())) * 1e9 - Vec3::splat(3e8)).collect();
        // Many in one place.
        points.extend([points[7]; 100]);
        let search = NeighbourSearch::new(points.iter().copied());
        for index in [0, 7, 250, 550] {
            let found = search.of(index, 20);
            assert_eq!(found.len(), 20);
            assert!(found.iter().all(|n| n.index != index));
            let mut distances: Vec<f32> = points.iter().map(|p| p.distance(points[index as usize])).collect();
            distances.sort_by(f32::total_cmp);
            for (n, expected) in found.iter().zip(&distances[1..]) {
                assert!((n.distance - expected).abs() <= 1e-5 * 1e9, "{} {expected}", n.distance);
            }
        }
        assert_eq!(NeighbourSearch::new([Vec3::ONE].into_iter()).of(0, 20), []);
    }
}
