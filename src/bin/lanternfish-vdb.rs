//! The `lanternfish-vdb` program: reads and writes .vdb files for `lanternfish`, which starts it. A process of its own,
//! because damaged files bring OpenVDB down, and because its libraries take long to load.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    openvdb_worker::run()
}
