//! Pixels, AOVs, image files.
//!
//! A [`Film`] is made of tiles; in a pass each tile belongs to one thread, which merges [`PixelSamples`] into its pixels. A
//! pixel's value depends on its samples and the division into passes only, so not on the number of threads.

pub mod accumulate;
pub mod exr;
pub mod filter;
pub mod gbuffer;
mod gif;
pub mod image;
pub mod merge;
pub mod pfm;
pub mod png_rows;
pub mod settings;
mod signed;
pub mod stored_image;
#[cfg(test)]
pub(crate) mod tests;

use glam::DVec3;

pub use accumulate::{Moments, PixelSamples, SampleResult};
pub use exr::ChannelImage;
pub use filter::{FilterSample, PixelFilter};
pub use settings::{FilmOverrides, FilmSettings, Sensor};

use crate::system::plain_bytes;
use accumulate::AovSums;
use gbuffer::SurfaceSums;
use signed::SignedSums;

/// A rectangle of pixels, counted from the top left corner of the full image; `x1`, `y1` are just outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PixelBounds {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl PixelBounds {
    /// The rectangle from (0, 0) of this size.
    pub const fn full(width: u32, height: u32) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width() as usize * self.height() as usize
    }

    /// Whether the pixel lies within.
    pub const fn contains(&self, [x, y]: [u32; 2]) -> bool {
        x >= self.x0 && x < self.x1 && y >= self.y0 && y < self.y1
    }

    /// The pixel's place in rows from the top; the pixel must lie within.
    pub const fn index(&self, [x, y]: [u32; 2]) -> usize {
        (y - self.y0) as usize * self.width() as usize + (x - self.x0) as usize
    }

    /// All pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| [x, y]))
    }
}

/// Width and height of a tile in pixels.
pub const TILE_SIZE: u32 = 16;

/// A square of the film with what its pixels have gathered.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct FilmTile {
    bounds: PixelBounds,
    #[serde(with = "plain_bytes")]
    beauty: Vec<Moments>,
    /// Empty where the render has no AOVs.
    #[serde(with = "plain_bytes")]
    aovs: Vec<AovSums>,
    /// Empty but for a `gbuffer` film.
    #[serde(with = "plain_bytes")]
    surfaces: Vec<SurfaceSums>,
    /// Empty but for filters with negative lobes.
    #[serde(with = "plain_bytes")]
    signed: Vec<SignedSums>,
    rejected: u64,
    first_rejected: Option<RejectedSample>,
}

impl FilmTile {
    /// The pixels of this tile.
    pub fn bounds(&self) -> PixelBounds {
        self.bounds
    }

    /// The mean over the channels of what `pixel`, which must lie within the tile, has gathered so far; at least 0, whatever the filter takes away.
    pub fn level(&self, pixel: [u32; 2]) -> f64 {
        (self.beauty[self.bounds.index(pixel)].mean.element_sum() / 3.0).max(0.0)
    }

    /// The mean of that over all its pixels.
    pub fn mean_level(&self) -> f64 {
        let sum: f64 = self.beauty.iter().map(|moments| moments.mean.element_sum() / 3.0).sum();
        (sum / self.beauty.len() as f64).max(0.0)
    }

    /// Joins the samples of a pass to those of `pixel`, which must lie within the tile.
    pub fn merge(&mut self, pixel: [u32; 2], samples: &PixelSamples) {
        let index = self.bounds.index(pixel);
        self.beauty[index].merge(&samples.beauty);
        if let Some(aovs) = self.aovs.get_mut(index) {
            aovs.merge(&samples.aovs);
        }
        if let Some(surfaces) = self.surfaces.get_mut(index) {
            surfaces.merge(&samples.surfaces);
        }
        if let Some(signed) = self.signed.get_mut(index) {
            signed.merge(&samples.signed);
        }
        self.rejected += samples.rejected;
        if let Some(sample) = samples.first_rejected {
            self.first_rejected.get_or_insert(RejectedSample { pixel, sample });
        }
    }
}

/// A sample that was NaN or infinite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RejectedSample {
    /// In the full image.
    pub pixel: [u32; 2],
    /// Its index in the pixel.
    pub sample: u32,
}

/// The image while it is being rendered.
#[derive(Clone, Debug)]
pub struct Film {
    settings: FilmSettings,
    has_aovs: bool,
    tiles: Vec<FilmTile>,
}

impl Film {
    /// An empty film. A pixel takes 56 bytes, 160 more with `aovs`, 112 more as a `gbuffer`, and 144 more with
    /// a filter that has negative lobes.
    pub fn new(settings: FilmSettings, has_aovs: bool) -> Self {
        let all = settings.bounds;
        let starts = |from: u32, to: u32| (from..to).step_by(TILE_SIZE as usize);
        let tiles = starts(all.y0, all.y1)
            .flat_map(|y0| starts(all.x0, all.x1).map(move |x0| (x0, y0)))
            .map(|(x0, y0)| {
                let bounds = PixelBounds {
                    x0,
                    y0,
                    x1: x0.saturating_add(TILE_SIZE).min(all.x1),
                    y1: y0.saturating_add(TILE_SIZE).min(all.y1),
                };
                FilmTile {
                    bounds,
                    beauty: vec![Moments::default(); bounds.area()],
                    aovs: vec![AovSums::default(); if has_aovs { bounds.area() } else { 0 }],
                    surfaces: vec![SurfaceSums::default(); if settings.gbuffer.is_some() { bounds.area() } else { 0 }],
                    signed: vec![SignedSums::default(); if settings.filter.is_signed() { bounds.area() } else { 0 }],
                    rejected: 0,
                    first_rejected: None,
                }
            })
            .collect();
        Self { settings, has_aovs, tiles }
    }

    /// Bytes that [`Film::new`] would take.
    pub fn memory_for(settings: &FilmSettings, has_aovs: bool) -> usize {
        let aovs = if has_aovs { size_of::<AovSums>() } else { 0 };
        let surfaces = if settings.gbuffer.is_some() { size_of::<SurfaceSums>() } else { 0 };
        let signed = if settings.filter.is_signed() { size_of::<SignedSums>() } else { 0 };
        settings.bounds.area() * (size_of::<Moments>() + aovs + surfaces + signed)
    }

    /// What it was made from.
    pub fn settings(&self) -> &FilmSettings {
        &self.settings
    }

    /// The tiles, row by row from the top left: hand each to one thread.
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        &mut self.tiles
    }

    /// The tiles, to look at.
    pub fn tiles(&self) -> &[FilmTile] {
        &self.tiles
    }

    /// Goes on from tiles of another film of the same kind; false, and nothing is changed, where they are not.
    #[must_use]
    pub fn restore(&mut self, tiles: Vec<FilmTile>) -> bool {
        let shape = |tile: &FilmTile| {
            (tile.bounds, [tile.beauty.len(), tile.aovs.len(), tile.surfaces.len(), tile.signed.len()])
        };
        let fits = tiles.len() == self.tiles.len() && tiles.iter().zip(&self.tiles).all(|(a, b)| shape(a) == shape(b));
        if fits {
            self.tiles = tiles;
        }
        fits
    }

    /// Samples taken so far, over all pixels, without the rejected ones.
    pub fn sample_count(&self) -> u64 {
        self.tiles.iter().flat_map(|t| &t.beauty).map(|m| m.count).sum()
    }

    /// How many samples were NaN or infinite, and the first of them: in a tile by passes and then pixels, of the tiles' first ones the one of
    /// the least index.
    pub fn rejected(&self) -> (u64, Option<RejectedSample>) {
        let first = self.tiles.iter().filter_map(|t| t.first_rejected).min_by_key(|rejected| rejected.sample);
        (self.tiles.iter().map(|t| t.rejected).sum(), first)
    }

    /// Whether no sample so far has brought any light.
    pub fn is_black(&self) -> bool {
        self.tiles.iter().flat_map(|tile| &tile.beauty).all(|moments| moments.mean == DVec3::ZERO)
    }

    /// The relative standard error of the image: √(Σ v / Σ m²) over pixels and channels, m being a channel's mean and v the
    /// variance of that mean. It is the RMSE to expect, over the image's root mean square. `None` until every pixel has two
    /// samples, but for pixels whose samples were all rejected; 0 for an image that is black so far.
    pub fn error_estimate(&self) -> Option<f64> {
        let (mut noise, mut signal) = (0.0, 0.0);
        let pixels = self.tiles.iter().flat_map(|tile| (0..tile.beauty.len()).map(move |i| (tile, i)));
        for (tile, i) in pixels {
            let (moments, _) = self.resolved(tile, i);
            if moments.count < 2 {
                if tile.rejected > 0 {
                    continue;
                }
                return None;
            }
            noise += moments.variance_of_mean().element_sum();
            signal += moments.mean.length_squared();
        }
        Some(if signal > 0.0 { (noise / signal).sqrt() } else { 0.0 })
    }

    /// The beauty as an RGB picture of the crop.
    pub fn beauty(&self) -> image::Image {
        let bounds = self.settings.bounds;
        let mut pixels = vec![0.0f32; bounds.area() * 3];
        self.each_pixel(|index, moments, _, _| {
            pixels[index * 3..index * 3 + 3].copy_from_slice(&moments.mean.as_vec3().to_array());
        });
        image::Image { width: bounds.width() as usize, height: bounds.height() as usize, channels: 3, pixels }
    }

    /// All channels, for [`exr::write_exr`]: `R G B`, `variance.R/G/B` (of the mean) and `samples`, and with AOVs the layers
    /// `direct`, `indirect`, `emission`, `volume`, `albedo` (R, G, B), `normal` (X, Y, Z: not renormalised), `depth.Z`
    /// (over the samples that hit something; 0 where none did) and `depth.samples` (how many did); of a `gbuffer` film [`gbuffer::CHANNELS`]. The attribute `lanternfish.biased` is there if the sensor cut samples.
    pub fn channels(&self) -> ChannelImage {
        let bounds = self.settings.bounds;
        let [width, height] = self.settings.resolution;
        let mut names: Vec<String> = ["R", "G", "B", "variance.R", "variance.G", "variance.B", "samples"]
            .iter()
            .map(|name| (*name).to_owned())
            .collect();
        if self.has_aovs {
            for layer in ["direct", "indirect", "emission", "volume", "albedo"] {
                names.extend(["R", "G", "B"].iter().map(|c| format!("{layer}.{c}")));
            }
            names.extend(["normal.X", "normal.Y", "normal.Z", "depth.Z", "depth.samples"].map(str::to_owned));
        }
        if self.settings.gbuffer.is_some() {
            names.extend(gbuffer::CHANNELS.map(str::to_owned));
        }
        let mut planes = vec![vec![0.0f32; bounds.area()]; names.len()];
        self.each_pixel(|index, moments, aovs, surfaces| {
            let mut plane = planes.iter_mut();
            let mut put = |values: &[f64]| {
                // In this order zip takes no plane after the last value.
                for (value, plane) in values.iter().zip(plane.by_ref()) {
                    plane[index] = merge::bounded(*value);
                }
            };
            put(&moments.mean.to_array());
            put(&moments.variance_of_mean().to_array());
            put(&[moments.count as f64]);
            if let Some(sums) = aovs {
                let scale = if moments.count > 0 { 1.0 / moments.count as f64 } else { 0.0 };
                let of = |sum: DVec3| (sum * scale).to_array();
                for sum in [sums.direct, sums.indirect, sums.emission, sums.volume, sums.albedo, sums.normal] {
                    put(&of(sum));
                }
                let hits = sums.hits as f64;
                put(&[if sums.hits > 0 { sums.depth / hits } else { 0.0 }, hits]);
            }
            if let Some(sums) = surfaces {
                let scale = if moments.count > 0 { 1.0 / moments.count as f64 } else { 0.0 };
                let albedo = aovs.map_or(DVec3::ZERO, |sums| sums.albedo * scale);
                put(&gbuffer::values(albedo, sums, moments));
            }
        });
        ChannelImage {
            bounds,
            display: PixelBounds::full(width, height),
            channels: names.into_iter().zip(planes).collect(),
            attributes: self.bias_note().into_iter().collect(),
        }
    }

    /// The header's word on samples that the sensor cuts.
    fn bias_note(&self) -> Option<(String, String)> {
        let sensor = self.settings.sensor;
        let note = format!("samples brighter than {} were cut down to it (maxcomponentvalue)", sensor.max_component);
        sensor.is_biased().then(|| ("lanternfish.biased".to_owned(), note))
    }

    /// What the image has of pixel number `i` of `tile`.
    fn resolved(&self, tile: &FilmTile, i: usize) -> (Moments, Option<AovSums>) {
        let (mut moments, mut aovs) = (tile.beauty[i], tile.aovs.get(i).copied());
        if let Some(signed) = tile.signed.get(i) {
            let width = tile.bounds.width() as usize;
            let [x, y] = [tile.bounds.x0 + (i % width) as u32, tile.bounds.y0 + (i / width) as u32];
            let mut around = SignedSums::default();
            for neighbour in (0..9).filter(|&n| n != 4) {
                let place = [(x + neighbour % 3).wrapping_sub(1), (y + neighbour / 3).wrapping_sub(1)];
                if let Some(sums) = self.signed(place) {
                    around.merge(sums);
                }
            }
            signed.correct(&around, &mut moments, aovs.as_mut());
        }
        (moments, aovs)
    }

    /// The sums of `pixel`, if it is there.
    fn signed(&self, pixel: [u32; 2]) -> Option<&SignedSums> {
        let all = self.settings.bounds;
        if !all.contains(pixel) {
            return None;
        }
        let [column, row] = [(pixel[0] - all.x0) / TILE_SIZE, (pixel[1] - all.y0) / TILE_SIZE];
        let tile = &self.tiles[(row * all.width().div_ceil(TILE_SIZE) + column) as usize];
        tile.signed.get(tile.bounds.index(pixel))
    }

    /// Calls `f` with each pixel's place in rows from the top of the crop.
    fn each_pixel(&self, mut f: impl FnMut(usize, &Moments, Option<&AovSums>, Option<&SurfaceSums>)) {
        for tile in &self.tiles {
            for (i, pixel) in tile.bounds.pixels().enumerate() {
                let (moments, aovs) = self.resolved(tile, i);
                f(self.settings.bounds.index(pixel), &moments, aovs.as_ref(), tile.surfaces.get(i));
            }
        }
    }
}
