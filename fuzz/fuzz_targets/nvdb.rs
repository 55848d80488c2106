//! NanoVDB files. One that begins with "P" is a list of places and words that are put into a whole file, of which the grids are not compressed: what
//! lies behind compression is seldom reached otherwise.

#![no_main]

mod common;

use std::io::Read;
use std::sync::OnceLock;

use lanternfish::fuzzing::volume;
use libfuzzer_sys::fuzz_target;

/// No grid has more bytes than this.
const LIMIT: u64 = 16 << 20;
const HEADER: usize = 16;
const METADATA: usize = 176;
/// File, grid, tree and root say what they are within so many bytes.
const DESCRIPTIONS: usize = 2048;

/// The first grid of a file of the tests, as a file by itself, not compressed.
fn whole() -> &'static [u8] {
    static WHOLE: OnceLock<Vec<u8>> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let packed = include_bytes!("../../tests/data/nanovdb/density-fp8.nvdb");
        let word = |at: usize| u64::from_le_bytes(packed[at..at + 8].try_into().expect("eight bytes"));
        let start = HEADER + METADATA + packed[HEADER + 136] as usize;
        assert_eq!(packed[14], 1, "it is compressed by zlib");
        let mut grid = vec![];
        flate2::read::ZlibDecoder::new(&packed[start + 8..]).read_to_end(&mut grid).expect("it is whole");
        assert_eq!(grid.len() as u64, word(HEADER));
        let mut file = packed[..start].to_vec();
        file[12..16].copy_from_slice(&[1, 0, 0, 0]);
        file[HEADER + 8..HEADER + 16].copy_from_slice(&word(HEADER).to_le_bytes());
        file.extend(grid);
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
