//! Ctrl-C and requests to terminate. Before rendering there is nothing to keep: the process ends at once. While it renders, the
//! first request stops it, so that the image so far and a checkpoint are written, and a second one ends the process. SIGHUP asks for a checkpoint alone.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::iterator::Signals;

use super::ExitStatus;
use crate::system::output::exit_at_once;

/// What has been asked for, and whether there is anything to keep.
#[derive(Default)]
pub struct Interrupts {
    /// Set by the first request while rendering.
    pub stop: AtomicBool,
    /// Set by a request to keep what there is and go on.
    pub keep: AtomicBool,
    rendering: AtomicBool,
}

impl Interrupts {
    /// Listens from now on. A limit on the size of files becomes an error of the write that meets it, instead of the end of the process.
    pub fn listen() -> Arc<Self> {
        let state = Arc::new(Self::default());
        let heard = state.clone();
        // Where no handler can be installed, the default one ends the process: nothing is half-written.
        let wanted = [SIGINT, SIGTERM, SIGUSR1, SIGHUP, SIGXFSZ].into_iter().filter(|&signal| !is_ignored(signal));
        if let Ok(mut signals) = Signals::new(wanted) {
            std::thread::spawn(move || {
                for signal in signals.forever().filter(|&signal| signal != SIGXFSZ) {
                    if signal == SIGHUP && heard.rendering.load(Ordering::Relaxed) {
                        heard.keep.store(true, Ordering::Relaxed);
                        continue;
                    }
                    let is_first = !heard.stop.swap(true, Ordering::Relaxed);
                    // Nothing is said here: whoever closed or stopped reading the error output must not keep the process alive.
                    if !(is_first && heard.rendering.load(Ordering::Relaxed)) {
                        exit_at_once(ExitStatus::Interrupted as i32);
                    }
                }
            });
        }
        state
    }

    /// Stops the render after this time, as the first request does.
    pub fn stop_after(self: &Arc<Self>, time: std::time::Duration) {
        let state = self.clone();
        std::thread::spawn(move || {
            std::thread::sleep(time);
            state.stop.store(true, Ordering::Relaxed);
        });
    }

    /// Whether from now on there is something to keep.
    pub fn rendering(&self, is_rendering: bool) {
        self.rendering.store(is_rendering, Ordering::Relaxed);
    }
}

/// Whether whoever started the process made it ignore this signal: `nohup` does so with SIGHUP, shells with SIGINT in the background.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
