//! An image thrown by a projector: light from a point through the pixels of an image, which lies before it in perspective. Source:
//! Pharr, Jakob, Humphreys (4th ed.) section 12.2.2, and pbrt-v4's reading of its parameters.
//!
//! The field of view spans the shorter side. Pixels are looked up as they are, with hard edges. The image's top is +y. Its power is summed
//! over the solid angles of the pixels' parts.

use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};

use crate::math::Rgb;

/// No direction counts whose cosine to the axis is below this (pbrt's near plane).
const LEAST_COSINE: f32 = 1e-3;

/// Parts along an edge that small images are divided into, at least, when they are summed.
const PARTS: usize = 256;

/// Pixels, rows from the top.
#[derive(Debug)]
pub struct Slide {
    width: usize,
    height: usize,
    pixels: Box<[[f32; 3]]>,
}

impl Slide {
    /// An image of `width` × `height` pixels (finite, not negative; at least one).
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), width * height, "the caller gives one triple a pixel");
        Self { width, height, pixels: pixels.into_boxed_slice() }
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.pixels)
    }
}

/// A slide before a light.
#[derive(Clone, Debug)]
pub struct Projection {
    slide: Arc<Slide>,
    /// Half the image's width and height at the distance 1.
    half: Vec2,
    /// From the light's space, turned but not stretched, to that of the image.
    inverse_stretch: Mat3,
    stretch: Mat3,
}

impl Projection {
    /// `slide` with the field of view `fov` in degrees (within 0 to 180, both left out) across its shorter side, in a space that `stretch` takes
    /// to the light's, where lengths are even: the identity unless the transform scales some axes more than others.
    pub fn new(slide: Arc<Slide>, fov: f32, stretch: Mat3) -> Self {
        let aspect = slide.width as f32 / slide.height as f32;
        let tan = (0.5 * fov.to_radians()).tan();
        let half = if aspect > 1.0 { Vec2::new(tan * aspect, tan) } else { Vec2::new(tan, tan / aspect) };
        Self { slide, half, inverse_stretch: stretch.inverse(), stretch }
    }

    /// The pixel in the unit direction `w` of the light's space; black beside the image.
    #[inline]
    pub fn at(&self, w: Vec3) -> Rgb {
        let q = self.inverse_stretch * w;
        if !(q.z >= LEAST_COSINE * q.length()) {
            return Rgb::BLACK;
        }
        let screen = q.truncate() / (q.z * self.half);
        if !(screen.abs().max_element() <= 1.0) {
            return Rgb::BLACK;
        }
        let Slide { width, height, ref pixels } = *self.slide;
        let place = |t: f32, count: usize| ((t * count as f32) as usize).min(count - 1);
        let (x, y) = (place(0.5 + 0.5 * screen.x, width), place(0.5 - 0.5 * screen.y, height));
        Rgb::from(pixels[y * width + x])
    }

    /// The integral over all directions.
    pub fn integral(&self) -> Rgb {
        let Slide { width, height, ref pixels } = *self.slide;
        let parts = [width, height].map(|count| PARTS.div_ceil(count));
        let (columns, rows) = (width * parts[0], height * parts[1]);
        let cell = f64::from(4.0 * self.half.x * self.half.y) / (columns as f64 * rows as f64);
        let determinant = f64::from(self.stretch.determinant().abs());
        let middle = |k: usize, count: usize, half: f32| half * (2.0 * (k as f32 + 0.5) / count as f32 - 1.0);
        let mut sum = [0.0f64; 3];
        for y in 0..rows {
            let down = middle(y, rows, self.half.y);
            for x in 0..columns {
                let q = self.stretch * Vec3::new(middle(x, columns, self.half.x), -down, 1.0);
                // dω = |det S| dA / |S q|³.
                let square = f64::from(q.length_squared());
                let solid_angle = determinant * cell / (square * square.sqrt());
                let pixel = pixels[y / parts[1] * width + x / parts[0]];
                (0..3).for_each(|c| sum[c] += f64::from(pixel[c]) * solid_angle);
            }
        }
        Rgb::from(sum.map(|s| s as f32))
    }

    /// Axis and cosine of the half angle of a cone around the image.
    pub fn cone(&self) -> (Vec3, f32) {
        let axis = (self.stretch * Vec3::Z).normalize_or(Vec3::Z);
        let corners = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
        let cosine = |[x, y]: [f32; 2]| {
            (self.stretch * Vec3::new(x * self.half.x, y * self.half.y, 1.0)).normalize_or(Vec3::Z).dot(axis)
        };
        (axis, (corners.map(cosine).into_iter().fold(1.0, f32::min) - 1e-5).max(-1.0))
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.slide.memory()
    }
}
