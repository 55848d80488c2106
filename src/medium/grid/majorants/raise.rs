//! Raising bounds: by a grid's leaves and tiles, or by boxes.

use glam::IVec3;

use super::{CELLS, MajorantsBuilder, REACH, ROOT_SHIFT, fine_slot};
use crate::medium::grid::blocks::{BLOCK_SHIFT, block_of};
use crate::medium::grid::sparse::{LEAF_EDGE, LEAF_SIZE, SparseGrid, Voxel};

/// Up to so many tiles of 128 raise just the cells around them, more the blocks.
const FEW_TILES: usize = 1 << 12;
/// Up to so many tiles of 4096 raise just the blocks around them …
const FEW_ROOTS: usize = 64;
/// … and a box that touches up to so many blocks, or cells of 4096, just those: a file of a few bytes may have more of either than memory holds. Beyond
/// that larger cells are raised, at last the background, which bounds as well.
const MOST_BLOCKS: i128 = 1 << 18;
/// Cubes of 2^`shift` voxels that the box `low..=high` touches.
fn cubes(low: IVec3, high: IVec3, shift: u32) -> i128 {
    let size = (high >> shift as i32).as_i64vec3() - (low >> shift as i32).as_i64vec3() + 1;
    size.to_array().into_iter().map(|n| i128::from(n.max(0))).product()
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
}
