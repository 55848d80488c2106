//! The built program: what it reads, refuses, says and writes.
//!
//! One program for all of them: it is linked once, and its tests keep all processors busy.

#[path = "../common/mod.rs"]
mod common;
#[path = "../program/mod.rs"]
mod program;

mod bad_input;
mod bad_values;
mod bench;
mod bench_lean;
mod bench_regression;
mod checkpoints;
mod command_line;
mod damaged_files;
mod exporters;
mod faults_of_a_farm;
mod format;
mod limits;
mod logs;
mod monsters;
mod monstrous_volumes;
mod parts;
mod replay;
mod scenes;
mod stability;
mod textures;
