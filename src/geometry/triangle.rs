//! Indexed triangle meshes: the watertight intersection test, points with error bounds, normals.
//!
//! Sources: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013 (the shear and the edge functions, here
//! always in f64, where products of two f32 are exact and so is the sign of their difference); pbrt-v4 sections 6.5 and
//! 6.8.5 for derivatives and errors.

use glam::{DVec3, Vec2, Vec3};

use super::local::LocalPoint;
use crate::math::robust::gamma;

/// Triangles over shared vertices.
#[derive(Debug, Default)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three vertex numbers a triangle, all in range.
    pub indices: Vec<[u32; 3]>,
    /// Shading normals a vertex (not necessarily unit); empty for none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates a vertex; empty for none (then pbrt's default: (0,0), (1,0), (1,1)).
    pub uvs: Vec<Vec2>,
}

/// A ray's shear into the space where it runs along +z from the origin, set up once for many triangles.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    origin: Vec3,
    direction: DVec3,
    axes: [usize; 3],
    shear: [f32; 2],
    inverse_z: f64,
}

impl ShearedRay {
    /// The shear of a ray with a nonzero direction.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let magnitude = direction.abs();
        let z = if magnitude.x > magnitude.y && magnitude.x > magnitude.z {
            0
        } else if magnitude.y > magnitude.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self {
            origin,
            direction: direction.as_dvec3(),
            axes: [x, y, z],
            shear: [direction[x] / direction[z], direction[y] / direction[z]],
            inverse_z: 1.0 / f64::from(direction[z]),
        }
    }

    /// The hit with the triangle (both sides) if `t_min` < t < `t_max`, with the barycentric weights of vertices 1 and 2.
    ///
    /// Two triangles that share an edge compute the same edge function on it up to the sign, so no ray passes between.
    #[inline]
    pub fn intersect(&self, triangle: [Vec3; 3], t_min: f32, t_max: f32) -> Option<(f32, [f32; 2])> {
        let [ax, ay, az] = self.axes;
        let [sx, sy] = self.shear;
        // The vertex relative to the origin, one rounding; shared vertices round alike.
        let sheared = |p: Vec3| {
            let r = p - self.origin;
            (f64::from(r[ax] - sx * r[az]), f64::from(r[ay] - sy * r[az]), f64::from(r[az]))
        };
        let (x0, y0, z0) = sheared(triangle[0]);
        let (x1, y1, z1) = sheared(triangle[1]);
        let (x2, y2, z2) = sheared(triangle[2]);
        let e0 = x2 * y1 - y2 * x1;
        let e1 = x0 * y2 - y0 * x2;
        let e2 = x1 * y0 - y1 * x0;
        if (e0 < 0.0 || e1 < 0.0 || e2 < 0.0) && (e0 > 0.0 || e1 > 0.0 || e2 > 0.0) {
            return None;
        }
        let sum = e0 + e1 + e2;
        if sum == 0.0 || sum.is_nan() {
            return None;
        }
        // The distance to the plane in f64: its sign holds however little the origin was offset from this very triangle.
        let o = self.origin.as_dvec3();
        let [r0, r1, r2] = triangle.map(|p| p.as_dvec3() - o);
        let n = (r1 - r0).cross(r2 - r0);
        let approach = n.dot(self.direction);
        let t =
            if approach == 0.0 { (e0 * z0 + e1 * z1 + e2 * z2) / sum * self.inverse_z } else { n.dot(r0) / approach }
                as f32;
        (t > t_min && t < t_max).then(|| (t, [(e1 / sum) as f32, (e2 / sum) as f32]))
    }
}

/// The unit normal of a triangle by its winding, computed in f64; zero for degenerate triangles.
pub(super) fn winding_normal([p0, p1, p2]: [Vec3; 3]) -> Vec3 {
    let (a, b) = (p1.as_dvec3() - p0.as_dvec3(), p2.as_dvec3() - p0.as_dvec3());
    a.cross(b).normalize_or_zero().as_vec3()
}

impl TriangleMesh {
    /// The triangle's vertices.
    #[inline]
    pub fn triangle(&self, primitive: u32) -> [Vec3; 3] {
        self.indices[primitive as usize].map(|i| self.positions[i as usize])
    }

    /// The hit with one triangle, both sides; see [`ShearedRay::intersect`].
    pub fn intersect(
        &self,
        primitive: u32,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, [f32; 2])> {
        ShearedRay::new(origin, direction).intersect(self.triangle(primitive), t_min, t_max)
    }

    /// The triangle's box.
    #[inline]
    pub fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        let [a, b, c] = self.triangle(primitive);
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Whether the triangle has no area (or a vertex that is not finite): it is never hit.
    pub fn is_degenerate(&self, primitive: u32) -> bool {
        winding_normal(self.triangle(primitive)) == Vec3::ZERO
    }

    /// The interpolated shading normal, unit; `None` where the mesh has none or they cancel.
    pub(super) fn shading_normal(&self, primitive: u32, uv: [f32; 2]) -> Option<Vec3> {
        if self.normals.is_empty() {
            return None;
        }
        let [n0, n1, n2] = self.indices[primitive as usize].map(|i| self.normals[i as usize]);
        (n0 * (1.0 - uv[0] - uv[1]) + n1 * uv[0] + n2 * uv[1]).try_normalize()
    }

    /// The unit geometric normal: by the winding, put into the hemisphere of the interpolated shading normal where there is
    /// one (then the shape's `flip_normal` does not apply). `uv` are the barycentric weights of vertices 1 and 2.
    pub fn geometric_normal(&self, primitive: u32, uv: [f32; 2]) -> Vec3 {
        let n = winding_normal(self.triangle(primitive));
        match self.shading_normal(primitive, uv) {
            Some(ns) if n.dot(ns) < 0.0 => -n,
            _ => n,
        }
    }

    /// The point with barycentric weights `uv` of vertices 1 and 2, its error, and its derivatives.
    pub(super) fn point(&self, primitive: u32, uv: [f32; 2]) -> LocalPoint {
        let [p0, p1, p2] = self.triangle(primitive);
        let (b1, b2) = (uv[0], uv[1]);
        let b0 = 1.0 - b1 - b2;
        // In f64 the interpolation is exact enough that only the rounding of the result and of b0 remains.
        let p = (p0.as_dvec3() * (1.0 - f64::from(b1) - f64::from(b2))
            + p1.as_dvec3() * f64::from(b1)
            + p2.as_dvec3() * f64::from(b2))
        .as_vec3();
        // The rounding of p itself is γ_1 |p|. The rest makes room for the roundings of intersection tests in f32: a few of the
        // position, when the ray is transformed, and of the vertices relative to it.
        let extent = (p1 - p0).abs().max((p2 - p0).abs());
        let p_error = gamma(4) * p.abs() + gamma(8) * extent + Vec3::splat(f32::MIN_POSITIVE);
        let (tex, dpdu) = match self.uvs.as_slice() {
            // u rises by 1 from the first vertex to the second, and v not at all.
            [] => ([Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::ONE], p1 - p0),
            uvs => {
                let tex = self.indices[primitive as usize].map(|i| uvs[i as usize]);
                (tex, dpdu([p0, p1, p2], tex))
            }
        };
        let ng = self.geometric_normal(primitive, uv);
        let ns = self.shading_normal(primitive, uv);
        LocalPoint {
            p,
            p_error,
            ng,
            ns: ns.unwrap_or(ng),
            dpdu,
            uv: tex[0] * b0 + tex[1] * b1 + tex[2] * b2,
            authoritative_ns: ns.is_some(),
        }
    }
}

impl TriangleMesh {
    /// ∂p/∂u and ∂p/∂v of one triangle; zero where the texture coordinates are degenerate (pbrt-v4 equation 6.7).
    pub(super) fn partials(&self, primitive: u32) -> [DVec3; 2] {
        let [p0, p1, p2] = self.triangle(primitive).map(|p| p.as_dvec3());
        if self.uvs.is_empty() {
            return [p1 - p0, p2 - p1];
        }
        let [t0, t1, t2] = self.indices[primitive as usize].map(|i| self.uvs[i as usize].as_dvec2());
        let (d02, d12, p02, p12) = (t0 - t2, t1 - t2, p0 - p2, p1 - p2);
        let determinant = d02.perp_dot(d12);
        if determinant.abs() < 1e-20 {
            return [DVec3::ZERO; 2];
        }
        [(p02 * d12.y - p12 * d02.y) / determinant, (p12 * d02.x - p02 * d12.x) / determinant]
    }
}

/// ∂p/∂u of a triangle with texture coordinates; zero where they are degenerate (pbrt-v4 equation 6.7).
fn dpdu([p0, p1, p2]: [Vec3; 3], [t0, t1, t2]: [Vec2; 3]) -> Vec3 {
    let (d02, d12) = (t0 - t2, t1 - t2);
    let determinant = f64::from(d02.x) * f64::from(d12.y) - f64::from(d02.y) * f64::from(d12.x);
    if determinant.abs() < 1e-20 {
        return Vec3::ZERO;
    }
    let (p02, p12) = ((p0 - p2).as_dvec3(), (p1 - p2).as_dvec3());
    let dpdu = ((p02 * f64::from(d12.y) - p12 * f64::from(d02.y)) / determinant).as_vec3();
    if dpdu.is_finite() { dpdu } else { Vec3::ZERO }
}
