//! How many camera rays a pixel's samples send out besides their paths, to find what shines straight into the camera.
//!
//! Small lamps in plain sight are a matter of antialiasing: whether a sample's camera ray meets them is all there is to know, and of a path that costs dozens
//! of rays it is one. **Ours:** where camera rays disagree about what they see shining, a sample's camera ray is split (Arvo & Kirk 1990): more
//! of them ask that alone, spread over pixel, lens and shutter, and the sample has the mean. Of a sum of two parts with variances V_e / n and V_g / m that take c_e n
//! and c_g m, the least variance times work is where
//!
//! ```text
//! n / m = √(V_e c_g / (V_g c_e)).
//! ```
//!
//! [`PRICE`] stands for c_g / c_e times the square of what is seen over V_g, so only the relative variance of what is seen has to be known.
//!
//! That is learned from what the paths' own camera rays see around a pixel, and a pass goes by what earlier ones saw. The pixel itself has no say: its
//! rays are points of one sequence, each where the others are not, so to split those that come after a lucky one would be bias. Nor have the rays
//! that are split off, whose number neighbours decide about in turn, but for those of the first pass, when all pixels send out as many. So a pixel's
//! rays and how they are split are independent, and nothing is biased.

use rayon::prelude::*;

use crate::film::{PixelBounds, TILE_SIZE};
use crate::math::Rgb;

/// What a path costs by what a camera ray does, where the part of light that is not seen shining varies as much as what is seen is bright.
const PRICE: f64 = 8.0;

/// Rays that a sample sends out besides its path, at most. Twice as many take off another 5 % of the image's error² in `rooms` and cost as much time.
const MOST_RAYS: f64 = 31.0;

/// Rays that a pixel's first sample sends out besides its path, when nothing is known.
const SCOUTS: u8 = 4;

/// What the camera rays of a pixel's paths have seen. In double precision, so that squares of any radiance fit: an image made brighter all over is split as before.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    rays: u32,
    sum: f64,
    squares: f64,
}

impl Seen {
    fn add(&mut self, other: &Self) {
        self.rays = self.rays.saturating_add(other.rays);
        self.sum += other.sum;
        self.squares += other.squares;
    }

    /// The rays that a sample should send out besides its path.
    fn rays(&self) -> u8 {
        let Self { sum, squares, .. } = *self;
        // n Σx² / (Σx)² − 1: variance over the square of the mean.
        let relative = (f64::from(self.rays) * squares / (sum * sum) - 1.0).max(0.0);
        if relative.is_finite() { ((PRICE * relative).sqrt() - 1.0).round().clamp(0.0, MOST_RAYS) as u8 } else { 0 }
    }
}

/// One tile: how many rays its pixels' samples send out, and what they have seen.
#[derive(Clone, Debug)]
pub struct TileSplitting {
    bounds: PixelBounds,
    rays: Vec<u8>,
    seen: Vec<Seen>,
}

impl TileSplitting {
    /// The splitting of the pixel at this place of the tile.
    #[inline]
    pub fn pixel(&self, index: usize) -> PixelSplitting {
        PixelSplitting { rays: u32::from(self.rays[index]), seen: Seen::default() }
    }

    /// Takes over what the paths of a pass have seen in the pixel at this place.
    #[inline]
    pub fn add(&mut self, index: usize, pixel: &PixelSplitting) {
        self.seen[index].add(&pixel.seen);
    }
}

/// One pixel in a pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelSplitting {
    /// Rays that each sample sends out besides its path.
    pub rays: u32,
    seen: Seen,
}

impl PixelSplitting {
    /// A ray has seen this: the camera ray of a path, or one of the first pass's others.
    #[inline]
    pub fn saw(&mut self, radiance: Rgb) {
        let level = f64::from(radiance.mean());
        if level.is_finite() {
            self.seen.add(&Seen { rays: 1, sum: level, squares: level * level });
        }
    }
}

/// All tiles, in the film's order.
#[derive(Clone, Debug)]
pub struct Splitting {
    columns: usize,
    tiles: Vec<TileSplitting>,
}

impl Splitting {
    /// For an image of these tiles, which cover `bounds` row by row.
    pub fn new(tiles: impl Iterator<Item = PixelBounds>, bounds: PixelBounds) -> Self {
        let tile = |bounds: PixelBounds| TileSplitting {
            bounds,
            rays: vec![SCOUTS; bounds.area()],
            seen: vec![Seen::default(); bounds.area()],
        };
        Self { columns: bounds.width().div_ceil(TILE_SIZE) as usize, tiles: tiles.map(tile).collect() }
    }

    /// Bytes that it takes for an image of so many pixels.
    pub const fn memory_for(pixels: usize) -> usize {
        pixels.saturating_mul(size_of::<u8>() + size_of::<Seen>())
    }

    /// The tiles, in the film's order.
    pub fn tiles_mut(&mut self) -> &mut [TileSplitting] {
        &mut self.tiles
    }

    /// The mean number of rays that a sample sends out besides its path.
    pub fn mean(&self) -> f64 {
        let (sum, count) = self
            .tiles
            .iter()
            .flat_map(|tile| &tile.rays)
            .fold((0, 0u64), |(sum, count), &rays| (sum + u64::from(rays), count + 1));
        sum as f64 / count.max(1) as f64
    }

    /// A pass is over: pixels go by what was seen around them.
    pub fn decide(&mut self) {
        let decided: Vec<Vec<u8>> = (0..self.tiles.len()).into_par_iter().map(|number| self.decided(number)).collect();
        for (tile, rays) in self.tiles.iter_mut().zip(decided) {
            tile.rays = rays;
        }
    }

    /// Rays for the pixels of the tile of this number.
    fn decided(&self, number: usize) -> Vec<u8> {
        let columns = self.columns;
        let near = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
        let rows = near(number / columns, self.tiles.len() / columns);
        let around: Vec<&TileSplitting> = rows
            .flat_map(|row| near(number % columns, columns).map(move |column| &self.tiles[row * columns + column]))
            .collect();
        let tile = &self.tiles[number];
        if around.iter().all(|tile| tile.seen.iter().all(|seen| seen.sum == 0.0)) {
            return vec![0; tile.bounds.area()];
        }
        let seen_at = |pixel| {
            let tile = around.iter().find(|tile| tile.bounds.contains(pixel));
            tile.map_or(Seen::default(), |tile| tile.seen[tile.bounds.index(pixel)])
        };
        let rays = |[x, y]: [u32; 2]| {
            let mut pooled = Seen::default();
            for other_y in y.saturating_sub(1)..=y.saturating_add(1) {
                for other_x in x.saturating_sub(1)..=x.saturating_add(1) {
                    if [other_x, other_y] != [x, y] {
                        pooled.add(&seen_at([other_x, other_y]));
                    }
                }
            }
            pooled.rays()
        };
        tile.bounds.pixels().map(rays).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::film_settings;
    use crate::film::{Film, FilmOverrides, FilmTile};

    fn splitting(width: u32, height: u32) -> Splitting {
        let overrides = FilmOverrides { resolution: Some([width, height]), crop: None };
        let film = Film::new(film_settings(vec![], &overrides), false);
        Splitting::new(film.tiles().iter().map(FilmTile::bounds), film.settings().bounds)
    }

    /// The pixel at `at` has seen this much in each of its rays.
    fn show(splitting: &mut Splitting, at: [u32; 2], levels: &[f32]) {
        let tile = splitting.tiles.iter_mut().find(|tile| tile.bounds.contains(at)).unwrap();
        let index = tile.bounds.index(at);
        let mut pixel = tile.pixel(index);
        levels.iter().for_each(|&level| pixel.saw(Rgb::splat(level)));
        tile.add(index, &pixel);
    }

    fn rays(splitting: &Splitting, at: [u32; 2]) -> u32 {
        let tile = splitting.tiles.iter().find(|tile| tile.bounds.contains(at)).unwrap();
        tile.pixel(tile.bounds.index(at)).rays
    }

    #[test]
    fn rays_are_split_where_those_around_disagree() {
        let mut splitting = splitting(40, 20);
        // Half a lamp, the same all over another, a tiny one at the corner of four tiles, one in a thousand rays.
        show(&mut splitting, [5, 5], &[1.0, 0.0]);
        show(&mut splitting, [10, 5], &[7.0, 7.0, 7.0, 7.0]);
        show(&mut splitting, [16, 16], &[1e15; 1]);
        show(&mut splitting, [16, 16], &[0.0; 29]);
        show(&mut splitting, [36, 10], &[1.0; 1]);
        show(&mut splitting, [36, 10], &[0.0; 999]);
        splitting.decide();
        // √(8 · 1) and √(8 · 29), each less the path's own. A pixel knows nothing of itself.
        for (at, expected) in [([4, 6], 2), ([5, 5], 0), ([3, 5], 0), ([10, 6], 0), ([37, 10], 31), ([36, 10], 0)] {
            assert_eq!(rays(&splitting, at), expected, "{at:?}");
        }
        for at in [[15, 15], [16, 15], [15, 16], [17, 17]] {
            assert_eq!(rays(&splitting, at), 14, "{at:?}");
        }
        assert_eq!((rays(&splitting, [16, 16]), rays(&splitting, [18, 16])), (0, 0));
        let [sum, pixels] = [8.0 * (2.0 + 14.0 + 31.0), 40.0 * 20.0];
        assert!((splitting.mean() - sum / pixels).abs() < 1e-9, "{}", splitting.mean());
    }

    #[test]
    fn brightness_is_no_matter_and_nonsense_is_ignored() {
        for level in [1e-38, 1e-15, 1.0, 1e15, 1e38] {
            let mut pixel = PixelSplitting::default();
            (0..9).for_each(|i| pixel.saw(Rgb::splat(if i == 0 { level } else { 0.0 })));
            assert_eq!(pixel.seen.rays(), 7, "{level}");
        }
        for level in [0.0, 1e-40, f32::NAN, f32::INFINITY] {
            let mut pixel = PixelSplitting::default();
            pixel.saw(Rgb::splat(level));
            assert_eq!(pixel.seen.rays(), 0, "{level}");
        }
    }
}
