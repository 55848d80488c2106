//! Spheres, whole or partial. Source: pbrt-v4 section 6.2 for the parametrisation and the refinement of hits.
//!
//! Intersection works in f64 on the exact difference between the ray's origin and the sphere's position, so that a sphere
//! far from the origin, or a ray that starts on it, is as exact as one nearby. It assumes an invertible `to_shape`.

use std::f64::consts::{PI, TAU};

use glam::{Affine3A, DMat3, DVec3, Vec2, Vec3};

use super::affine;
use super::local::LocalPoint;
use super::quadric::{RoundHit, azimuth};

/// A sphere around its object space's origin, cut at heights and at an angle.
#[derive(Debug, Clone)]
pub struct Sphere {
    /// Radius in object space.
    pub radius: f32,
    /// Lowest z kept, in object space.
    pub z_min: f32,
    /// Highest z kept.
    pub z_max: f32,
    /// Sweep about z in radians, (0, 2π].
    pub phi_max: f32,
    /// Object space to the shape's space.
    pub to_shape: Affine3A,
    /// The inverse of its linear part.
    pub inverse: DMat3,
}

impl Sphere {
    /// Polar angles from +z (θ) at `z_min` and `z_max`.
    fn thetas(&self) -> (f64, f64) {
        let theta = |z: f32| (f64::from(z) / f64::from(self.radius)).clamp(-1.0, 1.0).acos();
        (theta(self.z_min.min(self.z_max)), theta(self.z_min.max(self.z_max)))
    }

    /// Whether nothing is cut away.
    pub fn is_whole(&self) -> bool {
        self.z_min <= -self.radius && self.z_max >= self.radius && self.phi_max >= TAU as f32
    }

    /// The parameters of an object-space point on the sphere, or `None` where it is cut away.
    fn parameters(&self, p: DVec3) -> Option<[f32; 2]> {
        let radius = f64::from(self.radius);
        if (self.z_min > -self.radius && p.z < f64::from(self.z_min))
            || (self.z_max < self.radius && p.z > f64::from(self.z_max))
        {
            return None;
        }
        let u = azimuth(p.x, p.y, self.phi_max)?;
        let (theta_min, theta_max) = self.thetas();
        let theta = (p.z / radius).clamp(-1.0, 1.0).acos();
        let v = (theta - theta_min) / (theta_max - theta_min);
        Some([u, v.clamp(0.0, 1.0) as f32])
    }

    /// The nearest hit with `t_min` < t < `t_max`: t in units of `direction` (any length but zero), and (u, v) in [0, 1]²:
    /// u = φ/φ_max, v from `z_min` to `z_max` along the meridian.
    pub fn intersect(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<(f32, [f32; 2])> {
        let (o, d) = affine::ray_to_object(&self.to_shape, &self.inverse, origin, direction)?;
        let radius = f64::from(self.radius);
        let a = d.length_squared();
        let middle = -o.dot(d) / a;
        let nearest_squared = (o + d * middle).length_squared();
        let line = RoundHit { a, middle, nearest_squared, origin: o.length(), radius };
        for t in line.crossings()? {
            let rounded = t as f32;
            if rounded > t_min && rounded < t_max {
                let p = o + d * t;
                if let Some(uv) = self.parameters(p * (radius / p.length())) {
                    return Some((rounded, uv));
                }
            }
        }
        None
    }

    /// A box around the sphere (or the kept heights of it) in the shape's space.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let r = f64::from(self.radius);
        let low = DVec3::new(-r, -r, f64::from(self.z_min).max(-r));
        let high = DVec3::new(r, r, f64::from(self.z_max).min(r));
        affine::box_bounds(&self.to_shape, low, high)
    }

    fn direction_at(&self, uv: [f32; 2]) -> (DVec3, f64, f64) {
        let (theta_min, theta_max) = self.thetas();
        let phi = f64::from(uv[0]) * f64::from(self.phi_max);
        let theta = theta_min + (theta_max - theta_min) * f64::from(uv[1]);
        let (sin_theta, cos_theta) = if theta == PI { (0.0, -1.0) } else { theta.sin_cos() };
        (DVec3::new(sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta), phi, theta)
    }

    /// The unit vector away from the centre, in object space.
    pub(super) fn outward(&self, uv: [f32; 2]) -> DVec3 {
        self.direction_at(uv).0
    }

    /// The unit normal at (u, v) in the shape's space, as ∂p/∂u × ∂p/∂v has it in object space: outward, before any flip.
    pub fn normal(&self, uv: [f32; 2]) -> Vec3 {
        affine::normal(&self.to_shape, self.direction_at(uv).0)
    }

    /// ∂p/∂u and ∂p/∂v at (u, v) in the shape's space.
    pub(super) fn partials(&self, uv: [f32; 2]) -> [DVec3; 2] {
        let (unit, phi, theta) = self.direction_at(uv);
        let (theta_min, theta_max) = self.thetas();
        let radius = f64::from(self.radius);
        let around = DVec3::new(-unit.y, unit.x, 0.0) * (radius * f64::from(self.phi_max));
        let (sin_phi, cos_phi) = phi.sin_cos();
        let down = DVec3::new(unit.z * cos_phi, unit.z * sin_phi, -theta.sin()) * (radius * (theta_max - theta_min));
        let linear = affine::linear(&self.to_shape);
        [linear * around, linear * down]
    }

    /// The point at (u, v) in the shape's space, its error, and its derivatives.
    pub(super) fn point(&self, uv: [f32; 2]) -> LocalPoint {
        let (unit, phi, _) = self.direction_at(uv);
        let p = unit * f64::from(self.radius);
        let (p, p_error) = affine::exact_point(&self.to_shape, p);
        let z_radius = unit.truncate().length() * f64::from(self.radius);
        let along = DVec3::new(-phi.sin(), phi.cos(), 0.0) * (f64::from(self.phi_max) * z_radius.max(1e-20));
        let n = affine::normal(&self.to_shape, unit);
        LocalPoint {
            p,
            // The direction from f32 parameters is off by their rounding, but along the surface only: p stays on it.
            p_error,
            ng: n,
            ns: n,
            dpdu: affine::vector(&self.to_shape, along),
            uv: Vec2::from(uv),
            authoritative_ns: false,
        }
    }
}
