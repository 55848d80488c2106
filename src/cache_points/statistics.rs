//! What building the points came to.

use serde::Serialize;

use super::entries_per_bin;
use super::table::{BINS, FarLights, NearLights};

/// Points at each stage, seconds of each step, bytes, lists.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CacheStatistics {
    /// Candidates scattered in boxes.
    pub in_boxes: usize,
    /// Candidates from pilot paths.
    pub pilots: usize,
    /// Candidates along beams.
    pub in_beams: usize,
    /// Candidates removed because they coincided with others.
    pub coincident: usize,
    /// Points left after merging.
    pub points: usize,
    /// Near lights a point, on average.
    pub near_lights: f64,
    /// Far lights and clusters a point, on average.
    pub far_lights: f64,
    /// Those that each sensor receives something of (+x, −x, +y, −y, +z, −z, all around), on average.
    pub lights_per_bin: [f64; BINS],
    /// Bytes of everything that is kept.
    pub bytes: usize,
    /// Wall-clock seconds of each step.
    pub seconds: BuildSeconds,
}

/// Wall-clock seconds of each step.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct BuildSeconds {
    /// Boxes, pilot paths, beams.
    pub seed: f64,
    /// The light hierarchy.
    pub hierarchy: f64,
    /// Sorting and pruning.
    pub prune: f64,
    /// What lights candidates see.
    pub signatures: f64,
    /// Merging.
    pub merge: f64,
    /// Near and far lights of the points.
    pub gather: f64,
    /// Blurring them.
    pub blur: f64,
    /// The structure for look-ups.
    pub lookup: f64,
}

impl BuildSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        let Self { seed, hierarchy, prune, signatures, merge, gather, blur, lookup } = *self;
        seed + hierarchy + prune + signatures + merge + gather + blur + lookup
    }
}

impl CacheStatistics {
    pub(super) fn describe(&mut self, near: &NearLights, far: &FarLights) {
        let points = self.points.max(1) as f64;
        self.near_lights = near.clusters.len() as f64 / points;
        self.far_lights = far.clusters.len() as f64 / points;
        self.lights_per_bin = entries_per_bin(far);
    }
}
