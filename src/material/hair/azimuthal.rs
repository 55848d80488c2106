//! N_p: how light spreads around a fibre: the deflection of a smooth cylinder, blurred by a logistic distribution on −π..π. Sources: Marschner
//! et al. 2003 for the deflection, Chiang et al. 2016 for the logistic.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Φ(p), the angle around the fibre between where light comes from and where it goes, for light that crosses a smooth one `p` times:
/// γ_o and γ_t are the angles of incidence and refraction in the plane across.
#[inline]
pub fn deflection(p: usize, gamma_o: f32, gamma_t: f32) -> f32 {
    let p = p as f32;
    2.0 * p * gamma_t - 2.0 * gamma_o + p * PI
}

/// The density of the angle `x` (any) from the smooth cylinder's with the scale `s` above 0.
#[inline]
pub fn density(x: f32, s: f32) -> f32 {
    let x = (x - TAU * (x / TAU).round()).abs();
    let e = (-x / s).exp();
    e / (s * (1.0 + e) * (1.0 + e)) / share_within(s)
}

/// An angle in −π..=π with the pdf [`density`].
#[inline]
pub fn sample(s: f32, u: f32) -> f32 {
    // The logistic's distribution function from −π to π is this much around a half.
    let beyond_half = share_within(s) * (u - 0.5);
    (-s * (1.0 / (0.5 + beyond_half) - 1.0).ln()).clamp(-PI, PI)
}

/// The share of the logistic distribution that lies within −π..π.
#[inline]
fn share_within(s: f32) -> f32 {
    (FRAC_PI_2 / s).tanh()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_a_density_and_samples_have_its_quantiles() {
        for s in [0.0018f32, 0.05, 0.3, 1.0, 4.3] {
            let n = 200_000;
            let step = TAU / n as f32;
            let (mut sum, mut next) = (0.0f64, 1);
            for i in 0..n {
                let x = (i as f32 + 0.5) * step - PI;
                sum += f64::from(density(x, s) * step);
                // Every tenth of the distribution.
                while next < 10 && sum >= 0.1 * f64::from(next) {
                    let sampled = sample(s, 0.1 * next as f32);
                    assert!((sampled - x).abs() < 1e-4 + 0.02 * s, "s {s}, {next}: {sampled} {x}");
                    next += 1;
                }
            }
            assert!((sum - 1.0).abs() < 1e-3 && next == 10, "s {s}: {sum}");
            assert!((density(0.4, s) - density(0.4 - TAU, s)).abs() <= 1e-3 * density(0.4, s));
        }
    }
}
