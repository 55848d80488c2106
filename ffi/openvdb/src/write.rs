//! Writing fog volumes (and, for tests, grids of the other kinds that are read).

use std::ffi::{CString, c_char};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::ptr::NonNull;

use openvdb_sys as sys;

use crate::in_process::message;
use crate::types::{GridClass, Tile, VdbError};

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
pub struct VdbWriter(NonNull<sys::lf_writer>);

impl Drop for VdbWriter {
    fn drop(&mut self) {
        // SAFETY: the pointer came from lf_writer_new and is freed once, here.
        unsafe { sys::lf_writer_free(self.0.as_ptr()) }
    }
}

fn check(error: &sys::lf_error) -> Result<(), VdbError> {
    if error.code == 0 { Ok(()) } else { Err(VdbError::Write(message(error))) }
}

fn text(bytes: &[u8]) -> Result<CString, VdbError> {
    CString::new(bytes).map_err(|_| VdbError::Write("a name holds a zero byte".into()))
}

/// What a grid to be written is.
struct Kind {
    components: i32,
    precision: Precision,
    class: GridClass,
}

impl VdbWriter {
    /// A writer without grids.
    pub fn new() -> Result<Self, VdbError> {
        let mut error = sys::lf_error::default();
        // SAFETY: `error` is a valid place.
        let writer = unsafe { sys::lf_writer_new(&mut error) };
        check(&error)?;
        NonNull::new(writer).map(Self).ok_or_else(|| VdbError::Write("out of memory".into()))
    }

    fn begin(
        &mut self,
        name: &str,
        kind: &Kind,
        background: [f32; 3],
        voxel_size: f64,
        translation: [f64; 3],
        frustum: Option<[f64; 8]>,
    ) -> Result<(), VdbError> {
        let name = text(name.as_bytes())?;
        let class = match kind.class {
            GridClass::FogVolume => 1,
            GridClass::LevelSet => 2,
            GridClass::Staggered | GridClass::Unknown => 0,
        };
        let frustum = frustum.as_ref().map_or(std::ptr::null(), |f| f.as_ptr());
        let mut error = sys::lf_error::default();
        // SAFETY: all pointers are to arrays of the lengths that shim.h states, alive over the call.
        unsafe {
            sys::lf_writer_grid(
                self.0.as_ptr(),
                name.as_ptr().cast::<c_char>(),
                kind.components,
                i32::from(kind.precision == Precision::Half),
                i32::from(kind.precision == Precision::Double),
                class,
                background.as_ptr(),
                voxel_size,
                translation.as_ptr(),
                frustum,
                &mut error,
            );
        }
        check(&error)
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
        let kind = Kind { components: 1, precision, class: GridClass::FogVolume };
        self.begin(name, &kind, [background, 0.0, 0.0], voxel_size, translation, None)
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
        let kind = Kind { components: 1, precision: Precision::Single, class };
        self.begin(name, &kind, [background, 0.0, 0.0], voxel_size, translation, None)
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
        let kind = Kind { components: 3, precision, class: GridClass::Unknown };
        self.begin(name, &kind, background, voxel_size, translation, None)
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
        let kind = Kind { components: 1, precision: Precision::Single, class: GridClass::FogVolume };
        let frustum = [min[0], min[1], min[2], max[0], max[1], max[2], taper, depth];
        self.begin(name, &kind, [0.0; 3], size, translation, Some(frustum))
    }

    /// Adds leaves to the grid begun last: `values` holds 512 per origin, z fastest. Voxels equal to the background stay
    /// inactive. For grids of vectors see [`VdbWriter::vec3_leaves`].
    pub fn leaves(&mut self, origins: &[[i32; 3]], values: &[f32]) -> Result<(), VdbError> {
        self.raw_leaves(origins, values, 1)
    }

    /// The same for grids of vectors.
    pub fn vec3_leaves(&mut self, origins: &[[i32; 3]], values: &[[f32; 3]]) -> Result<(), VdbError> {
        self.raw_leaves(origins, values.as_flattened(), 3)
    }

    fn raw_leaves(&mut self, origins: &[[i32; 3]], values: &[f32], components: usize) -> Result<(), VdbError> {
        // The shim reads as many components as the grid has, which is at most 3: only vec3_leaves may meet vectors.
        if values.len() != origins.len() * 512 * components {
            return Err(VdbError::Write("leaves need 512 values each".into()));
        }
        if self.components()? != components {
            return Err(VdbError::Write("values and grid differ in components".into()));
        }
        let mut error = sys::lf_error::default();
        // SAFETY: lengths were checked just now.
        unsafe {
            let origins_start = origins.as_ptr().cast();
            sys::lf_writer_leaves(self.0.as_ptr(), origins_start, values.as_ptr(), origins.len() as u64, &mut error);
        }
        check(&error)
    }

    fn components(&self) -> Result<usize, VdbError> {
        // SAFETY: the writer is alive.
        match unsafe { sys::lf_writer_components(self.0.as_ptr()) } {
            0 => Err(VdbError::Write("no grid was begun".into())),
            n => Ok(n as usize),
        }
    }

    /// Adds tiles to the grid begun last.
    pub fn tiles(&mut self, tiles: &[Tile]) -> Result<(), VdbError> {
        if !tiles.iter().all(|t| matches!(t.size, 8 | 128 | 4096)) {
            return Err(VdbError::Write("tiles have edges of 8, 128 or 4096 voxels".into()));
        }
        let raw: Vec<sys::lf_tile> = tiles
            .iter()
            .map(|t| sys::lf_tile { origin: t.origin, size: t.size, value: t.value, active: t.active.into() })
            .collect();
        let mut error = sys::lf_error::default();
        // SAFETY: `raw` is alive over the call and its length is given.
        unsafe { sys::lf_writer_tiles(self.0.as_ptr(), raw.as_ptr(), raw.len() as u64, &mut error) };
        check(&error)
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
        let path = text(path.as_os_str().as_bytes())?;
        let compression = match compression {
            Compression::None => 0,
            Compression::Zip => 1,
            Compression::Blosc => 2,
        };
        let mut error = sys::lf_error::default();
        // SAFETY: `path` is a terminated string, alive over the call.
        unsafe { sys::lf_writer_write(self.0.as_ptr(), path.as_ptr(), compression, &mut error) };
        check(&error)
    }
}
