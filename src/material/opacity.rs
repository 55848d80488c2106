//! Stochastic opacity: `alpha` as the probability that a surface is there for a ray.

use glam::{Vec2, Vec3};

use super::footprint::Footprint;
use super::{Materials, TexturePoint};
use crate::geometry::Geometry;
use crate::geometry::shape::ShapeKind;
use crate::geometry::trace::{Opacity, PrimitivePoint};
use crate::math::sampler::mix;

impl Opacity for Materials {
    fn is_opaque(&self, geometry: &Geometry, at: &PrimitivePoint, opacity_seed: u32) -> bool {
        let shape = &geometry.shapes[at.shape.0 as usize];
        let Some(alpha) = shape.alpha.and_then(|alpha| self.alphas.get(alpha as usize)) else { return true };
        // A pattern in space stays with a moving object: it is that of the place where the object starts.
        let (p, n) = if alpha.is_spatial { geometry.place(at) } else { (Vec3::ZERO, Vec3::Z) };
        let uv = texture_coordinates(&shape.kind, at.primitive, at.uv);
        let alpha = alpha.input.evaluate(&self.textures, &TexturePoint { p, n, uv, footprint: Footprint::NONE });
        if alpha >= 1.0 {
            return true;
        }
        let threshold = (address(at, &shape.kind, opacity_seed) >> 40) as f32 * (1.0 / 16_777_216.0);
        threshold < alpha
    }
}

/// How finely the parameters of a primitive tell its crossings apart.
const CELLS: f32 = 64.0;

/// A hash of the crossing, so that asked again, the answer is the same. A ray crosses a flat triangle once, but the front and the back of
/// a sphere are both the same primitive: there the place counts too, coarsely, since backends agree on it only up to rounding.
fn address(at: &PrimitivePoint, kind: &ShapeKind, opacity_seed: u32) -> u64 {
    let instance = at.instance.map_or(0, |instance| instance.0.wrapping_add(1));
    let cell = match kind {
        ShapeKind::Triangles(_) => 0,
        _ => {
            let [u, v] = at.uv.map(|x| (x * CELLS) as u64);
            u << 32 | v
        }
    };
    let mut hash = mix(u64::from(opacity_seed) << 32 | u64::from(at.shape.0));
    hash = mix(hash ^ (u64::from(instance) << 32 | u64::from(at.primitive)));
    if cell == 0 { hash } else { mix(hash ^ cell) }
}

/// The texture coordinates at a primitive's own parameters `uv` (as in [`crate::geometry::RayHit::uv`]).
fn texture_coordinates(kind: &ShapeKind, primitive: u32, uv: [f32; 2]) -> Vec2 {
    let [u, v] = uv;
    match kind {
        ShapeKind::Triangles(mesh) => {
            let weights = [1.0 - u - v, u, v];
            if mesh.uvs.is_empty() {
                // pbrt's default: (0,0), (1,0), (1,1).
                return Vec2::new(u + v, v);
            }
            let corners = mesh.indices[primitive as usize].map(|i| mesh.uvs[i as usize]);
            corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
        }
        ShapeKind::Bilinear(mesh) => {
            if mesh.uvs.is_empty() {
                return Vec2::new(u, v);
            }
            let [a, b, c, d] = mesh.indices[primitive as usize].map(|i| mesh.uvs[i as usize]);
            a.lerp(b, u).lerp(c.lerp(d, u), v)
        }
        ShapeKind::Sphere(_) | ShapeKind::Disk(_) | ShapeKind::Cylinder(_) => Vec2::new(u, v),
        ShapeKind::Curves(curves) => {
            let [start, end] = curves.parameters[primitive as usize];
            Vec2::new(start + (end - start) * v, u)
        }
    }
}
