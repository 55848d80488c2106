//! Reading a file through the worker.

use std::ffi::OsString;
use std::io::Read;
use std::path::Path;

use crate::locate;
use crate::process::{Failure, Job, Trouble};
use crate::types::{Bounds, Limits, VdbError, VdbGrid};
use crate::wire::{Kind, Receiver, WireError, receive_grid};

/// The first four bytes of every OpenVDB file.
const MAGIC: [u8; 4] = [0x20, 0x42, 0x44, 0x56];

/// The length in bytes of a file that looks like OpenVDB's.
fn look_at(path: &Path) -> Result<u64, VdbError> {
    let failed = |reason: String| VdbError::Io { path: path.into(), reason };
    let mut file = std::fs::File::open(path).map_err(|e| failed(e.to_string()))?;
    let metadata = file.metadata().map_err(|e| failed(e.to_string()))?;
    if !metadata.is_file() {
        return Err(failed("not a regular file".into()));
    }
    let mut magic = [0u8; 4];
    if file.read_exact(&mut magic).is_err() || magic != MAGIC {
        return Err(VdbError::Damaged { path: path.into(), reason: "it does not begin as OpenVDB files do".into() });
    }
    Ok(metadata.len())
}

/// Every grid that comes through the pipe.
fn receive_all<R: Read>(input: &mut Receiver<R>) -> Result<Vec<VdbGrid>, Trouble> {
    let mut grids = Vec::new();
    loop {
        let head = input.head()?;
        match head.kind {
            Kind::End => return Ok(grids),
            Kind::Error => return Err(Trouble::refused(&input.text(head)?)),
            Kind::Header => {
                grids.try_reserve(1).map_err(|_| WireError::Memory)?;
                grids.push(receive_grid(input, head)?);
            }
            _ => return Err(WireError::Bad("frames out of order").into()),
        }
    }
}

/// The grids in what a worker says, from its greeting on, if they take no more than `budget` bytes: for fuzz targets, which say what no worker
/// would.
#[doc(hidden)]
pub fn take_answer(said: &[u8], budget: u64) -> Result<Vec<VdbGrid>, String> {
    let mut receiver = Receiver::new(said, budget);
    if !receiver.hello() {
        return Err("no worker".into());
    }
    let mut grids = receive_all(&mut receiver).map_err(|trouble| format!("{trouble:?}"))?;
    put_in_order(&mut grids);
    Ok(grids)
}

/// Puts grids in order of name and number, and renumbers those of one name from 0 without gaps.
fn put_in_order(grids: &mut [VdbGrid]) {
    grids.sort_by(|a, b| (&a.header.name, a.header.index).cmp(&(&b.header.name, b.header.index)));
    for i in 0..grids.len() {
        let repeated = i > 0 && grids[i - 1].header.name == grids[i].header.name;
        grids[i].header.index = if repeated { grids[i - 1].header.index + 1 } else { 0 };
    }
}

/// Reads every grid of `path` in the worker process under `limits`: whatever is wrong with the file, the worst that can
/// happen here is an error. The grids come in order of name and number, and take no more memory than the worker may.
pub fn read_vdb(path: &Path, limits: &Limits) -> Result<Vec<VdbGrid>, VdbError> {
    let length = look_at(path)?;
    read_with(&locate::worker()?, path, length, limits)
}

fn read_with(program: &Path, path: &Path, length: u64, limits: &Limits) -> Result<Vec<VdbGrid>, VdbError> {
    let Bounds { memory, data, cpu, wall } = limits.resolve(length);
    let numbers = [memory, data, cpu.as_secs().max(1), u64::from(limits.values)];
    let mut arguments = vec![OsString::from("read")];
    arguments.extend(numbers.map(|n| n.to_string().into()));
    arguments.push(path.into());
    let job = Job { program, arguments, input: false, budget: data, wall };
    let mut grids = job.run(|_, output| receive_all(output)).map_err(|failure| {
        let damaged = |reason: String| VdbError::Damaged { path: path.into(), reason };
        let limit = |reason: String| VdbError::Limit { path: path.into(), reason };
        // Not all of OpenVDB bears being refused memory: where there is little, that is what it most likely broke on.
        let is_short = data < Limits { memory: None, data: None, ..*limits }.resolve(length).data;
        // What is allowed otherwise follows from the file's size, and sound files need much less.
        let too_much = |reason: String| {
            if is_short {
                limit(reason)
            } else {
                damaged(format!("{reason}: far more than a sound file of its size needs"))
            }
        };
        let ended =
            |how: &str| format!("the reader {how}, most likely for lack of memory: it may have {} MiB", data >> 20);
        match failure {
            Failure::Program(reason) => VdbError::Reader { program: program.into(), reason },
            Failure::Refused { letter: 'L', reason } => too_much(reason),
            Failure::Refused { letter: 'I', reason } => VdbError::Io { path: path.into(), reason },
            Failure::Refused { reason, .. } => damaged(reason),
            Failure::Stopped(signal) => VdbError::Stopped { path: path.into(), signal },
            Failure::Late => damaged(format!("the reader did not finish within {} s", wall.as_secs_f32())),
            Failure::OutOfTime => damaged(format!("the reader ran for over {} s", cpu.as_secs())),
            Failure::Killed => limit("the system ended the reader, most likely for lack of memory".into()),
            Failure::Crashed(_) if is_short => limit(ended("crashed")),
            Failure::Broken if is_short => limit(ended("broke off")),
            Failure::Crashed(signal) => damaged(format!("the reader crashed with signal {signal}")),
            Failure::Broken => damaged("the reader broke off".into()),
            Failure::TooMuch => too_much(format!("its grids take more than {} MiB", data >> 20)),
            Failure::Memory => limit("there is not enough memory for its grids".into()),
        }
    })?;
    put_in_order(&mut grids);
    Ok(grids)
}

#[cfg(test)]
mod tests;
