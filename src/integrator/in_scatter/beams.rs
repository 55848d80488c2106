//! Where a ray crosses the cones of narrow spots and their like. Cache points know a beam only as far as one of them lies in it, and knots that follow the points
//! step over it; but where a ray enters and leaves a cone is known.

use crate::geometry::Ray;
use crate::light::contribution::Beam;
use crate::light::{LightId, Lights};

/// Knots within a crossing, as shares of its length.
pub(super) const KNOTS: [f32; 7] = [0.0, 0.06, 0.25, 0.5, 0.75, 0.94, 1.0];

/// Visits the stretches of `ray` inside the cones of `beams`.
pub(super) fn each_crossing(lights: &Lights, beams: &[LightId], ray: &Ray, mut visit: impl FnMut(LightId, [f32; 2])) {
    for &light in beams {
        let Some(beam) = lights.beam(light, ray.time) else { continue };
        inside(&beam, ray).into_iter().flatten().for_each(|t| visit(light, t));
    }
}

/// The stretches of `ray` inside the cone of `beam`: where (x − p)·a ≥ cos θ |x − p|. There are two where the ray runs more along the cone than its
/// sides do, one of them in its mirror image.
fn inside(beam: &Beam, ray: &Ray) -> [Option<[f32; 2]>; 2] {
    let (o, d) = ((ray.origin - beam.p).as_dvec3(), ray.direction.as_dvec3());
    let (axis, cos) = (beam.axis.as_dvec3(), f64::from(beam.cos_end));
    let (along_o, along_d) = (o.dot(axis), d.dot(axis));
    // a t² + 2 b t + c ≥ 0.
    let a = along_d * along_d - cos * cos;
    let b = along_o * along_d - cos * cos * o.dot(d);
    let c = along_o * along_o - cos * cos * o.length_squared();
    let end = f64::from(ray.t_max);
    let part = |from: f64, to: f64| {
        let (from, to) = (from.max(0.0), to.min(end));
        let middle = if to.is_finite() { 0.5 * (from + to) } else { from + 1.0 };
        let is_ahead = along_o + middle * along_d > 0.0;
        (from < to && to.is_finite() && is_ahead).then_some([from as f32, to as f32])
    };
    let root = b * b - a * c;
    if root <= 0.0 {
        return [if a > 0.0 { part(0.0, end) } else { None }, None];
    }
    // The form that does not cancel.
    let q = -(b + b.signum() * root.sqrt());
    let (t0, t1) = (q / a, c / q);
    let (t0, t1) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
    if a < 0.0 { [part(t0, t1), None] } else { [part(0.0, t0), part(t1, end)] }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::sampler::Stream;
    use crate::math::warp::uniform_sphere;

    #[test]
    fn stretches_are_where_the_beam_is() {
        let mut stream = Stream::from_seed(4);
        let mut next = || [stream.next_f32(), stream.next_f32()];
        let mut met = 0;
        for _ in 0..20_000 {
            let (axis, direction) = (uniform_sphere(next()), uniform_sphere(next()));
            let cos_end = 0.94 + 0.059 * next()[0];
            let beam = Beam { p: 3.0 * uniform_sphere(next()), axis, cos_end };
            let origin = 2.0 * uniform_sphere(next());
            let ray = Ray { origin, direction, t_max: 9.0, time: 0.0, opacity_seed: 0 };
            let parts = inside(&beam, &ray);
            met += parts.iter().flatten().count();
            for k in 0..90 {
                let t = 0.1 * (k as f32 + 0.5);
                let x: Vec3 = ray.origin + t * direction - beam.p;
                let is_inside = parts.iter().flatten().any(|[from, to]| (*from..=*to).contains(&t));
                let cos = x.normalize().dot(axis);
                assert!(is_inside == (cos >= cos_end) || (cos - cos_end).abs() < 1e-4, "{t} {cos} {cos_end} {parts:?}");
            }
        }
        assert!(met > 500, "{met}");
    }
}
