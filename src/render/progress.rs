//! How a render tells how far it is, without knowing who listens.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::settings::Budget;

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressState {
    /// Share of the work done, 0..=1: of samples, time, or an estimate of it where the goal is an error.
    pub fraction: f64,
    /// Samples per pixel so far, averaged over the image.
    pub samples_per_pixel: f64,
    /// The current error estimate, where there is one.
    pub error: Option<f64>,
}

/// Listens to a render. Threads may call [`Progress::update`] at once and often.
pub trait Progress: Send + Sync {
    /// What is rendered from now on is frame `index` (from 0) of `count`, each of which starts and finishes. Where nobody says so there is one.
    fn frame(&self, _index: usize, _count: usize) {}
    /// Rendering begins; `total_samples` over all pixels, where known.
    fn start(&self, total_samples: Option<u64>);
    /// It is this far.
    fn update(&self, state: &ProgressState);
    /// Rendering has ended, finished or interrupted.
    fn finish(&self);
}

/// Listens to nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _total_samples: Option<u64>) {}
    fn update(&self, _state: &ProgressState) {}
    fn finish(&self) {}
}

/// Turns the events of a render into [`ProgressState`]s.
pub(super) struct Tracking<'a> {
    listener: &'a dyn Progress,
    budget: Budget,
    limit: u32,
    pixels: u64,
    start: Instant,
    samples: AtomicU64,
    /// Bits of the last error estimate; NaN for none.
    error: AtomicU64,
    /// Nanoseconds to the first finished tile; 0 before.
    first_tile: AtomicU64,
}

impl<'a> Tracking<'a> {
    pub(super) fn new(budget: Budget, limit: u32, pixels: u64, start: Instant, listener: &'a dyn Progress) -> Self {
        let (samples, first_tile) = (AtomicU64::new(0), AtomicU64::new(0));
        Self { listener, budget, limit, pixels, start, samples, error: AtomicU64::new(f64::NAN.to_bits()), first_tile }
    }

    /// Samples in all, where that is known beforehand.
    pub(super) fn total(&self) -> Option<u64> {
        matches!(self.budget, Budget::Scene | Budget::Samples(_)).then(|| u64::from(self.limit) * self.pixels)
    }

    /// So many samples were taken by an earlier process.
    pub(super) fn tiles_ended(&self, samples: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
    }

    /// Samples so far, over all pixels.
    #[inline]
    pub(super) fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// A tile with so many samples is done.
    pub(super) fn tile_ended(&self, samples: u64) {
        let samples = self.samples.fetch_add(samples, Ordering::Relaxed) + samples;
        let elapsed = self.start.elapsed();
        let nanoseconds = (elapsed.as_nanos() as u64).max(1);
        let _ = self.first_tile.compare_exchange(0, nanoseconds, Ordering::Relaxed, Ordering::Relaxed);
        let error = Some(f64::from_bits(self.error.load(Ordering::Relaxed))).filter(|error| !error.is_nan());
        let fraction = match (self.budget, error) {
            (Budget::Time(budget), _) => elapsed.as_secs_f64() / budget.as_secs_f64(),
            // The error falls with the square root of the samples.
            (Budget::Error(target), Some(error)) => (target / error).powi(2),
            (Budget::Error(_), None) => 0.0,
            _ => samples as f64 / (f64::from(self.limit) * self.pixels as f64),
        };
        let samples_per_pixel = samples as f64 / self.pixels as f64;
        self.listener.update(&ProgressState { fraction: fraction.min(1.0), samples_per_pixel, error });
    }

    /// A pass has ended.
    pub(super) fn pass_ended(&self, error: Option<f64>) {
        self.error.store(error.unwrap_or(f64::NAN).to_bits(), Ordering::Relaxed);
    }

    /// Seconds to the first finished tile.
    pub(super) fn first_tile(&self) -> f64 {
        self.first_tile.load(Ordering::Relaxed) as f64 * 1e-9
    }
}
