//! The `lanternfish` command.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use lanternfish::cli::{self, Arguments};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    // Volume files are read by a child process, which is this very program.
    #[cfg(feature = "openvdb")]
    openvdb::run_reader_if_asked();
    cli::run(&Arguments::parse()).into()
}
