//! How grids travel through the pipe: frames of (kind, length, payload, checksum), little-endian. Numbers that must come
//! through exactly travel as bits.

use std::io::{self, Read, Write};

use half::f16;
use serde::{Deserialize, Serialize};

use crate::types::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbGrid};

/// What the reader says first: so that a program that is no reader is told apart from a crash.
pub(crate) const HELLO: [u8; 8] = *b"LFVDB\0\0\x01";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Kind {
    Header = 1,
    Origins = 2,
    Values = 3,
    Tiles = 4,
    Error = 5,
    End = 6,
}

impl Kind {
    fn from_byte(byte: u8) -> Option<Self> {
        [Self::Header, Self::Origins, Self::Values, Self::Tiles, Self::Error, Self::End]
            .into_iter()
            .find(|&kind| kind as u8 == byte)
    }
}

/// A hash of the payload that any lost, doubled or changed stretch upsets.
fn checksum(payload: &[u8]) -> u64 {
    let mut state = 0x9e37_79b9_7f4a_7c15u64 ^ payload.len() as u64;
    let (words, rest) = payload.as_chunks::<8>();
    for word in words {
        state = (state ^ u64::from_le_bytes(*word)).wrapping_mul(0xff51_afd7_ed55_8ccd).rotate_left(29);
    }
    for &byte in rest {
        state = (state ^ u64::from(byte)).wrapping_mul(0xff51_afd7_ed55_8ccd).rotate_left(29);
    }
    state ^ (state >> 32)
}

pub(crate) fn send(out: &mut impl Write, kind: Kind, payload: &[u8]) -> io::Result<()> {
    out.write_all(&[kind as u8])?;
    out.write_all(&(payload.len() as u64).to_le_bytes())?;
    out.write_all(payload)?;
    out.write_all(&checksum(payload).to_le_bytes())
}

fn bad(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason)
}

/// One frame; `limit` bounds its payload in bytes.
pub(crate) fn receive(input: &mut impl Read, limit: u64) -> io::Result<(Kind, Vec<u8>)> {
    let mut head = [0u8; 9];
    input.read_exact(&mut head)?;
    let kind = Kind::from_byte(head[0]).ok_or_else(|| bad("unknown frame"))?;
    let length = u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]);
    if length > limit {
        return Err(bad("frame too long"));
    }
    // Grows as data arrives: a false length allocates nothing.
    let mut payload = Vec::with_capacity(length.min(64 << 20) as usize);
    if input.take(length).read_to_end(&mut payload)? as u64 != length {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let mut sum = [0u8; 8];
    input.read_exact(&mut sum)?;
    if u64::from_le_bytes(sum) != checksum(&payload) {
        return Err(bad("checksum differs"));
    }
    Ok((kind, payload))
}

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
struct WireTile {
    origin: [i32; 3],
    size: i32,
    value: [f32; 3],
    active: u32,
}

pub(crate) fn send_grid(out: &mut impl Write, grid: &VdbGrid) -> io::Result<()> {
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
    send(out, Kind::Header, &serde_json::to_vec(&header)?)?;
    if storage != 0 {
        send(out, Kind::Origins, bytemuck::cast_slice(&grid.leaf_origins))?;
        send(out, Kind::Values, bytes)?;
        let tiles: Vec<WireTile> = grid
            .tiles
            .iter()
            .map(|t| WireTile { origin: t.origin, size: t.size, value: t.value, active: t.active.into() })
            .collect();
        send(out, Kind::Tiles, bytemuck::cast_slice(&tiles))?;
    }
    Ok(())
}

fn elements<T: bytemuck::Pod>(bytes: &[u8], count: usize) -> io::Result<Vec<T>> {
    if bytes.len() != count.saturating_mul(size_of::<T>()) {
        return Err(bad("wrong count"));
    }
    let mut elements = vec![T::zeroed(); count];
    bytemuck::cast_slice_mut(&mut elements).copy_from_slice(bytes);
    Ok(elements)
}

fn expect(input: &mut impl Read, limit: u64, kind: Kind) -> io::Result<Vec<u8>> {
    let (found, payload) = receive(input, limit)?;
    if found == kind { Ok(payload) } else { Err(bad("frames out of order")) }
}

/// The rest of a grid whose header frame was `header`. Checks that everything fits together.
pub(crate) fn receive_grid(input: &mut impl Read, header: &[u8], limit: u64) -> io::Result<VdbGrid> {
    let w: WireHeader = serde_json::from_slice(header)?;
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
    let leaves = usize::try_from(w.leaves).map_err(|_| bad("too many leaves"))?;
    let tile_count = usize::try_from(w.tiles).map_err(|_| bad("too many tiles"))?;
    let leaf_origins: Vec<[i32; 3]> = elements(&expect(input, limit, Kind::Origins)?, leaves)?;
    let values = expect(input, limit, Kind::Values)?;
    let count = leaves.saturating_mul(512);
    let values = match w.storage {
        1 => GridValues::F32(elements(&values, count)?),
        2 => GridValues::F16(elements::<f16>(&values, count)?),
        3 => GridValues::Vec3(elements(&values, count)?),
        _ => return Err(bad("unknown storage")),
    };
    let tiles: Vec<WireTile> = elements(&expect(input, limit, Kind::Tiles)?, tile_count)?;
    let tiles: Vec<Tile> =
        tiles.iter().map(|t| Tile { origin: t.origin, size: t.size, value: t.value, active: t.active != 0 }).collect();
    let aligned = |origin: &[i32; 3], size: i32| origin.iter().all(|c| c.rem_euclid(size) == 0);
    if !leaf_origins.iter().all(|o| aligned(o, 8))
        || !tiles.iter().all(|t| matches!(t.size, 8 | 128 | 4096) && aligned(&t.origin, t.size))
    {
        return Err(bad("leaves or tiles out of place"));
    }
    Ok(VdbGrid { header, leaf_origins, values, tiles })
}
