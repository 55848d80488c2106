//! The `lanternfish` command.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use lanternfish::cli::{self, Arguments};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    cli::run(&Arguments::parse()).into()
}
