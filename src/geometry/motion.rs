//! Transforms over the animation interval, and boxes that hold during all of it.

use glam::{Affine3A, DVec3, Vec3};

use super::{MotionTransform, affine};

/// Steps at which a moving box is looked at; what happens between them is bounded, not sampled.
const STEPS: u32 = 32;

impl MotionTransform {
    /// The transform at `time` in 0..=1.
    pub fn at(&self, time: f32) -> Affine3A {
        match self {
            Self::Fixed(affine) => *affine,
            Self::Moving { start, end } => {
                let affine = start.interpolate(end, f64::from(time));
                Affine3A { matrix3: affine.matrix3.as_mat3().into(), translation: affine.translation.as_vec3a() }
            }
        }
    }

    /// The inverse of the transform at `time`: computed in f64, rounded last.
    pub fn inverse_at(&self, time: f32) -> Affine3A {
        let forward = self.at(time);
        let inverse = affine::linear(&forward).inverse();
        let translation = -(inverse * affine::translation(&forward));
        Affine3A { matrix3: inverse.as_mat3().into(), translation: translation.as_vec3a() }
    }

    /// A ray's origin and direction (any length, kept in proportion: t is the same in both spaces) at `time`, taken to the
    /// space that the transform maps from. `None` where the transform is singular.
    #[inline]
    pub fn ray_to_local(&self, time: f32, origin: Vec3, direction: Vec3) -> Option<(Vec3, Vec3)> {
        let forward = self.at(time);
        let (o, d) = affine::ray_to_object(&forward, &affine::linear(&forward).inverse(), origin, direction)?;
        Some((o.as_vec3(), d.as_vec3()))
    }

    /// The unit image of a unit normal at `time` (inverse transpose).
    pub fn normal_at(&self, time: f32, normal: Vec3) -> Vec3 {
        affine::normal(&self.at(time), normal.as_dvec3())
    }

    /// Whether the transform changes over the interval.
    pub const fn is_moving(&self) -> bool {
        matches!(self, Self::Moving { .. })
    }

    /// A box that holds the image of the box `low`..`high` at every time.
    ///
    /// Between two steps of length h a corner p(t) = T + R S p strays from the chord by at most h²/8 max |p''|, and
    /// |p''| ≤ θ² |S p| + 2 θ |S' p| for a rotation by θ in all.
    pub fn bounds(&self, low: Vec3, high: Vec3) -> (Vec3, Vec3) {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        match self {
            Self::Fixed(affine) => affine::box_bounds(affine, low, high),
            Self::Moving { start, end } => {
                let corners: [DVec3; 8] = std::array::from_fn(|i| {
                    let pick = |bit: usize, l: f64, h: f64| if i & bit == 0 { l } else { h };
                    DVec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
                });
                let angle = 2.0 * start.rotation.dot(end.rotation).abs().min(1.0).acos();
                let mut pad = 0.0f64;
                for corner in corners {
                    let (a, b) = (start.stretch * corner, end.stretch * corner);
                    let bend = angle * angle * a.length().max(b.length()) + 2.0 * angle * (b - a).length();
                    pad = pad.max(bend / (8.0 * f64::from(STEPS * STEPS)));
                }
                let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
                let mut size = DVec3::ZERO;
                for step in 0..=STEPS {
                    let affine = start.interpolate(end, f64::from(step) / f64::from(STEPS));
                    size = size.max(affine.translation.abs());
                    for corner in corners {
                        let moved = affine.matrix3 * corner;
                        size = size.max(moved.abs());
                        least = least.min(moved + affine.translation);
                        most = most.max(moved + affine.translation);
                    }
                }
                // The transform is used rounded to f32.
                let pad = DVec3::splat(pad) + size * 1e-6;
                affine::outward(least - pad, most + pad)
            }
        }
    }
}
