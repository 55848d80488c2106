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
pub mod counter;
pub mod gather;
pub mod hierarchy;
pub mod kept;
pub mod learn;
pub mod linked;
pub mod lookup;
pub mod merge;
pub mod neighbours;
pub mod order;
pub mod prune;
pub mod refine;
pub mod scatter;
pub mod seed;
pub mod select;
pub mod statistics;
pub mod table;
#[cfg(test)]
mod tests;

use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::camera::PixelSpan;
use crate::light::selector::Uniform;
use crate::light::{LightId, Lights, Receiver};
use blur::BlurWeights;
use gather::{Extent, Gathering, Site, all_by_lists, by_hierarchy, sensors};
use hierarchy::{Cluster, Hierarchy};
use kept::KeptPoints;
use learn::{Lesson, VisibilityRule};
use lookup::NearestPoint;
use merge::{MergeSettings, SIGNATURE, Share, Signature, merge_similar};
use neighbours::NeighbourSearch;
use order::sort_spatially;
use prune::prune_coincident;
use scatter::{Phases, ScatterWeights};
use seed::Candidate;
pub use select::CacheScratch;
pub use statistics::CacheStatistics;
use table::{ENTRY, Energies, Table, pack};

/// With fewer candidates than this there is no cache: every vertex asks every light (section 3.1.1).
pub const FEWEST_CANDIDATES: usize = 10;

/// The lists of all points together take about this many bytes at most, twice as many while they are made anew: with many points each gets fewer.
pub const MOST_BYTES: usize = 512 << 20;

/// Lights and clusters that a point keeps at most where nothing else is asked for. With 128 instead of 64 (two candidates, 160 × 90 pixels, 32 spp,
/// two seeds) RMSE² × processor time is 0.74 as much in the scene `rooms`, 1.1 in `house` and 1.2 in `foliage`, the RMSE 0.75, 0.95 and 0.97.
pub const DEFAULT_ENTRIES: u32 = 128;

/// Which of the ways there are is taken; each improvement on the paper can be switched off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// How far lights are gathered.
    pub gathering: Gathering,
    /// How visibility is learned.
    pub visibility: VisibilityRule,
    /// Whether lists are made anew from what was learned.
    pub refine: bool,
    /// Whether pilot paths learn before the first pass.
    pub rehearse: bool,
    /// Whether surface normals count in merging and look-up.
    pub normals: bool,
    /// Whether ways to the lights of a cluster end where those are alike ([`crate::light::tree`]).
    pub alike: bool,
    /// Whether clusters of lights that are near are evaluated at the vertex, as near lights are. It makes the RMSE at 8 spp 0.83 times as large in
    /// `foliage` with 38,720 lights (160 × 90 pixels, three seeds; 0.86 times where nothing is learned), at 16 spp 0.98 in `rooms`, 0.99 in `house` and 0.94 in `foliage`
    /// with 3,000 (four seeds); processor times are 0.97 to 1.01 times as long.
    pub near_clusters: bool,
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
        Self {
            gathering,
            visibility,
            refine: true,
            rehearse: true,
            normals: true,
            alike: true,
            near_clusters: true,
            beams: true,
            candidates: None,
            entries: DEFAULT_ENTRIES,
        }
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
    table: Table,
    /// What media at the points scatter towards the camera, where in-scatter sampling asks for it.
    scatter: Option<ScatterWeights>,
    /// How many iterations there were.
    iterations: u32,
    /// All lights that shine, for the small chance that any is chosen.
    uniform: Uniform,
    statistics: CacheStatistics,
}

impl CachePoints {
    /// Points for `lights` from `candidates`; `pixel` is what one pixel spans. `None` where there are too few
    /// candidates. `statistics` holds what seeding has to say.
    pub fn build(
        lights: &Lights,
        mut candidates: Vec<Candidate>,
        pixel: PixelSpan,
        settings: CacheSettings,
        mut statistics: CacheStatistics,
    ) -> Option<Self> {
        candidates.retain(|c| c.p.is_finite());
        if candidates.len() < FEWEST_CANDIDATES {
            return None;
        }
        let mut clock = Clock::start();
        let hierarchy = Hierarchy::new(lights, settings.alike);
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
            .map(|(c, &radius)| signature(&hierarchy, lights, Site { p: c.p, radius }))
            .collect();
        statistics.seconds.signatures = clock.lap();
        let radii = merge_similar(&mut candidates, &signatures, MergeSettings { pixel, normals: settings.normals });
        drop(signatures);
        statistics.points = candidates.len();
        statistics.seconds.merge = clock.lap();

        let positions: Vec<Vec3> = candidates.iter().map(|c| c.p).collect();
        let blur = BlurWeights::new(&positions);
        let mut table = gather_all(&hierarchy, lights, &positions, &radii, &blur, &settings);
        table.energies = energies(&hierarchy, lights, &positions, &table);
        statistics.seconds.gather = clock.lap();

        table.energies = blur::blurred(&hierarchy, lights, &blur, &table);
        statistics.seconds.blur = clock.lap();
        let kept = KeptPoints { positions, radii, table, iterations: 0 };
        Some(Self::assembled(lights, settings, hierarchy, blur, kept, statistics))
    }

    /// All of it, from what took long to come by.
    fn assembled(
        lights: &Lights,
        settings: CacheSettings,
        hierarchy: Hierarchy,
        blur: BlurWeights,
        kept: KeptPoints,
        mut statistics: CacheStatistics,
    ) -> Self {
        let KeptPoints { positions, radii, table, iterations } = kept;
        let mut clock = Clock::start();
        let lookup = NearestPoint::new(&positions);
        statistics.seconds.lookup = clock.lap();
        let uniform = Uniform::of_shining(lights);
        let scatter = None;
        let mut cache = Self {
            settings,
            hierarchy,
            positions,
            radii,
            lookup,
            blur,
            table,
            scatter,
            iterations,
            uniform,
            statistics,
        };
        cache.statistics.describe(&cache.table);
        cache.statistics.bytes = cache.memory();
        cache
    }

    /// Takes over what was learned since the last call: from now on lights are selected by it.
    pub fn learn(&mut self, lights: &Lights) -> Lesson {
        let lesson = self.update();
        self.iterations += 1;
        if self.refines() && lesson == Lesson::Clear && self.iterations == refine::AFTER {
            let places: Vec<Site> = places(&self.positions, &self.radii).collect();
            let extent = extent(places.len(), &self.settings);
            self.table = refine::refined(&self.hierarchy, lights, &self.table, &places, extent);
            self.table.energies = energies(&self.hierarchy, lights, &self.positions, &self.table);
            self.table.energies = blur::blurred(&self.hierarchy, lights, &self.blur, &self.table);
            self.update();
            self.visit_for_scattering(lights);
            self.statistics.describe(&self.table);
            self.statistics.bytes = self.memory();
        }
        self.update_scattering(lights);
        lesson
    }

    /// Takes down what a rehearsal took.
    pub fn has_rehearsed(&mut self, rays: u64, seconds: f64) {
        self.statistics.rehearsal_rays = rays;
        self.statistics.seconds.rehearsal = seconds;
    }

    /// From now on keeps ready what media at the points scatter towards the camera, for these mean cosines of theirs.
    pub fn weigh_scattering(&mut self, lights: &Lights, phases: Phases) {
        let mut clock = Clock::start();
        self.scatter = Some(ScatterWeights::new(lights, phases));
        self.visit_for_scattering(lights);
        self.update_scattering(lights);
        self.statistics.seconds.scatter = clock.lap();
        self.statistics.bytes = self.memory();
    }

    /// Scatter weights are not wanted any more.
    pub fn end_scattering(&mut self) {
        self.scatter = None;
    }

    /// Whether scatter weights are kept.
    pub const fn scatters(&self) -> bool {
        self.scatter.is_some()
    }

    fn visit_for_scattering(&mut self, lights: &Lights) {
        if let Some(scatter) = &mut self.scatter {
            let places: Vec<Site> = places(&self.positions, &self.radii).collect();
            scatter.visit(&self.hierarchy, lights, &self.table, &places);
        }
    }

    fn update_scattering(&mut self, lights: &Lights) {
        if let Some(scatter) = &mut self.scatter {
            let places: Vec<Site> = places(&self.positions, &self.radii).collect();
            scatter.update(&self.hierarchy, lights, &self.table, &places);
        }
    }

    /// The point nearest to `p`, and its radius.
    #[inline]
    pub fn nearest(&self, p: Vec3) -> (u32, f32) {
        let point = self.lookup.of(p);
        (point, self.radii[point as usize])
    }

    /// What a medium of mean cosine `g` at `p`, to which `point` is the nearest, scatters towards the camera, narrow beams left out: luminance per
    /// unit of μ_s and length. 0 where no scatter weights are kept.
    #[inline]
    pub fn scattered(&self, lights: &Lights, point: u32, p: Vec3, g: f32) -> f32 {
        let at = |scatter: &ScatterWeights| scatter.at(&self.hierarchy, lights, &self.table, point, p, g);
        self.scatter.as_ref().map_or(0.0, at)
    }

    /// The beams that [`CachePoints::scattered`] leaves out.
    #[inline]
    pub fn beams(&self) -> &[LightId] {
        self.scatter.as_ref().map_or(&[], ScatterWeights::beams)
    }

    /// Whether [`CachePoints::scattered`] is 0 everywhere.
    #[inline]
    pub fn scatters_only_beams(&self) -> bool {
        self.scatter.as_ref().is_some_and(ScatterWeights::only_beams)
    }

    /// The share of the light of `light` that is expected to arrive at `point`.
    #[inline]
    pub fn arrives(&self, lights: &Lights, point: u32, light: LightId) -> f32 {
        let entries = table::range(&self.table.offsets, point);
        let entry = self.hierarchy.place(lights, light).and_then(|place| self.table.list(point).find(place));
        entry.map_or(1.0, |k| self.table.visibility[entries][k].powi(2))
    }

    /// Whether lists are made anew: where they leave no light out, and W tells how often a light arrives.
    fn refines(&self) -> bool {
        let CacheSettings { refine, gathering, visibility, .. } = self.settings;
        let is_root = matches!(visibility, VisibilityRule::Root | VisibilityRule::Clusters);
        refine && is_root && gathering == Gathering::Hierarchy
    }

    fn update(&mut self) -> Lesson {
        learn::update(self.settings.visibility, &self.hierarchy, &self.blur, &mut self.table)
    }

    /// What was learned so far, to go on from another time.
    pub const fn learned(&self) -> LearnedRef<'_> {
        LearnedRef { table: &self.table, scatter: &self.scatter, iterations: self.iterations }
    }

    /// Goes on from what these very points learned another time; false, and nothing is changed, where they are others.
    #[must_use]
    pub fn relearn(&mut self, learned: Learned) -> bool {
        let fits = learned.table.is_whole() && learned.table.offsets.len() == self.table.offsets.len();
        if fits {
            Learned { table: self.table, scatter: self.scatter, iterations: self.iterations } = learned;
            self.statistics.describe(&self.table);
            self.statistics.bytes = self.memory();
        }
        fits
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
            + self.table.memory()
            + self.scatter.as_ref().map_or(0, ScatterWeights::memory)
            + self.uniform.memory()
    }
}

/// What points have learned.
#[derive(Debug, serde::Deserialize)]
pub struct Learned {
    table: Table,
    scatter: Option<ScatterWeights>,
    iterations: u32,
}

/// The same, where it is.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct LearnedRef<'a> {
    table: &'a Table,
    scatter: &'a Option<ScatterWeights>,
    iterations: u32,
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
fn signature(hierarchy: &Hierarchy, lights: &Lights, place: Site) -> Signature {
    let extent = Extent { most: SIGNATURE, near_clusters: false };
    let mut clusters = by_hierarchy(hierarchy, lights, place, extent).clusters;
    // There may be more lights at infinity than there is room for.
    clusters.truncate(SIGNATURE);
    let receiver = Receiver::medium(place.p);
    let energies: Vec<f32> = clusters.iter().map(|cluster| hierarchy.energy(lights, cluster, &receiver)).collect();
    let total: f64 = energies.iter().map(|&e| f64::from(e)).sum();
    let share = |energy: f32| if total > 0.0 { (f64::from(energy) / total) as f32 } else { 0.0 };
    let of = |(c, energy): (&Cluster, f32)| Share { places: [c.first, c.count], share: share(energy) };
    clusters.iter().zip(energies).map(of).collect()
}

/// How much each of so many points may gather.
fn extent(points: usize, settings: &CacheSettings) -> Extent {
    let most = (MOST_BYTES / (ENTRY * points)).min(settings.entries as usize);
    Extent { most, near_clusters: settings.near_clusters }
}

fn places(positions: &[Vec3], radii: &[f32]) -> impl Iterator<Item = Site> {
    positions.iter().zip(radii).map(|(&p, &radius)| Site { p, radius })
}

/// The lists of all points, no energies yet.
fn gather_all(
    hierarchy: &Hierarchy,
    lights: &Lights,
    positions: &[Vec3],
    radii: &[f32],
    blur: &BlurWeights,
    settings: &CacheSettings,
) -> Table {
    let extent = extent(positions.len(), settings);
    let places: Vec<Site> = places(positions, radii).collect();
    match settings.gathering {
        Gathering::Hierarchy => {
            let gather = |point: u32| by_hierarchy(hierarchy, lights, places[point as usize], extent);
            Table::gathered(places.len(), Some(hierarchy.places()), |point| (gather(point), vec![]))
        }
        Gathering::Lists => {
            let lists = all_by_lists(hierarchy, lights, &places, blur, extent.most);
            Table::gathered(places.len(), None, |point| (lists[point as usize].clone(), vec![]))
        }
    }
}

/// What the sensors at each point receive of its entries.
fn energies(hierarchy: &Hierarchy, lights: &Lights, positions: &[Vec3], table: &Table) -> Energies {
    let mut out = Energies::new(table.visibility.len());
    out.split(&table.offsets).into_par_iter().enumerate().for_each(|(point, (fluence, shares))| {
        for (k, cluster) in table.list(point as u32).iter().enumerate() {
            pack(&sensors(hierarchy, lights, &cluster, positions[point]), k, fluence, shares);
        }
    });
    out
}
