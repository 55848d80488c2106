//! From a point of a surface to the coordinates that a texture is looked up at. Source: pbrt-v4, section 10.2.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::TexturePoint;

/// Coordinates in two dimensions.
#[derive(Clone, Copy, Debug)]
pub enum Mapping2d {
    /// The surface's own (u, v), scaled and then moved.
    Uv {
        /// Factors.
        scale: Vec2,
        /// What is added.
        delta: Vec2,
    },
    /// Along two vectors of the texture's space.
    Planar {
        /// Render space to the texture's.
        to_texture: Affine3A,
        /// What the coordinates are measured along.
        axes: [Vec3; 2],
        /// What is added.
        delta: Vec2,
    },
    /// Angles seen from the origin of the texture's space: from +z over π, and about z over 2π.
    Spherical(Affine3A),
    /// The angle about z over 2π, and what is along z of the unit vector to the point.
    Cylindrical(Affine3A),
}

impl Mapping2d {
    /// The surface's own coordinates.
    pub const IDENTITY: Self = Self::Uv { scale: Vec2::ONE, delta: Vec2::ZERO };

    /// The coordinates of `point`.
    #[inline]
    pub fn at(&self, point: &TexturePoint) -> Vec2 {
        match self {
            Self::Uv { scale, delta } => point.uv * *scale + *delta,
            Self::Planar { to_texture, axes, delta } => {
                let p = to_texture.transform_point3(point.p);
                Vec2::new(p.dot(axes[0]), p.dot(axes[1])) + *delta
            }
            Self::Spherical(to_texture) => {
                let d = to_texture.transform_point3(point.p).normalize_or_zero();
                Vec2::new(d.z.clamp(-1.0, 1.0).acos() * FRAC_1_PI, d.y.atan2(d.x).rem_euclid(TAU) / TAU)
            }
            Self::Cylindrical(to_texture) => {
                let d = to_texture.transform_point3(point.p).normalize_or_zero();
                Vec2::new((PI + d.y.atan2(d.x)) / TAU, d.z)
            }
        }
    }
}
