//! Learning visibility: how often the light of each entry arrived, turned into weights between iterations.
//! Source: Li et al. 2024, section 3.2.
//!
//! **Ours:** the best probability of a light seen a share R of the time is proportional to its unoccluded contribution times √R, by the
//! second moment of what a try gives (the paper's threshold leaves all above 4 % alone). R is estimated from the point's own counts
//! and its neighbours' (weighted as in the blur), on top of a prior, so that few tries do not mislead.

use rayon::prelude::*;

use super::blur::{BlurWeights, for_each_overlap};
use super::hierarchy::Cluster;
use super::table::{BINS, Counter, FarLights, NearLights, range};

/// R above this is left alone by the paper's rule.
const R_MIN: f32 = 0.04;

/// How counts become weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum VisibilityRule {
    /// Not at all: W = 1.
    Off,
    /// The paper's: W = (R / 0.04)² below R = 4 %, else 1, blurred.
    Threshold,
    /// W = √R, R with a prior and blurred.
    #[default]
    Root,
}

/// The prior of R for [`VisibilityRule::Root`]: as if so many tries had been made, with these successes.
const PRIOR: [f32; 2] = [1.0, 0.5];

/// Attempts and successes as they count for one entry, neighbours included.
type Tally = [f32; 2];

impl VisibilityRule {
    /// W of an entry from its own counts.
    fn own(self, [attempts, successes]: [u32; 2]) -> f32 {
        let r = (successes as f32 + 1.0) / (attempts as f32 + 1.0);
        match self {
            Self::Off => 1.0,
            Self::Threshold if r <= R_MIN => (r / R_MIN).powi(2),
            Self::Threshold => 1.0,
            Self::Root => root([attempts as f32, successes as f32]),
        }
    }
}

fn root([attempts, successes]: Tally) -> f32 {
    ((successes + PRIOR[1]) / (attempts + PRIOR[0])).sqrt().min(1.0)
}

/// The blurred weights of one list of entries; `entries` gives the clusters and counters of any point's list.
fn weights<'a>(
    rule: VisibilityRule,
    point: u32,
    blur: &BlurWeights,
    entries: &impl Fn(u32) -> (&'a [Cluster], &'a [Counter]),
) -> Vec<f32> {
    let (own, counters) = entries(point);
    match rule {
        VisibilityRule::Off => vec![1.0; own.len()],
        VisibilityRule::Threshold => {
            let mut sums: Vec<[f32; 2]> = counters.iter().map(|c| [rule.own(c.get()), 1.0]).collect();
            for &(neighbour, weight) in blur.of(point) {
                let (other, counters) = entries(neighbour);
                for_each_overlap(own, other, |i, j| {
                    if other[j].holds(&own[i]) {
                        sums[i][0] += weight * rule.own(counters[j].get());
                        sums[i][1] += weight;
                    }
                });
            }
            sums.into_iter().map(|[sum, weight]| sum / weight).collect()
        }
        VisibilityRule::Root => {
            let counts = |c: &Counter| c.get().map(|n| n as f32);
            let mut tallies: Vec<Tally> = counters.iter().map(counts).collect();
            for &(neighbour, weight) in blur.of(point) {
                let (other, counters) = entries(neighbour);
                for_each_overlap(own, other, |i, j| {
                    if other[j].holds(&own[i]) {
                        let more = counts(&counters[j]);
                        tallies[i] = [tallies[i][0] + weight * more[0], tallies[i][1] + weight * more[1]];
                    }
                });
            }
            tallies.into_iter().map(root).collect()
        }
    }
}

/// Turns what was learned into the weights that the next iteration selects by.
pub fn update(rule: VisibilityRule, blur: &BlurWeights, near: &mut NearLights, far: &mut FarLights) {
    let points = (far.offsets.len() - 1) as u32;
    near.visibility = (0..points)
        .into_par_iter()
        .flat_map_iter(|point| {
            weights(rule, point, blur, &|p| {
                let list = range(&near.offsets, p);
                (&near.clusters[list.clone()], &near.counters[list])
            })
        })
        .collect();
    let sums: Vec<f32> = (0..points)
        .into_par_iter()
        .flat_map_iter(|point| {
            let entries = |p| {
                let list = range(&far.offsets, p);
                (&far.clusters[list.clone()], &far.counters[list])
            };
            running_sums(&far.energy[range(&far.offsets, point)], &weights(rule, point, blur, &entries))
        })
        .collect();
    far.sums = sums;
}

/// The running sums of energy × W, sensor by sensor.
pub fn running_sums(energy: &[[f32; BINS]], visibility: &[f32]) -> Vec<f32> {
    let mut sums = Vec::with_capacity(BINS * energy.len());
    for bin in 0..BINS {
        let mut sum = 0.0f64;
        sums.extend(energy.iter().zip(visibility).map(|(energy, w)| {
            sum += f64::from(energy[bin] * w);
            sum as f32
        }));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_rule() {
        let w = |attempts, successes| VisibilityRule::Threshold.own([attempts, successes]);
        assert_eq!(w(0, 0), 1.0);
        // R = 1 / 100.
        assert!((w(99, 0) - 0.0625).abs() < 1e-6);
        assert_eq!(w(99, 10), 1.0);
        assert!(w(u32::MAX, 0) > 0.0);
    }

    #[test]
    fn the_root_rule_never_reaches_zero() {
        assert!((root([0.0, 0.0]) - 0.5f32.sqrt()).abs() < 1e-6);
        assert!((root([1e6, 25e4]) - 0.5).abs() < 1e-3);
        let hidden = root([u32::MAX as f32, 0.0]);
        assert!(hidden > 0.0 && hidden < 1e-4, "{hidden}");
    }
}
