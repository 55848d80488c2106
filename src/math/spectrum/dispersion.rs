//! Indices of refraction of clear solids by their dispersion formulas n(λ), λ in µm.
//! Glasses: Sellmeier coefficients of SCHOTT's optical glass data sheets (BAF10, FK51A and LASF9 are today's N- types).
//! MgO: Stephens & Malitson 1952, J. Res. Natl. Bur. Stand. 49. TiO2 (rutile, ordinary ray): Devore 1951, JOSA 41.

/// n² = 1 + Σ B λ² / (λ² − C): the pairs (B, C) of each glass, C in µm².
/// pbrt-v4 calls the SF glasses F: both names are known.
const GLASSES: [(&str, [(f64, f64); 3]); 10] = [
    ("glass-BK7", [(1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)]),
    ("glass-BAF10", [(1.5851495, 0.00926681282), (0.143559385, 0.0424489805), (1.08521269, 105.613573)]),
    ("glass-FK51A", [(0.971247817, 0.00472301995), (0.216901417, 0.0153575612), (0.904651666, 168.68133)]),
    ("glass-LASF9", [(2.00029547, 0.0121426017), (0.298926886, 0.0538736236), (1.80691843, 156.530829)]),
    ("glass-SF5", [(1.46141885, 0.0111826126), (0.247713019, 0.0508594669), (0.949995832, 112.041888)]),
    ("glass-F5", [(1.46141885, 0.0111826126), (0.247713019, 0.0508594669), (0.949995832, 112.041888)]),
    ("glass-SF10", [(1.61625977, 0.0127534559), (0.259229334, 0.0581983954), (1.07762317, 116.60768)]),
    ("glass-F10", [(1.61625977, 0.0127534559), (0.259229334, 0.0581983954), (1.07762317, 116.60768)]),
    ("glass-SF11", [(1.73848403, 0.0136068604), (0.311168974, 0.0615960463), (1.17490871, 121.922711)]),
    ("glass-F11", [(1.73848403, 0.0136068604), (0.311168974, 0.0615960463), (1.17490871, 121.922711)]),
];

/// The names of the glasses.
pub fn glass_names() -> impl Iterator<Item = &'static str> {
    GLASSES.iter().map(|(name, _)| *name)
}

/// n of the glass `name` at `wavelength` in nm; `None` for an unknown name.
pub fn glass(name: &str, wavelength: f64) -> Option<f64> {
    let (_, terms) = GLASSES.iter().find(|(n, _)| *n == name)?;
    let square = (wavelength * 1e-3).powi(2);
    Some((1.0 + terms.iter().map(|(b, c)| b * square / (square - c)).sum::<f64>()).sqrt())
}

/// n of magnesium oxide at `wavelength` in nm.
pub fn magnesium_oxide(wavelength: f64) -> f64 {
    let square = (wavelength * 1e-3).powi(2);
    (2.956362 - 0.01062387 * square - 2.04968e-5 * square * square + 0.0219577 / (square - 0.01428322)).sqrt()
}

/// n of rutile's ordinary ray at `wavelength` in nm.
pub fn titanium_dioxide(wavelength: f64) -> f64 {
    (5.913 + 0.2441 / ((wavelength * 1e-3).powi(2) - 0.0803)).sqrt()
}
