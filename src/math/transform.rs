//! Affine transforms in f64 as files give them, and their interpolation over the shutter.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// A transform at the start and at the end of the animation interval. Equal keys mean no motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Animated {
    /// At the interval's start.
    pub start: DMat4,
    /// At the interval's end.
    pub end: DMat4,
}

impl Animated {
    /// A transform that does not move.
    pub const fn fixed(matrix: DMat4) -> Self {
        Self { start: matrix, end: matrix }
    }

    /// This transform followed by `outer`, key by key.
    pub fn after(&self, outer: &Self) -> Self {
        Self { start: outer.start * self.start, end: outer.end * self.end }
    }

    /// Whether the keys differ.
    pub fn is_animated(&self) -> bool {
        self.start != self.end
    }
}

/// Whether `matrix` turns right-handed frames into left-handed ones.
pub fn swaps_handedness(matrix: &DMat4) -> bool {
    DMat3::from_mat4(*matrix).determinant() < 0.0
}

/// M = T R S (Shoemake & Duff 1992, polar decomposition): translation, rotation, and a symmetric stretch.
#[derive(Clone, Copy, Debug)]
pub struct Decomposed {
    /// T.
    pub translation: DVec3,
    /// R.
    pub rotation: DQuat,
    /// S; takes up any reflection.
    pub stretch: DMat3,
}

impl Decomposed {
    /// Decomposes an affine transform; `None` where it cannot be inverted or is not finite.
    pub fn new(affine: &DAffine3) -> Option<Self> {
        let m = affine.matrix3;
        if !affine.is_finite() || !m.determinant().is_normal() || !m.inverse().is_finite() {
            return None;
        }
        // Higham's iteration R ← (R + R^-T)/2 converges quadratically to the orthogonal factor.
        let mut r = m;
        for _ in 0..100 {
            let next = (r + r.inverse().transpose()) * 0.5;
            let change = (next - r).to_cols_array().into_iter().fold(0.0f64, |a, b| a.max(b.abs()));
            r = next;
            if change < 1e-14 {
                break;
            }
        }
        if r.determinant() < 0.0 {
            r = -r;
        }
        let rotation = DQuat::from_mat3(&r).normalize();
        Some(Self { translation: affine.translation, rotation, stretch: r.transpose() * m })
    }

    /// T, R (spherically) and S interpolated at `time` in 0..=1 (pbrt-v4, section 3.11).
    pub fn interpolate(&self, end: &Self, time: f64) -> DAffine3 {
        self.between(end, time).affine()
    }

    /// [`Decomposed::interpolate`] before it is put together.
    pub fn between(&self, end: &Self, time: f64) -> Self {
        Self {
            translation: self.translation.lerp(end.translation, time),
            rotation: self.rotation.slerp(end.rotation, time),
            stretch: self.stretch * (1.0 - time) + end.stretch * time,
        }
    }

    /// T R S.
    pub fn affine(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_quat(self.rotation) * self.stretch, translation: self.translation }
    }
}

/// Render space: world space moved so that the camera's first position is the origin. Far-away scenes keep their
/// precision because the move happens in f64, before anything is rounded to f32.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderSpace {
    /// The world-space point that becomes the origin.
    pub origin: DVec3,
}

impl RenderSpace {
    /// The object-to-render transform of an object-to-world one.
    pub fn from_world(&self, object_to_world: &DMat4) -> DAffine3 {
        let affine = DAffine3::from_mat4(*object_to_world);
        DAffine3 { translation: affine.translation - self.origin, ..affine }
    }
}
