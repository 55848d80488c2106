//! Media: what fills space between surfaces. Grids, majorants, phase functions, trackers.

pub mod build;
pub mod emission_points;
pub mod grid;
pub mod homogeneous;
pub mod measured;
pub mod regions;
pub mod resolution;
pub mod tracker;
pub(crate) mod walk;

use std::sync::Arc;

use glam::Vec3;

use crate::math::Rgb;

/// A medium, by its place in [`crate::integrator::World::media`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MediumId(pub u32);

/// The local optical properties of a medium, per unit length of render space.
#[derive(Clone, Copy, Debug, Default)]
pub struct MediumPoint {
    /// Absorption coefficient μ_a.
    pub absorption: Rgb,
    /// Scattering coefficient μ_s.
    pub scattering: Rgb,
    /// Emission μ_a L_e, or the emission that is given directly per unit length.
    pub emission: Rgb,
}

/// A stretch of a ray over which the majorant is constant.
#[derive(Clone, Copy, Debug)]
pub struct MajorantSegment {
    /// Where the stretch ends; it begins where the one before ended.
    pub t_end: f32,
    /// An upper bound of μ_t over the stretch, in every channel; 0 where there is nothing.
    pub majorant: f32,
}

/// A medium.
#[derive(Debug)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(homogeneous::HomogeneousMedium),
    /// Given by grids.
    Grid(Box<grid::GridMedium>),
}

/// The stretches of constant majorant along a ray, in order and without gaps: the first begins at the ray's `t_min`, the
/// last ends at its `t_max`.
#[derive(Debug)]
pub enum MajorantIter<'a> {
    /// One stretch.
    Homogeneous(Option<MajorantSegment>),
    /// Cell by cell.
    Grid(grid::dda::GridMajorants<'a>),
}

impl Iterator for MajorantIter<'_> {
    type Item = MajorantSegment;

    #[inline]
    fn next(&mut self) -> Option<MajorantSegment> {
        match self {
            Self::Homogeneous(segment) => segment.take(),
            Self::Grid(walk) => walk.next(),
        }
    }
}

impl Medium {
    /// The coefficients at `p` of render space, at a time between 0 and 1.
    #[inline]
    pub fn point(&self, p: Vec3, time: f32) -> MediumPoint {
        match self {
            Self::Homogeneous(medium) => medium.point,
            Self::Grid(medium) => medium.point(p, time),
        }
    }

    /// As [`Medium::point`], without the emission.
    #[inline]
    pub fn coefficients(&self, p: Vec3, time: f32) -> MediumPoint {
        match self {
            Self::Homogeneous(medium) => medium.point,
            Self::Grid(medium) => medium.dark_point(p, time),
        }
    }

    /// μ_t at `p` of render space, at a time between 0 and 1.
    #[inline]
    pub fn extinction(&self, p: Vec3, time: f32) -> Rgb {
        match self {
            Self::Homogeneous(medium) => medium.point.absorption + medium.point.scattering,
            Self::Grid(medium) => medium.extinction(p, time),
        }
    }

    /// Mean cosine of the Henyey-Greenstein phase function.
    #[inline]
    pub fn g(&self) -> f32 {
        match self {
            Self::Homogeneous(medium) => medium.g,
            Self::Grid(medium) => medium.g(),
        }
    }

    /// Upper bounds of μ_t (in every channel), as [`resolution`] limits it where each stretch begins, along the ray `origin + t·direction`,
    /// `t_min ≤ t ≤ t_max`, of render space; `direction` has length 1. Nothing if `t_max ≤ t_min`. They hold for points computed in single
    /// precision.
    #[inline]
    pub fn majorants(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> MajorantIter<'_> {
        match self {
            Self::Homogeneous(medium) => {
                let majorant = medium.majorant(origin + direction * t_min);
                let segment = MajorantSegment { t_end: t_max, majorant };
                MajorantIter::Homogeneous((t_max > t_min).then_some(segment))
            }
            Self::Grid(medium) => medium.majorants(origin, direction, t_min, t_max),
        }
    }

    /// How densely emission is gathered along a ray, in stretches as [`Medium::majorants`] has them; `None` for media that do not glow, and for
    /// homogeneous ones, whose glow is integrated.
    #[inline]
    pub fn gathering_rates(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<MajorantIter<'_>> {
        match self {
            Self::Homogeneous(_) => None,
            Self::Grid(medium) => medium.gathering_rates(origin, direction, t_min, t_max),
        }
    }

    /// Whether it scatters light anywhere.
    pub fn scatters(&self) -> bool {
        match self {
            Self::Homogeneous(medium) => !medium.point.scattering.is_black(),
            Self::Grid(medium) => medium.scatters(),
        }
    }

    /// Whether it emits light.
    pub fn is_emissive(&self) -> bool {
        match self {
            Self::Homogeneous(medium) => !medium.point.emission.is_black(),
            Self::Grid(medium) => medium.is_emissive(),
        }
    }

    /// Where it emits, if that is known: of media given by grids.
    pub fn energy(&self) -> Option<&Arc<grid::energy::EnergyGrid>> {
        match self {
            Self::Homogeneous(_) => None,
            Self::Grid(medium) => medium.energy(),
        }
    }

    /// A box of render space outside which the medium is nothing; `None` if it is something everywhere.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        match self {
            Self::Homogeneous(_) => None,
            Self::Grid(medium) => medium.bounds(),
        }
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        match self {
            Self::Homogeneous(_) => size_of::<Self>(),
            Self::Grid(medium) => size_of::<Self>() + medium.memory(),
        }
    }

    /// One line for people: what it is, how large, how dense.
    pub fn summary(&self) -> String {
        match self {
            Self::Homogeneous(medium) => {
                let [r, g, b] = (medium.point.absorption + medium.point.scattering).to_array();
                format!("homogeneous, extinction {r:.4} {g:.4} {b:.4}")
            }
            Self::Grid(medium) => medium.summary(),
        }
    }
}
