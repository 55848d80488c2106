//! Numbers about images: comparison of two, contents of one.

pub mod cache_points;
pub mod compare;
pub mod info;

pub use compare::{CompareError, Comparison, compare, write_difference};
pub use info::{ExrInfo, info_exr};
