//! A rehearsal: what hides lights is learned before the first pass, along pilot paths whose light goes into no image.
//!
//! **Ours.** The paper learns from the image's own samples alone (section 3.2), so its first passes know nothing, and with few samples a pixel they are a
//! large part of the image. A vertex that there is can try many lights for little more than their shadow rays, so few paths teach as much as several passes. In `rooms` at 480 × 270 pixels and 8
//! spp that took the RMSE of gathered light to 0.59 times as much and the processor time to 1.12, in `house` to 0.91 and 1.12; at 160 × 90 and 32 spp to 0.73 and
//! 1.13, 0.94 and 1.03 (two or three seeds). In `foliage`, at 160 × 90 and 16 spp, it was 0.995 and 1.09.
//!
//! The paths have random numbers of their own, so that what they teach is independent of every sample of the image.

use std::time::Instant;

use rayon::prelude::*;

use super::cache::{CacheBuilder, thinned};
use crate::cache_points::learn::Lesson;
use crate::integrator::in_scatter::alternatives::Mix;
use crate::integrator::{Counters, PathSettings, Scratch, World};

/// How often pilot paths are traced, each time with what was learned before. A third time took the squared error at 32 spp to 0.94 times as much in `rooms` and 0.99 in
/// `house` (160 × 90 pixels, three seeds), and the processor time to 1.04 and 1.07.
const ROUNDS: u32 = 2;
/// Lights that each vertex tries.
const TRIES: u32 = 16;
/// Bounces at most: what a path brings from beyond is little of the image, and in thick clouds there would be no end of vertices.
const MOST_BOUNCES: u32 = 8;
/// Sets the random numbers of a rehearsal apart from those of the render and of the pilot paths that points come of.
const SEED: u32 = 0x51ed_2701;

impl CacheBuilder<'_> {
    /// Has the cache points that choose the lights of `world` learn along pilot paths. Where leaves hide lights, now one and now another, the first round shows that there is little to
    /// learn, and is the last.
    pub fn rehearse(&self, world: &mut World) {
        if !self.settings.rehearse || !world.light_choice.learns() {
            return;
        }
        let start = Instant::now();
        let mut rays = 0;
        // Where points come of few candidates, few paths teach them.
        let most = self.settings.candidates.map_or(usize::MAX, |most| most as usize);
        let pixels = thinned(&self.pilot_pixels(), most);
        let path = PathSettings { tries: TRIES, max_depth: self.path.max_depth.min(MOST_BOUNCES), ..*self.path };
        for round in 0..ROUNDS {
            let seed = self.seed ^ SEED.wrapping_add(round);
            let traced = pixels.par_iter().enumerate().map_init(Scratch::default, |scratch, (k, &pixel)| {
                scratch.counters = Counters::default();
                scratch.in_scatter.begin_pixel(0.0, Mix::NULL);
                self.pilot(world, &path, (seed, pixel, k as u32), scratch);
                scratch.counters.shadow_rays
            });
            rays += traced.sum::<u64>();
            if world.light_choice.learn(&world.lights) != Some(Lesson::Clear) {
                break;
            }
        }
        world.light_choice.has_rehearsed(rays, start.elapsed().as_secs_f64());
    }
}
