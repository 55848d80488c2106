//! Whole images: against theory, against another renderer, and against each other.
//!
//! One program for all of them: it is linked once, and its tests keep all processors busy.

#[path = "../common/mod.rs"]
mod common;

mod analytic;
mod backends;
mod cameras;
mod checkpoints;
mod colour;
mod consistency;
mod curves;
mod determinism;
mod displacement;
mod furnace;
mod gallery;
mod image_formats;
mod materials;
mod real_files;
mod references;
mod textures;
mod view_rays;
