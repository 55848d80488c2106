//! Lights that are alike: far away, close together and facing the same way, each matters as much as its energy says. So the way down the
//! hierarchy ends above them, and one is chosen by a look at the running sums of their energies. **Ours**: Conty Estevez & Kulla (HPG 2018)
//! go down to the leaves. Among millions of lights most nodes are far from the processor, and a step down waits for each.

use rayon::prelude::*;

use super::node::Node;
use super::sample::LEAST;
use super::{Cluster, LightTree, Parts};
use crate::light::Receiver;
use crate::light::emitters::squared_sine;

/// How alike lights must be.
#[derive(Clone, Copy)]
struct Tolerance {
    /// Up to this ratio of radius and distance.
    spread: f32,
    /// A cosine may change by this share of itself over what the lights span.
    change: f32,
}

/// What arrives from the near side is 1.6 times what arrives from the middle then, from the far side 0.7 times.
const OF_FEW: Tolerance = Tolerance { spread: 0.2, change: 0.35 };

/// 2.8 times and half as much. The RMSE at 32 spp was 1.004, 1.001 and 1.004 times as large in `house`, `rooms` and `foliage` with this for all (160 × 90
/// pixels, four seeds), and a sample in `house` took 1.03 times as long, for ways down among few lights are short, and near. Under five million lights a
/// sample cost 1.27 ± 0.03 times one under five thousand, in place of 1.38 ± 0.02.
const OF_MANY: Tolerance = Tolerance { spread: 0.4, change: 0.7 };

/// How many lights are many.
const MANY: u32 = 256;

/// Lights with a smaller share of all energy are not told apart well enough by sums over all lights.
const LEAST_ENERGY: f64 = 1e-7;

/// The energies of all places, summed from left to right.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::light) struct EnergySums(Box<[f64]>);

impl EnergySums {
    /// Of the parts in `order`.
    pub fn new(parts: &impl Parts, order: &[u32]) -> Self {
        let energy = |&id: &u32| f64::from(parts.bounds(id).energy);
        let mut sums = vec![0.0];
        sums.par_extend(order.par_iter().map(energy));
        for place in 1..sums.len() {
            sums[place] += sums[place - 1];
        }
        Self(sums.into_boxed_slice())
    }

    /// Where a number in [0, 1) falls among the lights of `cluster` if all are equally strong, for fetching ahead.
    #[inline(always)]
    pub fn guess(cluster: &Cluster, u: f64) -> usize {
        cluster.first as usize + (u * f64::from(cluster.count)) as usize
    }

    /// The sums, to fetch from ahead.
    #[inline(always)]
    pub fn all(&self) -> &[f64] {
        &self.0
    }

    /// Whether they tell the lights below a node of this energy apart.
    #[inline(always)]
    fn resolve(&self, energy: f32) -> bool {
        self.0.last().is_some_and(|total| f64::from(energy) > LEAST_ENERGY * total)
    }

    /// The probability of the light at `place` among those of `cluster`, all of which stay in reach ([`LEAST`]).
    #[inline]
    pub fn pmf(&self, cluster: &Cluster, place: u32) -> f32 {
        let [start, end] = [cluster.first, cluster.end()].map(|place| self.0[place as usize]);
        let own = self.0[place as usize + 1] - self.0[place as usize];
        debug_assert!(end > start, "the sums tell these lights apart");
        let even = LEAST / cluster.count as f32;
        ((1.0 - f64::from(LEAST)) * own / (end - start)) as f32 + even
    }

    /// The place that `u` in [0, 1) chooses, and what is left of it, in [0, 1).
    #[inline]
    pub fn sample(&self, cluster: &Cluster, u: f64) -> (u32, f64) {
        let Cluster { first, count, .. } = *cluster;
        let least = f64::from(LEAST);
        let below_one = |rest: f64| rest.clamp(0.0, 1.0 - f64::EPSILON);
        if u < least {
            let at = u / least * f64::from(count);
            let k = (at as u32).min(count - 1);
            return (first + k, below_one(at - f64::from(k)));
        }
        let [start, end] = [first, first + count].map(|place| self.0[place as usize]);
        let target = start + (u - least) / (1.0 - least) * (end - start);
        let place = self.place(first as usize, (first + count) as usize, target);
        let own = self.0[place + 1] - self.0[place];
        let rest = if own > 0.0 { (target - self.0[place]) / own } else { 0.0 };
        (place as u32, below_one(rest))
    }

    /// The place in `low..high` in whose step of the sums `target` falls. Strengths are alike mostly, so a few looks where it should be find it;
    /// the rest is halving.
    #[inline]
    fn place(&self, mut low: usize, mut high: usize, target: f64) -> usize {
        const GUESSES: u32 = 3;
        for guess in 0.. {
            if high - low == 1 {
                break;
            }
            let [start, end] = [self.0[low], self.0[high]];
            let middle = if guess < GUESSES && end > start {
                let share = (target - start) / (end - start);
                (low + (share * (high - low) as f64) as usize).clamp(low, high - 1)
            } else {
                low + (high - low) / 2
            };
            if target < self.0[middle] {
                high = middle;
            } else if middle + 1 == high || target < self.0[middle + 1] {
                return middle;
            } else {
                low = middle + 1;
            }
        }
        low
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.0)
    }
}

impl LightTree {
    /// From here on the ways down end where lights are alike.
    pub fn end_where_alike(&mut self, parts: &impl Parts) {
        self.energies = Some(EnergySums::new(parts, &self.order));
    }

    /// The sums to choose by where the lights of `cluster`, several, are alike at `receiver`.
    #[inline(always)]
    pub(in crate::light) fn alike(&self, cluster: &Cluster, receiver: &Receiver) -> Option<&EnergySums> {
        let node = self.node(cluster.node);
        self.energies.as_ref().filter(|energies| {
            node.is_alike(receiver, if cluster.count < MANY { OF_FEW } else { OF_MANY })
                && energies.resolve(node.energy)
        })
    }
}

impl Node {
    /// Whether what `receiver` gets of each light below is in proportion to its energy, or nearly so.
    #[inline(always)]
    fn is_alike(&self, receiver: &Receiver, Tolerance { spread, change }: Tolerance) -> bool {
        let to_light = self.centre - receiver.p();
        let square = to_light.length_squared();
        let radius_squared = self.radius * self.radius;
        // Also false at the very spot.
        if !(radius_squared < spread * spread * square) {
            return false;
        }
        let wi = to_light * (1.0 / square.sqrt());
        let spanned = radius_squared / square;
        // Where the angle is not small a cosine changes by the sine of what the lights span, nearly.
        let is_steady = |cos: f32, sin_squared: f32| cos > 0.0 && sin_squared < change * change * cos * cos;
        let is_received = match *receiver {
            Receiver::Medium { .. } => true,
            Receiver::Surface { ns, two_sided, .. } => {
                let cos = ns.dot(wi);
                is_steady(if two_sided { cos.abs() } else { cos }, spanned)
            }
        };
        if !is_received || self.is_even() {
            return is_received;
        }
        // Spots and the like each have a way of their own to fall off; of panels some of which emit on both sides, who knows which face the receiver?
        if !self.is_lambertian() || self.is_two_sided() || self.faces_all_ways() {
            return false;
        }
        let cos = -self.axis().dot(wi);
        let cos_normals = self.cos_normals();
        // Sines add up to no more than this: (a + b)² ≤ 2 (a² + b²).
        let turned = 2.0 * (squared_sine(cos_normals) + spanned);
        cos_normals > 0.0 && is_steady(cos, turned)
    }
}
