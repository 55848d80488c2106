//! Floating-point rounding errors and ray offsets that scale with them.
//! Source: Pharr et al., "Physically Based Rendering" (4th ed.), section 6.8; Ize 2013 for the box test's margin.

use glam::Vec3;

/// The bound γ_n = nε/(1 − nε) on the relative error of n chained roundings, ε being half a unit in the last place.
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let ne = n as f32 * (f32::EPSILON * 0.5);
    ne / (1.0 - ne)
}

/// Moves `p` off its surface along the geometric normal `ng` to the side that `direction` leaves on, just far enough that no
/// rounding error in `p` (bounded per axis by `p_error`) can put the new origin on the wrong side (section 6.8.6).
//
// Always inlined: see `DirectLight::gather`.
#[inline(always)]
pub fn offset_ray_origin(p: Vec3, p_error: Vec3, ng: Vec3, direction: Vec3) -> Vec3 {
    let distance = ng.abs().dot(p_error);
    let offset = if direction.dot(ng) < 0.0 { -distance * ng } else { distance * ng };
    let moved = p + offset;
    // Round away from the surface, so that the addition's own rounding cannot undo the offset.
    let away = |value: f32, offset: f32| {
        if offset > 0.0 {
            value.next_up()
        } else if offset < 0.0 {
            value.next_down()
        } else {
            value
        }
    };
    Vec3::new(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z))
}
