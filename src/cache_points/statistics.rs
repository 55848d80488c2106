//! What building the points came to.

use serde::Serialize;

use super::table::{BINS, PLANES, Table};

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
    /// Whether they are those of another render.
    pub are_loaded: bool,
    /// Near lights and clusters a point, on average.
    pub near_lights: f64,
    /// Far lights and clusters a point, on average.
    pub far_lights: f64,
    /// Those that each sensor receives something of (+x, −x, +y, −y, +z, −z, all around), on average.
    pub lights_per_bin: [f64; BINS],
    /// Shadow rays of the rehearsal.
    pub rehearsal_rays: u64,
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
    /// What media at the points scatter.
    pub scatter: f64,
    /// Learning before the first pass.
    pub rehearsal: f64,
}

impl BuildSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        let Self { seed, hierarchy, prune, signatures, merge, gather, blur, lookup, scatter, rehearsal } = *self;
        seed + hierarchy + prune + signatures + merge + gather + blur + lookup + scatter + rehearsal
    }
}

impl CacheStatistics {
    pub(super) fn describe(&mut self, table: &Table) {
        let points = self.points.max(1) as f64;
        let near: usize = (0..self.points).map(|point| table.near(point as u32).len()).sum();
        self.near_lights = near as f64 / points;
        self.far_lights = table.visibility.len() as f64 / points - self.near_lights;
        let mut counts = [0; BINS];
        for point in 0..self.points {
            let (fluence, shares) = table.energies(point as u32);
            let rows = (0..PLANES).map(|row| &shares[row * fluence.len()..(row + 1) * fluence.len()]);
            rows.zip(&mut counts).for_each(|(row, count)| *count += row.iter().filter(|&&share| share > 0).count());
            counts[PLANES] += fluence.iter().filter(|&&energy| energy > 0.0).count();
        }
        self.lights_per_bin = counts.map(|count| count as f64 / points);
    }
}
