//! Choosing a light from the top down: at each node one child, in proportion to importance; the random number is stretched on the way, so
//! one is enough. Source: Conty Estevez & Kulla, HPG 2018, section 4.2.
//!
//! The probability of a light is the product, from the top, of the same f32 numbers whether it is drawn or asked for.

use arrayvec::ArrayVec;

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

impl LightTree {
    /// A light of `cluster`, its probability given the cluster, and what is left of `u` in [0, 1).
    #[inline]
    pub fn sample(&self, parts: &impl Parts, cluster: &Cluster, receiver: &Receiver, u: f64) -> (u32, f32, f64) {
        let Cluster { mut first, mut count, mut node } = *cluster;
        let mut pmf = 1.0;
        // `left` of `width` is what is left of `u`: no division on the way down. The branch lets the processor fetch ahead where it
        // guesses right, which is quicker than selecting without one.
        let (mut left, mut width) = (u, 1.0);
        while count > 1 && !self.node(node).is_leaf() {
            let pair = self.pair_below(node);
            let (nodes, middle) = self.pair(pair);
            let p = self::first(nodes, receiver);
            let cut = width * f64::from(p);
            if left < cut {
                width = cut;
                pmf *= p;
                (count, node) = (middle - first, 2 * pair);
            } else {
                left -= cut;
                width -= cut;
                pmf *= 1.0 - p;
                (first, count, node) = (middle, first + count - middle, 2 * pair + 1);
            }
        }
        let lights = &self.order[first as usize..(first + count) as usize];
        let mut k = 0;
        if count > 1 {
            let leaf = InLeaf::new(parts, lights, receiver);
            (k, left, width) = leaf.sample(left, width);
            pmf *= leaf.0[k];
        }
        (lights[k], pmf, (left / width).clamp(0.0, 1.0 - f64::EPSILON))
    }

    /// The probability with which [`LightTree::sample`] from `cluster` chooses the light at `place`, which is below it.
    #[inline]
    pub fn pmf(&self, parts: &impl Parts, cluster: &Cluster, place: u32, receiver: &Receiver) -> f32 {
        let Cluster { mut first, mut count, mut node } = *cluster;
        let mut pmf = 1.0;
        while count > 1 && !self.node(node).is_leaf() {
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
