//! OpenVDB files for Lanternfish: grids as leaves and tiles, exactly as stored.
//!
//! OpenVDB trusts what it reads: damage inside a compressed block corrupts the heap, hangs or aborts. So [`read_vdb`]
//! reads in a **child process** with limits on memory, processor time and wall-clock time, which sends the grids through
//! a pipe. The child is the running program itself, started with a hidden first argument: `main` must call
//! [`run_reader_if_asked`] before anything else. Where the running program cannot do that (test harnesses), the
//! environment variable `LANTERNFISH_VDB_READER` names an executable that does, such as this crate's `vdb-reader`.
//!
//! [`VdbWriter`] writes fog volumes.

#![warn(missing_docs)]

mod child;
mod in_process;
mod parent;
mod types;
mod wire;
mod write;

pub use child::run_reader_if_asked;
pub use in_process::read_vdb_in_process;
pub use parent::{READER_VARIABLE, read_vdb, set_reader};
pub use types::{GridClass, GridHeader, GridMap, GridValues, Limits, Tile, VdbError, VdbGrid};
pub use write::{Compression, Precision, VdbWriter};
