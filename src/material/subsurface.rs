//! What stands for subsurface scattering: a diffuse base under a dielectric boundary, with the albedo of a half-space of the matter. Light
//! leaves where it enters, so nothing is blurred and no light comes round edges. Sources: van de Hulst, "Multiple Light Scattering" (1980)
//! for the albedo; Jensen et al. 2001 for the boundary's mean reflectance from within.

use super::fresnel;
use crate::math::Rgb;

/// The albedo under diffuse light of a half-space that absorbs by `sigma_a` and scatters by `sigma_s` with the mean cosine `g`, without a
/// boundary: (1 − s)(1 − 0.139 s) / (1 + 1.17 s) with s² = (1 − ϖ) / (1 − ϖg), ϖ = σ_s / (σ_a + σ_s), within 0.01 of random walks.
pub fn half_space_albedo(sigma_a: Rgb, sigma_s: Rgb, g: f32) -> Rgb {
    let g = g.clamp(-1.0, 1.0);
    let mut albedo = Rgb::BLACK;
    for c in 0..3 {
        let (a, s) = (sigma_a[c].max(0.0), sigma_s[c].max(0.0));
        let single = if s > 0.0 { s / (a + s) } else { 0.0 };
        let similar = ((1.0 - single) / (1.0 - single * g).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0).sqrt();
        albedo[c] = (1.0 - similar) * (1.0 - 0.139 * similar) / (1.0 + 1.17 * similar);
    }
    albedo
}

/// The albedo ρ of a base under a smooth boundary of index `eta` such that of the light that goes in, `reflectance` comes out again:
/// (1 − F_i)ρ / (1 − F_iρ) solved for ρ, F_i being the boundary's mean reflectance from within.
pub fn albedo_under_boundary(reflectance: Rgb, eta: f32) -> Rgb {
    let inner = fresnel::mean_internal(eta.max(1.0));
    reflectance.map(|r| r / (1.0 - inner + inner * r).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::chi2::Moments;
    use crate::math::phase::HenyeyGreenstein;
    use crate::math::sampler::Stream;
    use crate::math::warp;
    use glam::Vec3;

    /// Random walks into a half-space. The fit is to be right within 0.01 and six standard errors (false alarms below 1e-8 each).
    #[test]
    fn the_half_space_albedo_is_that_of_random_walks() {
        for (i, (single, g)) in
            [(0.3f32, 0.0), (0.9, 0.0), (0.99, 0.0), (0.95, 0.7), (0.9, -0.4)].into_iter().enumerate()
        {
            let phase = HenyeyGreenstein::new(g);
            let mut rng = Stream::from_seed(i as u64);
            let mut out = Moments::default();
            for _ in 0..20_000 {
                let mut w = -warp::cosine_hemisphere([rng.next_f32(), rng.next_f32()]);
                let (mut z, mut weight) = (0.0f32, 1.0f32);
                loop {
                    z += rng.next_exponential() * w.z;
                    if z >= 0.0 {
                        break;
                    }
                    weight *= single;
                    if weight < 1e-4 {
                        weight = 0.0;
                        break;
                    }
                    let wi = phase.sample(-w, [rng.next_f32(), rng.next_f32()]);
                    w = Vec3::normalize(wi);
                }
                out.add(f64::from(weight));
            }
            let fit = f64::from(half_space_albedo(Rgb::splat(1.0 - single), Rgb::splat(single), g)[0]);
            let error = (out.variance() / out.n).sqrt();
            assert!((out.mean() - fit).abs() < 0.01 + 6.0 * error, "{single} {g}: {} ± {error}, fit {fit}", out.mean());
        }
    }

    #[test]
    fn extremes_stay_within_bounds() {
        assert_eq!(half_space_albedo(Rgb::BLACK, Rgb::WHITE, 0.5), Rgb::WHITE);
        assert_eq!(half_space_albedo(Rgb::WHITE, Rgb::BLACK, 0.5), Rgb::BLACK);
        assert_eq!(half_space_albedo(Rgb::BLACK, Rgb::BLACK, 0.0), Rgb::BLACK);
        for g in [-1.0, 1.0, 5.0] {
            assert!(half_space_albedo(Rgb::splat(0.1), Rgb::WHITE, g).is_finite());
        }
        assert_eq!(albedo_under_boundary(Rgb::BLACK, 1.33), Rgb::BLACK);
        assert!((albedo_under_boundary(Rgb::WHITE, 1.33)[0] - 1.0).abs() < 1e-6);
        let inner = fresnel::mean_internal(1.33);
        let r = albedo_under_boundary(Rgb::splat(0.4), 1.33)[0];
        assert!(((1.0 - inner) * r / (1.0 - inner * r) - 0.4).abs() < 1e-6);
    }
}
