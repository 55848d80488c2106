//! Shapes and opacity as the traits that `ffi/embree` calls back.

use std::sync::{Arc, OnceLock};

use ::embree::{Candidate, Filter, UserGeometry, UserHit};
use glam::Vec3;

use super::scale::Scale;
use super::shape_uv;
use crate::geometry::trace::{BOUNDARY_T_MIN, Opacity, PrimitivePoint};
use crate::geometry::{Geometry, InstanceId, Shape, ShapeId};

/// A shape that intersects its own primitives, in its own units.
pub(super) struct ShapePrimitives {
    pub geometry: Arc<Geometry>,
    pub shape: ShapeId,
    /// That of the shape's space.
    pub scale: Scale,
    /// That of render space, in which distances are.
    pub render: Scale,
}

impl ShapePrimitives {
    fn shape(&self) -> &Shape {
        &self.geometry.shapes[self.shape.0 as usize]
    }
}

impl UserGeometry for ShapePrimitives {
    fn len(&self) -> u32 {
        self.shape().primitive_count()
    }

    fn bounds(&self, primitive: u32) -> Option<([f32; 3], [f32; 3])> {
        let (low, high) = self.shape().bounds(primitive);
        let scaled = |corner: Vec3| (corner * self.scale.to_embree).to_array();
        (low.is_finite() && high.is_finite()).then(|| (scaled(low), scaled(high)))
    }

    fn intersect(
        &self,
        primitive: u32,
        origin: [f32; 3],
        direction: [f32; 3],
        t_min: f32,
        t_max: f32,
    ) -> Option<UserHit> {
        let shape = self.shape();
        // As Embree's own triangles: a boundary is crossed where the ray begins. Asked for the next hit, it begins at a larger number.
        let is_start = shape.is_boundary && t_min.to_bits() == 0;
        let t_min = if is_start { BOUNDARY_T_MIN } else { t_min * self.render.from_embree };
        let origin = Vec3::from(origin) * self.scale.from_embree;
        let direction = Vec3::from(direction) * (self.scale.from_embree * self.render.to_embree);
        let found = shape.intersect(primitive, origin, direction, t_min, t_max * self.render.from_embree);
        found.map(|(t, uv)| UserHit { t: t * self.render.to_embree, uv })
    }
}

/// The instance of each geometry number of the render-space scene; set once that is built.
pub(super) type InstanceNumbers = OnceLock<Vec<Option<InstanceId>>>;

/// The opacity of one shape.
pub(super) struct ShapeOpacity {
    pub instances: Arc<InstanceNumbers>,
    pub geometry: Arc<Geometry>,
    pub shape: ShapeId,
    pub opacity: Arc<dyn Opacity>,
}

impl Filter for ShapeOpacity {
    fn accept(&self, candidate: &Candidate) -> bool {
        let uv = shape_uv(&self.geometry.shapes[self.shape.0 as usize], candidate.hit.uv);
        let number = candidate.hit.instance.zip(self.instances.get());
        let instance = number.and_then(|(number, instances)| instances[number as usize]);
        let at = PrimitivePoint { shape: self.shape, instance, primitive: candidate.hit.primitive, uv };
        self.opacity.is_opaque(&self.geometry, &at, candidate.ray_id)
    }
}
