//! Holding `--memory-limit` while a render goes on: a thread looks now and then at what the process has in memory. Where that is above the limit tiles of textures make
//! way; where it is by more than a tenth, twice in a row, the render stops as an interrupt stops it, and before rendering, when there is nothing to keep, the process ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use super::ExitStatus;
use super::interrupt::Interrupts;
use crate::material::Materials;
use crate::render::{ExhaustedMemory, RenderError};
use crate::system::memory;
use crate::system::output::exit_at_once;

/// From look to look while rendering, and before, when memory fills faster.
const PAUSE: Duration = Duration::from_millis(250);
const SHORT_PAUSE: Duration = Duration::from_millis(50);

/// Looks in a row that find too much, before something is done about it: memory that was given back may be counted for a moment.
const PATIENCE: u32 = 2;

/// What a render is at.
#[derive(Clone, Default)]
enum Phase {
    /// There is nothing to keep yet.
    #[default]
    Preparing,
    /// There is something to stop, and these are what holds textures.
    Rendering(Weak<Materials>),
    /// It is better to end this than to stop it.
    Writing,
}

/// What the thread and the render share.
#[derive(Default)]
pub struct MemoryGuard {
    phase: Mutex<Phase>,
    /// Whether the render was stopped for lack of memory, and what took it then.
    stopped: Mutex<Option<ExhaustedMemory>>,
    /// Nobody looks any more.
    over: AtomicBool,
}

impl MemoryGuard {
    /// Watches from now on, where there is a limit, until it is dropped. `fail` tells why the process ends, where it does.
    pub fn watch(interrupts: &Arc<Interrupts>, fail: impl Fn(&RenderError) + Send + 'static) -> Guarded {
        let guard = Arc::new(Self::default());
        if let Some(limit) = memory::limit() {
            let (guard, interrupts) = (guard.clone(), interrupts.clone());
            std::thread::spawn(move || guard.look(limit, &interrupts, &fail));
        }
        Guarded(guard)
    }

    fn phase(&self) -> Phase {
        self.phase.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn look(&self, limit: u64, interrupts: &Interrupts, fail: &dyn Fn(&RenderError)) {
        let mut too_many = 0;
        while !self.over.load(Ordering::Relaxed) {
            std::thread::sleep(if matches!(self.phase(), Phase::Preparing) { SHORT_PAUSE } else { PAUSE });
            let (resident, phase) = (memory::resident(), self.phase());
            if resident > limit
                && let Phase::Rendering(materials) = &phase
                && let Some(materials) = materials.upgrade()
            {
                materials.shed_images(resident - limit);
            }
            too_many = if resident > limit + limit / 10 { too_many + 1 } else { 0 };
            if too_many < PATIENCE {
                continue;
            }
            match phase {
                Phase::Rendering(_) => {
                    let mut stopped = self.stopped.lock().unwrap_or_else(PoisonError::into_inner);
                    stopped.get_or_insert_with(ExhaustedMemory::now);
                    interrupts.stop.store(true, Ordering::Relaxed);
                }
                Phase::Preparing if !self.over.load(Ordering::Relaxed) => {
                    fail(&ExhaustedMemory::now().into());
                    exit_at_once(ExitStatus::Limit as i32);
                }
                Phase::Preparing | Phase::Writing => {}
            }
        }
    }
}

/// A render that is watched.
pub struct Guarded(Arc<MemoryGuard>);

impl Guarded {
    /// Rendering begins: from now on there is something to keep. Textures may make way.
    pub fn rendering_begins(&self, materials: &Arc<Materials>) {
        self.enter(Phase::Rendering(Arc::downgrade(materials)));
    }

    /// It has ended, and what there is is written.
    pub fn writing_begins(&self) {
        self.enter(Phase::Writing);
    }

    fn enter(&self, phase: Phase) {
        *self.0.phase.lock().unwrap_or_else(PoisonError::into_inner) = phase;
    }

    /// The next frame is made ready: there is nothing to keep.
    pub fn preparing_begins(&self) {
        self.enter(Phase::Preparing);
    }

    /// Why the render was stopped, if it was for lack of memory.
    pub fn stopped(&self) -> Option<ExhaustedMemory> {
        self.0.stopped.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        self.0.over.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    /// Whether a render in that phase is stopped within a few looks, and says why.
    fn is_stopped(phase: Phase, limit: u64) -> bool {
        let (guard, interrupts) = (Arc::new(MemoryGuard::default()), Arc::new(Interrupts::default()));
        let guarded = Guarded(guard.clone());
        guarded.enter(phase);
        let looking = {
            let interrupts = interrupts.clone();
            std::thread::spawn(move || guard.look(limit, &interrupts, &|error| panic!("{error}")))
        };
        let (start, few) = (Instant::now(), PAUSE * (PATIENCE + 4));
        while start.elapsed() < few && !interrupts.stop.load(Ordering::Relaxed) {
            std::thread::sleep(SHORT_PAUSE);
        }
        let told = guarded.stopped().map(|reason| reason.to_string());
        drop(guarded);
        looking.join().expect("it looks no more");
        let stopped = interrupts.stop.load(Ordering::Relaxed);
        assert_eq!(told.is_some_and(|told| told.contains("out of memory")), stopped);
        stopped
    }

    #[test]
    fn a_render_that_takes_too_much_is_stopped() {
        let rendering = || Phase::Rendering(Weak::new());
        assert!(is_stopped(rendering(), memory::resident() / 2));
        assert!(!is_stopped(rendering(), u64::MAX / 2));
        // What there is is being written: that goes on.
        assert!(!is_stopped(Phase::Writing, memory::resident() / 2));
    }
}
