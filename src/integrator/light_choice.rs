//! How the path chooses lights at its vertices: by a selector that knows the lights alone, or by cache points that have learned what
//! arrives. Also how pilot paths are recorded: they choose no light, and what a choice would have been made for is kept.

use arrayvec::ArrayVec;
use glam::Vec3;

use crate::cache_points::learn::Lesson;
use crate::cache_points::scatter::Phases;
use crate::cache_points::select::{Drawn, MOST_DRAWN};
use crate::cache_points::{CachePoints, CacheScratch, Learned, LearnedRef};
use crate::light::selector::{LightSelector, SelectorScratch};
use crate::light::{LightId, Lights, Receiver};

/// A way of choosing.
#[derive(Debug)]
pub enum LightChoice {
    /// By the lights alone.
    Selector(LightSelector),
    /// By the nearest cache point.
    CachePoints(Box<CachePoints>),
    /// By the lights alone; cache points learn beside it what in-scatter sampling goes by.
    Beside(LightSelector, Box<CachePoints>),
    /// None: paths only record where they would choose.
    Pilot,
}

/// What is worked out at a vertex. One per thread, reused.
#[derive(Clone, Debug, Default)]
pub struct LightScratch {
    selector: SelectorScratch,
    /// Of cache points.
    pub cache: CacheScratch,
    /// Vertices of pilot paths.
    pub pilots: Vec<Receiver>,
}

impl LightChoice {
    /// A new path begins.
    #[inline]
    pub fn begin_path(&self, scratch: &mut LightScratch) {
        scratch.cache.begin_path();
    }

    /// Works out what the other calls need at `receiver`.
    #[inline]
    pub fn prepare(&self, lights: &Lights, receiver: &Receiver, scratch: &mut LightScratch) {
        match self {
            Self::Selector(selector) | Self::Beside(selector, _) => {
                selector.prepare(lights, receiver, &mut scratch.selector)
            }
            Self::CachePoints(cache) => cache.prepare(lights, receiver, &mut scratch.cache),
            Self::Pilot => scratch.pilots.push(*receiver),
        }
    }

    /// How many lights to draw at the receiver last prepared.
    #[inline]
    pub fn draws(&self, scratch: &LightScratch) -> u32 {
        match self {
            Self::Selector(selector) | Self::Beside(selector, _) => selector.draws(&scratch.selector),
            Self::CachePoints(_) => 1,
            Self::Pilot => 0,
        }
    }

    /// Draws a light for each of `numbers`, all in [0, 1) and [`MOST_DRAWN`] at most, as one that draw number `draw` may choose.
    #[inline]
    pub fn sample(
        &self,
        lights: &Lights,
        draw: u32,
        numbers: impl Iterator<Item = f64>,
        scratch: &LightScratch,
        drawn: &mut ArrayVec<Drawn, MOST_DRAWN>,
    ) {
        match self {
            Self::Selector(selector) | Self::Beside(selector, _) => {
                let sample = |u| selector.sample(lights, draw, u, &scratch.selector);
                drawn.extend(numbers.filter_map(sample).map(Drawn::new));
            }
            Self::CachePoints(cache) => cache.sample(lights, numbers, &scratch.cache, drawn),
            Self::Pilot => {}
        }
    }

    /// How often the draws at the receiver last prepared are expected to choose `id`.
    #[inline]
    pub fn pmf(&self, lights: &Lights, id: LightId, scratch: &LightScratch) -> f32 {
        match self {
            Self::Selector(selector) | Self::Beside(selector, _) => selector.pmf(lights, id, &scratch.selector),
            Self::CachePoints(cache) => cache.pmf(lights, id, &scratch.cache),
            Self::Pilot => 0.0,
        }
    }

    /// The factor that the weight of a drawn light has because it is often hidden; 1 where nothing is known.
    #[inline]
    pub fn visibility(&self, drawn: &Drawn) -> f32 {
        match self {
            Self::CachePoints(cache) => cache.visibility(drawn),
            Self::Selector(_) | Self::Beside(..) | Self::Pilot => 1.0,
        }
    }

    /// Tells what became of the shadow ray to a drawn light.
    #[inline]
    pub fn record(&self, drawn: &Drawn, is_visible: bool) {
        if let Self::CachePoints(cache) = self {
            cache.record(drawn, is_visible);
        }
    }

    /// As [`LightChoice::record`], at a first scattering vertex `p`: tells cache points that choose no lights themselves.
    #[inline]
    pub fn record_scattering(&self, lights: &Lights, p: Vec3, light: LightId, is_visible: bool) {
        if let Self::Beside(_, cache) = self {
            cache.record_at(lights, p, light, is_visible);
        }
    }

    /// From now on cache points keep ready what media of these mean cosines scatter towards the camera.
    pub fn begin_scattering(&mut self, lights: &Lights, phases: Phases) {
        if let Self::CachePoints(cache) | Self::Beside(_, cache) = self
            && !cache.scatters()
        {
            cache.weigh_scattering(lights, phases);
        }
    }

    /// Nobody samples scattering points by what the cache points know any more.
    pub fn end_scattering(&mut self) {
        if let Self::CachePoints(cache) | Self::Beside(_, cache) = self {
            cache.end_scattering();
        }
    }

    /// Whether choices change with what earlier ones came to.
    #[inline]
    pub fn learns(&self) -> bool {
        match self {
            Self::CachePoints(cache) => cache.learns(),
            Self::Beside(_, cache) => cache.learns() && cache.scatters(),
            Self::Selector(_) | Self::Pilot => false,
        }
    }

    /// Takes down what a rehearsal took.
    pub fn has_rehearsed(&mut self, rays: u64, seconds: f64) {
        if let Self::CachePoints(cache) = self {
            cache.has_rehearsed(rays, seconds);
        }
    }

    /// An iteration is over: takes over what was learned, and tells what that is worth.
    pub fn learn(&mut self, lights: &Lights) -> Option<Lesson> {
        match self {
            Self::CachePoints(cache) if cache.learns() => Some(cache.learn(lights)),
            Self::Beside(_, cache) if cache.learns() && cache.scatters() => Some(cache.learn(lights)),
            _ => None,
        }
    }

    /// The cache points, where there are any.
    #[inline]
    pub fn cache_points(&self) -> Option<&CachePoints> {
        match self {
            Self::CachePoints(cache) | Self::Beside(_, cache) => Some(cache),
            Self::Selector(_) | Self::Pilot => None,
        }
    }

    /// What was learned so far, where anything learns.
    pub fn learned(&self) -> Option<LearnedRef<'_>> {
        self.cache_points().map(CachePoints::learned)
    }

    /// Goes on from what was learned another time; false where that belongs to another choice.
    #[must_use]
    pub fn relearn(&mut self, learned: Option<Learned>) -> bool {
        match (self, learned) {
            (Self::CachePoints(cache) | Self::Beside(_, cache), Some(learned)) => cache.relearn(learned),
            (Self::Selector(_) | Self::Pilot, None) => true,
            _ => false,
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        match self {
            Self::Selector(selector) => selector.memory(),
            Self::CachePoints(cache) => cache.memory(),
            Self::Beside(selector, cache) => selector.memory() + cache.memory(),
            Self::Pilot => 0,
        }
    }
}
