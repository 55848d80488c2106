//! Lights in proportion to the luminance of their power, in O(1) by an alias table. 12 bytes a light.

use crate::light::{LightId, Lights};
use crate::math::alias::AliasTable;
use crate::scene::Warnings;

/// In proportion to power.
#[derive(Clone, Debug)]
pub struct Power {
    table: AliasTable,
    pmf: Box<[f32]>,
}

/// No light that shines is chosen less often than this share of an even choice: its power may round to nothing beside a sun's.
pub const POWER_FLOOR: f64 = 1e-6;

impl Power {
    /// For all lights; `None` where their power is not known to be positive and finite (an infinite light without scene bounds).
    pub fn new(lights: &Lights, warnings: &mut Warnings) -> Option<Self> {
        let mut weights: Vec<f32> = lights.ids().map(|id| lights.power(id).luminance().clamp(0.0, f32::MAX)).collect();
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if total <= 0.0 {
            warnings.add(None, "the lights' power is not known (no scene bounds): they are chosen uniformly");
            return None;
        }
        let floor = POWER_FLOOR / lights.len() as f64;
        for (weight, id) in weights.iter_mut().zip(lights.ids()) {
            *weight = if lights.is_dark(id) { 0.0 } else { (f64::from(*weight) / total).max(floor) as f32 };
        }
        let table = AliasTable::new(&weights)?;
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        weights.iter_mut().for_each(|w| *w = (f64::from(*w) / total) as f32);
        Some(Self { table, pmf: weights.into() })
    }

    /// A light, its probability, and what is left of `u`.
    #[inline]
    pub fn sample(&self, u: f64) -> (LightId, f32, f64) {
        let (index, rest) = self.table.sample(u);
        (LightId(index), self.pmf[index as usize], rest)
    }

    /// The probability of `id`.
    #[inline]
    pub fn pmf(&self, id: LightId) -> f32 {
        self.pmf.get(id.0 as usize).copied().unwrap_or(0.0)
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.table.memory() + size_of_val(&*self.pmf)
    }
}
