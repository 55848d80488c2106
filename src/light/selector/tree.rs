//! Lights by a hierarchy: a choice costs as many steps as the tree is deep, and takes position and orientation into account. Source:
//! Conty Estevez & Kulla, HPG 2018 ([`crate::light::tree`]).
//!
//! Light from infinity is not in the tree. It is chosen in proportion to its contribution against the importance of the cut through the tree,
//! and where there are several draws it has one of its own.

use super::SelectorScratch;
use crate::light::tree::LightTree;
use crate::light::tree::split::Splitting;
use crate::light::{LightId, LightRef, Lights, Receiver};

/// How readily nodes are split where nothing else is asked for. In the fog of the scene `pier`, error² × processor time is the same from 0 to
/// 0.7 and a tenth more at 0.8; over a floor with 5,000 lamps it falls by a factor of 5.5 from 0 to 0.7, of 6 to 0.8 (8 samples a pixel, median of four pairs of seeds).
pub const DEFAULT_SPLITTING: f32 = 0.7;

/// The share of light from infinity that is chosen evenly, and the least that it has against the tree: its contribution is an estimate that
/// may be 0 where there is light. As much is left to the tree.
const FLOOR: f32 = 0.01;

/// In proportion to what a hierarchy knows.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Over the finite lights, if there are any that shine.
    tree: Option<LightTree>,
    /// Those from infinity that shine, in order.
    outside: Box<[LightId]>,
    splitting: Splitting,
}

impl Tree {
    /// For the lights that are not dark.
    pub fn new(lights: &Lights) -> Self {
        let is_outside = |&id: &LightId| matches!(lights.get(id), LightRef::Distant(_) | LightRef::Infinite(_));
        let outside = lights.ids().filter(is_outside).filter(|&id| !lights.is_dark(id)).collect();
        Self { tree: LightTree::of(lights), outside, splitting: Splitting::new(DEFAULT_SPLITTING) }
    }

    /// The same with another number in 0..=1 for splitting: 0 draws one light at every vertex, 1 draws all of them (64 at most).
    #[must_use]
    pub fn with_splitting(self, splitting: f32) -> Self {
        Self { splitting: Splitting::new(splitting), ..self }
    }

    /// Cuts the tree, and weighs light from infinity against it.
    #[inline]
    pub fn prepare(&self, lights: &Lights, receiver: &Receiver, scratch: &mut SelectorScratch) {
        scratch.receiver = Some(*receiver);
        match &self.tree {
            Some(tree) => scratch.cut.make(tree, lights, receiver, self.splitting),
            None => scratch.cut.clear(),
        }
        scratch.tree_share = 1.0;
        if !self.outside.is_empty() {
            let outside = self.weigh(lights, receiver, scratch);
            let inside = scratch.cut.importance();
            scratch.tree_share = (inside / (inside + outside)).clamp(FLOOR, 1.0 - FLOOR);
        }
    }

    /// The running sums of the weights of light from infinity; returns its contribution.
    fn weigh(&self, lights: &Lights, receiver: &Receiver, scratch: &mut SelectorScratch) -> f32 {
        let SelectorScratch { weights, sums, .. } = scratch;
        weights.clear();
        weights.extend(self.outside.iter().map(|&id| lights.contribution(id, receiver)));
        let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let floor = (total * f64::from(FLOOR)).max(f64::from(f32::MIN_POSITIVE)) / weights.len() as f64;
        sums.clear();
        let mut sum = 0.0;
        sums.extend(weights.iter().map(|&weight| {
            sum += f64::from(weight) + floor;
            sum
        }));
        total.min(f64::from(f32::MAX / 4.0)) as f32
    }

    /// Those of the cut, and one for light from infinity where that cannot share the only one.
    #[inline]
    pub fn draws(&self, scratch: &SelectorScratch) -> u32 {
        let draws = scratch.cut.draws();
        draws + u32::from(draws != 1 && !self.outside.is_empty())
    }

    /// A light, its probability, and what is left of `u`. `None` where nothing contributes.
    #[inline]
    pub fn sample(
        &self,
        lights: &Lights,
        draw: u32,
        mut u: f64,
        scratch: &SelectorScratch,
    ) -> Option<(LightId, f32, f64)> {
        let (Some(tree), Some(receiver)) = (&self.tree, &scratch.receiver) else {
            return self.sample_outside(u, 1.0, scratch);
        };
        if draw >= scratch.cut.draws() {
            return self.sample_outside(u, 1.0, scratch);
        }
        let mut share = 1.0;
        if scratch.cut.draws() == 1 && scratch.tree_share < 1.0 {
            share = scratch.tree_share;
            let split = f64::from(share);
            if u >= split {
                return self.sample_outside((u - split) / (1.0 - split), 1.0 - share, scratch);
            }
            u /= split;
        }
        let (id, pmf, rest) = scratch.cut.sample(tree, lights, receiver, draw, u.min(1.0 - f64::EPSILON))?;
        Some((LightId(id), share * pmf, rest))
    }

    fn sample_outside(&self, u: f64, share: f32, scratch: &SelectorScratch) -> Option<(LightId, f32, f64)> {
        let target = u.min(1.0 - f64::EPSILON) * scratch.sums.last()?;
        let index = scratch.sums.partition_point(|&sum| sum <= target);
        let id = *self.outside.get(index)?;
        let before = if index > 0 { scratch.sums[index - 1] } else { 0.0 };
        let rest = (target - before) / (scratch.sums[index] - before);
        Some((id, share * self.outside_pmf(index, scratch), rest.clamp(0.0, 1.0 - f64::EPSILON)))
    }

    /// The probability of a light from infinity among its like.
    #[inline]
    fn outside_pmf(&self, index: usize, scratch: &SelectorScratch) -> f32 {
        let sums = &scratch.sums;
        let before = if index > 0 { sums[index - 1] } else { 0.0 };
        ((sums[index] - before) / sums[sums.len() - 1]) as f32
    }

    /// How often the draws are expected to choose `id`.
    #[inline]
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &SelectorScratch) -> f32 {
        let is_shared = scratch.cut.draws() == 1;
        if let (Some(tree), Some(receiver)) = (&self.tree, &scratch.receiver)
            && let Some(place) = tree.place(id.0)
        {
            let share = if is_shared { scratch.tree_share } else { 1.0 };
            return share * scratch.cut.pmf(tree, lights, receiver, place);
        }
        match self.outside.binary_search(&id) {
            Ok(index) if index < scratch.sums.len() => {
                let share = if is_shared { 1.0 - scratch.tree_share } else { 1.0 };
                share * self.outside_pmf(index, scratch)
            }
            _ => 0.0,
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.tree.as_ref().map_or(0, LightTree::memory) + size_of_val(&*self.outside)
    }
}
