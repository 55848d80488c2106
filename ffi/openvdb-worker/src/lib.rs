//! The process that reads and writes .vdb files: all of OpenVDB is in here. It is started by `lanternfish-openvdb`, which
//! says how the two talk, with one of
//!
//! ```text
//! lanternfish-vdb read MEMORY DATA CPU-SECONDS VALUES(0|1) FILE
//! lanternfish-vdb write MEMORY DATA CPU-SECONDS COMPRESSION(0|1|2) FILE
//! ```
//!
//! OpenVDB trusts what it reads: damage inside a compressed block corrupts the heap, hangs or aborts. That is why this is a
//! process of its own. It limits itself, holds nothing that matters, does one job and leaves without tidying up; the other
//! side checks all that it says.

#![warn(missing_docs)]

mod file;
mod reading;
mod writer;
mod writing;

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::process::ExitCode;

use lanternfish_openvdb::wire::{HELLO, Kind, send};

/// What is to be done.
struct Job {
    write: bool,
    /// Address space in bytes.
    memory: u64,
    /// Bytes of it that may be written to.
    data: u64,
    cpu_seconds: u64,
    /// Whether values are wanted; how to compress.
    option: u64,
    path: PathBuf,
}

impl Job {
    fn from_arguments(mut arguments: impl Iterator<Item = OsString>) -> Option<Self> {
        let write = match arguments.next()?.to_str()? {
            "read" => false,
            "write" => true,
            _ => return None,
        };
        let mut number = || arguments.next()?.to_str()?.parse().ok();
        let (memory, data, cpu_seconds, option) = (number()?, number()?, number()?, number()?);
        let path = arguments.next()?.into();
        arguments.next().is_none().then_some(Self { write, memory, data, cpu_seconds, option, path })
    }
}

/// Why a job was not done, for the other side.
enum Fault {
    /// Of the file: one of the letters below, and words.
    Said { letter: char, reason: String },
    /// The other side does not listen or does not speak.
    Pipe,
}

impl Fault {
    const DAMAGED: char = 'D';
    const LIMIT: char = 'L';
    const IO: char = 'I';

    fn new(letter: char, reason: impl Into<String>) -> Self {
        Self::Said { letter, reason: reason.into() }
    }
}

impl From<io::Error> for Fault {
    fn from(_: io::Error) -> Self {
        Self::Pipe
    }
}

/// What `main` of the worker's program does: the job that its arguments name, or, where they name none, a line for people
/// and exit code 2.
pub fn run() -> ExitCode {
    let Some(job) = Job::from_arguments(std::env::args_os().skip(1)) else {
        eprintln!("lanternfish-vdb reads and writes .vdb files for lanternfish, which starts it; it is not for people");
        return ExitCode::from(2);
    };
    let done = work(&job);
    // Leaves without running destructors: a damaged heap must not turn a finished job into a crash.
    // SAFETY: _exit has no preconditions.
    unsafe { libc::_exit(i32::from(done.is_err())) }
}

fn work(job: &Job) -> io::Result<()> {
    // SAFETY: only asks to be killed when the parent is gone; a refusal changes nothing.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) };
    // Not `Stdout`, which would look for ends of lines.
    let mut out = BufWriter::new(File::from(io::stdout().as_fd().try_clone_to_owned()?));
    out.write_all(&HELLO)?;
    out.flush()?;
    limit(libc::RLIMIT_CORE, 0, 0);
    limit(libc::RLIMIT_AS, job.memory, job.memory);
    limit(libc::RLIMIT_DATA, job.data, job.data);
    // At the first a signal that tells why, at the second the end.
    limit(libc::RLIMIT_CPU, job.cpu_seconds, job.cpu_seconds.saturating_add(5));
    let done = if job.write {
        writing::write(&job.path, job.option, job.memory)
    } else {
        reading::read(&job.path, job.option != 0, &mut out)
    };
    match done {
        Ok(()) => send(&mut out, Kind::End, &[])?,
        Err(Fault::Said { letter, reason }) => send(&mut out, Kind::Error, format!("{letter}{reason}").as_bytes())?,
        Err(Fault::Pipe) => return Err(io::ErrorKind::BrokenPipe.into()),
    }
    out.flush()
}

fn limit(resource: libc::__rlimit_resource_t, soft: u64, hard: u64) {
    let bound = libc::rlimit { rlim_cur: soft, rlim_max: hard };
    // SAFETY: `bound` is a valid rlimit; a failure leaves the old limit, which the parent's timeout backs up.
    unsafe { libc::setrlimit(resource, &bound) };
}
