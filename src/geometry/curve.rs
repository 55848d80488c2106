//! Curves: cubic Bézier segments swept with a width that varies linearly; hair and fur. Source: pbrt-v4 section 6.7;
//! Nakamaru & Ohno, "Ray Tracing for Curves Primitive", WSCG 2002 (subdivision in the ray's frame).
//!
//! Conventions: of a hit, u runs across the width, 0 to 1, towards direction × tangent, and v along the segment. Texture coordinates are pbrt-v4's:
//! u along the whole curve, v across the width. The normals of ray-facing kinds point back along the ray; those of ribbons are as given.

use glam::{DVec3, Vec2, Vec3};

use super::local::LocalPoint;
use crate::math::Frame;
use crate::math::robust::gamma;

/// How a curve's cross-section is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// A ribbon that always faces the ray, shaded flat.
    Flat,
    /// A ribbon that always faces the ray, shaded as if round.
    Cylinder,
    /// A ribbon with given normals.
    Ribbon,
}

/// Cubic Bézier segments.
#[derive(Debug)]
pub struct Curves {
    /// How the cross-section is meant.
    pub kind: CurveKind,
    /// Four control points a segment, in the shape's space.
    pub control_points: Vec<[Vec3; 4]>,
    /// Width (not radius) at the segment's start and end.
    pub widths: Vec<[f32; 2]>,
    /// The interval along the whole curve, 0 to 1, that the segment is a part of.
    pub parameters: Vec<[f32; 2]>,
    /// For ribbons: the normals at the segment's ends (unit).
    pub normals: Vec<[Vec3; 2]>,
}

/// A segment in the frame of a ray that starts at the origin along +z, and what the recursion needs to know.
struct Search<'a> {
    curves: &'a Curves,
    primitive: usize,
    widths: [f32; 2],
    /// Unit direction of the ray.
    direction: Vec3,
    z_min: f32,
    /// Shrinks to the best hit.
    z_max: f32,
    uv: Option<[f32; 2]>,
}

impl Curves {
    /// The nearest hit with `t_min` < t < `t_max`: t in units of `direction` (any length but zero), and (u, v): u across the width
    /// in [0, 1], v along this segment in [0, 1].
    pub fn intersect(
        &self,
        primitive: u32,
        origin: Vec3,
        direction: Vec3,
        t_min: f32,
        t_max: f32,
    ) -> Option<(f32, [f32; 2])> {
        let primitive = primitive as usize;
        let length = direction.length();
        let z = direction / length;
        let relative = self.control_points[primitive].map(|p| p - origin);
        // y along the curve keeps the boxes of its pieces narrow in x.
        let frame = match z.cross(relative[3] - relative[0]).try_normalize() {
            Some(x) => Frame { x, y: z.cross(x), z },
            None => Frame::from_z(z),
        };
        let points = relative.map(|p| frame.to_local(p));
        let widths = self.widths[primitive];
        let widest = widths[0].max(widths[1]);
        let mut search = Search {
            curves: self,
            primitive,
            widths,
            direction: z,
            z_min: t_min * length,
            z_max: t_max * length,
            uv: None,
        };
        if search.misses(&points, [0.0, 1.0]) {
            return None;
        }
        // The deviation of a cubic from its chord falls by 4 with each halving; 1/20 of the width is flat enough.
        let second = |a: Vec3, b: Vec3, c: Vec3| (a - 2.0 * b + c).abs().max_element();
        let bend = second(points[0], points[1], points[2]).max(second(points[1], points[2], points[3]));
        let ratio = 1.06 * 6.0 * bend / (8.0 * 0.05 * widest);
        let depth = if ratio > 1.0 { (ratio.log2() * 0.5).ceil().clamp(0.0, 10.0) as u32 } else { 0 };
        search.descend(&points, [0.0, 1.0], depth);
        let t = search.z_max / length;
        search.uv.map(|uv| (t, uv)).filter(|_| t > t_min && t < t_max)
    }

    /// A box around the segment with its width.
    pub fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        let [a, b, c, d] = self.control_points[primitive as usize];
        let [w0, w1] = self.widths[primitive as usize];
        let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
        let pad = Vec3::splat(0.5 * w0.max(w1)) + gamma(6) * low.abs().max(high.abs());
        (low - pad, high + pad)
    }

    /// The ribbon's unit normal at `v` along the segment: on the great circle between its ends' normals.
    fn ribbon_normal(&self, primitive: usize, v: f32) -> Vec3 {
        let [n0, n1] = self.normals[primitive];
        let angle = n0.dot(n1).clamp(-1.0, 1.0).acos();
        let sin = angle.sin();
        let n = if sin < 1e-4 {
            n0.lerp(n1, v)
        } else {
            n0 * (((1.0 - v) * angle).sin() / sin) + n1 * ((v * angle).sin() / sin)
        };
        n.try_normalize().unwrap_or(n0)
    }

    /// ∂p/∂u and ∂p/∂v by the texture coordinates at a hit's (u, v), as seen along the unit `direction`.
    pub(super) fn partials(&self, primitive: u32, uv: [f32; 2], direction: Vec3) -> [DVec3; 2] {
        let point = self.point(primitive, uv, direction);
        let [v0, v1] = self.parameters[primitive as usize];
        let [w0, w1] = self.widths[primitive as usize];
        let across = point.ng.cross(point.dpdu).normalize_or_zero();
        // Towards direction × tangent.
        let side = if across.dot(direction.cross(point.dpdu)) < 0.0 { -across } else { across };
        [(point.dpdu / (v1 - v0)).as_dvec3(), (side * (w0 + (w1 - w0) * uv[1])).as_dvec3()]
    }

    /// The point at (u, v) as seen along the unit `direction`, its error, and its derivatives.
    pub(super) fn point(&self, primitive: u32, uv: [f32; 2], direction: Vec3) -> LocalPoint {
        let primitive = primitive as usize;
        let points = &self.control_points[primitive];
        let [w0, w1] = self.widths[primitive];
        let width = w0 + (w1 - w0) * uv[1];
        let (centre, derivative) = bezier(points, uv[1]);
        let tangent = derivative
            .try_normalize()
            .or_else(|| (points[3] - points[0]).try_normalize())
            .unwrap_or_else(|| Frame::from_z(direction).x);
        let facing = -direction;
        // `across` grows with u; see `Search::leaf`.
        let (across, ng) = match self.kind {
            CurveKind::Ribbon => {
                let n = self.ribbon_normal(primitive, uv[1]);
                let across = n.cross(tangent).try_normalize().unwrap_or_else(|| Frame::from_z(tangent).x);
                // The ray sees u grow to the side that `leaf` measured in its own frame.
                let seen = direction.cross(tangent);
                (if across.dot(seen) < 0.0 { -across } else { across }, n)
            }
            CurveKind::Flat | CurveKind::Cylinder => {
                let across = direction.cross(tangent).try_normalize().unwrap_or_else(|| Frame::from_z(tangent).x);
                let towards = across.cross(tangent);
                let n = if towards.dot(facing) < 0.0 { -towards } else { towards };
                (across, n)
            }
        };
        let ng = match self.kind {
            CurveKind::Cylinder => {
                // The round cross-section: sin of the angle from facing is the offset from the centre line.
                let sin = (2.0 * uv[0] - 1.0).clamp(-1.0, 1.0);
                (across * sin + ng * (1.0 - sin * sin).max(0.0).sqrt()).normalize()
            }
            CurveKind::Flat | CurveKind::Ribbon => ng,
        };
        let p = centre + across * ((uv[0] - 0.5) * width);
        let [v0, v1] = self.parameters[primitive];
        LocalPoint {
            p,
            // Another ray sees the ribbon turned: leaving it takes its width (pbrt-v4 section 6.7).
            p_error: Vec3::splat(2.0 * width) + gamma(8) * p.abs(),
            ng,
            ns: ng,
            dpdu: tangent * derivative.length(),
            uv: Vec2::new(v0 + (v1 - v0) * uv[1], uv[0]),
            authoritative_ns: self.kind != CurveKind::Ribbon,
        }
    }
}

impl Search<'_> {
    /// Whether the piece over the interval `v` cannot be hit.
    fn misses(&self, p: &[Vec3; 4], v: [f32; 2]) -> bool {
        let width = |v: f32| self.widths[0] + (self.widths[1] - self.widths[0]) * v;
        let half = 0.5 * width(v[0]).max(width(v[1]));
        let low = p[0].min(p[1]).min(p[2].min(p[3])) - half;
        let high = p[0].max(p[1]).max(p[2].max(p[3])) + half;
        low.x > 0.0 || high.x < 0.0 || low.y > 0.0 || high.y < 0.0 || high.z < self.z_min || low.z > self.z_max
    }

    fn descend(&mut self, points: &[Vec3; 4], v: [f32; 2], depth: u32) {
        if depth == 0 {
            self.leaf(points, v);
            return;
        }
        let middle = 0.5 * (v[0] + v[1]);
        let (first, second) = split(points);
        for (piece, v) in [(first, [v[0], middle]), (second, [middle, v[1]])] {
            if !self.misses(&piece, v) {
                self.descend(&piece, v, depth - 1);
            }
        }
    }

    fn leaf(&mut self, p: &[Vec3; 4], v: [f32; 2]) {
        // Between the planes across its ends? (The ray is the point (0, 0).) Neighbours share them.
        let xy = p.map(Vec3::truncate);
        if (xy[1] - xy[0]).dot(-xy[0]) < 0.0 || (xy[2] - xy[3]).dot(-xy[3]) < 0.0 {
            return;
        }
        let chord = xy[3] - xy[0];
        let squared = chord.length_squared();
        if squared == 0.0 {
            return;
        }
        let w = (-xy[0].dot(chord) / squared).clamp(0.0, 1.0);
        let at = v[0] + (v[1] - v[0]) * w;
        let mut width = self.widths[0] + (self.widths[1] - self.widths[0]) * at;
        if self.curves.kind == CurveKind::Ribbon {
            width *= self.curves.ribbon_normal(self.primitive, at).dot(self.direction).abs();
        }
        let (centre, derivative) = bezier(p, w);
        let distance_squared = centre.truncate().length_squared();
        if distance_squared > 0.25 * width * width || !(centre.z > self.z_min && centre.z < self.z_max) || width <= 0.0
        {
            return;
        }
        // The side: along z × derivative, the ribbon's direction across.
        let side = centre.x * derivative.y - centre.y * derivative.x;
        let offset = distance_squared.sqrt() / width;
        self.z_max = centre.z;
        self.uv = Some([(if side > 0.0 { 0.5 + offset } else { 0.5 - offset }).clamp(0.0, 1.0), at]);
    }
}

/// The point and derivative of a cubic Bézier curve (de Casteljau).
fn bezier(p: &[Vec3; 4], t: f32) -> (Vec3, Vec3) {
    let (a, b, c) = (p[0].lerp(p[1], t), p[1].lerp(p[2], t), p[2].lerp(p[3], t));
    let (d, e) = (a.lerp(b, t), b.lerp(c, t));
    (d.lerp(e, t), 3.0 * (e - d))
}

/// The two halves of a cubic Bézier curve.
fn split(p: &[Vec3; 4]) -> ([Vec3; 4], [Vec3; 4]) {
    let (a, b, c) = (p[0].midpoint(p[1]), p[1].midpoint(p[2]), p[2].midpoint(p[3]));
    let (d, e) = (a.midpoint(b), b.midpoint(c));
    let middle = d.midpoint(e);
    ([p[0], a, d, middle], [middle, e, c, p[3]])
}
