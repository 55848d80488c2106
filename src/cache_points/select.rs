//! Selecting a light at a vertex. Source: Li et al. 2024, section 3.3.
//!
//! The weights of a point's far lights are a mixture over sensors, so choosing a sensor and then an entry by that sensor's running sums gives
//! the paper's distribution without a pass over all entries. Near lights are evaluated at the vertex itself.

use arrayvec::ArrayVec;
use glam::Vec3;

use super::CachePoints;
use super::linked::Linked;
use super::table::{OMNIDIRECTIONAL, range};
use crate::light::{LightId, Lights, LinkSet, Receiver};

/// The share of choices made among all lights alike: what no list holds must stay reachable.
pub const UNIFORM_PROBABILITY: f64 = 0.01;

/// By how much of a point's radius surface vertices look for it off their surface (and points lie off theirs).
pub const OFF_SURFACE: f32 = 0.5;

/// What is worked out for one vertex. One per thread, reused.
#[derive(Clone, Debug, Default)]
pub struct CacheScratch {
    /// The point in use; the next vertex of the path may use it too.
    point: Option<u32>,
    receiver: Option<Receiver>,
    /// Sensors, their weights, and the sums up to and with each.
    pub(super) bins: ArrayVec<(usize, f64, f64), 6>,
    /// What light linking changes.
    pub(super) linked: Linked,
    /// Running sums of the near lights' weights.
    near: Vec<f64>,
    /// Sum over all near lights and sensors.
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

        let links = receiver.links();
        scratch.linked.reset();
        if links != LinkSet::ORDINARY {
            Self::find_linked(lights, receiver, links, &mut scratch.linked);
        }
        let keeps_rest = scratch.linked.keeps_rest;
        let is_lit = |id| links == LinkSet::ORDINARY || (keeps_rest && lights.is_linked(links, id));
        let near = range(&self.near.offsets, point);
        let mut sum = 0.0f64;
        scratch.near.clear();
        scratch.near.extend(self.near.clusters[near.clone()].iter().zip(&self.near.visibility[near]).map(
            |(cluster, w)| {
                let light = self.hierarchy.light(cluster).filter(|&id| is_lit(id));
                let weight = light.map_or(0.0, |id| lights.contribution(id, receiver));
                sum += f64::from(weight) * f64::from(*w);
                sum
            },
        ));

        sum += scratch.linked.named_sums.last().copied().unwrap_or(0.0);
        let before_far = sum;

        scratch.bins.clear();
        let mut add = |bin: usize, weight: f32| {
            if weight > 0.0 {
                let bin_total = self.far.sums_of(point, bin).last().copied().unwrap_or(0.0);
                sum += f64::from(weight) * f64::from(bin_total);
                scratch.bins.push((bin, f64::from(weight), sum));
            }
        };
        match *receiver {
            Receiver::Medium { .. } => add(OMNIDIRECTIONAL, 1.0),
            Receiver::Surface { ns, two_sided, .. } => {
                // The squares of a unit vector's components add up to 1.
                for (axis, n) in ns.to_array().into_iter().enumerate() {
                    let side = usize::from(n < 0.0);
                    add(2 * axis + side, n * n);
                    if two_sided {
                        add(2 * axis + 1 - side, n * n);
                    }
                }
            }
        }
        scratch.total = sum;
        if links != LinkSet::ORDINARY {
            if !keeps_rest {
                scratch.bins.clear();
                scratch.total = before_far;
            } else if scratch.linked.drops {
                self.sum_linked_far(lights, point, links, scratch);
                scratch.total = before_far + scratch.linked.far_sums.last().copied().unwrap_or(0.0);
            }
        }
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

    /// A light, its probability, and what is left of `u`.
    pub fn sample(&self, lights: &Lights, u: f64, scratch: &CacheScratch) -> Option<(LightId, f32, f64)> {
        let uniform = self.uniform_probability(scratch);
        let (id, rest) = if u < uniform {
            let (id, _, rest) = self.uniform.sample(u / uniform);
            (id, rest)
        } else {
            let target = ((u - uniform) / (1.0 - uniform)).min(1.0 - f64::EPSILON) * scratch.total;
            self.sample_listed(target, scratch)?
        };
        Some((id, self.pmf(lights, id, scratch), rest.clamp(0.0, 1.0 - f64::EPSILON)))
    }

    /// The light at `target` of the sum over near, named and far lights, and what is left of the number.
    fn sample_listed(&self, target: f64, scratch: &CacheScratch) -> Option<(LightId, f64)> {
        let (point, receiver) = (scratch.point?, scratch.receiver.as_ref()?);
        let total = |sums: &[f64]| sums.last().copied().unwrap_or(0.0);
        let near_total = total(&scratch.near);
        if target < near_total {
            let (k, rest) = place_of(target, &scratch.near);
            let cluster = &self.near.clusters[range(&self.near.offsets, point).start + k];
            return Some((self.hierarchy.light(cluster)?, rest));
        }
        let (target, linked) = (target - near_total, &scratch.linked);
        if target < total(&linked.named_sums) {
            let (k, rest) = place_of(target, &linked.named_sums);
            return Some((linked.named[k], rest));
        }
        let far = &self.far.clusters[range(&self.far.offsets, point)];
        if linked.drops {
            let target = (target - total(&linked.named_sums)).min(total(&linked.far_sums) * (1.0 - f64::EPSILON));
            let (k, rest) = place_of(target.max(0.0), &linked.far_sums);
            return self.hierarchy.sample_below(far.get(k)?, receiver, rest);
        }
        let target = target + near_total;
        let (bin, weight, end) = *scratch.bins.iter().find(|bin| target < bin.2).or(scratch.bins.last())?;
        let sums = self.far.sums_of(point, bin);
        let whole = Some(f64::from(*sums.last()?)).filter(|whole| *whole > 0.0)?;
        let target = ((target - (end - weight * whole)) / weight).clamp(0.0, whole * (1.0 - f64::EPSILON));
        let k = sums.partition_point(|&sum| f64::from(sum) <= target);
        let before = if k > 0 { f64::from(sums[k - 1]) } else { 0.0 };
        let rest = (target - before) / (f64::from(*sums.get(k)?) - before);
        self.hierarchy.sample_below(&far[k], receiver, rest.clamp(0.0, 1.0 - f64::EPSILON))
    }

    /// The probability of `id` at the vertex last prepared.
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> f32 {
        let uniform = self.uniform_probability(scratch);
        let even = f64::from(self.uniform.pmf(id)) * uniform;
        if uniform >= 1.0 {
            return even as f32;
        }
        let listed = self.listed_weight(lights, id, scratch).unwrap_or(0.0);
        (even + (1.0 - uniform) * listed / scratch.total) as f32
    }

    /// The share of `id` in the sum over near, named and far lights.
    fn listed_weight(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> Option<f64> {
        let (point, linked) = (scratch.point?, &scratch.linked);
        if let Ok(k) = linked.named.binary_search(&id) {
            return Some(step(&linked.named_sums, k));
        }
        let key = self.hierarchy.key(lights, id)?;
        if let Some(place) = self.near.find(point, key) {
            return Some(step(&scratch.near, place - range(&self.near.offsets, point).start));
        }
        let place = self.far.find(point, key)?;
        let k = place - range(&self.far.offsets, point).start;
        let weight: f64 = if linked.drops {
            step(&linked.far_sums, k)
        } else {
            let of_bin = |&(bin, weight, _): &(usize, f64, f64)| {
                let sums = self.far.sums_of(point, bin);
                weight * (f64::from(sums[k]) - if k > 0 { f64::from(sums[k - 1]) } else { 0.0 })
            };
            scratch.bins.iter().map(of_bin).sum()
        };
        // The way down a cluster need not be gone for nothing.
        let below =
            || Some(f64::from(self.hierarchy.pmf_below(&self.far.clusters[place], key, scratch.receiver.as_ref()?)));
        if weight > 0.0 { Some(weight * below()?) } else { Some(0.0) }
    }

    /// What is known of the visibility of `id` from the vertex last prepared, as the factor W that its weight has.
    #[inline]
    pub fn visibility(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> f32 {
        let (Some(point), Some(key)) = (scratch.point, self.hierarchy.key(lights, id)) else { return 1.0 };
        if let Some(place) = self.near.find(point, key) {
            return self.near.visibility[place];
        }
        self.far.find(point, key).map_or(1.0, |place| self.far.visibility[place])
    }

    /// Tells what became of a shadow ray to `id` at the vertex last prepared.
    #[inline]
    pub fn record(&self, lights: &Lights, id: LightId, is_visible: bool, scratch: &CacheScratch) {
        if !self.learns() {
            return;
        }
        let (Some(point), Some(key)) = (scratch.point, self.hierarchy.key(lights, id)) else { return };
        if let Some(place) = self.near.find(point, key) {
            self.near.counters[place].record(is_visible);
        } else if let Some(place) = self.far.find(point, key) {
            self.far.counters[place].record(is_visible);
        }
    }

    /// Where nothing known contributes, all lights are alike.
    #[inline]
    fn uniform_probability(&self, scratch: &CacheScratch) -> f64 {
        if scratch.total > 0.0 { UNIFORM_PROBABILITY } else { 1.0 }
    }

    /// Where cache points are moved off their surfaces to: see [`OFF_SURFACE`].
    pub(super) fn off_surface(p: Vec3, normal: Vec3, radius: f32) -> Vec3 {
        p + normal * (OFF_SURFACE * radius)
    }
}

/// The step of running sums that `target`, below the last of them, falls into, and where in it.
fn place_of(target: f64, sums: &[f64]) -> (usize, f64) {
    let k = sums.partition_point(|&sum| sum <= target);
    let before = if k > 0 { sums[k - 1] } else { 0.0 };
    (k, sums.get(k).map_or(0.0, |sum| (target - before) / (sum - before)))
}

/// The height of step `k` of running sums.
fn step(sums: &[f64], k: usize) -> f64 {
    sums[k] - if k > 0 { sums[k - 1] } else { 0.0 }
}
