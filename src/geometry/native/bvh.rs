//! A bounding volume hierarchy over items of any kind: built by `obvhs`, walked here.
//!
//! Sources: Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017
//! (nodes of eight quantised boxes, octant order, groups on the stack); Ize, "Robust BVH Ray Traversal", JCGT 2013 (boxes must
//! not be missed by rounding). The crate's own walk drops boxes nearer than 10⁻⁴ and has no margins, hence this one.

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::{CwBvhNode, extract_byte64};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::super::build::MAX_COORDINATE;
use super::super::trace::TraceError;

/// Groups of siblings that may wait during a walk. A node of eight children pushes at most one, so this is the depth.
const STACK: usize = 64;

/// The crate numbers 7 decisions for each of 2n nodes in 32 bits.
const MAX_ITEMS: usize = 300_000_000;

/// Levels of the binary tree on the way: more could overflow the stack of a recursion. A sane one has some dozens.
const MAX_BINARY_DEPTH: usize = 2000;

fn check_depth(depth: usize, limit: usize) -> Result<(), TraceError> {
    if depth <= limit {
        return Ok(());
    }
    let what =
        format!("very many primitives lie one inside the other: a hierarchy {depth} levels deep, the limit is {limit}");
    Err(TraceError::Geometry(what))
}

fn binary_depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut pending = vec![(0usize, 1usize)];
    while let Some((index, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        let node = &tree.nodes[index];
        if !node.is_leaf() {
            pending.extend([(node.first_index as usize, depth + 1), (node.first_index as usize + 1, depth + 1)]);
        }
    }
    deepest
}

/// The tree by clustering neighbours, unless it is so deep that what follows, which recurses, could overflow the stack.
fn clustered(boxes: &[Aabb]) -> Option<Bvh2> {
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        3,
    );
    let is_sane = |tree: &Bvh2| binary_depth(tree) <= MAX_BINARY_DEPTH;
    if !is_sane(&tree) {
        return None;
    }
    ReinsertionOptimizer::default().run(&mut tree, 0.05, None);
    is_sane(&tree).then_some(tree)
}

/// The tree that halves the number of boxes at every level, by the order of their middles: as shallow as can be, for boxes that clustering makes a
/// list of, such as those of a fan of thousands of triangles around one point.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let around =
        |range: &[u32]| range.iter().map(|&i| boxes[i as usize]).reduce(|a, b| a.union(&b)).unwrap_or(Aabb::INVALID);
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut pending = vec![(0, 0..boxes.len())];
    while let Some((node, range)) = pending.pop() {
        let part = &mut order[range.clone()];
        if part.len() == 1 {
            nodes[node] = Bvh2Node::new(around(part), 1, range.start as u32);
            continue;
        }
        let middle = |i: u32| boxes[i as usize].center();
        let ends =
            part.iter().map(|&i| middle(i)).fold((middle(part[0]), middle(part[0])), |(a, b), m| (a.min(m), b.max(m)));
        let extent = ends.1 - ends.0;
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
        let first = nodes.len();
        nodes[node] = Bvh2Node::new(around(part), 0, first as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        pending.extend([(first, range.start..range.start + half), (first + 1, range.start + half..range.end)]);
    }
    Bvh2 { nodes, primitive_indices: order, children_are_ordered_after_parents: true, ..Bvh2::default() }
}

/// Items with boxes.
pub(super) struct Bvh<T> {
    nodes: Vec<CwBvhNode>,
    /// In the order the leaves refer to.
    items: Vec<T>,
    /// Where several items share one box: the first item of each box and, last, their number. Empty where none do.
    starts: Vec<u32>,
}

/// A ray as the box test wants it.
pub(super) struct BoxRay {
    origin: Vec3,
    inverse: Vec3,
    negative: [bool; 3],
    octant: u32,
}

impl BoxRay {
    /// Of a nonzero direction.
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        // Components that are zero, or nearly, become tiny: their slabs still contain or exclude the origin as they should.
        let least = direction.abs().max_element() * 1e-18;
        let inverse = direction.to_array().map(|d| 1.0 / if d.abs() < least { least.copysign(d) } else { d });
        let negative = inverse.map(|d| d < 0.0);
        let octant = [4, 2, 1].iter().zip(negative).map(|(bit, negative)| if negative { 0 } else { *bit }).sum();
        Self { origin, inverse: inverse.into(), negative, octant }
    }

    /// The crate's mask of the children whose boxes the segment up to `t_max` may meet.
    #[inline]
    fn hits(&self, node: &CwBvhNode, t_max: f32) -> u32 {
        // Quantisation, the subtraction, both products and the inverse round; each by half an ulp of these magnitudes.
        const MARGIN: f32 = 16.0 * f32::EPSILON;
        let extent = node.compute_extent();
        let axes = [
            (&node.child_min_x, &node.child_max_x),
            (&node.child_min_y, &node.child_max_y),
            (&node.child_min_z, &node.child_max_z),
        ];
        let mut enter = [0.0f32; 8];
        let mut leave = [t_max * (1.0 + MARGIN); 8];
        for (axis, (low, high)) in axes.into_iter().enumerate() {
            let scale = extent[axis] * self.inverse[axis];
            let base = (node.p[axis] - self.origin[axis]) * self.inverse[axis];
            let error = MARGIN * (base.abs() + 255.0 * scale.abs());
            let (near, far) = if self.negative[axis] { (high, low) } else { (low, high) };
            let (near_base, far_base) = (base - error, base + error);
            for i in 0..8 {
                let t0 = f32::from(near[i]) * scale + near_base;
                let t1 = f32::from(far[i]) * scale + far_base;
                enter[i] = if t0 > enter[i] { t0 } else { enter[i] };
                leave[i] = if t1 < leave[i] { t1 } else { leave[i] };
            }
        }
        let (bits, shifts) = node.get_child_and_index_bits(self.octant * 0x0101_0101);
        let mut mask = 0;
        for i in 0..8 {
            if enter[i] <= leave[i] {
                mask |= extract_byte64(bits, i) << extract_byte64(shifts, i);
            }
        }
        mask
    }
}

impl<T: Copy> Bvh<T> {
    /// Builds over items and their boxes (finite, low ≤ high).
    pub(super) fn build(items: &[T], boxes: &[(Vec3, Vec3)]) -> Result<Self, TraceError> {
        if items.len() > MAX_ITEMS {
            return Err(TraceError::Geometry(format!(
                "the native backend holds at most {MAX_ITEMS} primitives in one space, found {}",
                items.len()
            )));
        }
        if items.is_empty() {
            return Ok(Self { nodes: Vec::new(), items: Vec::new(), starts: Vec::new() });
        }
        let within = |v: &Vec3| v.is_finite() && v.abs().max_element() <= MAX_COORDINATE;
        if !boxes.iter().all(|(low, high)| within(low) && within(high)) {
            return Err(TraceError::Geometry(format!("a shape reaches beyond {MAX_COORDINATE:e} units")));
        }
        // Equal boxes tie every choice of the clustering, which then takes quadratic time to build a list: they share a leaf.
        let key = |i: u32| {
            let (low, high) = boxes[i as usize];
            [low, high].map(|v| v.to_array().map(f32::to_bits))
        };
        let mut order: Vec<u32> = (0..items.len() as u32).collect();
        order.par_sort_unstable_by_key(|&i| (key(i), i));
        let unequal = order.windows(2).filter(|pair| key(pair[0]) != key(pair[1])).count() + 1;
        let shared: Vec<&[u32]> = if unequal < items.len() {
            order.chunk_by(|&a, &b| key(a) == key(b)).collect()
        } else {
            order.sort_unstable();
            order.chunks(1).collect()
        };
        let aabb = |same: &&[u32]| {
            let (low, high) = boxes[same[0] as usize];
            Aabb::new(low.into(), high.into())
        };
        let aabbs: Vec<Aabb> = shared.iter().map(aabb).collect();
        let arrange = |binary: &Bvh2| {
            let CwBvh { nodes, primitive_indices, .. } = bvh2_to_cwbvh(binary, 3, true, false);
            let mut starts = Vec::new();
            if unequal < items.len() {
                let mut start = 0;
                starts.push(0);
                for &i in &primitive_indices {
                    start += shared[i as usize].len() as u32;
                    starts.push(start);
                }
            }
            let items =
                primitive_indices.iter().flat_map(|&i| shared[i as usize]).map(|&i| items[i as usize]).collect();
            Self { nodes, items, starts }
        };
        let clustered = clustered(&aabbs).map(|binary| arrange(&binary)).filter(|bvh| bvh.depth() <= STACK);
        let bvh = clustered.unwrap_or_else(|| arrange(&halved(&aabbs)));
        check_depth(bvh.depth(), STACK)?;
        Ok(bvh)
    }

    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut pending = vec![(0u32, 1usize)];
        while let Some((index, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let node = &self.nodes[index as usize];
            for child in 0..8 {
                if !node.is_child_empty(child) && !node.is_leaf(child) {
                    pending.push((node.child_node_index(child), depth + 1));
                }
            }
        }
        deepest
    }

    /// Calls `visit` for every item whose box the segment up to `t_max` may meet, roughly from near to far. `visit` may
    /// shorten the segment; when it returns true the walk stops, and so does this, with true.
    #[inline]
    pub(super) fn walk(&self, ray: &BoxRay, t_max: &mut f32, mut visit: impl FnMut(&T, &mut f32) -> bool) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let mut stack = [(0u32, 0u32); STACK];
        let mut waiting = 0;
        // A group: the first child's number, and the children to visit (bits 24.. in octant order) above the inner mask.
        let mut group = (0u32, 0x8000_0000u32);
        loop {
            if group.1 & 0xff00_0000 == 0 {
                if waiting == 0 {
                    return false;
                }
                waiting -= 1;
                group = stack[waiting];
            }
            let (first, mask) = group;
            let bit = 31 - mask.leading_zeros();
            let rest = mask & !(1 << bit);
            if rest & 0xff00_0000 != 0 {
                stack[waiting] = (first, rest);
                waiting += 1;
            }
            let slot = (bit - 24) ^ ray.octant;
            let before = (mask & !(u32::MAX << slot)).count_ones();
            let node = &self.nodes[(first + before) as usize];
            let hits = ray.hits(node, *t_max);
            group = (node.child_base_idx, (hits & 0xff00_0000) | u32::from(node.imask));
            let mut leaves = hits & 0x00ff_ffff;
            while leaves != 0 {
                let item = node.primitive_base_idx + leaves.trailing_zeros();
                leaves &= leaves - 1;
                let items = if self.starts.is_empty() {
                    item as usize..item as usize + 1
                } else {
                    self.starts[item as usize] as usize..self.starts[item as usize + 1] as usize
                };
                for item in &self.items[items] {
                    if visit(item, t_max) {
                        return true;
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub(super) fn memory(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice()) + size_of_val(self.starts.as_slice())
    }
}
