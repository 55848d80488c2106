//! Deliberate faults, one at a time, to show that the checks would notice: cargo feature `faults`, for tests alone. Without it [`is`] is `false` at
//! compile time, and nothing of them is left in the program.
//!
//! With it the environment variable `LANTERNFISH_FAULT` names the one that is injected. `tests/faults.rs` lists which check catches which.

/// What may be wrong. In the environment each has its name in lower case with hyphens: `dropped-cosine`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "faults", derive(clap::ValueEnum))]
pub enum Fault {
    /// A dropped term: light samples at surfaces leave out the cosine.
    DroppedCosine,
    /// A wrong pdf: that of BSDF sampling counts half in multiple importance sampling at light samples.
    HalfBsdfPdf,
    /// A wrong pdf: light that a path meets by itself is weighed as if its light had been chosen for certain.
    CertainLight,
    /// Sums over the samples of a pixel are single precision.
    SinglePrecisionSums,
    /// Shadow rays and paths start at the surface itself, not moved off it by what rounding may be.
    NoOffset,
    /// Russian roulette does not make up for the paths that it ends.
    FreeRoulette,
    /// Null collisions leave the weights of channels as they are.
    ColourlessNull,
    /// A missing clamp: extinction is limited nowhere, however dense a medium is for the precision of positions.
    NoDensityLimit,
    /// A sign: the phase function that is evaluated scatters the other way.
    MirroredPhase,
    /// A bound that is none: three quarters of the largest extinction.
    LowMajorant,
    /// Fire that is a light is counted again where paths meet it.
    FireTwice,
    /// Scattering points that in-scatter sampling draws are not weighed against null tracking.
    PointsAlone,
    /// 0/0 instead of 0 where nothing arrives at a point seen at a grazing angle.
    NotANumber,
}

#[cfg(feature = "faults")]
mod injected {
    use std::sync::OnceLock;

    use clap::ValueEnum;

    use super::Fault;

    static CURRENT: OnceLock<Option<Fault>> = OnceLock::new();

    /// Whether this is the fault that is injected.
    #[inline]
    pub fn is(fault: Fault) -> bool {
        let current = CURRENT.get_or_init(|| {
            let name = std::env::var("LANTERNFISH_FAULT").ok()?;
            // A test that asks for a fault that there is not would prove nothing.
            let found = Fault::from_str(&name, false);
            Some(found.unwrap_or_else(|_| panic!("LANTERNFISH_FAULT={name} is none of {:?}", Fault::value_variants())))
        });
        *current == Some(fault)
    }
}

#[cfg(feature = "faults")]
pub use injected::is;

/// Whether this is the fault that is injected: none is.
#[cfg(not(feature = "faults"))]
#[inline(always)]
pub const fn is(_: Fault) -> bool {
    false
}
