//! Which primitive of an emissive mesh to draw a point on: by a light hierarchy over the primitives, seen from the point that is lit. Source:
//! Conty Estevez & Kulla, HPG 2018 ([`crate::light::tree`]); that a mesh is one light with a hierarchy inside is from Li et al., DigiPro
//! 2024, section 3.1.
//!
//! The tree stands in the shape's own space and the lit point is taken there. What faces away stays away under any affine map; under one that
//! stretches, distances are estimates like the rest, and the pdf takes the same ones into account. 72 bytes a primitive, in place of 8
//! for a choice by area.

use glam::{Affine3A, Vec3};

use super::extent::primitive_normals;
use crate::geometry::sampling::{ShapeSample, ShapeSampler, patch_corners, triangle_corners};
use crate::geometry::{Shape, ShapeKind};
use crate::light::Receiver;
use crate::light::tree::node::Node;
use crate::light::tree::{LightBounds, LightTree, Parts};

/// Meshes of fewer primitives are sampled by area. A closed tube of 16 triangles gains a factor of 1.3 to 3 in variance, one of 2,000 a factor of 13 to 34,
/// for 0.15 to 0.5 µs a sample, a fraction of what its shadow ray costs; with fewer there is little to gain. Far away it pays too, because what
/// faces away is left out (`cargo test --lib light::tests::mesh_tree::figures -- --ignored --nocapture`).
pub const LEAST_PRIMITIVES: u32 = 16;

/// Primitives in a leaf: nothing is kept of one, so asking each of several would take long.
const IN_LEAF: usize = 1;

/// A hierarchy over a mesh's primitives.
#[derive(Clone, Debug)]
pub struct MeshTree {
    tree: LightTree,
    two_sided: bool,
}

/// What it stands over.
struct Primitives<'a> {
    shape: &'a Shape,
    sampler: &'a ShapeSampler,
    two_sided: bool,
    /// While the tree is built, how bright each is for its area, where they differ.
    weights: Option<&'a [f32]>,
}

impl Parts for Primitives<'_> {
    fn bounds(&self, id: u32) -> LightBounds {
        let weight = self.weights.map_or(1.0, |weights| weights[id as usize]);
        bounds(self.shape, id, self.sampler.share_by_area(self.shape, id) * weight, self.two_sided)
    }

    /// Not asked for, with one primitive in a leaf.
    fn importance(&self, id: u32, receiver: &Receiver) -> f32 {
        Node::new(&self.bounds(id), true, 0).importance(receiver)
    }
}

impl MeshTree {
    /// Over the primitives of `shape`, for light that is emitted on one side or both, in proportion to `weights` if there are any; `None` where
    /// choosing by area is as good.
    pub fn new(shape: &Shape, sampler: &ShapeSampler, two_sided: bool, weights: Option<&[f32]>) -> Option<Self> {
        let count = shape.primitive_count();
        if count < LEAST_PRIMITIVES || !matches!(shape.kind, ShapeKind::Triangles(_) | ShapeKind::Bilinear(_)) {
            return None;
        }
        // As for the choice by area, nothing is drawn from what has none.
        let is_lit = |i: &u32| weights.is_none_or(|weights| weights[*i as usize] > 0.0);
        let ids = (0..count).filter(|&i| sampler.share_by_area(shape, i) > 0.0).filter(is_lit).collect();
        let parts = Primitives { shape, sampler, two_sided, weights };
        LightTree::new(&parts, ids, count as usize, IN_LEAF).map(|tree| Self { tree, two_sided })
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
        let parts = Primitives { shape, sampler, two_sided: self.two_sided, weights: None };
        let (primitive, pmf, _) = self.tree.sample(&parts, &self.tree.root(), &receiver(to_render, p), u_part);
        let mut sample = sampler.sample_on(shape, primitive, u)?;
        sample.point.pdf_area *= pmf / sampler.share_by_area(shape, primitive);
        Some(sample)
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
        let (tree, parts) = (&self.tree, Primitives { shape, sampler, two_sided: self.two_sided, weights: None });
        let pmf_at = |place| tree.pmf(&parts, &tree.root(), place, &receiver(to_render, p));
        let pmf = tree.place(primitive).map_or(0.0, pmf_at);
        if pmf > 0.0 { pmf / sampler.share_by_area(shape, primitive) } else { 0.0 }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + self.tree.memory()
    }
}

/// The lit point in the shape's space. Its surface, if it has one, is not known here.
fn receiver(to_render: Option<&Affine3A>, p: Vec3) -> Receiver {
    Receiver::medium(to_render.map_or(p, |m| m.inverse().transform_point3(p)))
}

/// The bounds of one primitive.
fn bounds(shape: &Shape, primitive: u32, energy: f32, two_sided: bool) -> LightBounds {
    let mut corners = [Vec3::ZERO; 4];
    let corners = match &shape.kind {
        ShapeKind::Triangles(mesh) => {
            corners[..3].copy_from_slice(&triangle_corners(mesh, primitive));
            &corners[..3]
        }
        ShapeKind::Bilinear(mesh) => {
            corners = patch_corners(mesh, primitive);
            &corners[..]
        }
        _ => &corners[..1],
    };
    let fold = |of: fn(Vec3, Vec3) -> Vec3| corners.iter().copied().reduce(of).unwrap_or(Vec3::ZERO);
    let (low, high) = (fold(Vec3::min), fold(Vec3::max));
    let centre = 0.5 * low + 0.5 * high;
    let radius = corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f32::max) * (1.0 + 1e-6);
    let normals = primitive_normals(shape, primitive);
    let (axis, cos_normals) = normals.unwrap_or((Vec3::Z, -1.0));
    LightBounds {
        low,
        high,
        radius,
        axis,
        cos_normals,
        cos_emission: 0.0,
        two_sided,
        lambertian: true,
        even: false,
        energy: energy.max(f32::MIN_POSITIVE),
    }
}
