//! What makes an emitter's radiance vary: an image over its texture coordinates, and a photometric profile over the directions about its
//! normal. Source: Pharr, Jakob, Humphreys (4th ed.) section 12.4 for the image: bilinear, its top row at v = 1, its edge going on beyond it.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::geometry::sampling::ShapeSampler;
use crate::geometry::{Shape, ShapeKind};
use crate::light::ies::IesProfile;
use crate::math::Rgb;
use crate::math::frame::Frame;
use crate::math::summed_area::SummedArea;

/// Factors on an emitter's radiance.
#[derive(Clone, Debug, Default)]
pub struct EmissionPattern {
    /// By texture coordinates.
    pub image: Option<Arc<EmissionImage>>,
    /// By direction.
    pub profile: Option<DirectionalEmission>,
}

/// A photometric profile about the normal.
#[derive(Clone, Debug)]
pub struct DirectionalEmission {
    /// Its +z is the normal, on either side.
    pub profile: Arc<IesProfile>,
    /// A factor that makes its largest value 1.
    pub scale: f32,
    /// Its +x is as near to this direction of render space as the normal allows.
    pub reference: Vec3,
}

impl EmissionPattern {
    /// The factor at a point with texture coordinates `uv` towards the unit direction `wo`; `normal` is the unit normal on that side.
    #[inline]
    pub fn at(&self, normal: Vec3, wo: Vec3, uv: Vec2) -> Rgb {
        let colour = self.image.as_ref().map_or(Rgb::WHITE, |image| image.at(uv));
        match &self.profile {
            None => colour,
            Some(directional) => {
                let w = Frame::from_zx(normal, directional.reference).to_local(wo);
                colour * (directional.profile.candela(w) * directional.scale)
            }
        }
    }

    /// The mean of the directional factor, by the cosine.
    pub fn directional_mean(&self) -> f32 {
        let of = |d: &DirectionalEmission| d.profile.forward() * d.scale * std::f32::consts::FRAC_1_PI;
        self.profile.as_ref().map_or(1.0, of)
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        let image = self.image.as_ref().map_or(0, |image| image.memory());
        size_of::<Self>() + image + self.profile.as_ref().map_or(0, |d| d.profile.memory())
    }
}

/// An image over texture coordinates.
#[derive(Debug)]
pub struct EmissionImage {
    width: usize,
    height: usize,
    pixels: Box<[[f32; 3]]>,
}

impl EmissionImage {
    /// Of `width` × `height` pixels (finite, not negative; at least one), rows from the top.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), width * height, "the caller gives one triple a pixel");
        Self { width, height, pixels: pixels.into_boxed_slice() }
    }

    /// Place in pixels, from the middle of the first one.
    #[inline]
    fn place(&self, uv: Vec2) -> Vec2 {
        Vec2::new(uv.x, 1.0 - uv.y) * Vec2::new(self.width as f32, self.height as f32) - 0.5
    }

    /// The colour at `uv`.
    #[inline]
    pub fn at(&self, uv: Vec2) -> Rgb {
        let p = self.place(uv);
        if !p.is_finite() {
            return Rgb::BLACK;
        }
        let corner = p.floor();
        let t = p - corner;
        let (x, y) = (corner.x as i64, corner.y as i64);
        let texel = |x: i64, y: i64| {
            let (x, y) = (x.clamp(0, self.width as i64 - 1), y.clamp(0, self.height as i64 - 1));
            Rgb::from(self.pixels[y as usize * self.width + x as usize])
        };
        let row = |y: i64| texel(x, y).lerp(texel(x.saturating_add(1), y), t.x);
        row(y).lerp(row(y.saturating_add(1)), t.y)
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.pixels)
    }
}

/// Sums over rectangles of an image, for as long as lights are built.
#[derive(Debug)]
pub struct ImageSums {
    luminance: SummedArea,
    /// How many pixels are not black.
    lit: SummedArea,
}

impl ImageSums {
    /// Those of `image`.
    pub fn new(image: &EmissionImage) -> Self {
        let pixel = |x: usize, y: usize| Rgb::from(image.pixels[y * image.width + x]);
        let sum = |of: &dyn Fn(Rgb) -> f64| SummedArea::new(image.width, image.height, |x, y| of(pixel(x, y)));
        Self {
            luminance: sum(&|colour| f64::from(colour.luminance())),
            lit: sum(&|colour| f64::from(u8::from(!colour.is_black()))),
        }
    }

    /// The mean luminance over all pixels that look-ups between these texture coordinates read, and whether one of them is lit.
    fn within(&self, image: &EmissionImage, low: Vec2, high: Vec2) -> (f32, bool) {
        // v runs upwards.
        let (from, to) = (image.place(Vec2::new(low.x, high.y)), image.place(Vec2::new(high.x, low.y)));
        let span = |from: f32, to: f32, count: usize| {
            let last = count as f64 - 1.0;
            let first = f64::from(from).floor().clamp(0.0, last);
            // What is no number spans the whole image.
            if from <= to { [first, (f64::from(to).floor() + 1.0).clamp(0.0, last) + 1.0] } else { [0.0, last + 1.0] }
        };
        let (x, y) = (span(from.x, to.x, image.width), span(from.y, to.y, image.height));
        let count = (x[1] - x[0]) * (y[1] - y[0]);
        ((self.luminance.integral(x, y) / count) as f32, self.lit.integral(x, y) > 0.5)
    }
}

/// What an image comes to on a shape.
#[derive(Debug)]
pub struct ImageMeans {
    /// The mean over the shape's area.
    pub overall: Rgb,
    /// For each primitive a weight for choosing points by luminance, for each unit of area: 0 only where the image is black.
    pub weights: Vec<f32>,
}

/// Places along an edge of a primitive where the image is looked up, at most.
const MOST_PLACES: usize = 256;

/// Look-ups on all primitives together, about.
const MOST_LOOKUPS: usize = 1 << 20;

impl ImageMeans {
    /// Of `image` on `shape`. The weight of a primitive is the mean of two: over the places that it covers, as far as they were looked up, and
    /// over the box around its texture coordinates, which misses none.
    pub fn new(image: &EmissionImage, sums: &ImageSums, shape: &Shape, sampler: &ShapeSampler) -> Self {
        let count = shape.primitive_count();
        let most = MOST_LOOKUPS.div_ceil(count.max(1) as usize).isqrt().clamp(1, MOST_PLACES);
        let (mut sum, mut area) = ([0.0f64; 3], 0.0f64);
        let size = Vec2::new(image.width as f32, image.height as f32);
        let weights: Vec<f32> = (0..count)
            .map(|primitive| {
                let (low, high) = uv_box(shape, primitive);
                let (in_box, is_lit) = sums.within(image, low, high);
                let extent = ((high - low) * size).max_element();
                let places = (extent.ceil() as usize).clamp(4, most.max(4));
                let mean = mean_on(image, shape, sampler, primitive, places);
                let share = f64::from(sampler.share_by_area(shape, primitive));
                (0..3).for_each(|c| sum[c] += share * f64::from(mean[c]));
                area += share;
                if is_lit { (0.5 * (mean.luminance() + in_box)).max(f32::MIN_POSITIVE) } else { 0.0 }
            })
            .collect();
        let overall = Rgb::from(sum.map(|s| (s / area) as f32));
        // What is too fine for all look-ups shines nevertheless.
        let least = weights.iter().copied().fold(0.0, f32::max) / count.max(1) as f32;
        Self { overall: if overall.is_black() { Rgb::splat(least) } else { overall }, weights }
    }
}

/// The mean of the image over a primitive's area, by `places`² points of it.
fn mean_on(image: &EmissionImage, shape: &Shape, sampler: &ShapeSampler, primitive: u32, places: usize) -> Rgb {
    let (mut sum, mut total) = ([0.0f64; 3], 0.0f64);
    for k in 0..places * places {
        let u = [k % places, k / places].map(|c| (c as f32 + 0.5) / places as f32);
        let Some(sample) = sampler.sample_on(shape, primitive, u) else { continue };
        let area = 1.0 / f64::from(sample.point.pdf_area);
        if area > 0.0 && area.is_finite() {
            let colour = image.at(sample.point.uv);
            (0..3).for_each(|c| sum[c] += area * f64::from(colour[c]));
            total += area;
        }
    }
    if total > 0.0 { Rgb::from(sum.map(|s| (s / total) as f32)) } else { Rgb::BLACK }
}

/// The box around a primitive's texture coordinates.
fn uv_box(shape: &Shape, primitive: u32) -> (Vec2, Vec2) {
    let around =
        |list: &[Vec2]| list.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(a, b), &uv| (a.min(uv), b.max(uv)));
    match &shape.kind {
        ShapeKind::Triangles(mesh) if !mesh.uvs.is_empty() => {
            around(&mesh.indices[primitive as usize].map(|i| mesh.uvs[i as usize]))
        }
        ShapeKind::Bilinear(mesh) if !mesh.uvs.is_empty() => {
            around(&mesh.indices[primitive as usize].map(|i| mesh.uvs[i as usize]))
        }
        _ => (Vec2::ZERO, Vec2::ONE),
    }
}
