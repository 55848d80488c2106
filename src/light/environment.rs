//! Images ([`super::sphere_image`]) that light the scene from infinity: lookups, and directions drawn in proportion to them.
//!
//! Sources: Pharr, Jakob, Humphreys (4th ed.) section 12.5.2; Ramamoorthi & Hanrahan, "An Efficient Representation for
//! Irradiance Environment Maps", SIGGRAPH 2001, for the irradiance estimate.
//!
//! Lookups are bilinear. The density is constant over each pixel's cell of the sphere and proportional to the *mean of the
//! bilinear lookup* over that cell, so it is positive wherever the lookup is, also in the pixels beside a lone sun.

use std::f32::consts::PI;

use glam::{Mat3, Vec2, Vec3};

use super::sphere_image::{Layout, SphereImage};
use crate::math::equal_area::equal_area_square_to_sphere;
use crate::math::sampler::mix;
use crate::math::{ONE_MINUS_EPSILON, Rgb};

/// An image around the scene.
#[derive(Debug)]
pub struct Environment {
    image: SphereImage,
    scale: Rgb,
    /// Light space to render space: orthogonal, perhaps a reflection.
    to_render: Mat3,
    /// Cumulative probability of the rows, `height` + 1 values from 0 to 1.
    rows: Box<[f64]>,
    /// For each row, the cumulative probability of its columns in units of 2⁻³²: where each column begins.
    columns: Box<[u32]>,
    mean: Rgb,
    /// Luminance in the real spherical harmonics of order up to 2, each already multiplied by the cosine lobe's coefficient.
    irradiance: [f32; 9],
}

/// Bits of u that a column boundary is given in.
const COLUMN_UNITS: f64 = 4_294_967_296.0;

impl Environment {
    /// `image` times `scale`, turned by the orthogonal matrix `to_render`. `None` for an image without pixels or without light.
    pub fn new(image: SphereImage, scale: Rgb, to_render: Mat3) -> Option<Self> {
        let (rows, columns) = (Box::default(), Box::default());
        let (mean, irradiance) = (Rgb::BLACK, [0.0; 9]);
        let mut environment = Self { image, scale, to_render, rows, columns, mean, irradiance };
        environment.tabulate()?;
        environment.project();
        Some(environment)
    }

    /// Fills `rows` and `columns`.
    fn tabulate(&mut self) -> Option<()> {
        let (width, height) = (self.image.width(), self.image.height());
        let mut rows = vec![0.0f64; height + 1];
        let mut columns = vec![0u32; width * height];
        let mut row = vec![0.0f64; width];
        let mut total = 0.0;
        for y in 0..height {
            let mut sum = 0.0;
            for (x, weight) in row.iter_mut().enumerate() {
                *weight = f64::from(self.image.cell_mean(x as i64, y as i64).mean());
                sum += *weight;
            }
            total += sum * self.image.row_solid_angle(y);
            rows[y + 1] = total;
            quantise(&row, sum, &mut columns[y * width..(y + 1) * width]);
        }
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        rows.iter_mut().for_each(|r| *r /= total);
        rows[height] = 1.0;
        (self.rows, self.columns) = (rows.into(), columns.into());
        Some(())
    }

    /// The mean radiance and the irradiance coefficients.
    fn project(&mut self) {
        let mut mean = [0.0f64; 3];
        let mut harmonics = [0.0f64; 9];
        for (colour, direction, solid_angle) in self.image.pixels() {
            let radiance = self.scale * colour;
            (0..3).for_each(|c| mean[c] += f64::from(radiance[c]) * solid_angle);
            let weight = f64::from(radiance.luminance()) * solid_angle;
            let basis = spherical_harmonics(direction);
            (0..9).for_each(|i| harmonics[i] += weight * f64::from(basis[i]));
        }
        self.mean = Rgb::from(mean.map(|m| (m / (4.0 * std::f64::consts::PI)) as f32));
        // Ramamoorthi & Hanrahan 2001, equation 8: A₀ = π, A₁ = 2π/3, A₂ = π/4.
        let lobe = |i: usize| [PI, 2.0 * PI / 3.0, 0.25 * PI][usize::from(i > 0) + usize::from(i > 3)];
        (0..9).for_each(|i| self.irradiance[i] = lobe(i) * harmonics[i] as f32);
    }

    /// The radiance that arrives from the unit direction `direction` (render space).
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        self.scale * self.image.at(self.local(direction))
    }

    /// `direction` in the image's own space.
    #[inline]
    fn local(&self, direction: Vec3) -> Vec3 {
        (self.to_render.transpose() * direction).normalize_or(Vec3::Z)
    }

    /// The solid-angle pdf of [`Environment::sample`].
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let uv = self.image.uv(self.local(direction));
        let (width, height) = (self.image.width(), self.image.height());
        let x = ((uv.x * width as f32) as usize).min(width - 1);
        let y = ((uv.y * height as f32) as usize).min(height - 1);
        let row = self.rows[y + 1] - self.rows[y];
        let [start, end] = self.column(x, y);
        (row * (end - start) / COLUMN_UNITS / self.image.row_solid_angle(y)) as f32
    }

    /// Where column `x` of row `y` begins and ends, in units of 2⁻³².
    fn column(&self, x: usize, y: usize) -> [f64; 2] {
        let starts = &self.columns[y * self.image.width()..(y + 1) * self.image.width()];
        [f64::from(starts[x]), starts.get(x + 1).map_or(COLUMN_UNITS, |&s| f64::from(s))]
    }

    /// A unit direction (render space) and its solid-angle pdf. The 24 bits of an f32 cannot reach every pixel beside a
    /// sun: a hash of all three numbers, unused otherwise, goes below them.
    pub fn sample(&self, u: [f32; 2], u_part: f64) -> Option<(Vec3, f32)> {
        let bits = mix(u_part.to_bits() ^ mix(u64::from(u[0].to_bits()) << 32 | u64::from(u[1].to_bits())));
        let extended = |u: f32, bits: u64| (f64::from(u) + bits as f64 * 0.5f64.powi(56)).min(1.0 - f64::EPSILON);
        let (u0, u1) = (extended(u[0], bits >> 32), extended(u[1], bits & 0xffff_ffff));
        let (width, height) = (self.image.width(), self.image.height());
        // The last row that begins at or before u1 is the one that is not empty.
        let y = self.rows.partition_point(|&start| start <= u1).clamp(1, height) - 1;
        let row = self.rows[y + 1] - self.rows[y];
        let starts = &self.columns[y * width..(y + 1) * width];
        let position = u0 * COLUMN_UNITS;
        let x = starts.partition_point(|&start| f64::from(start) <= position).max(1) - 1;
        let [start, end] = self.column(x, y);
        let fraction = |f: f64| (f as f32).clamp(0.0, ONE_MINUS_EPSILON);
        let (fx, fy) = (fraction((position - start) / (end - start)), fraction((u1 - self.rows[y]) / row));
        let pdf = (row * (end - start) / COLUMN_UNITS / self.image.row_solid_angle(y)) as f32;
        let local = match self.image.layout() {
            Layout::Octahedral => {
                let size = Vec2::new(width as f32, height as f32);
                equal_area_square_to_sphere(Vec2::new(x as f32 + fx, y as f32 + fy) / size)
            }
            Layout::LatLong => {
                // Uniform in solid angle within the cell: uniform in φ and in 1 − cos θ (or 1 + cos θ, whichever is exact).
                let pi = std::f64::consts::PI;
                let cos = |y: usize| (pi * y as f64 / height as f64).cos();
                let z = cos(y) + (cos(y + 1) - cos(y)) * f64::from(fy);
                let phi = 2.0 * pi * (x as f64 + f64::from(fx)) / width as f64;
                let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
                Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
            }
        };
        (pdf > 0.0 && pdf.is_finite()).then(|| ((self.to_render * local).normalize_or(Vec3::Z), pdf))
    }

    /// The mean radiance over the sphere.
    pub fn mean_radiance(&self) -> Rgb {
        self.mean
    }

    /// An estimate of the luminance received by a surface of this unit normal (render space): nine spherical harmonics, and
    /// never less than a twentieth of what a constant background of the same mean would give.
    #[inline]
    pub fn irradiance(&self, normal: Vec3) -> f32 {
        let basis = spherical_harmonics(self.to_render.transpose() * normal);
        let sum: f32 = (0..9).map(|i| self.irradiance[i] * basis[i]).sum();
        sum.max(0.05 * PI * self.mean.luminance())
    }

    /// What a surface facing +z of light space receives, in luminance: pbrt's measure for `illuminance`.
    pub fn upper_illuminance(&self) -> f32 {
        self.image.upper_illuminance(self.scale)
    }

    /// Multiplies the radiance from everywhere.
    pub fn scale_by(&mut self, factor: f32) {
        self.scale *= factor;
        self.mean *= factor;
        self.irradiance.iter_mut().for_each(|coefficient| *coefficient *= factor);
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.image.memory() + size_of_val(&*self.rows) + size_of_val(&*self.columns)
    }
}

/// Cumulative starts of `weights`, which add up to `sum`, in units of 2⁻³². A positive weight gets at least one unit; a zero
/// weight gets none, except in the last place of a row of zeros (whose row is never chosen).
fn quantise(weights: &[f64], sum: f64, starts: &mut [u32]) {
    let positive_after = |from: usize| weights[from..].iter().filter(|&&w| w > 0.0).count() as u64;
    let mut left = positive_after(0);
    let (mut cumulative, mut start) = (0.0f64, 0u64);
    let last = weights.iter().rposition(|&w| w > 0.0);
    for (i, &weight) in weights.iter().enumerate() {
        // What lies behind the last positive column starts at the very end of the range that u reaches.
        starts[i] = start.min(u64::from(u32::MAX)) as u32;
        if weight > 0.0 {
            left -= 1;
            cumulative += weight;
            let rounded = (cumulative / sum * COLUMN_UNITS).round() as u64;
            start = rounded.max(start + 1).min((1u64 << 32) - left);
        }
        if last == Some(i) {
            start = 1u64 << 32;
        }
    }
}

/// The real spherical harmonics of order 0 to 2 at the unit vector `d`.
fn spherical_harmonics(d: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = d;
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
    ]
}
