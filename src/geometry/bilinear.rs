//! Bilinear patches. Source: Reshetov, "Cool Patches: A Geometric Approach to Ray/Bilinear Patch Intersections", Ray Tracing
//! Gems (2019), chapter 8; pbrt-v4 section 6.6 for the parametrisation and the normals. Intersection works in f64 on
//! vertices relative to the ray's origin.

use glam::{DVec3, Vec2, Vec3};

use super::local::LocalPoint;
use crate::math::robust::gamma;

/// Bilinear patches over shared vertices. A patch's four vertices are at (u, v) = (0,0), (1,0), (0,1), (1,1).
#[derive(Debug, Default)]
pub struct BilinearMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Four vertex numbers a patch, all in range.
    pub indices: Vec<[u32; 4]>,
    /// Shading normals a vertex; empty for none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates a vertex; empty for none (then (u, v) itself).
    pub uvs: Vec<Vec2>,
}

/// How far outside [0, 1] a parameter may be: neighbours overlap by this much rather than leave a gap.
const SLACK: f64 = 1e-9;

impl BilinearMesh {
    /// The patch's vertices at (0,0), (1,0), (0,1), (1,1).
    #[inline]
    pub fn patch(&self, primitive: u32) -> [Vec3; 4] {
        self.indices[primitive as usize].map(|i| self.positions[i as usize])
    }

    /// The nearest hit with `t_min` < t < `t_max`: t in units of `direction` (any length but zero), and (u, v) in [0, 1]².
    pub fn intersect(
        &self,
        primitive: u32,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, [f32; 2])> {
        let o = origin.as_dvec3();
        let d = direction.as_dvec3();
        let [q00, q10, q01, q11] = self.patch(primitive).map(|p| p.as_dvec3() - o);
        // The patch's lines of constant u: from A(u) on the edge q00-q10 to B(u) on q01-q11. The ray (through the origin)
        // meets one where A(u), B(u) and d are coplanar: (A × B)·d = 0, a quadratic in u.
        let (edge0, edge1) = (q10 - q00, q11 - q01);
        let c = q00.cross(q01).dot(d);
        let at_one = q10.cross(q11).dot(d);
        let a = edge0.cross(edge1).dot(d);
        let b = at_one - c - a;
        let mut best: Option<(f32, [f32; 2])> = None;
        for u in quadratic_roots(a, b, c).into_iter().flatten() {
            if !(-SLACK..=1.0 + SLACK).contains(&u) {
                continue;
            }
            let start = q00 + edge0 * u;
            let line = q01 + edge1 * u - start;
            // The closest approach of the ray and the line, which meet: both parameters from one cross product.
            let n = d.cross(line);
            let n2 = n.length_squared();
            if n2 == 0.0 {
                continue;
            }
            let v = start.cross(d).dot(n) / n2;
            let t = start.cross(line).dot(n) / n2;
            if !(-SLACK..=1.0 + SLACK).contains(&v) {
                continue;
            }
            let t = t as f32;
            if t > t_min && t < best.map_or(t_max, |(best, _)| best) {
                best = Some((t, [u.clamp(0.0, 1.0) as f32, v.clamp(0.0, 1.0) as f32]));
            }
        }
        best
    }

    /// The patch's box: a patch lies in the hull of its vertices.
    #[inline]
    pub fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        let [a, b, c, d] = self.patch(primitive);
        (a.min(b).min(c).min(d), a.max(b).max(c).max(d))
    }

    /// ∂p/∂u and ∂p/∂v at (u, v).
    fn derivatives(&self, primitive: u32, uv: [f32; 2]) -> (DVec3, DVec3) {
        let [q00, q10, q01, q11] = self.patch(primitive).map(|p| p.as_dvec3());
        let (u, v) = (f64::from(uv[0]), f64::from(uv[1]));
        ((q10 - q00).lerp(q11 - q01, v), (q01 - q00).lerp(q11 - q10, u))
    }

    /// The derivatives of position by the texture coordinates at (u, v); zero where those are degenerate.
    pub(super) fn partials(&self, primitive: u32, uv: [f32; 2]) -> [DVec3; 2] {
        let (dpdu, dpdv) = self.derivatives(primitive, uv);
        if self.uvs.is_empty() {
            return [dpdu, dpdv];
        }
        let [t00, t10, t01, t11] = self.indices[primitive as usize].map(|i| self.uvs[i as usize].as_dvec2());
        let dstdu = (t10 - t00).lerp(t11 - t01, f64::from(uv[1]));
        let dstdv = (t01 - t00).lerp(t11 - t10, f64::from(uv[0]));
        let determinant = dstdu.perp_dot(dstdv);
        if determinant.abs() < 1e-20 {
            return [DVec3::ZERO; 2];
        }
        [(dpdu * dstdv.y - dpdv * dstdu.y) / determinant, (dpdv * dstdu.x - dpdu * dstdv.x) / determinant]
    }

    /// The interpolated shading normal, unit; `None` where the mesh has none or they cancel.
    pub(super) fn shading_normal(&self, primitive: u32, uv: [f32; 2]) -> Option<Vec3> {
        if self.normals.is_empty() {
            return None;
        }
        let [n00, n10, n01, n11] = self.indices[primitive as usize].map(|i| self.normals[i as usize]);
        n00.lerp(n10, uv[0]).lerp(n01.lerp(n11, uv[0]), uv[1]).try_normalize()
    }

    /// The unit geometric normal ∂p/∂u × ∂p/∂v at (u, v), before the shape's flip; put into the hemisphere of the interpolated
    /// shading normal where there is one (then the flip does not apply). Where a collapsed edge leaves no normal, that of
    /// the patch's middle.
    pub fn normal(&self, primitive: u32, uv: [f32; 2]) -> Vec3 {
        let cross = |uv| {
            let (du, dv) = self.derivatives(primitive, uv);
            let n = du.cross(dv);
            // Parallel derivatives leave only rounding noise in the product.
            (n.length_squared() > 1e-24 * du.length_squared() * dv.length_squared()).then(|| n.normalize().as_vec3())
        };
        let n = cross(uv).or_else(|| cross([0.5, 0.5])).unwrap_or(Vec3::ZERO);
        match self.shading_normal(primitive, uv) {
            Some(ns) if n.dot(ns) < 0.0 => -n,
            _ => n,
        }
    }

    /// The point at (u, v), its error, and its derivatives.
    pub(super) fn point(&self, primitive: u32, uv: [f32; 2]) -> LocalPoint {
        let [q00, q10, q01, q11] = self.patch(primitive).map(|p| p.as_dvec3());
        let (u, v) = (f64::from(uv[0]), f64::from(uv[1]));
        let p = q00.lerp(q10, u).lerp(q01.lerp(q11, u), v).as_vec3();
        let (low, high) = self.bounds(primitive);
        let p_error = gamma(4) * p.abs() + gamma(8) * (high - low) + Vec3::splat(f32::MIN_POSITIVE);
        let (dpdu, dpdv) = self.derivatives(primitive, uv);
        let (tex, dpds) = if self.uvs.is_empty() {
            (Vec2::from(uv), dpdu)
        } else {
            let [t00, t10, t01, t11] = self.indices[primitive as usize].map(|i| self.uvs[i as usize].as_dvec2());
            let st = t00.lerp(t10, u).lerp(t01.lerp(t11, u), v);
            // (s, t) are functions of (u, v): invert their Jacobian for ∂(u, v)/∂s.
            let dstdu = (t10 - t00).lerp(t11 - t01, v);
            let dstdv = (t01 - t00).lerp(t11 - t10, u);
            let determinant = dstdu.x * dstdv.y - dstdu.y * dstdv.x;
            let dpds =
                if determinant.abs() < 1e-20 { DVec3::ZERO } else { (dpdu * dstdv.y - dpdv * dstdu.y) / determinant };
            (st.as_vec2(), dpds)
        };
        let ng = self.normal(primitive, uv);
        let ns = self.shading_normal(primitive, uv);
        let dpds = dpds.as_vec3();
        LocalPoint {
            p,
            p_error,
            ng,
            ns: ns.unwrap_or(ng),
            dpdu: if dpds.is_finite() { dpds } else { Vec3::ZERO },
            uv: tex,
            authoritative_ns: ns.is_some(),
        }
    }
}

/// The real roots of a u² + b u + c, without cancellation; both of them `None` where there are none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    // A plane patch has a = 0 but for rounding: its second root is far away and is refused by its size.
    if a == 0.0 {
        return [(b != 0.0).then(|| -c / b), None];
    }
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 || discriminant.is_nan() {
        return [None, None];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [Some(q / a), (q != 0.0).then(|| c / q)]
}
