//! Mathematics shared by every room: colour, frames, sampling warps, low-discrepancy points, spectra and
//! robust floating-point arithmetic. Nothing here knows about scenes.

pub mod alias;
pub mod equal_area;
pub mod frame;
pub mod noise;
pub mod phase;
pub mod piecewise;
pub mod rgb;
pub mod robust;
pub mod sampler;
pub mod spectrum;
pub mod summed_area;
pub mod transform;
pub mod warp;

#[cfg(test)]
pub(crate) mod chi2;

pub use frame::Frame;
pub use rgb::Rgb;
pub use sampler::{Dimension, SampleId, SamplePoint};

/// The largest float below 1: the upper bound of a half-open unit interval.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
