//! The Trowbridge-Reitz (GGX) distribution of microfacet normals with Smith's masking and shadowing, perhaps anisotropic.
//! Sources: Walter et al. 2007; Heitz 2014, "Understanding the Masking-Shadowing Function" (height-correlated G, visible
//! normals); Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps". Directions are local (macro normal
//! +z) and may lie on either side: the distribution is symmetric about the surface.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// Below this roughness a surface is treated as perfectly smooth (as pbrt-v4 does, to keep D representable).
const SMOOTH: f32 = 1e-3;

/// A Trowbridge-Reitz distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrowbridgeReitz {
    alpha_x: f32,
    alpha_y: f32,
}

impl TrowbridgeReitz {
    /// With roughness `alpha_x` along the tangent and `alpha_y` across it (the root mean square slope is α/√2). Smaller
    /// values than 1e-4 are raised to it unless both are so small that the surface is smooth.
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        if alpha_x.max(alpha_y) < SMOOTH {
            Self { alpha_x, alpha_y }
        } else {
            Self { alpha_x: alpha_x.max(1e-4), alpha_y: alpha_y.max(1e-4) }
        }
    }

    /// Whether the surface counts as a mirror: both roughnesses below 1e-3.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.alpha_x.max(self.alpha_y) < SMOOTH
    }

    /// pbrt-v4's map from user-facing roughness in 0..=1 to α: the square root.
    #[inline]
    pub fn roughness_to_alpha(roughness: f32) -> f32 {
        roughness.max(0.0).sqrt()
    }

    /// D(ω_m), the density of normals: ∫ D(ω_m) cos θ_m dω_m = 1.
    #[inline]
    pub fn d(&self, wm: Vec3) -> f32 {
        // (x/α_x)² + (y/α_y)² + z² stays finite at grazing normals, where tan² θ does not.
        let stretched = (wm.x / self.alpha_x).powi(2) + (wm.y / self.alpha_y).powi(2) + wm.z * wm.z;
        let norm = PI * self.alpha_x * self.alpha_y * stretched * stretched;
        if norm.is_finite() && norm > 0.0 { 1.0 / norm } else { 0.0 }
    }

    /// Smith's auxiliary Λ(ω) (Heitz 2014, equation 72); infinite at the horizon.
    #[inline]
    pub fn lambda(&self, w: Vec3) -> f32 {
        let alpha2_tan2 = ((w.x * self.alpha_x).powi(2) + (w.y * self.alpha_y).powi(2)) / (w.z * w.z);
        if alpha2_tan2.is_nan() {
            return 0.0;
        }
        0.5 * ((1.0 + alpha2_tan2).sqrt() - 1.0)
    }

    /// Masking G₁(ω) in 0..=1.
    #[inline]
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Height-correlated masking and shadowing G(ω_o, ω_i) in 0..=1 (Heitz 2014, equation 99).
    #[inline]
    pub fn g(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// D_ω(ω_m), the density of the normals that are visible from `w` (Heitz 2014, equation 17): a pdf over the solid angle
    /// of `wm` for those with ω·ω_m of the right sign.
    #[inline]
    pub fn visible(&self, w: Vec3, wm: Vec3) -> f32 {
        let cos = w.z.abs();
        if cos == 0.0 {
            return 0.0;
        }
        self.g1(w) / cos * self.d(wm) * w.dot(wm).abs()
    }

    /// A normal in the upper hemisphere with pdf [`TrowbridgeReitz::visible`].
    #[inline]
    pub fn sample_visible(&self, w: Vec3, u: [f32; 2]) -> Vec3 {
        // On the sphere of the unstretched distribution, halfway vectors of a uniform spherical cap are the visible normals.
        let stretch = Vec3::new(self.alpha_x * w.x, self.alpha_y * w.y, w.z);
        let towards = stretch.normalize_or(Vec3::Z) * if w.z < 0.0 { -1.0 } else { 1.0 };
        let z = (1.0 - u[1]) * (1.0 + towards.z) - towards.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (TAU * u[0]).sin_cos();
        let half = Vec3::new(r * cos, r * sin, z) + towards;
        Vec3::new(self.alpha_x * half.x, self.alpha_y * half.y, half.z.max(1e-7)).normalize_or(Vec3::Z)
    }
}
