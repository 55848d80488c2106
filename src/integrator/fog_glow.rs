//! Emission of homogeneous media along a stretch between boundaries. Source: Kajiya 1986 (the emission term of the rendering equation);
//! Simon et al. 2017 ("Line integration for rendering heterogeneous emissive volumes"), where there is a closed form.
//!
//! Tentative collisions of a homogeneous medium would gather it as rarely as they come: a thin fog glows in few samples, and brightly in
//! those. Where all media of the stretch are homogeneous, the integral along it is known, and nothing is left to chance. Where grids
//! overlap, what they let through is not, and is taken at one point, which has no part in the flight itself.

use super::world::World;
use crate::geometry::Ray;
use crate::math::Rgb;
use crate::math::sampler::Stream;
use crate::medium::{Medium, MediumId, MediumPoint};

/// How the emission of a stretch is gathered.
pub(super) enum FogGlow {
    /// There is none, or it was gathered.
    Gathered,
    /// All at once where the stretch begins: ∫ e^{−μ_t t} μ_a L_e dt.
    Whole(Rgb),
    /// At the distance `t` of the ray, if the flight comes that far: μ_a L_e over the pdf of the point.
    At {
        /// Where.
        t: f32,
        /// How much.
        value: Rgb,
    },
}

impl FogGlow {
    /// For the stretch of `ray` from `t_start` to `t_end` through `media`.
    #[inline]
    pub fn new(world: &World, media: &[MediumId], ray: &Ray, stretch: [f32; 2], stream: &mut Stream) -> Self {
        let glows = |id| matches!(world.medium(id), Medium::Homogeneous(medium) if !medium.point.emission.is_black());
        if media.iter().any(|&id| glows(id)) { Self::of(world, media, ray, stretch, stream) } else { Self::Gathered }
    }

    /// The same, where some of the media glow.
    #[inline(never)]
    fn of(world: &World, media: &[MediumId], ray: &Ray, [t_start, t_end]: [f32; 2], stream: &mut Stream) -> Self {
        let (mut extinction, mut emission, mut grids) = (Rgb::BLACK, Rgb::BLACK, false);
        for &id in media {
            match world.medium(id) {
                Medium::Homogeneous(medium) => {
                    let p = ray.origin + ray.direction * t_start;
                    let MediumPoint { absorption, scattering, emission: glow } = medium.along(p);
                    extinction += absorption + scattering;
                    emission += glow;
                }
                Medium::Grid(_) => grids = true,
            }
        }
        if emission.is_black() {
            return Self::Gathered;
        }
        let length = t_end - t_start;
        if !grids {
            // What emits absorbs: where μ_t is 0, so is the emission.
            let depth = |mu: f32| if mu > 0.0 { -(-mu * length).exp_m1() / mu } else { 0.0 };
            return Self::Whole(emission * extinction.map(depth));
        }
        // By the thinnest channel that emits, so that no other one's weight grows along the stretch.
        let thinnest = |rate: f32, c: usize| if emission[c] > 0.0 { rate.min(extinction[c]) } else { rate };
        let rate = (0..3).fold(f32::INFINITY, thinnest);
        let (distance, pdf) = truncated_exponential(stream.next_f32(), rate, length);
        Self::At { t: t_start + distance, value: emission * (1.0 / pdf) }
    }
}

/// A distance from 0 to `length`, which may be infinite, drawn in proportion to e^{−rate t}; and its pdf.
fn truncated_exponential(u: f32, rate: f32, length: f32) -> (f32, f32) {
    let depth = rate * length;
    if depth < 1e-3 {
        return (u * length, 1.0 / length);
    }
    let whole = -(-depth).exp_m1();
    let t = (-(-u * whole).ln_1p() / rate).min(length);
    (t, rate * (-rate * t).exp() / whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_follow_their_pdf() {
        // Midpoints of u: the mean of f/pdf is the integral of f = e^{−2t} t over the stretch.
        for (rate, length) in [(1e-7f32, 3.0f32), (0.5, 3.0), (1.5, f32::INFINITY)] {
            let n = 200_000;
            let mean = (0..n)
                .map(|i| truncated_exponential((i as f32 + 0.5) / n as f32, rate, length))
                .map(|(t, pdf)| f64::from((-2.0 * t).exp() * t / pdf))
                .sum::<f64>()
                / f64::from(n);
            let end = f64::from(length);
            let expected = if end.is_finite() { 0.25 - (0.5 * end + 0.25) * (-2.0 * end).exp() } else { 0.25 };
            assert!((mean - expected).abs() < 1e-4, "{mean} is not {expected} for {rate}, {length}");
        }
    }
}
