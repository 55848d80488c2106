//! A hierarchy over lights, or over the parts of one, that chooses among millions in the time of a few dozen.
//!
//! Source: Conty Estevez & Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018. Each node bounds where its lights are, which
//! way they face and how strong they are ([`bounds`]); from that follows how much they may matter at a point
//! ([`importance`]). A light is chosen from the top down ([`sample`]), or one from each of several nodes ([`split`], [`cut`]).
//!
//! Lights are numbered anew, by their places from left to right, so that what is below a node is a range of places and nothing
//! else need be stored for each light. A leaf holds a few lights ([`MOST_IN_LEAF`]), which are chosen among one by one. The children of a
//! node lie side by side in one line of a cache ([`node`]): about 21 bytes a light, 8 for its number and place, and 8 where ways may
//! end among lights that are alike ([`alike`]).

mod alike;
pub mod bounds;
pub mod build;
mod cost;
pub mod cut;
pub mod importance;
pub mod node;
pub mod sample;
pub mod split;

use arrayvec::ArrayVec;

use self::alike::EnergySums;
use self::build::build;
use self::node::{Node, Pair};
use super::{LightId, Lights, Receiver};

pub use bounds::LightBounds;
pub use cut::Cut;
pub use importance::{LANES, importances};
pub use sample::Way;

/// Lights in a leaf at most. Asking each of them costs as much as the two levels that they replace and knows more. With 8, cache points come
/// to choose noticeably worse, because they look into all of a leaf or none.
pub const MOST_IN_LEAF: usize = 4;

/// What a hierarchy stands over, by numbers.
pub trait Parts: Sync {
    /// The bounds of part `id`.
    fn bounds(&self, id: u32) -> LightBounds;

    /// How much part `id` may matter at `receiver`: positive wherever it contributes.
    fn importance(&self, id: u32, receiver: &Receiver) -> f32;

    /// Has fetched what [`Parts::importance`] is going to read, what it reads first at stage 0.
    #[inline]
    fn fetch(&self, _id: u32, _stage: u32) {}
}

impl Parts for Lights {
    fn bounds(&self, id: u32) -> LightBounds {
        LightBounds::of(self, LightId(id)).expect("only finite lights that shine are in a tree")
    }

    #[inline]
    fn importance(&self, id: u32, receiver: &Receiver) -> f32 {
        let contribution = self.contribution(LightId(id), receiver);
        // An estimate of 0 is not relied upon: bounds decide.
        if contribution > 0.0 { contribution } else { Node::new(&self.bounds(id), true, 0).importance(receiver) }
    }

    #[inline]
    fn fetch(&self, id: u32, stage: u32) {
        Self::fetch(self, LightId(id), stage);
    }
}

/// The hierarchy.
#[derive(Clone, Debug, PartialEq)]
pub struct LightTree {
    /// The root (with nothing beside it), then the children of each node: node 2k and 2k + 1 are siblings.
    pairs: Box<[Pair]>,
    /// The number of the light at each place.
    order: Box<[u32]>,
    /// The place of each light; [`OUTSIDE`] for those that are not in the tree.
    places: Box<[u32]>,
    /// Where ways down end among lights that are alike: what those are chosen by.
    energies: Option<EnergySums>,
}

/// The place of lights that have none.
const OUTSIDE: u32 = u32::MAX;

/// Some of a tree's lights: a node, or one light of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cluster {
    /// The first place below.
    pub first: u32,
    /// How many lights are below; above 0.
    pub count: u32,
    /// The node. Of one light among several in a leaf, that leaf.
    pub node: u32,
}

impl Cluster {
    /// One past the last place below.
    #[inline]
    pub const fn end(&self) -> u32 {
        self.first + self.count
    }

    /// Whether the light at `place` is below.
    #[inline]
    pub const fn covers(&self, place: u32) -> bool {
        // Wraps around where it is before the first.
        place.wrapping_sub(self.first) < self.count
    }

    /// Whether all of `other` is below.
    #[inline]
    pub const fn holds(&self, other: &Self) -> bool {
        self.first <= other.first && other.end() <= self.end()
    }
}

impl LightTree {
    /// Over the finite lights of `lights` that shine; `None` where there is none. Built on the current rayon pool, the
    /// same with any number of threads.
    pub fn of(lights: &Lights) -> Option<Self> {
        let is_finite = |id: &LightId| !lights.is_dark(*id) && lights.centre(*id).is_some();
        let ids = lights.ids().filter(is_finite).map(|id| id.0).collect();
        Self::new(lights, ids, lights.len(), MOST_IN_LEAF)
    }

    /// Over those of `parts` that `ids` names, numbers below `count`, up to `most_in_leaf` (which is at most [`MOST_IN_LEAF`]) in a leaf.
    pub fn new(parts: &impl Parts, ids: Vec<u32>, count: usize, most_in_leaf: usize) -> Option<Self> {
        if ids.is_empty() {
            return None;
        }
        let mut order = ids.into_boxed_slice();
        let pairs = build(parts, &mut order, most_in_leaf.clamp(1, MOST_IN_LEAF));
        let mut places = vec![OUTSIDE; count].into_boxed_slice();
        for (place, &id) in order.iter().enumerate() {
            places[id as usize] = place as u32;
        }
        Some(Self { pairs, order, places, energies: None })
    }

    /// All of it.
    #[inline]
    pub fn root(&self) -> Cluster {
        Cluster { first: 0, count: self.len(), node: 0 }
    }

    /// How many lights it holds.
    #[expect(clippy::len_without_is_empty, reason = "there is no empty tree")]
    #[inline]
    pub fn len(&self) -> u32 {
        self.order.len() as u32
    }

    /// The node `index`.
    #[inline(always)]
    pub fn node(&self, index: u32) -> &Node {
        &self.pairs[(index >> 1) as usize].0[(index & 1) as usize]
    }

    /// The number of the pair below the node `index`, which is not a leaf.
    #[inline(always)]
    fn pair_below(&self, index: u32) -> u32 {
        let pair = index >> 1;
        pair + if index & 1 == 0 { 1 } else { self.node(index).link }
    }

    /// The two nodes of pair `pair`, and the first place below the second.
    #[inline(always)]
    fn pair(&self, pair: u32) -> (&[Node; 2], u32) {
        let nodes = &self.pairs[pair as usize].0;
        (nodes, nodes[0].link)
    }

    /// What a cluster of several lights falls into: two nodes, or the lights of a leaf. Nothing for one light.
    pub fn children(&self, cluster: &Cluster) -> ArrayVec<Cluster, MOST_IN_LEAF> {
        let Cluster { first, count, node } = *cluster;
        if count == 1 {
            return ArrayVec::new();
        }
        if self.node(node).is_leaf() {
            return (first..cluster.end()).map(|place| Cluster { first: place, count: 1, node }).collect();
        }
        let pair = self.pair_below(node);
        let (_, middle) = self.pair(pair);
        let left = Cluster { first, count: middle - first, node: 2 * pair };
        let right = Cluster { first: middle, count: cluster.end() - middle, node: 2 * pair + 1 };
        [left, right].into_iter().collect()
    }

    /// The light that a cluster is, if it is one.
    #[inline]
    pub fn light(&self, cluster: &Cluster) -> Option<u32> {
        (cluster.count == 1).then(|| self.order[cluster.first as usize])
    }

    /// How much the lights of a cluster may matter at `receiver`: 0 only where none of them can contribute.
    #[inline]
    pub fn importance(&self, parts: &impl Parts, cluster: &Cluster, receiver: &Receiver) -> f32 {
        match self.light(cluster) {
            Some(light) => parts.importance(light, receiver),
            None => self.node(cluster.node).importance(receiver),
        }
    }

    /// The place of the light `id`, where it is in the tree.
    #[inline]
    pub fn place(&self, id: u32) -> Option<u32> {
        self.places.get(id as usize).copied().filter(|&place| place != OUTSIDE)
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        let energies = self.energies.as_ref().map_or(0, EnergySums::memory);
        size_of_val(&*self.pairs) + size_of_val(&*self.order) + size_of_val(&*self.places) + energies
    }
}
