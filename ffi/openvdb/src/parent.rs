//! Reading a file through the reader process.

use std::io::{self, Read};
use std::os::fd::AsRawFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{OnceLock, mpsc};

use crate::child::FLAG;
use crate::in_process::put_in_order;
use crate::types::{Limits, VdbError, VdbGrid};
use crate::wire::{HELLO, Kind, receive, receive_grid};

/// The environment variable that names the reader's executable instead of the running program.
pub const READER_VARIABLE: &str = "LANTERNFISH_VDB_READER";

/// The first four bytes of every OpenVDB file.
const MAGIC: [u8; 4] = [0x20, 0x42, 0x44, 0x56];

/// How much the pipe holds, where the system allows it: fewer turns between the processes.
const PIPE_BYTES: libc::c_int = 1 << 20;

static READER: OnceLock<PathBuf> = OnceLock::new();

/// Names the reader's executable instead of the running program, for programs that cannot be their own reader (test
/// harnesses, say). The first call counts; [`READER_VARIABLE`] goes before it.
pub fn set_reader(program: impl Into<PathBuf>) {
    READER.get_or_init(|| program.into());
}

fn reader_program() -> Result<PathBuf, VdbError> {
    match (std::env::var_os(READER_VARIABLE), READER.get()) {
        (Some(program), _) if !program.is_empty() => Ok(program.into()),
        (_, Some(program)) => Ok(program.clone()),
        _ => std::env::current_exe()
            .map_err(|e| VdbError::Reader { program: "of this program".into(), reason: e.to_string() }),
    }
}

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

/// What came through the pipe.
enum Outcome {
    Grids(Vec<VdbGrid>),
    /// The reader's own words, with the letter of their kind in front.
    Refused(String),
    /// The first bytes were not the reader's.
    NotAReader,
    Broken(io::Error),
}

fn receive_all(mut input: ChildStdout, limit: u64) -> Outcome {
    let mut hello = [0u8; HELLO.len()];
    match input.read_exact(&mut hello) {
        Ok(()) if hello == HELLO => {}
        _ => return Outcome::NotAReader,
    }
    let mut grids = Vec::new();
    loop {
        match receive(&mut input, limit) {
            Ok((Kind::End, _)) => return Outcome::Grids(grids),
            Ok((Kind::Error, text)) => return Outcome::Refused(String::from_utf8_lossy(&text).into_owned()),
            Ok((Kind::Header, header)) => match receive_grid(&mut input, &header, limit) {
                Ok(grid) => grids.push(grid),
                Err(error) => return Outcome::Broken(error),
            },
            Ok(_) => return Outcome::Broken(io::Error::new(io::ErrorKind::InvalidData, "frames out of order")),
            Err(error) => return Outcome::Broken(error),
        }
    }
}

fn end(mut child: Child) -> Option<ExitStatus> {
    let _ = child.kill();
    child.wait().ok()
}

fn signal_name(signal: i32) -> String {
    match signal {
        libc::SIGSEGV => "SIGSEGV".into(),
        libc::SIGABRT => "SIGABRT".into(),
        libc::SIGBUS => "SIGBUS".into(),
        libc::SIGILL => "SIGILL".into(),
        libc::SIGFPE => "SIGFPE".into(),
        libc::SIGKILL => "SIGKILL".into(),
        other => format!("number {other}"),
    }
}

/// Reads every grid of `path` in a child process under `limits`: whatever is wrong with the file, the worst that can
/// happen here is an error. The grids come in order of name and number.
pub fn read_vdb(path: &Path, limits: &Limits) -> Result<Vec<VdbGrid>, VdbError> {
    let length = look_at(path)?;
    let (memory, cpu, wall) = limits.resolve(length);
    let program = reader_program()?;
    let mut child = Command::new(&program)
        .arg(FLAG)
        .arg(memory.to_string())
        .arg(cpu.as_secs().max(1).to_string())
        .arg(u8::from(limits.values).to_string())
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        // A Ctrl-C at the terminal is this process's to answer.
        .process_group(0)
        .spawn()
        .map_err(|e| VdbError::Reader { program: program.clone(), reason: e.to_string() })?;
    let Some(stdout) = child.stdout.take() else {
        end(child);
        return Err(VdbError::Reader { program, reason: "it has no output".into() });
    };
    // SAFETY: the descriptor is open; a refusal leaves the pipe as it was.
    unsafe { libc::fcntl(stdout.as_raw_fd(), libc::F_SETPIPE_SZ, PIPE_BYTES) };

    let (sender, receiver) = mpsc::channel();
    let worker = std::thread::spawn(move || sender.send(receive_all(stdout, memory)));
    let outcome = receiver.recv_timeout(wall);
    let damaged = |reason: String| VdbError::Damaged { path: path.into(), reason };
    let Ok(outcome) = outcome else {
        // The pipe closes with the reader, so the worker ends too.
        end(child);
        let _ = worker.join();
        return Err(damaged(format!("the reader did not finish within {} s", wall.as_secs_f32())));
    };
    let _ = worker.join();
    match outcome {
        Outcome::Grids(mut grids) => {
            let _ = child.wait();
            put_in_order(&mut grids);
            Ok(grids)
        }
        Outcome::Refused(text) => {
            let _ = child.wait();
            let reason = text.get(1..).unwrap_or_default().to_owned();
            Err(match text.as_bytes().first() {
                Some(b'L') => VdbError::Limit { path: path.into(), reason },
                Some(b'I') => VdbError::Io { path: path.into(), reason },
                _ => damaged(reason),
            })
        }
        Outcome::NotAReader => {
            let status = end(child);
            Err(match status.and_then(|s| s.signal()).filter(|&s| s != libc::SIGKILL) {
                Some(signal) => damaged(format!("the reader crashed with signal {}", signal_name(signal))),
                None => VdbError::Reader { program, reason: "it does not answer as a reader does".into() },
            })
        }
        Outcome::Broken(error) => {
            let gone = error.kind() == io::ErrorKind::UnexpectedEof;
            let status = if gone { child.wait().ok() } else { end(child) };
            let signal = status.and_then(|s| s.signal());
            Err(match (gone, signal) {
                (true, Some(libc::SIGXCPU | libc::SIGKILL)) => {
                    damaged(format!("the reader ran for over {} s", cpu.as_secs()))
                }
                (true, Some(signal)) => damaged(format!("the reader crashed with signal {}", signal_name(signal))),
                _ => damaged("the reader broke off".into()),
            })
        }
    }
}
