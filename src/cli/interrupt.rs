//! Ctrl-C and requests to terminate. Before rendering there is nothing to keep: the process ends at once. While it renders, the
//! first request stops it, so that the image so far is written, and a second one ends the process.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    /// Listens from now on.
    pub fn listen() -> Arc<Self> {
        let state = Arc::new(Self::default());
        let heard = state.clone();
        // Where no handler can be installed (there is one already), the default one ends the process: nothing is half-written.
        let _ = ctrlc::set_handler(move || {
            let is_first = !heard.stop.swap(true, Ordering::Relaxed);
            if !(is_first && heard.rendering.load(Ordering::Relaxed)) {
                eprintln!("interrupted");
                exit_at_once(ExitStatus::Interrupted as i32);
            }
        });
        state
    }

    /// From now on there is something to keep.
    pub fn rendering_begins(&self) {
        self.rendering.store(true, Ordering::Relaxed);
    }
}
