//! Which primitive of an emissive mesh to draw a point on, where not simply by area: by a hierarchy, where there are many, or by how bright an
//! image makes each of them.

use glam::{Affine3A, Vec3};

use super::mesh_tree::MeshTree;
use crate::geometry::Shape;
use crate::geometry::sampling::{ShapeSample, ShapeSampler};
use crate::math::alias::AliasTable;

/// A way of choosing.
#[derive(Clone, Debug)]
pub enum Parts {
    /// By place, orientation and brightness, as seen from the lit point.
    Tree(MeshTree),
    /// By brightness.
    Table(PartTable),
}

/// Primitives in proportion to area and weight. 12 bytes each.
#[derive(Clone, Debug)]
pub struct PartTable {
    table: AliasTable,
    /// How much more often than by area each is chosen.
    preferences: Box<[f32]>,
}

impl Parts {
    /// A way of choosing for the primitives of `shape`, which emits on one side or both and on each unit of area in proportion to `weights`, if
    /// there are any; `None` where choosing by area is as good.
    pub fn new(shape: &Shape, sampler: &ShapeSampler, two_sided: bool, weights: Option<&[f32]>) -> Option<Self> {
        if let Some(tree) = MeshTree::new(shape, sampler, two_sided, weights) {
            return Some(Self::Tree(tree));
        }
        let weights = weights.filter(|weights| weights.len() > 1)?;
        let mean: f64 =
            (0..).zip(weights).map(|(i, &w)| f64::from(sampler.share_by_area(shape, i)) * f64::from(w)).sum();
        let preferences: Box<[f32]> = weights.iter().map(|&weight| (f64::from(weight) / mean) as f32).collect();
        let shares: Vec<f32> = (0..).zip(&preferences).map(|(i, p)| sampler.share_by_area(shape, i) * p).collect();
        Some(Self::Table(PartTable { table: AliasTable::new(&shares)?, preferences }))
    }

    /// A point on a primitive chosen by `u_part` for the lit point `p`, in render space. See [`ShapeSampler::sample`].
    pub fn sample(
        &self,
        shape: &Shape,
        sampler: &ShapeSampler,
        to_render: Option<&Affine3A>,
        p: Vec3,
        u: [f32; 2],
        u_part: f64,
    ) -> Option<ShapeSample> {
        match self {
            Self::Tree(tree) => tree.sample(shape, sampler, to_render, p, u, u_part),
            Self::Table(PartTable { table, preferences }) => {
                let (primitive, _) = table.sample(u_part);
                let mut sample = sampler.sample_on(shape, primitive, u)?;
                sample.point.pdf_area *= preferences[primitive as usize];
                Some(sample)
            }
        }
    }

    /// How much more often than by area `primitive` is chosen for the lit point `p`.
    pub fn preference(
        &self,
        shape: &Shape,
        sampler: &ShapeSampler,
        to_render: Option<&Affine3A>,
        p: Vec3,
        primitive: u32,
    ) -> f32 {
        match self {
            Self::Tree(tree) => tree.preference(shape, sampler, to_render, p, primitive),
            Self::Table(PartTable { preferences, .. }) => preferences.get(primitive as usize).copied().unwrap_or(0.0),
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of::<Self>()
            + match self {
                Self::Tree(tree) => tree.memory(),
                Self::Table(PartTable { table, preferences }) => table.memory() + size_of_val(&**preferences),
            }
    }
}
