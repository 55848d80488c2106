//! The lights as cache points see them: the light hierarchy, and beside it the lights that are infinitely far away.
//!
//! Every light that shines has a place: the tree's from left to right, then those at infinity. A cluster is a range of places, so lists
//! of disjoint clusters can be ordered, and the one that holds a light found by one binary search.

use arrayvec::ArrayVec;

use crate::light::tree::{LANES, LightTree, MOST_IN_LEAF, Parts, Way, importances};
use crate::light::{LightId, LightRef, Lights, Receiver};

pub use crate::light::tree::Cluster;

/// The node of lights at infinity.
const AT_INFINITY: u32 = u32::MAX;

/// The tree and the lights at infinity.
#[derive(Debug)]
pub struct Hierarchy {
    tree: Option<LightTree>,
    at_infinity: Vec<LightId>,
}

impl Hierarchy {
    /// Over all lights that shine on everything: exclusive ones are added at the vertices they shine on.
    /// Ways to the lights of a cluster end where those are `alike`, if they shall.
    pub fn new(lights: &Lights, alike: bool) -> Self {
        let shines =
            |id: &LightId| !lights.is_dark(*id) && !lights.linking().is_some_and(|linking| linking.is_exclusive(*id));
        let (at_infinity, finite): (Vec<LightId>, Vec<LightId>) =
            lights.ids().filter(shines).partition(|&id| is_at_infinity(lights, id));
        let finite = finite.into_iter().map(|id| id.0).collect();
        let mut tree = LightTree::new(lights, finite, lights.len(), MOST_IN_LEAF);
        if let Some(tree) = tree.as_mut().filter(|_| alike) {
            tree.end_where_alike(lights);
        }
        Self { tree, at_infinity }
    }

    /// Places in the tree; from here on those at infinity follow.
    fn finite(&self) -> u32 {
        self.tree.as_ref().map_or(0, LightTree::len)
    }

    /// How many places there are.
    #[inline]
    pub fn places(&self) -> u32 {
        self.finite() + self.at_infinity.len() as u32
    }

    /// The clusters that hold everything: the tree's root and each light at infinity.
    pub fn roots(&self) -> impl Iterator<Item = Cluster> + '_ {
        let at_infinity = |place| Cluster { first: place, count: 1, node: AT_INFINITY };
        self.tree.iter().map(LightTree::root).chain((self.finite()..self.places()).map(at_infinity))
    }

    /// The places of each node of the tree: the first, and one past the last.
    pub fn spans(&self) -> Vec<[u32; 2]> {
        let mut spans = vec![];
        let mut open: Vec<Cluster> = self.roots().filter(|cluster| cluster.node != AT_INFINITY).collect();
        while let Some(cluster) = open.pop() {
            let node = cluster.node as usize;
            if spans.len() <= node {
                spans.resize(node + 1, [0; 2]);
            }
            spans[node] = [cluster.first, cluster.end()];
            open.extend(self.children(&cluster).into_iter().filter(|child| child.node != cluster.node));
        }
        spans
    }

    /// Whether there is such a cluster; `spans` are those of this hierarchy.
    pub fn has(&self, spans: &[[u32; 2]], cluster: &Cluster) -> bool {
        let Cluster { first, count, node } = *cluster;
        if node == AT_INFINITY {
            return count == 1 && (self.finite()..self.places()).contains(&first);
        }
        spans.get(node as usize).is_some_and(|&[start, end]| {
            let is_whole = [start, end] == [first, first.saturating_add(count)];
            // Of one light among several in a leaf, the leaf.
            let is_of_leaf = count == 1 && (start..end).contains(&first) && (end - start) as usize <= MOST_IN_LEAF;
            start < end && (is_whole || is_of_leaf)
        })
    }

    /// What a cluster of several lights falls into. Nothing for one light.
    #[inline]
    pub fn children(&self, cluster: &Cluster) -> ArrayVec<Cluster, MOST_IN_LEAF> {
        match &self.tree {
            Some(tree) if cluster.count > 1 => tree.children(cluster),
            _ => ArrayVec::new(),
        }
    }

    /// The place of a light that shines on everything.
    #[inline]
    pub fn place(&self, lights: &Lights, id: LightId) -> Option<u32> {
        if let Some(place) = self.tree.as_ref().and_then(|tree| tree.place(id.0)) {
            return Some(place);
        }
        let is_here = || self.at_infinity.binary_search(&id).ok();
        if is_at_infinity(lights, id) { Some(self.finite() + is_here()? as u32) } else { None }
    }

    /// The light that a cluster is, if it is one.
    #[inline]
    pub fn light(&self, cluster: &Cluster) -> Option<LightId> {
        if cluster.node == AT_INFINITY {
            return Some(self.at_infinity[(cluster.first - self.finite()) as usize]);
        }
        self.tree.as_ref()?.light(cluster).map(LightId)
    }

    /// The light at `place` as a cluster.
    pub fn leaf(&self, place: u32) -> Option<Cluster> {
        let mut cluster = self.roots().find(|root| root.covers(place))?;
        while let Some(next) = self.children(&cluster).into_iter().find(|child| child.covers(place)) {
            cluster = next;
        }
        Some(cluster)
    }

    /// What `receiver` gets of a cluster, unoccluded: of one light its contribution, of several an estimate.
    #[inline]
    pub fn energy(&self, lights: &Lights, cluster: &Cluster, receiver: &Receiver) -> f32 {
        match (self.light(cluster), &self.tree) {
            (Some(light), _) => lights.contribution(light, receiver),
            (None, Some(tree)) => tree.node(cluster.node).importance(receiver),
            (None, None) => 0.0,
        }
    }

    /// What `receiver` gets of each of the clusters of several lights at these nodes, of none where there is no tree.
    #[inline]
    pub fn energies(&self, nodes: [u32; LANES], receiver: &Receiver) -> [f32; LANES] {
        self.tree.as_ref().map_or([0.0; LANES], |tree| importances(nodes.map(|node| tree.node(node)), receiver))
    }

    /// A measure of the strength of a cluster, for sharing out among its parts.
    pub fn strength(&self, lights: &Lights, cluster: &Cluster) -> f32 {
        match &self.tree {
            Some(tree) if cluster.node != AT_INFINITY => match tree.light(cluster) {
                Some(light) => lights.bounds(light).energy,
                None => tree.node(cluster.node).energy,
            },
            _ => 1.0,
        }
    }

    /// Centre and radius of a ball around a cluster; `None` at infinity.
    pub fn ball(&self, lights: &Lights, cluster: &Cluster) -> Option<(glam::Vec3, f32)> {
        let tree = self.tree.as_ref().filter(|_| cluster.node != AT_INFINITY)?;
        Some(match tree.light(cluster) {
            Some(light) => {
                let bounds = lights.bounds(light);
                (bounds.centre(), bounds.radius)
            }
            None => {
                let node = tree.node(cluster.node);
                (node.centre, node.radius)
            }
        })
    }

    /// How much a cluster of several lights looks like many from `p`: its angular size, from a tenth (they count even where they are close
    /// together: some may be hidden) to 1.
    #[inline]
    pub fn spread(&self, cluster: &Cluster, p: glam::Vec3) -> f32 {
        let Some(tree) = self.tree.as_ref().filter(|_| cluster.node != AT_INFINITY) else { return 1.0 };
        let node = tree.node(cluster.node);
        let distance = node.centre.distance(p);
        if distance > node.radius { (2.0 * node.radius / distance).clamp(0.1, 1.0) } else { 1.0 }
    }

    /// Has fetched what [`Hierarchy::descend`] reads first of a way that begins at `cluster`.
    #[inline]
    pub fn fetch(&self, cluster: &Cluster) {
        if let Some(tree) = self.tree.as_ref().filter(|_| cluster.node != AT_INFINITY) {
            tree.fetch(cluster);
        }
    }

    /// Takes ways to lights down from the clusters where they begin, all at once.
    #[inline]
    pub fn descend(&self, lights: &Lights, ways: &mut [Way], receiver: &Receiver) {
        if let Some(tree) = &self.tree {
            tree.descend(lights, ways, receiver);
        }
    }

    /// The light that a way leads to after [`Hierarchy::descend`], its probability given the cluster, and what is left of the way's number.
    #[inline]
    pub fn arrive(&self, lights: &Lights, way: Way, receiver: &Receiver) -> (LightId, f32, f64) {
        match &self.tree {
            Some(tree) if way.cluster().node != AT_INFINITY => {
                let (light, pmf, rest) = tree.arrive(lights, way, receiver);
                (LightId(light), pmf, rest)
            }
            _ => (self.at_infinity[(way.cluster().first - self.finite()) as usize], 1.0, way.rest()),
        }
    }

    /// The probability with which a way from the cluster leads to the light at `place`, which is below.
    #[inline]
    pub fn pmf_below(&self, lights: &Lights, cluster: &Cluster, place: u32, receiver: &Receiver) -> f32 {
        match &self.tree {
            Some(tree) if cluster.count > 1 => tree.pmf(lights, cluster, place, receiver),
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
    use glam::Vec3;

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
        let hierarchy = Hierarchy::new(&lights, true);
        assert_eq!(hierarchy.place(&lights, LightId(7)), None);
        let mut places = vec![];
        for id in lights.ids().filter(|id| id.0 != 7) {
            let place = hierarchy.place(&lights, id).expect("it shines");
            let leaf = hierarchy.leaf(place).expect("it has a place");
            assert_eq!(hierarchy.light(&leaf), Some(id));
            assert!(leaf.covers(place) && leaf.first == place && leaf.count == 1);
            assert_eq!(hierarchy.roots().filter(|root| root.covers(place) && root.holds(&leaf)).count(), 1);
            places.push(place);
        }
        places.sort_unstable();
        assert!(places.into_iter().eq(0..hierarchy.places()));
    }

    #[test]
    fn children_make_the_whole() {
        let mut lights = Lights::default();
        for i in 0..64 {
            lights.add_point(PointLight { p: Vec3::splat((i * i) as f32), intensity: Rgb::WHITE });
        }
        let hierarchy = Hierarchy::new(&lights, true);
        let mut open: Vec<Cluster> = hierarchy.roots().collect();
        let mut leaves = 0;
        while let Some(cluster) = open.pop() {
            let children = hierarchy.children(&cluster);
            if children.is_empty() {
                leaves += cluster.count;
                continue;
            }
            let mut next = cluster.first;
            for child in &children {
                assert!(child.first == next && cluster.holds(child) && !child.holds(&cluster));
                next = child.end();
            }
            assert_eq!(next, cluster.end());
            open.extend(children);
        }
        assert_eq!(leaves, 64);
    }
}
