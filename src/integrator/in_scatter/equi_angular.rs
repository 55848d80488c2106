//! Equi-angular sampling, the rival of cache points: scattering points in proportion to what lights would bring if there were no media and nothing
//! stood between. Source: Kulla & Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media", EGSR 2012, section 4.1.
//!
//! There one light is chosen and the point drawn for it. Here the point is drawn from the sum over the lights, so that it may be combined
//! with null tracking as any other, and whatever selector there is chooses among the lights at the point:
//!
//! ```text
//! p_select(t) ∝ Σ_l Φ_l / (4π (D_l² + (t − δ_l)²)) + Σ_∞ E_l
//! ```
//!
//! with D_l the light's distance from the ray, δ_l where on the ray that is, and E_l the irradiance of lights at infinity.

use std::f64::consts::PI;

use glam::Vec3;

use super::stretches::enters_and_leaves;
use crate::geometry::Ray;
use crate::light::Lights;

/// Lights that have a term of their own. Of more, the most powerful ones do; the others count as if they shone everywhere alike.
const MOST: usize = 64;

/// What is known of the lights: one for a render.
#[derive(Debug)]
pub struct EquiAngular {
    /// Centres and Φ / 4π.
    lights: Vec<(Vec3, f64)>,
    /// Irradiance of the others.
    everywhere: f64,
    /// No light is taken to be closer to a ray.
    closest: f64,
}

impl EquiAngular {
    /// For all lights in a scene within `extent`.
    pub fn new(lights: &Lights, (low, high): (Vec3, Vec3)) -> Self {
        let radius = f64::from(0.5 * (high - low).length());
        let (mut own, mut everywhere) = (vec![], 0.0);
        for id in lights.ids() {
            let power = f64::from(lights.power(id).luminance());
            match lights.centre(id) {
                _ if !(power > 0.0 && power.is_finite()) => {}
                Some(centre) => own.push((centre, power / (4.0 * PI))),
                None => everywhere += power / (PI * radius * radius),
            }
        }
        if own.len() > MOST {
            own.select_nth_unstable_by(MOST, |a, b| b.1.total_cmp(&a.1));
            everywhere += own.drain(MOST..).map(|(_, a)| 4.0 * a / (radius * radius)).sum::<f64>();
        }
        Self { lights: own, everywhere, closest: 1e-5 * radius }
    }
}

/// One light as seen from the ray: a/(d² + (t − δ)²).
#[derive(Clone, Copy, Debug)]
struct Term {
    a: f64,
    /// D_l.
    distance: f64,
    /// δ_l.
    nearest: f64,
    /// The integral up to the end of the ray.
    integral: f64,
}

/// The density along one ray; nothing where this way of sampling is not in use.
#[derive(Debug, Default)]
pub(super) struct OfLights {
    terms: Vec<Term>,
    everywhere: f64,
    /// Where the ray is within the scene.
    t: [f64; 2],
}

impl OfLights {
    /// From here on it is that along `ray`. Returns its integral.
    pub fn aim(&mut self, lights: &EquiAngular, ray: &Ray, extent: (Vec3, Vec3)) -> f64 {
        self.terms.clear();
        let (enter, leave) = enters_and_leaves(ray, extent);
        self.t = [enter, leave.min(ray.t_max)].map(f64::from);
        let [start, end] = self.t;
        self.everywhere = lights.everywhere;
        if !(start < end) {
            (self.t, self.everywhere) = ([0.0; 2], 0.0);
            return 0.0;
        }
        self.terms.extend(lights.lights.iter().map(|&(centre, a)| {
            let to_light = (centre - ray.origin).as_dvec3();
            let nearest = to_light.dot(ray.direction.as_dvec3());
            let distance = (to_light.length_squared() - nearest * nearest).max(0.0).sqrt().max(lights.closest);
            let angle = |t: f64| ((t - nearest) / distance).atan();
            Term { a, distance, nearest, integral: a / distance * (angle(end) - angle(start)) }
        }));
        self.everywhere * (end - start) + self.terms.iter().map(|term| term.integral).sum::<f64>()
    }

    /// The density at `t`.
    #[inline]
    pub fn value(&self, t: f32) -> f64 {
        let t = f64::from(t);
        if t < self.t[0] || t > self.t[1] {
            return 0.0;
        }
        let of = |term: &Term| term.a / (term.distance * term.distance + (t - term.nearest).powi(2));
        self.everywhere + self.terms.iter().map(of).sum::<f64>()
    }

    /// Where the integral, light by light, is `rest`.
    pub fn inverse(&self, mut rest: f64) -> Option<f32> {
        let [start, end] = self.t;
        let even = self.everywhere * (end - start);
        if rest < even {
            return Some((start + rest / self.everywhere).clamp(start, end) as f32);
        }
        rest -= even;
        for term in &self.terms {
            if rest < term.integral {
                let Term { a, distance, nearest, .. } = *term;
                let angle = ((start - nearest) / distance).atan() + rest * distance / a;
                return Some((nearest + distance * angle.tan()).clamp(start, end) as f32);
            }
            rest -= term.integral;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{DistantLight, PointLight};
    use crate::math::Rgb;
    use crate::math::chi2::assert_counts;
    use crate::math::sampler::Stream;

    #[test]
    fn points_follow_the_lights() {
        let mut lights = Lights::default();
        lights.add_point(PointLight { p: Vec3::new(3.0, 0.5, 0.0), intensity: Rgb::splat(2.0) });
        lights.add_point(PointLight { p: Vec3::new(-1.0, 2.0, 4.0), intensity: Rgb::splat(9.0) });
        lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::splat(0.5) });
        let extent = (Vec3::splat(-5.0), Vec3::splat(5.0));
        lights.set_scene_bounds(extent.0, extent.1);
        let of_lights = EquiAngular::new(&lights, extent);
        let ray =
            Ray { origin: Vec3::new(-9.0, 0.0, 0.0), direction: Vec3::X, t_max: 13.0, time: 0.0, opacity_seed: 0 };
        let mut density = OfLights::default();
        let total = density.aim(&of_lights, &ray, extent);
        let (bins, n) = (65, 100_000);
        let width = 13.0 / f64::from(bins);
        let mut counts = vec![0.0; bins as usize];
        let mut stream = Stream::from_seed(8);
        for _ in 0..n {
            let t = density.inverse(f64::from(stream.next_f32()) * total).expect("there are lights");
            counts[((f64::from(t) / width) as usize).min(bins as usize - 1)] += 1.0;
        }
        let expected = |bin: i32| {
            let middle = |k: i32| (f64::from(bin) + (f64::from(k) + 0.5) / 400.0) * width;
            let mean = (0..400).map(|k| density.value(middle(k) as f32)).sum::<f64>() / 400.0;
            mean * width / total * f64::from(n)
        };
        assert_counts("equi-angular", &counts, &(0..bins).map(expected).collect::<Vec<_>>());
        // Before the scene there is nothing.
        assert_eq!(density.value(3.9), 0.0);
    }
}
