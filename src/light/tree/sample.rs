//! Choosing a light from the top down: at each node one child, in proportion to importance; the random number is stretched on the way, so
//! one is enough. Source: Conty Estevez & Kulla, HPG 2018, section 4.2.
//!
//! The probability of a light is the product, from the top, of the same f32 numbers whether it is drawn or asked for.

use arrayvec::ArrayVec;
use prefetch_index::prefetch_index;

use super::alike::EnergySums;
use super::node::Node;
use super::{Cluster, LightTree, MOST_IN_LEAF, Parts};
use crate::light::Receiver;

/// The least probability of a child that can contribute: however bright its sibling, that one may be hidden. Costs at most this share
/// of the choices at a node.
pub const LEAST: f32 = 1.0 / 16_384.0;

/// The probability of the first of two children.
#[inline(always)]
fn first([a, b]: &[Node; 2], receiver: &Receiver) -> f32 {
    let (first, second) = (a.importance(receiver), b.importance(receiver));
    if first > 0.0 && second > 0.0 {
        (first / (first + second)).clamp(LEAST, 1.0 - LEAST)
    } else if first > 0.0 {
        1.0
    } else if second > 0.0 {
        0.0
    } else {
        // Nothing contributes: the choice does not matter, but there is one.
        (a.energy / (a.energy + b.energy)).clamp(LEAST, 1.0 - LEAST)
    }
}

/// The probabilities of the lights in one leaf.
struct InLeaf(ArrayVec<f32, MOST_IN_LEAF>);

impl InLeaf {
    #[inline]
    fn new(parts: &impl Parts, lights: &[u32], receiver: &Receiver) -> Self {
        let mut weights: ArrayVec<f32, MOST_IN_LEAF> =
            lights.iter().map(|&id| parts.importance(id, receiver)).collect();
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        let even = 1.0 / lights.len() as f32;
        if total > 0.0 {
            let floor = LEAST * even;
            let probability = |w: f32| if w > 0.0 { (f64::from(w) / total) as f32 + floor } else { 0.0 };
            weights.iter_mut().for_each(|w| *w = probability(*w));
            let scale = 1.0 / weights.iter().sum::<f32>();
            weights.iter_mut().for_each(|w| *w *= scale);
        } else {
            weights.iter_mut().for_each(|w| *w = even);
        }
        Self(weights)
    }

    /// Which one `u` of `width` chooses; and what is left of both.
    #[inline]
    fn sample(&self, mut u: f64, width: f64) -> (usize, f64, f64) {
        let mut last = (0, u, width);
        for (k, &p) in self.0.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let step = width * f64::from(p);
            last = (k, u, step);
            if u < step {
                break;
            }
            u -= step;
        }
        last
    }
}

/// A way down the tree, from a cluster to one of its lights.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    cluster: Cluster,
    /// What is left of the random number, below `width`: no division on the way down.
    left: f64,
    width: f64,
    pmf: f32,
    next: Next,
}

/// What a way comes to next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// The nodes of this pair.
    Pair(u32),
    /// Lights that are alike, of which it is in the midst.
    Alike,
    /// A leaf, or one light: it is there.
    Leaf,
}

impl Way {
    /// About to start at `cluster` with `u` in [0, 1).
    #[inline]
    pub const fn from(cluster: Cluster, u: f64) -> Self {
        Self { cluster, left: u, width: 1.0, pmf: 1.0, next: Next::Leaf }
    }

    /// Where it is.
    #[inline]
    pub const fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// What is left of its random number, in [0, 1).
    #[inline]
    pub fn rest(&self) -> f64 {
        (self.left / self.width).clamp(0.0, 1.0 - f64::EPSILON)
    }
}

impl LightTree {
    /// A light of `cluster`, its probability given the cluster, and what is left of `u` in [0, 1).
    #[inline]
    pub fn sample(&self, parts: &impl Parts, cluster: &Cluster, receiver: &Receiver, u: f64) -> (u32, f32, f64) {
        let mut way = Way::from(*cluster, u);
        self.look_ahead(&mut way, receiver);
        while self.step(&mut way, receiver) {}
        self.choose_alike(&mut way);
        self.arrive(parts, way, receiver)
    }

    /// Has fetched what a way reads that begins at `cluster`.
    #[inline]
    pub fn fetch(&self, cluster: &Cluster) {
        prefetch_index(&self.pairs, (cluster.node >> 1) as usize);
    }

    /// Takes all of `ways` down to their leaves, from where [`LightTree::arrive`] goes on. They take their steps in turn, so that the
    /// processor waits for the nodes of all of them at once: with millions of lights most nodes are far from it.
    #[inline]
    pub fn descend(&self, parts: &impl Parts, ways: &mut [Way], receiver: &Receiver) {
        let mut goes_on = true;
        ways.iter_mut().for_each(|way| self.look_ahead(way, receiver));
        while goes_on {
            goes_on = false;
            for way in &mut *ways {
                goes_on |= self.step(way, receiver);
            }
        }
        ways.iter_mut().for_each(|way| self.choose_alike(way));
        for stage in 0..2 {
            for way in &*ways {
                self.below(way).iter().for_each(|&id| parts.fetch(id, stage));
            }
        }
    }

    /// The lights that are left of a way's cluster in its leaf.
    #[inline]
    fn below(&self, way: &Way) -> &[u32] {
        let Cluster { first, count, .. } = way.cluster;
        // One light may lie outside.
        self.order.get(first as usize..(first + count) as usize).unwrap_or(&[])
    }

    /// One step down; false where there is none.
    #[inline(always)]
    fn step(&self, way: &mut Way, receiver: &Receiver) -> bool {
        let Next::Pair(pair) = way.next else { return false };
        let Cluster { first, count, .. } = way.cluster;
        let (nodes, middle) = self.pair(pair);
        self.fetch_two_below(pair, nodes);
        let p = self::first(nodes, receiver);
        let cut = way.width * f64::from(p);
        // Without a branch: a wrong guess would throw away the steps of the other ways too. A way on its own pays for it (`--lights tree` takes 3 %
        // longer in the scene `rooms`).
        let is_second = way.left >= cut;
        let (rest, width) = (way.left - cut, way.width - cut);
        way.left = if is_second { rest } else { way.left };
        way.width = if is_second { width } else { cut };
        way.pmf *= if is_second { 1.0 - p } else { p };
        way.cluster = Cluster {
            first: if is_second { middle } else { first },
            count: if is_second { first + count - middle } else { middle - first },
            node: 2 * pair + u32::from(is_second),
        };
        self.look_ahead(way, receiver);
        true
    }

    /// Has fetched the nodes two levels below `nodes`, those of pair `pair`, whichever of them a way is going to take: what one level brings then waits
    /// for no more than its arithmetic. Under five million lights a sample takes 0.92 times as long, under few thousands as long as without.
    #[inline(always)]
    fn fetch_two_below(&self, pair: u32, nodes: &[Node; 2]) {
        for (node, below) in nodes.iter().zip([pair + 1, pair + nodes[1].link]) {
            if !node.is_leaf() {
                let [_, second] = &self.pairs[below as usize].0;
                prefetch_index(&self.pairs, (below + 1) as usize);
                prefetch_index(&self.pairs, (below + second.link) as usize);
            }
        }
    }

    /// Finds what a way comes to next, and has it fetched while other ways take their steps.
    #[inline(always)]
    fn look_ahead(&self, way: &mut Way, receiver: &Receiver) {
        let Cluster { first, count, node } = way.cluster;
        way.next = Next::Leaf;
        if count == 1 {
            prefetch_index(&self.order, first as usize);
        } else if let Some(energies) = self.alike(&way.cluster, receiver) {
            way.next = Next::Alike;
            let guess = EnergySums::guess(&way.cluster, way.rest());
            for place in [guess, first as usize, (first + count) as usize] {
                prefetch_index(energies.all(), place);
            }
            prefetch_index(&self.order, guess);
        } else if !self.node(node).is_leaf() {
            let pair = self.pair_below(node);
            way.next = Next::Pair(pair);
            prefetch_index(&self.pairs, pair as usize);
        } else {
            prefetch_index(&self.order, first as usize);
        }
    }

    /// Chooses one of lights that are alike, where a way has come to such.
    #[inline(always)]
    fn choose_alike(&self, way: &mut Way) {
        if let (Next::Alike, Some(energies)) = (way.next, &self.energies) {
            let (place, rest) = energies.sample(&way.cluster, way.rest());
            way.pmf *= energies.pmf(&way.cluster, place);
            (way.left, way.width, way.next) = (rest, 1.0, Next::Leaf);
            way.cluster = Cluster { first: place, count: 1, node: way.cluster.node };
            prefetch_index(&self.order, place as usize);
        }
    }

    /// The light that a way leads to from its leaf, its probability given where the way began, and what is left of its number, in [0, 1).
    #[inline]
    pub fn arrive(&self, parts: &impl Parts, way: Way, receiver: &Receiver) -> (u32, f32, f64) {
        let Cluster { first, count, .. } = way.cluster;
        let lights = &self.order[first as usize..(first + count) as usize];
        if count == 1 {
            return (lights[0], way.pmf, way.rest());
        }
        let leaf = InLeaf::new(parts, lights, receiver);
        let (k, left, width) = leaf.sample(way.left, way.width);
        (lights[k], way.pmf * leaf.0[k], Way { left, width, ..way }.rest())
    }

    /// The probability with which [`LightTree::sample`] from `cluster` chooses the light at `place`, which is below it.
    #[inline]
    pub fn pmf(&self, parts: &impl Parts, cluster: &Cluster, place: u32, receiver: &Receiver) -> f32 {
        let Cluster { mut first, mut count, mut node } = *cluster;
        let mut pmf = 1.0;
        while count > 1 {
            if let Some(energies) = self.alike(&Cluster { first, count, node }, receiver) {
                return pmf * energies.pmf(&Cluster { first, count, node }, place);
            }
            if self.node(node).is_leaf() {
                break;
            }
            let pair = self.pair_below(node);
            let (nodes, middle) = self.pair(pair);
            let p = self::first(nodes, receiver);
            if place < middle {
                pmf *= p;
                (count, node) = (middle - first, 2 * pair);
            } else {
                pmf *= 1.0 - p;
                (first, count, node) = (middle, first + count - middle, 2 * pair + 1);
            }
        }
        if count > 1 {
            let lights = &self.order[first as usize..(first + count) as usize];
            pmf *= InLeaf::new(parts, lights, receiver).0[(place - first) as usize];
        }
        pmf
    }
}
