//! What the lobes share: samples in the local frame (shading normal +z), and which way light is followed.

use glam::Vec3;

use crate::math::Rgb;

/// A direction sampled from a lobe, in the local frame. Fields as in [`super::BsdfSample`].
#[derive(Clone, Copy, Debug)]
pub struct LocalSample {
    /// The direction.
    pub wi: Vec3,
    /// f(wo, wi), or for Dirac lobes the coefficient divided by |cos θ_i|.
    pub f: Rgb,
    /// Solid-angle pdf or discrete probability.
    pub pdf: f32,
    /// A Dirac lobe.
    pub is_specular: bool,
    /// To the other side.
    pub is_transmission: bool,
    /// η_t/η_i for refraction, else 1.
    pub eta: f32,
    /// `f` and `pdf` are only proportional to the true ones.
    pub pdf_is_proportional: bool,
}

impl LocalSample {
    /// Reflection by a lobe that is not Dirac.
    #[inline]
    pub fn rough(wi: Vec3, f: Rgb, pdf: f32) -> Self {
        Self { wi, f, pdf, is_specular: false, is_transmission: false, eta: 1.0, pdf_is_proportional: false }
    }

    /// Mirror reflection.
    #[inline]
    pub fn specular(wi: Vec3, f: Rgb, pdf: f32) -> Self {
        Self { is_specular: true, ..Self::rough(wi, f, pdf) }
    }

    /// The same as transmission that meets a relative index of refraction `eta`.
    #[inline]
    pub fn transmitted(self, eta: f32) -> Self {
        Self { is_transmission: true, eta, ..self }
    }

    /// f |cos θ_i| / pdf.
    #[inline]
    pub fn weight(&self) -> Rgb {
        self.f * (self.wi.z.abs() / self.pdf)
    }

    /// Whether there is anything to follow.
    #[inline]
    pub fn is_usable(&self) -> bool {
        self.pdf > 0.0 && self.wi.z != 0.0 && !self.f.is_black()
    }
}

/// What is carried from wi to wo: radiance changes by the square of the index of refraction, importance does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Paths that start at the camera.
    Radiance,
    /// Paths that start at a light.
    Importance,
}

/// Which directions a sampling routine may choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// All.
    Both,
    /// Only reflection.
    Reflection,
    /// Only transmission.
    Transmission,
}

impl Sides {
    /// The weights of reflection and transmission when choosing between them, given reflectance r.
    #[inline]
    pub fn weights(self, r: f32) -> (f32, f32) {
        match self {
            Self::Both => (r, 1.0 - r),
            Self::Reflection => (r, 0.0),
            Self::Transmission => (0.0, 1.0 - r),
        }
    }
}

/// Whether two local directions lie on the same side; false where one is tangential.
#[inline]
pub fn same_hemisphere(a: Vec3, b: Vec3) -> bool {
    a.z * b.z > 0.0
}
