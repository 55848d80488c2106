//! The lights as cache points see them: the light hierarchy, and beside it the lights that are infinitely far away.
//!
//! Every leaf has a key of 64 bits: a tree's leaf the turns from the root to it, the first turn in the second highest bit; a light at infinity
//! the highest bit and its number. A node covers the keys that begin with its own turns, so lists of disjoint nodes can be ordered,
//! and the one that holds a light found by one binary search, without a number stored for any light.

use glam::Vec3;

use crate::light::tree::build::Leaf;
use crate::light::tree::{Below, LightBounds, LightTree, ROOT};
use crate::light::{LightId, LightRef, Lights, Receiver};

/// Marks keys of lights at infinity.
const AT_INFINITY: u64 = 1 << 63;

/// A light, or a cluster of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cluster {
    /// The least key below.
    pub key: u64,
    /// The node of the tree; the light's number where it is at infinity.
    node: u32,
    /// How many of the key's high bits all below share.
    bits: u32,
}

impl Cluster {
    /// The greatest key below.
    #[inline]
    pub const fn last(&self) -> u64 {
        self.key | (u64::MAX >> 1 >> (self.bits - 1))
    }

    /// Whether `key` is below.
    #[inline]
    pub const fn covers(&self, key: u64) -> bool {
        self.key <= key && key <= self.last()
    }

    /// Whether all of `other` is below.
    #[inline]
    pub const fn holds(&self, other: &Self) -> bool {
        self.key <= other.key && other.last() <= self.last()
    }

    const fn is_at_infinity(&self) -> bool {
        self.key & AT_INFINITY != 0
    }

    /// Its depth in the tree.
    const fn depth(&self) -> u32 {
        self.bits - 1
    }
}

/// The tree and the lights at infinity.
#[derive(Debug)]
pub struct Hierarchy {
    tree: Option<LightTree>,
    at_infinity: Vec<LightId>,
}

impl Hierarchy {
    /// Over all lights that shine on everything: exclusive ones are added at the vertices they shine on.
    pub fn new(lights: &Lights) -> Self {
        let shines =
            |id: &LightId| !lights.is_dark(*id) && !lights.linking().is_some_and(|linking| linking.is_exclusive(*id));
        let leaf = |id: LightId| LightBounds::of(lights, id).map(|bounds| Leaf::new(id.0, bounds));
        let leaves = lights.ids().filter(shines).filter_map(leaf).collect();
        let at_infinity = lights.ids().filter(|&id| is_at_infinity(lights, id)).filter(shines).collect();
        Self { tree: LightTree::new(leaves, lights.len()), at_infinity }
    }

    /// The clusters that hold everything: the tree's root and each light at infinity.
    pub fn roots(&self) -> impl Iterator<Item = Cluster> + '_ {
        let root = self.tree.iter().map(|_| Cluster { key: 0, node: ROOT, bits: 1 });
        root.chain(self.at_infinity.iter().map(|id| Cluster {
            key: AT_INFINITY | u64::from(id.0),
            node: id.0,
            bits: 64,
        }))
    }

    /// The two halves of a cluster that is not one light.
    #[inline]
    pub fn children(&self, cluster: &Cluster) -> Option<[Cluster; 2]> {
        if cluster.is_at_infinity() {
            return None;
        }
        let Below::Nodes([first, second]) = self.tree.as_ref()?.below(cluster.node) else { return None };
        let bits = cluster.bits + 1;
        let turn = 1 << (64 - bits);
        let child = |key, node| Cluster { key, node, bits };
        Some([child(cluster.key, first), child(cluster.key | turn, second)])
    }

    /// The key of a light that shines on everything.
    #[inline]
    pub fn key(&self, lights: &Lights, id: LightId) -> Option<u64> {
        if let Some(trail) = self.tree.as_ref().and_then(|tree| tree.trail(id.0)) {
            return Some(trail.reverse_bits() >> 1);
        }
        let is_here = is_at_infinity(lights, id) && self.at_infinity.binary_search(&id).is_ok();
        is_here.then_some(AT_INFINITY | u64::from(id.0))
    }

    /// The light that a cluster is, if it is one.
    #[inline]
    pub fn light(&self, cluster: &Cluster) -> Option<LightId> {
        if cluster.is_at_infinity() {
            return Some(LightId(cluster.node));
        }
        match self.tree.as_ref()?.below(cluster.node) {
            Below::Light(light) => Some(LightId(light)),
            Below::Nodes(_) => None,
        }
    }

    /// The light of key `key` as a cluster.
    pub fn leaf(&self, lights: &Lights, id: LightId) -> Option<Cluster> {
        let key = self.key(lights, id)?;
        self.roots().find(|root| root.covers(key)).map(|root| {
            let mut cluster = root;
            while let Some(halves) = self.children(&cluster) {
                cluster = halves[usize::from(halves[1].covers(key))];
            }
            cluster
        })
    }

    /// What `receiver` gets of a cluster, unoccluded: of one light its contribution, of several an upper bound.
    #[inline]
    pub fn energy(&self, lights: &Lights, cluster: &Cluster, receiver: &Receiver) -> f32 {
        match (self.light(cluster), &self.tree) {
            (Some(light), _) => lights.contribution(light, receiver),
            (None, Some(tree)) => tree.node(cluster.node).importance(receiver),
            (None, None) => 0.0,
        }
    }

    /// A measure of the strength of a cluster, for sharing out among its parts.
    #[inline]
    pub fn strength(&self, cluster: &Cluster) -> f32 {
        match &self.tree {
            Some(tree) if !cluster.is_at_infinity() => tree.node(cluster.node).energy,
            _ => 1.0,
        }
    }

    /// How much a cluster of several lights looks like many from `p`: its angular size, from a tenth (they count even where they are close
    /// together: some may be hidden) to 1.
    #[inline]
    pub fn spread(&self, cluster: &Cluster, p: Vec3) -> f32 {
        let Some(tree) = self.tree.as_ref().filter(|_| !cluster.is_at_infinity()) else { return 1.0 };
        let node = tree.node(cluster.node);
        let distance = node.centre.distance(p);
        if distance > node.radius { (2.0 * node.radius / distance).clamp(0.1, 1.0) } else { 1.0 }
    }

    /// A light below, and what is left of `u`.
    #[inline]
    pub fn sample_below(&self, cluster: &Cluster, receiver: &Receiver, u: f64) -> Option<(LightId, f64)> {
        if cluster.is_at_infinity() {
            return Some((LightId(cluster.node), u));
        }
        let (light, _, rest) = self.tree.as_ref()?.sample(cluster.node, receiver, u);
        Some((LightId(light), rest))
    }

    /// The probability with which [`Hierarchy::sample_below`] takes the light of key `key`, which is below.
    #[inline]
    pub fn pmf_below(&self, cluster: &Cluster, key: u64, receiver: &Receiver) -> f32 {
        match &self.tree {
            Some(tree) if !cluster.is_at_infinity() => {
                let trail = (key << 1).reverse_bits();
                tree.pmf(cluster.node, cluster.depth(), trail, receiver)
            }
            _ => 1.0,
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.tree.as_ref().map_or(0, LightTree::memory) + size_of_val(&*self.at_infinity)
    }
}

fn is_at_infinity(lights: &Lights, id: LightId) -> bool {
    matches!(lights.get(id), LightRef::Distant(_) | LightRef::Infinite(_))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{DistantLight, PointLight};
    use crate::math::Rgb;

    #[test]
    fn every_light_has_its_place() {
        let mut lights = Lights::default();
        for i in 0..37 {
            let p = Vec3::new(i as f32, (i % 5) as f32, 0.0);
            lights.add_point(PointLight { p, intensity: Rgb::splat(if i == 7 { 0.0 } else { 1.0 }) });
        }
        lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::WHITE });
        let hierarchy = Hierarchy::new(&lights);
        assert_eq!(hierarchy.key(&lights, LightId(7)), None);
        let mut keys = vec![];
        for id in lights.ids().filter(|id| id.0 != 7) {
            let (key, leaf) =
                (hierarchy.key(&lights, id).expect("it shines"), hierarchy.leaf(&lights, id).expect("it shines"));
            assert_eq!(hierarchy.light(&leaf), Some(id));
            assert!(leaf.covers(key) && leaf.key == key);
            assert_eq!(hierarchy.roots().filter(|root| root.covers(key) && root.holds(&leaf)).count(), 1);
            keys.push(key);
        }
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 37);
    }

    #[test]
    fn halves_make_the_whole() {
        let mut lights = Lights::default();
        for i in 0..64 {
            lights.add_point(PointLight { p: Vec3::splat((i * i) as f32), intensity: Rgb::WHITE });
        }
        let hierarchy = Hierarchy::new(&lights);
        let mut open: Vec<Cluster> = hierarchy.roots().collect();
        let mut leaves = 0;
        while let Some(cluster) = open.pop() {
            match hierarchy.children(&cluster) {
                None => leaves += 1,
                Some([a, b]) => {
                    assert!(cluster.holds(&a) && cluster.holds(&b) && !a.holds(&cluster));
                    assert!(a.key == cluster.key && a.last() < b.key && b.last() == cluster.last());
                    open.extend([a, b]);
                }
            }
        }
        assert_eq!(leaves, 64);
    }
}
