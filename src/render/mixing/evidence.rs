//! What the paths of a tile tell of each way to go, and which of them is best: the one with the least variance times work.

use glam::Vec3;

use crate::film::{Moments, SampleResult};
use crate::integrator::Scratch;
use crate::integrator::in_scatter::alternatives::Mix;
use crate::integrator::in_scatter::{InScatter, PointWork};

/// Points a path that a tile may draw.
const COUNTS: [f32; 3] = [1.0, 2.0, 4.0];

/// What one more point must gain to be drawn, and what none must gain for tiles to stop drawing.
const WORTHWHILE: f64 = 0.95;

/// Knots are laid out once a pass, and later passes have more samples: the share of that work that counts.
const KNOTS_LATER: f64 = 0.25;

/// What the paths of a tile do.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Way {
    /// Points that each camera path draws.
    pub count: f32,
    pub mix: Mix,
}

impl Way {
    pub const NULL: Self = Self { count: 0.0, mix: Mix::NULL };

    pub const fn one(mix: Mix) -> Self {
        Self { count: 1.0, mix }
    }
}

impl Default for Way {
    fn default() -> Self {
        Self::NULL
    }
}

/// Evidence of one tile from one pass.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Evidence {
    /// Variance of a sample, relative to the square of the pixel's level, summed over pixels.
    pub with: f64,
    /// Of what the points bring.
    pub drawn: f64,
    /// As it would have been with each of [`Mix::OTHERS`].
    pub others: [f64; Mix::OTHERS.len()],
    /// Work for all of it.
    pub work: f64,
    /// And for points.
    pub parts: Parts,
}

/// Work for points: to find them and what lights bring there, to go on from them, and for lights at null tracking's vertices.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Parts {
    pub points: f64,
    pub paths: f64,
    pub null_lights: f64,
}

impl Evidence {
    /// Of what a pixel's samples took: work for all of it, and for points.
    pub(super) fn of_work(all: u64, PointWork { knots, points, paths, null_lights }: PointWork) -> Self {
        let [all, knots, points, paths, null_lights] = [all, knots, points, paths, null_lights].map(|n| n as f64);
        let later = KNOTS_LATER * knots;
        let parts = Parts { points: points + later, paths, null_lights };
        Self { work: all - knots + later, parts, ..Self::default() }
    }

    /// Adds that of other pixels, or of another tile.
    pub(super) fn add(&mut self, other: &Self) {
        self.with += other.with;
        self.drawn += other.drawn;
        self.others = std::array::from_fn(|i| self.others[i] + other.others[i]);
        self.work += other.work;
        self.parts.points += other.parts.points;
        self.parts.paths += other.parts.paths;
        self.parts.null_lights += other.parts.null_lights;
    }

    /// The same in parts of this tile's own variance, so that a tile full of noise that points do not touch does not speak for those around it.
    pub(super) fn relative(&self) -> Self {
        let scale = 1.0 / (self.with + self.others[0].max(0.0));
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let others = self.others.map(|variance| variance * scale);
        Self { with: self.with * scale, drawn: self.drawn * scale, others, ..*self }
    }

    /// What a tile should do that went by `way`: what has the least variance times work.
    pub(super) fn best(&self, way: Way) -> Way {
        let Self { work, parts, .. } = *self;
        let of_points = parts.points + parts.paths;
        let rest = work - of_points - parts.null_lights;
        let mut best = (way, f64::INFINITY);
        let mut offer = |other: Way, variance: f64, work: f64| {
            let value = variance.max(0.0) * work;
            if value < WORTHWHILE * best.1 {
                best = (other, value);
            }
        };
        if way.mix == Mix::FULL {
            for (mix, variance) in Mix::OTHERS.into_iter().zip(self.others) {
                let on = |is_on: bool, work: f64| if is_on { work } else { 0.0 };
                let parts =
                    on(mix.draws, parts.points) + on(mix.goes_on, parts.paths) + on(mix.null_lights, parts.null_lights);
                offer(Way { count: if mix.draws { way.count } else { 0.0 }, mix }, variance, rest + parts);
            }
        }
        let others = (self.with - self.drawn).max(0.0);
        for count in COUNTS {
            let ratio = f64::from(count / way.count);
            // Of more points than were tried, only their own variance is known to fall.
            let variance = if count == way.count { self.with } else { others + self.drawn / ratio };
            offer(Way { count, ..way }, variance, rest + parts.null_lights + of_points * ratio);
        }
        best.0
    }
}

/// The samples of one pixel.
#[derive(Default)]
pub struct PixelEvidence {
    /// What they brought, and what of it points that were drawn did.
    brought: Moments,
    /// By how much the square of what they brought would be larger with each of [`Mix::OTHERS`].
    more: [f64; Mix::OTHERS.len()],
}

impl PixelEvidence {
    /// Adds a sample.
    #[inline]
    pub fn add(&mut self, sample: &SampleResult, scratch: &Scratch) {
        let InScatter { alternatives, drawn, scattered, glow, .. } = &scratch.in_scatter;
        self.brought.add(Vec3::new(sample.beauty.luminance(), drawn.luminance(), 0.0).as_dvec3());
        let more = alternatives.more(f64::from((sample.beauty - *scattered - *glow).luminance()));
        self.more.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }

    /// What the pixel tells its tile. `level` is what it came to in earlier passes (in this one it would depend on what is weighed by it): variances are
    /// relative to it, so that the edge of a flame does not speak for the fog beside it; and no darker than `floor`.
    pub(super) fn told(&self, level: f64, floor: f64) -> Evidence {
        let count = self.brought.count;
        if count > 1 && self.brought.squares.is_finite() && self.more.iter().all(|more| more.is_finite()) {
            let scale = 1.0 / (level * level + floor * floor);
            let scale = if scale.is_finite() { scale } else { 1.0 };
            let [with, drawn, _] = (self.brought.squares * (scale / (count - 1) as f64)).to_array();
            // The mean is the same whatever is done: variances differ as squares do.
            let others = self.more.map(|more| with + more * (scale / count as f64));
            return Evidence { with, drawn, others, ..Evidence::default() };
        }
        Evidence::default()
    }
}
