//! Ctrl-C and requests to terminate. Before rendering there is nothing to keep: the process ends at once. While it renders, the
//! first request stops it, so that the image so far is written, and a second one ends the process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

use super::ExitStatus;
use crate::system::output::exit_at_once;

/// What has been asked for, and whether there is anything to keep.
#[derive(Default)]
pub struct Interrupts {
    /// Set by the first request while rendering.
    pub stop: AtomicBool,
    rendering: AtomicBool,
}

impl Interrupts {
    /// Listens from now on. A limit on the size of files becomes an error of the write that meets it, instead of the end of the process.
    pub fn listen() -> Arc<Self> {
        let state = Arc::new(Self::default());
        let heard = state.clone();
        // Where no handler can be installed, the default one ends the process: nothing is half-written.
        if let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGXFSZ]) {
            std::thread::spawn(move || {
                for _ in signals.forever().filter(|&signal| signal != SIGXFSZ) {
                    let is_first = !heard.stop.swap(true, Ordering::Relaxed);
                    if !(is_first && heard.rendering.load(Ordering::Relaxed)) {
                        eprintln!("interrupted");
                        exit_at_once(ExitStatus::Interrupted as i32);
                    }
                }
            });
        }
        state
    }

    /// From now on there is something to keep.
    pub fn rendering_begins(&self) {
        self.rendering.store(true, Ordering::Relaxed);
    }
}
