//! Adaptive splitting: where one light cannot stand for all below a node, because the node is near or wide, a light is drawn from each
//! of its children. Source: Conty Estevez & Kulla, HPG 2018, section 4.3.
//!
//! For distances spread evenly over [a, b] the geometry term 1/d² has the mean 1/(ab) and the relative variance (b − a)²/(3ab) (their
//! equations 5 and 6); a node's sphere spans d − r to d + r, so that this is 4r²/(3(d² − r²)). Their threshold compares
//! (1/(1 + √V))^¼ with the user's number in 0..=1: 0 never splits, 1 always.
//!
//! Three things are ours. V is relative to the squared mean, so that the unit of light does not matter. It counts only as far as
//! the node's part of the whole goes: what is uncertain about a hundredth of the light is not worth a ray. And the variance of energies is
//! left out, because lights are chosen in proportion to energy.

use super::node::Node;
use super::{LightTree, ROOT};
use crate::light::Receiver;

/// At most this many nodes make up a cut.
pub const MAX_CUT: usize = 64;

/// The relative variance of 1/d² where it is unbounded: from within a node's sphere.
const MAX_VARIANCE: f32 = 64.0;

/// A node that a light is drawn from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutNode {
    /// The turns to it from the root.
    pub trail: u64,
    /// The node.
    pub node: u32,
    /// How many turns those are.
    pub depth: u32,
    /// Its part of the importance of all.
    pub share: f32,
}

impl CutNode {
    /// Whether the light at the end of `trail` is below.
    #[inline]
    pub const fn holds(&self, trail: u64) -> bool {
        (trail ^ self.trail) & ((1 << self.depth) - 1) == 0
    }
}

/// When to split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splitting {
    /// A node whose variance times its squared share is above this is split.
    threshold: f32,
}

impl Splitting {
    /// From the user's number: 0 for never, 1 for always.
    pub fn new(splitting: f32) -> Self {
        // (1/(1 + σ))^¼ < s where σ > s⁻⁴ − 1.
        let deviation = splitting.max(0.0).powi(-4) - 1.0;
        Self { threshold: if deviation > 0.0 { deviation * deviation } else { -1.0 } }
    }

    /// Whether nothing is ever split.
    #[inline]
    pub const fn is_never(&self) -> bool {
        self.threshold == f32::INFINITY
    }

    #[inline]
    fn splits(&self, node: &Node, receiver: &Receiver, share: f32) -> bool {
        let extent = node.squared_extent(receiver);
        let variance = if extent < 1.0 { (4.0 / 3.0) * extent / (1.0 - extent) } else { MAX_VARIANCE };
        variance.min(MAX_VARIANCE) * share * share > self.threshold
    }
}

impl LightTree {
    /// The nodes to draw a light from at `receiver`, whose part of all light there is `share`: together they hold every
    /// light that can contribute. The root alone where nothing needs splitting; none where splitting finds that no light contributes.
    #[inline]
    pub fn cut(&self, receiver: &Receiver, splitting: Splitting, share: f32, cut: &mut Vec<CutNode>) {
        cut.clear();
        cut.push(CutNode { trail: 0, node: ROOT, depth: 0, share });
        if !splitting.is_never() {
            self.refine(receiver, splitting, cut);
        }
    }

    /// Splits nodes in the order in which they came, so that all parts have their turn before the cut is full.
    fn refine(&self, receiver: &Receiver, splitting: Splitting, cut: &mut Vec<CutNode>) {
        let mut next = 0;
        while next < cut.len() && cut.len() < MAX_CUT {
            let CutNode { trail, node, depth, share } = cut[next];
            let node = self.node(node);
            if node.is_leaf() || !splitting.splits(node, receiver, share) {
                next += 1;
                continue;
            }
            let [a, b] = self.pairs[node.link as usize].0.map(|child| child.importance(receiver));
            let first = CutNode { trail, node: 2 * node.link, depth: depth + 1, share: share * (a / (a + b)) };
            let second = CutNode {
                trail: trail | 1 << depth,
                node: 2 * node.link + 1,
                depth: depth + 1,
                share: share * (b / (a + b)),
            };
            match (a > 0.0, b > 0.0) {
                (true, true) => {
                    cut[next] = first;
                    cut.push(second);
                }
                (true, false) => cut[next] = first,
                (false, true) => cut[next] = second,
                (false, false) => {
                    cut.swap_remove(next);
                }
            }
        }
    }
}
