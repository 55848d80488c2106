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
use crate::light::Receiver;

/// The relative variance of 1/d² where it is unbounded: from within a node's sphere.
const MAX_VARIANCE: f32 = 1e4;

/// When to split a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splitting {
    /// Where variance times squared share is above this.
    threshold: f32,
}

impl Splitting {
    /// From the user's number: 0 for never, 1 for always.
    pub fn new(splitting: f32) -> Self {
        // (1/(1 + σ))^¼ < s where σ > s⁻⁴ − 1.
        let deviation = splitting.max(0.0).powi(-4) - 1.0;
        Self { threshold: if deviation > 0.0 { deviation * deviation } else { -1.0 } }
    }

    /// Whether `node`, whose part of all light at `receiver` is `share`, is to be split.
    #[inline(always)]
    pub(super) fn splits(&self, node: &Node, receiver: &Receiver, share: f32) -> bool {
        let extent = node.squared_extent(receiver);
        let variance = if extent < 1.0 { (4.0 / 3.0) * extent / (1.0 - extent) } else { MAX_VARIANCE };
        variance.min(MAX_VARIANCE) * share * share > self.threshold
    }
}
