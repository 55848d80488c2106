//! Open cylinders about the z axis, perhaps partial. Source: pbrt-v4 section 6.3.
//!
//! Intersection works in f64 like the sphere's. It assumes an invertible `to_shape`.

use glam::{Affine3A, DMat3, DVec3, Vec2, Vec3};

use super::affine;
use super::local::LocalPoint;
use super::quadric::{RoundHit, azimuth};

/// The points at `radius` from the z axis of its object space, between two heights.
#[derive(Debug, Clone)]
pub struct Cylinder {
    /// Distance from the axis.
    pub radius: f32,
    /// Lowest z.
    pub z_min: f32,
    /// Highest z.
    pub z_max: f32,
    /// Sweep about z in radians, (0, 2π].
    pub phi_max: f32,
    /// Object space to the shape's space.
    pub to_shape: Affine3A,
    /// The inverse of its linear part.
    pub inverse: DMat3,
}

impl Cylinder {
    /// The parameters of an object-space point on the cylinder, or `None` where it is cut away.
    fn parameters(&self, p: DVec3) -> Option<[f32; 2]> {
        let (low, high) = (f64::from(self.z_min), f64::from(self.z_max));
        if p.z < low || p.z > high {
            return None;
        }
        let u = azimuth(p.x, p.y, self.phi_max)?;
        let v = (p.z - low) / (high - low);
        Some([u, v.clamp(0.0, 1.0) as f32])
    }

    /// The nearest hit with `t_min` < t < `t_max`: t in units of `direction` (any length but zero), and (u, v) in [0, 1]²:
    /// u = φ/φ_max, v from `z_min` to `z_max`.
    pub fn intersect(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<(f32, [f32; 2])> {
        let (o, d) = affine::ray_to_object(&self.to_shape, &self.inverse, origin, direction)?;
        let radius = f64::from(self.radius);
        // In the plane across the axis it is a circle.
        let (across, along) = (o.truncate(), d.truncate());
        let a = along.length_squared();
        if a == 0.0 {
            return None;
        }
        let middle = -across.dot(along) / a;
        let nearest_squared = (across + along * middle).length_squared();
        let line = RoundHit { a, middle, nearest_squared, origin: across.length(), radius };
        for t in line.crossings()? {
            let rounded = t as f32;
            if rounded > t_min
                && rounded < t_max
                && let Some(uv) = self.parameters(o + d * t)
            {
                return Some((rounded, uv));
            }
        }
        None
    }

    /// A box around the whole cylinder in the shape's space.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let r = f64::from(self.radius);
        let (low, high) = (f64::from(self.z_min), f64::from(self.z_max));
        affine::box_bounds(&self.to_shape, DVec3::new(-r, -r, low), DVec3::new(r, r, high))
    }

    /// The unit vector away from the axis, in object space.
    pub(super) fn outward(&self, uv: [f32; 2]) -> DVec3 {
        let (sin, cos) = (f64::from(uv[0]) * f64::from(self.phi_max)).sin_cos();
        DVec3::new(cos, sin, 0.0)
    }

    /// The unit normal at (u, v) in the shape's space, as ∂p/∂u × ∂p/∂v has it in object space: outward, before any flip.
    pub fn normal(&self, uv: [f32; 2]) -> Vec3 {
        affine::normal(&self.to_shape, self.outward(uv))
    }

    /// ∂p/∂u and ∂p/∂v in the shape's space.
    pub(super) fn partials(&self, uv: [f32; 2]) -> [DVec3; 2] {
        let outward = self.outward(uv);
        let around = DVec3::new(-outward.y, outward.x, 0.0) * (f64::from(self.radius) * f64::from(self.phi_max));
        let linear = affine::linear(&self.to_shape);
        [linear * around, linear * DVec3::Z * f64::from(self.z_max - self.z_min)]
    }

    /// The point at (u, v) in the shape's space, its error, and its derivatives.
    pub(super) fn point(&self, uv: [f32; 2]) -> LocalPoint {
        let outward = self.outward(uv);
        let (low, high) = (f64::from(self.z_min), f64::from(self.z_max));
        let height = low + (high - low) * f64::from(uv[1]);
        let radius = f64::from(self.radius);
        let (p, p_error) = affine::exact_point(&self.to_shape, outward * radius + DVec3::Z * height);
        let along = DVec3::new(-outward.y, outward.x, 0.0) * (f64::from(self.phi_max) * radius);
        let n = affine::normal(&self.to_shape, outward);
        LocalPoint {
            p,
            // As with spheres: f32 parameters move it along the surface only.
            p_error,
            ng: n,
            ns: n,
            dpdu: affine::vector(&self.to_shape, along),
            uv: Vec2::from(uv),
            authoritative_ns: false,
        }
    }
}
