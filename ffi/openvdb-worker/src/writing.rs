//! The job of writing: grids from the other side to a file.

use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::path::Path;

use lanternfish_openvdb::wire::{Kind, NewGrid, Part, Receiver, WireError, receive_new_grid};

use crate::Fault;
use crate::writer::Writer;

impl From<WireError> for Fault {
    fn from(error: WireError) -> Self {
        match error {
            WireError::Memory => Self::new(Self::LIMIT, "out of memory"),
            // Whoever sent it does not wait for an answer.
            WireError::Io(_) | WireError::Bad(_) | WireError::TooMuch => Self::Pipe,
        }
    }
}

/// Writes the grids that come through standard input, `memory` bytes at most.
pub fn write(path: &Path, compression: u64, memory: u64) -> Result<(), Fault> {
    let mut input = Receiver::new(File::from(io::stdin().as_fd().try_clone_to_owned()?), memory);
    let mut writer = Writer::new()?;
    let mut head = input.head()?;
    while head.kind == Kind::Header {
        let (grid, next) = receive_new_grid(&mut input, head)?;
        put(&mut writer, &grid)?;
        head = next;
    }
    if head.kind == Kind::End { writer.write(path, compression) } else { Err(Fault::Pipe) }
}

/// Adds a grid.
pub fn put(writer: &mut Writer, grid: &NewGrid) -> Result<(), Fault> {
    writer.begin(grid)?;
    for part in &grid.parts {
        match part {
            Part::Leaves { origins, values } => writer.leaves(origins, values)?,
            Part::Tiles(tiles) => writer.tiles(tiles)?,
        }
    }
    Ok(())
}
