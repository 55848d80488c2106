//! Starting the worker, talking to it for at most so long, and finding out how it ended.

use std::ffi::OsString;
use std::os::fd::AsRawFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use crate::wire::{Receiver, WireError};

/// How much a pipe holds, where the system allows it: fewer turns between the processes.
const PIPE_BYTES: libc::c_int = 1 << 20;

/// Characters of a worker's reason.
const MAX_REASON: usize = 600;

/// How long a worker that has closed its pipe may take to end.
const GRACE: Duration = Duration::from_secs(2);

/// A worker to be started.
pub(crate) struct Job<'a> {
    pub program: &'a Path,
    pub arguments: Vec<OsString>,
    /// Whether it is sent something.
    pub input: bool,
    /// Bytes taken from it in all.
    pub budget: u64,
    /// How long it may take.
    pub wall: Duration,
}

/// Why talking ended early.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// The first bytes were not a worker's.
    NoHello,
    /// The worker's own words, with the letter of their kind in front.
    Refused(String),
    Wire(WireError),
}

impl From<WireError> for Trouble {
    fn from(error: WireError) -> Self {
        Self::Wire(error)
    }
}

impl Trouble {
    /// From the payload of an error frame.
    pub fn refused(text: &[u8]) -> Self {
        Self::Refused(String::from_utf8_lossy(text).into_owned())
    }
}

/// Why nothing came of a job.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The program cannot be started or is no worker.
    Program(String),
    /// The worker's own words.
    Refused { letter: char, reason: String },
    /// Somebody sent it this signal.
    Stopped(&'static str),
    /// It took longer than `Job::wall`.
    Late,
    /// Its processor time is used up.
    OutOfTime,
    /// The system killed it, most likely because the machine's memory is used up.
    Killed,
    /// A signal that a fault of its own raised.
    Crashed(String),
    /// It broke off, or what it sent made no sense.
    Broken,
    /// It sent more than `Job::budget`.
    TooMuch,
    /// There is no memory for what it sent.
    Memory,
}

impl Job<'_> {
    /// Starts the worker, waits for its greeting, lets `talk` talk to it, and ends it.
    pub fn run<T: Send + 'static>(
        self,
        talk: impl FnOnce(Option<ChildStdin>, &mut Receiver<ChildStdout>) -> Result<T, Trouble> + Send + 'static,
    ) -> Result<T, Failure> {
        let mut child = Command::new(self.program)
            .args(self.arguments)
            .stdin(if self.input { Stdio::piped() } else { Stdio::null() })
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            // A Ctrl-C at the terminal is this process's to answer.
            .process_group(0)
            .spawn()
            .map_err(|e| Failure::Program(e.to_string()))?;
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take());
        let Some(stdout) = stdout else {
            end(child);
            return Err(Failure::Program("it has no output".into()));
        };
        for pipe in stdin.iter().map(AsRawFd::as_raw_fd).chain([stdout.as_raw_fd()]) {
            // SAFETY: the descriptor is open; a refusal leaves the pipe as it was.
            unsafe { libc::fcntl(pipe, libc::F_SETPIPE_SZ, PIPE_BYTES) };
        }

        let (sender, receiver) = mpsc::channel();
        let budget = self.budget;
        let talking = std::thread::Builder::new().spawn(move || {
            let mut receiver = Receiver::new(stdout, budget);
            let said = if receiver.hello() { talk(stdin, &mut receiver) } else { Err(Trouble::NoHello) };
            // Nobody listens any more where it took too long.
            let _ = sender.send(said);
        });
        let Ok(talking) = talking else {
            end(child);
            return Err(Failure::Memory);
        };
        let said = receiver.recv_timeout(self.wall);
        let status = match &said {
            Err(_) | Ok(Ok(_)) => end(child),
            Ok(Err(Trouble::NoHello | Trouble::Wire(WireError::Io(_)))) => wait(child),
            Ok(Err(_)) => end(child),
        };
        // The pipes close with the worker, so the thread ends too.
        let _ = talking.join();
        match said {
            Ok(said) => said.map_err(|trouble| judge(trouble, status)),
            Err(mpsc::RecvTimeoutError::Timeout) => Err(Failure::Late),
            Err(mpsc::RecvTimeoutError::Disconnected) => Err(Failure::Broken),
        }
    }
}

/// Ends the worker now, with whatever it has started: that might hold the pipes open.
fn end(mut child: Child) -> Option<ExitStatus> {
    // SAFETY: no memory is touched. The child leads a process group of its own and was not waited for, so the number is its.
    unsafe { libc::kill(-(child.id() as libc::pid_t), libc::SIGKILL) };
    child.wait().ok()
}

/// How the worker, whose pipe is closed, ended by itself; one that does not is killed.
fn wait(mut child: Child) -> Option<ExitStatus> {
    let start = Instant::now();
    while let Ok(None) = child.try_wait() {
        if start.elapsed() > GRACE {
            end(child);
            return None;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    // Known since then.
    child.wait().ok()
}

/// What to blame, given how the worker ended.
fn judge(trouble: Trouble, status: Option<ExitStatus>) -> Failure {
    let signal = status.and_then(|s| s.signal());
    match (trouble, signal) {
        (Trouble::Refused(text), _) => {
            let mut letters = text.chars();
            let letter = letters.next().unwrap_or_default();
            Failure::Refused { letter, reason: letters.take(MAX_REASON).collect() }
        }
        (_, Some(libc::SIGINT)) => Failure::Stopped("SIGINT"),
        (_, Some(libc::SIGTERM)) => Failure::Stopped("SIGTERM"),
        (_, Some(libc::SIGHUP)) => Failure::Stopped("SIGHUP"),
        (Trouble::NoHello, Some(signal)) => {
            Failure::Program(format!("signal {} ended it before it answered", signal_name(signal)))
        }
        (Trouble::NoHello, None) => Failure::Program(match status.and_then(|s| s.code()) {
            Some(code) => format!("it ended with exit code {code} and did not answer; started by hand it may say why"),
            None => "it does not answer as it should".into(),
        }),
        (Trouble::Wire(WireError::TooMuch), _) => Failure::TooMuch,
        (Trouble::Wire(WireError::Memory), _) => Failure::Memory,
        (Trouble::Wire(WireError::Io(_)), Some(libc::SIGXCPU)) => Failure::OutOfTime,
        (Trouble::Wire(WireError::Io(_)), Some(libc::SIGKILL)) => Failure::Killed,
        (Trouble::Wire(WireError::Io(_)), Some(signal)) => Failure::Crashed(signal_name(signal)),
        (Trouble::Wire(_), _) => Failure::Broken,
    }
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
