//! Raw bindings of the C shim over OpenVDB (`shim.h` beside this file says what each function does). The safe side is
//! the crate `lanternfish-openvdb`.

#![allow(non_camel_case_types, missing_docs)]

use std::ffi::c_char;

pub const LF_F32: u8 = 0;
pub const LF_F16: u8 = 1;
pub const LF_VEC3: u8 = 2;

pub const LF_NAME: i32 = 0;
pub const LF_UNIQUE_NAME: i32 = 1;
pub const LF_TYPE: i32 = 2;
pub const LF_VALUE_TYPE: i32 = 3;
pub const LF_CLASS: i32 = 4;
pub const LF_MAP: i32 = 5;
pub const LF_SKIPPED: i32 = 6;

#[repr(C)]
pub struct lf_file {
    _private: [u8; 0],
}

#[repr(C)]
pub struct lf_writer {
    _private: [u8; 0],
}

#[repr(C)]
pub struct lf_error {
    pub code: i32,
    pub text: [c_char; 500],
}

impl Default for lf_error {
    fn default() -> Self {
        Self { code: 0, text: [0; 500] }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct lf_info {
    pub active_voxels: u64,
    pub index_min: [i32; 3],
    pub index_max: [i32; 3],
    pub is_frustum: u8,
    pub saved_as_half: u8,
    pub was_level_set: u8,
    pub storage: u8,
    pub matrix: [f64; 16],
    pub frustum: [f64; 8],
    pub background: [f32; 3],
    pub leaves: u64,
    pub tiles: u64,
    pub metadata: u64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct lf_tile {
    pub origin: [i32; 3],
    pub size: i32,
    pub value: [f32; 3],
    pub active: i32,
}

unsafe extern "C" {
    pub fn lf_open(path: *const c_char, error: *mut lf_error) -> *mut lf_file;
    pub fn lf_close(file: *mut lf_file);
    pub fn lf_grid_count(file: *const lf_file) -> u64;
    pub fn lf_grid_string(file: *const lf_file, grid: u64, which: i32, out: *mut c_char, capacity: u64) -> u64;
    pub fn lf_grid_metadata(
        file: *const lf_file,
        grid: u64,
        item: u64,
        value: i32,
        out: *mut c_char,
        capacity: u64,
    ) -> u64;
    pub fn lf_grid_load(file: *mut lf_file, grid: u64, info: *mut lf_info, error: *mut lf_error);
    pub fn lf_grid_copy(
        file: *mut lf_file,
        grid: u64,
        origins: *mut i32,
        values: *mut std::ffi::c_void,
        tiles: *mut lf_tile,
        error: *mut lf_error,
    );
    pub fn lf_grid_free(file: *mut lf_file, grid: u64);
    pub fn lf_writer_new(error: *mut lf_error) -> *mut lf_writer;
    pub fn lf_writer_free(writer: *mut lf_writer);
    pub fn lf_writer_grid(
        writer: *mut lf_writer,
        name: *const c_char,
        components: i32,
        half: i32,
        as_double: i32,
        grid_class: i32,
        background: *const f32,
        voxel_size: f64,
        translation: *const f64,
        frustum: *const f64,
        error: *mut lf_error,
    );
    pub fn lf_writer_components(writer: *const lf_writer) -> i32;
    pub fn lf_writer_leaves(
        writer: *mut lf_writer,
        origins: *const i32,
        values: *const f32,
        count: u64,
        error: *mut lf_error,
    );
    pub fn lf_writer_tiles(writer: *mut lf_writer, tiles: *const lf_tile, count: u64, error: *mut lf_error);
    pub fn lf_writer_write(writer: *mut lf_writer, path: *const c_char, compression: i32, error: *mut lf_error);
}
