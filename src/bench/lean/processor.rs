//! One processor for all that is compared.

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// While this is there, the thread that made it, and processes that it starts, use one processor alone.
pub struct Processor {
    before: Option<CpuSet>,
}

impl Processor {
    /// The last of those that the thread may use. Where the system does not allow it, nothing changes: what is measured is less certain then.
    pub fn alone() -> Self {
        let Ok(before) = sched_getaffinity(None) else { return Self { before: None } };
        let mut one = CpuSet::new();
        if let Some(last) = (0..CpuSet::MAX_CPU).rev().find(|&cpu| before.is_set(cpu)) {
            one.set(last);
        }
        Self { before: sched_setaffinity(None, &one).is_ok().then_some(before) }
    }
}

impl Drop for Processor {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            // That it worked once is reason enough to expect it to work again; if not, later renders are slower.
            let _ = sched_setaffinity(None, before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_used_for_a_while() {
        let count = || sched_getaffinity(None).map_or(0, |set| set.count());
        let before = count();
        let alone = Processor::alone();
        assert_eq!(count(), 1);
        drop(alone);
        assert_eq!(count(), before);
    }
}
