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
//! visibility, is kept ready: one number a point for each phase function. Left out of it are the point's strongest lights, which are evaluated
//! where B is asked for (a fire is many times brighter at one end of a cell than at the other), and narrow beams, which are looked for along the ray.

use std::f32::consts::PI;

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::gather::Site;
use super::hierarchy::{Cluster, Hierarchy};
use super::seed::beams;
use super::table::{Table, range};
use crate::light::{LightId, LightRef, Lights, Receiver};
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
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub struct ScatterWeights {
    phases: Phases,
    /// For each phase function, in the order of [`Table`]'s entries: the mean of ρ over the light, relative to isotropic scattering.
    lobes: Vec<Vec<f32>>,
    /// For each phase function: B of each point, without its strong lights and beams.
    sums: Vec<Vec<f32>>,
    /// The entries of each point that are strong lights; [`NONE`] where there are fewer.
    strong: Vec<[u16; STRONG]>,
    /// Narrow beams.
    beams: Vec<LightId>,
    /// Whether no point knows of any other light.
    only_beams: bool,
    /// Whether points have been told often enough on average what arrives there.
    knows_enough: bool,
}

/// Points have been told enough when entries were tried so often on average (lists that are made anew begin with few tries): in `godrays` a lookup for each vertex in its haze took 2 % of the time.
const ENOUGH_TRIES: f64 = 64.0;

/// Strong lights of a point at most.
const STRONG: usize = 2;
/// No entry.
const NONE: u16 = u16::MAX;
/// A light of at least this share of a point's B is strong.
const STRONG_SHARE: f32 = 0.1;
/// If it is no farther than this many radii of the point: from farther away it is the same all around.
const STRONG_RADII: f32 = 16.0;
/// With more beams than this, points alone say where they are.
const MOST_BEAMS: usize = 256;

impl ScatterWeights {
    /// For these mean cosines; nothing is weighed yet.
    pub fn new(lights: &Lights, phases: Phases) -> Self {
        let mut beams: Vec<LightId> = beams(lights).take(MOST_BEAMS + 1).collect();
        if beams.len() > MOST_BEAMS {
            beams.clear();
        }
        Self { phases, lobes: vec![], sums: vec![], strong: vec![], beams, only_beams: false, knows_enough: false }
    }

    /// The beams that are left out of [`ScatterWeights::at`].
    #[inline]
    pub fn beams(&self) -> &[LightId] {
        &self.beams
    }

    /// Whether [`ScatterWeights::at`] is 0 everywhere.
    #[inline]
    pub const fn only_beams(&self) -> bool {
        self.only_beams
    }

    /// Whether more tries at lights would hardly change what is known.
    #[inline]
    pub const fn knows_enough(&self) -> bool {
        self.knows_enough
    }

    /// The number of the phase function that stands for the mean cosine `g`.
    #[inline]
    fn phase(&self, g: f32) -> usize {
        let nearest = |a: &usize, b: &usize| (self.phases[*a] - g).abs().total_cmp(&(self.phases[*b] - g).abs());
        if self.phases.len() == 1 { 0 } else { (0..self.phases.len()).min_by(nearest).unwrap_or(0) }
    }

    /// B at `p`, to which `point` is the nearest, for the mean cosine `g`: luminance of the radiance that is scattered towards the camera per unit
    /// of μ_s and length.
    #[inline]
    pub fn at(&self, hierarchy: &Hierarchy, lights: &Lights, table: &Table, point: u32, p: Vec3, g: f32) -> f32 {
        let phase = self.phase(g);
        let mut sum = self.sums[phase][point as usize];
        let entries = range(&table.offsets, point);
        for &k in self.strong[point as usize].iter().filter(|&&k| k != NONE) {
            let entry = entries.start + usize::from(k);
            let cluster = table.list(point).get(usize::from(k));
            let w = table.visibility[entry];
            let lobe = self.lobes[phase].get(entry).copied().unwrap_or(1.0);
            sum += hierarchy.energy(lights, &cluster, &Receiver::medium(p)) * w * w * lobe * (1.0 / (4.0 * PI));
        }
        sum.min(f32::MAX)
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
    pub fn update(&mut self, hierarchy: &Hierarchy, lights: &Lights, table: &Table, places: &[Site]) {
        let of_point = |point: usize| {
            let entries = range(&table.offsets, point as u32);
            let (fluence, _) = table.energies(point as u32);
            let mut seen: Vec<f32> =
                fluence.iter().zip(&table.visibility[entries.clone()]).map(|(fluence, w)| fluence * w * w).collect();
            let list = table.list(point as u32);
            if !self.beams.is_empty() {
                let is_beam = |light| self.beams.binary_search(&light).is_ok();
                let beams = list.iter().zip(&mut seen).filter(|(c, _)| hierarchy.light(c).is_some_and(is_beam));
                beams.for_each(|(_, seen)| *seen = 0.0);
            }
            let least = STRONG_SHARE * seen.iter().sum::<f32>();
            let mut strong = [NONE; STRONG];
            for slot in &mut strong {
                let strongest = (0..seen.len()).max_by(|&a, &b| seen[a].total_cmp(&seen[b]));
                let Some(k) = strongest.filter(|&k| seen[k] > least) else { break };
                let near =
                    |(centre, _): (Vec3, f32)| centre.distance(places[point].p) < STRONG_RADII * places[point].radius;
                if list.get(k).count > 1 || !hierarchy.ball(lights, &list.get(k)).is_some_and(near) {
                    break;
                }
                (*slot, seen[k]) = (k as u16, 0.0);
            }
            let sum = |lobes: &Vec<f32>| {
                let sum: f64 = match lobes.get(entries.clone()) {
                    Some(lobes) => seen.iter().zip(lobes).map(|(seen, lobe)| f64::from(seen * lobe)).sum(),
                    None => seen.iter().copied().map(f64::from).sum(),
                };
                ((sum / f64::from(4.0 * PI)) as f32).min(f32::MAX)
            };
            (strong, self.lobes.iter().map(sum).collect())
        };
        let points: Vec<([u16; STRONG], Phases)> = (0..places.len()).into_par_iter().map(of_point).collect();
        self.strong = points.iter().map(|(strong, _)| *strong).collect();
        self.sums = (0..self.phases.len()).map(|phase| points.iter().map(|(_, sums)| sums[phase]).collect()).collect();
        let is_dark = self.sums.iter().flatten().all(|&sum| sum == 0.0);
        self.only_beams = is_dark && self.strong.iter().flatten().all(|&k| k == NONE);
        self.knows_enough = table.tries() >= ENOUGH_TRIES * table.counters.len() as f64;
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        let lists: usize = self.lobes.iter().chain(&self.sums).map(|list| size_of_val(&**list)).sum();
        lists + size_of_val(&*self.strong) + size_of_val(&*self.beams)
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
                if let Some(sample) = light.sample(place.p, next(), f64::from(next()[0])) {
                    add(place.p, sample.wi);
                }
            }
        }
        _ => {}
    }
    if count > 0 { 4.0 * PI * sum / count as f32 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::gather::{Extent, by_hierarchy};
    use super::super::table::pack;
    use super::*;
    use crate::cache_points::gather::sensors;
    use crate::light::{DistantLight, PointLight, SpotLight};
    use crate::math::Rgb;

    /// One point far from its lights, with scatter weights for these mean cosines, and all that they stand on.
    fn weights(lights: &Lights, place: Site, phases: &[f32], visibility: f32) -> (ScatterWeights, Hierarchy, Table) {
        let hierarchy = Hierarchy::new(lights, true);
        let extent = Extent { most: 64, near_clusters: true };
        let gather = |_| (by_hierarchy(&hierarchy, lights, place, extent), vec![]);
        let mut table = Table::gathered(1, Some(hierarchy.places()), gather);
        table.energies = super::super::table::Energies::new(table.visibility.len());
        table.visibility.fill(visibility);
        let list: Vec<Cluster> = table.list(0).iter().collect();
        for (fluence, shares) in table.energies.split(&table.offsets) {
            list.iter()
                .enumerate()
                .for_each(|(k, c)| pack(&sensors(&hierarchy, lights, c, place.p), k, fluence, shares));
        }
        let mut weights = ScatterWeights::new(lights, phases.iter().copied().collect());
        weights.visit(&hierarchy, lights, &table, &[place]);
        weights.update(&hierarchy, lights, &table, &[place]);
        (weights, hierarchy, table)
    }

    #[test]
    fn they_are_what_is_scattered_towards_the_camera() {
        let mut lights = Lights::default();
        lights.add_point(PointLight { p: Vec3::new(40.0, 0.0, 5.0), intensity: Rgb::splat(300.0) });
        lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::splat(2.0) });
        let spot =
            SpotLight { p: Vec3::ZERO, axis: Vec3::Z, intensity: Rgb::splat(1e6), cos_start: 0.9999, cos_end: 0.999 };
        lights.add_spot(spot);
        let place = Site { p: Vec3::new(0.0, 0.0, 5.0), radius: 0.01 };
        let phases = [-0.5, 0.0, 0.9];
        let (weights, hierarchy, table) = weights(&lights, place, &phases, 0.5);
        assert_eq!(weights.beams().len(), 1);
        for g in phases {
            let phase = HenyeyGreenstein::new(g);
            let (from_point, from_sun) = (300.0 / 1600.0, 2.0);
            let wo = -Vec3::Z;
            // W² of either; the beam is left out.
            let expected = 0.25 * (from_point * phase.evaluate(wo, Vec3::X) + from_sun * phase.evaluate(wo, Vec3::Y));
            let found = weights.at(&hierarchy, &lights, &table, 0, place.p, g);
            assert!((found - expected).abs() < 0.02 * expected, "{g}: {found} {expected}");
        }
    }

    #[test]
    fn a_strong_light_is_evaluated_where_it_is_asked_for() {
        let mut lights = Lights::default();
        lights.add_point(PointLight { p: Vec3::new(4.0, 0.0, 5.0), intensity: Rgb::splat(300.0) });
        let place = Site { p: Vec3::new(0.0, 0.0, 5.0), radius: 1.0 };
        let (weights, hierarchy, table) = weights(&lights, place, &[0.0], 1.0);
        for x in [0.0f32, 2.0, 3.5] {
            let found = weights.at(&hierarchy, &lights, &table, 0, Vec3::new(x, 0.0, 5.0), 0.0);
            let expected = 300.0 / (4.0 - x).powi(2) / (4.0 * PI);
            assert!((found - expected).abs() < 1e-3 * expected, "{x}: {found} {expected}");
        }
    }
}
