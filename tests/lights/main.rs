//! Choosing among lights: that every way to do so gives the same image, and what learning gains.
//!
//! One program for all of them: it is linked once, and its tests keep all processors busy.

#[path = "../common/mod.rs"]
mod common;

mod beams;
mod distributions;
mod extremes;
mod learning;
mod learning_bias;
mod linking;
mod moving;
mod selection;
mod selectors;
