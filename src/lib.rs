//! Lanternfish: a CPU production renderer for scenes with very many lights and OpenVDB volumes.
//!
//! Rooms, from the top; each uses only those below it: [`cli`], [`mod@bench`], [`report`], [`farm`], [`stability`], [`render`], [`integrator`], [`light`],
//! [`medium`], [`material`], [`geometry`], [`gallery`], [`film`], [`scene`], [`math`], [`system`].

#![forbid(unsafe_code)]
#![warn(missing_docs)]
// The documentation is for those who work on it: `cargo doc --document-private-items`.
#![allow(rustdoc::private_intra_doc_links)]

pub mod bench;
pub mod cache_points;
pub mod cli;
pub mod farm;
pub mod film;
#[doc(hidden)]
pub mod fuzzing;
pub mod gallery;
pub mod geometry;
pub mod integrator;
pub mod light;
pub mod material;
pub mod math;
pub mod medium;
pub mod render;
pub mod report;
pub mod scene;
pub mod stability;
pub mod system;
