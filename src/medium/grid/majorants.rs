//! Upper bounds of μ_t over cells of index space, as a hierarchy: leaves' cells (8³ voxels), uniform cells of 32 and 128,
//! cells of 4096 under the largest tiles, and empty cells up to 2²⁷ voxels where a grid is scattered that widely.
//!
//! The bound of a cell holds for every trilinear sample at a position in it, and at positions up to one voxel outside, so
//! that rounding of a ray's points in single precision cannot lead past it.

mod build;
mod derive;
mod raise;

use glam::IVec3;

use super::blocks::{BLOCK_SHIFT, BlockMap, CoordMap, block_of};

pub(super) const CELLS: usize = 4096;
const UNIFORM: u32 = 1 << 31;
const ROOT_SHIFT: u32 = 12;
/// The sizes (log2) at which a scattered grid knows what is empty, coarsest first.
const EMPTY_SHIFTS: [u32; 4] = [27, 22, 17, 12];
/// How far beyond a voxel its value may reach: one voxel of interpolation and one of tolerance.
pub const REACH: i32 = 2;

#[derive(Debug)]
struct Node {
    /// Of each cell of 8³ voxels.
    fine: [f32; CELLS],
    /// Of each cell of 32³ voxels: its bound if all fine cells in it have the same; NaN otherwise.
    middle: [f32; 64],
    /// Of each cell of 8³ voxels that is empty: how many cells away the nearest other is; 0 of others. See [`super::clearance`].
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

pub(super) fn fine_slot(cell: IVec3) -> usize {
    let at: IVec3 = cell & 15i32;
    ((at.x << 8) | (at.y << 4) | at.z) as usize
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
