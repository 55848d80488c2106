//! What goes in comes out, and what was not sent so does not.

use super::*;
use crate::types::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbGrid};
use crate::write::Precision;

fn grid(leaves: usize) -> VdbGrid {
    let header = GridHeader {
        name: "density".into(),
        index: 3,
        type_name: "Tree_float_5_4_3".into(),
        value_type: "float".into(),
        class: GridClass::FogVolume,
        map_name: "UniformScaleMap".into(),
        map: GridMap::Affine(std::array::from_fn(|i| i as f64 / 7.0)),
        background: [f32::NAN, 1.0, -0.0],
        active_voxels: 1 << 60,
        index_bounds: Some(([-1; 3], [i32::MAX; 3])),
        saved_as_half: true,
        was_level_set: false,
        leaf_count: leaves as u64,
        tile_count: 1,
        skipped: None,
        metadata: vec![("é".into(), "\u{0}\"".into())],
    };
    let values = GridValues::F32((0..512 * leaves).map(|i| i as f32 / 3.0).collect());
    let leaf_origins = (0..leaves as i32).map(|i| [8 * i, -8, 0]).collect();
    let tiles = vec![Tile { origin: [128, 0, -128], size: 128, value: [0.5; 3], active: true }];
    VdbGrid { header, leaf_origins, values, tiles }
}

fn sent(grid: &VdbGrid) -> Vec<u8> {
    let mut bytes = Vec::new();
    send_grid(&mut bytes, grid).expect("memory takes it");
    bytes
}

fn received(bytes: &[u8], budget: u64) -> Result<VdbGrid, WireError> {
    let mut input = Receiver::new(bytes, budget);
    let head = input.head()?;
    receive_grid(&mut input, head)
}

#[test]
fn grids_come_through() {
    // More values than are taken in at once.
    for leaves in [0, 1, 700] {
        let grid = grid(leaves);
        let back = received(&sent(&grid), 1 << 30).expect("whole");
        assert!(back.header.background[0].is_nan());
        assert_eq!(format!("{:?}", back.header), format!("{:?}", grid.header));
        assert!(back.leaf_origins == grid.leaf_origins && back.values == grid.values && back.tiles == grid.tiles);
    }
}

#[test]
fn every_changed_or_missing_byte_is_noticed() {
    let whole = sent(&grid(1));
    for at in 0..whole.len() {
        let mut changed = whole.clone();
        changed[at] ^= 0x10;
        assert!(received(&changed, 1 << 30).is_err(), "byte {at}");
        assert!(received(&whole[..at], 1 << 30).is_err(), "cut at {at}");
    }
}

#[test]
fn the_budget_is_for_all_that_comes() {
    let one = sent(&grid(100));
    let size = one.len() as u64;
    let twice = [one.as_slice(), &one].concat();
    let count = |budget| {
        let mut input = Receiver::new(twice.as_slice(), budget);
        let mut count = 0;
        while let Ok(head) = input.head() {
            match receive_grid(&mut input, head) {
                Ok(_) => count += 1,
                Err(error) => {
                    assert!(matches!(error, WireError::TooMuch), "{error}");
                    break;
                }
            }
        }
        count
    };
    assert_eq!([count(size / 2), count(size + size / 2), count(3 * size)], [0, 1, 2]);
}

/// A frame that says it has `length` bytes, and has these.
fn lie(kind: Kind, length: u64, payload: &[u8]) -> Vec<u8> {
    [&[kind as u8][..], &length.to_le_bytes(), payload].concat()
}

#[test]
fn false_lengths_take_no_memory() {
    let huge = u64::MAX / 16;
    let grid_of = |leaves: u64| {
        let mut grid = grid(0);
        (grid.header.leaf_count, grid.header.tile_count) = (leaves, leaves);
        let mut bytes = sent(&grid);
        // Only the header, which now lies.
        let header = 9 + u64::from_le_bytes(bytes[1..9].try_into().expect("eight bytes")) + 8;
        bytes.truncate(header as usize);
        bytes
    };
    for leaves in [huge, huge / 12, u64::MAX, 1 << 40] {
        let origins = leaves.saturating_mul(12);
        for budget in [1 << 30, u64::MAX] {
            let bytes = [grid_of(leaves), lie(Kind::Origins, origins, &[0; 4096])].concat();
            assert!(received(&bytes, budget).is_err());
        }
    }
    for length in [MAX_TEXT as u64 + 1, huge, u64::MAX] {
        assert!(matches!(received(&lie(Kind::Header, length, &[]), u64::MAX), Err(WireError::TooMuch)));
    }
}

#[test]
fn leaves_and_tiles_out_of_place_are_refused() {
    let refused = |change: fn(&mut VdbGrid)| {
        let mut grid = grid(2);
        change(&mut grid);
        assert!(matches!(received(&sent(&grid), 1 << 30), Err(WireError::Bad(_))));
    };
    refused(|g| g.leaf_origins[1][2] = 4);
    refused(|g| g.tiles[0].size = 0);
    refused(|g| g.tiles[0].origin[0] = 8);
    refused(|g| g.header.leaf_count = 3);
    refused(|g| g.leaf_origins.truncate(1));
}

#[test]
fn new_grids_come_through_in_the_order_of_their_parts() {
    let mut grid = NewGrid {
        name: "fog".into(),
        vectors: false,
        precision: Precision::Double,
        class: GridClass::LevelSet,
        background: [0.1, 0.0, 0.0],
        voxel_size: 0.3,
        translation: [1.0, -2.0, 1e300],
        frustum: Some([0.25; 8]),
        parts: Vec::new(),
    };
    let tile = Tile { origin: [0; 3], size: 8, value: [1.0, 0.0, 0.0], active: false };
    for vectors in [false, true] {
        grid.vectors = vectors;
        let leaves = |n: usize| Part::Leaves { origins: vec![[8; 3]; n], values: vec![0.5; n * grid.leaf_numbers()] };
        grid.parts = vec![leaves(1), Part::Tiles(vec![tile; 3]), leaves(300)];
        let mut bytes = Vec::new();
        send_new_grid(&mut bytes, &grid).expect("memory takes it");
        send(&mut bytes, Kind::End, &[]).expect("memory takes it");
        let mut input = Receiver::new(bytes.as_slice(), 1 << 30);
        let head = input.head().expect("a frame");
        let (back, next) = receive_new_grid(&mut input, head).expect("whole");
        assert_eq!((back, next.kind), (grid.clone(), Kind::End));
    }
}
