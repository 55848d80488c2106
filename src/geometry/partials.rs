//! How position changes with the texture coordinates, for bump maps: asked for only where a material has one. Source: pbrt-v4, chapter 6,
//! for the parametrisations.

use glam::{DVec3, Vec3};

use super::{Geometry, Ray, RayHit, Shape, ShapeKind, affine};

/// The partial derivatives of position by the texture coordinates, in render space; zero where the coordinates leave them undefined.
#[derive(Clone, Copy, Debug)]
pub struct Partials {
    /// ∂p/∂u.
    pub dpdu: Vec3,
    /// ∂p/∂v.
    pub dpdv: Vec3,
}

impl Shape {
    /// The partial derivatives of one primitive in the shape's space; `direction` (unit) is the ray's, for curves.
    fn partials(&self, primitive: u32, uv: [f32; 2], direction: Vec3) -> [DVec3; 2] {
        match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.partials(primitive),
            ShapeKind::Bilinear(mesh) => mesh.partials(primitive, uv),
            ShapeKind::Sphere(sphere) => sphere.partials(uv),
            ShapeKind::Disk(disk) => disk.partials(uv),
            ShapeKind::Cylinder(cylinder) => cylinder.partials(uv),
            ShapeKind::Curves(curves) => curves.partials(primitive, uv, direction),
        }
    }
}

impl Geometry {
    /// The partial derivatives at a hit. `ray` must be the ray that was traced.
    pub fn partials(&self, ray: &Ray, hit: &RayHit) -> Partials {
        let shape = &self.shapes[hit.shape.0 as usize];
        let [dpdu, dpdv] = match hit.instance {
            None => shape.partials(hit.primitive, hit.uv, ray.direction),
            Some(instance) => {
                let to_render = self.instances[instance.0 as usize].transform.at(ray.time);
                let linear = affine::linear(&to_render);
                let direction = match &shape.kind {
                    ShapeKind::Curves(_) => (linear.inverse() * ray.direction.as_dvec3()).normalize_or_zero().as_vec3(),
                    _ => Vec3::ZERO,
                };
                shape.partials(hit.primitive, hit.uv, direction).map(|derivative| linear * derivative)
            }
        };
        let finite = |v: DVec3| if v.as_vec3().is_finite() { v.as_vec3() } else { Vec3::ZERO };
        Partials { dpdu: finite(dpdu), dpdv: finite(dpdv) }
    }
}
