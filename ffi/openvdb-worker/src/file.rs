//! Reading in this very process, through the shim. OpenVDB trusts what it reads, so this is `unsafe`: see [`File::open`].

use std::ffi::{CString, c_char};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::ptr::NonNull;

use half::f16;
use lanternfish_openvdb::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbGrid};
use openvdb_sys as sys;

use crate::Fault;

/// The shim's words.
pub fn message(error: &sys::lf_error) -> String {
    let bytes: Vec<u8> = error.text.iter().take_while(|&&c| c != 0).map(|&c| c as u8).collect();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    // OpenVDB puts its exception's name in front of each text.
    text.strip_prefix("IoError: ").map(str::to_owned).unwrap_or(text)
}

/// An open file of the shim.
pub struct File(NonNull<sys::lf_file>);

impl Drop for File {
    fn drop(&mut self) {
        // SAFETY: the pointer came from lf_open and is closed once, here.
        unsafe { sys::lf_close(self.0.as_ptr()) }
    }
}

/// What is said where memory runs out.
pub const TOO_LITTLE_MEMORY: &str = "reading it takes more memory than is allowed";

/// Values of metadata are cut to this many bytes.
const MAX_METADATA: usize = 4096;

fn check(error: &sys::lf_error) -> Result<(), Fault> {
    match error.code {
        0 => Ok(()),
        2 => Err(Fault::new(Fault::LIMIT, TOO_LITTLE_MEMORY)),
        _ => Err(Fault::new(Fault::DAMAGED, message(error))),
    }
}

/// `count` times `value`.
fn filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>, Fault> {
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|_| Fault::new(Fault::LIMIT, TOO_LITTLE_MEMORY))?;
    all.resize(count, value);
    Ok(all)
}

impl File {
    /// Opens a file.
    ///
    /// # Safety
    /// OpenVDB writes where damage in the file tells it to. Either the file is whole, or nothing in this process
    /// matters and nothing that it says from now on is believed.
    pub unsafe fn open(path: &Path) -> Result<Self, Fault> {
        let name = CString::new(path.as_os_str().as_bytes())
            .map_err(|_| Fault::new(Fault::IO, "the name holds a zero byte"))?;
        let mut error = sys::lf_error::default();
        // SAFETY: `name` is a terminated string and `error` a valid place, both alive over the call.
        let file = unsafe { sys::lf_open(name.as_ptr(), &mut error) };
        check(&error)?;
        NonNull::new(file).map(Self).ok_or_else(|| Fault::new(Fault::DAMAGED, "it cannot be opened"))
    }

    /// How many grids there are.
    pub fn grid_count(&self) -> u64 {
        // SAFETY: the file is open.
        unsafe { sys::lf_grid_count(self.0.as_ptr()) }
    }

    fn string(&self, grid: u64, which: i32) -> String {
        // SAFETY: `grid` is below grid_count, `which` one of the LF_ constants; the shim writes at most `capacity` bytes.
        two_phase(|out, capacity| unsafe { sys::lf_grid_string(self.0.as_ptr(), grid, which, out, capacity) })
    }

    /// Grid number `grid`, below [`File::grid_count`]; its values if `values`.
    ///
    /// # Safety
    /// As for [`File::open`].
    pub unsafe fn load(&self, grid: u64, values: bool) -> Result<VdbGrid, Fault> {
        assert!(grid < self.grid_count(), "there is such a grid");
        let mut info = sys::lf_info::default();
        let mut error = sys::lf_error::default();
        // SAFETY: `grid` is below grid_count; both places are valid over the call.
        unsafe { sys::lf_grid_load(self.0.as_ptr(), grid, &mut info, &mut error) };
        check(&error)?;
        let header = self.header(grid, &info);
        let mut leaf_origins = Vec::new();
        let mut tiles = Vec::new();
        let mut stored = GridValues::Absent;
        if values && header.skipped.is_none() {
            let leaves = info.leaves as usize;
            leaf_origins = filled([0i32; 3], leaves)?;
            let mut raw_tiles = filled(sys::lf_tile::default(), info.tiles as usize)?;
            let numbers = leaves.saturating_mul(512);
            stored = match info.storage {
                sys::LF_F16 => GridValues::F16(filled(f16::ZERO, numbers)?),
                sys::LF_VEC3 => GridValues::Vec3(filled([0.0; 3], numbers)?),
                _ => GridValues::F32(filled(0.0, numbers)?),
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
            check(&error)?;
            tiles = filled(Tile { origin: [0; 3], size: 0, value: [0.0; 3], active: false }, raw_tiles.len())?;
            for (tile, t) in tiles.iter_mut().zip(&raw_tiles) {
                *tile = Tile { origin: t.origin, size: t.size, value: t.value, active: t.active != 0 };
            }
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
                (cut(part(0)), cut(part(1)))
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

/// `text`, or its beginning.
fn cut(mut text: String) -> String {
    if text.len() > MAX_METADATA {
        text.truncate(text.floor_char_boundary(MAX_METADATA));
        text.push('…');
    }
    text
}
