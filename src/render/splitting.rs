//! How many camera rays a pixel's samples send out besides their paths, to find what shines straight into the camera.
//!
//! Small lamps in plain sight are a matter of antialiasing: whether a sample's camera ray meets them is all there is to know, and of a path that costs dozens
//! of rays it is one. **Ours:** where camera rays disagree about what they see shining, a sample's camera ray is split (Arvo & Kirk 1990): more
//! of them ask that alone, spread over pixel, lens and shutter. If Y is what a path's ray sees shining, Ȳ the mean over all rays and G what the path brings
//! besides, the sample is
//!
//! ```text
//! G + Y + β (Ȳ − Y),
//! ```
//!
//! right for any β that does not depend on it. The best is Cov(G + Y, Y) / Var Y: 1 if lamps are much brighter than what they light, 0 before a sky as bright
//! as the ground, where G makes up for what Y lacks. With G = g wherever nothing shines it is 1 − g P(Y = 0) E Y / Var Y.
//!
//! Of a sum of two parts with variances V_e / n and V_g / m that take c_e n and c_g m, the least variance times work is where
//!
//! ```text
//! n / m = √(V_e c_g / (V_g c_e)).
//! ```
//!
//! [`PRICE`] stands for c_g / c_e times the square of what is seen over V_g, so only β² and the relative variance of what is seen have to be known.
//!
//! That is learned from what the paths' own camera rays see around a pixel, and a pass goes by what earlier ones saw. The pixel itself has no say: its
//! rays are points of one sequence, each where the others are not, so to split those that come after a lucky one would be bias. Nor have the rays
//! that are split off, whose number neighbours decide about in turn, but for those of the first pass, when all pixels send out as many. So a pixel's
//! rays and how they are split are independent, and nothing is biased. g is of the first pass too, before anything was learned, and of those pixels of
//! the tile that are of the other colour on a chessboard.

use rayon::prelude::*;

use crate::film::{PixelBounds, TILE_SIZE};
use crate::math::Rgb;
use crate::system::plain_bytes;

/// What a path costs by what a camera ray does, where the part of light that is not seen shining varies as much as what is seen is bright.
const PRICE: f64 = 8.0;

/// Rays that a sample sends out besides its path, at most. In `rooms` 63 left 2 % less error² than 15 and took 9 % longer.
const MOST_RAYS: f64 = 31.0;

/// Rays that a pixel's first sample sends out besides its path, when nothing is known.
const SCOUTS: u32 = 4;

/// Of what the paths of a tile bring, the share that does not count, at the bright end: single bright paths.
const BRIGHTEST: f64 = 1.0 / 32.0;

/// What the samples of a pixel do.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Split {
    /// Rays that each sends out besides its path.
    pub rays: u32,
    /// How much what they see counts.
    pub beta: f32,
}

/// What camera rays have seen. In double precision, so that squares of any radiance fit: an image made brighter all over is split as before.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Seen {
    rays: u32,
    /// How many of them have seen nothing shine.
    dark: u32,
    sum: f64,
    squares: f64,
}

impl Seen {
    fn add(&mut self, other: &Self) {
        self.rays = self.rays.saturating_add(other.rays);
        self.dark = self.dark.saturating_add(other.dark);
        self.sum += other.sum;
        self.squares += other.squares;
    }

    /// What a sample should do where paths bring `level` besides, if they see nothing shine.
    fn split(&self, level: f64) -> Split {
        let rays = f64::from(self.rays);
        let (mean, dark) = (self.sum / rays, f64::from(self.dark) / rays);
        let variance = self.squares / rays - mean * mean;
        let beta = (1.0 - level * dark * (mean / variance)).clamp(0.0, 1.0);
        let relative = beta * beta * (variance / (mean * mean));
        if relative.is_finite() && relative > 0.0 {
            let rays = ((PRICE * relative).sqrt() - 1.0).round().clamp(0.0, MOST_RAYS);
            Split { rays: rays as u32, beta: beta as f32 }
        } else {
            Split::default()
        }
    }
}

/// One pixel in a pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelSplitting {
    /// What its samples do.
    pub split: Split,
    seen: Seen,
    /// What the last path brought that saw nothing shine.
    brought: Option<f32>,
}

impl PixelSplitting {
    /// A ray has seen this: the camera ray of a path, or one of the first pass's others.
    #[inline]
    pub fn saw(&mut self, radiance: Rgb) {
        let level = f64::from(radiance.mean());
        if level.is_finite() {
            self.seen.add(&Seen { rays: 1, dark: u32::from(level == 0.0), sum: level, squares: level * level });
        }
    }

    /// A path that saw nothing shine brought this.
    #[inline]
    pub fn brought(&mut self, radiance: Rgb) {
        self.brought = Some(radiance.mean());
    }
}

/// One tile.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct TileSplitting {
    bounds: PixelBounds,
    #[serde(with = "plain_bytes")]
    splits: Vec<Split>,
    #[serde(with = "plain_bytes")]
    seen: Vec<Seen>,
    /// In the first pass, what the pixels' paths bring that see nothing shine; then empty.
    #[serde(with = "plain_bytes")]
    brought: Vec<f32>,
    /// The mean of that over either colour of the chessboard.
    levels: [f64; 2],
}

impl TileSplitting {
    /// The splitting of the pixel at this place of the tile.
    #[inline]
    pub fn pixel(&self, index: usize) -> PixelSplitting {
        PixelSplitting { split: self.splits[index], ..PixelSplitting::default() }
    }

    /// Takes over what the paths of a pass have seen and brought in the pixel at this place.
    #[inline]
    pub fn add(&mut self, index: usize, pixel: &PixelSplitting) {
        self.seen[index].add(&pixel.seen);
        if let (Some(brought), Some(sample)) = (self.brought.get_mut(index), pixel.brought) {
            *brought = sample;
        }
    }

    /// After the first pass: what paths bring.
    fn settle(&mut self) {
        for (of, level) in self.levels.iter_mut().enumerate().filter(|_| !self.brought.is_empty()) {
            let of_colour = self.bounds.pixels().zip(&self.brought).filter(|(pixel, _)| colour(*pixel) == of);
            let mut values: Vec<f32> = of_colour.map(|(_, &value)| value).filter(|value| value.is_finite()).collect();
            values.sort_unstable_by(f32::total_cmp);
            values.truncate((values.len() as f64 * (1.0 - BRIGHTEST)).ceil() as usize);
            *level = values.iter().copied().map(f64::from).sum::<f64>() / values.len().max(1) as f64;
        }
        self.brought = vec![];
    }
}

/// Of a chessboard's squares.
const fn colour([x, y]: [u32; 2]) -> usize {
    ((x ^ y) & 1) as usize
}

/// All tiles, in the film's order.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Splitting {
    columns: usize,
    tiles: Vec<TileSplitting>,
}

impl Splitting {
    /// For an image of these tiles, which cover `bounds` row by row. `has_sky` is whether an environment may be seen, which may be no brighter than what it lights.
    pub fn new(tiles: impl Iterator<Item = PixelBounds>, bounds: PixelBounds, has_sky: bool) -> Self {
        let first = Split { rays: SCOUTS, beta: if has_sky { 0.0 } else { 1.0 } };
        let tile = |bounds: PixelBounds| TileSplitting {
            bounds,
            splits: vec![first; bounds.area()],
            seen: vec![Seen::default(); bounds.area()],
            brought: vec![f32::NAN; bounds.area()],
            levels: [0.0; 2],
        };
        Self { columns: bounds.width().div_ceil(TILE_SIZE) as usize, tiles: tiles.map(tile).collect() }
    }

    /// Bytes that it takes for an image of so many pixels.
    pub const fn memory_for(pixels: usize) -> usize {
        pixels.saturating_mul(size_of::<Split>() + size_of::<Seen>() + size_of::<f32>())
    }

    /// Whether it is for the same image.
    pub fn is_like(&self, other: &Self) -> bool {
        let shape = |tile: &TileSplitting| (tile.bounds, [tile.splits.len(), tile.seen.len()]);
        self.columns == other.columns && self.tiles.iter().map(shape).eq(other.tiles.iter().map(shape))
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
            .flat_map(|tile| &tile.splits)
            .fold((0, 0u64), |(sum, count), split| (sum + u64::from(split.rays), count + 1));
        sum as f64 / count.max(1) as f64
    }

    /// A pass is over: pixels go by what was seen around them.
    pub fn decide(&mut self) {
        self.tiles.par_iter_mut().for_each(TileSplitting::settle);
        let decided: Vec<Vec<Split>> =
            (0..self.tiles.len()).into_par_iter().map(|number| self.decided(number)).collect();
        for (tile, splits) in self.tiles.iter_mut().zip(decided) {
            tile.splits = splits;
        }
    }

    /// What the samples of the pixels of the tile of this number should do.
    fn decided(&self, number: usize) -> Vec<Split> {
        let columns = self.columns;
        let near = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
        let rows = near(number / columns, self.tiles.len() / columns);
        let around: Vec<&TileSplitting> = rows
            .flat_map(|row| near(number % columns, columns).map(move |column| &self.tiles[row * columns + column]))
            .collect();
        let tile = &self.tiles[number];
        if around.iter().all(|tile| tile.seen.iter().all(|seen| seen.sum == 0.0)) {
            return vec![Split::default(); tile.bounds.area()];
        }
        let seen_at = |pixel| {
            let tile = around.iter().find(|tile| tile.bounds.contains(pixel));
            tile.map_or(Seen::default(), |tile| tile.seen[tile.bounds.index(pixel)])
        };
        let split = |[x, y]: [u32; 2]| {
            let mut pooled = Seen::default();
            for other_y in y.saturating_sub(1)..=y.saturating_add(1) {
                for other_x in x.saturating_sub(1)..=x.saturating_add(1) {
                    if [other_x, other_y] != [x, y] {
                        pooled.add(&seen_at([other_x, other_y]));
                    }
                }
            }
            pooled.split(tile.levels[1 - colour([x, y])])
        };
        tile.bounds.pixels().map(split).collect()
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
        Splitting::new(film.tiles().iter().map(FilmTile::bounds), film.settings().bounds, false)
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
        tile.pixel(tile.bounds.index(at)).split.rays
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

    /// Half of what is seen is as bright as what is lit, half as bright, or much brighter.
    #[test]
    fn what_makes_up_for_what_is_not_seen_counts() {
        let mut pixel = PixelSplitting::default();
        (0..8).for_each(|i| pixel.saw(Rgb::splat((i % 2) as f32)));
        for (level, beta, rays) in [(1.0, 0.0, 0), (2.0, 0.0, 0), (0.5, 0.5, 0), (0.01, 0.99, 2), (0.0, 1.0, 2)] {
            let split = pixel.seen.split(level);
            assert!((f64::from(split.beta) - beta).abs() < 1e-6 && split.rays == rays, "{level}: {split:?}");
        }
    }

    /// A firefly does not count, nor do pixels whose paths see a lamp.
    #[test]
    fn levels_are_of_a_colour() {
        let mut splitting = splitting(16, 16);
        let tile = &mut splitting.tiles[0];
        let pixels: Vec<[u32; 2]> = tile.bounds.pixels().collect();
        for (index, pixel) in pixels.into_iter().enumerate().skip(16) {
            let mut splitting = PixelSplitting::default();
            splitting.brought(Rgb::splat(if index == 77 { 1e9 } else { [2.0, 3.0][colour(pixel)] }));
            tile.add(index, &splitting);
        }
        tile.settle();
        assert_eq!(tile.levels, [2.0, 3.0]);
        assert!(tile.brought.is_empty());
        tile.settle();
        assert_eq!(tile.levels, [2.0, 3.0]);
    }

    #[test]
    fn brightness_is_no_matter_and_nonsense_is_ignored() {
        for level in [1e-38, 1e-15, 1.0, 1e15, 1e38] {
            let mut pixel = PixelSplitting::default();
            (0..9).for_each(|i| pixel.saw(Rgb::splat(if i == 0 { level } else { 0.0 })));
            let split = pixel.seen.split(0.0);
            assert_eq!(split, Split { rays: 7, beta: 1.0 }, "{level}");
        }
        for level in [0.0, 1e-40, f32::NAN, f32::INFINITY] {
            let mut pixel = PixelSplitting::default();
            pixel.saw(Rgb::splat(level));
            assert_eq!(pixel.seen.split(1.0), Split::default(), "{level}");
        }
    }
}
