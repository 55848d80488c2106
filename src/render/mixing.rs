//! Whether in-scatter sampling pays, and where. The paper leaves that to the artist (Li et al. 2024, section 4.2), because it can cost more
//! than it gains. **Ours:** the first passes draw points everywhere. Each sample then tells what it would have brought without them, and how much of its
//! work they were, so both variance times work are known of the same paths. Between passes each tile keeps what is better, going by itself and
//! the tiles around it.
//!
//! Work is counted in rays and steps, not measured, so the image does not depend on the machine or the number of threads.

use glam::Vec3;

use super::settings::VolumeSampling;
use crate::film::{Moments, PixelBounds, TILE_SIZE};
use crate::integrator::Scratch;
use crate::integrator::in_scatter::InScatter;
use crate::math::Rgb;

/// How far around a tile others count, in tiles.
const AROUND: usize = 1;

/// Points a path that a tile may draw.
const COUNTS: [f32; 4] = [0.0, 1.0, 2.0, 4.0];

/// What one more point must gain to be drawn, and what none must gain for tiles to stop drawing.
const WORTHWHILE: f64 = 0.95;

/// Knots are laid out once a pass, and later passes have more samples: the share of that work that counts.
const KNOTS_LATER: f64 = 0.25;

/// Evidence of one tile from one pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evidence {
    /// Variance of a sample, summed over pixels.
    with: f64,
    /// As it would have been without points drawn.
    without: f64,
    /// Of what the points bring.
    drawn: f64,
    /// Work for all of it, and for the points.
    work: [f64; 2],
}

impl Evidence {
    fn add(&mut self, other: &Self) {
        self.with += other.with;
        self.without += other.without;
        self.drawn += other.drawn;
        self.work = [self.work[0] + other.work[0], self.work[1] + other.work[1]];
    }

    /// The same in parts of this tile's own variance, so that a tile full of noise that points do not touch does not speak for those around it.
    fn relative(&self) -> Self {
        let scale = 1.0 / (self.with + self.without.max(0.0));
        if !scale.is_finite() {
            return Self { work: self.work, ..Self::default() };
        }
        let Self { with, without, drawn, work } = *self;
        Self { with: with * scale, without: without * scale, drawn: drawn * scale, work }
    }

    /// How many points a path should draw where it drew `count` of them: the number with the least variance times work.
    fn best(&self, count: f32) -> f32 {
        let rest = self.work[0] - self.work[1];
        let others = (self.with - self.drawn).max(0.0);
        let none = self.without.max(0.0) * rest;
        let expected = |n: f32| {
            let ratio = f64::from(n / count);
            // Of more points than were tried, only their own variance is known to fall.
            (others + self.drawn / ratio) * (rest + self.work[1] * ratio)
        };
        let mut best = (0.0, none);
        for n in COUNTS.into_iter().filter(|&n| n > 0.0) {
            let value = if n == count { self.with * self.work[0] } else { expected(n) };
            if value < WORTHWHILE * best.1 {
                best = (n, value);
            }
        }
        best.0
    }
}

/// One tile: how many points its paths draw, and what that has come to in the last pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileMix {
    /// Points that each camera path draws.
    count: f32,
    /// Only one pixel in [`SPARSE`] draws them.
    is_sparse: bool,
    evidence: Evidence,
}

/// Of so many pixels one draws points where they are only tried.
const SPARSE: u32 = 4;

/// How far it has come with finding out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// Nothing is to be found out.
    Fixed,
    /// Points are drawn from the pass on that begins after so many samples a pixel.
    Waiting(u32),
    /// Tiles draw points until evidence tells otherwise.
    Adapting,
}

/// All tiles, in the film's order.
#[derive(Clone, Debug)]
pub struct Mixing {
    columns: usize,
    stage: Stage,
    tiles: Vec<TileMix>,
}

impl Mixing {
    /// For an image of this size. `is_shared` is whether the cache points choose lights as well: then they learn without points being drawn, and
    /// a short trial in some of the pixels is enough; else points are drawn from the start, so that there is something to go by.
    pub fn new(bounds: PixelBounds, sampling: Option<VolumeSampling>, is_shared: bool) -> Self {
        let tiles = |pixels: u32| pixels.div_ceil(TILE_SIZE) as usize;
        let (columns, rows) = (tiles(bounds.width()), tiles(bounds.height()));
        let (stage, count) = match sampling {
            None | Some(VolumeSampling::Null) => (Stage::Fixed, 0.0),
            Some(VolumeSampling::Both | VolumeSampling::InScatter | VolumeSampling::EquiAngular) => (Stage::Fixed, 1.0),
            Some(VolumeSampling::Auto) => (Stage::Waiting(if is_shared { 2 } else { 0 }), 0.0),
        };
        let tile = TileMix { count, ..TileMix::default() };
        Self { columns, stage, tiles: vec![tile; columns * rows] }
    }

    /// A pass begins where `done` samples a pixel have been taken.
    pub fn begin_pass(&mut self, done: u32) {
        if let Stage::Waiting(until) = self.stage
            && done >= until
        {
            self.stage = Stage::Adapting;
            self.tiles.fill(TileMix { count: 1.0, is_sparse: until > 0, ..TileMix::default() });
        }
    }

    /// The tiles, in the film's order.
    pub fn tiles_mut(&mut self) -> &mut [TileMix] {
        &mut self.tiles
    }

    /// Whether passes go by what earlier ones came to.
    pub fn adapts(&self) -> bool {
        self.stage == Stage::Adapting
    }

    /// Whether no tile draws points.
    pub fn is_off(&self) -> bool {
        self.tiles.iter().all(|tile| tile.count == 0.0)
    }

    /// The share of tiles that draw points, and the mean number of points that they draw for a path.
    pub fn summary(&self) -> [f64; 2] {
        let on = self.tiles.iter().filter(|tile| tile.count > 0.0).count();
        let points: f64 = self.tiles.iter().map(|tile| f64::from(tile.count)).sum();
        [on as f64 / self.tiles.len().max(1) as f64, if on > 0 { points / on as f64 } else { 0.0 }]
    }

    /// A pass of `samples` a pixel is over: tiles that drew points go by what it showed.
    pub fn decide(&mut self, samples: u32) {
        if !self.adapts() || samples < 2 {
            return;
        }
        let rows = self.tiles.len() / self.columns.max(1);
        let before = self.tiles.clone();
        for (number, tile) in self.tiles.iter_mut().enumerate() {
            if tile.count == 0.0 {
                continue;
            }
            let near = |i: usize, end: usize| i.saturating_sub(AROUND)..(i + AROUND + 1).min(end);
            let mut evidence = Evidence::default();
            for row in near(number / self.columns, rows) {
                for column in near(number % self.columns, self.columns) {
                    let other = &before[row * self.columns + column];
                    if other.count == tile.count {
                        evidence.add(&other.evidence.relative());
                    }
                }
            }
            tile.count = evidence.best(tile.count);
        }
        self.tiles.iter_mut().for_each(|tile| (tile.evidence, tile.is_sparse) = Default::default());
    }
}

/// The samples of one pixel.
#[derive(Default)]
pub struct PixelEvidence {
    /// What they brought, and what of it points that were drawn did.
    brought: Moments,
    /// By how much the square of what they brought would be larger without points drawn.
    more: f64,
}

impl PixelEvidence {
    /// Adds a sample that brought `beauty`.
    #[inline]
    pub fn add(&mut self, beauty: Rgb, scratch: &Scratch) {
        let InScatter { scattered, null_square, drawn, .. } = &scratch.in_scatter;
        self.brought.add(Vec3::new(beauty.luminance(), drawn.luminance(), 0.0).as_dvec3());
        self.more += null_square - f64::from(scattered.luminance()).powi(2);
    }

    /// Adds the pixel to its tile.
    pub fn add_to(&self, tile: &mut TileMix) {
        let count = self.brought.count;
        if count > 1 && self.brought.squares.is_finite() && self.more.is_finite() {
            let [with, drawn, _] = (self.brought.squares / (count - 1) as f64).to_array();
            // The mean is the same with and without: variances differ as squares do.
            let without = with + self.more / count as f64;
            tile.evidence.add(&Evidence { with, without, drawn, work: [0.0; 2] });
        }
    }
}

impl TileMix {
    /// Points that the paths of `pixel` draw.
    #[inline]
    pub const fn count_at(&self, [x, y]: [u32; 2]) -> f32 {
        if self.is_sparse && (x.wrapping_add(2 * y)) % SPARSE != 0 { 0.0 } else { self.count }
    }

    /// Adds what a pixel's samples took: work for all of it, for the points, and for laying out knots.
    pub fn add_work(&mut self, all: u64, [points, knots]: [u64; 2]) {
        let [all, points, knots] = [all, points, knots].map(|n| n as f64);
        let later = KNOTS_LATER * knots;
        self.evidence.add(&Evidence { work: [all - knots + later, points + later], ..Evidence::default() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: PixelBounds = PixelBounds::full(3 * TILE_SIZE, 2 * TILE_SIZE);

    fn mixing(sampling: VolumeSampling, is_shared: bool) -> Mixing {
        Mixing::new(BOUNDS, Some(sampling), is_shared)
    }

    /// A pass after which the tiles know this of variance with and without, and of work for all and for points.
    fn pass(mixing: &mut Mixing, done: u32, samples: u32, evidence: impl Fn(usize) -> Evidence) {
        mixing.begin_pass(done);
        mixing.tiles_mut().iter_mut().enumerate().for_each(|(i, tile)| tile.evidence = evidence(i));
        mixing.decide(samples);
    }

    #[test]
    fn points_are_drawn_where_they_pay() {
        let evidence = |with, without| Evidence { with, without, drawn: 0.5 * with, work: [1.3, 0.3] };
        let mut mixing = mixing(VolumeSampling::Auto, false);
        // One sample tells no variance.
        pass(&mut mixing, 0, 1, |_| evidence(9.0, 1.0));
        assert!(!mixing.is_off());
        // Columns of tiles that gain much, are in between, and gain nothing. The noisiest tile speaks for itself alone.
        pass(&mut mixing, 2, 2, |i| match i % 3 {
            0 => evidence(1.0, 20.0),
            1 => evidence(1e6, 1e6),
            _ => evidence(1.0, 1.0),
        });
        let counts: Vec<f32> = mixing.tiles.iter().map(|tile| tile.count).collect();
        assert!(counts[0] > 0.0 && counts[1] > 0.0 && counts[2] == 0.0, "{counts:?}");
        // What is off stays off.
        pass(&mut mixing, 4, 4, |_| evidence(1.0, 20.0));
        assert!(mixing.tiles[2].count == 0.0 && mixing.tiles[0].count > 0.0);
        pass(&mut mixing, 8, 8, |_| evidence(1.0, 1.0));
        assert!(mixing.is_off());
    }

    #[test]
    fn a_trial_is_short_and_sparse() {
        let mut mixing = mixing(VolumeSampling::Auto, true);
        for done in [0, 1] {
            mixing.begin_pass(done);
            assert!(mixing.is_off());
        }
        mixing.begin_pass(2);
        let drawing = (0..TILE_SIZE).filter(|&x| mixing.tiles[0].count_at([x, 3]) > 0.0).count();
        assert_eq!(drawing as u32, TILE_SIZE / SPARSE);
        assert!(
            !self::mixing(VolumeSampling::Both, true).is_off() && self::mixing(VolumeSampling::Null, true).is_off()
        );
    }
}
