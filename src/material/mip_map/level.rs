//! The levels of a MIP map (Williams 1983, "Pyramidal Parametrics") and how each is cut into tiles.
//!
//! Each level has half the width and height of the one before, rounded down, and a texel of it is the mean of what it covers there: of two by two texels
//! or, where sizes are odd, of up to three by three, those at its edge in part.

use std::ops::Range;

use super::texels::{Format, Texels};

/// Texels along a tile's sides.
pub const TILE: usize = 64;

/// Where the texels of a level are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// In texels.
    pub width: usize,
    /// In texels.
    pub height: usize,
    /// Number of this level's first tile among all of the image.
    pub first_tile: usize,
    /// Tiles side by side.
    tiles_across: usize,
    /// Width of a tile: [`TILE`], or less where there is one alone.
    tile_width: usize,
    /// Height of a tile.
    tile_height: usize,
}

impl Level {
    /// All levels of an image of that size, the image first, one texel last.
    pub fn all(mut width: usize, mut height: usize) -> Vec<Self> {
        let mut levels = vec![];
        let mut first_tile = 0;
        loop {
            let level = Self {
                width,
                height,
                first_tile,
                tiles_across: width.div_ceil(TILE),
                tile_width: width.min(TILE),
                tile_height: height.min(TILE),
            };
            first_tile += level.tiles();
            levels.push(level);
            if width == 1 && height == 1 {
                return levels;
            }
            (width, height) = ((width / 2).max(1), (height / 2).max(1));
        }
    }

    /// Tiles side by side.
    pub fn tiles_across(&self) -> usize {
        self.tiles_across
    }

    /// How many tiles it is cut into.
    pub fn tiles(&self) -> usize {
        self.tiles_across * self.height.div_ceil(TILE)
    }

    /// Texels of each tile, those beyond the image's edge included.
    pub fn tile_texels(&self) -> usize {
        self.tile_width * self.tile_height
    }

    /// Texels of all tiles.
    pub fn texels(&self) -> usize {
        self.tiles() * self.tile_texels()
    }

    /// The tile (counted within the level) of a texel, and its place there.
    #[inline]
    pub fn place(&self, x: usize, y: usize) -> (usize, usize) {
        let tile = y / TILE * self.tiles_across + x / TILE;
        (tile, y % TILE * self.tile_width + x % TILE)
    }

    /// Copies one tile out of the level's texels in rows, those from row `first` on.
    pub fn cut(&self, rows: &Texels, first: usize, tile: usize, format: &Format, out: &mut [u8]) {
        let size = format.texel_bytes();
        let (x0, y0) = (tile % self.tiles_across * TILE, tile / self.tiles_across * TILE);
        let width = self.tile_width.min(self.width - x0);
        for y in 0..self.tile_height.min(self.height - y0) {
            let from = ((y0 + y - first) * self.width + x0) * size;
            let to = y * self.tile_width * size;
            out[to..to + width * size].copy_from_slice(&rows.as_bytes()[from..from + width * size]);
        }
    }

    /// The texels of the next level, `next`, from those of this one, both in rows.
    pub fn halved(&self, rows: &Texels, next: &Self, format: &Format) -> Texels {
        let mut halved = Texels::zeroed(format.kind, next.width * next.height * format.channels);
        let halving = Halving::new(self, next);
        for y in 0..next.height {
            halving.row(rows, 0, y, format, &mut halved, y * next.width);
        }
        halved
    }
}

/// How a level is made of the one before, row by row.
pub struct Halving {
    from: Level,
    to: Level,
    /// What each place of a row covers, unless that is two by two texels everywhere.
    columns: Option<Box<[Taps]>>,
}

impl Halving {
    /// `to` is the level after `from`.
    pub fn new(from: &Level, to: &Level) -> Self {
        let is_even = from.width == 2 * to.width && from.height == 2 * to.height;
        let columns = (!is_even).then(|| (0..to.width).map(|x| taps(x, from.width, to.width)).collect());
        Self { from: *from, to: *to, columns }
    }

    /// The rows of the level before that row `y` covers; `None` where there is no such row.
    pub fn rows(&self, y: usize) -> Option<Range<usize>> {
        let (from, to) = (self.from.height, self.to.height);
        (y < to).then(|| y * from / to..((y + 1) * from).div_ceil(to))
    }

    /// Makes row `y`, whose first texel is that of number `place` in `out`. `rows` are those of the level before from row `first` on, as far as this one
    /// covers them.
    pub fn row(&self, rows: &Texels, first: usize, y: usize, format: &Format, out: &mut Texels, place: usize) {
        let (from, to) = (self.from.width, self.to.width);
        let Some(columns) = &self.columns else {
            let above = (2 * y - first) * from;
            let below = above + from;
            for x in 0..to {
                let corners = [above, above + 1, below, below + 1].map(|at| rows.get(at + 2 * x, format));
                let [a, b, c, d] = corners;
                let mean = std::array::from_fn(|i| 0.25 * (a[i] + b[i] + c[i] + d[i]));
                out.set(place + x, &mean, format);
            }
            return;
        };
        let lines = taps(y, self.from.height, self.to.height);
        for (x, columns) in columns.iter().enumerate() {
            let mut sum = [0.0; 4];
            for (line, weight) in weighed(&lines) {
                for (column, share) in weighed(columns) {
                    let texel = rows.get((line - first) * from + column, format);
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += weight * share * value;
                    }
                }
            }
            out.set(place + x, &sum, format);
        }
    }
}

/// The first place that something covers, and how much of it is covered there and in the three that follow.
type Taps = (usize, [f32; 4]);

/// What place `i` of `to` covers of `from`, which is at least `to` and below three times that, or both are 1.
fn taps(i: usize, from: usize, to: usize) -> Taps {
    // In whole numbers: place i covers i·from … (i + 1)·from, where places of the other are `to` long.
    let (start, end) = (i * from, (i + 1) * from);
    let first = start / to;
    let mut shares = [0.0; 4];
    for (place, share) in (first..).zip(&mut shares) {
        let covered = end.min((place + 1) * to).saturating_sub(start.max(place * to));
        *share = covered as f32 / from as f32;
    }
    (first, shares)
}

/// Places and weights of those that count.
fn weighed((first, shares): &Taps) -> impl Iterator<Item = (usize, f32)> + '_ {
    (*first..).zip(shares.iter().copied()).filter(|&(_, share)| share > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::image::Encoding;
    use crate::material::mip_map::texels::Kind;

    #[test]
    fn levels_halve_down_to_one_texel() {
        let levels = Level::all(300, 5);
        let sizes: Vec<_> = levels.iter().map(|level| (level.width, level.height)).collect();
        assert_eq!(sizes[..5], [(300, 5), (150, 2), (75, 1), (37, 1), (18, 1)]);
        assert_eq!(sizes.last(), Some(&(1, 1)));
        assert_eq!((levels[0].tiles(), levels[0].tile_texels(), levels[1].first_tile), (5, 320, 5));
        assert_eq!(levels[0].place(130, 4), (2, 4 * 64 + 2));
    }

    #[test]
    fn every_texel_counts_alike_in_every_level() {
        for (width, height) in [(1, 1), (2, 2), (3, 3), (5, 7), (64, 1), (1, 9), (99, 100)] {
            let format = Format::new(1, Kind::Floats, Encoding::Linear);
            let mut rows = Texels::Floats((0..height * width).map(|i| (i * 7 % 11) as f32).collect());
            let mean = |rows: &Texels, texels: usize| {
                (0..texels).map(|i| f64::from(rows.get(i, &format)[0])).sum::<f64>() / texels as f64
            };
            let expected = mean(&rows, width * height);
            for pair in Level::all(width, height).windows(2) {
                rows = pair[0].halved(&rows, &pair[1], &format);
                let found = mean(&rows, pair[1].width * pair[1].height);
                assert!((found - expected).abs() < 1e-5 * (1.0 + expected), "{pair:?}: {found} {expected}");
            }
        }
    }

    #[test]
    fn what_a_texel_covers_is_where_it_is() {
        let format = Format::new(1, Kind::Floats, Encoding::Linear);
        let levels = Level::all(8, 5);
        let rows = Texels::Floats((0..40).map(|i| (i % 8) as f32).collect());
        let halved = levels[0].halved(&rows, &levels[1], &format);
        for (i, expected) in [0.5, 2.5, 4.5, 6.5].repeat(2).into_iter().enumerate() {
            assert!((halved.get(i, &format)[0] - expected).abs() < 1e-5, "{i}: {halved:?}");
        }
    }

    #[test]
    fn means_are_of_light_and_not_of_bytes() {
        let format = Format::new(1, Kind::Bytes, Encoding::Srgb);
        let levels = Level::all(2, 2);
        let rows = Texels::Bytes(vec![0, 255, 255, 0].into());
        let mean = levels[0].halved(&rows, &levels[1], &format);
        assert_eq!(mean, Texels::Bytes(vec![188].into()));
        assert!((mean.get(0, &format)[0] - 0.5).abs() < 0.003);
    }

    #[test]
    fn tiles_are_cut_out_of_rows() {
        let format = Format::new(3, Kind::Bytes, Encoding::Linear);
        let (width, height) = (130, 70);
        let level = Level::all(width, height)[0];
        let rows = Texels::Bytes((0..height * width * 3).map(|i| (i % 251) as u8).collect());
        for (x, y) in [(0, 0), (63, 63), (64, 64), (129, 69), (128, 0)] {
            let (tile, at) = level.place(x, y);
            let mut cut = Texels::zeroed(format.kind, level.tile_texels() * 3);
            level.cut(&rows, 0, tile, &format, cut.as_bytes_mut());
            assert_eq!(cut.get(at, &format), rows.get(y * width + x, &format), "{x} {y}");
        }
    }
}
