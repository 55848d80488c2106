//! Sums what a path brings and sorts it into the image's layers, which add up to the beauty.

use crate::film::SampleResult;
use crate::math::Rgb;

/// The sums of one path.
#[derive(Default)]
pub(super) struct Layers {
    /// What has come so far.
    pub result: SampleResult,
    /// What the path met first.
    pub first: Option<FirstVertex>,
    /// What media on the camera ray emit towards the camera.
    pub glow: Rgb,
    /// What surfaces and environments shine straight into the camera. It is no part of `result` before [`Layers::whole`].
    pub seen: Rgb,
}

/// Where a path is scattered first.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum FirstVertex {
    /// At a surface.
    Surface,
    /// In a medium.
    Medium,
}

impl Layers {
    /// Nothing yet, of a path from a camera.
    pub fn new() -> Self {
        Self { result: SampleResult { depth: f32::INFINITY, ..Default::default() }, ..Self::default() }
    }

    /// Adds light that arrives after `depth` bounces, from a medium or from elsewhere.
    #[inline]
    pub fn add(&mut self, contribution: Rgb, depth: u32, from_medium: bool) {
        if self.first.is_none() && !from_medium {
            self.seen += contribution;
            return;
        }
        let result = &mut self.result;
        result.beauty += contribution;
        match (self.first, depth) {
            (None, _) => {
                result.emission += contribution;
                self.glow += contribution;
            }
            (Some(FirstVertex::Medium), _) => result.volume += contribution,
            (Some(FirstVertex::Surface), 1) => result.direct += contribution,
            (Some(FirstVertex::Surface), _) => result.indirect += contribution,
        }
    }

    /// The sums, with `seen` for what surfaces and environments shine straight into the camera.
    pub fn whole(mut self, seen: Rgb) -> SampleResult {
        self.result.beauty += seen;
        self.result.emission += seen;
        self.result
    }

    /// Adds light that a medium scatters back along the path's ray, found beside the path, as its bounce number `depth`.
    #[inline]
    pub fn add_scattered(&mut self, contribution: Rgb, depth: u32) {
        if self.first.is_some() {
            return self.add(contribution, depth, false);
        }
        self.result.beauty += contribution;
        self.result.volume += contribution;
    }
}
