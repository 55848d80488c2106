//! The job of reading: every grid of a file, one after the other, to the other side.

use std::io::{self, Write};
use std::path::Path;

use lanternfish_openvdb::wire::send_grid;

use crate::Fault;
use crate::file::File;

/// Sends every grid of `path`, with its values if `values`.
pub fn read(path: &Path, values: bool, out: &mut impl Write) -> Result<(), Fault> {
    // SAFETY: the file may be damaged and then undo this process. That is what the process is for: it holds nothing else,
    // and the other side believes nothing that it says.
    let file = unsafe { File::open(path) }?;
    for number in 0..file.grid_count() {
        // SAFETY: as above.
        let grid = unsafe { file.load(number, values) }?;
        send_grid(out, &grid).map_err(|error| match error.kind() {
            io::ErrorKind::FileTooLarge => Fault::new(Fault::LIMIT, error.to_string()),
            io::ErrorKind::OutOfMemory => Fault::new(Fault::LIMIT, crate::file::TOO_LITTLE_MEMORY),
            _ => Fault::Pipe,
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
