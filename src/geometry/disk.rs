//! Disks in a plane of constant z, perhaps annular or partial. Source: pbrt-v4 section 6.4.
//!
//! Intersection works in f64 like the sphere's. It assumes an invertible `to_shape`.

use glam::{Affine3A, DMat3, DVec3, Vec2, Vec3};

use super::affine;
use super::local::LocalPoint;
use super::quadric::azimuth;

/// A disk in its object space's plane z = `height`.
#[derive(Debug, Clone)]
pub struct Disk {
    /// z of its plane in object space.
    pub height: f32,
    /// Outer radius.
    pub radius: f32,
    /// Inner radius; 0 for a full disk.
    pub inner_radius: f32,
    /// Sweep about z in radians, (0, 2π].
    pub phi_max: f32,
    /// Object space to the shape's space.
    pub to_shape: Affine3A,
    /// The inverse of its linear part.
    pub inverse: DMat3,
}

impl Disk {
    /// The hit if `t_min` < t < `t_max`: t in units of `direction` (any length but zero), and (u, v) in [0, 1]²: u = φ/φ_max, v
    /// from the outer radius (0) to the inner one (1).
    pub fn intersect(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<(f32, [f32; 2])> {
        let (o, d) = affine::ray_to_object(&self.to_shape, &self.inverse, origin, direction)?;
        if d.z == 0.0 {
            return None;
        }
        let t = (f64::from(self.height) - o.z) / d.z;
        let rounded = t as f32;
        if !(rounded > t_min && rounded < t_max) {
            return None;
        }
        let p = (o + d * t).truncate();
        let (inner, outer) = (f64::from(self.inner_radius), f64::from(self.radius));
        let distance_squared = p.length_squared();
        if distance_squared > outer * outer || distance_squared < inner * inner {
            return None;
        }
        let u = azimuth(p.x, p.y, self.phi_max)?;
        let v = (outer - distance_squared.sqrt()) / (outer - inner);
        Some((rounded, [u, v.clamp(0.0, 1.0) as f32]))
    }

    /// A box around the whole disk in the shape's space.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (r, z) = (f64::from(self.radius), f64::from(self.height));
        affine::box_bounds(&self.to_shape, DVec3::new(-r, -r, z), DVec3::new(r, r, z))
    }

    /// The unit normal in the shape's space: object space's +z, before any flip.
    pub fn normal(&self) -> Vec3 {
        affine::normal(&self.to_shape, DVec3::Z)
    }

    /// ∂p/∂u and ∂p/∂v at (u, v) in the shape's space.
    pub(super) fn partials(&self, uv: [f32; 2]) -> [DVec3; 2] {
        let (inner, outer) = (f64::from(self.inner_radius), f64::from(self.radius));
        let phi_max = f64::from(self.phi_max);
        let (sin, cos) = (f64::from(uv[0]) * phi_max).sin_cos();
        let r = outer + (inner - outer) * f64::from(uv[1]);
        let linear = affine::linear(&self.to_shape);
        [linear * DVec3::new(-sin, cos, 0.0) * (phi_max * r), linear * DVec3::new(cos, sin, 0.0) * (inner - outer)]
    }

    /// The point at (u, v) in the shape's space, its error, and its derivatives.
    pub(super) fn point(&self, uv: [f32; 2]) -> LocalPoint {
        let (inner, outer) = (f64::from(self.inner_radius), f64::from(self.radius));
        let phi_max = f64::from(self.phi_max);
        let (sin, cos) = (f64::from(uv[0]) * phi_max).sin_cos();
        let r = outer + (inner - outer) * f64::from(uv[1]);
        let (p, p_error) = affine::exact_point(&self.to_shape, DVec3::new(r * cos, r * sin, f64::from(self.height)));
        let n = self.normal();
        LocalPoint {
            p,
            p_error,
            ng: n,
            ns: n,
            dpdu: affine::vector(&self.to_shape, DVec3::new(-sin, cos, 0.0) * (phi_max * r.max(1e-20))),
            uv: Vec2::from(uv),
            authoritative_ns: false,
        }
    }
}
