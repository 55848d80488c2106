//! What a ray covers of a surface: how position and texture coordinates change from it to its neighbours. Source: pbrt-v4, section 10.1.1.

use glam::{Vec2, Vec3};

use crate::geometry::Partials;

/// The changes to two neighbours of a ray; 0 where nothing is known of them, and then textures are looked up at their finest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Of position, in render space, within the surface.
    pub dp: [Vec3; 2],
    /// Of the texture coordinates.
    pub duv: [Vec2; 2],
}

impl Footprint {
    /// Nothing is known of neighbours.
    pub const NONE: Self = Self { dp: [Vec3::ZERO; 2], duv: [Vec2::ZERO; 2] };

    /// What covers `dp` of a surface with the given derivatives: the texture coordinates that come nearest to `dp` (pbrt-v4, equation 10.1 and what follows, by least
    /// squares).
    pub fn new(dp: [Vec3; 2], partials: &Partials) -> Self {
        // Beyond this, coordinates mean nothing any more.
        const MOST: f32 = 1e8;
        let (u, v) = (partials.dpdu.as_dvec3(), partials.dpdv.as_dvec3());
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let determinant = uu * vv - uv * uv;
        let duv = dp.map(|dp| {
            let dp = dp.as_dvec3();
            let (along_u, along_v) = (u.dot(dp), v.dot(dp));
            let duv = if determinant > 1e-12 * uu * vv {
                Vec2::new(
                    ((vv * along_u - uv * along_v) / determinant) as f32,
                    ((uu * along_v - uv * along_u) / determinant) as f32,
                )
            } else {
                Vec2::ZERO
            };
            if duv.is_finite() { duv.clamp(Vec2::splat(-MOST), Vec2::splat(MOST)) } else { Vec2::ZERO }
        });
        Self { dp, duv }
    }

    /// Whether nothing is known of neighbours.
    #[inline]
    pub fn is_none(&self) -> bool {
        self.dp[0] == Vec3::ZERO && self.dp[1] == Vec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_coordinates_follow_position() {
        let partials = Partials { dpdu: Vec3::new(2.0, 0.0, 1.0), dpdv: Vec3::new(-1.0, 3.0, 0.0) };
        let change = |du: f32, dv: f32| partials.dpdu * du + partials.dpdv * dv;
        let footprint = Footprint::new([change(0.25, -0.5), change(1e-3, 0.0)], &partials);
        assert!((footprint.duv[0] - Vec2::new(0.25, -0.5)).length() < 1e-6);
        assert!((footprint.duv[1] - Vec2::new(1e-3, 0.0)).length() < 1e-9);
        // What leaves the surface does not count; a surface without coordinates has none that change.
        let n = partials.dpdu.cross(partials.dpdv);
        assert!((Footprint::new([change(0.25, 0.0) + n, n], &partials).duv[0].x - 0.25).abs() < 1e-6);
        let without = Partials { dpdu: Vec3::X, dpdv: Vec3::X * 2.0 };
        assert_eq!(Footprint::new([Vec3::X, Vec3::Y], &without).duv, [Vec2::ZERO; 2]);
        assert!(Footprint::NONE.is_none() && !footprint.is_none());
    }
}
