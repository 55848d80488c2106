//! The stability suite: scenes that are extreme in one way each, with what must come of them. `lanternfish stability` runs it.
//!
//! A case has an exact answer, an invariant (two scenes that must give one image), or two independent methods that must agree, the second one in double
//! precision ([`mod@reference`]). Any NaN or infinity, in any case, is a failure, and so is not being done in time.
//!
//! Where sampling has a say, means are judged by the image's own variance: all comparisons of the suite together fail by chance with a probability of
//! [`case::FAMILY_RATE`] at most (seeds are fixed, so a run that passes goes on passing until something changes). What single precision may add
//! is stated with each comparison.

pub mod case;
mod convergence;
mod film;
mod geometry;
mod lights;
mod media;
mod range;
pub mod reference;
pub mod report;
pub mod run;
pub mod scene;

pub use case::Case;

/// All cases, group by group.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [media::CASES, lights::CASES, geometry::CASES, range::CASES, film::CASES, convergence::CASES].into_iter().flatten()
}
