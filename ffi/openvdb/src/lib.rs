//! OpenVDB files for Lanternfish: grids as leaves and tiles, exactly as stored.
//!
//! OpenVDB trusts what it reads: damage inside a compressed block corrupts the heap, hangs or aborts. And its library with
//! all that it needs takes tens of milliseconds to load. So nothing of it is linked here: [`read_vdb`] and [`VdbWriter`]
//! start the **worker**, the program `lanternfish-vdb` (crate `lanternfish-openvdb-worker`), and exchange grids with it
//! through its standard input and output ([`wire`]). While reading, the worker has limits on memory, processor time and
//! wall-clock time, and what it sends is not trusted either.
//!
//! The worker is what the environment variable [`WORKER_VARIABLE`] names, else what [`set_worker`] names, else
//! `lanternfish-vdb` in the folder of the running executable (for cargo's tests and benchmarks: in the folder above).

#![warn(missing_docs)]

mod locate;
mod process;
mod read;
mod types;
pub mod wire;
mod write;

pub use locate::{WORKER_NAME, WORKER_VARIABLE, set_worker};
pub use read::read_vdb;
#[doc(hidden)]
pub use read::take_answer;
pub use types::{Bounds, GridClass, GridHeader, GridMap, GridValues, Limits, Tile, VdbError, VdbGrid};
pub use write::{Compression, Precision, VdbWriter};
