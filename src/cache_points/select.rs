//! Selecting a light at a vertex. Source: Li et al. 2024, section 3.3.
//!
//! The weights of a point's far lights are a mixture over sensors, so choosing a sensor and then an entry by that sensor's running sums gives
//! the paper's distribution without a pass over all entries. Near lights are evaluated at the vertex itself.

use arrayvec::ArrayVec;
use glam::Vec3;

use super::CachePoints;
use super::table::{OMNIDIRECTIONAL, range};
use crate::light::{LightId, Lights, Receiver};

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
    bins: ArrayVec<(usize, f64, f64), 6>,
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

        let near = range(&self.near.offsets, point);
        let mut sum = 0.0f64;
        scratch.near.clear();
        scratch.near.extend(self.near.clusters[near.clone()].iter().zip(&self.near.visibility[near]).map(
            |(cluster, w)| {
                let weight = self.hierarchy.light(cluster).map_or(0.0, |id| lights.contribution(id, receiver));
                sum += f64::from(weight) * f64::from(*w);
                sum
            },
        ));

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
        if u < uniform {
            let (id, _, rest) = self.uniform.sample(u / uniform);
            return Some((id, self.pmf(lights, id, scratch), rest));
        }
        let mut target = ((u - uniform) / (1.0 - uniform)).min(1.0 - f64::EPSILON) * scratch.total;
        let near_total = scratch.near.last().copied().unwrap_or(0.0);
        let point = scratch.point?;
        let (id, rest) = if target < near_total {
            let k = scratch.near.partition_point(|&sum| sum <= target);
            let before = if k > 0 { scratch.near[k - 1] } else { 0.0 };
            let cluster = &self.near.clusters[range(&self.near.offsets, point).start + k];
            (self.hierarchy.light(cluster)?, (target - before) / (scratch.near[k] - before))
        } else {
            let (bin, weight, end) = *scratch.bins.iter().find(|bin| target < bin.2).or(scratch.bins.last())?;
            let sums = self.far.sums_of(point, bin);
            let whole = Some(f64::from(*sums.last()?)).filter(|whole| *whole > 0.0)?;
            target = ((target - (end - weight * whole)) / weight).clamp(0.0, whole * (1.0 - f64::EPSILON));
            let k = sums.partition_point(|&sum| f64::from(sum) <= target).min(sums.len() - 1);
            let before = if k > 0 { f64::from(sums[k - 1]) } else { 0.0 };
            let rest = ((target - before) / (f64::from(sums[k]) - before)).clamp(0.0, 1.0 - f64::EPSILON);
            let cluster = &self.far.clusters[range(&self.far.offsets, point).start + k];
            self.hierarchy.sample_below(cluster, scratch.receiver.as_ref()?, rest)?
        };
        Some((id, self.pmf(lights, id, scratch), rest.clamp(0.0, 1.0 - f64::EPSILON)))
    }

    /// The probability of `id` at the vertex last prepared.
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &CacheScratch) -> f32 {
        let uniform = self.uniform_probability(scratch);
        let even = f64::from(self.uniform.pmf(id)) * uniform;
        let (Some(point), Some(key)) = (scratch.point, self.hierarchy.key(lights, id)) else { return even as f32 };
        if uniform >= 1.0 {
            return even as f32;
        }
        let weight = if let Some(place) = self.near.find(point, key) {
            let k = place - range(&self.near.offsets, point).start;
            scratch.near[k] - if k > 0 { scratch.near[k - 1] } else { 0.0 }
        } else if let Some(place) = self.far.find(point, key) {
            let k = place - range(&self.far.offsets, point).start;
            let of_bin = |&(bin, weight, _): &(usize, f64, f64)| {
                let sums = self.far.sums_of(point, bin);
                weight * (f64::from(sums[k]) - if k > 0 { f64::from(sums[k - 1]) } else { 0.0 })
            };
            let weight: f64 = scratch.bins.iter().map(of_bin).sum();
            match &scratch.receiver {
                Some(receiver) if weight > 0.0 => {
                    weight * f64::from(self.hierarchy.pmf_below(&self.far.clusters[place], key, receiver))
                }
                _ => weight,
            }
        } else {
            0.0
        };
        (even + (1.0 - uniform) * weight / scratch.total) as f32
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
