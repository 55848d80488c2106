//! Cache points with all that they have learned, to be kept in a file and taken up by another render of the scene: it need not make points of its own.

use glam::Vec3;

use super::blur::BlurWeights;
use super::hierarchy::Hierarchy;
use super::table::Table;
use super::{CachePoints, CacheSettings, CacheStatistics, Clock};
use crate::light::Lights;

/// What they are made of, as it is read.
#[derive(Debug, serde::Deserialize)]
pub struct KeptPoints {
    pub(super) positions: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
    pub(super) table: Table,
    pub(super) iterations: u32,
}

/// The same, where it is.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct KeptPointsRef<'a> {
    positions: &'a [Vec3],
    radii: &'a [f32],
    table: &'a Table,
    iterations: u32,
}

impl KeptPoints {
    /// Whether all of it belongs together, and to these lights.
    fn fits(&self, hierarchy: &Hierarchy) -> bool {
        let Self { positions, radii, table, .. } = self;
        let is_finite = positions.iter().all(|p| p.is_finite()) && radii.iter().all(|r| r.is_finite() && *r >= 0.0);
        !positions.is_empty() && positions.len() == radii.len() && is_finite && table.is_of(positions.len(), hierarchy)
    }
}

impl CachePoints {
    /// All that another render needs.
    pub fn kept(&self) -> KeptPointsRef<'_> {
        let Self { positions, radii, table, iterations, .. } = self;
        KeptPointsRef { positions, radii, table, iterations: *iterations }
    }

    /// The points of another render, for the same lights; `None` where they are not.
    pub fn from_kept(lights: &Lights, kept: KeptPoints, settings: CacheSettings) -> Option<Self> {
        let mut clock = Clock::start();
        let mut statistics = CacheStatistics { points: kept.positions.len(), are_loaded: true, ..Default::default() };
        let hierarchy = Hierarchy::new(lights, settings.alike);
        statistics.seconds.hierarchy = clock.lap();
        if !kept.fits(&hierarchy) {
            return None;
        }
        let blur = BlurWeights::new(&kept.positions);
        statistics.seconds.blur = clock.lap();
        Some(Self::assembled(lights, settings, hierarchy, blur, kept, statistics))
    }
}
