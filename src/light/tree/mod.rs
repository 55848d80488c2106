//! A hierarchy over lights, or over the parts of one, that chooses among millions in the time of a few dozen.
//!
//! Source: Conty Estevez & Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018. Each node bounds where its lights are, which
//! way they face and how strong they are ([`bounds`]); from that follows how much they may matter at a point
//! ([`importance`]). A light is chosen from the top down ([`sample`]), or one from each of several nodes ([`split`], [`cut`]).
//!
//! Each light is a leaf. The children of a node lie side by side in one line of a cache ([`node`]): 64 bytes a light, and 8 more for the
//! way from the root to each light, one bit a level.

pub mod bounds;
pub mod build;
mod cost;
pub mod cut;
pub mod importance;
pub mod node;
pub mod sample;
pub mod split;

use self::build::{Leaf, build};
use self::node::{Node, Pair};
use super::Lights;

pub use bounds::LightBounds;
pub use cut::Cut;

/// The index of the root.
pub const ROOT: u32 = 0;

/// The hierarchy.
#[derive(Clone, Debug, PartialEq)]
pub struct LightTree {
    /// The root (with nothing beside it), then the children of each node: node 2k and 2k + 1 are siblings.
    pairs: Box<[Pair]>,
    /// For each light, the turns from the root to its leaf, the first in the lowest bit; [`OUTSIDE`] for those that have no leaf.
    trails: Box<[u64]>,
}

/// No trail: no leaf is this deep.
const OUTSIDE: u64 = u64::MAX;

/// What is below a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Below {
    /// Two nodes.
    Nodes([u32; 2]),
    /// One light.
    Light(u32),
}

impl LightTree {
    /// Over the finite lights of `lights` that shine; `None` where there is none. Built on the current rayon pool, the
    /// same with any number of threads.
    pub fn of(lights: &Lights) -> Option<Self> {
        let leaves = lights.ids().filter_map(|id| LightBounds::of(lights, id).map(|bounds| Leaf::new(id.0, bounds)));
        Self::new(leaves.collect(), lights.len())
    }

    /// Over `leaves`, each with a number of its own below `count`.
    pub fn new(mut leaves: Vec<Leaf>, count: usize) -> Option<Self> {
        let pairs = build(&mut leaves)?;
        let mut trails = vec![OUTSIDE; count].into_boxed_slice();
        for leaf in &leaves {
            trails[leaf.id as usize] = leaf.trail;
        }
        Some(Self { pairs, trails })
    }

    /// The node `index`.
    #[inline(always)]
    pub fn node(&self, index: u32) -> &Node {
        &self.pairs[(index >> 1) as usize].0[(index & 1) as usize]
    }

    /// The two nodes below `node`, which is not a leaf.
    #[inline(always)]
    pub fn children(&self, node: &Node) -> &[Node; 2] {
        &self.pairs[node.link as usize].0
    }

    /// What is below the node `index`.
    #[inline]
    pub fn below(&self, index: u32) -> Below {
        let node = self.node(index);
        if node.is_leaf() { Below::Light(node.link) } else { Below::Nodes([2 * node.link, 2 * node.link + 1]) }
    }

    /// The turns from the root to the light `id`, where it has a leaf.
    #[inline]
    pub fn trail(&self, id: u32) -> Option<u64> {
        self.trails.get(id as usize).copied().filter(|&trail| trail != OUTSIDE)
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.pairs) + size_of_val(&*self.trails)
    }
}
