//! Upper bounds of μ_t over cells of index space, as a hierarchy: leaves' cells (8³ voxels), uniform cells of 32 and 128,
//! cells of 4096 under the largest tiles, and empty cells up to 2²⁷ voxels where a grid is scattered that widely.
//!
//! The bound of a cell holds for every trilinear sample at a position in it, and at positions up to one voxel outside, so
//! that rounding of a ray's points in single precision cannot lead past it.

use glam::IVec3;
use rayon::prelude::*;

use super::blocks::{BLOCK_SHIFT, BlockMap, CoordMap, block_of};
use super::clearance;
use super::sparse::{LEAF_EDGE, LEAF_SIZE, SparseGrid, Voxel};

pub(super) const CELLS: usize = 4096;
const UNIFORM: u32 = 1 << 31;
const ROOT_SHIFT: u32 = 12;
/// The sizes (log2) at which a scattered grid knows what is empty, coarsest first.
const EMPTY_SHIFTS: [u32; 4] = [27, 22, 17, 12];
/// Up to so many tiles of 128 raise just the cells around them, more the blocks.
const FEW_TILES: usize = 1 << 12;
/// Up to so many tiles of 4096 raise just the blocks around them …
const FEW_ROOTS: usize = 64;
/// … and a box that touches up to so many blocks, or cells of 4096, just those: a file of a few bytes may have more of either than memory holds. Beyond
/// that larger cells are raised, at last the background, which bounds as well.
const MOST_BLOCKS: i128 = 1 << 18;
/// How far beyond a voxel its value may reach: one voxel of interpolation and one of tolerance.
pub const REACH: i32 = 2;

#[derive(Debug)]
struct Node {
    /// Of each cell of 8³ voxels.
    fine: [f32; CELLS],
    /// Of each cell of 32³ voxels: its bound if all fine cells in it have the same; NaN otherwise.
    middle: [f32; 64],
    /// Of each cell of 8³ voxels that is empty: how many cells away the nearest other is; 0 of others. See [`clearance`].
    clear: [u8; CELLS],
}

/// Collects bounds; cells not raised keep the background's.
#[derive(Debug, Default)]
pub struct MajorantsBuilder {
    blocks: CoordMap<(f32, Option<Box<[f32; CELLS]>>)>,
    roots: CoordMap<f32>,
    bounds: Option<(IVec3, IVec3)>,
    background: f32,
}

/// The finished hierarchy.
#[derive(Debug)]
pub struct Majorants {
    blocks: BlockMap,
    nodes: Vec<Box<Node>>,
    uniform: Vec<f32>,
    roots: CoordMap<f32>,
    /// Which cells of each of [`EMPTY_SHIFTS`] hold anything; empty for grids that lie close together.
    occupied: Vec<CoordMap<()>>,
    background: f32,
    largest: f32,
    /// Where anything but the background may be met, inclusive.
    bounds: Option<(IVec3, IVec3)>,
}

/// Cubes of 2^`shift` voxels that the box `low..=high` touches.
fn cubes(low: IVec3, high: IVec3, shift: u32) -> i128 {
    let size = (high >> shift as i32).as_i64vec3() - (low >> shift as i32).as_i64vec3() + 1;
    size.to_array().into_iter().map(|n| i128::from(n.max(0))).product()
}

pub(super) fn fine_slot(cell: IVec3) -> usize {
    let at: IVec3 = cell & 15i32;
    ((at.x << 8) | (at.y << 4) | at.z) as usize
}

impl MajorantsBuilder {
    /// A builder; `background` is the bound wherever nothing is stored.
    pub fn new(background: f32) -> Self {
        Self { background, ..Self::default() }
    }

    fn include(&mut self, low: IVec3, high: IVec3) {
        let low = low.saturating_sub(IVec3::splat(REACH));
        let high = high.saturating_add(IVec3::splat(REACH));
        let (a, b) = self.bounds.unwrap_or((low, high));
        self.bounds = Some((a.min(low), b.max(high)));
    }

    /// Raises the cell number `cell` (index >> 3).
    fn raise_fine(&mut self, cell: IVec3, bound: f32) {
        let background = self.background;
        let (floor, fine) = self.blocks.entry(cell >> 4i32).or_insert((background, None));
        if bound <= *floor {
            return;
        }
        let fine = fine.get_or_insert_with(|| Box::new([background; CELLS]));
        let slot = &mut fine[fine_slot(cell)];
        *slot = slot.max(bound);
    }

    fn raise_block(&mut self, block: IVec3, bound: f32) {
        let (floor, _) = self.blocks.entry(block).or_insert((self.background, None));
        *floor = floor.max(bound);
    }

    fn raise_blocks_around(&mut self, block: IVec3, bound: f32) {
        for direction in 0..27 {
            let step = IVec3::new(direction / 9, direction / 3 % 3, direction % 3) - 1;
            self.raise_block(block.wrapping_add(step), bound);
        }
    }

    /// Raises every cell that the box `low..=high` of voxels touches or reaches.
    pub fn raise_box(&mut self, low: IVec3, high: IVec3, bound: f32) {
        if bound <= self.background {
            return;
        }
        self.raise_voxels(low.saturating_sub(IVec3::splat(REACH)), high.saturating_add(IVec3::splat(REACH)), bound);
    }

    /// Raises the cells that hold the voxels `low..=high`.
    pub fn raise_voxels(&mut self, low: IVec3, high: IVec3, bound: f32) {
        if bound <= self.background {
            return;
        }
        let (a, b) = self.bounds.unwrap_or((low, high));
        self.bounds = Some((a.min(low), b.max(high)));
        if cubes(low, high, BLOCK_SHIFT) > MOST_BLOCKS {
            return self.raise_coarsely(low, high, bound);
        }
        let (first, last) = (low >> 3i32, high >> 3i32);
        let block_inside = |block: IVec3| {
            let corner: IVec3 = block << 4i32;
            corner.cmpge(first).all() && (corner + 15).cmple(last).all()
        };
        for bx in first.x >> 4..=last.x >> 4 {
            for by in first.y >> 4..=last.y >> 4 {
                for bz in first.z >> 4..=last.z >> 4 {
                    let block = IVec3::new(bx, by, bz);
                    if block_inside(block) {
                        self.raise_block(block, bound);
                        continue;
                    }
                    let (a, b) = ((block << 4i32).max(first), ((block << 4i32) + 15).min(last));
                    for x in a.x..=b.x {
                        for y in a.y..=b.y {
                            for z in a.z..=b.z {
                                self.raise_fine(IVec3::new(x, y, z), bound);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Raises cells of 4096 voxels that the box `low..=high` touches, or, if they are too many, whatever there is.
    fn raise_coarsely(&mut self, low: IVec3, high: IVec3, bound: f32) {
        if cubes(low, high, ROOT_SHIFT) > MOST_BLOCKS {
            self.background = self.background.max(bound);
            return;
        }
        let (first, last) = (low >> ROOT_SHIFT as i32, high >> ROOT_SHIFT as i32);
        for x in first.x..=last.x {
            for y in first.y..=last.y {
                for z in first.z..=last.z {
                    self.raise_root(IVec3::new(x, y, z), bound);
                }
            }
        }
    }

    fn raise_root(&mut self, root: IVec3, bound: f32) {
        let known = self.roots.entry(root).or_insert(bound);
        *known = known.max(bound);
    }

    /// Raises what a tile of 4096 voxels reaches around it, the cells of all such tiles being raised: the blocks next to it, or, where there are many tiles,
    /// the cells.
    fn add_shell(&mut self, root: IVec3, bound: f32, many: bool) {
        for direction in (0..27).filter(|&direction| direction != 13) {
            let step = IVec3::new(direction / 9, direction / 3 % 3, direction % 3) - 1;
            let beside = root.wrapping_add(step);
            if self.roots.get(&beside).is_some_and(|&known| known >= bound) {
                continue;
            }
            if many {
                self.raise_root(beside, bound);
                continue;
            }
            // The layer of blocks that touches the tile.
            const BLOCKS: i32 = 1 << (ROOT_SHIFT - BLOCK_SHIFT);
            let corner = IVec3::from_array(root.to_array().map(|c| c.wrapping_shl(ROOT_SHIFT - BLOCK_SHIFT)));
            let range = |axis: usize| match step[axis] {
                -1 => -1..=-1,
                0 => 0..=BLOCKS - 1,
                _ => BLOCKS..=BLOCKS,
            };
            for x in range(0) {
                for y in range(1) {
                    for z in range(2) {
                        self.raise_block(corner.wrapping_add(IVec3::new(x, y, z)), bound);
                    }
                }
            }
        }
    }

    /// Raises cells to `bound(value)` of every stored value of `grid`, whose index space is this one's. `bound` must not
    /// fall as the value rises.
    pub fn add<V: Voxel>(&mut self, grid: &SparseGrid<V>, bound: impl Fn(f32) -> f32) {
        for (origin, leaf) in grid.leaves() {
            self.add_leaf(origin, leaf, &bound);
        }
        let mut tiles = Vec::new();
        let coarse = grid.tiles().iter().filter(|tile| tile.edge == 128).count() > FEW_TILES;
        for tile in grid.tiles() {
            let m = bound(V::maximum(tile.value));
            if m <= self.background {
                continue;
            }
            let high = tile.origin.saturating_add(IVec3::splat(tile.edge - 1));
            if tile.edge == 128 && coarse {
                self.include(tile.origin, high);
                self.raise_blocks_around(block_of(tile.origin), m);
                continue;
            }
            if tile.edge < 4096 {
                self.raise_box(tile.origin, high, m);
                continue;
            }
            self.include(tile.origin, high);
            let root = tile.origin >> ROOT_SHIFT as i32;
            self.raise_root(root, m);
            tiles.push((root, m));
        }
        let many = tiles.len() > FEW_ROOTS;
        for (root, m) in tiles {
            self.add_shell(root, m, many);
        }
    }

    fn add_leaf<V: Voxel>(&mut self, origin: IVec3, leaf: &[V; LEAF_SIZE], bound: &impl Fn(f32) -> f32) {
        // Each axis falls into layers 0, 1 (seen by the cell below), 2..=6, and 7 (seen by the cell above): the cell at
        // `8c` depends on voxels 8c − 1 ..= 8c + 9.
        let layer = |i: usize| match i {
            0 | 1 => 0usize,
            7 => 2,
            _ => 1,
        };
        let mut parts = [f32::NEG_INFINITY; 27];
        for (offset, v) in leaf.iter().enumerate() {
            let part = &mut parts[layer(offset >> 6) * 9 + layer((offset >> 3) & 7) * 3 + layer(offset & 7)];
            *part = part.max(V::maximum(v.get()));
        }
        let whole = parts.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if bound(whole) <= self.background {
            return;
        }
        self.include(origin, origin + (LEAF_EDGE - 1));
        let cell: IVec3 = origin >> 3i32;
        for direction in 0..27usize {
            let d = [direction / 9, direction / 3 % 3, direction % 3];
            // Towards −1 only layer 0 is seen, towards +1 only layer 2, and straight all of them.
            let seen = |axis: usize, layer: usize| d[axis] == 1 || layer == d[axis];
            let mut largest = f32::NEG_INFINITY;
            for (part, value) in parts.iter().enumerate() {
                if seen(0, part / 9) && seen(1, part / 3 % 3) && seen(2, part % 3) {
                    largest = largest.max(*value);
                }
            }
            let m = bound(largest);
            if m > self.background {
                let step = IVec3::new(d[0] as i32 - 1, d[1] as i32 - 1, d[2] as i32 - 1);
                self.raise_fine(cell.wrapping_add(step), m);
            }
        }
    }

    /// The hierarchy.
    pub fn build(self) -> Majorants {
        let mut nodes = Vec::new();
        let mut uniform = Vec::new();
        let mut pairs = Vec::with_capacity(self.blocks.len());
        let mut largest = self.roots.values().copied().fold(self.background, f32::max);
        for (block, (floor, fine)) in self.blocks {
            let root = self.roots.get(&(block >> (ROOT_SHIFT - BLOCK_SHIFT) as i32)).copied();
            let floor = floor.max(root.unwrap_or(self.background));
            let fine = fine.map(|mut fine| {
                for value in fine.iter_mut() {
                    *value = value.max(floor);
                    largest = largest.max(*value);
                }
                fine
            });
            largest = largest.max(floor);
            match fine {
                Some(fine) if fine.iter().any(|&v| v != fine[0]) => {
                    pairs.push((block, nodes.len() as u32));
                    nodes.push(Box::new(Node { middle: uniform_middles(&fine), fine: *fine, clear: [0; CELLS] }));
                }
                fine => {
                    pairs.push((block, uniform.len() as u32 | UNIFORM));
                    uniform.push(fine.map_or(floor, |f| f[0]));
                }
            }
        }
        let blocks = BlockMap::new(&pairs);
        let occupied = if matches!(blocks, BlockMap::Sparse(_)) || !self.roots.is_empty() {
            let of = |shift: u32| {
                let near = pairs.iter().map(|(block, _)| *block >> (shift - BLOCK_SHIFT) as i32);
                near.chain(self.roots.keys().map(|root| *root >> (shift - ROOT_SHIFT) as i32))
                    .map(|c| (c, ()))
                    .collect()
            };
            EMPTY_SHIFTS.map(of).into()
        } else {
            Vec::new()
        };
        let mut majorants = Majorants {
            blocks,
            nodes,
            uniform,
            roots: self.roots,
            occupied,
            background: self.background,
            largest,
            bounds: self.bounds,
        };
        majorants.measure_clearances();
        majorants
    }
}

fn uniform_middles(fine: &[f32; CELLS]) -> [f32; 64] {
    std::array::from_fn(|middle| {
        let (x0, y0, z0) = (middle >> 4 << 2, (middle >> 2 & 3) << 2, (middle & 3) << 2);
        let at = |i: usize| fine[((x0 + (i >> 4)) << 8) | ((y0 + (i >> 2 & 3)) << 4) | (z0 + (i & 3))];
        if (1..64).all(|i| at(i) == at(0)) { at(0) } else { f32::NAN }
    })
}

impl Majorants {
    /// The largest bound anywhere.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// Where anything but the background may be met: voxels, inclusive.
    pub fn bounds(&self) -> Option<(IVec3, IVec3)> {
        self.bounds
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.blocks.memory() + self.uniform.len() * 4
    }

    /// Cell by cell what `with` makes of this bound and that of `other`, which is over the same cells.
    pub fn combined(&self, other: &Self, with: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = MajorantsBuilder::new(with(self.background, other.background));
        out.bounds = match (self.bounds, other.bounds) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (bounds, None) | (None, bounds) => bounds,
        };
        for root in self.roots.keys().chain(other.roots.keys()) {
            let of = |m: &Self| m.roots.get(root).copied().unwrap_or(m.background);
            out.roots.insert(*root, with(of(self), of(other)));
        }
        for block in self.blocks.iter().chain(other.blocks.iter()).map(|(block, _)| block) {
            out.blocks.entry(block).or_insert_with(|| match (self.block(block), other.block(block)) {
                (Ok(a), Ok(b)) => (with(a, b), None),
                (a, b) => {
                    let of = |part: &Result<f32, &Node>, slot: usize| part.map_or_else(|n| n.fine[slot], |bound| bound);
                    let fine = std::array::from_fn(|slot| with(of(&a, slot), of(&b, slot)));
                    (0.0, Some(Box::new(fine)))
                }
            });
        }
        out.build()
    }

    /// The same bounds, to be raised.
    pub fn to_builder(&self) -> MajorantsBuilder {
        let mut out = MajorantsBuilder::new(self.background);
        out.bounds = self.bounds;
        out.roots.clone_from(&self.roots);
        for (block, _) in self.blocks.iter() {
            let part = match self.block(block) {
                Ok(bound) => (bound, None),
                Err(node) => (self.background, Some(Box::new(node.fine))),
            };
            out.blocks.insert(block, part);
        }
        out
    }

    /// Visits all cells of one bound that is above the background's: low corner, edge, and the bound.
    pub fn each_cell(&self, mut visit: impl FnMut(IVec3, i32, f32)) {
        let corner = |c: IVec3, shift: u32| IVec3::from_array(c.to_array().map(|c| c.wrapping_shl(shift)));
        self.roots.iter().for_each(|(root, &bound)| visit(corner(*root, ROOT_SHIFT), 1 << ROOT_SHIFT, bound));
        for (block, _) in self.blocks.iter() {
            let low = corner(block, BLOCK_SHIFT);
            match self.block(block) {
                Ok(bound) if bound > self.background => visit(low, 1 << BLOCK_SHIFT, bound),
                Ok(_) => {}
                Err(node) => {
                    for (slot, &bound) in node.fine.iter().enumerate().filter(|(_, bound)| **bound > self.background) {
                        let cell = IVec3::new(slot as i32 >> 8, slot as i32 >> 4 & 15, slot as i32 & 15);
                        visit(low + 8 * cell, 8, bound);
                    }
                }
            }
        }
    }

    /// The one bound of a block, or else its node.
    fn block(&self, block: IVec3) -> Result<f32, &Node> {
        match self.blocks.get(block) {
            Some(code) if code & UNIFORM == 0 => Err(&self.nodes[code as usize]),
            Some(code) => Ok(self.uniform[(code & !UNIFORM) as usize]),
            None => {
                let root = self.roots.get(&(block >> (ROOT_SHIFT - BLOCK_SHIFT) as i32));
                Ok(root.copied().unwrap_or(self.background))
            }
        }
    }

    /// Notes for every empty cell how far it is to one that is not.
    fn measure_clearances(&mut self) {
        // Scattered grids have other means; and a cube must not reach beyond all numbers.
        if !self.occupied.is_empty() {
            return;
        }
        let is_within = |block: IVec3| block.abs().max_element() < (1 << (31 - BLOCK_SHIFT)) - 1;
        let of_nodes: Vec<(IVec3, u32)> =
            self.blocks.iter().filter(|&(block, code)| code & UNIFORM == 0 && is_within(block)).collect();
        let measured: Vec<(u32, [u8; CELLS])> = of_nodes
            .into_par_iter()
            .map(|(block, node)| {
                let is_empty = |other: IVec3, slot: usize| {
                    self.block(other).unwrap_or_else(|node| node.fine[slot]) == self.background
                };
                (node, clearance::measure(block, is_empty))
            })
            .collect();
        for (node, clear) in measured {
            self.nodes[node as usize].clear = clear;
        }
    }

    /// A box of voxels, inclusive, around all cells whose bound is above `least`, which is not below the background.
    pub fn box_above(&self, least: f32) -> Option<(IVec3, IVec3)> {
        let mut all: Option<(IVec3, IVec3)> = None;
        self.each_cell(|low, edge, bound| {
            if bound > least {
                let high = low.saturating_add(IVec3::splat(edge - 1));
                all = Some(all.map_or((low, high), |(a, b)| (a.min(low), b.max(high))));
            }
        });
        // Bounds reach as far as interpolation does, cells further.
        all.zip(self.bounds).map(|((a, b), (low, high))| (a.max(low), b.min(high)))
    }

    /// The bound where nothing is stored.
    pub fn background(&self) -> f32 {
        self.background
    }

    /// A cube of one bound around the voxel, as large as is known: low corner, edge, and the bound.
    #[inline]
    pub fn cube(&self, voxel: IVec3) -> (IVec3, i64, f32) {
        if self.occupied.is_empty()
            && let Some(code) = self.blocks.get(block_of(voxel))
            && code & UNIFORM == 0
        {
            let node = &self.nodes[code as usize];
            let cell: IVec3 = voxel >> 3i32;
            let slot = fine_slot(cell);
            let at: IVec3 = (cell >> 2i32) & 3i32;
            let bound = node.fine[slot];
            let is_mixed = node.middle[((at.x << 4) | (at.y << 2) | at.z) as usize].is_nan();
            let around = if bound == self.background { i32::from(node.clear[slot]) - 1 } else { 0 };
            return if around >= 2 || (around == 1 && is_mixed) {
                ((cell - around) << 3i32, i64::from(8 * (2 * around + 1)), bound)
            } else if is_mixed {
                (cell << 3i32, 8, bound)
            } else {
                ((cell >> 2i32) << 5i32, 32, bound)
            };
        }
        let (shift, bound) = self.cell(voxel);
        ((voxel >> shift as i32) << shift as i32, 1 << shift, bound)
    }

    /// The largest known cell of one bound that holds the voxel: log2 of its edge, and the bound.
    #[inline]
    pub fn cell(&self, voxel: IVec3) -> (u32, f32) {
        for (shift, cells) in EMPTY_SHIFTS.iter().zip(&self.occupied) {
            if !cells.contains_key(&(voxel >> *shift as i32)) {
                return (*shift, self.background);
            }
        }
        match self.blocks.get(block_of(voxel)) {
            Some(code) if code & UNIFORM == 0 => {
                let node = &self.nodes[code as usize];
                let cell: IVec3 = voxel >> 3i32;
                let at: IVec3 = (cell >> 2i32) & 3i32;
                let middle = node.middle[((at.x << 4) | (at.y << 2) | at.z) as usize];
                if middle.is_nan() { (3, node.fine[fine_slot(cell)]) } else { (5, middle) }
            }
            Some(code) => (BLOCK_SHIFT, self.uniform[(code & !UNIFORM) as usize]),
            None if self.roots.is_empty() => (BLOCK_SHIFT, self.background),
            None => match self.roots.get(&(voxel >> ROOT_SHIFT as i32)) {
                // Blocks within a root tile exist where a neighbour raises them, so only this block is sure.
                Some(&bound) => (BLOCK_SHIFT, bound),
                None => (BLOCK_SHIFT, self.background),
            },
        }
    }
}
