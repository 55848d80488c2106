//! NanoVDB files. One that begins with "P" is a list of places and words that are put into a whole file that is not compressed: what lies behind
//! compression is seldom reached otherwise.

#![no_main]

mod common;

use std::sync::OnceLock;

use lanternfish::fuzzing::volume;
use libfuzzer_sys::fuzz_target;

/// No grid has more bytes than this.
const LIMIT: u64 = 16 << 20;

/// Where the parts of a grid of floats begin: its tree, the root and its table, a node of 32³, one of 16³, and a leaf.
const TREE: usize = 672;
const ROOT: usize = TREE + 64;
const TABLE: usize = ROOT + 64;
const UPPER: usize = TABLE + 2 * 32;
const UPPER_TABLE: usize = UPPER + 8256;
const LOWER: usize = UPPER_TABLE + 8 * 32_768;
const LOWER_TABLE: usize = LOWER + 1088;
const LEAF: usize = LOWER_TABLE + 8 * 4096;
const END: usize = LEAF + 96 + 4 * 512;
/// What stands before a grid in a file of one, whose name takes eight bytes.
const BEFORE: usize = 16 + 176 + 8;
/// File, grid, tree, root and the first node say what they are within so many bytes.
const DESCRIPTIONS: usize = BEFORE + UPPER + 256;

/// A file of one grid with one leaf and one tile of 4096³ voxels.
fn whole() -> &'static [u8] {
    static WHOLE: OnceLock<Vec<u8>> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let mut grid = vec![0u8; END];
        let mut put = |at: usize, bytes: &[u8]| grid[at..at + bytes.len()].copy_from_slice(bytes);
        let version = 32u32 << 21;
        put(0, b"NanoVDB0");
        put(16, &version.to_le_bytes());
        put(40, b"density\0");
        for axis in 0..3 {
            put(384 + 32 * axis, &0.5f64.to_le_bytes());
            put(384 + 72 + 32 * axis, &2f64.to_le_bytes());
        }
        put(632, &2u32.to_le_bytes());
        put(636, &1u32.to_le_bytes());
        let distance = |from: usize, to: usize| ((to - from) as i64).to_le_bytes();
        put(TREE + 24, &distance(TREE, ROOT));
        put(ROOT + 24, &2u32.to_le_bytes());
        put(TABLE + 8, &distance(ROOT, UPPER));
        put(TABLE + 32, &1u64.to_le_bytes());
        put(TABLE + 32 + 20, &0.5f32.to_le_bytes());
        // The first child of each node is one, by its mask.
        put(UPPER + 32 + 4096, &[1]);
        put(UPPER_TABLE, &distance(UPPER, LOWER));
        put(LOWER + 32 + 512, &[1]);
        put(LOWER_TABLE, &distance(LOWER, LEAF));
        (0..512).for_each(|i| put(LEAF + 96 + 4 * i, &(i as f32 * 0.01).to_le_bytes()));
        let mut file = b"NanoVDB0".to_vec();
        file.extend(version.to_le_bytes());
        file.extend([1, 0, 0, 0]);
        let mut about = [0u8; 176];
        about[..8].copy_from_slice(&(END as u64).to_le_bytes());
        about[8..16].copy_from_slice(&(END as u64).to_le_bytes());
        about[136] = 8;
        file.extend(about);
        file.extend(b"density\0");
        file.extend(grid);
        assert_eq!(volume(&file, LIMIT).expect("it is whole").grids.len(), 1);
        file
    })
}

fuzz_target!(|data: &[u8]| {
    let changed;
    let file = match data.strip_prefix(b"P") {
        Some(patches) => {
            let mut copy = whole().to_vec();
            for patch in patches.as_chunks::<8>().0 {
                // Half of them go where the grid and its tree describe themselves.
                let end = if patch[3] & 0x80 != 0 { DESCRIPTIONS } else { copy.len() };
                let at = u32::from_le_bytes([patch[0], patch[1], patch[2], 0]) as usize % end;
                let count = usize::from(patch[3] % 5).min(copy.len() - at);
                copy[at..at + count].copy_from_slice(&patch[4..4 + count]);
            }
            changed = copy;
            changed.as_slice()
        }
        None => data,
    };
    let Ok(found) = volume(file, LIMIT) else { return };
    for grid in found.grids {
        common::build(grid.voxels, grid.world_from_index, None);
    }
});
