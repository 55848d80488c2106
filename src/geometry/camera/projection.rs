//! How a film position becomes a ray in camera space, which looks along +z with x to the right and y up.
//!
//! Sources: pbrt-v4, sections 5.2 (projective cameras), 5.2.3 (thin lens), 5.3 (spherical camera).

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::math::equal_area::{equal_area_sphere_to_square, equal_area_square_to_sphere, wrap_equal_area_square};
use crate::math::warp::concentric_disk;

/// From film positions, in pixels of the full image from its top left corner with y downwards, to rays.
#[derive(Clone, Debug)]
pub(super) enum Projection {
    /// All rays come from one point, or from a lens around it.
    Perspective {
        /// The plane z = 1.
        screen: Screen,
        /// Where rays start.
        lens: Lens,
    },
    /// All rays are parallel, or meet in the plane of focus.
    Orthographic {
        /// The plane z = 0.
        screen: Screen,
        /// How far from the screen's points they start.
        lens: Lens,
    },
    /// All rays come from one point, in all directions.
    Spherical {
        /// One over width and height in pixels.
        per_pixel: Vec2,
        /// How the image covers the sphere.
        mapping: Mapping,
    },
}

/// A plane that the image is stretched over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Screen {
    /// The point that the image's top left corner looks at.
    pub corner: Vec2,
    /// What one pixel to the right and one pixel down add to it.
    pub per_pixel: Vec2,
}

impl Screen {
    #[inline]
    fn at(&self, film: Vec2) -> Vec2 {
        self.corner + film * self.per_pixel
    }

    fn film(&self, at: Vec2) -> Vec2 {
        (at - self.corner) / self.per_pixel
    }
}

/// A thin lens.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// Its radius; 0 for a pinhole.
    pub radius: f32,
    /// The distance of the plane that is sharp.
    pub focal_distance: f32,
}

/// How an image covers the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mapping {
    /// Clarberg's octahedral map: each pixel has the same solid angle.
    EqualArea,
    /// Rows are latitudes from +y down, columns longitudes.
    Equirectangular,
}

/// What a pixel spans at the distance t: `width` + t · `angle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelSpan {
    /// In units of length.
    pub width: f32,
    /// In radians.
    pub angle: f32,
}

impl Projection {
    /// Where the ray starts and its direction, of any length, through `lens` in the unit square.
    #[inline]
    pub fn ray(&self, film: Vec2, lens: [f32; 2]) -> (Vec3, Vec3) {
        match self {
            Self::Perspective { screen, lens: Lens { radius, focal_distance } } => {
                let target = screen.at(film).extend(1.0);
                if *radius > 0.0 {
                    let on_lens = (concentric_disk(lens) * *radius).extend(0.0);
                    (on_lens, target * *focal_distance - on_lens)
                } else {
                    (Vec3::ZERO, target)
                }
            }
            Self::Orthographic { screen, lens: Lens { radius, focal_distance } } => {
                let at = screen.at(film).extend(0.0);
                if *radius > 0.0 {
                    // pbrt-v4 starts these rays on a lens around the middle of the image, which makes a perspective of them. Here each point
                    // of the image has a lens of its own, so that what is sharp is where it is without.
                    let on_lens = (concentric_disk(lens) * *radius).extend(0.0);
                    (at + on_lens, Vec3::Z * *focal_distance - on_lens)
                } else {
                    (at, Vec3::Z)
                }
            }
            Self::Spherical { per_pixel, mapping } => {
                let uv = film * *per_pixel;
                let z_up = match mapping {
                    Mapping::EqualArea => equal_area_square_to_sphere(wrap_equal_area_square(uv)),
                    Mapping::Equirectangular => {
                        let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * uv.x).sin_cos(), (PI * uv.y).sin_cos());
                        Vec3::new(sin * cos_phi, sin * sin_phi, cos)
                    }
                };
                (Vec3::ZERO, Vec3::new(z_up.x, z_up.z, z_up.y))
            }
        }
    }

    /// Where the point `p` of camera space is seen, through the lens's middle; `None` where it is not.
    pub fn film(&self, p: Vec3) -> Option<Vec2> {
        let film = match self {
            Self::Perspective { screen, .. } => screen.film(p.truncate() / p.z),
            Self::Orthographic { screen, .. } => screen.film(p.truncate()),
            Self::Spherical { per_pixel, mapping } => {
                let d = Vec3::new(p.x, p.z, p.y).try_normalize()?;
                let uv = match mapping {
                    Mapping::EqualArea => equal_area_sphere_to_square(d),
                    Mapping::Equirectangular => {
                        Vec2::new(d.y.atan2(d.x).rem_euclid(TAU) / TAU, d.z.clamp(-1.0, 1.0).acos() / PI)
                    }
                };
                return Some(uv / *per_pixel);
            }
        };
        (p.z > 0.0).then_some(film).filter(|film| film.is_finite())
    }

    /// What a pixel in the middle of the image spans.
    pub fn pixel_span(&self) -> PixelSpan {
        match self {
            Self::Perspective { screen, .. } => PixelSpan { width: 0.0, angle: screen.per_pixel.abs().max_element() },
            Self::Orthographic { screen, .. } => PixelSpan { width: screen.per_pixel.abs().max_element(), angle: 0.0 },
            Self::Spherical { per_pixel, mapping: Mapping::EqualArea } => {
                PixelSpan { width: 0.0, angle: (2.0 * TAU * per_pixel.x * per_pixel.y).sqrt() }
            }
            Self::Spherical { per_pixel, mapping: Mapping::Equirectangular } => {
                PixelSpan { width: 0.0, angle: (TAU * per_pixel.x).max(PI * per_pixel.y) }
            }
        }
    }

    /// Whether rays start all over a lens.
    pub fn has_lens(&self) -> bool {
        match self {
            Self::Perspective { lens, .. } | Self::Orthographic { lens, .. } => lens.radius > 0.0,
            Self::Spherical { .. } => false,
        }
    }
}
