//! In-scatter sampling: scattering points on camera rays, drawn where cache points expect light to be scattered towards the camera, combined
//! with null-collision tracking by multiple importance sampling. Source: Li et al. 2024, section 4.2.
//!
//! The ray's density p_select over distance is linear between knots ([`PiecewiseLinear`]). A point x_k drawn from it is reached by ratio tracking,
//! against null tracking that reaches it past the same null collisions, so nearly everything cancels:
//!
//! ```text
//! p_null : p_in-scatter  =  P_n(x_1) … P_n(x_{k−1}) μ̄(x_k) P_s(x_k)  :  p_select(x_k)
//! ```
//!
//! What is drawn is a place to sample lights from. So the direct light that a vertex on a camera ray receives is found in three ways
//! (null tracking or in-scatter sampling with a light sample, null tracking with a phase sample), and weighed by the balance heuristic over
//! all of them; longer paths go on from null tracking's vertices alone.
//!
//! **Ours:** the knots carry the transmittance to the camera as well; they lie as close as the cache points do; and they are laid out once for all
//! samples that a pixel takes in a pass. The samples' rays differ a little, which is why any density that is 0 somewhere is allowed.

use std::borrow::Cow;

use glam::Vec3;

use super::beam_knots::{BeamCrossing, cross_beams};
use super::direct::{DirectLight, Vertex};
use super::flight::{MediumVertex, PathState, PathWeight, pass};
use super::light_choice::LightChoice;
use super::path::{PathSettings, Scratch};
use super::world::World;
use crate::cache_points::CachePoints;
use crate::geometry::Ray;
use crate::light::Receiver;
use crate::math::Rgb;
use crate::math::phase::HenyeyGreenstein;
use crate::math::piecewise::PiecewiseLinear;
use crate::math::sampler::{Dimension, SamplePoint};
use crate::medium::regions::Regions;
use crate::medium::{MediumId, MediumPoint};

/// Knots along a ray, about, at most and at least.
const MOST_KNOTS: f32 = 40.0;
const FEWEST_KNOTS: f32 = 12.0;
/// Distance between knots, in radii of the nearest cache point.
const KNOT_RADII: f32 = 0.5;
/// And in mean free paths.
const KNOT_DEPTH: f32 = 0.5;
/// Beyond this optical depth nothing is drawn.
const DEEPEST: f32 = 9.0;
/// Rays share knots up to this angle, in radians: what one pixel spans in an image of some hundred pixels, several in a larger one.
const SAME_RAY: f32 = 0.003;
/// How often the knots of a pixel are laid out anew because a ray reaches farther than the ones before.
const MOST_LAYOUTS: u32 = 3;
/// Places on a pilot path's camera ray.
const PLACES: usize = 4;
/// The first number of the vertices that are drawn: path vertices never come this far.
const FIRST_INDEX: u32 = 1 << 24;

/// The density along the rays of a pixel, and what it brings. One per thread, reused.
#[derive(Debug, Default)]
pub struct InScatter {
    knots: Knots,
    /// How far the ray that it was made for went.
    reach: f32,
    /// And where to.
    direction: Vec3,
    /// Layouts made for the current pixel.
    layouts: u32,
    /// Points that each camera path draws: a whole number, or a probability.
    count: f32,
    /// What the current path has found of the light that is scattered once, by points drawn and by its own vertex.
    pub scattered: Rgb,
    /// An estimate of the square of what null tracking alone would have found in its place, from the same vertices: those of either technique count
    /// v² p / p_null, v being what they bring, p the pdf of both techniques together. So what null tracking finds once in a thousand
    /// paths does not come as a surprise.
    pub null_square: f64,
    /// What the points drawn on the current path's camera ray brought.
    pub drawn: Rgb,
    /// What they took, of all paths of the pixel so far, and what laying out knots for them took.
    pub work: [u64; 2],
    /// Places on the camera rays of pilot paths.
    pub seeds: Vec<Vec3>,
}

/// The density, and what it is made from.
#[derive(Debug, Default)]
struct Knots {
    density: PiecewiseLinear,
    /// The beams that the ray crosses.
    beams: Vec<BeamCrossing>,
    /// Where knots must be because of them.
    wanted: Vec<f32>,
}

impl InScatter {
    /// Forgets the knots: the next ray is another one.
    pub fn forget(&mut self) {
        self.reach = 0.0;
        self.knots.density.clear();
    }

    /// A new pixel begins, each of whose paths draws `count` points: a whole number, or a probability. Its rays may share knots with the pixel
    /// before.
    pub fn begin_pixel(&mut self, count: f32) {
        (self.count, self.layouts, self.work) = (count, 0, [0; 2]);
    }

    /// Whether the pixel's paths draw points.
    #[inline]
    pub fn is_on(&self) -> bool {
        self.count > 0.0
    }

    /// The pdf with which a point at `t` of a camera ray that ends at `t_max` is drawn, times the number of points that are.
    #[inline]
    pub fn expected(&self, t: f32, t_max: f32) -> f32 {
        self.count * self.knots.density.pdf(t, t_max)
    }
}

/// The direct light that points drawn on the camera ray `ray` scatter back along it. `path` is as it leaves the camera.
pub fn gather(
    world: &World,
    settings: &PathSettings,
    ray: &Ray,
    path: &PathState,
    random: &SamplePoint,
    scratch: &mut Scratch,
) -> Rgb {
    if let LightChoice::Pilot = world.light_choice {
        seed(world, ray, &path.regions, random, scratch);
        return Rgb::BLACK;
    }
    let Some(cache) = world.light_choice.cache_points() else { return Rgb::BLACK };
    let before = scratch.counters.work();
    lay_out(world, cache, ray, &path.regions, scratch);
    scratch.in_scatter.work[1] += scratch.counters.work() - before;
    let before = scratch.counters.work();
    let count = scratch.in_scatter.count;
    let [u, u_count, u_medium] = random.draw::<3>(FIRST_INDEX, Dimension::InScatter);
    let draws = if count < 1.0 { u32::from(u_count < count) } else { count as u32 };
    let mut to_point =
        PathState { weight: PathWeight::START, regions: Regions::default(), hero: path.hero, links: None };
    let (mut gathered, mut null_square) = (Rgb::BLACK, 0.0);
    for draw in 0..draws {
        let u = (f64::from(u) + f64::from(draw)) / f64::from(draws);
        let Some((t, pdf)) = scratch.in_scatter.knots.density.sample(u, ray.t_max) else { break };
        let index = FIRST_INDEX + draw;
        let mut stream = random.stream(index, Dimension::Flight);
        let mut regions = Cow::Borrowed(&path.regions);
        let (passed, t) = pass(world, &Ray { t_max: t, ..*ray }, &mut regions, &mut stream, scratch);
        if passed.value.is_black() {
            continue;
        }
        let p = ray.origin + ray.direction * t;
        let Some((medium, share)) = choose_medium(world, regions.media(), p, u_medium) else { continue };
        let MediumPoint { absorption, scattering, .. } = world.medium(medium).point(p);
        // All weights are relative to the density of having drawn this point and medium.
        let inverse = 1.0 / (pdf * share);
        let unidirectional = passed.pass_probability * (absorption + scattering) * inverse;
        let null = if settings.null_samples_lights { unidirectional } else { Rgb::BLACK };
        to_point.weight = PathWeight {
            throughput: passed.value * scattering * inverse,
            unidirectional,
            light: null + Rgb::splat(count),
        };
        to_point.regions.copy_from(&regions);
        scratch.counters.medium_vertices += 1;
        let (vertex, wo) = (MediumVertex::new(world, p, medium), -ray.direction);
        let vertex = Vertex::Medium(&vertex);
        let direct =
            DirectLight { world, settings, vertex, wo, time: ray.time, path: &to_point, depth: 1, random, index };
        let found = direct.gather::<true>(scratch);
        gathered += found;
        null_square += to_point.weight.null_square(found);
    }
    // The path begins without a cache point in use.
    world.light_choice.begin_path(&mut scratch.lights);
    let in_scatter = &mut scratch.in_scatter;
    (in_scatter.drawn, in_scatter.scattered, in_scatter.null_square) = (gathered, gathered, null_square);
    in_scatter.work[0] += scratch.counters.work() - before;
    gathered
}

/// The medium that scatters at `p`, in proportion to the media's scattering coefficients, and its probability.
fn choose_medium(world: &World, media: &[MediumId], p: Vec3, u: f32) -> Option<(MediumId, f32)> {
    if let &[only] = media {
        return Some((only, 1.0));
    }
    let strength = |id: MediumId| world.medium(id).point(p).scattering.luminance();
    let total: f32 = media.iter().map(|&id| strength(id)).sum();
    let mut rest = u * total;
    let mut chosen = None;
    for &id in media {
        let own = strength(id);
        if own > 0.0 {
            chosen = Some((id, own / total));
            if rest < own {
                break;
            }
        }
        rest -= own;
    }
    chosen
}

/// The probability with which [`choose_medium`] chooses `medium` at `p`.
pub(super) fn medium_share(world: &World, media: &[MediumId], medium: MediumId, p: Vec3) -> f32 {
    if media.len() == 1 {
        return 1.0;
    }
    let strength = |id: MediumId| world.medium(id).point(p).scattering.luminance();
    let total: f32 = media.iter().map(|&id| strength(id)).sum();
    if total > 0.0 { strength(medium) / total } else { 0.0 }
}

/// Notes places along the camera ray of a pilot path where media may scatter it.
fn seed(world: &World, ray: &Ray, regions: &Regions, random: &SamplePoint, scratch: &mut Scratch) {
    let (low, high) = world.extent;
    let t_end = ray.t_max.min(leaves(ray, low, high));
    let mut places = std::mem::take(&mut scratch.in_scatter.seeds);
    let u = random.draw::<4>(FIRST_INDEX, Dimension::InScatter);
    // Stratified, each within its share of the way.
    let mut next = (0..PLACES).map(|k| t_end * (k as f32 + u[k % 4]) / PLACES as f32).peekable();
    each_stretch(world, &Ray { t_max: t_end, ..*ray }, &mut regions.clone(), scratch, |[_, end], media| {
        while let Some(t) = next.next_if(|&t| t < end) {
            if media.iter().any(|&id| world.medium(id).scatters()) {
                places.push(ray.origin + ray.direction * t);
            }
        }
    });
    scratch.in_scatter.seeds = places;
}

/// Visits the stretches between boundaries of a ray that starts in `regions`, with the media there, in order.
fn each_stretch(
    world: &World,
    ray: &Ray,
    regions: &mut Regions,
    scratch: &mut Scratch,
    mut visit: impl FnMut([f32; 2], &[MediumId]),
) {
    let mut crossings = std::mem::take(&mut scratch.crossings);
    world.tracer.boundaries(ray, &mut crossings);
    scratch.counters.boundary_rays += 1;
    let mut t_start = 0.0;
    for i in 0..=crossings.len() {
        let end = crossings.get(i).map_or(ray.t_max, |c| c.t);
        if end > t_start {
            visit([t_start, end], regions.media());
        }
        if let Some(crossing) = crossings.get(i) {
            // What does not fit is counted by whoever follows the ray.
            let _ = world.cross(regions, crossing.shape, crossing.instance, crossing.entering);
            t_start = crossing.t;
        }
    }
    scratch.crossings = crossings;
}

/// Makes sure that the knots reach as far as `ray` does.
fn lay_out(world: &World, cache: &CachePoints, ray: &Ray, regions: &Regions, scratch: &mut Scratch) {
    let InScatter { reach, direction, layouts, .. } = scratch.in_scatter;
    // The samples of a pixel always share theirs: it may be large.
    let is_same = layouts > 0 || direction.distance_squared(ray.direction) < SAME_RAY * SAME_RAY;
    if layouts >= MOST_LAYOUTS || is_same && ray.t_max <= 1.02 * reach {
        return;
    }
    let mut knots = std::mem::take(&mut scratch.in_scatter.knots);
    knots.density.clear();
    let (low, high) = world.extent;
    let t_end = ray.t_max.min(leaves(ray, low, high));
    let inside = Ray { t_max: t_end, ..*ray };
    cross_beams(&world.lights, cache.beams(), &inside, &mut knots.beams, &mut knots.wanted);
    let mut layout = Layout { world, cache, ray, knots: &mut knots, depth: Rgb::BLACK, lookups: 0 };
    each_stretch(world, &inside, &mut regions.clone(), scratch, |stretch, media| {
        if !media.is_empty() {
            layout.add(stretch, t_end, media);
        }
    });
    scratch.counters.cache_lookups += layout.lookups;
    let in_scatter = &mut scratch.in_scatter;
    (in_scatter.knots, in_scatter.reach, in_scatter.direction) = (knots, ray.t_max, ray.direction);
    in_scatter.layouts += 1;
}

/// Where `ray` leaves a box for good; 0 where it never meets it.
fn leaves(ray: &Ray, low: Vec3, high: Vec3) -> f32 {
    let (a, b) = ((low - ray.origin) / ray.direction, (high - ray.origin) / ray.direction);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    if leave > enter.max(0.0) { leave } else { 0.0 }
}

/// Knots in the making.
struct Layout<'a> {
    world: &'a World,
    cache: &'a CachePoints,
    ray: &'a Ray,
    knots: &'a mut Knots,
    /// Optical depth so far.
    depth: Rgb,
    lookups: u64,
}

/// What there is at a knot.
struct Place {
    extinction: Rgb,
    /// Luminance of what is scattered towards the camera and arrives.
    value: f32,
    /// Where the next knot should be at the latest.
    step: f32,
}

impl Layout<'_> {
    /// Knots for a stretch through `media` of a ray that is looked at up to `t_end`.
    fn add(&mut self, [t_start, t_stop]: [f32; 2], t_end: f32, media: &[MediumId]) {
        let (least, most) = (t_end / MOST_KNOTS, t_end / FEWEST_KNOTS);
        let mut t = t_start;
        let mut last: Option<(f32, Rgb)> = None;
        self.knots.density.push(t_start, 0.0);
        loop {
            let place = self.at(t, media, last);
            self.knots.density.push(t, place.value);
            if t >= t_stop || self.depth.min_channel() > DEEPEST {
                break;
            }
            last = Some((t, place.extinction));
            let next = t + place.step.clamp(least, most);
            let wanted = &self.knots.wanted;
            let next = wanted.get(wanted.partition_point(|&w| w <= t)).map_or(next, |&wanted| next.min(wanted));
            t = if next + 1e-3 * least < t_stop { next } else { t_stop };
        }
        self.knots.density.push(t, 0.0);
    }

    fn at(&mut self, t: f32, media: &[MediumId], last: Option<(f32, Rgb)>) -> Place {
        let p = self.ray.origin + self.ray.direction * t;
        self.lookups += 1;
        let (point, radius) = self.cache.nearest(p);
        let (mut extinction, mut scattered) = (Rgb::BLACK, Rgb::BLACK);
        for &id in media {
            let medium = self.world.medium(id);
            let MediumPoint { absorption, scattering, .. } = medium.point(p);
            extinction += absorption + scattering;
            if !scattering.is_black() {
                let g = medium.g();
                let value = self.cache.scattered(&self.world.lights, point, p, g) + self.of_beams(t, point, p, g);
                scattered += scattering * value;
            }
        }
        if let Some((before, of_before)) = last {
            self.depth += (of_before + extinction) * (0.5 * (t - before));
        }
        let value = (scattered * self.depth.map(|tau| (-tau).exp())).luminance();
        let value = if value > 0.0 { value.min(f32::MAX) } else { 0.0 };
        let free = KNOT_DEPTH / extinction.max_channel();
        Place { extinction, value, step: (KNOT_RADII * radius).min(free) }
    }

    /// What the beams that are crossed at `t` bring to `p`.
    fn of_beams(&self, t: f32, point: u32, p: Vec3, g: f32) -> f32 {
        let lights = &self.world.lights;
        let here = self.knots.beams.iter().filter(|beam| beam.t[0] <= t && t <= beam.t[1]);
        let value = |beam: &BeamCrossing| {
            let wi = lights.centre(beam.light).map_or(Vec3::Z, |centre| (centre - p).normalize_or(Vec3::Z));
            let fluence = lights.contribution(beam.light, &Receiver::medium(p));
            let phase = HenyeyGreenstein::new(g).evaluate(-self.ray.direction, wi);
            fluence * phase * self.cache.arrives(lights, point, beam.light)
        };
        here.map(value).sum()
    }
}
