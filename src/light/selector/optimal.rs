//! Every light in proportion to its unoccluded contribution at the vertex, worked out anew at each: locally optimal
//! selection, and hopelessly slow with many lights. The yardstick for what is cheaper (Li et al., DigiPro 2024, section 3).

use super::{SelectorScratch, Uniform};
use crate::light::emitters::EmitterTable;
use crate::light::{LightId, Lights, Receiver};

/// The share of choices made uniformly: keeps every light reachable where an estimate is poor.
pub const OPTIMAL_UNIFORM_PROBABILITY: f64 = 0.01;

/// In proportion to unoccluded contribution.
#[derive(Clone, Debug)]
pub struct Optimal {
    uniform: Uniform,
    /// The area lights, which come first.
    emitters: EmitterTable,
}

impl Optimal {
    /// For the lights that are not dark, of which there must be some; `dark` are.
    pub fn new(lights: &Lights, dark: usize) -> Self {
        Self { uniform: Uniform::new(lights, dark), emitters: lights.emitter_table() }
    }

    /// One pass over all lights.
    pub fn prepare(&self, lights: &Lights, receiver: &Receiver, scratch: &mut SelectorScratch) {
        let SelectorScratch { weights, sums, .. } = scratch;
        weights.clear();
        self.emitters.contributions(receiver, weights);
        weights.extend(lights.ids().skip(weights.len()).map(|id| lights.contribution(id, receiver)));
        if let Some(linking) = lights.linking() {
            linking.clear_unlinked(receiver.links(), weights);
        }
        sums.clear();
        let mut sum = 0.0f64;
        sums.extend(weights.iter().map(|&weight| {
            sum += f64::from(weight.min(f32::MAX));
            sum
        }));
    }

    /// A light, its probability, and what is left of `u`.
    pub fn sample(&self, u: f64, scratch: &SelectorScratch) -> Option<(LightId, f32, f64)> {
        let total = scratch.sums.last().copied().unwrap_or(0.0);
        let uniform = self.uniform_probability(total);
        if u < uniform {
            let (id, _, rest) = self.uniform.sample(u / uniform);
            return Some((id, self.pmf(id, scratch), rest));
        }
        let target = ((u - uniform) / (1.0 - uniform)).min(1.0 - f64::EPSILON) * total;
        // The first sum beyond the target: its light has a positive weight.
        let index = scratch.sums.partition_point(|&sum| sum <= target);
        let before = if index > 0 { scratch.sums[index - 1] } else { 0.0 };
        let weight = scratch.sums.get(index)? - before;
        let id = LightId(index as u32);
        let rest = ((target - before) / weight).clamp(0.0, 1.0 - f64::EPSILON);
        Some((id, self.pmf(id, scratch), rest))
    }

    /// The probability of `id`.
    #[inline]
    pub fn pmf(&self, id: LightId, scratch: &SelectorScratch) -> f32 {
        let index = id.0 as usize;
        let total = scratch.sums.last().copied().unwrap_or(0.0);
        let uniform = self.uniform_probability(total);
        let even = f64::from(self.uniform.pmf(id)) * uniform;
        if total <= 0.0 || index >= scratch.sums.len() {
            return even as f32;
        }
        let before = if index > 0 { scratch.sums[index - 1] } else { 0.0 };
        (even + (1.0 - uniform) * (scratch.sums[index] - before) / total) as f32
    }

    /// Where no light seems to contribute, all are equally likely.
    #[inline]
    fn uniform_probability(&self, total: f64) -> f64 {
        if total > 0.0 && self.uniform.count() > 0 { OPTIMAL_UNIFORM_PROBABILITY } else { 1.0 }
    }

    /// Bytes held on the heap; each thread's scratch takes 12 bytes a light besides.
    pub fn memory(&self) -> usize {
        self.uniform.memory() + self.emitters.memory()
    }
}
