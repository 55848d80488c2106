//! Cache points: light selection learned at points in space, with visibility learned while rendering.
//!
//! Source: Li, Zhu, Nichols, Kutz, Huang, Adler, Burley, Teece, "Cache Points for Production-Scale Occlusion-Aware Many-Lights Sampling
//! and Volumetric Scattering", DigiPro 2024. A file for each step: [`seed`] candidates, sort them ([`order`]), [`prune`] those that coincide,
//! [`merge`] those that see the same lights, gather their lights ([`gather`]), [`blur`] over neighbours, [`learn`] what arrives, and
//! [`select`] at a vertex from the nearest point ([`lookup`]). What a point knows is in [`table`].
//!
//! The points are only ever sampled from, never evaluated as lighting, so however rough they are, the image stays unbiased (as long as what
//! they learned in one iteration is independent of the random numbers of the next, which the render sees to).
//! The same scene and seed give the same points at any number of threads: candidates are sorted, marks do not depend on order, removal is
//! serial.

pub mod blur;
pub mod gather;
pub mod hierarchy;
pub mod learn;
pub mod linked;
pub mod lookup;
pub mod merge;
pub mod neighbours;
pub mod order;
pub mod prune;
pub mod seed;
pub mod select;
pub mod statistics;
pub mod table;
#[cfg(test)]
mod tests;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use crate::light::selector::Uniform;
use crate::light::{LightId, Lights, Receiver};
use blur::BlurWeights;
use gather::{Gathered, Gathering, Place, by_hierarchy, by_lists, sensors};
use hierarchy::{Cluster, Hierarchy};
use learn::VisibilityRule;
use lookup::NearestPoint;
use merge::{MergeSettings, SIGNATURE, Share, Signature, merge_similar};
use neighbours::NeighbourSearch;
use order::sort_spatially;
use prune::prune_coincident;
use seed::Candidate;
pub use select::CacheScratch;
pub use statistics::CacheStatistics;
use table::{BINS, Counter, FAR_ENTRY, FarLights, NearLights, OMNIDIRECTIONAL, range, split_lists};

/// With fewer candidates than this there is no cache: every vertex asks every light (section 3.1.1).
pub const FEWEST_CANDIDATES: usize = 10;

/// Far entries of all points together take at most this many bytes: with many points each gets fewer.
pub const MOST_BYTES: usize = 512 << 20;

/// Lights and clusters that a point keeps at most where nothing else is asked for.
pub const DEFAULT_ENTRIES: u32 = 256;

/// Which of the ways there are is taken; each improvement on the paper can be switched off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// How far lights are gathered.
    pub gathering: Gathering,
    /// How visibility is learned.
    pub visibility: VisibilityRule,
    /// Whether surface normals count in merging and look-up.
    pub normals: bool,
    /// Whether beams get candidates.
    pub beams: bool,
    /// Candidates at most; `None` for a number that suits the image.
    pub candidates: Option<u32>,
    /// Lights and clusters that a point keeps at most, [`gather::FEWEST`] to [`gather::MOST`].
    pub entries: u32,
}

impl Default for CacheSettings {
    fn default() -> Self {
        let (gathering, visibility) = Default::default();
        Self { gathering, visibility, normals: true, beams: true, candidates: None, entries: DEFAULT_ENTRIES }
    }
}

/// The points, and what they know.
#[derive(Debug)]
pub struct CachePoints {
    settings: CacheSettings,
    hierarchy: Hierarchy,
    /// In render space; off the surface that they belong to.
    positions: Vec<Vec3>,
    radii: Vec<f32>,
    lookup: NearestPoint,
    blur: BlurWeights,
    near: NearLights,
    far: FarLights,
    /// All lights that shine, for the small chance that any is chosen.
    uniform: Uniform,
    statistics: CacheStatistics,
}

impl CachePoints {
    /// Points for `lights` from `candidates`; `pixel_angle` is what one pixel spans at distance 1. `None` where there are too few
    /// candidates. `statistics` holds what seeding has to say.
    pub fn build(
        lights: &Lights,
        mut candidates: Vec<Candidate>,
        pixel_angle: f32,
        settings: CacheSettings,
        mut statistics: CacheStatistics,
    ) -> Option<Self> {
        candidates.retain(|c| c.p.is_finite());
        if candidates.len() < FEWEST_CANDIDATES {
            return None;
        }
        let mut clock = Clock::start();
        let hierarchy = Hierarchy::new(lights);
        statistics.seconds.hierarchy = clock.lap();

        sort_spatially(&mut candidates);
        statistics.coincident = prune_coincident(&mut candidates);
        statistics.seconds.prune = clock.lap();

        let first_radii = first_radii(&candidates);
        if settings.normals {
            for (candidate, &radius) in candidates.iter_mut().zip(&first_radii) {
                candidate.p = Self::off_surface(candidate.p, candidate.normal, radius);
            }
        }
        let signatures: Vec<Signature> = candidates
            .par_iter()
            .zip(&first_radii)
            .map(|(c, &radius)| signature(&hierarchy, lights, Place { p: c.p, radius }))
            .collect();
        statistics.seconds.signatures = clock.lap();
        let radii =
            merge_similar(&mut candidates, &signatures, MergeSettings { pixel_angle, normals: settings.normals });
        drop(signatures);
        statistics.points = candidates.len();
        statistics.seconds.merge = clock.lap();

        let positions: Vec<Vec3> = candidates.iter().map(|c| c.p).collect();
        let blur = BlurWeights::new(&positions);
        let gathered = gather_all(&hierarchy, lights, &positions, &radii, &blur, &settings);
        let near = near_lights(&gathered);
        let mut far = far_lights(&hierarchy, lights, &positions, &gathered);
        statistics.seconds.gather = clock.lap();

        far.energy = blurred_energy(&hierarchy, &blur, &far);
        statistics.seconds.blur = clock.lap();
        let lookup = NearestPoint::new(&positions);
        statistics.seconds.lookup = clock.lap();

        let dark = lights.ids().filter(|&id| lights.is_dark(id)).count();
        let uniform = Uniform::new(lights, dark);
        let mut cache = Self { settings, hierarchy, positions, radii, lookup, blur, near, far, uniform, statistics };
        cache.learn();
        cache.statistics.describe(&cache.near, &cache.far);
        cache.statistics.bytes = cache.memory();
        Some(cache)
    }

    /// Takes over what was learned since the last call: from now on lights are selected by it.
    pub fn learn(&mut self) {
        learn::update(self.settings.visibility, &self.blur, &mut self.near, &mut self.far);
    }

    /// Whether rendering changes anything.
    pub fn learns(&self) -> bool {
        self.settings.visibility != VisibilityRule::Off
    }

    /// What there is to say about it.
    pub fn statistics(&self) -> &CacheStatistics {
        &self.statistics
    }

    /// Positions (render space) and radii of the points.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (Vec3, f32)> + '_ {
        self.positions.iter().copied().zip(self.radii.iter().copied())
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        self.hierarchy.memory()
            + size_of_val(&*self.positions)
            + size_of_val(&*self.radii)
            + self.lookup.memory()
            + self.blur.memory()
            + self.near.memory()
            + self.far.memory()
            + self.uniform.memory()
    }
}

/// Seconds between steps.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> f64 {
        let seconds = self.0.elapsed().as_secs_f64();
        self.0 = Instant::now();
        seconds
    }
}

fn first_radii(candidates: &[Candidate]) -> Vec<f32> {
    let search = NeighbourSearch::new(candidates.iter().map(|c| c.p));
    let radius = |index| merge::mean_distance(&search.of(index, merge::NEIGHBOURS));
    (0..candidates.len() as u32).into_par_iter().map(radius).collect()
}

/// The lights of a place in few entries, each with its share of the fluence.
fn signature(hierarchy: &Hierarchy, lights: &Lights, place: Place) -> Signature {
    let Gathered { near, far } = by_hierarchy(hierarchy, lights, place, SIGNATURE);
    let mut clusters = [near, far].concat();
    clusters.sort_unstable_by_key(|cluster| cluster.key);
    // Going down may end with one cluster more than asked for.
    clusters.truncate(SIGNATURE);
    let receiver = Receiver::medium(place.p);
    let energies: Vec<f32> = clusters.iter().map(|cluster| hierarchy.energy(lights, cluster, &receiver)).collect();
    let total: f64 = energies.iter().map(|&e| f64::from(e)).sum();
    let share = |energy: f32| if total > 0.0 { (f64::from(energy) / total) as f32 } else { 0.0 };
    let keys = |cluster: &Cluster| [cluster.key, cluster.last()];
    clusters.iter().zip(energies).map(|(cluster, energy)| Share { keys: keys(cluster), share: share(energy) }).collect()
}

fn gather_all(
    hierarchy: &Hierarchy,
    lights: &Lights,
    positions: &[Vec3],
    radii: &[f32],
    blur: &BlurWeights,
    settings: &CacheSettings,
) -> Vec<Gathered> {
    let most = (MOST_BYTES / (FAR_ENTRY * positions.len())).min(settings.entries as usize);
    let places = positions.par_iter().zip(radii).map(|(&p, &radius)| Place { p, radius });
    match settings.gathering {
        Gathering::Hierarchy => places.map(|place| by_hierarchy(hierarchy, lights, place, most)).collect(),
        Gathering::Lists => {
            let leaves: Vec<(LightId, Cluster)> =
                lights.ids().filter_map(|id| Some((id, hierarchy.leaf(lights, id)?))).collect();
            let own: Vec<Gathered> = places.map(|place| by_lists(hierarchy, lights, &leaves, place)).collect();
            // The blur adds the neighbours' lights, as far as there is room.
            let with_neighbours = |point: u32| {
                let Gathered { near, mut far } = own[point as usize].clone();
                let theirs = blur.of(point).iter().flat_map(|&(q, _)| &own[q as usize].far);
                let room = most.saturating_sub(far.len());
                let is_in = |list: &[Cluster], c: &Cluster| list.binary_search_by_key(&c.key, |c| c.key).is_ok();
                let mut more: Vec<Cluster> = theirs.copied().filter(|c| !is_in(&near, c) && !is_in(&far, c)).collect();
                more.sort_unstable_by_key(|c| c.key);
                more.dedup();
                more.truncate(room);
                far.extend(more);
                far.sort_unstable_by_key(|c| c.key);
                Gathered { near, far }
            };
            (0..own.len() as u32).into_par_iter().map(with_neighbours).collect()
        }
    }
}

fn offsets(counts: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut offsets = vec![0];
    offsets.extend(counts.scan(0, |sum, count| {
        *sum += count as u32;
        Some(*sum)
    }));
    offsets
}

fn near_lights(gathered: &[Gathered]) -> NearLights {
    let clusters: Vec<Cluster> = gathered.iter().flat_map(|g| g.near.iter().copied()).collect();
    let counters = clusters.iter().map(|_| Counter::default()).collect();
    NearLights {
        offsets: offsets(gathered.iter().map(|g| g.near.len())),
        visibility: vec![1.0; clusters.len()],
        counters,
        clusters,
    }
}

fn far_lights(hierarchy: &Hierarchy, lights: &Lights, positions: &[Vec3], gathered: &[Gathered]) -> FarLights {
    let clusters: Vec<Cluster> = gathered.iter().flat_map(|g| g.far.iter().copied()).collect();
    let offsets = offsets(gathered.iter().map(|g| g.far.len()));
    let mut energy = vec![[0.0; BINS]; clusters.len()];
    split_lists(&mut energy, &offsets, 1).into_par_iter().enumerate().for_each(|(point, out)| {
        for (energy, cluster) in out.iter_mut().zip(&clusters[range(&offsets, point as u32)]) {
            *energy = sensors(hierarchy, lights, cluster, positions[point]);
        }
    });
    let counters = clusters.iter().map(|_| Counter::default()).collect();
    FarLights { offsets, clusters, energy, counters, visibility: vec![], sums: vec![] }
}

/// The far lights' energies averaged over neighbours (section 3.1.5), not in place.
fn blurred_energy(hierarchy: &Hierarchy, blur: &BlurWeights, far: &FarLights) -> Vec<[f32; BINS]> {
    let mut blurred = far.energy.clone();
    split_lists(&mut blurred, &far.offsets, 1).into_par_iter().enumerate().for_each(|(point, sums)| {
        let own = &far.clusters[range(&far.offsets, point as u32)];
        let mut weights = 1.0;
        for &(neighbour, weight) in blur.of(point as u32) {
            let other = range(&far.offsets, neighbour);
            let other = (&far.clusters[other.clone()], &far.energy[other]);
            blur::add_energy(hierarchy, own, sums, other, weight);
            weights += weight;
        }
        sums.iter_mut().flatten().for_each(|energy| *energy = (*energy / weights).min(f32::MAX));
    });
    blurred
}

/// How many entries each point has in a sensor's list.
fn entries_per_bin(far: &FarLights) -> [f64; BINS] {
    let points = (far.offsets.len() - 1).max(1) as f64;
    std::array::from_fn(|bin| far.energy.iter().filter(|energy| energy[bin] > 0.0).count() as f64 / points)
}

const _: () = assert!(OMNIDIRECTIONAL == BINS - 1);
