//! The density that scattering points on a camera ray are drawn by. Source: Li et al. 2024, section 4.2 (p_select, piecewise linear).
//!
//! **Ours:** it is a sum. What cache points know is laid out once for many rays ([`super::layout`], [`super::shared`]): from one ray of a pixel to the
//! next it hardly differs. Narrow beams do: a ray crosses them elsewhere, or not at all, so their part is each ray's own ([`super::beams`]). In place of both there
//! may be what [`super::equi_angular`] makes of the lights.

use glam::Vec3;

use super::beams::{KNOTS, each_crossing};
use super::equi_angular::{EquiAngular, OfLights};
use super::shared::Shared;
use crate::cache_points::CachePoints;
use crate::geometry::Ray;
use crate::light::{LightId, Lights, Receiver};
use crate::math::phase::HenyeyGreenstein;
use crate::math::piecewise::PiecewiseLinear;

/// A knot of the part that rays share: what media there make of a beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub t: f32,
    /// Luminance of μ_s times the transmittance to the camera; 0 at either side of space without media.
    pub strength: f32,
    /// Mean cosine of what scatters.
    pub g: f32,
    /// The nearest cache point.
    pub point: u32,
}

/// One beam that the ray crosses.
#[derive(Debug, Default)]
struct BeamPart {
    /// Where it begins and ends.
    t: [f32; 2],
    density: PiecewiseLinear,
}

/// The sum of all parts.
#[derive(Debug, Default)]
pub(super) struct RayDensity {
    /// Of cache points, for this ray and others.
    pub shared: Shared,
    /// Those of the ray itself are the first `crossed` of them; the others' memory waits for other rays.
    beams: Vec<BeamPart>,
    crossed: usize,
    /// Equi-angular sampling.
    of_lights: OfLights,
    /// Where the ray ends.
    end: f32,
    /// Integrals up to there, of the shared part, of the beams as well, and of all.
    sums: [f64; 3],
}

impl RayDensity {
    /// From here on it is the density along `ray`. Returns how many beams the ray crosses.
    pub fn aim(&mut self, ray: &Ray, lights: &Lights, cache: &CachePoints) -> usize {
        (self.end, self.crossed) = (ray.t_max, 0);
        let shared = self.shared.curve.integral(ray.t_max);
        let mut total = shared;
        if let Some(last) = self.shared.places.last() {
            let inside = Ray { t_max: ray.t_max.min(last.t), ..*ray };
            each_crossing(lights, cache.beams(), &inside, |light, t| total += self.cross(ray, lights, cache, light, t));
        }
        self.sums = [shared, total, total];
        self.crossed
    }

    /// From here on it is equi-angular sampling along `ray` in a scene within `extent`, and nothing else.
    pub fn aim_at_lights(&mut self, ray: &Ray, lights: &EquiAngular, extent: (Vec3, Vec3)) {
        (self.end, self.crossed) = (ray.t_max, 0);
        self.sums = [0.0, 0.0, self.of_lights.aim(lights, ray, extent)];
    }

    /// Adds the beam that `ray` crosses at `t`; returns the integral of its part.
    fn cross(&mut self, ray: &Ray, lights: &Lights, cache: &CachePoints, light: LightId, t: [f32; 2]) -> f64 {
        let arrives = cache.arrives(lights, self.place(0.5 * (t[0] + t[1])).point, light);
        if self.crossed == self.beams.len() {
            self.beams.push(BeamPart::default());
        }
        let mut part = std::mem::take(&mut self.beams[self.crossed]);
        part.t = t;
        part.density.clear();
        for share in KNOTS {
            let t = t[0] + share * (t[1] - t[0]);
            let Place { strength, g, .. } = self.place(t);
            let p = ray.origin + ray.direction * t;
            let wi = lights.centre(light).map_or(Vec3::Z, |centre| (centre - p).normalize_or(Vec3::Z));
            let phase = HenyeyGreenstein::new(g).evaluate(-ray.direction, wi);
            let value = strength * arrives * phase * lights.contribution(light, &Receiver::medium(p));
            part.density.push(t, if value > 0.0 { value.min(f32::MAX) } else { 0.0 });
        }
        let integral = part.density.integral(t[1]);
        self.beams[self.crossed] = part;
        self.crossed += 1;
        integral
    }

    /// What is known at `t`.
    fn place(&self, t: f32) -> Place {
        let places = &self.shared.places;
        let next = places.partition_point(|place| place.t <= t).min(places.len() - 1);
        let (a, b) = (places[next.saturating_sub(1)], places[next]);
        let share = if b.t > a.t { ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0) } else { 0.0 };
        let nearest = if share < 0.5 { a } else { b };
        Place { t, strength: a.strength + share * (b.strength - a.strength), ..nearest }
    }

    /// The pdf of a point at `t`, 1 / length; 0 where there is no density at all.
    #[inline]
    pub fn pdf(&self, t: f32) -> f32 {
        let [_, without_lights, total] = self.sums;
        if !(t <= self.end && total > 0.0) {
            return 0.0;
        }
        let of_beam = |part: &BeamPart| if part.t[0] <= t && t <= part.t[1] { part.density.value(t) } else { 0.0 };
        let of_beams: f64 = self.beams[..self.crossed].iter().map(of_beam).sum();
        let of_lights = if total > without_lights { self.of_lights.value(t) } else { 0.0 };
        ((self.shared.curve.value(t) + of_beams + of_lights) / total) as f32
    }

    /// A point drawn by `u` in [0, 1), and its pdf. `None` where there is no density.
    #[inline]
    pub fn sample(&self, u: f64) -> Option<(f32, f32)> {
        let [shared, without_lights, total] = self.sums;
        let mut rest = u * total;
        if shared == total {
            let (t, value) = self.shared.curve.inverse(rest)?;
            let pdf = (value / total) as f32;
            return (pdf > 0.0 && pdf.is_finite()).then_some((t.min(self.end), pdf));
        }
        let mut t = None;
        if rest < shared {
            t = self.shared.curve.inverse(rest);
        } else if rest >= without_lights {
            t = self.of_lights.inverse(rest - without_lights).map(|t| (t, 0.0));
        } else {
            rest -= shared;
            for part in &self.beams[..self.crossed] {
                let own = part.density.integral(part.t[1]);
                if rest < own {
                    t = part.density.inverse(rest);
                    break;
                }
                rest -= own;
            }
        }
        let t = t?.0.min(self.end);
        let pdf = self.pdf(t);
        (pdf > 0.0 && pdf.is_finite()).then_some((t, pdf))
    }
}
