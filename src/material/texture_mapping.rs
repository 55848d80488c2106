//! From a point of a surface to the coordinates that a texture is looked up at. Source: pbrt-v4, section 10.2.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::TexturePoint;
use super::mip_map::View;

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
    /// The angle about z over 2π, and z.
    Cylindrical(Affine3A),
}

/// Coordinates on an image, and how they change to neighbours of the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureCoordinates {
    /// s to the right, t upwards: from 0 to 1 across the image.
    pub st: Vec2,
    /// Their change to either neighbour; 0 where nothing is known of neighbours.
    pub change: [Vec2; 2],
}

impl TextureCoordinates {
    /// Twice what they change by, in texels of the image: the width of pbrt-v4's filters.
    #[inline]
    pub fn extent(&self, view: &View) -> f32 {
        let size = Vec2::new(view.levels()[0].width as f32, view.levels()[0].height as f32);
        let [a, b] = self.change.map(|change| (change * size).abs().max_element());
        2.0 * a.max(b)
    }
}

impl Mapping2d {
    /// The coordinates of `point` and of the ray's neighbours there. Those of a mapping that is not linear are told apart by finite differences,
    /// as short as the footprint.
    #[inline]
    pub fn across(&self, point: &TexturePoint) -> TextureCoordinates {
        let st = self.at(point);
        let change = match self {
            _ if point.footprint.is_none() => [Vec2::ZERO; 2],
            Self::Uv { scale, .. } => point.footprint.duv.map(|duv| duv * *scale),
            _ => point.footprint.dp.map(|dp| {
                let change = self.at(&TexturePoint { p: point.p + dp, ..*point }) - st;
                // The angle about z goes round: the shorter way is meant.
                let shorter = |change: f32| change - change.round();
                match self {
                    Self::Spherical(_) => Vec2::new(change.x, shorter(change.y)),
                    Self::Cylindrical(_) => Vec2::new(shorter(change.x), change.y),
                    Self::Uv { .. } | Self::Planar { .. } => change,
                }
            }),
        };
        TextureCoordinates { st, change }
    }

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
                let p = to_texture.transform_point3(point.p);
                Vec2::new((PI + p.y.atan2(p.x)) / TAU, p.z)
            }
        }
    }
}
