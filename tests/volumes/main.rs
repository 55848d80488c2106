//! Media: that they are right, fast where nothing is, and light and are lit.
//!
//! One program for all of them: it is linked once, and its tests keep all processors busy.

#[path = "../common/mod.rs"]
mod common;
#[path = "../program/mod.rs"]
mod program;

mod damage;
mod dense;
mod emission;
mod extremes;
mod files;
mod lights;
mod motion;
mod places;
mod sampling;
mod voxels;
mod worker;
