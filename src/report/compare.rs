//! How much two images differ, and whether by more than their noise explains.
//!
//! FLIP: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020), through the crate `nv-flip`. It judges
//! pictures as shown: both images are scaled so that B's mean luminance is 0.18, mapped by x / (1 + x) and sRGB encoded in
//! 8 bits, at the usual 67 pixels per degree.
//!
//! Noise comes from the layers `variance.R/G/B`, the variances of the pixels' means. The three channels of a pixel share
//! their paths and so are correlated by an unknown amount; for their mean full correlation is assumed, which can only
//! overstate the noise: σ = (σ_R + σ_G + σ_B) / 3. Pixels are taken as independent.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::film::exr::read_exr_layers;
use crate::film::image::{Image, ImageError, linear_to_srgb, to_byte, write_png};
use crate::film::{ChannelImage, PixelBounds};
use crate::math::Rgb;
use crate::system::output::OutputError;

/// Width and height of the blocks whose means are compared.
pub const BLOCK: u32 = 8;

/// A block agrees if its mean is within this share of B's.
pub const BLOCK_TOLERANCE: f64 = 0.05;

/// The 97.5th percentile of the normal distribution: half the width of a 95 % interval in standard errors.
const Z95: f64 = 1.959_963_984_540_054;

/// How many of the blocks that differ most are listed.
const WORST: usize = 5;

/// Why two images cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// One cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The picture cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// They do not show the same pixels.
    #[error("the images do not show the same pixels: A has {a}, B has {b}")]
    Shape {
        /// Crop and full size of A.
        a: String,
        /// Crop and full size of B.
        b: String,
    },
    /// One has no colour.
    #[error("{0} has no channels R, G and B")]
    Colour(&'static str),
    /// One has NaN or infinite pixels.
    #[error("{which} has {count} values that are NaN or infinite, the first at pixel {}, {}", pixel[0], pixel[1])]
    NotFinite {
        /// A or B.
        which: &'static str,
        /// How many.
        count: usize,
        /// The first, in the full image.
        pixel: [u32; 2],
    },
}

/// Two images in numbers. A is judged by B.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The pixels compared.
    pub bounds: PixelBounds,
    /// Mean of A over pixels and channels.
    pub mean_a: f64,
    /// Mean of B over pixels and channels.
    pub mean_b: f64,
    /// √ of the mean of (A − B)² over pixels and channels.
    pub rmse: f64,
    /// `rmse` over B's root mean square; 0 where both are 0.
    pub relative_rmse: f64,
    /// Mean of (A − B)² / (B² + ε) over pixels and channels, with ε = 0.01 (mean of B)².
    pub relative_mse: f64,
    /// Mean of A − B over pixels and channels.
    pub bias: Bias,
    /// The same per channel R, G, B.
    pub bias_per_channel: [Bias; 3],
    /// The images whose variance is known: of the others the noise is taken as 0.
    pub variance_from: Vec<&'static str>,
    /// Agreement of block means.
    pub blocks: Blocks,
    /// Mean FLIP error, 0 (alike) to 1.
    pub flip: f64,
}

/// A mean difference.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bias {
    /// Mean of A − B.
    pub value: f64,
    /// The same over B's mean; `None` where that is 0.
    pub relative: Option<f64>,
    /// The 95 % confidence interval of `value`; `None` where neither image has variances.
    pub interval: Option<[f64; 2]>,
}

/// Agreement of the means of blocks of [`BLOCK`] × [`BLOCK`] pixels, over the mean of the channels.
#[derive(Clone, Debug, Serialize)]
pub struct Blocks {
    /// Number of blocks; those at the right and lower edge may be smaller.
    pub count: usize,
    /// Share of blocks within [`BLOCK_TOLERANCE`] of B.
    pub within_tolerance: f64,
    /// Share of blocks with |z| ≤ 1.96, where noise is known: 0.95 or more if only noise differs.
    pub within_noise: Option<f64>,
    /// Mean of z² where noise is known: 1 or less if only noise differs.
    pub mean_z_squared: Option<f64>,
    /// The blocks that differ most: by z where noise is known, else by relative difference.
    pub worst: Vec<Block>,
}

/// The means of one block.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Block {
    /// Its upper left pixel in the full image.
    pub pixel: [u32; 2],
    /// Mean of A.
    pub a: f64,
    /// Mean of B.
    pub b: f64,
    /// (A − B) / √(variance of A + variance of B); 0 where A = B, `None` where they differ without any noise.
    pub z: Option<f64>,
}

/// One image as the comparison needs it.
#[derive(Clone, Debug)]
pub struct Side {
    /// The pixels that are there.
    pub bounds: PixelBounds,
    /// The full image.
    pub display: PixelBounds,
    /// Red, green and blue, all finite.
    pub colour: [Vec<f32>; 3],
    /// The variances of the pixels' means, where the image has them.
    pub variance: Option<[Vec<f32>; 3]>,
    /// What of it is seen without being scattered, where the image has that (layer `emission`).
    pub emission: Option<[Vec<f32>; 3]>,
}

impl Side {
    /// The beauty of `image`, which is called `which` if something is wrong with it.
    ///
    /// # Errors
    /// Images without colour, and values that are not finite.
    pub fn new(image: ChannelImage, which: &'static str) -> Result<Self, CompareError> {
        let own = |planes: [&[f32]; 3]| planes.map(<[f32]>::to_vec);
        let colour = image.rgb("").map(own).ok_or(CompareError::Colour(which))?;
        let variance = image.rgb("variance").map(own);
        let emission = image.rgb("emission").map(own);
        let planes = || colour.iter().chain(variance.iter().flatten()).chain(emission.iter().flatten());
        let count = planes().flatten().filter(|v| !v.is_finite()).count();
        if count > 0 {
            let first = planes().filter_map(|plane| plane.iter().position(|v| !v.is_finite())).min().unwrap_or(0);
            let pixel = image.bounds.pixels().nth(first).unwrap_or_default();
            return Err(CompareError::NotFinite { which, count, pixel });
        }
        Ok(Self { bounds: image.bounds, display: image.display, colour, variance, emission })
    }

    /// Which pixels it has, in words.
    pub fn shape(&self) -> String {
        shape(self.bounds, self.display)
    }

    /// The luminance of pixel `i`.
    pub fn luminance(&self, i: usize) -> f32 {
        Rgb::new(self.colour[0][i], self.colour[1][i], self.colour[2][i]).luminance()
    }

    /// Mean of the channels of pixel `i`.
    fn grey(&self, i: usize) -> f64 {
        self.colour.iter().map(|plane| f64::from(plane[i])).sum::<f64>() / 3.0
    }

    /// Variance of [`Side::grey`], were the channels fully correlated.
    fn grey_variance(&self, i: usize) -> f64 {
        let Some(variance) = &self.variance else { return 0.0 };
        (variance.iter().map(|plane| f64::from(plane[i]).max(0.0).sqrt()).sum::<f64>() / 3.0).powi(2)
    }
}

/// Which pixels there are, and of which image, in words.
pub fn shape(bounds: PixelBounds, display: PixelBounds) -> String {
    let PixelBounds { x0, y0, x1, y1 } = bounds;
    format!("columns {x0}..{x1} and rows {y0}..{y1} of {} × {}", display.width(), display.height())
}

fn read_pair(a: &Path, b: &Path) -> Result<(Side, Side), CompareError> {
    let (a, b) = (Side::new(read_exr_layers(a)?, "A")?, Side::new(read_exr_layers(b)?, "B")?);
    if a.bounds != b.bounds || (a.display.width(), a.display.height()) != (b.display.width(), b.display.height()) {
        return Err(CompareError::Shape { a: a.shape(), b: b.shape() });
    }
    Ok((a, b))
}

/// Compares the beauty of two OpenEXR files of the same size and crop.
pub fn compare(a: &Path, b: &Path) -> Result<Comparison, CompareError> {
    let (a, b) = read_pair(a, b)?;
    Ok(compare_sides(&a, &b))
}

fn compare_sides(a: &Side, b: &Side) -> Comparison {
    let pixels = a.bounds.area();
    let values = 3.0 * pixels as f64;
    let pairs = || {
        let channels = a.colour.iter().zip(&b.colour);
        channels.flat_map(|(a, b)| a.iter().zip(b).map(|(&a, &b)| (f64::from(a), f64::from(b))))
    };
    let mean_a = pairs().map(|(a, _)| a).sum::<f64>() / values;
    let mean_b = pairs().map(|(_, b)| b).sum::<f64>() / values;
    let square = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let power = pairs().map(|(_, b)| b * b).sum::<f64>();
    let epsilon = 0.01 * mean_b * mean_b;
    let ratio = |difference: f64, of: f64| if difference == 0.0 { 0.0 } else { difference / of };
    let relative_mse = pairs().map(|(a, b)| ratio((a - b).powi(2), b * b + epsilon)).sum::<f64>() / values;

    let sides = [("A", a), ("B", b)];
    let variance_from: Vec<&str> = sides.iter().filter(|(_, s)| s.variance.is_some()).map(|(name, _)| *name).collect();
    let is_noise_known = !variance_from.is_empty();
    let bias = |value: f64, mean_b: f64, variance: f64| Bias {
        value,
        relative: (mean_b != 0.0).then(|| value / mean_b),
        interval: is_noise_known.then(|| {
            let half = Z95 * variance.sqrt();
            [value - half, value + half]
        }),
    };
    let n2 = (pixels as f64).powi(2);
    let grey_variance = (0..pixels).map(|i| a.grey_variance(i) + b.grey_variance(i)).sum::<f64>() / n2;
    let bias_per_channel = std::array::from_fn(|c| {
        let mean = |side: &Side| side.colour[c].iter().map(|&v| f64::from(v)).sum::<f64>() / pixels as f64;
        let noise = |side: &Side| {
            side.variance.as_ref().map_or(0.0, |v| v[c].iter().map(|&v| f64::from(v).max(0.0)).sum::<f64>())
        };
        bias(mean(a) - mean(b), mean(b), (noise(a) + noise(b)) / n2)
    });
    Comparison {
        bounds: a.bounds,
        mean_a,
        mean_b,
        rmse: (square / values).sqrt(),
        relative_rmse: ratio(square, power).sqrt(),
        relative_mse,
        bias: bias(mean_a - mean_b, mean_b, grey_variance),
        bias_per_channel,
        variance_from,
        blocks: blocks(a, b, is_noise_known),
        flip: flip(a, b),
    }
}

fn blocks(a: &Side, b: &Side, is_noise_known: bool) -> Blocks {
    let bounds = a.bounds;
    let starts = |from: u32, to: u32| (from..to).step_by(BLOCK as usize);
    let mut all: Vec<Block> = starts(bounds.y0, bounds.y1)
        .flat_map(|y0| starts(bounds.x0, bounds.x1).map(move |x0| [x0, y0]))
        .map(|[x0, y0]| {
            let block = PixelBounds { x0, y0, x1: (x0 + BLOCK).min(bounds.x1), y1: (y0 + BLOCK).min(bounds.y1) };
            let n = block.area() as f64;
            let (mut mean_a, mut mean_b, mut variance) = (0.0, 0.0, 0.0);
            for i in block.pixels().map(|pixel| bounds.index(pixel)) {
                mean_a += a.grey(i) / n;
                mean_b += b.grey(i) / n;
                variance += (a.grey_variance(i) + b.grey_variance(i)) / (n * n);
            }
            let difference = mean_a - mean_b;
            let z = if difference == 0.0 { Some(0.0) } else { (variance > 0.0).then(|| difference / variance.sqrt()) };
            Block { pixel: [x0, y0], a: mean_a, b: mean_b, z }
        })
        .collect();
    let count = all.len();
    let share = |of: usize| of as f64 / count as f64;
    let relative = |block: &Block| {
        let difference = (block.a - block.b).abs();
        if difference == 0.0 { 0.0 } else { difference / block.b.abs() }
    };
    let within_tolerance = share(all.iter().filter(|block| relative(block) <= BLOCK_TOLERANCE).count());
    let z_or_huge = |block: &Block| block.z.map_or(f64::INFINITY, f64::abs);
    let within_noise = is_noise_known.then(|| share(all.iter().filter(|block| z_or_huge(block) <= Z95).count()));
    let known: Vec<f64> = all.iter().filter_map(|block| block.z).collect();
    let mean_z_squared =
        (is_noise_known && !known.is_empty()).then(|| known.iter().map(|z| z * z).sum::<f64>() / known.len() as f64);
    let rank = |block: &Block| if is_noise_known { z_or_huge(block) } else { relative(block) };
    all.sort_by(|p, q| rank(q).total_cmp(&rank(p)));
    all.truncate(WORST);
    Blocks { count, within_tolerance, within_noise, mean_z_squared, worst: all }
}

/// What brings the mean luminance of `b` to 0.18; 1 for a black image.
pub fn exposure_scale(b: &Side) -> f32 {
    let luminance = |i: usize| f64::from(b.luminance(i));
    let mean = (0..b.bounds.area()).map(luminance).sum::<f64>() / b.bounds.area() as f64;
    if mean > 0.0 { (0.18 / mean) as f32 } else { 1.0 }
}

fn flip(a: &Side, b: &Side) -> f64 {
    let scale = exposure_scale(b);
    let (width, height) = (a.bounds.width(), a.bounds.height());
    let shown = |side: &Side| {
        let encode = |v: f32| {
            let v = (v * scale).clamp(0.0, 1e30);
            to_byte(linear_to_srgb(v / (1.0 + v)))
        };
        let bytes: Vec<u8> =
            (0..side.bounds.area()).flat_map(|i| [0, 1, 2].map(|c| encode(side.colour[c][i]))).collect();
        nv_flip::FlipImageRgb8::with_data(width, height, &bytes)
    };
    let map = nv_flip::flip(shown(b), shown(a), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len() as f64
}

/// Writes a PNG of A, B and |A − B| side by side, all scaled so that B's mean luminance is 0.18.
pub fn write_difference(a: &Path, b: &Path, png: &Path) -> Result<(), CompareError> {
    let (a, b) = read_pair(a, b)?;
    let (width, height) = (a.bounds.width() as usize, a.bounds.height() as usize);
    let mut pixels = Vec::with_capacity(width * height * 9);
    for y in 0..height {
        for part in 0..3 {
            for i in y * width..(y + 1) * width {
                pixels.extend((0..3).map(|c| {
                    let (a, b) = (a.colour[c][i], b.colour[c][i]);
                    [a, b, (a - b).abs()][part]
                }));
            }
        }
    }
    let picture = Image { width: width * 3, height, channels: 3, pixels };
    Ok(write_png(png, &picture, exposure_scale(&b).log2())?)
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "mean          A {:.6}, B {:.6}", self.mean_a, self.mean_b)?;
        writeln!(f, "RMSE          {:.6} ({:.4} % of B)", self.rmse, self.relative_rmse * 100.0)?;
        writeln!(f, "relative MSE  {:.6}", self.relative_mse)?;
        write!(f, "bias          {:+.6}", self.bias.value)?;
        if let Some(relative) = self.bias.relative {
            write!(f, " ({:+.4} %)", relative * 100.0)?;
        }
        match self.bias.interval {
            Some([low, high]) => {
                writeln!(f, ", 95 % within {low:+.6} to {high:+.6} (noise of {})", self.variance_from.join(" and "))?;
            }
            None => writeln!(f, ", noise unknown: neither image has variance layers")?,
        }
        let blocks = &self.blocks;
        let (tolerance, within) = (BLOCK_TOLERANCE * 100.0, blocks.within_tolerance * 100.0);
        write!(f, "blocks        {within:.1} % of {} within {tolerance} %", blocks.count)?;
        if let Some(share) = blocks.within_noise {
            write!(f, ", {:.1} % within 1.96 σ", share * 100.0)?;
        }
        if let Some(z2) = blocks.mean_z_squared {
            write!(f, ", mean z² {z2:.3}")?;
        }
        writeln!(f)?;
        for block in blocks.worst.iter().filter(|block| block.a != block.b) {
            let z = block.z.map_or("without noise".to_owned(), |z| format!("z {z:+.2}"));
            writeln!(f, "  at {:>5}, {:<5} A {:.6}, B {:.6}, {z}", block.pixel[0], block.pixel[1], block.a, block.b)?;
        }
        writeln!(f, "FLIP          {:.5}", self.flip)
    }
}

#[cfg(test)]
mod tests;
