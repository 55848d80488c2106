//! Grids on their way to a file: a header frame, then leaves (origins and values) and tiles in the order in which they are
//! to be put in.

use std::io::{self, Read, Write};

use serde::{Deserialize, Serialize};

use super::grid::WireTile;
use super::{Head, Kind, Receiver, WireError, send, try_convert};
use crate::types::{GridClass, Tile};
use crate::write::Precision;

/// A grid to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct NewGrid {
    /// Name; without zero bytes.
    pub name: String,
    /// Vectors, or scalars.
    pub vectors: bool,
    /// How numbers are stored.
    pub precision: Precision,
    /// What its values mean.
    pub class: GridClass,
    /// The value where nothing is stored; scalars use the first component.
    pub background: [f32; 3],
    /// Edge of a voxel in world units (with a frustum: of its box after the taper).
    pub voxel_size: f64,
    /// Where index (0, 0, 0) lies in the world.
    pub translation: [f64; 3],
    /// A frustum's box (low and high corner), taper and depth.
    pub frustum: Option<[f64; 8]>,
    /// What is in it.
    pub parts: Vec<Part>,
}

/// What is put into a grid at once.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// Leaves.
    Leaves {
        /// Low corners, multiples of 8.
        origins: Vec<[i32; 3]>,
        /// 512 values per leaf, z fastest; vectors one after the other.
        values: Vec<f32>,
    },
    /// Tiles.
    Tiles(Vec<Tile>),
}

impl NewGrid {
    /// Numbers per leaf.
    pub fn leaf_numbers(&self) -> usize {
        512 * if self.vectors { 3 } else { 1 }
    }
}

#[derive(Serialize, Deserialize)]
struct WireNewHeader {
    name: String,
    vectors: bool,
    precision: u8,
    class: String,
    background: [u32; 3],
    voxel_size: u64,
    translation: [u64; 3],
    frustum: Option<[u64; 8]>,
}

const PRECISIONS: [Precision; 3] = [Precision::Half, Precision::Single, Precision::Double];

/// Sends a grid.
pub fn send_new_grid(out: &mut impl Write, grid: &NewGrid) -> io::Result<()> {
    let header = WireNewHeader {
        name: grid.name.clone(),
        vectors: grid.vectors,
        precision: PRECISIONS.iter().position(|&p| p == grid.precision).unwrap_or_default() as u8,
        class: grid.class.word().to_owned(),
        background: grid.background.map(f32::to_bits),
        voxel_size: grid.voxel_size.to_bits(),
        translation: grid.translation.map(f64::to_bits),
        frustum: grid.frustum.map(|f| f.map(f64::to_bits)),
    };
    send(out, Kind::Header, &serde_json::to_vec(&header)?)?;
    for part in &grid.parts {
        match part {
            Part::Leaves { origins, values } => {
                send(out, Kind::Origins, bytemuck::cast_slice(origins))?;
                send(out, Kind::Values, bytemuck::cast_slice(values))?;
            }
            Part::Tiles(tiles) => {
                let tiles: Vec<WireTile> = tiles.iter().copied().map(WireTile::from).collect();
                send(out, Kind::Tiles, bytemuck::cast_slice(&tiles))?;
            }
        }
    }
    Ok(())
}

/// The grid whose header frame begins with `head`, and how the frame after it begins.
pub fn receive_new_grid<R: Read>(input: &mut Receiver<R>, head: Head) -> Result<(NewGrid, Head), WireError> {
    let text = input.text(head)?;
    let w: WireNewHeader = serde_json::from_slice(&text).map_err(|_| WireError::Bad("not a header"))?;
    let mut grid = NewGrid {
        name: w.name,
        vectors: w.vectors,
        precision: *PRECISIONS.get(usize::from(w.precision)).ok_or(WireError::Bad("unknown precision"))?,
        class: GridClass::from_word(&w.class),
        background: w.background.map(f32::from_bits),
        voxel_size: f64::from_bits(w.voxel_size),
        translation: w.translation.map(f64::from_bits),
        frustum: w.frustum.map(|f| f.map(f64::from_bits)),
        parts: Vec::new(),
    };
    loop {
        let head = input.head()?;
        match head.kind {
            Kind::Origins => {
                let leaves = head.count::<[i32; 3]>()?;
                let origins = input.elements(head, leaves)?;
                let values = input.expect(Kind::Values, leaves.saturating_mul(grid.leaf_numbers()))?;
                grid.parts.push(Part::Leaves { origins, values });
            }
            Kind::Tiles => {
                let tiles: Vec<WireTile> = input.elements(head, head.count::<WireTile>()?)?;
                grid.parts.push(Part::Tiles(try_convert(&tiles)?));
            }
            _ => return Ok((grid, head)),
        }
    }
}
