//! Every light with the same probability. Nothing is stored unless some lights are dark.

use crate::light::{LightId, Lights};

/// Every light alike.
#[derive(Clone, Debug)]
pub struct Uniform {
    count: u32,
    /// The lights that shine, in order, where not all do.
    live: Option<Box<[LightId]>>,
}

impl Uniform {
    /// For the lights that are not dark, of which there must be some; `dark` are.
    pub fn new(lights: &Lights, dark: usize) -> Self {
        let live = (dark > 0).then(|| lights.ids().filter(|&id| !lights.is_dark(id)).collect());
        Self { count: (lights.len() - dark) as u32, live }
    }

    /// For all lights that shine, of which there must be some.
    pub fn of_shining(lights: &Lights) -> Self {
        Self::new(lights, lights.ids().filter(|&id| lights.is_dark(id)).count())
    }

    /// A light, its probability, and what is left of `u`.
    #[inline]
    pub fn sample(&self, u: f64) -> (LightId, f32, f64) {
        let scaled = u * f64::from(self.count);
        let index = (scaled as u32).min(self.count - 1);
        let id = self.live.as_ref().map_or(LightId(index), |live| live[index as usize]);
        (id, 1.0 / self.count as f32, (scaled - f64::from(index)).clamp(0.0, 1.0 - f64::EPSILON))
    }

    /// The probability of `id`.
    #[inline]
    pub fn pmf(&self, id: LightId) -> f32 {
        let shines = match &self.live {
            None => id.0 < self.count,
            Some(live) => live.binary_search(&id).is_ok(),
        };
        if shines { 1.0 / self.count as f32 } else { 0.0 }
    }

    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.live.as_ref().map_or(0, |live| size_of_val(&**live))
    }
}
