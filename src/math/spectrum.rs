//! Spectra as files give them, reduced to linear RGB once at load: integrals against the CIE 1931 2° observer
//! (`cie.rs`), then Rec. 709's matrix (`color_space.rs`). Also the spectra that pbrt-v4 knows by name.
//!
//! A renderer in RGB cannot disperse light: of an index of refraction that varies with the wavelength,
//! [`Spectrum::to_eta`] takes the value at the sodium line.

mod cie;
mod color_space;
mod daylight;
mod dispersion;
mod metals;

use std::sync::{Arc, OnceLock};

use glam::DVec3;

pub use color_space::{RgbColorSpace, ToRec709};
pub use daylight::white_balance;

use super::Rgb;

/// A spectrum as a scene file states it, before reduction to RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// Linear RGB in the scene's colour space, already converted to Rec. 709.
    Rgb(Rgb),
    /// A black body of this temperature in kelvin.
    Blackbody(f32),
    /// Pairs of wavelength (nm, rising) and value; linear between them and 0 outside them, as in pbrt-v4. Those of a file are in memory once.
    Samples(Arc<[(f32, f32)]>),
}

/// The wavelength of the sodium D lines, in nm, at which glass catalogues state n.
pub const SODIUM_LINE: f64 = 589.3;

/// The second radiation constant h c / k_B in nm K (CODATA 2018, exact in the SI of 2019).
const C2: f64 = 1.438_776_877e7;

/// The share of D50 in the mixture with D65 that has the chromaticity of ACES' white (0.32168, 0.33767), to 0.001.
const ACES_D60: f64 = 0.295;

/// The names that [`Spectrum::named`] knows.
pub fn named_spectrum_names() -> &'static [&'static str] {
    static NAMES: OnceLock<Vec<&'static str>> = OnceLock::new();
    NAMES.get_or_init(|| {
        let mut names = vec![
            "metal-Ag-eta",
            "metal-Ag-k",
            "metal-Al-eta",
            "metal-Al-k",
            "metal-Au-eta",
            "metal-Au-k",
            "metal-Cu-eta",
            "metal-Cu-k",
            "metal-CuZn-eta",
            "metal-CuZn-k",
            "metal-MgO-eta",
            "metal-MgO-k",
            "metal-TiO2-eta",
            "metal-TiO2-k",
            "stdillum-A",
            "illum-acesD60",
        ];
        names.extend(cie::ILLUMINANTS.iter().map(|(name, _)| *name));
        names.extend(dispersion::glass_names());
        names
    })
}

/// Samples of `f` from 360 to 830 nm, each 5 nm.
fn tabulate(f: impl Fn(f64) -> f64) -> Spectrum {
    let row = |i: usize| {
        let wavelength = cie::OBSERVER_FIRST + cie::STEP * i as f64;
        (wavelength as f32, f(wavelength) as f32)
    };
    Spectrum::Samples((0..cie::OBSERVER.len()).map(row).collect())
}

impl Spectrum {
    /// The spectrum that pbrt-v4 calls `name`: metals, glasses and the illuminants A, D50, D65, ACES' D60 and F1 to F12;
    /// `None` for others (pbrt's camera sensors).
    pub fn named(name: &str) -> Option<Self> {
        if dispersion::glass(name, SODIUM_LINE).is_some() {
            return Some(tabulate(|wavelength| dispersion::glass(name, wavelength).unwrap_or(1.0)));
        }
        match name {
            // CIE 15:2018, equation 4.1: A is a black body by definition.
            "stdillum-A" => {
                return Some(tabulate(|l| 100.0 * (560.0 / l).powi(5) * a_exponential(560.0) / a_exponential(l)));
            }
            "illum-acesD60" => {
                let (warm, cool) = (Self::named("stdillum-D50")?, Self::named("stdillum-D65")?);
                return Some(tabulate(|l| ACES_D60 * warm.value(l) + (1.0 - ACES_D60) * cool.value(l)));
            }
            "metal-MgO-eta" => return Some(tabulate(dispersion::magnesium_oxide)),
            "metal-TiO2-eta" => return Some(tabulate(dispersion::titanium_dioxide)),
            "metal-MgO-k" | "metal-TiO2-k" => return Some(tabulate(|_| 0.0)),
            _ => {}
        }
        if let Some((_, table)) = cie::ILLUMINANTS.iter().find(|(n, _)| *n == name) {
            let wavelength = |i: usize| (cie::ILLUMINANT_FIRST + cie::STEP * i as f64) as f32;
            return Some(Self::Samples(table.iter().enumerate().map(|(i, v)| (wavelength(i), *v as f32)).collect()));
        }
        let (metal, part) = name.strip_prefix("metal-")?.rsplit_once('-')?;
        let metal = metals::METALS.iter().find(|m| m.name == metal)?;
        let values = match part {
            "eta" => &metal.eta,
            "k" => &metal.k,
            _ => return None,
        };
        Some(Self::Samples(metals::WAVELENGTHS.iter().copied().zip(values.iter().copied()).collect()))
    }

    /// The value at `wavelength` in nm. A black body's is relative to its largest visible one, as in pbrt-v4 up to the
    /// choice of the maximum; RGB gives its luminance at every wavelength.
    pub fn value(&self, wavelength: f64) -> f64 {
        match self {
            Self::Rgb(rgb) => f64::from(rgb.luminance()),
            Self::Blackbody(kelvin) => blackbody(f64::from(*kelvin))(wavelength),
            Self::Samples(samples) => interpolate(samples, wavelength),
        }
    }

    /// As a reflectance or other unitless factor: the RGB seen under D65, not clamped. A constant spectrum c gives
    /// exactly (c, c, c).
    pub fn to_albedo(&self) -> Rgb {
        match self {
            Self::Rgb(rgb) => *rgb,
            Self::Blackbody(kelvin) => under_d65(blackbody(f64::from(*kelvin))),
            Self::Samples(samples) => under_d65(|l| interpolate(samples, l)),
        }
    }

    /// As an emission spectrum. RGB stays as it is; any other spectrum is scaled to luminance 1, as pbrt-v4 does before
    /// its light's `scale`. Colours outside Rec. 709's gamut are clipped to it (no channel below 0) with their
    /// luminance kept; a spectrum without luminance gives black.
    pub fn to_illuminant(&self) -> Rgb {
        let xyz = match self {
            Self::Rgb(rgb) => return *rgb,
            Self::Blackbody(kelvin) => observe(blackbody(f64::from(*kelvin))),
            Self::Samples(samples) => observe(|l| interpolate(samples, l)),
        };
        if xyz.y.is_nan() || xyz.y <= 0.0 {
            return Rgb::BLACK;
        }
        let rgb = narrow(to_rgb(xyz / xyz.y)).map(|c| c.max(0.0));
        rgb / rgb.luminance()
    }

    /// As a coefficient that is not bounded by 1 and not light (μ_a, μ_s, η, k): projected like
    /// [`Spectrum::to_albedo`], but no channel below 0.
    pub fn to_unbounded(&self) -> Rgb {
        match self {
            Self::Rgb(rgb) => *rgb,
            _ => self.to_albedo().map(|c| c.max(0.0)),
        }
    }

    /// As a single index of refraction: the value at [`SODIUM_LINE`]; without dispersion in the renderer there is one n
    /// for all light.
    pub fn to_eta(&self) -> f32 {
        self.value(SODIUM_LINE) as f32
    }
}

/// e^(c₂/λT) − 1 with the constants that the CIE's definition of illuminant A fixes.
fn a_exponential(wavelength: f64) -> f64 {
    (1.435e7 / (2848.0 * wavelength)).exp_m1()
}

/// Planck's law, relative to its largest value between 360 and 830 nm. In logarithms, so that no temperature above 0
/// overflows or vanishes.
fn blackbody(kelvin: f64) -> impl Fn(f64) -> f64 {
    let logarithm = move |wavelength: f64| {
        let x = C2 / (wavelength * kelvin);
        let ln_expm1 = if x > 40.0 { x } else { x.exp_m1().ln() };
        -5.0 * wavelength.ln() - ln_expm1
    };
    // Wien's displacement law; the maximum lies at an end of the visible range if not within.
    let brightest = (2.897_771_955e6 / kelvin).clamp(cie::OBSERVER_FIRST, cie::OBSERVER_LAST);
    let largest = logarithm(brightest);
    move |wavelength| (logarithm(wavelength) - largest).exp()
}

/// The value of rising samples at `wavelength`, linear between them, 0 outside.
fn interpolate(samples: &[(f32, f32)], wavelength: f64) -> f64 {
    let after = samples.partition_point(|(l, _)| f64::from(*l) <= wavelength);
    let at = |i: usize| samples.get(i).map(|(l, v)| (f64::from(*l), f64::from(*v)));
    match (after.checked_sub(1).and_then(at), at(after)) {
        (Some((l0, v0)), Some((l1, v1))) => v0 + (v1 - v0) * (wavelength - l0) / (l1 - l0),
        (Some((l0, v0)), None) if l0 == wavelength => v0,
        _ => 0.0,
    }
}

/// XYZ of a spectral power: sums of 1 nm steps from 360 to 830 nm with the observer interpolated linearly.
/// Unnormalised.
fn observe(power: impl Fn(f64) -> f64) -> DVec3 {
    let steps = (cie::OBSERVER_LAST - cie::OBSERVER_FIRST) as usize;
    let per_row = cie::STEP as usize;
    let mut sum = DVec3::ZERO;
    for i in 0..=steps {
        let (row, part) = (i / per_row, (i % per_row) as f64 / cie::STEP);
        let low = DVec3::from_array(cie::OBSERVER[row]);
        let high = DVec3::from_array(cie::OBSERVER[(row + 1).min(cie::OBSERVER.len() - 1)]);
        sum += low.lerp(high, part) * power(cie::OBSERVER_FIRST + i as f64);
    }
    sum
}

/// D65 at `wavelength`: the table, continued by its last values.
fn d65(wavelength: f64) -> f64 {
    let table = &cie::ILLUMINANTS[1].1;
    let position = ((wavelength - cie::ILLUMINANT_FIRST) / cie::STEP).clamp(0.0, (table.len() - 1) as f64);
    let row = (position as usize).min(table.len() - 2);
    table[row] + (table[row + 1] - table[row]) * (position - row as f64)
}

/// Linear Rec. 709 of XYZ. The tabulated D65 differs from the matrix's white in the fourth digit; it is made exactly
/// white.
fn to_rgb(xyz: DVec3) -> DVec3 {
    static WHITE: OnceLock<DVec3> = OnceLock::new();
    let white = WHITE.get_or_init(|| {
        let xyz = observe(d65);
        *color_space::xyz_to_rec709() * (xyz / xyz.y)
    });
    *color_space::xyz_to_rec709() * xyz / *white
}

fn under_d65(factor: impl Fn(f64) -> f64) -> Rgb {
    static LUMINANCE: OnceLock<f64> = OnceLock::new();
    let luminance = LUMINANCE.get_or_init(|| observe(d65).y);
    narrow(to_rgb(observe(|l| d65(l) * factor(l)) / *luminance))
}

fn narrow(rgb: DVec3) -> Rgb {
    Rgb::new(rgb.x as f32, rgb.y as f32, rgb.z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn xy(power: impl Fn(f64) -> f64) -> (f64, f64) {
        let xyz = observe(power);
        (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum())
    }

    fn close(found: (f64, f64), wanted: (f64, f64), tolerance: f64) {
        let near = (found.0 - wanted.0).abs() < tolerance && (found.1 - wanted.1).abs() < tolerance;
        assert!(near, "{found:?}, expected {wanted:?}");
    }

    #[test]
    fn constants_stay_themselves() {
        for value in [0.0f32, 0.18, 0.5, 1.0, 7.0] {
            let rgb = Spectrum::Samples([(300.0, value), (900.0, value)].into()).to_albedo();
            assert!((rgb.0 - glam::Vec3::splat(value)).abs().max_element() <= 1e-5 * value.max(1.0), "{rgb:?}");
        }
    }

    #[test]
    fn aces_white_is_between_daylights() {
        let white = Spectrum::named("illum-acesD60").unwrap();
        close(xy(|l| white.value(l)), (0.32168, 0.33767), 1e-3);
    }

    #[test]
    fn chromaticities_of_standard_illuminants() {
        // CIE 15:2018, tables 1 and T.6.
        for (name, wanted) in [
            ("stdillum-A", (0.44758, 0.40745)),
            ("stdillum-D50", (0.34567, 0.35851)),
            ("stdillum-D65", (0.31272, 0.32903)),
            ("stdillum-F2", (0.3721, 0.3751)),
            ("stdillum-F7", (0.3129, 0.3292)),
            ("stdillum-F11", (0.3805, 0.3769)),
        ] {
            let spectrum = Spectrum::named(name).unwrap();
            close(xy(|l| spectrum.value(l)), wanted, 5e-4);
        }
    }

    #[test]
    fn chromaticities_of_black_bodies() {
        // The Planckian locus (Wyszecki & Stiles, table 1(3.11)), c₂ = 1.4388e-2 m K.
        for (kelvin, wanted) in [
            (2000.0, (0.52669, 0.41331)),
            (3000.0, (0.43693, 0.40407)),
            (5000.0, (0.34510, 0.35161)),
            (6500.0, (0.31352, 0.32363)),
            (10000.0, (0.28063, 0.28828)),
        ] {
            close(xy(blackbody(kelvin)), wanted, 2e-4);
        }
    }

    #[test]
    fn illuminants_have_luminance_one() {
        let white = Spectrum::named("stdillum-D65").unwrap().to_illuminant();
        assert!((white.0 - glam::Vec3::ONE).abs().max_element() < 2e-3, "{white:?}");
        for kelvin in [1e-30, 500.0, 1000.0, 2700.0, 6500.0, 1e5, 1e30] {
            let rgb = Spectrum::Blackbody(kelvin).to_illuminant();
            assert!(rgb.is_finite() && (rgb.luminance() - 1.0).abs() < 1e-4, "{kelvin}: {rgb:?}");
            assert!(rgb.min_channel() >= 0.0);
        }
        let warm = Spectrum::Blackbody(2700.0).to_illuminant();
        assert!(warm[0] > warm[1] && warm[1] > warm[2]);
        assert!(Spectrum::Samples([(400.0, 0.0), (700.0, 0.0)].into()).to_illuminant().is_black());
        assert!(Spectrum::Samples([(100.0, 1.0), (200.0, 1.0)].into()).to_illuminant().is_black());
        let rgb = Rgb::new(2.0, -1.0, 3.0);
        assert_eq!(Spectrum::Rgb(rgb).to_illuminant(), rgb);
    }

    #[test]
    fn glass_and_metal() {
        // n_d of SCHOTT's data sheets, at the helium line.
        for (name, wanted) in [
            ("glass-BK7", 1.51680),
            ("glass-BAF10", 1.67003),
            ("glass-FK51A", 1.48656),
            ("glass-LASF9", 1.85025),
            ("glass-SF5", 1.67270),
            ("glass-SF10", 1.72825),
            ("glass-SF11", 1.78472),
        ] {
            assert!((dispersion::glass(name, 587.5618).unwrap() - wanted).abs() < 1e-5, "{name}");
            assert!((f64::from(Spectrum::named(name).unwrap().to_eta()) - wanted).abs() < 3e-4, "{name}");
        }
        assert!((dispersion::magnesium_oxide(589.3) - 1.7377).abs() < 5e-4);
        assert!((dispersion::titanium_dioxide(589.3) - 2.613).abs() < 2e-3);
        // Reflectance at normal incidence: gold is yellow, copper red, silver and aluminium grey and bright.
        let reflectance = |metal: &str| {
            let part = |p: &str| Spectrum::named(&format!("metal-{metal}-{p}")).unwrap().to_unbounded();
            let (n, k) = (part("eta"), part("k"));
            [0, 1, 2].map(|c| ((n[c] - 1.0).powi(2) + k[c].powi(2)) / ((n[c] + 1.0).powi(2) + k[c].powi(2)))
        };
        let (gold, copper, silver, aluminium) =
            (reflectance("Au"), reflectance("Cu"), reflectance("Ag"), reflectance("Al"));
        assert!(gold[0] > 0.9 && gold[1] > 0.6 && gold[2] < 0.5, "{gold:?}");
        assert!(copper[0] > 0.85 && copper[1] < 0.75 && copper[2] < 0.65, "{copper:?}");
        assert!(silver.iter().all(|r| *r > 0.94), "{silver:?}");
        assert!(aluminium.iter().all(|r| (0.88..0.95).contains(r)), "{aluminium:?}");
    }

    #[test]
    fn every_name_is_known() {
        for name in named_spectrum_names() {
            let spectrum = Spectrum::named(name).unwrap_or_else(|| panic!("{name}"));
            assert!(spectrum.to_albedo().is_finite() && spectrum.to_unbounded().min_channel() >= 0.0, "{name}");
        }
        assert_eq!(Spectrum::named("canon_eos_100d_r"), None);
        assert_eq!(Spectrum::named("metal-Xx-eta"), None);
    }
}
