//! Choosing a light from the top down: at each node one child, in proportion to importance; the random number is stretched on the way, so
//! one is enough. Source: Conty Estevez & Kulla, HPG 2018, section 4.2.
//!
//! The probability of a light is the product, from the top, of the same f32 numbers whether it is drawn or asked for.

use super::LightTree;
use super::node::{Node, Pair};
use crate::light::Receiver;

/// The least probability of a child that can contribute: however bright its sibling, that one may be hidden. Costs at most this share
/// of the choices at a node.
pub const LEAST: f32 = 1.0 / 16_384.0;

/// The probability of the first of two children.
#[inline(always)]
fn first(pair: &Pair, receiver: &Receiver) -> f32 {
    let [a, b] = &pair.0;
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

impl LightTree {
    /// A light below `node`, its probability given the node, and what is left of `u` in [0, 1).
    #[inline]
    pub fn sample(&self, node: u32, receiver: &Receiver, u: f64) -> (u32, f32, f64) {
        let mut node: &Node = self.node(node);
        let mut pmf = 1.0;
        // `left` of `width` is what is left of `u`: no division on the way down. The branch lets the processor fetch ahead where it
        // guesses right, which is quicker than selecting without one.
        let (mut left, mut width) = (u, 1.0);
        while !node.is_leaf() {
            let pair = &self.pairs[node.link as usize];
            let p = first(pair, receiver);
            let cut = width * f64::from(p);
            if left < cut {
                width = cut;
                pmf *= p;
                node = &pair.0[0];
            } else {
                left -= cut;
                width -= cut;
                pmf *= 1.0 - p;
                node = &pair.0[1];
            }
        }
        (node.link, pmf, (left / width).clamp(0.0, 1.0 - f64::EPSILON))
    }

    /// The probability with which [`LightTree::sample`] from `node`, `depth` below the root, chooses the light that `trail` leads to, which is below it.
    #[inline]
    pub fn pmf(&self, node: u32, depth: u32, trail: u64, receiver: &Receiver) -> f32 {
        let mut node: &Node = self.node(node);
        let mut turns = trail >> depth;
        let mut pmf = 1.0;
        while !node.is_leaf() {
            let pair = &self.pairs[node.link as usize];
            let p = first(pair, receiver);
            pmf *= if turns & 1 == 0 { p } else { 1.0 - p };
            node = &pair.0[(turns & 1) as usize];
            turns >>= 1;
        }
        pmf
    }
}
