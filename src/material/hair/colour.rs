//! The absorption of hair: from pigments, or from the colour that much hair comes to. Sources: d'Eon et al. 2011, as pbrt-v4
//! has it in RGB; Chiang et al. 2016, equation 9.

use crate::math::Rgb;

/// Absorption per radius of a unit concentration of eumelanin, which is brown and black.
const EUMELANIN: Rgb = Rgb::new(0.419, 0.697, 1.37);
/// The same of pheomelanin, which is yellow and red.
const PHEOMELANIN: Rgb = Rgb::new(0.187, 0.4, 1.05);

/// Darker colours than this would take endless absorption.
const DARKEST: f32 = 1e-4;

/// σ_a per radius from the concentrations of both pigments (0.1 is blond, 0.3 red or light brown, 1.3 brown, 8 black).
pub fn from_pigments(eumelanin: f32, pheomelanin: f32) -> Rgb {
    EUMELANIN * eumelanin.max(0.0) + PHEOMELANIN * pheomelanin.max(0.0)
}

/// σ_a per radius with which a mass of hair of azimuthal roughness `beta_n` has the colour `reflectance` (0..=1 per channel), by the fit of
/// Chiang et al.
pub fn from_reflectance(reflectance: Rgb, beta_n: f32) -> Rgb {
    let n = beta_n.clamp(0.0, 1.0);
    let fit = 5.969 + n * (-0.215 + n * (2.532 + n * (-10.73 + n * (5.574 + n * 0.245))));
    reflectance.map(|c| (c.clamp(DARKEST, 1.0).ln() / fit).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_pigment_is_darker_and_white_absorbs_nothing() {
        assert_eq!(from_reflectance(Rgb::WHITE, 0.3), Rgb::BLACK);
        let (grey, dark) = (from_reflectance(Rgb::splat(0.5), 0.3), from_reflectance(Rgb::BLACK, 0.3));
        assert!(grey[0] > 0.0 && dark[0] > grey[0] && dark.is_finite());
        // (ln 0.5 / 5.88841)².
        assert!((grey[0] - 0.013_857).abs() < 1e-5, "{grey:?}");
        let brown = from_pigments(1.3, 0.0);
        assert!((brown[0] - 0.5447).abs() < 1e-4 && brown[2] > brown[0]);
        assert_eq!(from_pigments(-1.0, 0.0), Rgb::BLACK);
    }
}
