//! The nearest point to any place, at render time. **Ours:** the paper asks its k-d tree (section 3.3); only ever one neighbour is wanted, so
//! here space is cut into octants until each holds the list of the few points that are nearest anywhere in it. A lookup is one way
//! down and a short scan. Far from all points, where it makes no difference, the point found may be up to twice as far as the nearest.

use glam::{Vec3, Vec3A, Vec4};
use rayon::prelude::*;

use super::order::UnitSpace;

/// A cell is divided while more points than this may be the nearest somewhere in it.
const MANY: usize = 64;
/// Of more than this, only those stay that are nearest somewhere on a grid over the cell.
const FEW: usize = 8;
/// Places of that grid along each axis.
const GRID: u32 = 4;
/// Cells are no smaller than the cube halved this often.
const DEEPEST: u32 = 14;
/// A cell farther from all points than this many of its diagonals is not divided: all points that could be the nearest there are about
/// as far. Without this rule a few points close together would divide all of space between them.
const FAR: f32 = 1.0;
/// Cells down to this depth are divided in parallel.
const PARALLEL_DEPTH: u32 = 3;

/// A child or a leaf: the first of eight cells, or a range of the lists.
#[derive(Clone, Copy, Debug)]
enum Cell {
    Inner(u32),
    Leaf { first: u32, count: u32 },
}

/// The map from places to nearest points.
#[derive(Debug)]
pub struct NearestPoint {
    space: UnitSpace,
    cells: Vec<Cell>,
    lists: Vec<Entry>,
}

/// A point of a list.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Entry {
    /// In unit space.
    p: Vec3,
    index: u32,
}

impl Entry {
    /// Its place, ready to be reckoned with as a whole.
    #[inline(always)]
    fn place(&self) -> Vec3A {
        // Without the index: as part of a number it would be one of those that processors are slow with.
        Vec3A::from_vec4(Vec4::from_array(bytemuck::cast(*self)).with_w(0.0))
    }
}

impl NearestPoint {
    /// The map for `points`, of which there must be some.
    pub fn new(points: &[Vec3]) -> Self {
        let space = UnitSpace::around(points.iter().copied());
        let entries: Vec<Entry> =
            points.iter().enumerate().map(|(i, &p)| Entry { p: space.to_unit(p), index: i as u32 }).collect();
        let Branch { cells, lists } = Branch::divide(Cube { low: Vec3A::ZERO, edge: 1.0 }, &entries, 0);
        Self { space, cells, lists }
    }

    /// The point nearest to `p`; for places outside the points' box, nearest to where it is left.
    #[inline]
    pub fn of(&self, p: Vec3) -> u32 {
        let unit = self.space.to_unit(p).clamp(Vec3::ZERO, Vec3::ONE);
        // The position in the current cell, in units of its edge.
        let mut within = unit;
        let mut cell = self.cells[0];
        while let Cell::Inner(first) = cell {
            let octant = within.cmpge(Vec3::splat(0.5));
            within = within * 2.0 - Vec3::select(octant, Vec3::ONE, Vec3::ZERO);
            // x is the lowest bit, as in `Cube::octant`.
            cell = self.cells[first as usize + octant.bitmask() as usize];
        }
        let Cell::Leaf { first, count } = cell else { unreachable!("the loop ends at a leaf") };
        let list = &self.lists[first as usize..(first + count) as usize];
        let mut nearest = (f32::INFINITY, list[0].index);
        for entry in list {
            let square = entry.p.distance_squared(unit);
            if square < nearest.0 {
                nearest = (square, entry.index);
            }
        }
        nearest.1
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.cells.capacity() * size_of::<Cell>() + self.lists.capacity() * size_of::<Entry>()
    }
}

#[derive(Clone, Copy)]
struct Cube {
    low: Vec3A,
    edge: f32,
}

impl Cube {
    fn octant(&self, number: usize) -> Self {
        let edge = 0.5 * self.edge;
        let offset = Vec3A::new((number & 1) as f32, (number >> 1 & 1) as f32, (number >> 2) as f32);
        Self { low: self.low + offset * edge, edge }
    }

    #[inline(always)]
    fn nearest_square(&self, p: Vec3A) -> f32 {
        (self.low - p).max(p - self.low - self.edge).max(Vec3A::ZERO).length_squared()
    }

    #[inline(always)]
    fn farthest_square(&self, p: Vec3A) -> f32 {
        (p - self.low).abs().max((self.low + self.edge - p).abs()).length_squared()
    }
}

/// The points that are nearest to places on a grid over the cell, faces included.
fn nearest_to_grid(cube: Cube, list: &[Entry]) -> Vec<Entry> {
    /// Where a group has room for more: farther than any point, and its square is finite.
    const NOWHERE: f32 = 1e18;
    // Four at a time, each coordinate for itself: this is much of the work of building.
    let coordinate =
        |group: &[Entry], axis| Vec4::from_array([0, 1, 2, 3].map(|k| group.get(k).map_or(NOWHERE, |e| e.p[axis])));
    let groups: Vec<[Vec4; 3]> = list.chunks(4).map(|group| [0, 1, 2].map(|axis| coordinate(group, axis))).collect();
    let mut squares = vec![Vec4::ZERO; groups.len()];
    let mut is_kept = vec![false; list.len()];
    for place in 0..GRID.pow(3) {
        let [x, y, z] =
            [place % GRID, place / GRID % GRID, place / (GRID * GRID)].map(|i| i as f32 / (GRID - 1) as f32);
        let p = Vec3::from(cube.low) + cube.edge * Vec3::new(x, y, z);
        let mut least = Vec4::INFINITY;
        for (square, [x, y, z]) in squares.iter_mut().zip(&groups) {
            let (x, y, z) = (x - p.x, y - p.y, z - p.z);
            *square = x * x + y * y + z * z;
            least = least.min(*square);
        }
        let least = Vec4::splat(least.min_element());
        let mut found = squares.iter().map(|square| square.cmpeq(least).bitmask()).enumerate();
        if let Some((group, lanes)) = found.find(|(_, lanes)| *lanes != 0) {
            is_kept[4 * group + lanes.trailing_zeros() as usize] = true;
        }
    }
    list.iter().zip(is_kept).filter(|(_, kept)| *kept).map(|(entry, _)| *entry).collect()
}

/// The cells under one, the first of them itself, with references from its own start.
struct Branch {
    cells: Vec<Cell>,
    lists: Vec<Entry>,
}

impl Branch {
    fn leaf(lists: Vec<Entry>) -> Self {
        Self { cells: vec![Cell::Leaf { first: 0, count: lists.len() as u32 }], lists }
    }

    /// `above` are the points that may be nearest in the cell around `cube`, in the order of their numbers.
    fn divide(cube: Cube, above: &[Entry], depth: u32) -> Self {
        // Some point is at most this far from any place in the cell: what is farther from all of it is never the nearest.
        let least = |a: f32, b: f32| if b < a { b } else { a };
        let reach = above.iter().map(|e| cube.farthest_square(e.place())).fold(f32::INFINITY, least);
        let mut nearest = f32::INFINITY;
        let mut list: Vec<Entry> = vec![];
        for entry in above {
            let square = cube.nearest_square(entry.place());
            if square <= reach {
                nearest = least(nearest, square);
                list.push(*entry);
            }
        }
        if list.len() <= MANY || depth == DEEPEST || nearest > FAR * FAR * 3.0 * cube.edge * cube.edge {
            if list.len() > FEW {
                list = nearest_to_grid(cube, &list);
            }
            return Self::leaf(list);
        }
        let child = |number| Self::divide(cube.octant(number), &list, depth + 1);
        let branches: Vec<Self> = if depth < PARALLEL_DEPTH {
            (0..8).into_par_iter().map(child).collect()
        } else {
            (0..8).map(child).collect()
        };
        Self::join(branches)
    }

    /// A cell over eight.
    fn join(branches: Vec<Self>) -> Self {
        let mut out = Self { cells: vec![Cell::Inner(1)], lists: vec![] };
        // The eight themselves come first, side by side; what is below them follows.
        out.cells.resize(9, Cell::Inner(0));
        for (number, branch) in branches.into_iter().enumerate() {
            // The branch's own first cell moves up, so its references shift by one less.
            let (shift, list_shift) = (out.cells.len() as u32 - 1, out.lists.len() as u32);
            let mut moved = branch.cells.into_iter().map(|cell| match cell {
                Cell::Inner(first) => Cell::Inner(first + shift),
                Cell::Leaf { first, count } => Cell::Leaf { first: first + list_shift, count },
            });
            if let Some(top) = moved.next() {
                out.cells[1 + number] = top;
            }
            out.cells.extend(moved);
            out.lists.extend(branch.lists);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache_points::neighbours::NeighbourSearch;
    use crate::math::sampler::Stream;

    fn cloud(count: usize, seed: u64) -> Vec<Vec3> {
        let mut stream = Stream::from_seed(seed);
        let mut next = || Vec3::from([(); 3].map(|()| stream.next_f32()));
        // Dense in a corner, sparse elsewhere, and a flat part.
        (0..count)
            .map(|i| match i % 3 {
                0 => next(),
                1 => next() * 0.02,
                _ => next() * Vec3::new(1.0, 1.0, 0.0),
            })
            .collect()
    }

    #[test]
    fn it_is_the_nearest() {
        let points = cloud(3000, 5);
        let map = NearestPoint::new(&points);
        let mut inexact = 0;
        for p in cloud(3000, 6) {
            let found = points[map.of(p) as usize].distance(p);
            let nearest = points.iter().map(|q| q.distance(p)).fold(f32::INFINITY, f32::min);
            let exact = found <= nearest + 1e-6;
            inexact += usize::from(!exact);
            assert!(exact || found <= 2.0 * nearest + 0.01, "{found} {nearest}");
        }
        assert!(inexact < 300, "{inexact}");
        assert_eq!(NearestPoint::new(&[Vec3::ONE]).of(Vec3::splat(9.0)), 0);
    }

    #[test]
    fn equally_far_points_do_not_fill_the_memory() {
        let mut stream = Stream::from_seed(7);
        let shell: Vec<Vec3> =
            (0..5000).map(|_| crate::math::warp::uniform_sphere([stream.next_f32(), stream.next_f32()])).collect();
        let map = NearestPoint::new(&shell);
        assert!(map.memory() < 20 << 20, "{}", map.memory());
        assert!((map.of(Vec3::ZERO) as usize) < shell.len());
        let crowd = vec![Vec3::ONE; 1000];
        assert!(NearestPoint::new(&crowd).memory() < 1 << 20);
    }

    /// `cargo test --release lookup -- --ignored --nocapture`
    #[test]
    #[ignore = "a measurement"]
    fn cost_beside_a_k_d_tree() {
        for count in [2_000, 20_000, 200_000] {
            let (points, places) = (cloud(count, 8), cloud(1_000_000, 9));
            let start = std::time::Instant::now();
            let map = NearestPoint::new(&points);
            let build = start.elapsed().as_secs_f64();
            let time = |find: &dyn Fn(Vec3) -> u32| {
                let start = std::time::Instant::now();
                let sum: u64 = places.iter().map(|&p| u64::from(find(p))).sum();
                (start.elapsed().as_secs_f64() * 1e3, sum)
            };
            let tree = NeighbourSearch::new(points.iter().copied());
            let space = UnitSpace::around(points.iter().copied());
            let (octants, sum) = time(&|p| map.of(p));
            let (kd, other) = time(&|p| tree.nearest(space.to_unit(p)));
            println!(
                "{count} points: octants {octants:.0} ns (build {build:.2} s, {} KiB), k-d tree {kd:.0} ns",
                map.memory() >> 10
            );
            assert!(sum.abs_diff(other) < sum / 1000);
        }
    }
}
