//! One pass over all pixels, and the random numbers of its samples.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec2;
use rayon::prelude::*;

use super::Job;
use super::mixing::{Mixing, PixelEvidence, TileMix};
use super::progress::Tracking;
use super::splitting::{PixelSplitting, Split, Splitting, TileSplitting};
use crate::film::{Film, FilmTile, FilterSample, PixelSamples, SampleResult};
use crate::geometry::Ray;
use crate::geometry::differentials::RayDifferentials;
use crate::integrator::{Counters, Scratch, trace_path, view_ray};
use crate::math::Rgb;
use crate::math::sampler::{Dimension, SampleId, SamplePoint, mix};

/// What passes go by, tile by tile, and learn for later ones.
#[derive(Clone)]
pub struct Guides {
    /// How scattering points are sampled.
    pub mixing: Mixing,
    /// How camera rays are split, where they are.
    pub splitting: Option<Splitting>,
}

/// What a pass goes by in one tile.
pub(super) struct TileGuides<'a> {
    pub mix: &'a mut TileMix,
    pub splitting: Option<&'a mut TileSplitting>,
}

impl Guides {
    /// Goes on from those of another time; false where they are of another image.
    #[must_use]
    pub fn restore(&mut self, mixing: Mixing, splitting: Option<Splitting>) -> bool {
        let fits = mixing.is_like(&self.mixing)
            && match (&splitting, &self.splitting) {
                (Some(a), Some(b)) => a.is_like(b),
                (None, None) => true,
                _ => false,
            };
        if fits {
            *self = Self { mixing, splitting };
        }
        fits
    }

    /// Those of each tile, in the film's order.
    pub(super) fn tiles_mut(&mut self) -> Vec<TileGuides<'_>> {
        let mut splitting = self.splitting.as_mut().map(|splitting| splitting.tiles_mut().iter_mut());
        let tiles = self.mixing.tiles_mut().iter_mut();
        tiles.map(|mix| TileGuides { mix, splitting: splitting.as_mut().and_then(Iterator::next) }).collect()
    }
}

/// Samples a pixel that a tile is rendered with at most before the next tile is, so that a render can stop between two tiles however long its passes are.
const STEP: u32 = 128;

/// The part of the pass of these samples that begins with sample `first`.
pub(super) fn step(samples: &Range<u32>, first: u32) -> Range<u32> {
    first..samples.end.min(first.saturating_add(STEP))
}

/// One pass over all pixels, or a step of one.
pub(super) struct Pass<'a> {
    pub job: &'a Job,
    pub seed: u32,
    pub samples: Range<u32>,
    /// Those of them that are rendered now.
    pub step: Range<u32>,
    pub interrupt: &'a AtomicBool,
    /// Whether no other tile is to be begun.
    pub held: &'a (dyn Fn() -> bool + Sync),
    pub tracking: &'a Tracking<'a>,
    /// Whether what earlier passes found has a say in its paths.
    pub learns: bool,
}

/// Where a camera ray begins.
pub(super) struct CameraSample {
    /// In pixels of the full image.
    pub film: Vec2,
    /// In the unit square.
    pub lens: [f32; 2],
    /// From 0 to 1 while the shutter is open.
    pub u_time: f32,
    /// What it counts in the pixel.
    pub weight: f32,
}

/// Sets the paths of renders that learn nothing more apart from those that taught.
const FROZEN_SEED: u64 = 0x7b3d_90c5;

/// Sets the numbers of rays that are split off apart from those of paths.
const SPLIT_SEED: u64 = 0x5b1e_77d4_0a93_c6f2;

impl Pass<'_> {
    /// Whether no pass went before.
    #[inline]
    fn is_first(&self) -> bool {
        self.samples.start == self.job.first_sample
    }

    /// Renders all tiles that have not `ended`, or as many as it comes to.
    pub fn run(&self, film: &mut Film, guides: &mut Guides, ended: &mut [bool]) -> Counters {
        film.tiles_mut()
            .par_iter_mut()
            .zip(guides.tiles_mut())
            .zip(ended)
            .map_init(Scratch::default, |scratch, ((tile, mut guides), ended)| {
                let is_cut = || self.interrupt.load(Ordering::Relaxed) || self.job.world.materials.has_failed();
                if *ended || is_cut() || (self.held)() {
                    return Counters::default();
                }
                scratch.counters = Counters::default();
                self.begin_tile(tile, &mut guides, scratch);
                for pixel in tile.bounds().pixels() {
                    let samples = self.pixel(tile, pixel, &mut guides, scratch);
                    tile.merge(pixel, &samples);
                }
                *ended = !is_cut();
                self.tracking.tile_ended(tile.bounds().area() as u64 * self.step.len() as u64);
                scratch.counters
            })
            .sum()
    }

    /// What rays share never leaves the tile.
    pub fn begin_tile(&self, tile: &FilmTile, guides: &mut TileGuides<'_>, scratch: &mut Scratch) {
        scratch.in_scatter.forget();
        guides.mix.begin_pass(tile.mean_level());
    }

    /// The addresses of a sample's random numbers, for its camera ray and for its path. The samples of a pixel are points of one sequence, each where
    /// the others are not. Where one pass learns from the one before that would be bias, so then paths have a sequence of their own in every
    /// pass. Camera rays need none: whatever was learned, the path along a ray is expected to bring what arrives along it, and the rays
    /// as such are spread evenly.
    fn sample_ids(&self, pixel: [u32; 2], sample: u32) -> [SampleId; 2] {
        let (first, of_all) = (self.samples.start, SampleId { seed: self.seed, pixel, sample });
        if !self.is_first() && self.learns {
            let seed = mix(u64::from(self.seed) << 32 | u64::from(first)) as u32;
            return [of_all, SampleId { seed, pixel, sample: sample - first }];
        }
        if self.job.is_frozen {
            // Those that taught may be of the seed's own sequence, so all others are of another one.
            let seed = mix(u64::from(self.seed) << 32 | FROZEN_SEED) as u32;
            return [of_all, SampleId { seed, ..of_all }];
        }
        [of_all; 2]
    }

    /// The random numbers of that address.
    #[inline]
    fn point(&self, id: SampleId) -> SamplePoint {
        if self.job.is_independent { SamplePoint::independent(id) } else { SamplePoint::new(id) }
    }

    /// The ray from the camera that goes with these random numbers.
    #[inline]
    fn camera_ray(&self, [x, y]: [u32; 2], random: &SamplePoint) -> (Ray, CameraSample) {
        let [jitter_x, jitter_y, lens_u, lens_v] = random.draw::<4>(0, Dimension::Camera);
        let [u_time] = random.draw::<1>(0, Dimension::Time);
        let centre = Vec2::new(x as f32, y as f32) + Vec2::splat(0.5);
        let u_lobe = || random.draw::<1>(0, Dimension::Filter)[0];
        let FilterSample { offset, weight } = self.job.film.filter.sample([jitter_x, jitter_y], u_lobe);
        let sample = CameraSample { film: centre + offset, lens: [lens_u, lens_v], u_time, weight };
        (self.job.camera.ray(sample.film, sample.lens, u_time), sample)
    }

    /// One sample of a pixel, and what it counts there: 1 unless the filter has negative lobes.
    #[inline]
    pub fn sample(
        &self,
        pixel: [u32; 2],
        sample: u32,
        splitting: &mut PixelSplitting,
        scratch: &mut Scratch,
    ) -> (SampleResult, f32) {
        let job = self.job;
        let [camera, random] = self.sample_ids(pixel, sample).map(|id| self.point(id));
        let (ray, camera) = self.camera_ray(pixel, &camera);
        let weight = camera.weight;
        let seen = |seen, scratch: &mut Scratch| {
            splitting.saw(seen);
            if splitting.split.rays == 0 {
                return seen;
            }
            // The weight of all that the path brings is still to come.
            self.split(pixel, sample, splitting, seen * weight, scratch) * weight.recip()
        };
        let differentials = job.texture_share.map(|share| {
            RayDifferentials::of_camera(&job.camera, &ray, camera.film, camera.lens, camera.u_time, share)
        });
        let camera_ray = (ray, differentials);
        let mut result = trace_path(&job.world, &job.path, camera_ray, &random, scratch, seen);
        let surface = job.film.gbuffer.zip(result.surface);
        result.surface = surface.map(|(coordinates, surface)| job.in_coordinates(coordinates, &surface, &ray, &camera));
        if sample == job.first_sample && result.emission.is_black() {
            splitting.brought(result.beauty);
        }
        (result, weight)
    }

    /// What shines straight into the camera and counts in the pixel, by what a path's own camera ray has seen and as many others as `splitting` asks
    /// for. Those of a pixel are points of one sequence in a pass.
    fn split(
        &self,
        pixel: [u32; 2],
        sample: u32,
        splitting: &mut PixelSplitting,
        own: Rgb,
        scratch: &mut Scratch,
    ) -> Rgb {
        let seed = mix((u64::from(self.seed) << 32 | u64::from(self.samples.start)) ^ SPLIT_SEED) as u32;
        let Split { rays, beta } = splitting.split;
        // In steps, so that the mean over what is the same everywhere is that to the last bit.
        let mut mean = own;
        let first = (sample - self.samples.start).wrapping_mul(rays);
        for number in 0..rays {
            let sample = first.wrapping_add(number);
            let random = self.point(SampleId { seed, pixel, sample });
            let (ray, CameraSample { weight, .. }) = self.camera_ray(pixel, &random);
            let seen = view_ray::seen(&self.job.world, ray, &random, scratch);
            if self.is_first() {
                splitting.saw(seen);
            }
            mean += (seen * weight - mean) * (1.0 / (number + 2) as f32);
        }
        own + (mean - own) * beta
    }

    /// One pixel.
    pub fn pixel(
        &self,
        tile: &FilmTile,
        pixel: [u32; 2],
        guides: &mut TileGuides<'_>,
        scratch: &mut Scratch,
    ) -> PixelSamples {
        let mut evidence = PixelEvidence::default();
        let before = scratch.counters.work();
        let mut splitting = self.begin_pixel(tile, pixel, guides, scratch);
        let mut samples = PixelSamples::new(self.job.film.sensor);
        for sample in self.step.clone() {
            // A pass of a long render may take minutes a tile: stopping must not wait for it.
            if self.interrupt.load(Ordering::Relaxed) {
                break;
            }
            let (result, weight) = self.sample(pixel, sample, &mut splitting, scratch);
            samples.add_weighted(sample, &result, weight);
            if scratch.in_scatter.is_on() {
                evidence.add(&result, scratch);
            }
        }
        if let Some(tile_splitting) = &mut guides.splitting {
            tile_splitting.add(tile.bounds().index(pixel), &splitting);
        }
        if scratch.in_scatter.is_on() {
            guides.mix.add(&evidence, tile.level(pixel));
            guides.mix.add_work(scratch.counters.work() - before, scratch.in_scatter.work);
        }
        samples
    }

    /// What the pixel's samples go by.
    #[inline]
    pub fn begin_pixel(
        &self,
        tile: &FilmTile,
        pixel: [u32; 2],
        guides: &TileGuides<'_>,
        scratch: &mut Scratch,
    ) -> PixelSplitting {
        let (count, mix) = guides.mix.way_at(pixel);
        scratch.in_scatter.begin_pixel(count, mix);
        let splitting = guides.splitting.as_ref();
        splitting.map_or(PixelSplitting::default(), |splitting| splitting.pixel(tile.bounds().index(pixel)))
    }
}
