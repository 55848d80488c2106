//! Learning visibility: how often the light of each entry arrived, turned into weights between iterations.
//! Source: Li et al. 2024, section 3.2.
//!
//! **Ours:** the best probability of a light seen a share R of the time is proportional to its unoccluded contribution times √R, by the
//! second moment of what a try gives (the paper's threshold leaves all above 4 % alone). R is estimated from the point's own counts
//! and its neighbours' (weighted as in the blur), on top of a prior, so that few tries do not mislead. The prior of a light is what is known of
//! the clusters of the light hierarchy that it belongs to: after some tries at the lights of the next room, all of them are known to be
//! hidden. How much such a prior counts is learned as well ([`prior_tries`]).

use std::ops::Range;

use rayon::prelude::*;

use super::blur::{BlurWeights, for_each_overlap};
use super::counter::Counter;
use super::hierarchy::{Cluster, Hierarchy};
use super::table::{List, Table, range, split_lists};

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
    /// W = √R, the prior of R being that of the clusters around; how much it counts is learned.
    #[default]
    Clusters,
}

/// How many tries a prior counts as where entries are judged each for itself.
const PRIOR_TRIES: f32 = 1.0;
/// How many tries the prior that a cluster is may count as: [`prior_tries`] chooses. At 160 × 90 pixels and 32 spp, without lists made anew, 16
/// instead of 1 took the mean squared error to 0.80 times as much in the scene `foliage` (four seeds), but to 1.08 in `house` and 1.23
/// in `rooms` (two seeds). 4 as a third choice was taken at times in `foliage`, for 1.03 times the error; 64 made it 0.98 there and 1.05 in `pier`.
const CLUSTER_TRIES: [f32; 2] = [1.0, 16.0];
/// It asks about this many points, so that asking costs little beside learning.
const ASKED: u32 = 256;
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
            Self::Root | Self::Clusters => weight(posterior([attempts, successes], PRIOR, PRIOR_TRIES)),
        }
    }
}

/// The least W of the √R rules: a light that nearly no place around sees may shine on just this one, and what is drawn too rarely there
/// comes as a firefly. In the scenes `house` and `rooms` (240 × 135 pixels, 16 spp, two seeds) 0.03 instead of 0 raised the RMSE of direct light
/// without the worst 1 % of pixels by 14 and 6 %, and lowered that of all pixels by 1 and 21 %, that of indirect light by 8 and 31 %.
const LEAST_WEIGHT: f32 = 0.03;

/// What happens at a point was not foretold to be less likely than this: other places may differ by any factor.
const LEAST_CHANCE: f32 = 1e-4;

/// W = √R, but not below [`LEAST_WEIGHT`].
fn weight(r: f32) -> f32 {
    r.sqrt().max(LEAST_WEIGHT)
}

/// R after these counts where it was `prior` before, which counts as `tries`.
fn posterior([attempts, successes]: Tally, prior: f32, tries: f32) -> f32 {
    ((successes + tries * prior) / (attempts + tries)).min(1.0)
}

/// R of each entry with its clusters as priors: from all lights down the hierarchy, what is known of a part goes on from what is known of
/// the whole.
struct Descent<'a> {
    hierarchy: &'a Hierarchy,
    list: List<'a>,
    /// Running sums of the entries' tallies, from 0 on.
    sums: Vec<[f64; 2]>,
    /// How many tries a prior counts as.
    tries: f32,
    /// R of the entries so far.
    out: Vec<f32>,
}

impl<'a> Descent<'a> {
    fn new(hierarchy: &'a Hierarchy, list: List<'a>, tallies: &[Tally], tries: f32) -> Self {
        let mut sums = Vec::with_capacity(tallies.len() + 1);
        sums.push([0.0; 2]);
        for (k, tally) in tallies.iter().enumerate() {
            sums.push([0, 1].map(|i| sums[k][i] + f64::from(tally[i])));
        }
        Self { hierarchy, list, sums, tries, out: Vec::with_capacity(tallies.len()) }
    }

    /// R of every entry.
    fn all(mut self) -> Vec<f32> {
        let entries = 0..self.list.len();
        let r = self.posterior(&entries, PRIOR);
        self.share_out(&entries, self.hierarchy.roots(), r);
        self.out
    }

    fn tally(&self, entries: &Range<usize>) -> Tally {
        [0, 1].map(|i| (self.sums[entries.end][i] - self.sums[entries.start][i]) as f32)
    }

    fn posterior(&self, entries: &Range<usize>, prior: f32) -> f32 {
        posterior(self.tally(entries), prior, self.tries)
    }

    /// `entries`, all of which are in one of `clusters`, which are in order. R is expected to be that of all of them, `r`.
    fn share_out(&mut self, entries: &Range<usize>, clusters: impl IntoIterator<Item = Cluster>, r: f32) {
        let mut start = entries.start;
        for cluster in clusters {
            let end = self.list.from_place_within(start..entries.end, cluster.end());
            let part = start..end;
            // What all of them are in tells nothing new.
            let r = if part == *entries { r } else { self.posterior(&part, r) };
            self.go_on(&part, &cluster, r);
            start = end;
        }
    }

    /// `entries`, those in `cluster`, whose R is `r` all together.
    fn go_on(&mut self, entries: &Range<usize>, cluster: &Cluster, r: f32) {
        // Where nothing was ever tried there is nothing to tell either: this is most of it.
        if entries.len() <= 1 || self.tally(entries)[0] == 0.0 {
            self.out.extend(entries.clone().map(|_| r));
        } else {
            self.share_out(entries, self.hierarchy.children(cluster), r);
        }
    }
}

/// What the neighbours of `point` know of its entries. What one of them knows of a cluster goes to the parts that the point itself tells apart
/// in equal shares: together they were tried no more often.
fn around(blur: &BlurWeights, table: &Table, point: u32) -> Vec<Tally> {
    let own = table.list(point);
    let mut sums = vec![[0.0; 2]; own.len()];
    for &(neighbour, weight) in blur.of(point) {
        let theirs = table.list(neighbour);
        let mut first = 0;
        // Few of a point's entries were ever tried.
        for (j, counter) in table.counters[range(&table.offsets, neighbour)].iter().enumerate() {
            if !counter.is_tried() {
                continue;
            }
            let [attempts, successes] = counter.get();
            let parts = own.overlapping_from(first, &theirs.get(j));
            first = parts.start;
            let share = weight / parts.len() as f32;
            for sum in &mut sums[parts] {
                *sum = [sum[0] + share * attempts, sum[1] + share * successes];
            }
        }
    }
    sums
}

/// How many tries the clusters' priors should count as: that of [`CLUSTER_TRIES`] which best foretells, from what happened around them, what
/// happened at some points (the most likely one).
///
/// Where walls hide lights, what little is known of one is to be believed; where leaves do, half of all lights are seen from any place, each place
/// sees others, and few tries tell nothing but chance.
fn prior_tries(hierarchy: &Hierarchy, blur: &BlurWeights, table: &Table) -> f32 {
    let points = table.offsets.len() as u32 - 1;
    let stride = points.div_ceil(ASKED).max(1);
    let ask = |i: u32| {
        let point = i * stride;
        let (list, around) = (table.list(point), around(blur, table, point));
        let counters = &table.counters[range(&table.offsets, point)];
        CLUSTER_TRIES.map(|tries| {
            let expected = Descent::new(hierarchy, list, &around, tries).all();
            let log_likelihood = |(counter, r): (&Counter, &f32)| {
                let [attempts, successes] = counter.get();
                let r = r.clamp(LEAST_CHANCE, 1.0 - LEAST_CHANCE);
                f64::from(successes * r.ln() + (attempts - successes) * (1.0 - r).ln())
            };
            counters.iter().zip(&expected).map(log_likelihood).sum::<f64>()
        })
    };
    let answers: Vec<[f64; CLUSTER_TRIES.len()]> = (0..points.div_ceil(stride)).into_par_iter().map(ask).collect();
    // One after the other, so that threads change nothing.
    let sum = |k: usize| answers.iter().map(|answer| answer[k]).sum::<f64>();
    let best = (0..CLUSTER_TRIES.len()).max_by(|&a, &b| sum(a).total_cmp(&sum(b)));
    best.map_or(PRIOR_TRIES, |k| CLUSTER_TRIES[k])
}

/// The blurred weights of one point's entries by a rule that judges each for itself.
fn weights_alone(rule: VisibilityRule, blur: &BlurWeights, table: &Table, point: u32) -> Vec<f32> {
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
        VisibilityRule::Threshold => sums.into_iter().map(|[weight, sum]| sum / weight).collect(),
        _ => sums.into_iter().map(|tally| weight(posterior(tally, PRIOR, PRIOR_TRIES))).collect(),
    }
}

/// The weights of one point's entries with their clusters as priors, which count as `tries`.
fn weights_in_clusters(
    hierarchy: &Hierarchy,
    blur: &BlurWeights,
    table: &Table,
    point: u32,
    tries: f32,
) -> impl Iterator<Item = f32> {
    let mut tallies = around(blur, table, point);
    for (sum, counter) in tallies.iter_mut().zip(&table.counters[range(&table.offsets, point)]) {
        let [attempts, successes] = counter.get();
        *sum = [sum[0] + attempts, sum[1] + successes];
    }
    Descent::new(hierarchy, table.list(point), &tallies, tries).all().into_iter().map(weight)
}

/// Whether the lights that are hidden could be told from those that are not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lesson {
    /// They could.
    Clear,
    /// Hardly: which are hidden changes from place to place.
    Vague,
}

/// Turns what was learned into the weights that the next iteration selects by.
pub fn update(rule: VisibilityRule, hierarchy: &Hierarchy, blur: &BlurWeights, table: &mut Table) -> Lesson {
    let tries = match rule {
        VisibilityRule::Clusters => prior_tries(hierarchy, blur, table),
        _ => PRIOR_TRIES,
    };
    let mut visibility = std::mem::take(&mut table.visibility);
    split_lists(&mut visibility, &table.offsets, 1).into_par_iter().enumerate().for_each(|(point, out)| {
        let point = point as u32;
        match rule {
            VisibilityRule::Off => out.fill(1.0),
            VisibilityRule::Threshold | VisibilityRule::Root => {
                out.copy_from_slice(&weights_alone(rule, blur, table, point));
            }
            VisibilityRule::Clusters => {
                let weights = weights_in_clusters(hierarchy, blur, table, point, tries);
                out.iter_mut().zip(weights).for_each(|(out, w)| *out = w);
            }
        }
    });
    table.visibility = visibility;
    table.counters.par_iter_mut().for_each(Counter::limit);
    if tries < CLUSTER_TRIES[CLUSTER_TRIES.len() - 1] { Lesson::Clear } else { Lesson::Vague }
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
        let hierarchy = Hierarchy::new(&lights, true);
        let leaf = |place| hierarchy.leaf(place).expect("sixteen lights");
        let gathered = Gathered { clusters: (0..16).map(leaf).collect(), near: vec![] };
        let table = Table::gathered(1, Some(hierarchy.places()), |_| (gathered.clone(), vec![]));
        // One light of each is known: hidden here, visible there.
        let mut tallies = [[0.0; 2]; 16];
        (tallies[0], tallies[8]) = ([50.0, 0.0], [50.0, 50.0]);
        let r = Descent::new(&hierarchy, table.list(0), &tallies, 1.0).all();
        assert_eq!(r.len(), 16);
        assert!(r[..8].iter().all(|&r| r < 0.05) && r[8..].iter().all(|&r| r > 0.95), "{r:?}");
        assert!(r[0] < r[1] && r[8] > r[9], "{r:?}");
        // What a prior that counts as much as many tries makes of it lies between them.
        let slow = Descent::new(&hierarchy, table.list(0), &tallies, 16.0).all();
        assert!(r[0] < slow[0] && slow[8] < r[8] && slow[0] < slow[8], "{slow:?}");
    }

    /// Points in a row, each with eight lights as entries, `seen(point, light)` of four tries at each.
    fn row(points: u32, seen: impl Fn(u32, u32) -> u32 + Sync) -> (Hierarchy, BlurWeights, Table) {
        let mut lights = Lights::default();
        (0..8).for_each(|i| {
            lights.add_point(PointLight { p: Vec3::X * i as f32, intensity: Rgb::WHITE });
        });
        let hierarchy = Hierarchy::new(&lights, true);
        let leaf = |place| hierarchy.leaf(place).expect("eight lights");
        let gathered = Gathered { clusters: (0..8).map(leaf).collect(), near: vec![] };
        let counters = |point| (0..8).map(|light| Counter::new([4.0, seen(point, light) as f32])).collect();
        let table = Table::gathered(points as usize, Some(hierarchy.places()), |p| (gathered.clone(), counters(p)));
        let positions: Vec<Vec3> = (0..points).map(|i| Vec3::Y * i as f32).collect();
        (hierarchy, BlurWeights::new(&positions), table)
    }

    #[test]
    fn chance_is_told_from_walls() {
        // Walls: every second light is hidden from everywhere.
        let (hierarchy, blur, table) = row(64, |_, light| 4 * (light % 2));
        assert_eq!(prior_tries(&hierarchy, &blur, &table), 1.0);
        // Leaves: each is seen about half the time.
        let (hierarchy, blur, table) =
            row(64, |point, light| crate::math::sampler::mix((8 * point + light).into()) as u32 % 5);
        assert_eq!(prior_tries(&hierarchy, &blur, &table), 16.0);
    }

    #[test]
    fn what_is_known_of_a_cluster_is_shared_out() {
        let mut lights = Lights::default();
        (0..8).for_each(|i| {
            lights.add_point(PointLight { p: Vec3::X * i as f32, intensity: Rgb::WHITE });
        });
        let hierarchy = Hierarchy::new(&lights, true);
        let leaf = |place| hierarchy.leaf(place).expect("eight lights");
        let root = hierarchy.roots().next().expect("lights");
        // One point tells the lights apart, the other does not.
        let lists = [(0..8).map(leaf).collect(), vec![root]].map(|clusters| Gathered { clusters, near: vec![] });
        let counters = |n: usize| (0..n).map(|_| Counter::new([16.0, 8.0])).collect();
        let make = |p: u32| (lists[p as usize].clone(), counters(lists[p as usize].clusters.len()));
        let table = Table::gathered(2, Some(hierarchy.places()), make);
        let blur = BlurWeights::new(&[Vec3::ZERO, Vec3::Y]);
        assert_eq!(around(&blur, &table, 0), [[2.0, 1.0]; 8]);
        assert_eq!(around(&blur, &table, 1), [[128.0, 64.0]]);
    }
}
