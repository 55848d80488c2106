//! From a hit to a surface point: position recomputed from the primitive with its error bound, oriented normals, tangent.
//!
//! Sources: pbrt-v4 section 6.8 (errors), and its rules of orientation: the parametrisation's normal, turned by the shape's
//! flip; where a mesh has normals of its own the geometric normal follows those instead. Curves that face the ray have
//! normals back along it and no flip. Instances transform normals by the inverse transpose.

use glam::Vec3;

use super::local::LocalPoint;
use super::trace::PrimitivePoint;
use super::{Geometry, InstanceId, Ray, RayHit, Shape, ShapeKind, SurfacePoint, affine};

/// By how much a tracer's own interpolation of a rotation may differ from [`super::MotionTransform`], relative to the distance from the
/// origin that is turned about. Embree's is fitted to a few millionths; a point off by more than its bound would shadow
/// itself.
const MOTION_ERROR: f32 = 1e-5;

impl Shape {
    /// The point of a primitive in the shape's space, oriented. `direction` (unit) is the ray's, for curves.
    pub(super) fn point(&self, primitive: u32, uv: [f32; 2], direction: Vec3) -> LocalPoint {
        let mut point = match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.point(primitive, uv),
            ShapeKind::Bilinear(mesh) => mesh.point(primitive, uv),
            ShapeKind::Sphere(sphere) => sphere.point(uv),
            ShapeKind::Disk(disk) => disk.point(uv),
            ShapeKind::Cylinder(cylinder) => cylinder.point(uv),
            ShapeKind::Curves(curves) => curves.point(primitive, uv, direction),
        };
        if self.flip_normal && !point.authoritative_ns {
            point.ng = -point.ng;
            point.ns = -point.ns;
        }
        point
    }

    /// The oriented unit geometric normal in the shape's space: the flip applied, or towards the mesh's own normals.
    /// `direction` is the ray's in that space (any length), for curves. Zero for degenerate primitives.
    pub fn oriented_normal(&self, primitive: u32, uv: [f32; 2], direction: Vec3) -> Vec3 {
        let (n, follows_shading) = match &self.kind {
            ShapeKind::Triangles(mesh) => {
                (mesh.geometric_normal(primitive, uv), mesh.shading_normal(primitive, uv).is_some())
            }
            ShapeKind::Bilinear(mesh) => (mesh.normal(primitive, uv), mesh.shading_normal(primitive, uv).is_some()),
            ShapeKind::Sphere(sphere) => (sphere.normal(uv), false),
            ShapeKind::Disk(disk) => (disk.normal(), false),
            ShapeKind::Cylinder(cylinder) => (cylinder.normal(uv), false),
            ShapeKind::Curves(_) => return self.point(primitive, uv, direction.normalize_or_zero()).ng,
        };
        if self.flip_normal && !follows_shading { -n } else { n }
    }
}

impl Geometry {
    /// Where a point of a primitive is in render space when the shutter's interval begins, and its unit geometric normal; for curves, which face the
    /// ray, roughly.
    pub fn place(&self, at: &PrimitivePoint) -> (Vec3, Vec3) {
        let LocalPoint { p, ng, .. } = self.shapes[at.shape.0 as usize].point(at.primitive, at.uv, Vec3::Z);
        let Some(InstanceId(instance)) = at.instance else { return (p, ng) };
        let to_render = self.instances[instance as usize].transform.at(0.0);
        (to_render.transform_point3(p), affine::normal(&to_render, ng.as_dvec3()))
    }

    /// The surface at a hit, with everything shading needs. `ray` must be the ray that was traced.
    pub fn surface_point(&self, ray: &Ray, hit: &RayHit) -> SurfacePoint {
        let shape = &self.shapes[hit.shape.0 as usize];
        let point = match hit.instance {
            None => shape.point(hit.primitive, hit.uv, ray.direction),
            Some(InstanceId(instance)) => {
                let transform = &self.instances[instance as usize].transform;
                let to_render = transform.at(ray.time);
                let direction = match &shape.kind {
                    ShapeKind::Curves(_) => {
                        let local = affine::linear(&to_render).inverse() * ray.direction.as_dvec3();
                        local.normalize_or_zero().as_vec3()
                    }
                    // Only what faces the ray asks for its direction.
                    _ => Vec3::ZERO,
                };
                let point = shape.point(hit.primitive, hit.uv, direction);
                let (p, mut p_error) = affine::point_with_error(&to_render, point.p, point.p_error);
                if transform.is_moving() {
                    let from_pivot = affine::linear(&to_render) * point.p.as_dvec3();
                    p_error += Vec3::splat(MOTION_ERROR * from_pivot.length() as f32);
                }
                LocalPoint {
                    p,
                    p_error,
                    ng: affine::normal(&to_render, point.ng.as_dvec3()),
                    ns: affine::normal(&to_render, point.ns.as_dvec3()),
                    dpdu: affine::vector(&to_render, point.dpdu.as_dvec3()),
                    ..point
                }
            }
        };
        SurfacePoint {
            p: point.p,
            p_error: point.p_error,
            ng: point.ng,
            ns: if point.ns.dot(point.ng) < 0.0 { -point.ns } else { point.ns },
            dpdu: point.dpdu,
            uv: point.uv,
            shape: hit.shape,
            primitive: hit.primitive,
            instance: hit.instance,
        }
    }
}
