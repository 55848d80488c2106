//! The parent's side of the job of writing.

use std::ffi::OsString;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Duration;

use super::Compression;
use crate::process::{Failure, Job, Trouble};
use crate::types::VdbError;
use crate::wire::{Kind, NewGrid, Part, WireError, send, send_new_grid};

/// The worker's answer is no longer than this.
const ANSWER_BYTES: u64 = 1 << 16;

/// Bytes that the grids' numbers take.
fn bytes(grids: &[NewGrid]) -> u64 {
    let part = |part: &Part| match part {
        Part::Leaves { values, .. } => size_of_val(values.as_slice()),
        Part::Tiles(tiles) => size_of_val(tiles.as_slice()),
    };
    grids.iter().flat_map(|grid| &grid.parts).map(part).sum::<usize>() as u64
}

fn send_all(grids: &[NewGrid], to: impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(to);
    grids.iter().try_for_each(|grid| send_new_grid(&mut out, grid))?;
    send(&mut out, Kind::End, &[])?;
    out.flush()
}

/// Has the worker `program` write `grids` to `path`.
pub(super) fn write_with(
    program: &Path,
    grids: Vec<NewGrid>,
    path: &Path,
    compression: Compression,
) -> Result<(), VdbError> {
    let compression = match compression {
        Compression::None => 0,
        Compression::Zip => 1,
        Compression::Blosc => 2,
    };
    // The files are ours, so these limits are only against running wild: room for the tree beside what was sent, and
    // a tenth of what zlib writes a second.
    let bytes = bytes(&grids);
    let (memory, seconds) = ((4u64 << 30).saturating_add(bytes.saturating_mul(8)), 60 + bytes / 1_000_000);
    let mut arguments = vec![OsString::from("write")];
    arguments.extend([memory, memory, seconds, compression].map(|n| n.to_string().into()));
    arguments.push(path.into());
    let wall = Duration::from_secs(60 + 4 * seconds);
    let job = Job { program, arguments, input: true, budget: ANSWER_BYTES, wall };
    let written = job.run(move |input, output| {
        // A worker that has to give up stops listening and says why.
        let sent = input.map_or(Err(io::ErrorKind::BrokenPipe.into()), |input| send_all(&grids, input));
        let head = output.head()?;
        match head.kind {
            Kind::End => sent.map_err(|e| WireError::Io(e).into()),
            Kind::Error => Err(Trouble::refused(&output.text(head)?)),
            _ => Err(WireError::Bad("frames out of order").into()),
        }
    });
    written.map_err(|failure| match failure {
        Failure::Program(reason) => VdbError::Reader { program: program.into(), reason },
        Failure::Refused { reason, .. } => VdbError::Write(reason),
        Failure::Stopped(signal) => VdbError::Write(format!("the writer was stopped by {signal}")),
        Failure::Late => VdbError::Write(format!("the writer did not finish within {} s", wall.as_secs())),
        Failure::OutOfTime => VdbError::Write(format!("the writer ran for over {seconds} s")),
        Failure::Killed => VdbError::Write("the system ended the writer, most likely for lack of memory".into()),
        Failure::Crashed(signal) => VdbError::Write(format!("the writer crashed with signal {signal}")),
        Failure::Memory => VdbError::Write("out of memory".into()),
        Failure::Broken | Failure::TooMuch => VdbError::Write("the writer broke off".into()),
    })
}
