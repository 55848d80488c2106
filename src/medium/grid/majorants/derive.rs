//! What follows from the bounds of a whole grid: other bounds over the same cells, and where they are above a level.

use glam::IVec3;

use super::{Majorants, MajorantsBuilder, Node, ROOT_SHIFT};
use crate::medium::grid::blocks::BLOCK_SHIFT;

impl Majorants {
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
}
