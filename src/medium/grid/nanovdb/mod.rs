//! NanoVDB files, read without any library: segments of grids, each a tree in one block of memory.
//!
//! Source: Museth, "NanoVDB: A GPU-Friendly and Portable VDB Data Structure For Real-Time Rendering And Simulation" (2021), and the layout that the
//! headers of version 32 document. A file is a sequence of segments: a header of 16 bytes, for each grid 176 bytes and its name, then the grids, as
//! they lie in memory or compressed ([`codec`]). Numbers are little-endian. Nothing that a file says is believed: every offset is looked up within
//! its grid's bytes, and no more nodes are visited than fit into them.

mod bytes;
mod codec;
mod describe;
#[cfg(test)]
mod tests;
mod tree;

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::sparse::SparseGrid;
use crate::system::input::read_regular;
use crate::system::memory::available;
use bytes::Bytes;
pub use describe::describe;

/// A grid of numbers.
#[derive(Clone, Debug)]
pub struct NanoGrid {
    /// Its name.
    pub name: String,
    /// Index space (voxels' centres at whole numbers) to world space.
    pub world_from_index: DAffine3,
    /// Voxels.
    pub voxels: Arc<SparseGrid<f32>>,
    /// Whether it was a level set, and is a fog volume now.
    pub was_level_set: bool,
    /// What else it says of itself.
    pub facts: Facts,
}

/// What a grid says of itself, for people: nothing is made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// NanoVDB's word for the type of its values.
    pub value_type: &'static str,
    /// NanoVDB's word for its class, before any conversion.
    pub class: &'static str,
    /// Active voxels, tiles' included.
    pub active_voxels: u64,
    /// Bounding box of active voxels, inclusive; `None` where there are none.
    pub bounds: Option<([i32; 3], [i32; 3])>,
}

/// What is known of a grid that is not read.
#[derive(Clone, Debug, PartialEq)]
pub struct Skipped {
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
    /// What else it says of itself.
    pub facts: Facts,
}

/// What a file holds.
#[derive(Debug, Default)]
pub struct NanoFile {
    /// Grids of numbers.
    pub grids: Vec<NanoGrid>,
    /// Others.
    pub skipped: Vec<Skipped>,
}

const MAGICS: [u64; 2] = [u64::from_le_bytes(*b"NanoVDB0"), u64::from_le_bytes(*b"NanoVDB1")];
const HEADER: usize = 16;
const METADATA: usize = 176;
const GRID_DATA: usize = 672;
/// A grid may unpack freely to this many bytes …
const UNSUSPICIOUS: u64 = 256 << 20;
/// … and beyond it to this many for each of its packed ones. Nodes are mostly empty and pack to little, but of large grids leaves are the most.
const MOST_A_BYTE: u64 = 100;
/// The version of the layout.
const MAJOR: u32 = 32;

const GRID_CLASS_LEVEL_SET: u32 = 1;

/// Words for the classes of grids, by number; as OpenVDB has them where it has the class.
const CLASSES: [&str; 10] = [
    "unknown",
    "level set",
    "fog volume",
    "staggered",
    "point index",
    "point data",
    "topology",
    "voxel volume",
    "index grid",
    "tensor grid",
];

/// Words for the types of grids, by number.
const TYPES: [&str; 20] = [
    "unknown", "float", "double", "int16", "int32", "int64", "vec3f", "vec3d", "mask", "half", "uint32", "bool",
    "rgba8", "fp4", "fp8", "fp16", "fpN", "vec4f", "vec4d", "index",
];

/// Reads a file.
///
/// # Errors
/// In words: the file cannot be read, is none of NanoVDB's, of another version, damaged, or larger than memory.
pub fn read(path: &Path) -> Result<NanoFile, String> {
    // The file, a grid's bytes, and its voxels are in memory at once.
    let limit = available().unwrap_or(u64::MAX) / 3;
    let bytes = read_regular(path, limit).map_err(|e| e.to_string())?;
    parse(&bytes, limit)
}

/// [`read`] from bytes; no grid of more than `limit` bytes is read.
pub(crate) fn parse(file: &[u8], limit: u64) -> Result<NanoFile, String> {
    let mut found = NanoFile::default();
    let mut rest = Bytes(file);
    loop {
        let magic = rest.u64(0)?;
        if !MAGICS.contains(&magic) {
            return Err(if found.grids.is_empty() && found.skipped.is_empty() {
                "it is not a NanoVDB file".to_owned()
            } else {
                "it goes on with something that is no segment".to_owned()
            });
        }
        check_version(rest.u32(8)?)?;
        let (count, codec) = (rest.u16(12)?, rest.u16(14)?);
        let mut at = HEADER;
        let mut metadata = Vec::new();
        for _ in 0..count {
            let one = rest.part(at, METADATA)?;
            let name_size = one.u32(136)? as usize;
            metadata.push(one);
            at = at.checked_add(METADATA + name_size).filter(|&at| at <= rest.0.len()).ok_or_else(bytes::cut)?;
        }
        for one in metadata {
            let (size, stored) = (one.u64(0)?, usize::try_from(one.u64(8)?).map_err(|_| bytes::cut())?);
            if size > limit {
                return Err(format!("a grid of {size} bytes is more than memory holds"));
            }
            if size > UNSUSPICIOUS.max(MOST_A_BYTE.saturating_mul(stored as u64)) {
                return Err(format!("a grid of {size} bytes in {stored}: refused as it looks made to fill the memory"));
            }
            let packed = rest.part(at, stored)?;
            let grid = codec::unpack(codec, packed.0, size as usize)?;
            match read_grid(&Bytes(&grid))? {
                Ok(grid) => found.grids.push(grid),
                Err(skipped) => found.skipped.push(skipped),
            }
            at += stored;
        }
        rest = Bytes(&rest.0[at..]);
        if rest.0.is_empty() {
            return Ok(found);
        }
    }
}

fn check_version(version: u32) -> Result<(), String> {
    let [major, minor, patch] = [version >> 21, version >> 10 & 0x7ff, version & 0x3ff];
    if major == MAJOR {
        return Ok(());
    }
    Err(format!("it is of NanoVDB's version {major}.{minor}.{patch}: only {MAJOR}.x can be read"))
}

/// One grid, from its own bytes; or why it is left out.
fn read_grid(grid: &Bytes<'_>) -> Result<Result<NanoGrid, Skipped>, String> {
    if !MAGICS.contains(&grid.u64(0)?) {
        return Err("a grid does not begin like one".to_owned());
    }
    check_version(grid.u32(16)?)?;
    let name = grid.part(40, 256)?.0;
    let name = String::from_utf8_lossy(name.split(|&b| b == 0).next().unwrap_or_default()).into_owned();
    let class = grid.u32(632)?;
    let number = grid.u32(636)?;
    let word = |words: &[&'static str], number: u32| words.get(number as usize).copied().unwrap_or("unknown");
    let (active_voxels, bounds) = tree::extent(grid, GRID_DATA).unwrap_or_default();
    let facts = Facts { value_type: word(&TYPES, number), class: word(&CLASSES, class), active_voxels, bounds };
    let Some(kind) = tree::Kind::of(number) else {
        let reason = format!("its values are of type \"{}\", not numbers", facts.value_type);
        return Ok(Err(Skipped { name, reason, facts }));
    };
    // After 22 single numbers the map has its matrix in double precision, row by row, then the same of its inverse, and what it adds.
    const MAP: usize = 296 + 22 * 4;
    let number = |i: usize| grid.f64(MAP + 8 * i);
    let rows: [f64; 9] = bytes::all(number)?;
    let moved: [f64; 3] = bytes::all(|i| number(18 + i))?;
    let matrix3 = DMat3::from_cols_array(&rows).transpose();
    let world_from_index = DAffine3 { matrix3, translation: DVec3::from_array(moved) };
    let is_level_set = class == GRID_CLASS_LEVEL_SET;
    let voxels = tree::voxels(grid, GRID_DATA, kind, is_level_set)?;
    Ok(Ok(NanoGrid { name, world_from_index, voxels: Arc::new(voxels), was_level_set: is_level_set, facts }))
}
