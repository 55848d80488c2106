//! Selecting a light at a vertex. Source: Li et al. 2024, section 3.3.
//!
//! Every entry of the nearest point's list is weighed: far lights by what the sensors that agree with the normal receive of them, near ones (lights and
//! clusters) at the vertex itself. One pass over a short list of numbers side by side is cheaper than the running sums of seven sensors would be to keep.

use arrayvec::ArrayVec;

use super::CachePoints;
use super::linked::Named;
use super::scatter::ScatterWeights;
use super::table::{List, range};
use crate::light::tree::{LANES, Way};
use crate::light::{LightId, Lights, LinkSet, Receiver};

/// The share of choices made among all lights alike: what no list holds must stay reachable.
pub const UNIFORM_PROBABILITY: f64 = 0.01;

/// By how much of a point's radius surface vertices look for it off their surface (and points lie off theirs).
pub const OFF_SURFACE: f32 = 0.5;

/// At most this many lights are drawn at once.
pub const MOST_DRAWN: usize = 8;

/// A light that was drawn at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Which.
    pub light: LightId,
    /// Its probability.
    pub pmf: f32,
    /// A number in [0, 1) that is uniform given the light, for choosing a part of it.
    pub rest: f64,
    /// The entry, among those of all points, that it belongs to.
    entry: Option<u32>,
}

impl Drawn {
    /// One that cache points know nothing of.
    pub const fn new((light, pmf, rest): (LightId, f32, f64)) -> Self {
        Self { light, pmf, rest, entry: None }
    }
}

/// What is worked out for one vertex. One per thread, reused.
#[derive(Clone, Debug, Default)]
pub struct CacheScratch {
    /// The point in use; the next vertex of the path may use it too.
    point: Option<u32>,
    receiver: Option<Receiver>,
    /// Weight of each entry.
    weights: Vec<f32>,
    /// Their running sums.
    sums: Vec<f64>,
    /// What light linking adds.
    named: Named,
    /// Sum over all entries and what linking adds.
    total: f64,
    /// Points looked up and used again.
    pub lookups: [u64; 2],
}

impl CacheScratch {
    /// Forgets the point in use: a new path begins.
    #[inline]
    pub fn begin_path(&mut self) {
        self.point = None;
    }
}

impl CachePoints {
    /// Finds the point for `receiver` and weighs its lights.
    pub fn prepare(&self, lights: &Lights, receiver: &Receiver, scratch: &mut CacheScratch) {
        let point = self.point_for(receiver, scratch);
        scratch.point = Some(point);
        scratch.receiver = Some(*receiver);
        let CacheScratch { weights, sums, named, .. } = scratch;
        self.weigh(lights, point, receiver, weights);
        named.clear();
        let links = receiver.links();
        if links != LinkSet::ORDINARY {
            self.link(lights, (point, receiver), links, weights, named);
        }
        let mut sum = 0.0;
        sums.clear();
        sums.extend(weights.iter().map(|&weight| {
            sum += f64::from(weight);
            sum
        }));
        scratch.total = sum + named.total();
    }

    /// The nearest point. In media the last one is kept while the path is within its radius.
    #[inline]
    fn point_for(&self, receiver: &Receiver, scratch: &mut CacheScratch) -> u32 {
        let p = receiver.p();
        if let (Receiver::Medium { .. }, Some(point)) = (receiver, scratch.point)
            && p.distance_squared(self.positions[point as usize]) <= self.radii[point as usize].powi(2)
        {
            scratch.lookups[1] += 1;
            return point;
        }
        scratch.lookups[0] += 1;
        let point = self.lookup.of(p);
        match *receiver {
            Receiver::Surface { ns, two_sided: false, .. } if self.settings.normals => {
                self.lookup.of(p + ns * (OFF_SURFACE * self.radii[point as usize]))
            }
            _ => point,
        }
    }

    /// The weights of the entries of `point`.
    #[inline]
    fn weigh(&self, lights: &Lights, point: u32, receiver: &Receiver, weights: &mut Vec<f32>) {
        let entries = range(&self.table.offsets, point);
        let (fluence, shares) = self.table.energies(point);
        let visibility = &self.table.visibility[entries];
        let energy = fluence.iter().zip(visibility).map(|(fluence, w)| fluence * w);
        weights.clear();
        match *receiver {
            Receiver::Medium { .. } => weights.extend(energy),
            Receiver::Surface { ns, two_sided, .. } => {
                // The squares of a unit vector's components add up to 1.
                let agree: [f32; 3] = (ns * ns * (1.0 / 255.0)).to_array();
                let count = fluence.len();
                let row = |row: usize| &shares[row * count..(row + 1) * count];
                // Each axis has a plane that faces the way the normal does.
                let facing = [0, 1, 2].map(|axis| 2 * axis + usize::from(ns[axis] < 0.0));
                let received =
                    |[x, y, z]: [u8; 3]| agree[0] * f32::from(x) + agree[1] * f32::from(y) + agree[2] * f32::from(z);
                let [x, y, z] = facing.map(row);
                let front = x.iter().zip(y).zip(z).map(|((&x, &y), &z)| received([x, y, z]));
                weights.extend(energy.clone().zip(front).map(|(energy, share)| energy * share));
                if two_sided {
                    let [x, y, z] = facing.map(|plane| row(plane ^ 1));
                    let back = x.iter().zip(y).zip(z).map(|((&x, &y), &z)| received([x, y, z]));
                    weights
                        .iter_mut()
                        .zip(energy.zip(back))
                        .for_each(|(weight, (energy, share))| *weight += energy * share);
                }
            }
        }
        self.weigh_near(lights, point, receiver, weights);
    }

    /// The weights of near entries of `point`: of lights one by one, of clusters several at once.
    #[inline]
    fn weigh_near(&self, lights: &Lights, point: u32, receiver: &Receiver, weights: &mut [f32]) {
        let (list, near) = (self.table.list(point), self.table.near(point));
        let visibility = &self.table.visibility[range(&self.table.offsets, point)];
        let mut clusters: ArrayVec<(usize, u32), LANES> = ArrayVec::new();
        for (i, &k) in near.iter().enumerate() {
            let k = usize::from(k);
            let cluster = list.get(k);
            if cluster.count > 1 {
                clusters.push((k, cluster.node));
            } else {
                weights[k] = self.hierarchy.energy(lights, &cluster, receiver) * visibility[k];
            }
            if clusters.is_full() || (i + 1 == near.len() && !clusters.is_empty()) {
                // Where fewer are left, the last one stands in for the rest.
                let last = clusters.len() - 1;
                let energies =
                    self.hierarchy.energies(std::array::from_fn(|lane| clusters[lane.min(last)].1), receiver);
                clusters.drain(..).zip(energies).for_each(|((k, _), energy)| weights[k] = energy * visibility[k]);
            }
        }
    }

    /// Draws a light for each of `numbers`, all in [0, 1), at the vertex last prepared.
    pub fn sample(
        &self,
        lights: &Lights,
        numbers: impl Iterator<Item = f64>,
        scratch: &CacheScratch,
        drawn: &mut ArrayVec<Drawn, MOST_DRAWN>,
    ) {
        let (Some(point), Some(receiver)) = (scratch.point, &scratch.receiver) else { return };
        let uniform = self.uniform_probability(scratch);
        let (list, first) = (self.table.list(point), self.table.offsets[point as usize]);
        let of_named = scratch.named.total();
        let mut entries: ArrayVec<usize, MOST_DRAWN> = ArrayVec::new();
        let mut ways: ArrayVec<Way, MOST_DRAWN> = ArrayVec::new();
        for u in numbers {
            let target = ((u - uniform) / (1.0 - uniform)).min(1.0 - f64::EPSILON) * scratch.total;
            if u >= uniform && target >= of_named {
                let (k, rest) = place_of(target - of_named, &scratch.sums);
                entries.push(k);
                let cluster = list.get(k);
                self.hierarchy.fetch(&cluster);
                ways.push(Way::from(cluster, rest));
                continue;
            }
            let (light, rest) = if u < uniform {
                let (light, _, rest) = self.uniform.sample(u / uniform);
                (light, rest.clamp(0.0, 1.0 - f64::EPSILON))
            } else {
                let (k, rest) = place_of(target, &scratch.named.sums);
                (scratch.named.lights[k], rest)
            };
            let entry = self.entry_of(lights, light, &list).map(|k| first + k as u32);
            drawn.push(Drawn { light, pmf: self.pmf(lights, light, scratch), rest, entry });
        }
        self.hierarchy.descend(lights, &mut ways, receiver);
        for (k, way) in entries.into_iter().zip(ways) {
            let (light, below, rest) = self.hierarchy.arrive(lights, way, receiver);
            let pmf = self.mixed(light, uniform, entry_weight(k, below, scratch), scratch);
            drawn.push(Drawn { light, pmf, rest, entry: Some(first + k as u32) });
        }
    }

    /// The probability of `id` at the vertex last prepared.
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> f32 {
        let uniform = self.uniform_probability(scratch);
        let listed = if uniform < 1.0 { self.listed_weight(lights, id, scratch) } else { None };
        self.mixed(id, uniform, listed.unwrap_or(0.0), scratch)
    }

    /// The probability of a light that is chosen in proportion to `weight`, or with probability `uniform` like any other.
    #[inline]
    fn mixed(&self, id: LightId, uniform: f64, weight: f64, scratch: &CacheScratch) -> f32 {
        let even = f64::from(self.uniform.pmf(id)) * uniform;
        if weight > 0.0 { (even + (1.0 - uniform) * weight / scratch.total) as f32 } else { even as f32 }
    }

    /// The part of `id` in the sum over entries and what linking adds.
    fn listed_weight(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> Option<f64> {
        let named = &scratch.named;
        if let Ok(k) = named.lights.binary_search(&id) {
            return Some(named.sums[k] - if k > 0 { named.sums[k - 1] } else { 0.0 });
        }
        let place = self.hierarchy.place(lights, id)?;
        let list = self.table.list(scratch.point?);
        let k = list.find(place)?;
        // The way down a cluster need not be gone for nothing.
        if scratch.weights[k] == 0.0 {
            return None;
        }
        let below = self.hierarchy.pmf_below(lights, &list.get(k), place, scratch.receiver.as_ref()?);
        Some(entry_weight(k, below, scratch))
    }

    /// The number of the entry of `list` that `id` belongs to.
    #[inline]
    fn entry_of(&self, lights: &Lights, id: LightId, list: &List<'_>) -> Option<usize> {
        list.find(self.hierarchy.place(lights, id)?)
    }

    /// What is known of the visibility of a light where it was drawn, as the factor W that its weight has; 1 where nothing is known.
    #[inline]
    pub fn visibility(&self, drawn: &Drawn) -> f32 {
        drawn.entry.map_or(1.0, |entry| self.table.visibility[entry as usize])
    }

    /// Tells what became of a shadow ray to a light that was drawn.
    #[inline]
    pub fn record(&self, drawn: &Drawn, is_visible: bool) {
        if self.learns()
            && let Some(entry) = drawn.entry
        {
            self.table.counters[entry as usize].record(is_visible);
        }
    }

    /// Tells what became of a shadow ray from `p` in a medium to a light that something else has chosen.
    #[inline]
    pub fn record_at(&self, lights: &Lights, p: glam::Vec3, light: LightId, is_visible: bool) {
        if !self.learns() || self.scatter.as_ref().is_none_or(ScatterWeights::knows_enough) {
            return;
        }
        let point = self.lookup.of(p);
        if let Some(k) = self.entry_of(lights, light, &self.table.list(point)) {
            self.table.counters[range(&self.table.offsets, point)][k].record(is_visible);
        }
    }

    /// Where nothing known contributes, all lights are alike.
    #[inline]
    fn uniform_probability(&self, scratch: &CacheScratch) -> f64 {
        if scratch.total > 0.0 { UNIFORM_PROBABILITY } else { 1.0 }
    }

    /// Where cache points are moved off their surfaces to: see [`OFF_SURFACE`].
    pub(super) fn off_surface(p: glam::Vec3, normal: glam::Vec3, radius: f32) -> glam::Vec3 {
        p + normal * (OFF_SURFACE * radius)
    }
}

/// The weight of a light that has the probability `below` within entry `k`.
#[inline]
fn entry_weight(k: usize, below: f32, scratch: &CacheScratch) -> f64 {
    f64::from(scratch.weights[k]) * f64::from(below)
}

/// The step of running sums that `target`, not below 0, falls into (the last one where rounding leaves it beyond), and where in it.
fn place_of(target: f64, sums: &[f64]) -> (usize, f64) {
    let end = sums.last().map_or(0.0, |sum| sum * (1.0 - f64::EPSILON));
    let target = target.min(end);
    let k = sums.partition_point(|&sum| sum <= target).min(sums.len().saturating_sub(1));
    let before = if k > 0 { sums[k - 1] } else { 0.0 };
    let rest = sums.get(k).map_or(0.0, |sum| (target - before) / (sum - before));
    (k, rest.clamp(0.0, 1.0 - f64::EPSILON))
}
