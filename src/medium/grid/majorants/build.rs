//! From bounds that were raised to the hierarchy: what is the same all over a block or a cell of 32³ voxels is kept once, and empty cells learn how
//! far it is to others.

use glam::IVec3;
use rayon::prelude::*;

use super::{CELLS, EMPTY_SHIFTS, Majorants, MajorantsBuilder, Node, ROOT_SHIFT, UNIFORM};
use crate::medium::grid::blocks::{BLOCK_SHIFT, BlockMap};
use crate::medium::grid::clearance;

impl MajorantsBuilder {
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
}
