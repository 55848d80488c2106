//! Laying out the part of the density that rays share: knots as close as the cache points lie, each with what they expect media there to scatter
//! towards the camera. Source: Li et al. 2024, section 4.2. **Ours:** the knots carry the transmittance to the camera as well, and rays that
//! are almost the same share them.

use super::Along;
use super::density::Place;
use super::shared::Shared;
use super::stretches::{each_stretch, leaves};
use crate::cache_points::CachePoints;
use crate::geometry::Ray;
use crate::integrator::path::Scratch;
use crate::integrator::walk::Walk;
use crate::integrator::world::World;
use crate::math::Rgb;
use crate::medium::{Medium, MediumId, MediumPoint};

/// Knots along a ray, about, at most and at least.
const MOST_KNOTS: f32 = 40.0;
const FEWEST_KNOTS: f32 = 12.0;
/// Distance between knots, in radii of the nearest cache point.
const KNOT_RADII: f32 = 0.5;
/// And in mean free paths.
const KNOT_DEPTH: f32 = 0.5;
/// Beyond this optical depth nothing is drawn.
const DEEPEST: f32 = 9.0;
/// Rays share knots up to this angle, in radians, where there are grids: what some pixels span.
const SAME_RAY: f32 = 0.01;
/// Up to this one in media that are the same everywhere: cache points lie farther apart, and in `godrays` variance was the same to 2 % at 0.003
/// and at 0.045.
const SAME_FOG: f32 = 0.03;
/// Up to this one where there are but beams, which are every ray's own, in media that are the same everywhere.
const WIDEST: f32 = 0.05;

/// Makes sure that the shared part reaches as far as the ray does.
pub(super) fn lay_out(world: &World, cache: &CachePoints, start: &Walk, scratch: &mut Scratch) {
    let Walk { ref ray, index: number, ref path, .. } = *start;
    let Along { density, kept } = &mut scratch.in_scatter.along[number as usize - 1];
    if kept.find(&mut density.shared, ray, number) {
        return;
    }
    kept.keep(&mut density.shared);
    let mut shared = std::mem::take(&mut density.shared);
    let t_end = ray.t_max.min(leaves(ray, world.extent));
    let inside = Ray { t_max: t_end, ..*ray };
    let has_beams = !cache.beams().is_empty();
    let only_beams = cache.scatters_only_beams();
    // What grids hold may be anywhere, also a little beside a ray that misses it.
    let has_grids = world.media.iter().any(|medium| matches!(medium, Medium::Grid(_)));
    let angle = if has_grids {
        SAME_RAY
    } else if only_beams {
        WIDEST
    } else {
        SAME_FOG
    };
    let mut layout =
        Layout { world, cache, ray, shared: &mut shared, has_beams, only_beams, depth: Rgb::BLACK, lookups: 0 };
    each_stretch(world, &inside, &mut path.regions.clone(), scratch, |stretch, media| {
        if !media.is_empty() {
            layout.add(stretch, t_end, media);
        }
    });
    scratch.counters.cache_lookups += layout.lookups;
    (shared.origin, shared.direction, shared.angle) = (ray.origin, ray.direction, angle);
    (shared.reach, shared.length) = (ray.t_max, t_end);
    scratch.in_scatter.along[number as usize - 1].density.shared = shared;
}

/// Knots in the making.
struct Layout<'a> {
    world: &'a World,
    cache: &'a CachePoints,
    ray: &'a Ray,
    shared: &'a mut Shared,
    has_beams: bool,
    only_beams: bool,
    /// Optical depth so far.
    depth: Rgb,
    lookups: u64,
}

/// What there is at a knot.
struct Knot {
    extinction: Rgb,
    /// Luminance of what is scattered towards the camera and arrives, without beams.
    value: f32,
    /// Where the next knot should be at the latest.
    step: f32,
    /// For beams.
    place: Place,
}

impl Layout<'_> {
    /// Knots for a stretch through `media` of a ray that is looked at up to `t_end`.
    fn add(&mut self, [t_start, t_stop]: [f32; 2], t_end: f32, media: &[MediumId]) {
        let (least, most) = (t_end / MOST_KNOTS, t_end / FEWEST_KNOTS);
        let mut t = t_start;
        let mut last: Option<(f32, Rgb)> = None;
        self.push(t_start, 0.0, Place { t: t_start, strength: 0.0, g: 0.0, point: 0 });
        loop {
            let knot = self.at(t, media, last);
            self.push(t, knot.value, knot.place);
            if t >= t_stop || self.depth.min_channel() > DEEPEST {
                self.push(t, 0.0, Place { strength: 0.0, ..knot.place });
                break;
            }
            last = Some((t, knot.extinction));
            let next = t + knot.step.clamp(least, most);
            t = if next + 1e-3 * least < t_stop { next } else { t_stop };
        }
    }

    fn push(&mut self, t: f32, value: f32, place: Place) {
        self.shared.curve.push(t, value);
        if self.has_beams {
            self.shared.places.push(place);
        }
    }

    fn at(&mut self, t: f32, media: &[MediumId], last: Option<(f32, Rgb)>) -> Knot {
        let p = self.ray.origin + self.ray.direction * t;
        self.lookups += 1;
        let (point, radius) = self.cache.nearest(p);
        // Where there are but beams, media alone say how far knots are apart.
        let radius = if self.only_beams { f32::INFINITY } else { radius };
        let (mut extinction, mut scattered, mut all) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
        let (mut g_sum, mut sum) = (0.0, 0.0);
        for &id in media {
            let medium = self.world.medium(id);
            let MediumPoint { absorption, scattering, .. } = medium.coefficients(p, self.ray.time);
            extinction += absorption + scattering;
            if !scattering.is_black() {
                let g = medium.g();
                scattered += scattering * self.cache.scattered(&self.world.lights, point, p, g);
                all += scattering;
                (g_sum, sum) = (g_sum + g * scattering.luminance(), sum + scattering.luminance());
            }
        }
        if let Some((before, of_before)) = last {
            self.depth += (of_before + extinction) * (0.5 * (t - before));
        }
        let arriving = self.depth.map(|tau| (-tau).exp());
        let luminance = |value: Rgb| {
            let value = (value * arriving).luminance();
            if value > 0.0 { value.min(f32::MAX) } else { 0.0 }
        };
        let place = Place { t, strength: luminance(all), g: if sum > 0.0 { g_sum / sum } else { 0.0 }, point };
        let free = KNOT_DEPTH / extinction.max_channel();
        Knot { extinction, value: luminance(scattered), step: (KNOT_RADII * radius).min(free), place }
    }
}
