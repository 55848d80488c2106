//! Building the hierarchy from the top down: lights are cut in two where the surface area orientation heuristic, evaluated at the
//! borders of bins, finds it cheapest ([`super::cost`]). Source: Conty Estevez & Kulla, HPG 2018, section 4.1.
//!
//! Where each part goes follows from the numbers of lights alone, so the tree is the same with any number of threads. Its depth is
//! bounded: what the heuristic cannot tell apart, or would peel off light by light, is halved. Bounds of lights are worked out anew for
//! every cut of a long list and kept only while a short one is built ([`SHORT`]), so that building takes little more than the tree itself, twice at the end.

use glam::Vec3;
use rayon::prelude::*;

use super::Parts;
use super::bounds::LightBounds;
use super::cost::cheapest_cut;
use super::node::{Node, Pair};

/// No leaf is deeper.
pub const MAX_DEPTH: u32 = 62;

/// Up to this many lights, a task of its own keeps their bounds, which takes 4 MiB.
const SHORT: usize = 1 << 16;

/// Longer lists are gone through in pieces of this length, side by side.
pub(super) const PIECE: usize = 1 << 14;

/// A light to build from.
pub(super) trait Item: Copy + Send + Sync {
    /// Its number.
    fn id(&self) -> u32;
    /// Its bounds.
    fn bounds(&self, parts: &impl Parts) -> LightBounds;
}

/// One of a long list.
impl Item for u32 {
    fn id(&self) -> u32 {
        *self
    }

    fn bounds(&self, parts: &impl Parts) -> LightBounds {
        parts.bounds(*self)
    }
}

/// One of a short list.
#[derive(Clone, Copy)]
struct Bounded {
    id: u32,
    bounds: LightBounds,
}

impl Item for Bounded {
    fn id(&self) -> u32 {
        self.id
    }

    fn bounds(&self, _: &impl Parts) -> LightBounds {
        self.bounds
    }
}

/// A tree in the making.
struct Builder<'a, P: Parts> {
    parts: &'a P,
    most_in_leaf: usize,
}

/// The pairs of the hierarchy over `ids` (at least one), which are put in order.
pub(super) fn build(parts: &impl Parts, ids: &mut [u32], most_in_leaf: usize) -> Box<[Pair]> {
    let builder = Builder { parts, most_in_leaf };
    let mut pairs = vec![Pair::default()];
    let (bounds, is_leaf, below) = builder.long(ids, 0, 0);
    pairs[0].0[0] = Node::new(&bounds, is_leaf, 0);
    pairs.extend(below);
    pairs.into_boxed_slice()
}

/// The bounds of a subtree, whether it is a leaf, and the pairs below its root.
type Subtree = (LightBounds, bool, Vec<Pair>);

impl<P: Parts> Builder<'_, P> {
    /// The tree over `ids`, the first of which has the place `first`.
    fn long(&self, ids: &mut [u32], first: u32, depth: u32) -> Subtree {
        if ids.len() <= SHORT {
            let mut list: Vec<Bounded> = ids.iter().map(|&id| Bounded { id, bounds: self.parts.bounds(id) }).collect();
            let mut pairs = vec![];
            let (bounds, is_leaf) = self.short(&mut list, first, depth, &mut pairs);
            ids.iter_mut().zip(&list).for_each(|(id, item)| *id = item.id);
            return (bounds, is_leaf, pairs);
        }
        let cut = self.cut(ids, depth);
        let (left, right) = ids.split_at_mut(cut);
        let middle = first + cut as u32;
        let (left, right) = rayon::join(|| self.long(left, first, depth + 1), || self.long(right, middle, depth + 1));
        let mut pairs = Vec::with_capacity(1 + left.2.len() + right.2.len());
        pairs.push(Self::pair((&left.0, left.1), (&right.0, right.1), middle, left.2.len()));
        pairs.extend(left.2);
        pairs.extend(right.2);
        (left.0.union(&right.0), false, pairs)
    }

    /// The same for few lights, the pairs appended to `pairs`.
    fn short(&self, list: &mut [Bounded], first: u32, depth: u32, pairs: &mut Vec<Pair>) -> (LightBounds, bool) {
        if list.len() <= self.most_in_leaf {
            let bounds = list[1..].iter().fold(list[0].bounds, |all, item| all.union(&item.bounds));
            return (bounds, true);
        }
        let cut = self.cut(list, depth);
        let (left, right) = list.split_at_mut(cut);
        let (own, middle) = (pairs.len(), first + cut as u32);
        pairs.push(Pair::default());
        let left = self.short(left, first, depth + 1, pairs);
        let left_pairs = pairs.len() - own - 1;
        let right = self.short(right, middle, depth + 1, pairs);
        pairs[own] = Self::pair((&left.0, left.1), (&right.0, right.1), middle, left_pairs);
        (left.0.union(&right.0), false)
    }

    /// Two siblings: the second has the places from `middle` on, its children follow the first one's `left_pairs`.
    fn pair(left: (&LightBounds, bool), right: (&LightBounds, bool), middle: u32, left_pairs: usize) -> Pair {
        Pair([Node::new(left.0, left.1, middle), Node::new(right.0, right.1, 1 + left_pairs as u32)])
    }

    /// Puts `list` (two at least) in order so that the first part, whose length is returned, goes left.
    fn cut<T: Item>(&self, list: &mut [T], depth: u32) -> usize {
        let half = list.len() / 2;
        if list.len() == 2 {
            return half;
        }
        let centre = |item: &T| item.bounds(self.parts).centre();
        let axis = |item: &T| item.bounds(self.parts).axis;
        // Halving from here on just fits.
        let must_halve = depth + list.len().ilog2() + 2 >= MAX_DEPTH;
        let (low, high) = extent(list, centre);
        if low == high {
            // At one spot: by direction, as far as there are any.
            let (low, high) = extent(list, axis);
            return halve(list, (high - low).max_position(), axis);
        }
        if !must_halve && let Some(at) = cheapest_cut(list, self.parts, low, high) {
            return partition(list, |item| at.is_left(centre(item)));
        }
        halve(list, (high - low).max_position(), centre)
    }
}

/// The box around what `of` gives for each item.
fn extent<T: Item>(list: &[T], of: impl Fn(&T) -> Vec3 + Sync) -> (Vec3, Vec3) {
    const NOTHING: (Vec3, Vec3) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let of_piece = |piece: &[T]| {
        piece.iter().fold(NOTHING, |(low, high), item| {
            let p = of(item);
            (low.min(p), high.max(p))
        })
    };
    if list.len() <= PIECE {
        return of_piece(list);
    }
    list.par_chunks(PIECE).map(of_piece).reduce(|| NOTHING, |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// The lesser half by the coordinate `axis` goes first, those with lower numbers where it is the same.
fn halve<T: Item>(list: &mut [T], axis: usize, of: impl Fn(&T) -> Vec3) -> usize {
    let half = list.len() / 2;
    list.select_nth_unstable_by(half, |a, b| of(a)[axis].total_cmp(&of(b)[axis]).then(a.id().cmp(&b.id())));
    half
}

/// Brings those that are left to the front; returns how many.
fn partition<T>(list: &mut [T], is_left: impl Fn(&T) -> bool) -> usize {
    let (mut front, mut back) = (0, list.len());
    loop {
        while front < back && is_left(&list[front]) {
            front += 1;
        }
        while front < back && !is_left(&list[back - 1]) {
            back -= 1;
        }
        if front == back {
            return front;
        }
        list.swap(front, back - 1);
    }
}
