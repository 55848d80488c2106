//! Grids on their way from a file: a header frame, then, if the values were read, frames of origins, values and tiles.

use std::io::{self, Read, Write};

use half::f16;
use serde::{Deserialize, Serialize};

use super::{Head, Kind, MAX_TEXT, Receiver, WireError, send, try_convert};
use crate::types::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbGrid};

#[derive(Serialize, Deserialize)]
struct WireHeader {
    name: String,
    index: u32,
    type_name: String,
    value_type: String,
    class: String,
    map_name: String,
    matrix: [u64; 16],
    frustum: Option<[u64; 8]>,
    background: [u32; 3],
    active_voxels: u64,
    bounds: Option<([i32; 3], [i32; 3])>,
    saved_as_half: bool,
    was_level_set: bool,
    leaves: u64,
    tiles: u64,
    skipped: Option<String>,
    metadata: Vec<(String, String)>,
    storage: u8,
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct WireTile {
    origin: [i32; 3],
    size: i32,
    value: [f32; 3],
    active: u32,
}

impl From<Tile> for WireTile {
    fn from(t: Tile) -> Self {
        Self { origin: t.origin, size: t.size, value: t.value, active: t.active.into() }
    }
}

impl From<WireTile> for Tile {
    fn from(t: WireTile) -> Self {
        Self { origin: t.origin, size: t.size, value: t.value, active: t.active != 0 }
    }
}

/// Sends a grid.
pub fn send_grid(out: &mut impl Write, grid: &VdbGrid) -> io::Result<()> {
    let h = &grid.header;
    let (matrix, frustum) = match h.map {
        GridMap::Affine(m) => (m, None),
        GridMap::Frustum { min, max, taper, depth, second } => {
            let f = [min[0], min[1], min[2], max[0], max[1], max[2], taper, depth];
            (second, Some(f.map(f64::to_bits)))
        }
    };
    let (storage, bytes): (u8, &[u8]) = match &grid.values {
        GridValues::Absent => (0, &[]),
        GridValues::F32(v) => (1, bytemuck::cast_slice(v)),
        GridValues::F16(v) => (2, bytemuck::cast_slice(v)),
        GridValues::Vec3(v) => (3, bytemuck::cast_slice(v)),
    };
    let header = WireHeader {
        name: h.name.clone(),
        index: h.index,
        type_name: h.type_name.clone(),
        value_type: h.value_type.clone(),
        class: h.class.word().to_owned(),
        map_name: h.map_name.clone(),
        matrix: matrix.map(f64::to_bits),
        frustum,
        background: h.background.map(f32::to_bits),
        active_voxels: h.active_voxels,
        bounds: h.index_bounds,
        saved_as_half: h.saved_as_half,
        was_level_set: h.was_level_set,
        leaves: h.leaf_count,
        tiles: h.tile_count,
        skipped: h.skipped.clone(),
        metadata: h.metadata.clone(),
        storage,
    };
    let header = serde_json::to_vec(&header)?;
    if header.len() > MAX_TEXT {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "its grids have too much metadata"));
    }
    send(out, Kind::Header, &header)?;
    if storage != 0 {
        send(out, Kind::Origins, bytemuck::cast_slice(&grid.leaf_origins))?;
        send(out, Kind::Values, bytes)?;
        let tiles: Vec<WireTile> = try_convert(&grid.tiles).map_err(|_| io::ErrorKind::OutOfMemory)?;
        send(out, Kind::Tiles, bytemuck::cast_slice(&tiles))?;
    }
    Ok(())
}

/// The grid whose header frame begins with `head`. Checks that everything fits together.
pub fn receive_grid<R: Read>(input: &mut Receiver<R>, head: Head) -> Result<VdbGrid, WireError> {
    let text = input.text(head)?;
    let w: WireHeader = serde_json::from_slice(&text).map_err(|_| WireError::Bad("not a header"))?;
    let matrix = w.matrix.map(f64::from_bits);
    let map = match w.frustum.map(|f| f.map(f64::from_bits)) {
        None => GridMap::Affine(matrix),
        Some(f) => GridMap::Frustum {
            min: [f[0], f[1], f[2]],
            max: [f[3], f[4], f[5]],
            taper: f[6],
            depth: f[7],
            second: matrix,
        },
    };
    let header = GridHeader {
        name: w.name,
        index: w.index,
        type_name: w.type_name,
        value_type: w.value_type,
        class: GridClass::from_word(&w.class),
        map_name: w.map_name,
        map,
        background: w.background.map(f32::from_bits),
        active_voxels: w.active_voxels,
        index_bounds: w.bounds,
        saved_as_half: w.saved_as_half,
        was_level_set: w.was_level_set,
        leaf_count: w.leaves,
        tile_count: w.tiles,
        skipped: w.skipped,
        metadata: w.metadata,
    };
    if w.storage == 0 {
        return Ok(VdbGrid { header, leaf_origins: Vec::new(), values: GridValues::Absent, tiles: Vec::new() });
    }
    let leaves = usize::try_from(w.leaves).map_err(|_| WireError::TooMuch)?;
    let tiles = usize::try_from(w.tiles).map_err(|_| WireError::TooMuch)?;
    let leaf_origins: Vec<[i32; 3]> = input.expect(Kind::Origins, leaves)?;
    let count = leaves.saturating_mul(512);
    let values = match w.storage {
        1 => GridValues::F32(input.expect(Kind::Values, count)?),
        2 => GridValues::F16(input.expect::<f16>(Kind::Values, count)?),
        3 => GridValues::Vec3(input.expect(Kind::Values, count)?),
        _ => return Err(WireError::Bad("unknown storage")),
    };
    let tiles: Vec<WireTile> = input.expect(Kind::Tiles, tiles)?;
    let tiles: Vec<Tile> = try_convert(&tiles)?;
    let aligned = |origin: &[i32; 3], size: i32| origin.iter().all(|c| c.rem_euclid(size) == 0);
    if !leaf_origins.iter().all(|o| aligned(o, 8))
        || !tiles.iter().all(|t| matches!(t.size, 8 | 128 | 4096) && aligned(&t.origin, t.size))
    {
        return Err(WireError::Bad("leaves or tiles out of place"));
    }
    Ok(VdbGrid { header, leaf_origins, values, tiles })
}
