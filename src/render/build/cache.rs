//! Cache points for a world: candidates from the boxes of its objects, from pilot paths and along beams.

use std::time::Instant;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::cache_points::seed::{Candidate, MOST_IN_BOXES, MOST_PILOTS, ReceivingBox, along_beams, scatter_in_boxes};
use crate::cache_points::{CachePoints, CacheSettings, CacheStatistics};
use crate::film::FilmSettings;
use crate::geometry::camera::Camera;
use crate::geometry::differentials::{RayDifferentials, SampleShare};
use crate::geometry::extent::union;
use crate::geometry::{Geometry, ShapeId};
use crate::integrator::in_scatter::alternatives::Mix;
use crate::integrator::{PathSettings, Scratch, World, trace_path};
use crate::light::Receiver;
use crate::material::{MaterialId, Materials};
use crate::math::sampler::{Dimension, SampleId, SamplePoint};

/// Pixels for each pilot path. So pilots cost an eighth of a sample a pixel. With 32 of them the RMSE of gathered light was 1.02 times as large in `house`, 1.16 in `rooms` (960 × 540
/// pixels) and 1.18 in `foliage` (640 × 360, all with 8 spp, three seeds).
const PIXELS_PER_PILOT: usize = 8;
/// Pixels for each candidate in a box: paths find most places that count. With 2 of them the RMSE was 0.996, 0.99 and 1.002 times as large in those scenes, the
/// processor time 1.12, 1.10 and 1.14 times, and there were 1.5, 1.3 and 2.2 times as many points.
const PIXELS_PER_BOXED: usize = 24;
/// Pilot paths at least, and candidates in boxes at least: small images have scenes as large as any.
const FEWEST_PILOTS: usize = 4096;
const FEWEST_IN_BOXES: usize = 8192;
/// The number of the first instance's box; before it are those of shapes.
const FIRST_INSTANCE: u64 = 1 << 32;
/// Pilot paths are samples of a render of another seed.
const PILOT_SEED: u32 = 0x9e37_79b9;

/// What building cache points takes besides the world.
pub struct CacheBuilder<'a> {
    /// Where paths start.
    pub camera: &'a Camera,
    /// The image.
    pub film: &'a FilmSettings,
    /// How paths go.
    pub path: &'a PathSettings,
    /// Of the render.
    pub seed: u32,
    /// How points are made.
    pub settings: CacheSettings,
    /// Whether points lie along camera rays and beams alone: where they are there for in-scatter sampling, and choose no lights.
    pub on_camera_rays: bool,
    /// What part of a pixel a sample stands for, where textures have levels of detail.
    pub texture_share: Option<SampleShare>,
}

impl CacheBuilder<'_> {
    /// Cache points for `world`, whose choice must be [`crate::integrator::LightChoice::Pilot`]; `None` where there are too few candidates.
    pub fn build(&self, world: &World) -> Option<CachePoints> {
        let start = Instant::now();
        let mut statistics = CacheStatistics::default();
        let mut candidates = self.pilots(world);
        statistics.pilots = candidates.len();
        if self.settings.beams && world.has_media() {
            along_beams(&world.lights, world.geometry.bounds(), &mut candidates);
            statistics.in_beams = candidates.len() - statistics.pilots;
        }
        if !self.on_camera_rays {
            let boxes = receiving_boxes(&world.geometry, &world.materials, world);
            let before = candidates.len();
            scatter_in_boxes(&boxes, self.in_boxes(before), &mut candidates);
            statistics.in_boxes = candidates.len() - before;
        }
        statistics.seconds.seed = start.elapsed().as_secs_f64();

        let pixel = self.camera.pixel_span();
        CachePoints::build(&world.lights, candidates, pixel, self.settings, statistics)
    }

    fn in_boxes(&self, others: usize) -> usize {
        let suits = (self.film.bounds.area() / PIXELS_PER_BOXED).clamp(FEWEST_IN_BOXES, MOST_IN_BOXES);
        self.settings.candidates.map_or(suits, |most| suits.min((most as usize).saturating_sub(others)))
    }

    /// The vertices of pilot paths, spread evenly over the image.
    fn pilots(&self, world: &World) -> Vec<Candidate> {
        let seed = self.seed ^ PILOT_SEED;
        let vertices: Vec<Vec<Candidate>> = self
            .pilot_pixels()
            .into_par_iter()
            .enumerate()
            .map_init(Scratch::default, |scratch, (k, pixel)| {
                scratch.lights.pilots.clear();
                scratch.in_scatter.seeds.clear();
                scratch.in_scatter.begin_pixel(if self.on_camera_rays { 1.0 } else { 0.0 }, Mix::NULL);
                self.pilot(world, self.path, (seed, pixel, k as u32), scratch);
                let vertices = scratch.lights.pilots.iter();
                if self.on_camera_rays {
                    let scattered = vertices.filter(|vertex| matches!(vertex, Receiver::Medium { .. }));
                    let places = scratch.in_scatter.seeds.iter().copied().map(Candidate::in_space);
                    scattered.map(Candidate::at).chain(places).collect()
                } else {
                    vertices.map(Candidate::at).collect()
                }
            })
            .collect();
        let most = self.settings.candidates.map_or(MOST_PILOTS, |n| (n as usize).min(MOST_PILOTS));
        thinned(&vertices.concat(), most)
    }

    /// The pixel of each pilot path.
    pub(super) fn pilot_pixels(&self) -> Vec<[u32; 2]> {
        let pixels: Vec<[u32; 2]> = self.film.bounds.pixels().collect();
        let paths = (pixels.len() / PIXELS_PER_PILOT).max(FEWEST_PILOTS);
        (0..paths).map(|k| pixels[(k as u64 * pixels.len() as u64 / paths as u64) as usize]).collect()
    }

    /// Traces the path of sample `sample` of `pixel` in a render of that seed.
    pub(super) fn pilot(
        &self,
        world: &World,
        path: &PathSettings,
        (seed, pixel, sample): (u32, [u32; 2], u32),
        scratch: &mut Scratch,
    ) {
        let random = SamplePoint::new(SampleId { seed, pixel, sample });
        let [jitter_x, jitter_y, lens_u, lens_v] = random.draw::<4>(0, Dimension::Camera);
        let [u_time] = random.draw::<1>(0, Dimension::Time);
        let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
        let position = corner + Vec2::splat(0.5) + self.film.filter.sample([jitter_x, jitter_y], || 0.5).offset;
        let lens = [lens_u, lens_v];
        let ray = self.camera.ray(position, lens, u_time);
        let differentials = self
            .texture_share
            .map(|share| RayDifferentials::of_camera(self.camera, &ray, position, lens, u_time, share));
        let ray = (ray, differentials);
        // The camera ray is known once the path has its first vertex.
        let most = if self.on_camera_rays { 1 } else { u32::MAX };
        let path = PathSettings { max_depth: path.max_depth.min(most), ..*path };
        let own = |seen, _: &mut Scratch| seen;
        trace_path(world, &path, ray, &random, scratch, own);
    }
}

/// Evenly chosen ones where there are more than `most`.
pub(super) fn thinned<T: Copy>(list: &[T], most: usize) -> Vec<T> {
    let most = most.min(list.len());
    (0..most).map(|k| list[(k as u64 * list.len() as u64 / most as u64) as usize]).collect()
}

/// The boxes of everything that light may be gathered in or on: not of pure emitters, nor of surfaces that reflect nothing.
fn receiving_boxes(geometry: &Geometry, materials: &Materials, world: &World) -> Vec<ReceivingBox> {
    let receives = |id: &ShapeId| {
        let shape = &geometry.shapes[id.0 as usize];
        if shape.is_boundary {
            world.transition(*id).is_some()
        } else {
            !materials.is_black(MaterialId(shape.material))
        }
    };
    let of_shapes = |ids: &[ShapeId]| -> Vec<(u64, (Vec3, Vec3))> {
        let receiving = ids.iter().filter(|id| receives(id));
        receiving.filter_map(|&id| Some((u64::from(id.0), geometry.shape_bounds(id)?))).collect()
    };
    let prototypes: Vec<_> = geometry
        .prototypes
        .iter()
        .map(|prototype| of_shapes(&prototype.shapes).into_iter().map(|(_, bounds)| bounds).reduce(union))
        .collect();
    let instances = geometry.instances.iter().enumerate().filter_map(|(id, instance)| {
        let (low, high) = prototypes[instance.prototype as usize]?;
        Some((FIRST_INSTANCE + id as u64, instance.transform.bounds(low, high)))
    });
    let all = of_shapes(&geometry.top_level).into_iter().chain(instances);
    all.map(|(number, corners)| ReceivingBox { number, corners }).collect()
}
