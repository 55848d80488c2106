//! Deliberate faults, one at a time, to show that the checks would notice: cargo feature `faults`, for tests alone. Without it [`is`] is `false` at
//! compile time, and nothing of them is left in the program.
//!
//! With it the environment variable `LANTERNFISH_FAULT` names the one that is injected. `tests/faults.rs` lists which check catches which.

/// What may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

    use super::Fault;

    /// Their names in the environment.
    const NAMES: [(&str, Fault); 13] = [
        ("dropped-cosine", Fault::DroppedCosine),
        ("half-bsdf-pdf", Fault::HalfBsdfPdf),
        ("certain-light", Fault::CertainLight),
        ("single-precision-sums", Fault::SinglePrecisionSums),
        ("no-offset", Fault::NoOffset),
        ("free-roulette", Fault::FreeRoulette),
        ("colourless-null", Fault::ColourlessNull),
        ("no-density-limit", Fault::NoDensityLimit),
        ("mirrored-phase", Fault::MirroredPhase),
        ("low-majorant", Fault::LowMajorant),
        ("fire-twice", Fault::FireTwice),
        ("points-alone", Fault::PointsAlone),
        ("not-a-number", Fault::NotANumber),
    ];

    static CURRENT: OnceLock<Option<Fault>> = OnceLock::new();

    /// Whether this is the fault that is injected.
    #[inline]
    pub fn is(fault: Fault) -> bool {
        let current = CURRENT.get_or_init(|| {
            let name = std::env::var("LANTERNFISH_FAULT").ok()?;
            let found = NAMES.iter().find(|(known, _)| *known == name);
            // A test that asks for a fault that there is not would prove nothing.
            Some(found.unwrap_or_else(|| panic!("LANTERNFISH_FAULT={name} is none of {NAMES:?}")).1)
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
