//! What the program that reads .vdb files may answer if a file has taken it over: frames of any kind in any order.
//!
//! A file that begins with "LF" is sent as it is. Any other is a list of frames: a kind, the length of the payload in two bytes, and the payload; where
//! the kind has its top bit set, two more bytes say how many times the payload is repeated. Checksums are put right.

#![no_main]

mod common;

use std::sync::Arc;

use glam::{DAffine3, DMat4, IVec3};
use lanternfish::medium::grid::map::Frustum;
use lanternfish::medium::grid::sparse::{SparseGrid, TileOf};
use lanternfish_openvdb::wire::{HELLO, Kind, send};
use lanternfish_openvdb::{GridMap, GridValues, take_answer};
use libfuzzer_sys::fuzz_target;

/// What it may make this side take.
const BUDGET: u64 = 16 << 20;

fn frames(mut rest: &[u8]) -> Vec<u8> {
    const KINDS: [Kind; 6] = [Kind::Header, Kind::Origins, Kind::Values, Kind::Tiles, Kind::Error, Kind::End];
    let mut said = HELLO.to_vec();
    while let [kind, low, high, payload @ ..] = rest {
        let (mut payload, mut times) = (payload, 1);
        if let (true, [low, high, more @ ..]) = (kind & 0x80 != 0, payload) {
            (payload, times) = (more, usize::from(u16::from_le_bytes([*low, *high])));
        }
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(payload.len());
        let (now, later) = payload.split_at(length);
        let repeated = now.repeat(times.min((BUDGET as usize) / length.max(1)));
        send(&mut said, KINDS[usize::from(kind & 0x7f) % 6], &repeated).expect("there is room");
        rest = later;
    }
    said
}

fuzz_target!(|data: &[u8]| {
    let said = if data.starts_with(&HELLO[..2]) { data.to_vec() } else { frames(data) };
    let Ok(grids) = take_answer(&said, BUDGET) else { return };
    for grid in grids {
        let values = match grid.values {
            GridValues::F32(values) => values,
            GridValues::F16(values) => values.iter().map(|value| value.to_f32()).collect(),
            GridValues::Vec3(values) => values.iter().map(|value| value[1]).collect(),
            GridValues::Absent => continue,
        };
        let origins = grid.leaf_origins.iter().map(|&origin| IVec3::from_array(origin)).collect();
        let tiles =
            grid.tiles.iter().map(|t| TileOf { origin: IVec3::from_array(t.origin), edge: t.size, value: t.value[0] });
        let voxels = SparseGrid::new(grid.header.background[0], origins, values, tiles.collect());
        let (matrix, frustum) = match grid.header.map {
            GridMap::Affine(matrix) => (matrix, None),
            GridMap::Frustum { min, max, taper, depth, second } => {
                (second, Some(Frustum { min: min.into(), max: max.into(), taper, depth }))
            }
        };
        common::build(Arc::new(voxels), DAffine3::from_mat4(DMat4::from_cols_array(&matrix)), frustum);
    }
});
