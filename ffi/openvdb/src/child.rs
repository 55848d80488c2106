//! The reader process: limits itself, reads, sends.

use std::io::{BufWriter, Write};
use std::os::unix::ffi::OsStringExt;
use std::path::PathBuf;

use crate::in_process::File;
use crate::types::VdbError;
use crate::wire::{HELLO, Kind, send, send_grid};

/// The hidden first argument.
pub(crate) const FLAG: &str = "--vdb-reader";

fn limit(resource: libc::__rlimit_resource_t, value: u64) {
    let bound = libc::rlimit { rlim_cur: value, rlim_max: value };
    // SAFETY: `bound` is a valid rlimit; a failure leaves the old limit, which the parent's timeout backs up.
    unsafe { libc::setrlimit(resource, &bound) };
}

/// Becomes the reader process and never returns if this program was started as one; otherwise returns at once.
/// `main` must call it first.
pub fn run_reader_if_asked() {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_none_or(|first| first != FLAG) {
        return;
    }
    let numbers: Vec<u64> = arguments.by_ref().take(3).filter_map(|a| a.into_string().ok()?.parse().ok()).collect();
    let (Some(path), &[memory, cpu_seconds, values]) = (arguments.next(), numbers.as_slice()) else {
        std::process::exit(2);
    };
    // SAFETY: only asks to be killed when the parent is gone; a refusal changes nothing.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) };
    limit(libc::RLIMIT_CORE, 0);
    limit(libc::RLIMIT_AS, memory);
    limit(libc::RLIMIT_CPU, cpu_seconds);
    let path = PathBuf::from(std::ffi::OsString::from_vec(path.into_vec()));
    let mut out = BufWriter::with_capacity(1 << 20, std::io::stdout().lock());
    let sent =
        out.write_all(&HELLO).and_then(|()| out.flush()).and_then(|()| match read(&path, values != 0, &mut out) {
            Ok(result) => result,
            Err(error) => {
                let (code, reason) = match error {
                    VdbError::Limit { reason, .. } => ('L', reason),
                    VdbError::Io { reason, .. } => ('I', reason),
                    VdbError::Damaged { reason, .. } => ('D', reason),
                    other => ('D', other.to_string()),
                };
                send(&mut out, Kind::Error, format!("{code}{reason}").as_bytes())
            }
        });
    let finished = sent.and_then(|()| out.flush());
    // Leaves without running destructors: a damaged heap must not turn a finished job into a crash.
    // SAFETY: _exit has no preconditions.
    unsafe { libc::_exit(if finished.is_ok() { 0 } else { 1 }) }
}

fn read(path: &std::path::Path, values: bool, out: &mut impl Write) -> Result<std::io::Result<()>, VdbError> {
    let file = File::open(path)?;
    for grid in 0..file.grid_count() {
        let grid = file.load(path, grid, values)?;
        if let Err(error) = send_grid(out, &grid) {
            return Ok(Err(error));
        }
    }
    Ok(send(out, Kind::End, &[]))
}
