//! Thin panes of a dielectric: two parallel boundaries so close that light leaves where it came in. All reflections between the two are
//! summed, and what passes goes straight on. Source: pbrt-v4, section 9.5.1. Directions are local.

use glam::Vec3;

use super::fresnel;
use super::local::LocalSample;
use crate::math::Rgb;

/// A pane that neither absorbs nor bends light.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// Index of refraction of the pane over that of what lies on either side.
    pub eta: f32,
}

impl ThinDielectric {
    /// The fraction in 0..=1 that the pane reflects of light at `cos` (of either sign) to its normal: R + T²R + T²R³ + … =
    /// R + T²R / (1 − R²), which for T = 1 − R is 2R / (1 + R).
    #[inline]
    pub fn reflectance(&self, cos: f32) -> f32 {
        let r = fresnel::dielectric(cos.abs(), self.eta);
        2.0 * r / (1.0 + r)
    }

    /// Reflects or passes by `uc`, in proportion to how much of the light does.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32) -> Option<LocalSample> {
        let r = self.reflectance(wo.z);
        let cos = wo.z.abs();
        Some(if uc < r {
            LocalSample::specular(Vec3::new(-wo.x, -wo.y, wo.z), Rgb::splat(r / cos), r)
        } else {
            LocalSample::specular(-wo, Rgb::splat((1.0 - r) / cos), 1.0 - r).transmitted(1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflections_within_the_pane_add_up() {
        for eta in [1.0, 1.33, 1.5, 2.4, 0.7] {
            for cos in [1.0, 0.7, 0.2, -0.4] {
                let r = fresnel::dielectric(f32::abs(cos), eta);
                let (t, mut sum, mut inside) = (1.0 - r, r, (1.0 - r) * r);
                for _ in 0..10_000 {
                    sum += inside * t;
                    inside *= r * r;
                }
                let pane = ThinDielectric { eta };
                // Total reflection at the first boundary lets nothing in.
                let expected = if r < 1.0 { r + t * t * r / (1.0 - r * r) } else { 1.0 };
                assert!((pane.reflectance(cos) - expected).abs() < 1e-6, "{eta} {cos}");
                assert!((pane.reflectance(cos) - sum).abs() < 1e-5, "{eta} {cos}");
            }
        }
    }

    #[test]
    fn light_is_shared_and_goes_straight_on() {
        let pane = ThinDielectric { eta: 1.5 };
        let wo = Vec3::new(0.6, 0.0, -0.8);
        let r = pane.reflectance(wo.z);
        let back = pane.sample(wo, r * 0.99).expect("something is reflected");
        let on = pane.sample(wo, r * 1.01).expect("something passes");
        assert!(back.is_specular && !back.is_transmission && back.wi == Vec3::new(-0.6, 0.0, -0.8));
        assert!(on.is_specular && on.is_transmission && on.wi == -wo && on.eta == 1.0);
        assert!((back.pdf - r).abs() < 1e-7 && (on.pdf - (1.0 - r)).abs() < 1e-7);
        assert!((back.weight()[0] - 1.0).abs() < 1e-6 && (on.weight()[0] - 1.0).abs() < 1e-6);
    }
}
