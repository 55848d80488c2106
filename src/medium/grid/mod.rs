//! Media given by grids: sparse bricks of voxels ([`sparse`]), where they lie ([`map`], [`field`]), what they emit
//! ([`emission`]), bounds of their extinction ([`majorants`]) with what is empty around them ([`clearance`]), how densely emission is gathered
//! ([`gathering`]), and how a ray is led along both ([`dda`]); and how all of
//! it moves ([`motion`], [`velocity`]).
//!
//! Everything but reading .vdb files ([`mod@file`]) is plain Rust and exists without the feature `openvdb`.

pub mod blocks;
mod bounds;
mod clearance;
pub mod dda;
pub mod emission;
pub mod energy;
pub mod field;
pub mod file;
pub mod gathering;
pub mod majorants;
pub mod map;
mod medium;
pub mod motion;
pub mod nanovdb;
pub mod sparse;
mod survey;
pub mod velocity;

pub use medium::{GridMedium, GridMediumParts};

#[cfg(all(test, feature = "openvdb"))]
mod real_files;
#[cfg(test)]
mod tests;
