//! Images over the sphere of directions: which direction a pixel stands for, and look-ups between pixels that go on across the
//! edges of the map as the sphere does.
//!
//! Source: [`crate::math::equal_area`] for the octahedral square; Pharr, Jakob, Humphreys (4th ed.) section 3.8.3.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::math::Rgb;
use crate::math::equal_area::{equal_area_sphere_to_square, equal_area_square_to_sphere};

/// How the image covers the sphere. In both, light space has z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Clarberg's equal-area octahedral map on a square image, as pbrt-v4 requires.
    Octahedral,
    /// Columns are φ = 2πu, rows are θ = πv from +z, as pbrt-v4's `imgtool makeequiarea` reads them.
    LatLong,
}

/// An image of `width` × `height` RGB pixels around the sphere, rows from the top.
#[derive(Debug)]
pub struct SphereImage {
    layout: Layout,
    width: usize,
    height: usize,
    pixels: Box<[[f32; 3]]>,
}

impl SphereImage {
    /// The image of these pixels (finite, not negative). Needs a square image for [`Layout::Octahedral`].
    pub fn new(layout: Layout, width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), width * height, "the caller gives one triple a pixel");
        Self { layout, width, height, pixels: pixels.into_boxed_slice() }
    }

    /// How it covers the sphere.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Every pixel with the direction of its middle and its solid angle, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = (Rgb, Vec3, f64)> + '_ {
        (0..self.height).flat_map(move |y| {
            let solid_angle = self.row_solid_angle(y);
            (0..self.width).map(move |x| {
                let uv = Vec2::new((x as f32 + 0.5) / self.width as f32, (y as f32 + 0.5) / self.height as f32);
                (Rgb::from(self.pixels[y * self.width + x]), self.direction(uv), solid_angle)
            })
        })
    }

    /// The mean over the sphere.
    pub fn mean(&self) -> Rgb {
        let mut mean = [0.0f64; 3];
        for (colour, _, solid_angle) in self.pixels() {
            (0..3).for_each(|c| mean[c] += f64::from(colour[c]) * solid_angle);
        }
        Rgb::from(mean.map(|m| (m / (4.0 * std::f64::consts::PI)) as f32))
    }

    /// What a surface facing +z receives of the image times `scale`, in luminance.
    pub fn upper_illuminance(&self, scale: Rgb) -> f32 {
        let received = |(colour, direction, solid_angle): (Rgb, Vec3, f64)| {
            f64::from((scale * colour).luminance() * direction.z.max(0.0)) * solid_angle
        };
        self.pixels().map(received).sum::<f64>() as f32
    }

    /// The value in the unit direction `w` of the image's own space, z up.
    #[inline]
    pub fn at(&self, w: Vec3) -> Rgb {
        self.lookup(self.uv(w))
    }

    /// The solid angle of one pixel of row `y`.
    pub(super) fn row_solid_angle(&self, y: usize) -> f64 {
        let pi = std::f64::consts::PI;
        match self.layout {
            Layout::Octahedral => 4.0 * pi / (self.width * self.height) as f64,
            Layout::LatLong => {
                let cos = |y: usize| (pi * y as f64 / self.height as f64).cos();
                (cos(y) - cos(y + 1)) * 2.0 * pi / self.width as f64
            }
        }
    }

    /// The pixel at (x, y), which may lie up to one beyond the edges: there the map goes on as the sphere does.
    fn pixel(&self, mut x: i64, mut y: i64) -> Rgb {
        let (w, h) = (self.width as i64, self.height as i64);
        match self.layout {
            Layout::Octahedral => {
                if x < 0 || x >= w {
                    x = if x < 0 { -1 - x } else { 2 * w - 1 - x };
                    y = h - 1 - y;
                }
                if y < 0 || y >= h {
                    y = if y < 0 { -1 - y } else { 2 * h - 1 - y };
                    x = w - 1 - x;
                }
            }
            Layout::LatLong => {
                if y < 0 || y >= h {
                    y = if y < 0 { -1 - y } else { 2 * h - 1 - y };
                    x += w / 2;
                }
                x = x.rem_euclid(w);
            }
        }
        let index = y.clamp(0, h - 1) * w + x.clamp(0, w - 1);
        Rgb::from(self.pixels[index as usize])
    }

    /// The mean of the bilinear lookup over a pixel's cell: its tent covers the neighbours by 1/8, 6/8, 1/8 along each axis.
    pub(super) fn cell_mean(&self, x: i64, y: i64) -> Rgb {
        let row = |y: i64| self.pixel(x - 1, y) + self.pixel(x, y) * 6.0 + self.pixel(x + 1, y);
        (row(y - 1) + row(y) * 6.0 + row(y + 1)) * (1.0 / 64.0)
    }

    /// The bilinear look-up at `uv` of the map.
    #[inline]
    pub(super) fn lookup(&self, uv: Vec2) -> Rgb {
        let x = uv.x * self.width as f32 - 0.5;
        let y = uv.y * self.height as f32 - 0.5;
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let (left, top) = (left as i64, top as i64);
        let row = |y: i64| self.pixel(left, y).lerp(self.pixel(left + 1, y), fx);
        row(top).lerp(row(top + 1), fy)
    }

    /// The unit direction at `uv` of the map.
    pub(super) fn direction(&self, uv: Vec2) -> Vec3 {
        match self.layout {
            Layout::Octahedral => equal_area_square_to_sphere(uv),
            Layout::LatLong => {
                let (theta, phi) = (PI * uv.y, TAU * uv.x);
                Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
            }
        }
    }

    /// Where the unit direction `w` is on the map.
    pub(super) fn uv(&self, w: Vec3) -> Vec2 {
        match self.layout {
            Layout::Octahedral => equal_area_sphere_to_square(w),
            Layout::LatLong => {
                let phi = w.y.atan2(w.x);
                let theta = w.truncate().length().atan2(w.z);
                Vec2::new(if phi < 0.0 { phi + TAU } else { phi } / TAU, theta / PI).clamp(Vec2::ZERO, Vec2::ONE)
            }
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.pixels)
    }
}
