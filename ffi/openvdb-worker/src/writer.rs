//! The shim's writer behind safe functions.

use std::ffi::CString;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::ptr::NonNull;

use lanternfish_openvdb::wire::NewGrid;
use lanternfish_openvdb::{GridClass, Precision, Tile};
use openvdb_sys as sys;

use crate::Fault;
use crate::file::message;

/// Collects grids and writes them to one file.
pub struct Writer(NonNull<sys::lf_writer>);

impl Drop for Writer {
    fn drop(&mut self) {
        // SAFETY: the pointer came from lf_writer_new and is freed once, here.
        unsafe { sys::lf_writer_free(self.0.as_ptr()) }
    }
}

fn fault(reason: impl Into<String>) -> Fault {
    Fault::new(Fault::IO, reason)
}

fn check(error: &sys::lf_error) -> Result<(), Fault> {
    if error.code == 0 { Ok(()) } else { Err(fault(message(error))) }
}

fn text(bytes: &[u8]) -> Result<CString, Fault> {
    CString::new(bytes).map_err(|_| fault("a name holds a zero byte"))
}

impl Writer {
    /// A writer without grids.
    pub fn new() -> Result<Self, Fault> {
        let mut error = sys::lf_error::default();
        // SAFETY: `error` is a valid place.
        let writer = unsafe { sys::lf_writer_new(&mut error) };
        check(&error)?;
        NonNull::new(writer).map(Self).ok_or_else(|| fault("out of memory"))
    }

    /// Begins a grid; its parts are added after.
    pub fn begin(&mut self, grid: &NewGrid) -> Result<(), Fault> {
        let name = text(grid.name.as_bytes())?;
        let class = match grid.class {
            GridClass::FogVolume => 1,
            GridClass::LevelSet => 2,
            GridClass::Staggered | GridClass::Unknown => 0,
        };
        let frustum = grid.frustum.as_ref().map_or(std::ptr::null(), |f| f.as_ptr());
        let mut error = sys::lf_error::default();
        // SAFETY: all pointers are to arrays of the lengths that shim.h states, alive over the call.
        unsafe {
            sys::lf_writer_grid(
                self.0.as_ptr(),
                name.as_ptr(),
                if grid.vectors { 3 } else { 1 },
                i32::from(grid.precision == Precision::Half),
                i32::from(grid.precision == Precision::Double),
                class,
                grid.background.as_ptr(),
                grid.voxel_size,
                grid.translation.as_ptr(),
                frustum,
                &mut error,
            );
        }
        check(&error)
    }

    /// Adds leaves to the grid begun last: 512 values per origin, z fastest; vectors one after the other.
    pub fn leaves(&mut self, origins: &[[i32; 3]], values: &[f32]) -> Result<(), Fault> {
        // SAFETY: the writer is alive.
        let components = unsafe { sys::lf_writer_components(self.0.as_ptr()) };
        // The shim reads as many numbers as the grid has components.
        let numbers =
            usize::try_from(components).ok().filter(|&n| n > 0).and_then(|n| origins.len().checked_mul(512 * n));
        if numbers != Some(values.len()) {
            return Err(fault("values and grid do not fit together"));
        }
        let mut error = sys::lf_error::default();
        // SAFETY: lengths were checked just now.
        unsafe {
            let origins_start = origins.as_ptr().cast();
            sys::lf_writer_leaves(self.0.as_ptr(), origins_start, values.as_ptr(), origins.len() as u64, &mut error);
        }
        check(&error)
    }

    /// Adds tiles to the grid begun last.
    pub fn tiles(&mut self, tiles: &[Tile]) -> Result<(), Fault> {
        if !tiles.iter().all(|t| matches!(t.size, 8 | 128 | 4096)) {
            return Err(fault("tiles have edges of 8, 128 or 4096 voxels"));
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

    /// Writes all grids to `path`. `compression`: 0 none, 1 zlib, 2 Blosc.
    pub fn write(self, path: &Path, compression: u64) -> Result<(), Fault> {
        let path = text(path.as_os_str().as_bytes())?;
        let compression = i32::try_from(compression).map_err(|_| fault("no such compression"))?;
        let mut error = sys::lf_error::default();
        // SAFETY: `path` is a terminated string, alive over the call.
        unsafe { sys::lf_writer_write(self.0.as_ptr(), path.as_ptr(), compression, &mut error) };
        check(&error)
    }
}
