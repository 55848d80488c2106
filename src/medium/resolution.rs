//! How dense a medium can be: mean free paths stay well above the distance of neighbouring f32 positions.
//!
//! A vertex is rounded to f32 and kept off boundaries by a few times that rounding. Where the mean free path is no longer than that, no path gets
//! out again, and what should look white is black. So extinction is limited to
//!
//! ```text
//! μ_t ≤ 1 / (128 ε |p|),
//! ```
//!
//! |p| being the distance from the camera (the origin of render space) where a stretch of a ray begins, every channel by itself. The albedo, the phase
//! function, and what is emitted in proportion to the extinction stay, and with them the radiance of everything that is many mean free paths
//! deep: of a half-space that does not depend on the extinction (Chandrasekhar, "Radiative Transfer", 1960, section 13: only optical depths enter). What
//! changes is seen only where such a medium is thinner than some hundreds of mean free paths: sheets of less than a hundredth of their distance
//! (which let through some thousandths if they are white), or of a ten-thousandth if they absorb half.
//!
//! The bounds of free flights are limited ([`limit`]), and the rest follows: a collision is real with probability min(μ_t / μ̄, 1).

use glam::Vec3;

use super::MediumPoint;
use crate::system::fault::{self, Fault};

/// Mean free paths are at least this many times ε |p|. Vertices keep off boundaries by 4 of these, a thirty-second of a mean free path, which
/// takes about 0.3 % off what a half-space of albedo 0.5 reflects, and 0.1 % at 0.9. The loss grows with the square of that distance.
const LEAST_PATH: f32 = 128.0;

/// μ_t, or a bound of it, as it holds at `p` of render space.
#[inline]
pub fn limit(extinction: f32, p: Vec3) -> f32 {
    extinction.min(largest(p.length()))
}

/// The largest extinction at this distance from the camera; infinite at the camera.
#[inline]
pub fn largest(distance: f32) -> f32 {
    if fault::is(Fault::NoDensityLimit) { f32::INFINITY } else { 1.0 / (LEAST_PATH * f32::EPSILON * distance) }
}

impl MediumPoint {
    /// As it holds at `p` of render space: all coefficients of a channel are lowered alike where its extinction is too large there.
    #[inline]
    pub fn limited(self, p: Vec3) -> Self {
        let extinction = self.absorption + self.scattering;
        let largest = largest(p.length());
        if extinction.max_channel() <= largest {
            return self;
        }
        let share = extinction.map(|mu| if mu > largest { largest / mu } else { 1.0 });
        Self {
            absorption: self.absorption * share,
            scattering: self.scattering * share,
            emission: self.emission * share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    #[test]
    fn channels_are_limited_each_by_itself() {
        let p = Vec3::new(3.0, 4.0, 0.0);
        let most = largest(5.0);
        let point = MediumPoint {
            absorption: Rgb::new(3.0 * most, 1.0, 0.0),
            scattering: Rgb::new(most, 2.0, 0.0),
            emission: Rgb::new(8.0, 8.0, 8.0),
        };
        let limited = point.limited(p);
        let near = |a: Rgb, b: [f32; 3]| (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-6 * b[c]);
        assert!(near(limited.absorption, [0.75 * most, 1.0, 0.0]), "{limited:?}");
        assert!(near(limited.scattering, [0.25 * most, 2.0, 0.0]), "{limited:?}");
        assert!(near(limited.emission, [2.0, 8.0, 8.0]), "{limited:?}");
        assert_eq!(limit(f32::MAX, p), most);
        // What is as thick as a hundredth of its distance is still hundreds of mean free paths deep.
        assert!(most * 0.05 > 500.0);
        for p in [Vec3::ZERO, Vec3::splat(1e-40)] {
            assert_eq!(limit(f32::MAX, p), f32::MAX);
        }
    }
}
