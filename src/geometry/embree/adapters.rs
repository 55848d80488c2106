//! Shapes and opacity as the traits that `ffi/embree` calls back.

use std::sync::Arc;

use ::embree::{Candidate, Filter, UserGeometry, UserHit};

use super::shape_uv;
use crate::geometry::trace::Opacity;
use crate::geometry::{Geometry, Shape, ShapeId};

/// A shape that intersects its own primitives.
pub(super) struct ShapePrimitives {
    pub geometry: Arc<Geometry>,
    pub shape: ShapeId,
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
        (low.is_finite() && high.is_finite()).then(|| (low.to_array(), high.to_array()))
    }

    fn intersect(
        &self,
        primitive: u32,
        origin: [f32; 3],
        direction: [f32; 3],
        t_min: f32,
        t_max: f32,
    ) -> Option<UserHit> {
        let found = self.shape().intersect(primitive, origin.into(), direction.into(), t_min, t_max);
        found.map(|(t, uv)| UserHit { t, uv })
    }
}

/// The opacity of one shape.
pub(super) struct ShapeOpacity {
    pub geometry: Arc<Geometry>,
    pub shape: ShapeId,
    pub opacity: Arc<dyn Opacity>,
}

impl Filter for ShapeOpacity {
    fn accept(&self, candidate: &Candidate) -> bool {
        let uv = shape_uv(&self.geometry.shapes[self.shape.0 as usize], candidate.hit.uv);
        self.opacity.is_opaque(&self.geometry, self.shape, candidate.hit.primitive, uv, candidate.ray_id)
    }
}
