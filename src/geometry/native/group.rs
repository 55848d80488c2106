//! All primitives of some shapes that share one space, under one hierarchy.

use glam::Vec3;

use super::super::trace::{BOUNDARY_T_MIN, Opacity, PrimitivePoint, TraceError};
use super::super::triangle::ShearedRay;
use super::super::{Geometry, InstanceId, Shape, ShapeId, ShapeKind};
use super::bvh::{BoxRay, Bvh};

/// A primitive as the leaves hold it: triangles with their vertices, so that a test reads one place in memory.
#[derive(Clone, Copy)]
enum Leaf {
    Triangle { vertices: [Vec3; 3], shape: u32, primitive: u32 },
    Other { shape: u32, primitive: u32 },
}

/// The hit of a ray within a group.
#[derive(Clone, Copy)]
pub(super) struct LocalHit {
    pub t: f32,
    pub shape: ShapeId,
    pub primitive: u32,
    pub uv: [f32; 2],
}

/// A ray in the group's space; t is measured in the direction's length.
pub(super) struct LocalRay {
    pub origin: Vec3,
    pub direction: Vec3,
    boxes: BoxRay,
    sheared: ShearedRay,
}

impl LocalRay {
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, boxes: BoxRay::new(origin, direction), sheared: ShearedRay::new(origin, direction) }
    }

    pub(super) fn boxes(&self) -> &BoxRay {
        &self.boxes
    }
}

/// Who decides about alpha for one ray.
#[derive(Clone, Copy)]
pub(super) struct Mask<'a> {
    pub geometry: &'a Geometry,
    pub opacity: Option<&'a dyn Opacity>,
    pub instance: Option<InstanceId>,
    pub seed: u32,
}

impl Mask<'_> {
    fn stops(&self, hit: &LocalHit) -> bool {
        match self.opacity {
            Some(opacity) if self.geometry.shapes[hit.shape.0 as usize].has_opacity() => {
                let LocalHit { shape, primitive, uv, .. } = *hit;
                let at = PrimitivePoint { shape, instance: self.instance, primitive, uv };
                opacity.is_opaque(self.geometry, &at, self.seed)
            }
            _ => true,
        }
    }
}

pub(super) struct Group {
    bvh: Bvh<Leaf>,
    /// Around everything; `None` when empty.
    bounds: Option<(Vec3, Vec3)>,
}

impl Group {
    /// Over the given shapes. Triangles without area are left out; the numbers of the rest stay.
    pub(super) fn build(geometry: &Geometry, shapes: &[ShapeId]) -> Result<Self, TraceError> {
        let mut leaves = Vec::new();
        let mut boxes = Vec::new();
        for &ShapeId(id) in shapes {
            let shape: &Shape = &geometry.shapes[id as usize];
            for primitive in 0..shape.primitive_count() {
                let leaf = match &shape.kind {
                    ShapeKind::Triangles(mesh) if mesh.is_degenerate(primitive) => continue,
                    ShapeKind::Triangles(mesh) => {
                        Leaf::Triangle { vertices: mesh.triangle(primitive), shape: id, primitive }
                    }
                    _ => Leaf::Other { shape: id, primitive },
                };
                leaves.push(leaf);
                boxes.push(shape.bounds(primitive));
            }
        }
        let bounds = boxes.iter().copied().reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
        Ok(Self { bvh: Bvh::build(&leaves, &boxes)?, bounds })
    }

    pub(super) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    pub(super) fn memory(&self) -> usize {
        self.bvh.memory()
    }

    /// The closest hit before `t_max` that `mask` lets stop the ray.
    pub(super) fn closest(&self, ray: &LocalRay, t_max: f32, mask: &Mask) -> Option<LocalHit> {
        let mut best = None;
        let mut limit = t_max;
        self.bvh.walk(&ray.boxes, &mut limit, |leaf, limit| {
            if let Some(hit) = leaf.first(ray, *limit, mask) {
                *limit = hit.t;
                best = Some(hit);
            }
            false
        });
        best
    }

    /// Whether anything that `mask` lets stop the ray lies before `t_max`.
    pub(super) fn occluded(&self, ray: &LocalRay, t_max: f32, mask: &Mask) -> bool {
        let mut limit = t_max;
        self.bvh.walk(&ray.boxes, &mut limit, |leaf, limit| leaf.first(ray, *limit, mask).is_some())
    }

    /// Every hit of boundaries in [0, `t_max`), in no order; opacity is not asked.
    pub(super) fn all(&self, geometry: &Geometry, ray: &LocalRay, t_max: f32, mut report: impl FnMut(LocalHit)) {
        let mut limit = t_max;
        self.bvh.walk(&ray.boxes, &mut limit, |leaf, limit| {
            let mut start = BOUNDARY_T_MIN;
            while let Some(hit) = leaf.intersect(geometry, ray, start, *limit) {
                start = hit.t;
                report(hit);
                if matches!(leaf, Leaf::Triangle { .. }) {
                    break;
                }
            }
            false
        });
    }
}

impl Leaf {
    #[inline]
    fn intersect(&self, geometry: &Geometry, ray: &LocalRay, t_min: f32, t_max: f32) -> Option<LocalHit> {
        match *self {
            Self::Triangle { vertices, shape, primitive } => ray
                .sheared
                .intersect(vertices, t_min, t_max)
                .map(|(t, uv)| LocalHit { t, shape: ShapeId(shape), primitive, uv }),
            Self::Other { shape, primitive } => geometry.shapes[shape as usize]
                .intersect(primitive, ray.origin, ray.direction, t_min, t_max)
                .map(|(t, uv)| LocalHit { t, shape: ShapeId(shape), primitive, uv }),
        }
    }

    /// The first hit in (0, `t_max`) that stops the ray. A transparent front of a sphere leaves its back to be asked.
    #[inline]
    fn first(&self, ray: &LocalRay, t_max: f32, mask: &Mask) -> Option<LocalHit> {
        let mut start = 0.0;
        loop {
            let hit = self.intersect(mask.geometry, ray, start, t_max)?;
            if mask.stops(&hit) {
                return Some(hit);
            }
            if matches!(self, Self::Triangle { .. }) {
                return None;
            }
            start = hit.t;
        }
    }
}
