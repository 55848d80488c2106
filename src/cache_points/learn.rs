//! Learning visibility: how often the light of each entry arrived, turned into weights between iterations.
//! Source: Li et al. 2024, section 3.2.
//!
//! **Ours:** the best probability of a light seen a share R of the time is proportional to its unoccluded contribution times √R, by the
//! second moment of what a try gives (the paper's threshold leaves all above 4 % alone). R is estimated from the point's own counts
//! and its neighbours' (weighted as in the blur), on top of a prior, so that few tries do not mislead. The prior of a light is what is known of
//! the clusters of the light hierarchy that it belongs to: after some tries at the lights of the next room, all of them are known to be
//! hidden.

use std::ops::Range;

use rayon::prelude::*;

use super::blur::{BlurWeights, for_each_overlap};
use super::hierarchy::{Cluster, Hierarchy};
use super::table::{Counter, List, Table, range, split_lists};

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
    /// W = √R, R of each entry for itself, with a prior and blurred.
    Root,
    /// W = √R, the prior of R being that of the clusters around.
    #[default]
    Clusters,
}

/// How many tries a prior counts as.
const PRIOR_TRIES: f32 = 1.0;
/// The prior where nothing is known.
const PRIOR: f32 = 0.5;

/// Attempts and successes as they count for one entry, neighbours included.
type Tally = [f32; 2];

impl VisibilityRule {
    /// W of an entry from its own counts.
    fn own(self, [attempts, successes]: Tally) -> f32 {
        let r = (successes + 1.0) / (attempts + 1.0);
        match self {
            Self::Off => 1.0,
            Self::Threshold if r <= R_MIN => (r / R_MIN).powi(2),
            Self::Threshold => 1.0,
            Self::Root | Self::Clusters => weight(posterior([attempts, successes], PRIOR)),
        }
    }
}

/// The least W of the √R rules: a light that nearly no place around sees may shine on just this one, and what is drawn too rarely there
/// comes as a firefly. In the scenes `house` and `rooms` (240 × 135 pixels, 16 spp, two seeds) 0.03 instead of 0 raised the RMSE of direct light
/// without the worst 1 % of pixels by 14 and 6 %, and lowered that of all pixels by 1 and 21 %, that of indirect light by 8 and 31 %.
const LEAST_WEIGHT: f32 = 0.03;

/// W = √R, but not below [`LEAST_WEIGHT`].
fn weight(r: f32) -> f32 {
    r.sqrt().max(LEAST_WEIGHT)
}

/// R after these counts where it was `prior` before.
fn posterior([attempts, successes]: Tally, prior: f32) -> f32 {
    ((successes + PRIOR_TRIES * prior) / (attempts + PRIOR_TRIES)).min(1.0)
}

/// R of each entry with its clusters as priors: from all lights down the hierarchy, what is known of a part goes on from what is known of
/// the whole.
struct Descent<'a> {
    hierarchy: &'a Hierarchy,
    list: List<'a>,
    /// Running sums of the entries' tallies, from 0 on.
    sums: Vec<[f64; 2]>,
    /// R of the entries so far.
    out: Vec<f32>,
}

impl<'a> Descent<'a> {
    fn new(hierarchy: &'a Hierarchy, list: List<'a>, tallies: &[Tally]) -> Self {
        let mut sums = Vec::with_capacity(tallies.len() + 1);
        sums.push([0.0; 2]);
        for (k, tally) in tallies.iter().enumerate() {
            sums.push([0, 1].map(|i| sums[k][i] + f64::from(tally[i])));
        }
        Self { hierarchy, list, sums, out: Vec::with_capacity(tallies.len()) }
    }

    /// R of every entry.
    fn all(mut self) -> Vec<f32> {
        let entries = 0..self.list.len();
        let r = self.posterior(&entries, PRIOR);
        for root in self.hierarchy.roots() {
            self.go_on(&entries, root, r);
        }
        self.out
    }

    fn posterior(&self, entries: &Range<usize>, prior: f32) -> f32 {
        posterior([0, 1].map(|i| (self.sums[entries.end][i] - self.sums[entries.start][i]) as f32), prior)
    }

    /// Those of `entries` that are in `cluster`, where R is expected to be that of all of `entries`, `r`.
    fn go_on(&mut self, entries: &Range<usize>, cluster: Cluster, r: f32) {
        let within = entries.start..entries.end;
        let part =
            within.start.max(self.list.from_place(cluster.first))..within.end.min(self.list.from_place(cluster.end()));
        if part.is_empty() {
            return;
        }
        // What all of them are in tells nothing new.
        let r = if part == within { r } else { self.posterior(&part, r) };
        if part.len() == 1 {
            self.out.push(r);
            return;
        }
        for child in self.hierarchy.children(&cluster) {
            self.go_on(&part, child, r);
        }
    }
}

/// The blurred weights of one point's entries.
fn weights(rule: VisibilityRule, hierarchy: &Hierarchy, blur: &BlurWeights, table: &Table, point: u32) -> Vec<f32> {
    let own = table.list(point);
    let counters = |point| &table.counters[range(&table.offsets, point)];
    // Sums over the point and its neighbours, of W or of what was tried.
    let own_of = |c: &Counter| match rule {
        VisibilityRule::Threshold => [1.0, rule.own(c.get())],
        _ => c.get(),
    };
    let mut sums: Vec<Tally> = counters(point).iter().map(own_of).collect();
    for &(neighbour, weight) in blur.of(point) {
        let theirs = counters(neighbour);
        for_each_overlap(own, table.list(neighbour), |(i, a), (j, b)| {
            // The paper's W is averaged over points that list the light.
            if rule == VisibilityRule::Threshold && !b.holds(&a) {
                return;
            }
            let more = own_of(&theirs[j]);
            sums[i] = [sums[i][0] + weight * more[0], sums[i][1] + weight * more[1]];
        });
    }
    match rule {
        VisibilityRule::Off => vec![1.0; own.len()],
        VisibilityRule::Threshold => sums.into_iter().map(|[weight, sum]| sum / weight).collect(),
        VisibilityRule::Root => sums.into_iter().map(|tally| weight(posterior(tally, PRIOR))).collect(),
        VisibilityRule::Clusters => Descent::new(hierarchy, own, &sums).all().into_iter().map(weight).collect(),
    }
}

/// Turns what was learned into the weights that the next iteration selects by.
pub fn update(rule: VisibilityRule, hierarchy: &Hierarchy, blur: &BlurWeights, table: &mut Table) {
    let mut visibility = std::mem::take(&mut table.visibility);
    split_lists(&mut visibility, &table.offsets, 1).into_par_iter().enumerate().for_each(|(point, out)| {
        out.copy_from_slice(&weights(rule, hierarchy, blur, table, point as u32));
    });
    table.visibility = visibility;
    table.counters.par_iter_mut().for_each(Counter::limit);
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::gather::Gathered;
    use super::*;
    use crate::light::{Lights, PointLight};
    use crate::math::Rgb;

    #[test]
    fn the_papers_rule() {
        let w = |attempts: f32, successes: f32| VisibilityRule::Threshold.own([attempts, successes]);
        assert_eq!(w(0.0, 0.0), 1.0);
        // R = 1 / 100.
        assert!((w(99.0, 0.0) - 0.0625).abs() < 1e-6);
        assert_eq!(w(99.0, 10.0), 1.0);
        assert!(w(1e9, 0.0) > 0.0);
    }

    #[test]
    fn the_root_rule_stays_above_zero() {
        assert_eq!(VisibilityRule::Root.own([0.0, 0.0]), 0.5f32.sqrt());
        assert!((VisibilityRule::Root.own([1e6, 2.5e5]) - 0.5).abs() < 1e-3);
        assert_eq!(VisibilityRule::Root.own([1e9, 0.0]), LEAST_WEIGHT);
    }

    #[test]
    fn what_is_known_of_a_cluster_is_expected_of_its_lights() {
        let mut lights = Lights::default();
        // Two clusters of eight.
        for i in 0..16 {
            let p = Vec3::X * (i + 1000 * (i / 8)) as f32;
            lights.add_point(PointLight { p, intensity: Rgb::WHITE });
        }
        let hierarchy = Hierarchy::new(&lights);
        let leaf = |place| hierarchy.leaf(place).expect("sixteen lights");
        let gathered = Gathered { clusters: (0..16).map(leaf).collect(), near: vec![] };
        let table = Table::gathered(1, Some(hierarchy.places()), |_| (gathered.clone(), vec![]));
        // One light of each is known: hidden here, visible there.
        let mut tallies = [[0.0; 2]; 16];
        (tallies[0], tallies[8]) = ([50.0, 0.0], [50.0, 50.0]);
        let r = Descent::new(&hierarchy, table.list(0), &tallies).all();
        assert_eq!(r.len(), 16);
        assert!(r[..8].iter().all(|&r| r < 0.05) && r[8..].iter().all(|&r| r > 0.95), "{r:?}");
        assert!(r[0] < r[1] && r[8] > r[9], "{r:?}");
    }
}
