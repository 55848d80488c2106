//! A cut through the tree for one receiver: nodes that together hold every light that can contribute there.
//!
//! It serves two ends. Nodes that the user's number splits ([`super::split`]) have a draw each. And all of them are refined further
//! by the same criterion at a fixed number: bounds say little about a node that the receiver is in or near, and choices from the top would
//! have to go through just those. So the nodes of a draw are chosen among by their own importance, all at once, and only then does the choice go on
//! downwards. This is ours. With 2,000 lights around, the choice of one light has a third of the variance, or six tenths where the lights are in groups, for
//! a little more than twice the time (`cargo test --lib light::tests::tree::figures -- --ignored --nocapture`).

use arrayvec::ArrayVec;

use super::sample::LEAST;
use super::split::Splitting;
use super::{Cluster, LightTree, MOST_IN_LEAF, Parts};
use crate::light::Receiver;

/// At most this many nodes make up a cut, so at most this many lights are drawn at a vertex.
pub const MAX_CUT: usize = 64;

/// The number for which nodes are refined, whether or not they have a draw each.
const REFINING: f32 = 0.85;

/// A node of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutNode {
    /// Its lights.
    pub cluster: Cluster,
    /// The draw that may choose it.
    pub draw: u32,
    /// Its importance, above 0.
    pub importance: f32,
    /// Its part of all light, judged from the top down; once the cut is done, the probability that its draw chooses it.
    pub share: f32,
}

/// See the file's description. Reused from vertex to vertex.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// The nodes.
    nodes: Vec<CutNode>,
    /// How many draws there are.
    draws: u32,
}

impl Cut {
    /// Cuts `tree` for `receiver`, with a draw for each node that `splitting` splits off.
    pub fn make(&mut self, tree: &LightTree, parts: &impl Parts, receiver: &Receiver, splitting: Splitting) {
        self.clear();
        let root = tree.root();
        let importance = tree.importance(parts, &root, receiver);
        if importance <= 0.0 {
            return;
        }
        self.nodes.reserve_exact(MAX_CUT);
        self.nodes.push(CutNode { cluster: root, draw: 0, importance, share: 1.0 });
        self.draws = 1;
        let refining = Splitting::new(REFINING);
        let mut next = 0;
        // In the order in which they came, so that all parts have their turn before the cut is full.
        while next < self.nodes.len() {
            let CutNode { cluster, share, .. } = self.nodes[next];
            let node = tree.node(cluster.node);
            let falls_into = if node.is_leaf() { cluster.count as usize } else { 2 };
            if cluster.count == 1 || self.nodes.len() + falls_into - 1 > MAX_CUT {
                next += 1;
            } else if splitting.splits(node, receiver, share) && self.is_alone(next) {
                self.replace(tree, parts, receiver, next, true);
            } else if refining.splits(node, receiver, share) {
                self.replace(tree, parts, receiver, next, false);
            } else {
                next += 1;
            }
        }
        self.weigh();
    }

    /// No nodes, no draws.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.draws = 0;
    }

    /// Puts those children of the node at `index` that can contribute in its place; all but the first, if it `splits`, with draws of their own.
    fn replace(&mut self, tree: &LightTree, parts: &impl Parts, receiver: &Receiver, index: usize, splits: bool) {
        let parent = self.nodes[index];
        let children = tree.children(&parent.cluster).into_iter();
        let mut children: ArrayVec<CutNode, MOST_IN_LEAF> = children
            .map(|cluster| CutNode { cluster, importance: tree.importance(parts, &cluster, receiver), ..parent })
            .filter(|child| child.importance > 0.0)
            .collect();
        let sum: f64 = children.iter().map(|child| f64::from(child.importance)).sum();
        children.iter_mut().for_each(|child| child.share *= (f64::from(child.importance) / sum) as f32);
        let mut children = children.into_iter();
        let Some(first) = children.next() else {
            let is_alone = self.is_alone(index);
            self.nodes.swap_remove(index);
            if is_alone {
                // Its draw has nothing left: the last one takes its number.
                self.draws -= 1;
                let last = self.draws;
                self.nodes.iter_mut().filter(|n| n.draw == last).for_each(|n| n.draw = parent.draw);
            }
            return;
        };
        self.nodes[index] = first;
        for child in children {
            let draw = if splits { self.draws } else { parent.draw };
            self.draws += u32::from(splits);
            self.nodes.push(CutNode { draw, ..child });
        }
    }

    /// Whether the node at `index` has a draw to itself.
    fn is_alone(&self, index: usize) -> bool {
        let draw = self.nodes[index].draw;
        self.nodes.iter().filter(|node| node.draw == draw).count() == 1
    }

    /// Turns importances into probabilities, none of them less than [`LEAST`] of an even choice.
    fn weigh(&mut self) {
        let mut sums = [(0.0f64, 0u32); MAX_CUT];
        for node in &self.nodes {
            let (sum, count) = &mut sums[node.draw as usize];
            *sum += f64::from(node.importance);
            *count += 1;
        }
        for node in &mut self.nodes {
            let (sum, count) = sums[node.draw as usize];
            let weight = f64::from(node.importance) / sum + f64::from(LEAST) / f64::from(count);
            node.share = (weight / (1.0 + f64::from(LEAST))) as f32;
        }
    }

    /// How many lights to draw.
    #[inline]
    pub const fn draws(&self) -> u32 {
        self.draws
    }

    /// The nodes.
    #[inline]
    pub fn nodes(&self) -> &[CutNode] {
        &self.nodes
    }

    /// An estimate of all light that arrives, finite.
    pub fn importance(&self) -> f32 {
        let sum: f64 = self.nodes.iter().map(|node| f64::from(node.importance)).sum();
        sum.min(f64::from(f32::MAX / 4.0)) as f32
    }

    /// The light of `draw` for `u` in [0, 1), its probability, and what is left of `u`.
    #[inline]
    pub fn sample(
        &self,
        tree: &LightTree,
        parts: &impl Parts,
        receiver: &Receiver,
        draw: u32,
        u: f64,
    ) -> Option<(u32, f32, f64)> {
        let mut left = u;
        let mut chosen = None;
        for node in self.nodes.iter().filter(|node| node.draw == draw) {
            left -= chosen.map_or(0.0, |before: &CutNode| f64::from(before.share));
            chosen = Some(node);
            if left < f64::from(node.share) {
                break;
            }
        }
        let chosen = chosen?;
        let rest = (left / f64::from(chosen.share)).clamp(0.0, 1.0 - f64::EPSILON);
        let (id, pmf, rest) = tree.sample(parts, &chosen.cluster, receiver, rest);
        Some((id, chosen.share * pmf, rest))
    }

    /// The probability that the draw that may choose it chooses the light at `place`.
    #[inline]
    pub fn pmf(&self, tree: &LightTree, parts: &impl Parts, receiver: &Receiver, place: u32) -> f32 {
        let above = self.nodes.iter().find(|node| node.cluster.covers(place));
        above.map_or(0.0, |above| above.share * tree.pmf(parts, &above.cluster, place, receiver))
    }
}
