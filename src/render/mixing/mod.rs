//! Whether in-scatter sampling pays, and where. The paper leaves that to the artist (Li et al. 2024, section 4.2), because it can cost more
//! than it gains. **Ours:** the first passes draw points everywhere. Each sample then tells what it would have brought without them, and how much of its
//! work they were, so both variance times work are known of the same paths. Between passes each tile keeps what is better, going by itself and
//! the tiles around it.
//!
//! Work is counted in rays and steps, not measured, so the image does not depend on the machine or the number of threads.

mod evidence;

use super::settings::VolumeSampling;
use crate::film::{PixelBounds, TILE_SIZE};
use crate::integrator::in_scatter::PointWork;
use crate::integrator::in_scatter::alternatives::Mix;
pub use evidence::PixelEvidence;
use evidence::{Evidence, Way};

/// How far around a tile others count, in tiles.
const AROUND: usize = 1;

/// Pixels count as no darker than this share of their tile's mean.
const DARKEST: f64 = 0.1;

/// One tile: what its paths do, and what that has come to in the last pass.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct TileMix {
    way: Way,
    /// Only one pixel in [`SPARSE`] draws them.
    is_sparse: bool,
    evidence: Evidence,
    /// No pixel counts as darker than this.
    floor: f64,
}

/// Of so many pixels one draws points where they are only tried.
const SPARSE: u32 = 8;

/// How far it has come with finding out.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
enum Stage {
    /// Nothing is to be found out.
    Fixed,
    /// Points are drawn from the pass on that begins after so many samples a pixel.
    Waiting(u32),
    /// Tiles draw points until evidence tells otherwise.
    Adapting,
}

/// All tiles, in the film's order.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
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
        let (stage, way) = match sampling {
            None | Some(VolumeSampling::Null) => (Stage::Fixed, Way::NULL),
            Some(VolumeSampling::Both | VolumeSampling::EquiAngular) => (Stage::Fixed, Way::one(Mix::LIGHTS)),
            Some(VolumeSampling::Paths) => (Stage::Fixed, Way::one(Mix::FULL)),
            Some(VolumeSampling::InScatter) => (Stage::Fixed, Way::one(Mix::POINTS)),
            Some(VolumeSampling::Auto) => (Stage::Waiting(if is_shared { 2 } else { 0 }), Way::NULL),
        };
        let tile = TileMix { way, ..TileMix::default() };
        Self { columns, stage, tiles: vec![tile; columns * rows] }
    }

    /// A pass begins where `done` samples a pixel have been taken.
    pub fn begin_pass(&mut self, done: u32) {
        if let Stage::Waiting(until) = self.stage
            && done >= until
        {
            self.stage = Stage::Adapting;
            self.tiles.fill(TileMix { way: Way::one(Mix::FULL), is_sparse: until > 0, ..TileMix::default() });
        }
    }

    /// Whether it is for the same image.
    pub fn is_like(&self, other: &Self) -> bool {
        self.columns == other.columns && self.tiles.len() == other.tiles.len()
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
        self.tiles.iter().all(|tile| tile.way.count == 0.0)
    }

    /// The share of tiles that draw points, and the mean number of points that they draw for a path.
    pub fn summary(&self) -> [f64; 2] {
        let on = self.tiles.iter().filter(|tile| tile.way.count > 0.0).count();
        let points: f64 = self.tiles.iter().map(|tile| f64::from(tile.way.count)).sum();
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
            if tile.way.count == 0.0 {
                continue;
            }
            let near = |i: usize, end: usize| i.saturating_sub(AROUND)..(i + AROUND + 1).min(end);
            let mut evidence = Evidence::default();
            for row in near(number / self.columns, rows) {
                for column in near(number % self.columns, self.columns) {
                    let other = &before[row * self.columns + column];
                    if other.way == tile.way {
                        evidence.add(&other.evidence.relative());
                    }
                }
            }
            tile.way = evidence.best(tile.way);
        }
        self.tiles.iter_mut().for_each(|tile| (tile.evidence, tile.is_sparse) = Default::default());
    }
}

impl TileMix {
    /// A pass begins where the tile's mean level is `level`.
    pub fn begin_pass(&mut self, level: f64) {
        self.floor = DARKEST * level;
    }

    /// Whether any of its paths draw points.
    pub fn draws(&self) -> bool {
        self.way.count > 0.0
    }

    /// Points that the paths of `pixel` draw, and what they do.
    #[inline]
    pub const fn way_at(&self, [x, y]: [u32; 2]) -> (f32, Mix) {
        let is_left_out = self.is_sparse && (x.wrapping_add(2 * y)) % SPARSE != 0;
        (if is_left_out { 0.0 } else { self.way.count }, self.way.mix)
    }

    /// Adds what a pixel's samples tell, `level` being what it came to in earlier passes.
    pub fn add(&mut self, pixel: &PixelEvidence, level: f64) {
        self.evidence.add(&pixel.told(level, self.floor));
    }

    /// Adds what a pixel's samples took: work for all of it, and for points.
    pub fn add_work(&mut self, all: u64, of_points: PointWork) {
        self.evidence.add(&Evidence::of_work(all, of_points));
    }
}

#[cfg(test)]
mod tests {
    use super::evidence::Parts;
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
        let evidence = |with, without| Evidence {
            with,
            drawn: 0.5 * with,
            others: [without, 9.0 * with, 9.0 * with, 9.0 * with],
            work: 1.3,
            parts: Parts { points: 0.2, paths: 0.1, null_lights: 0.0 },
        };
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
        let counts: Vec<f32> = mixing.tiles.iter().map(|tile| tile.way.count).collect();
        assert!(counts[0] > 0.0 && counts[1] > 0.0 && counts[2] == 0.0, "{counts:?}");
        // What is off stays off.
        pass(&mut mixing, 4, 4, |_| evidence(1.0, 20.0));
        assert!(mixing.tiles[2].way.count == 0.0 && mixing.tiles[0].way.count > 0.0);
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
        let drawing = (0..TILE_SIZE).filter(|&x| mixing.tiles[0].way_at([x, 3]).0 > 0.0).count();
        assert_eq!(drawing as u32, TILE_SIZE / SPARSE);
        assert!(
            !self::mixing(VolumeSampling::Both, true).is_off() && self::mixing(VolumeSampling::Null, true).is_off()
        );
    }
}
