//! Reading in this very process: what the reader process does, and what only trusted files may be given to.

use std::ffi::{CString, c_char};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::ptr::NonNull;

use half::f16;
use openvdb_sys as sys;

use crate::types::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbError, VdbGrid};

pub(crate) fn message(error: &sys::lf_error) -> String {
    let bytes: Vec<u8> = error.text.iter().take_while(|&&c| c != 0).map(|&c| c as u8).collect();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    // OpenVDB puts its exception's name in front of each text.
    text.strip_prefix("IoError: ").map(str::to_owned).unwrap_or(text)
}

/// An open file of the shim.
pub(crate) struct File(NonNull<sys::lf_file>);

impl Drop for File {
    fn drop(&mut self) {
        // SAFETY: the pointer came from lf_open and is closed once, here.
        unsafe { sys::lf_close(self.0.as_ptr()) }
    }
}

fn check(path: &Path, error: &sys::lf_error) -> Result<(), VdbError> {
    match error.code {
        0 => Ok(()),
        2 => Err(VdbError::Limit { path: path.into(), reason: "reading it takes more memory than is allowed".into() }),
        _ => Err(VdbError::Damaged { path: path.into(), reason: message(error) }),
    }
}

impl File {
    pub(crate) fn open(path: &Path) -> Result<Self, VdbError> {
        let name = CString::new(path.as_os_str().as_bytes())
            .map_err(|_| VdbError::Io { path: path.into(), reason: "the name holds a zero byte".into() })?;
        let mut error = sys::lf_error::default();
        // SAFETY: `name` is a terminated string and `error` a valid place, both alive over the call.
        let file = unsafe { sys::lf_open(name.as_ptr(), &mut error) };
        check(path, &error)?;
        NonNull::new(file)
            .map(Self)
            .ok_or_else(|| VdbError::Damaged { path: path.into(), reason: "it cannot be opened".into() })
    }

    pub(crate) fn grid_count(&self) -> u64 {
        // SAFETY: the file is open.
        unsafe { sys::lf_grid_count(self.0.as_ptr()) }
    }

    fn string(&self, grid: u64, which: i32) -> String {
        // SAFETY: `grid` is below grid_count, `which` one of the LF_ constants; the shim writes at most `capacity` bytes.
        two_phase(|out, capacity| unsafe { sys::lf_grid_string(self.0.as_ptr(), grid, which, out, capacity) })
    }

    /// Loads grid number `grid`, hands its header and then, if `values`, its contents to `sink`, and frees it.
    pub(crate) fn load(&self, path: &Path, grid: u64, values: bool) -> Result<VdbGrid, VdbError> {
        let mut info = sys::lf_info::default();
        let mut error = sys::lf_error::default();
        // SAFETY: `grid` is below grid_count; both places are valid over the call.
        unsafe { sys::lf_grid_load(self.0.as_ptr(), grid, &mut info, &mut error) };
        check(path, &error)?;
        let header = self.header(grid, &info);
        let mut leaf_origins = Vec::new();
        let mut tiles = Vec::new();
        let mut stored = GridValues::Absent;
        if values && header.skipped.is_none() {
            let leaves = info.leaves as usize;
            leaf_origins = vec![[0i32; 3]; leaves];
            let mut raw_tiles = vec![sys::lf_tile::default(); info.tiles as usize];
            stored = match info.storage {
                sys::LF_F16 => GridValues::F16(vec![f16::ZERO; leaves * 512]),
                sys::LF_VEC3 => GridValues::Vec3(vec![[0.0; 3]; leaves * 512]),
                _ => GridValues::F32(vec![0.0; leaves * 512]),
            };
            let target = match &mut stored {
                GridValues::F16(v) => v.as_mut_ptr().cast(),
                GridValues::Vec3(v) => v.as_mut_ptr().cast(),
                GridValues::F32(v) => v.as_mut_ptr().cast(),
                GridValues::Absent => std::ptr::null_mut(),
            };
            // SAFETY: each buffer has the length that lf_grid_load counted, in the element type of `storage`.
            unsafe {
                sys::lf_grid_copy(
                    self.0.as_ptr(),
                    grid,
                    leaf_origins.as_mut_ptr().cast(),
                    target,
                    raw_tiles.as_mut_ptr(),
                    &mut error,
                );
            }
            check(path, &error)?;
            tiles = raw_tiles
                .iter()
                .map(|t| Tile { origin: t.origin, size: t.size, value: t.value, active: t.active != 0 })
                .collect();
        }
        // SAFETY: `grid` is below grid_count.
        unsafe { sys::lf_grid_free(self.0.as_ptr(), grid) };
        Ok(VdbGrid { header, leaf_origins, values: stored, tiles })
    }

    fn header(&self, grid: u64, info: &sys::lf_info) -> GridHeader {
        let skipped = self.string(grid, sys::LF_SKIPPED);
        let f = &info.frustum;
        let map = if info.is_frustum != 0 {
            GridMap::Frustum {
                min: [f[0], f[1], f[2]],
                max: [f[3], f[4], f[5]],
                taper: f[6],
                depth: f[7],
                second: info.matrix,
            }
        } else {
            GridMap::Affine(info.matrix)
        };
        let metadata = (0..info.metadata)
            .map(|item| {
                let part = |value| {
                    // SAFETY: `grid` and `item` are below their counts; the shim writes at most `capacity` bytes.
                    two_phase(|out, capacity| unsafe {
                        sys::lf_grid_metadata(self.0.as_ptr(), grid, item, value, out, capacity)
                    })
                };
                (part(0), part(1))
            })
            .collect();
        let has_bounds = (0..3).all(|i| info.index_min[i] <= info.index_max[i]);
        GridHeader {
            name: self.string(grid, sys::LF_NAME),
            index: unique_index(&self.string(grid, sys::LF_UNIQUE_NAME)),
            type_name: self.string(grid, sys::LF_TYPE),
            value_type: self.string(grid, sys::LF_VALUE_TYPE),
            class: GridClass::from_word(&self.string(grid, sys::LF_CLASS)),
            map_name: self.string(grid, sys::LF_MAP),
            map,
            background: info.background,
            active_voxels: info.active_voxels,
            index_bounds: (has_bounds && info.active_voxels > 0).then_some((info.index_min, info.index_max)),
            saved_as_half: info.saved_as_half != 0,
            was_level_set: info.was_level_set != 0,
            leaf_count: info.leaves,
            tile_count: info.tiles,
            skipped: (!skipped.is_empty()).then_some(skipped),
            metadata,
        }
    }
}

fn two_phase(copy: impl Fn(*mut c_char, u64) -> u64) -> String {
    let length = copy(std::ptr::null_mut(), 0);
    let mut bytes = vec![0u8; length as usize];
    copy(bytes.as_mut_ptr().cast(), length);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The number in `name[3]`; 0 where there is none.
fn unique_index(unique: &str) -> u32 {
    unique.strip_suffix(']').and_then(|u| u.rsplit_once('[')).and_then(|(_, digits)| digits.parse().ok()).unwrap_or(0)
}

/// Puts grids in order of name and number, and renumbers those of one name from 0 without gaps.
pub(crate) fn put_in_order(grids: &mut [VdbGrid]) {
    grids.sort_by(|a, b| (&a.header.name, a.header.index).cmp(&(&b.header.name, b.header.index)));
    let mut last: Option<(String, u32)> = None;
    for grid in grids {
        let index = match &last {
            Some((name, index)) if *name == grid.header.name => index + 1,
            _ => 0,
        };
        grid.header.index = index;
        last = Some((grid.header.name.clone(), index));
    }
}

/// Reads every grid of `path` in this process. A damaged file can bring the process down: see [`crate::read_vdb`].
pub fn read_vdb_in_process(path: &Path, values: bool) -> Result<Vec<VdbGrid>, VdbError> {
    let file = File::open(path)?;
    let mut grids =
        (0..file.grid_count()).map(|grid| file.load(path, grid, values)).collect::<Result<Vec<_>, VdbError>>()?;
    put_in_order(&mut grids);
    Ok(grids)
}
