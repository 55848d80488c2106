//! Hair and fur: a rough dielectric cylinder that absorbs within. Sources: Chiang et al. 2016, "A Practical and Controllable Hair and Fur
//! Model for Production Path Tracing"; Marschner et al. 2003; d'Eon et al. 2011; the formulas in the form of Pharr, "The Implementation
//! of a Hair Scattering Model", and pbrt-v4, section 9.9.
//!
//! f is a sum over p, the number of times that light crosses the fibre: R (p = 0), TT, TRT, and one term for all that comes after. Each is
//! longitudinal scattering M_p (`longitudinal.rs`) × attenuation A_p × azimuthal scattering N_p (`azimuthal.rs`).
//!
//! Local x runs along the fibre, θ is the angle to the plane across it and φ that within, from y towards z. Light may leave to any side of
//! the shading normal; f is divided by the cosine to it, so that its product with that cosine is the fibre's own.

mod azimuthal;
pub mod colour;
mod longitudinal;
#[cfg(test)]
mod tests;

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::fresnel;
use super::local::LocalSample;
use crate::math::{ONE_MINUS_EPSILON, Rgb};

/// Terms that are told apart; the last of the four sums up the rest.
const LAST: usize = 3;

/// Roughnesses below this are raised to it (as in pbrt-v4).
const SMOOTHEST: f32 = 0.01;

/// The least cosine that f is divided by: rounding of the directions drowns smaller ones.
const LEAST_COSINE: f32 = 1e-6;

/// The shortest way of light through the fibre is across: it is lengthened by 1/cos θ_t, at most by the inverse of this.
const LEAST_COSINE_INSIDE: f32 = 1e-3;

/// Scattering by a fibre at one offset from its middle.
#[derive(Clone, Copy, Debug)]
pub struct Hair {
    h: f32,
    eta: f32,
    sigma_a: Rgb,
    /// Longitudinal variances v_p of R, TT and all others.
    variances: [f32; 3],
    /// Scale s of the azimuthal logistic.
    scale: f32,
    /// Sine and cosine of the angle by which the scales of the surface turn θ_o for R, TT and TRT.
    tilts: [[f32; 2]; 3],
}

/// All of f that depends on ω_o alone.
struct Outgoing {
    sin_theta: f32,
    cos_theta: f32,
    phi: f32,
    gamma_o: f32,
    gamma_t: f32,
    /// A_p.
    attenuation: [Rgb; LAST + 1],
}

impl Hair {
    /// A fibre met at the offset `h` in −1..=1 from its middle, in units of its radius: positive to the side of ω_o × x; with the index of
    /// refraction `eta`, absorbing by `sigma_a` per radius (not negative), with the roughnesses `beta_m` along and `beta_n` around it (0..=1,
    /// Chiang et al. 2016, section 4) and scales tilted by `alpha` degrees.
    pub fn new(h: f32, eta: f32, sigma_a: Rgb, beta_m: f32, beta_n: f32, alpha: f32) -> Self {
        let (m, n) = (beta_m.clamp(SMOOTHEST, 1.0), beta_n.clamp(SMOOTHEST, 1.0));
        // Chiang et al. 2016, equations 7 and 8.
        let variance = (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2);
        let scale = (PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22));
        let tilt = |times: f32| {
            let (sin, cos) = (times * alpha.to_radians()).sin_cos();
            [sin, cos]
        };
        Self {
            h: h.clamp(-1.0, 1.0),
            eta,
            sigma_a,
            variances: [variance, 0.25 * variance, 4.0 * variance],
            scale,
            tilts: [tilt(-2.0), tilt(1.0), tilt(4.0)],
        }
    }

    /// f(wo, wi).
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let out = self.outgoing(wo);
        let (sin_i, cos_i, phi_i) = angles(wi);
        let mut sum = Rgb::BLACK;
        for (p, attenuation) in out.attenuation.into_iter().enumerate() {
            sum += attenuation * self.term(p, &out, sin_i, cos_i, phi_i - out.phi);
        }
        sum / wi.z.abs().max(LEAST_COSINE)
    }

    /// The pdf of [`Hair::sample`]: the same sum with shares in place of attenuations.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let out = self.outgoing(wo);
        let (sin_i, cos_i, phi_i) = angles(wi);
        let shares = out.shares();
        (0..=LAST).map(|p| shares[p] * self.term(p, &out, sin_i, cos_i, phi_i - out.phi)).sum()
    }

    /// Chooses a term by `uc` in proportion to its attenuation, and θ and φ by its M_p and N_p.
    pub fn sample(&self, wo: Vec3, uc: f32, u: [f32; 2]) -> Option<LocalSample> {
        let out = self.outgoing(wo);
        let shares = out.shares();
        let (mut p, mut rest) = (0, uc);
        while p < LAST && rest >= shares[p] {
            rest -= shares[p];
            p += 1;
        }
        // What is left of the number chooses φ.
        let u_phi = if shares[p] > 0.0 { (rest / shares[p]).clamp(0.0, ONE_MINUS_EPSILON) } else { 0.5 };
        let (sin_o, cos_o) = self.tilted(p, &out);
        let sin_i = longitudinal::sample(sin_o, cos_o, self.variance(p), u);
        let cos_i = (1.0 - sin_i * sin_i).max(0.0).sqrt();
        let turn = if p < LAST {
            azimuthal::deflection(p, out.gamma_o, out.gamma_t) + azimuthal::sample(self.scale, u_phi)
        } else {
            TAU * u_phi
        };
        let (sin_phi, cos_phi) = (out.phi + turn).sin_cos();
        let wi = Vec3::new(sin_i, cos_i * cos_phi, cos_i * sin_phi);
        let sample = LocalSample::rough(wi, self.evaluate(wo, wi), self.pdf(wo, wi));
        Some(if wo.z * wi.z < 0.0 { sample.transmitted(1.0) } else { sample })
    }

    /// ∫ f |cos θ_i| dω_i, exactly: what each term lets through.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.outgoing(wo).attenuation.into_iter().sum()
    }

    /// M_p N_p for a light direction at the angle `phi` from ω_o around the fibre.
    #[inline]
    fn term(&self, p: usize, out: &Outgoing, sin_i: f32, cos_i: f32, phi: f32) -> f32 {
        let (sin_o, cos_o) = self.tilted(p, out);
        let m = longitudinal::density(sin_i, cos_i, sin_o, cos_o, self.variance(p));
        let n = if p < LAST {
            azimuthal::density(phi - azimuthal::deflection(p, out.gamma_o, out.gamma_t), self.scale)
        } else {
            1.0 / TAU
        };
        m * n
    }

    #[inline]
    fn variance(&self, p: usize) -> f32 {
        self.variances[p.min(2)]
    }

    /// sin and cos of θ_o, turned by the tilt of the scales.
    #[inline]
    fn tilted(&self, p: usize, out: &Outgoing) -> (f32, f32) {
        let Some(&[sin, cos]) = self.tilts.get(p) else { return (out.sin_theta, out.cos_theta) };
        let turned = out.cos_theta * cos - out.sin_theta * sin;
        // Turned past the fibre's own direction, it comes up on the other side.
        (out.sin_theta * cos + out.cos_theta * sin, turned.abs())
    }

    fn outgoing(&self, wo: Vec3) -> Outgoing {
        let (sin_theta, cos_theta, phi) = angles(wo);
        // Seen along the plane across, the fibre has the index η′ (Bravais; Marschner et al. 2003, appendix B).
        let bravais = (self.eta * self.eta - sin_theta * sin_theta).max(0.0).sqrt() / cos_theta.max(1e-6);
        let sin_gamma_t = if bravais > 0.0 { (self.h / bravais).clamp(-1.0, 1.0) } else { self.h.signum() };
        let cos_gamma_t = (1.0 - sin_gamma_t * sin_gamma_t).max(0.0).sqrt();
        let sin_theta_t = sin_theta / self.eta;
        let cos_theta_t = (1.0 - sin_theta_t * sin_theta_t).max(0.0).sqrt().max(LEAST_COSINE_INSIDE);
        let way = 2.0 * cos_gamma_t / cos_theta_t;
        let transmittance = (self.sigma_a * -way).exp();
        let cos_gamma_o = (1.0 - self.h * self.h).max(0.0).sqrt();
        let reflectance = fresnel::dielectric(cos_theta * cos_gamma_o, self.eta);
        Outgoing {
            sin_theta,
            cos_theta,
            phi,
            gamma_o: self.h.asin(),
            gamma_t: sin_gamma_t.asin(),
            attenuation: attenuations(reflectance, transmittance),
        }
    }
}

impl Outgoing {
    /// The probability of each term.
    #[inline]
    fn shares(&self) -> [f32; LAST + 1] {
        let means = self.attenuation.map(Rgb::mean);
        let total: f32 = means.iter().sum();
        if total > 0.0 { means.map(|mean| mean / total) } else { [1.0, 0.0, 0.0, 0.0] }
    }
}

/// A_p from the reflectance f of the surface and the transmittance T of one way through: f, (1−f)²T, (1−f)²T²f, and the rest of that
/// geometric series. They add up to 1 where T is.
#[inline]
fn attenuations(reflectance: f32, transmittance: Rgb) -> [Rgb; LAST + 1] {
    let f = reflectance;
    let tt = transmittance * ((1.0 - f) * (1.0 - f));
    let trt = tt * transmittance * f;
    let mut rest = Rgb::BLACK;
    for c in 0..3 {
        let again = transmittance[c] * f;
        rest[c] = if again < 1.0 { trt[c] * again / (1.0 - again) } else { 0.0 };
    }
    [Rgb::splat(f), tt, trt, rest]
}

/// sin θ, cos θ and φ.
#[inline]
fn angles(w: Vec3) -> (f32, f32, f32) {
    (w.x, Vec2::new(w.y, w.z).length(), w.z.atan2(w.y))
}
