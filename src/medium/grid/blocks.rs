//! A map from blocks of 128³ voxels to what is known about them: an array where they lie close together (all
//! ordinary grids), a hash table where they do not (voxels may lie 2³¹ apart).

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::IVec3;

use crate::math::sampler::mix;

/// log2 of a block's edge in voxels.
pub const BLOCK_SHIFT: u32 = 7;

/// The block that holds the voxel `ijk`.
#[inline]
pub fn block_of(ijk: IVec3) -> IVec3 {
    ijk >> BLOCK_SHIFT as i32
}

/// Hashes three coordinates; std's hasher would cost more than the look-up.
#[derive(Default)]
pub struct CoordHasher(u64);

impl Hasher for CoordHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = mix(self.0 ^ u64::from(byte));
        }
    }

    fn write_i32(&mut self, value: i32) {
        self.0 = mix(self.0 ^ u64::from(value as u32));
    }
}

/// A hash table by coordinates.
pub type CoordMap<T> = HashMap<IVec3, T, BuildHasherDefault<CoordHasher>>;

/// No entry.
const NONE: u32 = u32::MAX;

/// Numbers (below `u32::MAX`) by block.
#[derive(Debug)]
pub enum BlockMap {
    /// Block (x, y, z) of a box, x slowest, at `(x·dim.y + y)·dim.z + z`.
    Dense {
        /// The box's low corner.
        low: IVec3,
        /// Its size in blocks.
        dim: IVec3,
        /// The entries.
        entries: Vec<u32>,
    },
    /// By hash.
    Sparse(CoordMap<u32>),
}

impl BlockMap {
    /// A map of the given pairs; of two with the same block the later one counts.
    pub fn new(pairs: &[(IVec3, u32)]) -> Self {
        let Some((first, _)) = pairs.first() else {
            return Self::Dense { low: IVec3::ZERO, dim: IVec3::ZERO, entries: Vec::new() };
        };
        let (low, high) = pairs.iter().fold((*first, *first), |(low, high), (b, _)| (low.min(*b), high.max(*b)));
        let dim = (high.as_i64vec3() - low.as_i64vec3()) + 1;
        let volume = (dim.x as i128) * (dim.y as i128) * (dim.z as i128);
        if volume <= 4096 + 16 * pairs.len() as i128 {
            let dim = dim.as_ivec3();
            let mut entries = vec![NONE; volume as usize];
            for (block, value) in pairs {
                let at = *block - low;
                entries[((at.x * dim.y + at.y) * dim.z + at.z) as usize] = *value;
            }
            Self::Dense { low, dim, entries }
        } else {
            Self::Sparse(pairs.iter().copied().collect())
        }
    }

    /// The entry of `block`.
    #[inline(always)]
    pub fn get(&self, block: IVec3) -> Option<u32> {
        match self {
            Self::Dense { low, dim, entries } => {
                // Below `low` wraps to a number above every `dim`.
                let at = block.wrapping_sub(*low).as_uvec3();
                let size = dim.as_uvec3();
                if at.x >= size.x || at.y >= size.y || at.z >= size.z {
                    return None;
                }
                let entry = entries[((at.x * size.y + at.y) * size.z + at.z) as usize];
                (entry != NONE).then_some(entry)
            }
            Self::Sparse(map) => map.get(&block).copied(),
        }
    }

    /// All blocks that have an entry, with it.
    pub fn iter(&self) -> impl Iterator<Item = (IVec3, u32)> + '_ {
        let (dense, sparse) = match self {
            Self::Dense { low, dim, entries } => (Some((*low, *dim, entries)), None),
            Self::Sparse(map) => (None, Some(map)),
        };
        let dense = dense.into_iter().flat_map(|(low, dim, entries)| {
            let place = move |i: i32| low + IVec3::new(i / dim.z / dim.y, i / dim.z % dim.y, i % dim.z);
            let present = entries.iter().enumerate().filter(|(_, entry)| **entry != NONE);
            present.map(move |(i, entry)| (place(i as i32), *entry))
        });
        dense.chain(sparse.into_iter().flatten().map(|(block, entry)| (*block, *entry)))
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        match self {
            Self::Dense { entries, .. } => entries.len() * 4,
            Self::Sparse(map) => map.capacity() * (size_of::<(IVec3, u32)>() + 1),
        }
    }
}
