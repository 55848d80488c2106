//! A grid's tree: a root, nodes of 32³ and of 16³, leaves of 8³. Each node is a header, masks and a table that begins at a multiple of 32 bytes; children
//! are told by their distance in bytes.

use std::collections::HashSet;

use glam::IVec3;

use super::bytes::{Bytes, all, cut};
use crate::medium::grid::sparse::{LEAF_SIZE, SparseGrid, TileOf};

/// How values are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// As single precision numbers.
    Float,
    /// As double precision numbers.
    Double,
    /// In each leaf as so many bits, a power of two, or as many as the leaf says; elsewhere as single precision numbers.
    Quantised(Option<u32>),
}

impl Kind {
    /// That of the grid type with this number, if it is of numbers.
    pub fn of(number: u32) -> Option<Self> {
        Some(match number {
            1 => Self::Float,
            2 => Self::Double,
            13 => Self::Quantised(Some(4)),
            14 => Self::Quantised(Some(8)),
            15 => Self::Quantised(Some(16)),
            16 => Self::Quantised(None),
            _ => return None,
        })
    }

    /// Bytes of a value outside of leaves, which is their alignment too.
    fn size(self) -> usize {
        if self == Self::Double { 8 } else { 4 }
    }

    fn value(self, bytes: &Bytes<'_>, at: usize) -> Result<f32, String> {
        if self == Self::Double { bytes.f64(at).map(|v| v as f32) } else { bytes.f32(at) }
    }

    /// Where a table begins after `fixed` bytes, so many values, a mean and a deviation.
    fn table(self, fixed: usize, values: usize) -> usize {
        (fixed.next_multiple_of(self.size()) + (values + 2) * self.size()).next_multiple_of(32)
    }
}

const TILE: usize = 32;
/// Box and flags of an inner node.
const NODE_FIXED: usize = 32;
const LEAF_MASK: usize = 64;
/// Box and flags of a leaf, and its mask.
const LEAF_FIXED: usize = 16 + LEAF_MASK;
/// Header of a quantised leaf: the above, then minimum, step and statistics.
const QUANTISED_FIXED: usize = LEAF_FIXED + 16;

/// What a walk over the tree gathers.
struct Walk<'a> {
    grid: &'a Bytes<'a>,
    kind: Kind,
    background: f32,
    origins: Vec<IVec3>,
    values: Vec<f32>,
    tiles: Vec<TileOf<f32>>,
    /// Inner nodes that may still be visited: more do not fit into the file, so some would be visited twice.
    nodes_left: usize,
    leaves_left: usize,
}

/// The voxels of `grid`, whose tree begins at `tree`. Level sets become fog volumes: from 0 outside to 1 inside, across the narrow band (as OpenVDB's
/// `sdfToFogVolume`).
pub(super) fn voxels(grid: &Bytes<'_>, tree: usize, kind: Kind, is_level_set: bool) -> Result<SparseGrid<f32>, String> {
    // The last of four distances is the root's.
    let root = offset(tree, grid.i64(tree + 24)?)?;
    let count = grid.u32(root + 24)? as usize;
    let background = kind.value(grid, (root + 28).next_multiple_of(kind.size()))?;
    let first = root + kind.table(28, 3);
    let lower_size = kind.table(NODE_FIXED + 2 * 512, 2) + 4096 * 8;
    let leaf_size = match kind {
        Kind::Float => 96 + 4 * LEAF_SIZE,
        Kind::Double => 128 + 8 * LEAF_SIZE,
        Kind::Quantised(bits) => QUANTISED_FIXED + LEAF_SIZE / 8 * bits.unwrap_or(1) as usize,
    };
    let length = grid.0.len();
    let mut walk = Walk {
        grid,
        kind,
        background,
        origins: vec![],
        values: vec![],
        tiles: vec![],
        nodes_left: length / lower_size + 1,
        leaves_left: length / leaf_size + 1,
    };
    // Before a table of any length is believed.
    grid.part(first, count.checked_mul(TILE).ok_or_else(cut)?)?;
    let mut known = HashSet::new();
    for number in 0..count {
        let at = first + number * TILE;
        let key = grid.u64(at)?;
        // 21 bits an axis, the last axis lowest; each counts 4096 voxels, and wraps around for negative ones.
        let part = |shift: u32| (((key >> shift & 0x1f_ffff) as u32) << 12) as i32;
        let origin = IVec3::new(part(42), part(21), part(0));
        if !known.insert(origin) {
            return Err(cut());
        }
        match grid.i64(at + 8)? {
            0 => walk.tile(origin, 4096, kind.value(grid, (at + 20).next_multiple_of(kind.size()))?),
            distance => walk.inner(offset(root, distance)?, origin, 5)?,
        }
    }
    let Walk { origins, mut values, mut tiles, .. } = walk;
    let mut outside = background;
    if is_level_set {
        let fog = |v: f32| if background > 0.0 { (-v / background).clamp(0.0, 1.0) } else { 0.0 };
        values.iter_mut().for_each(|v| *v = fog(*v));
        tiles.iter_mut().for_each(|tile| tile.value = fog(tile.value));
        outside = 0.0;
        tiles.retain(|tile| tile.value != 0.0);
    }
    Ok(SparseGrid::new(outside, origins, values, tiles))
}

/// Active voxels of the tree that begins at `tree`, and their box.
pub(super) fn extent(grid: &Bytes<'_>, tree: usize) -> Result<(u64, Option<Box3>), String> {
    // After four distances, and how many nodes and tiles there are of three kinds.
    let count = grid.u64(tree + 56)?;
    let root = offset(tree, grid.i64(tree + 24)?)?;
    let corner = |at: usize| all(|axis| grid.u32(at + 4 * axis).map(|x| x as i32));
    let (low, high): ([i32; 3], [i32; 3]) = (corner(root)?, corner(root.checked_add(12).ok_or_else(cut)?)?);
    let is_box = (0..3).all(|axis| low[axis] <= high[axis]);
    Ok((count, is_box.then_some((low, high))))
}

/// Low and high corner, inclusive.
type Box3 = ([i32; 3], [i32; 3]);

fn offset(from: usize, distance: i64) -> Result<usize, String> {
    isize::try_from(distance).ok().and_then(|d| from.checked_add_signed(d)).ok_or_else(cut)
}

impl Walk<'_> {
    fn tile(&mut self, origin: IVec3, edge: i32, value: f32) {
        // NaN is not the background, and is told of.
        if value != self.background {
            self.tiles.push(TileOf { origin, edge, value });
        }
    }

    /// A node of (2^`log2`)³ children: nodes of 16³ below that of 32³, leaves below those.
    fn inner(&mut self, node: usize, origin: IVec3, log2: u32) -> Result<(), String> {
        self.nodes_left = self.nodes_left.checked_sub(1).ok_or_else(cut)?;
        let count = 1usize << (3 * log2);
        let mask = count / 8;
        let children = self.grid.part(node.checked_add(NODE_FIXED + mask).ok_or_else(cut)?, mask)?;
        let table = node + self.kind.table(NODE_FIXED + 2 * mask, 2);
        self.grid.part(table, count * 8)?;
        let edge = if log2 == 5 { 128 } else { 8 };
        for number in 0..count {
            let at = table + 8 * number;
            // z fastest.
            let side = (1usize << log2) - 1;
            let ijk = [number >> (2 * log2), number >> log2 & side, number & side].map(|i| i as i32 * edge);
            // A key far out may wrap; then the tree is nonsense, not the program.
            let place = IVec3::from_array(std::array::from_fn(|axis| origin[axis].wrapping_add(ijk[axis])));
            if children.0[number / 8] >> (number % 8) & 1 == 0 {
                self.tile(place, edge, self.kind.value(self.grid, at)?);
            } else {
                let child = offset(node, self.grid.i64(at)?)?;
                if log2 == 5 { self.inner(child, place, 4)? } else { self.leaf(child, place)? }
            }
        }
        Ok(())
    }

    fn leaf(&mut self, leaf: usize, origin: IVec3) -> Result<(), String> {
        self.leaves_left = self.leaves_left.checked_sub(1).ok_or_else(cut)?;
        self.origins.push(origin);
        match self.kind {
            Kind::Float => {
                let stored = self.grid.part(leaf.checked_add(96).ok_or_else(cut)?, 4 * LEAF_SIZE)?;
                self.values.extend(stored.0.as_chunks::<4>().0.iter().map(|four| f32::from_le_bytes(*four)));
            }
            Kind::Double => {
                let stored = self.grid.part(leaf.checked_add(128).ok_or_else(cut)?, 8 * LEAF_SIZE)?;
                self.values.extend(stored.0.as_chunks::<8>().0.iter().map(|eight| f64::from_le_bytes(*eight) as f32));
            }
            Kind::Quantised(bits) => {
                let header = self.grid.part(leaf, QUANTISED_FIXED)?;
                // Where the width is the leaf's own, its logarithm is in the upper bits of its flags.
                let bits = bits.unwrap_or(1 << (header.0[15] >> 5));
                if bits > 16 {
                    return Err(cut());
                }
                let (least, step) = (header.f32(LEAF_FIXED)?, header.f32(LEAF_FIXED + 4)?);
                let codes = self.grid.part(leaf + QUANTISED_FIXED, LEAF_SIZE / 8 * bits as usize)?;
                let code = |number: usize| -> Result<u32, String> {
                    let bit = number * bits as usize;
                    Ok(match bits {
                        16 => u32::from(codes.u16(bit / 8)?),
                        _ => u32::from(codes.0[bit / 8]) >> (bit % 8) & ((1 << bits) - 1),
                    })
                };
                for number in 0..LEAF_SIZE {
                    self.values.push(code(number)? as f32 * step + least);
                }
            }
        }
        Ok(())
    }
}
