//! Scatter weights: what a medium at a point would scatter towards the camera. Source: Li et al. 2024, section 4.2.
//!
//! While a point visits its lights it stores for each of them
//!
//! ```text
//! B ≈ ∫ L(y,ω') ρ(y,ω,ω') dω',
//! ```
//!
//! with y random inside the point's radius, ω' towards a random position on the light and ω towards the camera. **Ours:** μ_s is left out, because
//! it is known where B is used; and since a whole ray needs B at many places, only the sum over the lights, each with what was learned of its
//! visibility, is kept ready: one number a point for each phase function.

use std::f32::consts::PI;

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::gather::Site;
use super::hierarchy::{Cluster, Hierarchy};
use super::table::{Table, range};
use crate::light::{LightRef, Lights};
use crate::math::phase::HenyeyGreenstein;
use crate::math::sampler::{Stream, mix};
use crate::math::warp::uniform_sphere;

/// Phase functions that weights are kept for. More of them share the nearest one's.
pub const MOST_PHASES: usize = 4;

/// Directions that the phase function is averaged over, where a light spans an angle as seen from around the point; of backgrounds.
const DIRECTIONS: u32 = 4;
const BACKGROUND_DIRECTIONS: u32 = 16;
/// Where neither the light nor the point's surroundings span more than this (as a tangent), one direction is enough.
const NARROW: f32 = 0.05;

/// The mean cosines that weights are kept for.
pub type Phases = ArrayVec<f32, MOST_PHASES>;

/// B of all entries, and their sums.
#[derive(Debug)]
pub struct ScatterWeights {
    phases: Phases,
    /// For each phase function, in the order of [`Table`]'s entries: the mean of ρ over the light, relative to isotropic scattering.
    lobes: Vec<Vec<f32>>,
    /// For each phase function: B of each point.
    sums: Vec<Vec<f32>>,
}

impl ScatterWeights {
    /// For these mean cosines; nothing is weighed yet.
    pub fn new(phases: Phases) -> Self {
        Self { phases, lobes: vec![], sums: vec![] }
    }

    /// The number of the phase function that stands for the mean cosine `g`.
    #[inline]
    pub fn phase(&self, g: f32) -> usize {
        let nearest = |a: &usize, b: &usize| (self.phases[*a] - g).abs().total_cmp(&(self.phases[*b] - g).abs());
        if self.phases.len() == 1 { 0 } else { (0..self.phases.len()).min_by(nearest).unwrap_or(0) }
    }

    /// B of `point` for the phase function of that number: luminance of the radiance that is scattered towards the camera per unit of μ_s and
    /// length.
    #[inline]
    pub fn of(&self, point: u32, phase: usize) -> f32 {
        self.sums[phase][point as usize]
    }

    /// The lists were made anew: visits all lights again.
    pub fn visit(&mut self, hierarchy: &Hierarchy, lights: &Lights, table: &Table, places: &[Site]) {
        let of_phase = |&g: &f32| {
            if g == 0.0 {
                return vec![];
            }
            let phase = HenyeyGreenstein::new(g);
            let of_point = |point: usize| {
                let mut stream = Stream::from_seed(mix(point as u64));
                let list = table.list(point as u32);
                let lobes = list.iter().map(|c| lobe(hierarchy, lights, &phase, &c, places[point], &mut stream));
                lobes.collect::<Vec<f32>>()
            };
            let lists: Vec<Vec<f32>> = (0..places.len()).into_par_iter().map(of_point).collect();
            lists.concat()
        };
        self.lobes = self.phases.iter().map(of_phase).collect();
    }

    /// Takes over what was learned of the lights' visibility: with W = √R, W² is the share of them that arrives. (W itself, which is best where
    /// one technique has to find all light, gave 6 % less in the scene `godrays`: null tracking looks after what is expected too rarely.)
    pub fn update(&mut self, table: &Table) {
        let points = table.offsets.len() as u32 - 1;
        let of_phase = |lobes: &Vec<f32>| -> Vec<f32> {
            let sum = |point: u32| {
                let entries = range(&table.offsets, point);
                let (fluence, _) = table.energies(point);
                let seen = fluence.iter().zip(&table.visibility[entries.clone()]).map(|(fluence, w)| fluence * w * w);
                let sum: f64 = match lobes.get(entries) {
                    Some(lobes) => seen.zip(lobes).map(|(seen, lobe)| f64::from(seen * lobe)).sum(),
                    None => seen.map(f64::from).sum(),
                };
                ((sum / f64::from(4.0 * PI)) as f32).min(f32::MAX)
            };
            (0..points).into_par_iter().map(sum).collect()
        };
        self.sums = self.lobes.iter().map(of_phase).collect();
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.lobes.iter().chain(&self.sums).map(|list| size_of_val(&**list)).sum()
    }
}

/// The mean of 4π ρ over the directions to `cluster` from around `place`, towards the camera at the origin.
fn lobe(
    hierarchy: &Hierarchy,
    lights: &Lights,
    phase: &HenyeyGreenstein,
    cluster: &Cluster,
    place: Site,
    stream: &mut Stream,
) -> f32 {
    let mut next = || [stream.next_f32(), stream.next_f32()];
    let light = hierarchy.light(cluster).map(|id| lights.get(id));
    let (mut sum, mut count) = (0.0, 0);
    let mut add = |p: Vec3, wi: Vec3| {
        sum += phase.evaluate((-p).normalize_or(Vec3::Z), wi);
        count += 1;
    };
    match (light, hierarchy.ball(lights, cluster)) {
        (_, Some((centre, radius))) => {
            let distance = centre.distance(place.p);
            let is_narrow = radius + place.radius < NARROW * distance;
            for _ in 0..if is_narrow { 1 } else { DIRECTIONS } {
                let (p, q) = if is_narrow {
                    (place.p, centre)
                } else {
                    (place.p + place.radius * uniform_sphere(next()), centre + radius * uniform_sphere(next()))
                };
                add(p, (q - p).normalize_or(Vec3::Z));
            }
        }
        (Some(LightRef::Distant(light)), None) => add(place.p, light.wi),
        (Some(LightRef::Infinite(light)), None) => {
            for _ in 0..BACKGROUND_DIRECTIONS {
                if let Some(sample) = light.sample(next(), f64::from(next()[0])) {
                    add(place.p, sample.wi);
                }
            }
        }
        _ => {}
    }
    if count > 0 { 4.0 * PI * sum / count as f32 } else { 1.0 }
}
