//! M_p: how light spreads along a fibre. Source: d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model" and, for
//! sampling, d'Eon et al. 2013, "Importance Sampling for Physically-Based Hair Fiber Models".
//!
//! M = e^(−sin θ_i sin θ_o / v) I₀(cos θ_i cos θ_o / v) / (2v sinh(1/v)). Its factors overflow for small v; here their exponents are taken
//! together, as the distance of two points on a circle, which does not cancel either.

use std::f32::consts::TAU;

/// The density of θ_i, by cos θ_i dθ_i, for light that leaves at θ_o, with variance `v` above 0.
#[inline]
pub fn density(sin_i: f32, cos_i: f32, sin_o: f32, cos_o: f32, v: f32) -> f32 {
    // 2 (1 + sin sin − cos cos) = (sin + sin)² + (cos − cos)².
    let apart = (sin_i + sin_o).powi(2) + (cos_i - cos_o).powi(2);
    (-apart / (2.0 * v)).exp() * bessel_i0_scaled(cos_i * cos_o / v) / (-v * (-2.0 / v).exp_m1())
}

/// sin θ_i with the pdf [`density`].
#[inline]
pub fn sample(sin_o: f32, cos_o: f32, v: f32, u: [f32; 2]) -> f32 {
    // 1 − cos of the angle from the cone's axis; d'Eon et al. 2013 with u reversed, so that small v keep their precision.
    let from_axis = (-v * (u[0] * (-2.0 / v).exp_m1()).ln_1p()).min(2.0);
    let sin = (from_axis * (2.0 - from_axis)).max(0.0).sqrt();
    ((from_axis - 1.0) * sin_o + sin * (TAU * u[1]).cos() * cos_o).clamp(-1.0, 1.0)
}

/// e^−x I₀(x) for x ≥ 0: the polynomials 9.8.1 and 9.8.2 of Abramowitz & Stegun, relative error below 3e-7.
#[inline]
fn bessel_i0_scaled(x: f32) -> f32 {
    let polynomial = |t: f32, coefficients: &[f32]| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let t = x / 3.75;
    if t < 1.0 {
        let series =
            polynomial(t * t, &[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3]);
        series * (-x).exp()
    } else {
        let coefficients = [
            0.398_942_3,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        polynomial(1.0 / t, &coefficients) / x.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The power series in f64.
    #[test]
    fn the_bessel_function_is_right() {
        for x in [0.0f32, 0.1, 1.0, 3.7, 3.8, 8.0, 20.0, 100.0, 600.0] {
            let y = f64::from(x);
            let (mut sum, mut term, mut k) = (0.0f64, 1.0f64, 0.0f64);
            while term > 1e-17 * sum {
                sum += term;
                k += 1.0;
                term *= (y / (2.0 * k)).powi(2);
            }
            let expected = sum * (-y).exp();
            let value = f64::from(bessel_i0_scaled(x));
            assert!((value / expected - 1.0).abs() < 2e-6, "{x}: {value} {expected}");
        }
    }

    #[test]
    fn it_is_a_density_at_any_roughness() {
        // From β_m = 0.01 to 1 and four times the variance for TRT.
        for v in [5.4e-5f32, 1e-3, 0.02, 0.1, 1.0, 27.0, 110.0] {
            for theta_o in [-1.5f32, -0.7, 0.0, 0.3, 1.2] {
                let (sin_o, cos_o) = theta_o.sin_cos();
                let n = 400_000;
                let step = std::f64::consts::PI / f64::from(n);
                let sum: f64 = (0..n)
                    .map(|i| {
                        let theta = (f64::from(i) + 0.5) * step - std::f64::consts::FRAC_PI_2;
                        let (sin, cos) = theta.sin_cos();
                        f64::from(density(sin as f32, cos as f32, sin_o, cos_o, v)) * cos * step
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 2e-3, "v {v}, θ_o {theta_o}: {sum}");
            }
        }
    }
}
