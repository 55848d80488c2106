//! Media that are the same everywhere.

use super::MediumPoint;

/// A homogeneous medium.
#[derive(Debug)]
pub struct HomogeneousMedium {
    /// Its coefficients.
    pub point: MediumPoint,
    /// Mean cosine of the Henyey-Greenstein phase function.
    pub g: f32,
}
