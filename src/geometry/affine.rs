//! Affine transforms of rays, points with error bounds, normals and boxes. Transforms are stored in f32 and applied in
//! f64, so the only roundings that matter are those of the results. Source: pbrt-v4 section 6.8.

use glam::{Affine3A, DMat3, DVec3, Vec3};

use crate::math::robust::gamma;

/// The linear part in double precision.
pub fn linear(affine: &Affine3A) -> DMat3 {
    let m = affine.matrix3;
    DMat3::from_cols(Vec3::from(m.x_axis).as_dvec3(), Vec3::from(m.y_axis).as_dvec3(), Vec3::from(m.z_axis).as_dvec3())
}

/// The translation in double precision.
pub fn translation(affine: &Affine3A) -> DVec3 {
    Vec3::from(affine.translation).as_dvec3()
}

/// The ray in the space that `affine` maps from, `inverse` being the inverse of its linear part. `None` for a ray or transform without meaning (NaN, singular).
pub fn ray_to_object(affine: &Affine3A, inverse: &DMat3, origin: Vec3, direction: Vec3) -> Option<(DVec3, DVec3)> {
    let o = *inverse * (origin.as_dvec3() - translation(affine));
    let d = *inverse * direction.as_dvec3();
    let ok = o.is_finite() && d.is_finite() && d.length_squared() > 0.0;
    ok.then_some((o, d))
}

/// The image of a point known in f64, rounded, with the bound of the roundings.
pub fn exact_point(affine: &Affine3A, p: DVec3) -> (Vec3, Vec3) {
    let q = linear(affine) * p + translation(affine);
    let rounded = q.as_vec3();
    // One rounding of p itself is γ_1 |p|; the rest leaves room for transforms of the ray that leaves it.
    let size = (linear(affine) * p).abs().as_vec3();
    (rounded, gamma(4) * rounded.abs() + gamma(4) * size + Vec3::splat(f32::MIN_POSITIVE))
}

/// The image of a point whose error is bounded by `error` per axis, with the new bound: the old one under |M|, and room for
/// tracers that transform the ray in f32: a few roundings of the size of |M| |p| and of the translation, however much the two cancel
/// (pbrt-v4, equation 6.16).
pub fn point_with_error(affine: &Affine3A, p: Vec3, error: Vec3) -> (Vec3, Vec3) {
    let m = linear(affine);
    let q = (m * p.as_dvec3() + translation(affine)).as_vec3();
    let abs = DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let grown = (abs * error.as_dvec3()).as_vec3() * (1.0 + gamma(3));
    let cancelled = (abs * p.abs().as_dvec3() + translation(affine).abs()).as_vec3();
    (q, grown + gamma(2) * q.abs() + gamma(6) * cancelled + Vec3::splat(f32::MIN_POSITIVE))
}

/// The image of a vector.
pub fn vector(affine: &Affine3A, v: DVec3) -> Vec3 {
    (linear(affine) * v).as_vec3()
}

/// The unit image of a normal: by the inverse transpose.
pub fn normal(affine: &Affine3A, n: DVec3) -> Vec3 {
    (cofactors(affine) * n).normalize_or_zero().as_vec3()
}

/// The unit image of a normal, and the changes of that where the normal changes by each of `dn`.
pub fn normal_change(affine: &Affine3A, n: DVec3, dn: [Vec3; 2]) -> [Vec3; 3] {
    let cofactors = cofactors(affine);
    let image = cofactors * n;
    let length = image.length();
    let unit = image / length;
    let [dx, dy] = dn.map(|dn| {
        let change = cofactors * dn.as_dvec3() / length;
        (change - unit * unit.dot(change)).as_vec3()
    });
    [unit.as_vec3(), dx, dy]
}

/// The inverse transpose times the size of the determinant: no division, so near-singular transforms behave.
fn cofactors(affine: &Affine3A) -> DMat3 {
    let m = linear(affine);
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}

/// A box around the image of the box `low`..`high`, rounded outward.
pub fn box_bounds(affine: &Affine3A, low: DVec3, high: DVec3) -> (Vec3, Vec3) {
    let m = linear(affine);
    let centre = m * ((low + high) * 0.5) + translation(affine);
    let half = (high - low) * 0.5;
    let extent = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    outward(centre - extent, centre + extent)
}

/// Rounds a box outward, to f32.
pub fn outward(low: DVec3, high: DVec3) -> (Vec3, Vec3) {
    let pad = |v: f32, up: bool| if up { v.next_up().next_up() } else { v.next_down().next_down() };
    let (l, h) = (low.as_vec3(), high.as_vec3());
    (
        Vec3::new(pad(l.x, false), pad(l.y, false), pad(l.z, false)),
        Vec3::new(pad(h.x, true), pad(h.y, true), pad(h.z, true)),
    )
}
