//! What memory went into, for the message that ends a process which has no more. Steps of the work follow each other; what the process's resident memory
//! grows by in each of them is counted as that step's. It is measured only where there is a limit ([`super::memory::set_limit`]): otherwise nothing is done here.

use std::sync::{Mutex, PoisonError};

use bytesize::ByteSize;

use super::memory::{limit, resident};

static STEPS: Mutex<Steps> = Mutex::new(Steps { ended: vec![], current: None });

struct Steps {
    ended: Vec<(&'static str, u64)>,
    /// The step that goes on, and the resident memory when it began.
    current: Option<(&'static str, u64)>,
}

/// A step begins: what the process grows by from now on goes to it. The one before has ended.
pub fn begin(what: &'static str) {
    if limit().is_some() {
        let now = if is_first() { 0 } else { resident() };
        let mut steps = STEPS.lock().unwrap_or_else(PoisonError::into_inner);
        steps.end(now);
        steps.current = Some((what, now));
    }
}

fn is_first() -> bool {
    STEPS.lock().unwrap_or_else(PoisonError::into_inner).current.is_none()
}

/// The steps that took most, three at most, the largest first: `geometry 310.0 MiB, lights 12.5 MiB`.
pub fn largest() -> String {
    let steps = STEPS.lock().unwrap_or_else(PoisonError::into_inner);
    steps.largest(resident())
}

impl Steps {
    fn end(&mut self, now: u64) {
        if let Some((what, before)) = self.current.take() {
            let bytes = now.saturating_sub(before);
            match self.ended.iter_mut().find(|(known, _)| *known == what) {
                Some((_, sum)) => *sum += bytes,
                None => self.ended.push((what, bytes)),
            }
        }
    }

    fn largest(&self, now: u64) -> String {
        let mut all = Self { ended: self.ended.clone(), current: self.current };
        all.end(now);
        all.ended.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
        let told = all.ended.iter().filter(|(_, bytes)| *bytes > 0).take(3);
        told.map(|(what, bytes)| format!("{what} {}", ByteSize(*bytes))).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_goes_to_the_step_that_it_happens_in() {
        let mut steps = Steps { ended: vec![], current: Some(("the program itself", 0)) };
        for (what, now) in [("geometry", 10 << 20), ("lights", 50 << 20), ("film", 40 << 20), ("lights", 41 << 20)] {
            steps.end(now);
            steps.current = Some((what, now));
        }
        assert_eq!(steps.largest(71 << 20), "geometry 40.0 MiB, lights 30.0 MiB, the program itself 10.0 MiB");
        assert_eq!(Steps { ended: vec![], current: None }.largest(1), "");
    }
}
