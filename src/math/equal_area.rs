//! The equal-area map between the unit square and the unit sphere that pbrt-v4 keeps environments in and its spherical camera looks through.
//! Source: Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD" (2008); pbrt-v4, section 3.8.3.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Vec2, Vec3};

/// Clarberg's map from the unit square to the unit sphere: the inner diamond is the upper hemisphere (z up).
pub fn equal_area_square_to_sphere(p: Vec2) -> Vec3 {
    let (u, v) = (2.0 * p.x - 1.0, 2.0 * p.y - 1.0);
    let (au, av) = (u.abs(), v.abs());
    let signed_distance = 1.0 - (au + av);
    let r = 1.0 - signed_distance.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((av - au) / r + 1.0) * FRAC_PI_4 };
    let ring = r * (2.0 - r * r).max(0.0).sqrt();
    Vec3::new((ring * phi.cos()).copysign(u), (ring * phi.sin()).copysign(v), (1.0 - r * r).copysign(signed_distance))
}

/// The inverse of [`equal_area_square_to_sphere`].
pub fn equal_area_sphere_to_square(d: Vec3) -> Vec2 {
    let (x, y) = (d.x.abs(), d.y.abs());
    // r² = 1 − |z|, written so that it keeps its precision at the poles.
    let r = ((x * x + y * y) / (1.0 + d.z.abs())).sqrt();
    let phi = if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) / FRAC_PI_2 };
    let (v, u) = (phi * r, r - phi * r);
    let (u, v) = if d.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    ((Vec2::new(u.copysign(d.x), v.copysign(d.y)) + Vec2::ONE) * 0.5).clamp(Vec2::ZERO, Vec2::ONE)
}

/// The point of the unit square that continues the map at `p`, which may lie up to a width outside of it: over an edge it goes on at the same edge, mirrored.
pub fn wrap_equal_area_square(mut p: Vec2) -> Vec2 {
    for axis in 0..2 {
        let folded = if p[axis] < 0.0 {
            -p[axis]
        } else if p[axis] > 1.0 {
            2.0 - p[axis]
        } else {
            continue;
        };
        p[axis] = folded;
        p[1 - axis] = 1.0 - p[1 - axis];
    }
    p.clamp(Vec2::ZERO, Vec2::ONE)
}
