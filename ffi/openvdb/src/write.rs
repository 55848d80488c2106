//! Writing fog volumes (and, for tests, grids of the other kinds that are read) through the worker.

mod job;

use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use crate::locate;
use crate::types::{GridClass, Tile, VdbError};
use crate::wire::{NewGrid, Part};

/// How values are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// zlib: slow, dense.
    Zip,
    /// Blosc: fast.
    Blosc,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits.
    Half,
    /// 32 bits.
    Single,
    /// 64 bits.
    Double,
}

/// Collects grids and writes them to one file.
#[derive(Debug, Default)]
pub struct VdbWriter {
    grids: Vec<NewGrid>,
}

fn wrong(reason: &str) -> VdbError {
    VdbError::Write(reason.into())
}

/// The grid of a cube of voxels, without what makes it special.
fn new_grid(name: &str, background: [f32; 3], voxel_size: f64, translation: [f64; 3]) -> NewGrid {
    NewGrid {
        name: name.to_owned(),
        vectors: false,
        precision: Precision::Single,
        class: GridClass::Unknown,
        background,
        voxel_size,
        translation,
        frustum: None,
        parts: Vec::new(),
    }
}

impl VdbWriter {
    /// A writer without grids.
    pub fn new() -> Result<Self, VdbError> {
        Ok(Self::default())
    }

    fn begin(&mut self, grid: NewGrid) -> Result<(), VdbError> {
        if grid.name.contains('\0') {
            return Err(wrong("a name holds a zero byte"));
        }
        self.grids.push(grid);
        Ok(())
    }

    fn current(&mut self) -> Result<&mut NewGrid, VdbError> {
        self.grids.last_mut().ok_or_else(|| wrong("no grid was begun"))
    }

    /// Begins a fog volume of scalars. Index (0, 0, 0) lies at `translation`; `voxel_size` is in world units.
    pub fn fog_grid(
        &mut self,
        name: &str,
        precision: Precision,
        background: f32,
        voxel_size: f64,
        translation: [f64; 3],
    ) -> Result<(), VdbError> {
        let grid = new_grid(name, [background, 0.0, 0.0], voxel_size, translation);
        self.begin(NewGrid { precision, class: GridClass::FogVolume, ..grid })
    }

    /// Begins a grid of scalars of any class.
    pub fn scalar_grid(
        &mut self,
        name: &str,
        class: GridClass,
        background: f32,
        voxel_size: f64,
        translation: [f64; 3],
    ) -> Result<(), VdbError> {
        self.begin(NewGrid { class, ..new_grid(name, [background, 0.0, 0.0], voxel_size, translation) })
    }

    /// Begins a grid of vectors.
    pub fn vec3_grid(
        &mut self,
        name: &str,
        precision: Precision,
        background: [f32; 3],
        voxel_size: f64,
        translation: [f64; 3],
    ) -> Result<(), VdbError> {
        self.begin(NewGrid { vectors: true, precision, ..new_grid(name, background, voxel_size, translation) })
    }

    /// Begins a fog volume in a frustum: the index box `min..max` tapers along z (near over far width) over `depth` near
    /// widths, is scaled by `size` and moved by `translation`.
    pub fn frustum_grid(
        &mut self,
        name: &str,
        [min, max]: [[f64; 3]; 2],
        taper: f64,
        depth: f64,
        size: f64,
        translation: [f64; 3],
    ) -> Result<(), VdbError> {
        let frustum = Some([min[0], min[1], min[2], max[0], max[1], max[2], taper, depth]);
        self.begin(NewGrid { class: GridClass::FogVolume, frustum, ..new_grid(name, [0.0; 3], size, translation) })
    }

    /// Adds leaves to the grid begun last: `values` holds 512 per origin, z fastest. Voxels equal to the background stay
    /// inactive. For grids of vectors see [`VdbWriter::vec3_leaves`].
    pub fn leaves(&mut self, origins: &[[i32; 3]], values: &[f32]) -> Result<(), VdbError> {
        self.put_leaves(origins, values, false)
    }

    /// The same for grids of vectors.
    pub fn vec3_leaves(&mut self, origins: &[[i32; 3]], values: &[[f32; 3]]) -> Result<(), VdbError> {
        self.put_leaves(origins, values.as_flattened(), true)
    }

    fn put_leaves(&mut self, new: &[[i32; 3]], numbers: &[f32], vectors: bool) -> Result<(), VdbError> {
        let grid = self.current()?;
        if grid.vectors != vectors {
            return Err(wrong("values and grid differ in components"));
        }
        if numbers.len() != new.len() * grid.leaf_numbers() {
            return Err(wrong("leaves need 512 values each"));
        }
        let new = new.iter().map(|origin| origin.map(|c| c & !7));
        if let Some(Part::Leaves { origins, values }) = grid.parts.last_mut() {
            origins.extend(new);
            values.extend_from_slice(numbers);
        } else {
            grid.parts.push(Part::Leaves { origins: new.collect(), values: numbers.to_vec() });
        }
        Ok(())
    }

    /// Adds tiles to the grid begun last.
    pub fn tiles(&mut self, tiles: &[Tile]) -> Result<(), VdbError> {
        if !tiles.iter().all(|t| matches!(t.size, 8 | 128 | 4096)) {
            return Err(wrong("tiles have edges of 8, 128 or 4096 voxels"));
        }
        let tiles = tiles.iter().map(|t| Tile { origin: t.origin.map(|c| c & !(t.size - 1)), ..*t });
        self.current()?.parts.push(Part::Tiles(tiles.collect()));
        Ok(())
    }

    /// Adds a dense block of scalars to the grid begun last: `value(x, y, z)` for each index of `origin..origin + size`;
    /// leaves that hold nothing but `background` are left out.
    pub fn dense(
        &mut self,
        origin: [i32; 3],
        size: [u32; 3],
        background: f32,
        mut value: impl FnMut(i32, i32, i32) -> f32,
    ) -> Result<(), VdbError> {
        let end: [i32; 3] = std::array::from_fn(|i| origin[i].saturating_add_unsigned(size[i]));
        let leaf_range = |i: usize| (origin[i].div_euclid(8)..=(end[i] - 1).div_euclid(8)).map(|l| l * 8);
        for lx in leaf_range(0) {
            for ly in leaf_range(1) {
                for lz in leaf_range(2) {
                    let mut values = [background; 512];
                    for x in lx.max(origin[0])..(lx + 8).min(end[0]) {
                        for y in ly.max(origin[1])..(ly + 8).min(end[1]) {
                            for z in lz.max(origin[2])..(lz + 8).min(end[2]) {
                                let offset = ((x - lx) * 8 + (y - ly)) * 8 + (z - lz);
                                values[offset as usize] = value(x, y, z);
                            }
                        }
                    }
                    if values.iter().any(|&v| v.to_bits() != background.to_bits()) {
                        self.leaves(&[[lx, ly, lz]], &values)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes all grids to `path` (an existing file is replaced; on an error it may be incomplete).
    pub fn write(self, path: &Path, compression: Compression) -> Result<(), VdbError> {
        if path.as_os_str().as_bytes().contains(&0) {
            return Err(wrong("the file's name holds a zero byte"));
        }
        job::write_with(&locate::worker()?, self.grids, path, compression)
    }
}
