//! Building the hierarchy from the top down: lights are cut in two where the surface area orientation heuristic, evaluated at the
//! borders of bins, finds it cheapest ([`super::cost`]). Source: Conty Estevez & Kulla, HPG 2018, section 4.1.
//!
//! Where each part goes follows from the numbers of lights alone, so the tree is the same with any number of threads. Its depth is
//! bounded: what the heuristic cannot tell apart, or would peel off light by light, is halved.

use glam::Vec3;

use super::bounds::LightBounds;
use super::cost::cheapest_cut;
use super::node::{Node, Pair};

/// A light to build from.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Its bounds.
    pub bounds: LightBounds,
    /// Its number.
    pub id: u32,
    /// The way to it, once built.
    pub(super) trail: u64,
}

impl Leaf {
    /// The light number `id` within `bounds`.
    pub fn new(id: u32, bounds: LightBounds) -> Self {
        Self { bounds, id, trail: 0 }
    }
}

/// No leaf is deeper, so that trails fit into 64 bits with some to spare.
pub const MAX_DEPTH: u32 = 62;

/// Fewer lights than this are not worth a task of their own.
const PARALLEL: usize = 2048;

/// The pairs of the hierarchy over `leaves`, which are put in order and given their trails. `None` without leaves.
pub(super) fn build(leaves: &mut [Leaf]) -> Option<Box<[Pair]>> {
    if leaves.is_empty() {
        return None;
    }
    // One pair for the root, one for each inner node.
    let mut pairs = vec![Pair::default(); leaves.len()];
    let (root, inner) = pairs.split_first_mut()?;
    let (_, node) = subtree(leaves, inner, 1, 0, 0);
    root.0[0] = node;
    Some(pairs.into_boxed_slice())
}

/// Builds the tree over `leaves` (at least one) into `pairs`, one fewer, of which the first has the number `first`. Returns its bounds and
/// root.
fn subtree(leaves: &mut [Leaf], pairs: &mut [Pair], first: u32, depth: u32, trail: u64) -> (LightBounds, Node) {
    let Some((pair, rest)) = pairs.split_first_mut() else {
        let leaf = &mut leaves[0];
        leaf.trail = trail;
        return (leaf.bounds, Node::new(&leaf.bounds, true, leaf.id));
    };
    let cut = cut(leaves, depth);
    let (left, right) = leaves.split_at_mut(cut);
    let is_parallel = left.len().min(right.len()) >= PARALLEL;
    let (left_pairs, right_pairs) = rest.split_at_mut(cut - 1);
    let mut build_left = || subtree(left, left_pairs, first + 1, depth + 1, trail);
    let mut build_right = || subtree(right, right_pairs, first + cut as u32, depth + 1, trail | 1 << depth);
    let ((left_bounds, left_node), (right_bounds, right_node)) =
        if is_parallel { rayon::join(build_left, build_right) } else { (build_left(), build_right()) };
    pair.0 = [left_node, right_node];
    let bounds = left_bounds.union(&right_bounds);
    (bounds, Node::new(&bounds, false, first))
}

/// Puts `leaves` (two at least) in order so that the first part, whose length is returned, goes left.
fn cut(leaves: &mut [Leaf], depth: u32) -> usize {
    let half = leaves.len() / 2;
    if leaves.len() == 2 {
        return half;
    }
    // Halving from here on just fits.
    let must_halve = depth + leaves.len().ilog2() + 2 >= MAX_DEPTH;
    let (low, high) = extent(leaves, |leaf| leaf.bounds.centre());
    if low == high {
        // At one spot: by direction, as far as there are any.
        let (low, high) = extent(leaves, |leaf| leaf.bounds.axis);
        return halve(leaves, (high - low).max_position(), |leaf| leaf.bounds.axis);
    }
    if !must_halve && let Some(at) = cheapest_cut(leaves, low, high) {
        return partition(leaves, |leaf| at.is_left(leaf.bounds.centre()));
    }
    halve(leaves, (high - low).max_position(), |leaf| leaf.bounds.centre())
}

fn extent(leaves: &[Leaf], of: impl Fn(&Leaf) -> Vec3) -> (Vec3, Vec3) {
    leaves.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), leaf| {
        let p = of(leaf);
        (low.min(p), high.max(p))
    })
}

/// The lesser half by the coordinate `axis` goes first, those with lower numbers where it is the same.
fn halve(leaves: &mut [Leaf], axis: usize, of: impl Fn(&Leaf) -> Vec3) -> usize {
    let half = leaves.len() / 2;
    leaves.select_nth_unstable_by(half, |a, b| of(a)[axis].total_cmp(&of(b)[axis]).then(a.id.cmp(&b.id)));
    half
}

/// Brings those that are left to the front; returns how many.
fn partition(leaves: &mut [Leaf], is_left: impl Fn(&Leaf) -> bool) -> usize {
    let (mut front, mut back) = (0, leaves.len());
    loop {
        while front < back && is_left(&leaves[front]) {
            front += 1;
        }
        while front < back && !is_left(&leaves[back - 1]) {
            back -= 1;
        }
        if front == back {
            return front;
        }
        leaves.swap(front, back - 1);
    }
}
