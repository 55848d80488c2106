//! The Henyey–Greenstein phase function. Source: Henyey & Greenstein 1941; pbrt-v4 section 11.3.1 for the convention that
//! both directions point away from the vertex.
//!
//! The textbook denominator 1 + g² + 2g cos θ cancels catastrophically in the forward peak of |g| → 1. Here it is written with the
//! squared length of ω_o ± ω_i, which is exact where the directions nearly oppose or agree.

use glam::Vec3;

use crate::math::Frame;
use crate::system::fault::{self, Fault};

/// Henyey–Greenstein with mean cosine g in (−1, 1); g > 0 scatters forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    g: f32,
}

impl HenyeyGreenstein {
    /// The largest |g| used; larger ones are limited to it so that the lobe stays finite in f32.
    pub const MAX_G: f32 = 0.9999;

    /// The phase function with mean cosine `g`.
    pub fn new(g: f32) -> Self {
        Self { g: g.clamp(-Self::MAX_G, Self::MAX_G) }
    }

    /// p(ω_o, ω_i) per steradian; also the pdf of [`HenyeyGreenstein::sample`].
    #[inline]
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> f32 {
        let g = if fault::is(Fault::MirroredPhase) { -self.g } else { self.g };
        // (1 − g)² + 2g(1 + cos θ) = (1 − g)² + g |ω_o + ω_i|², and its mirror image for g < 0.
        let denominator = if g >= 0.0 {
            (1.0 - g) * (1.0 - g) + g * (wo + wi).length_squared()
        } else {
            (1.0 + g) * (1.0 + g) - g * (wo - wi).length_squared()
        };
        (1.0 - g) * (1.0 + g) / (4.0 * std::f32::consts::PI * denominator * denominator.sqrt())
    }

    /// A direction ω_i with pdf [`HenyeyGreenstein::evaluate`].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let g = f64::from(self.g);
        let u0 = f64::from(u[0]);
        // cos θ between ω_o and ω_i: forward scattering (g > 0) continues along −ω_o.
        let cos_theta = if g.abs() < 1e-3 {
            // Second order in g of the inversion below, whose 1/(2g) cancels here: error O(g³).
            let c = 2.0 * u0 - 1.0;
            -(c + 1.5 * g * (1.0 - c * c) - 2.0 * g * g * c * (1.0 - c * c))
        } else {
            let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u0);
            -(1.0 + g * g - s * s) / (2.0 * g)
        };
        let cos_theta = cos_theta.clamp(-1.0, 1.0);
        let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).sqrt();
        let phi = std::f64::consts::TAU * f64::from(u[1]);
        let local = Vec3::new((sin_theta * phi.cos()) as f32, (sin_theta * phi.sin()) as f32, cos_theta as f32);
        Frame::from_z(wo).to_world(local).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::Stream;

    const G: [f32; 9] = [-0.999, -0.8, -0.3, -1e-4, 0.0, 5e-4, 0.5, 0.95, 0.999];

    /// ∫ p dω = 1 by quadrature over ω_o · ω_i, refined towards the peak.
    #[test]
    fn it_integrates_to_one() {
        for g in G {
            let phase = HenyeyGreenstein::new(g);
            let wo = Vec3::Z;
            let steps = 200_000;
            // cos θ = ±(1 − 2 s³) puts steps where the peak is.
            let sum: f64 = (0..steps)
                .map(|i| {
                    let s = (f64::from(i) + 0.5) / f64::from(steps);
                    let from_peak = 2.0 * s * s * s;
                    let cos = if g > 0.0 { -1.0 + from_peak } else { 1.0 - from_peak };
                    let sin = (from_peak * (2.0 - from_peak)).sqrt();
                    let wi = Vec3::new(sin as f32, 0.0, cos as f32);
                    f64::from(phase.evaluate(wo, wi)) * std::f64::consts::TAU * 6.0 * s * s / f64::from(steps)
                })
                .sum();
            assert!((sum - 1.0).abs() < 2e-3, "g = {g}: {sum}");
        }
    }

    /// Samples fall into bins of equal probability equally often: chi² with 63 degrees of freedom, false alarms at 1e-6 for each g.
    #[test]
    fn samples_follow_the_pdf() {
        for g in G {
            let phase = HenyeyGreenstein::new(g);
            let mut stream = Stream::from_seed(7);
            let wo = Vec3::new(0.48, -0.6, 0.64);
            let (mut bins, count) = ([0u32; 64], 200_000);
            for _ in 0..count {
                let wi = phase.sample(wo, [stream.next_f32(), stream.next_f32()]);
                assert!((wi.length() - 1.0).abs() < 1e-5);
                // The cumulative distribution of μ = −cos θ, in f64 and independent of the sampling routine. In sharp lobes
                // only differences of the directions still tell how far from the peak they are.
                let g = f64::from(phase.g);
                let cdf = if g.abs() < 1e-6 {
                    0.5 * (1.0 - f64::from(wo.dot(wi)).clamp(-1.0, 1.0))
                } else {
                    let (p, q) = (wo.as_dvec3(), wi.as_dvec3());
                    let squared = if g > 0.0 {
                        (1.0 - g) * (1.0 - g) + g * (p + q).length_squared()
                    } else {
                        (1.0 + g) * (1.0 + g) - g * (p - q).length_squared()
                    };
                    (1.0 - g * g) / (2.0 * g) * (1.0 / squared.sqrt() - 1.0 / (1.0 + g))
                };
                bins[((cdf * 64.0) as usize).min(63)] += 1;
            }
            let expected = f64::from(count) / 64.0;
            let chi2: f64 = bins.iter().map(|b| (f64::from(*b) - expected).powi(2) / expected).sum();
            // The 1 − 1e-6 quantile of chi² with 63 degrees of freedom.
            assert!(chi2 < 128.6, "g = {g}: chi² = {chi2}");
        }
    }

    #[test]
    fn extreme_lobes_stay_finite() {
        for g in [-1.0, 1.0, 0.999_999, -5.0, 5.0] {
            let phase = HenyeyGreenstein::new(g);
            for wo in [Vec3::Z, -Vec3::Z, Vec3::X] {
                for u in [0.0, 0.5, crate::math::ONE_MINUS_EPSILON] {
                    let wi = phase.sample(wo, [u, u]);
                    let p = phase.evaluate(wo, wi);
                    assert!(wi.is_finite() && p.is_finite() && p > 0.0, "g = {g}, u = {u}: {wi}, {p}");
                }
            }
        }
    }
}
