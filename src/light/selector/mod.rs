//! Choosing lights at a path vertex. Every way of choosing is a variant of [`LightSelector`] and answers the same calls: `prepare` for a
//! receiver, `sample` for each of its `draws`, and `pmf`. What a vertex needs lives in a [`SelectorScratch`] that each thread
//! keeps, so nothing is allocated per vertex.

pub mod optimal;
pub mod power;
pub mod tree;
pub mod uniform;

use super::tree::Cut;
use super::{LightId, Lights, Receiver};
use crate::scene::Warnings;

pub use optimal::Optimal;
pub use power::Power;
pub use tree::Tree;
pub use uniform::Uniform;

/// The ways of choosing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SelectorKind {
    /// Every light alike.
    Uniform,
    /// In proportion to emitted power.
    Power,
    /// In proportion to each light's unoccluded contribution at the vertex.
    Optimal,
    /// By a hierarchy over the lights, in proportion to bounds of their unoccluded contribution at the vertex.
    Tree,
}

/// A way of choosing, prepared for a scene.
#[derive(Debug)]
pub enum LightSelector {
    /// There is no light.
    None,
    /// There is one light.
    Single(LightId),
    /// See [`SelectorKind::Uniform`].
    Uniform(Uniform),
    /// See [`SelectorKind::Power`].
    Power(Power),
    /// See [`SelectorKind::Optimal`].
    Optimal(Box<Optimal>),
    /// See [`SelectorKind::Tree`].
    Tree(Box<Tree>),
}

/// What a selector works out for one vertex. One per thread, reused.
#[derive(Clone, Debug, Default)]
pub struct SelectorScratch {
    /// The lights' weights.
    pub(super) weights: Vec<f32>,
    /// Their running sums.
    pub(super) sums: Vec<f64>,
    /// The vertex, for selectors that ask again for each draw.
    pub(super) receiver: Option<Receiver>,
    /// The nodes of the light tree that lights are drawn from.
    pub(super) cut: Cut,
    /// The probability of the lights in the tree, where the others have no draw of their own.
    pub(super) tree_share: f32,
}

impl LightSelector {
    /// The selector of this kind for `lights`. Dark lights are left out, with a warning at the first of them. One light needs no structure.
    pub fn build(kind: SelectorKind, lights: &Lights, warnings: &mut Warnings) -> Self {
        let dark = lights.ids().filter(|&id| lights.is_dark(id)).count();
        if dark > 0 {
            let message = format!("{dark} of {} lights emit nothing and are never sampled", lights.len());
            warnings.add(lights.dark_places().first().copied(), message);
        }
        let mut live = lights.ids().filter(|&id| !lights.is_dark(id));
        match (live.next(), live.next()) {
            (None, _) => Self::None,
            (Some(only), None) => Self::Single(only),
            _ => match kind {
                SelectorKind::Uniform => Self::Uniform(Uniform::new(lights, dark)),
                SelectorKind::Power => {
                    Power::new(lights, warnings).map_or_else(|| Self::Uniform(Uniform::new(lights, dark)), Self::Power)
                }
                SelectorKind::Optimal => Self::Optimal(Box::new(Optimal::new(lights, dark))),
                SelectorKind::Tree => Self::Tree(Box::new(Tree::new(lights))),
            },
        }
    }

    /// The same selector with this number in 0..=1 for how readily the light tree draws several lights: see [`Tree::with_splitting`].
    #[must_use]
    pub fn with_splitting(self, splitting: f32) -> Self {
        match self {
            Self::Tree(tree) => Self::Tree(Box::new(tree.with_splitting(splitting))),
            other => other,
        }
    }

    /// Works out what `sample` and `pmf` need at `receiver`: nothing where choices do not depend on the vertex.
    #[inline]
    pub fn prepare(&self, lights: &Lights, receiver: &Receiver, scratch: &mut SelectorScratch) {
        match self {
            Self::Optimal(optimal) => optimal.prepare(lights, receiver, scratch),
            Self::Tree(tree) => tree.prepare(lights, receiver, scratch),
            Self::None | Self::Single(_) | Self::Uniform(_) | Self::Power(_) => {}
        }
    }

    /// How many lights to draw at the receiver last prepared: one, or more where a way of choosing finds that it pays.
    #[inline]
    pub fn draws(&self, scratch: &SelectorScratch) -> u32 {
        match self {
            Self::Tree(tree) => tree.draws(scratch),
            _ => 1,
        }
    }

    /// The light of draw number `draw`, its probability, and a number in [0, 1) that is uniform given the light (for choosing a part of it). `u` in [0, 1)
    /// is f64 because millions of lights use up an f32's 24 bits: see [`choice`].
    #[inline]
    pub fn sample(&self, lights: &Lights, draw: u32, u: f64, scratch: &SelectorScratch) -> Option<(LightId, f32, f64)> {
        debug_assert!(draw < self.draws(scratch));
        match self {
            Self::None => None,
            Self::Single(only) => Some((*only, 1.0, u)),
            Self::Uniform(uniform) => Some(uniform.sample(u)),
            Self::Power(power) => Some(power.sample(u)),
            Self::Optimal(optimal) => optimal.sample(u, scratch),
            Self::Tree(tree) => tree.sample(lights, draw, u, scratch),
        }
    }

    /// How often the draws at the receiver last prepared are expected to choose `id`: a probability where there is one draw.
    #[inline]
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &SelectorScratch) -> f32 {
        match self {
            Self::None => 0.0,
            Self::Single(only) => f32::from(u8::from(*only == id)),
            Self::Uniform(uniform) => uniform.pmf(id),
            Self::Power(power) => power.pmf(id),
            Self::Optimal(optimal) => optimal.pmf(id, scratch),
            Self::Tree(tree) => tree.pmf(lights, id, scratch),
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        match self {
            Self::None | Self::Single(_) => 0,
            Self::Uniform(uniform) => uniform.memory(),
            Self::Power(power) => power.memory(),
            Self::Optimal(optimal) => optimal.memory(),
            Self::Tree(tree) => tree.memory(),
        }
    }
}

/// One number of 48 random bits from two of 24: `first` keeps its stratification, `second` fills in below it and so serves as
/// the number that chooses a part of the light.
#[inline]
pub fn choice(first: f32, second: f32) -> f64 {
    f64::from(first) + f64::from(second) * (1.0 / 16_777_216.0)
}
