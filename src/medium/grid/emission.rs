//! What grids emit: a constant colour, scaled by a grid, or black bodies by a grid of temperatures.
//! Source: Planck's law; pbrt-v4 (section 11.4) for emission = μ_a L_e.

use glam::DVec3;

use super::field::{AnyGrid, Field, ScalarGrid};
use super::map::IndexMap;
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;

/// What a temperature's radiance is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BlackbodyScale {
    /// As pbrt-v4: Planck's curve divided by its own peak, wherever that lies, as a sensor of [`PHOTOMETRIC`] sees it.
    Peak,
    /// Luminance relative to that of this temperature in kelvin.
    Relative(f32),
}

/// ∫ ȳ dλ of the CIE's 1931 observer, in nm. pbrt-v4's sensor (`PixelSensor::ToSensorRGB`) integrates radiance times ȳ and does not divide by this: for
/// lights and for most media the spectrum is divided by it when it is made. What `GridMedium` and `NanoVDBMedium` emit by temperature, and the `Le` of
/// `RGBGridMedium`, is not, and so comes out this many times as bright as the numbers say.
pub const PHOTOMETRIC: f32 = 106.856_895;

/// Second radiation constant hc/k in nm K.
const C2: f64 = 1.438_776_877e7;
/// Below this, in kelvin, nothing glows (as in pbrt-v4).
const COLD: f32 = 100.0;

/// Above this, in kelvin, bodies glow no more: a table ends there.
pub const HOTTEST: f32 = 1e6;

/// Planck's law without its constant factor, λ in nm.
fn planck(lambda: f64, kelvin: f64) -> f64 {
    1e15 / (lambda.powi(5) * (C2 / (lambda * kelvin)).exp_m1())
}

/// The CIE 1931 ȳ(λ) by the two-lobe fit of Wyman, Sloan & Shirley 2013, λ in nm.
fn y_bar(lambda: f64) -> f64 {
    let lobe = |height: f64, centre: f64, below: f64, above: f64| {
        let x = (lambda - centre) * if lambda < centre { below } else { above };
        height * (-0.5 * x * x).exp()
    };
    lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322)
}

/// Mean of Planck's curve under ȳ: the luminance of a spectrum whose constant 1 has luminance 1. Steps of 5 nm: both curves
/// are smooth and ȳ vanishes at the ends, so finer ones change nothing that f32 could show.
fn luminance(kelvin: f64) -> f64 {
    let (mut sum, mut norm) = (0.0, 0.0);
    for nm in (360..=830).step_by(5) {
        let y = y_bar(f64::from(nm));
        sum += y * planck(f64::from(nm), kelvin);
        norm += y;
    }
    sum / norm
}

/// Radiance of black bodies over temperature, as a table.
#[derive(Debug)]
pub struct BlackbodyTable {
    /// From [`COLD`] up, evenly spaced in ln T: radiance is nearly a power of T over a step, however hot the hottest voxel is.
    entries: Vec<Rgb>,
    /// Entries per unit of ln T.
    density: f32,
}

impl BlackbodyTable {
    /// A table up to `hottest` kelvin.
    pub fn new(hottest: f32, scale: BlackbodyScale) -> Self {
        const ENTRIES: usize = 4096;
        let hottest = hottest.clamp(COLD * 1.01, HOTTEST);
        let step = (hottest / COLD).ln() / (ENTRIES - 1) as f32;
        let fixed_reference = match scale {
            BlackbodyScale::Peak => None,
            BlackbodyScale::Relative(to) => Some(luminance(f64::from(to.max(COLD)))),
        };
        let seen = if fixed_reference.is_some() { 1.0 } else { PHOTOMETRIC };
        let entries = (0..ENTRIES)
            .map(|i| {
                let kelvin = COLD * (step * i as f32).exp();
                let t = f64::from(kelvin);
                // Wien's law: λ T = 2.897771955e6 nm K at the peak.
                let reference = fixed_reference.unwrap_or_else(|| planck(2.897_771_955e6 / t, t));
                let chroma = Spectrum::Blackbody(kelvin).to_illuminant();
                (chroma * (luminance(t) / reference) as f32 * seen).map(|c| if c.is_finite() { c } else { 0.0 })
            })
            .collect();
        Self { entries, density: 1.0 / step }
    }

    /// The radiance at `kelvin`; none below 100 K.
    #[inline]
    pub fn at(&self, kelvin: f32) -> Rgb {
        if kelvin <= COLD {
            return Rgb::BLACK;
        }
        let x = ((kelvin / COLD).ln() * self.density).clamp(0.0, (self.entries.len() - 1) as f32);
        let i = (x as usize).min(self.entries.len() - 2);
        self.entries[i].lerp(self.entries[i + 1], x - i as f32)
    }
}

/// What makes L_e vary.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one a medium")]
pub enum EmissionShape {
    /// The same everywhere.
    Constant,
    /// Proportional to a grid.
    Grid(Field<AnyGrid>),
    /// Black bodies; the field gives kelvin. With an optional scale grid.
    Temperature {
        /// Kelvin.
        kelvin: Field<ScalarGrid>,
        /// Radiance by temperature.
        table: BlackbodyTable,
        /// Factor by place.
        scale: Option<Field<AnyGrid>>,
    },
}

/// Emission of a grid medium.
#[derive(Debug)]
pub struct Emission {
    /// Radiance L_e in W/(m² sr), or its factor.
    pub radiance: Rgb,
    /// What makes it vary.
    pub shape: EmissionShape,
    /// Given per unit length, instead of multiplied by μ_a.
    pub direct: bool,
}

impl Emission {
    /// L_e (or, if direct, the emission per unit length) at a point; `index_of` gives its index position under a grid's map.
    #[inline]
    pub fn at(&self, index_of: impl Fn(&IndexMap) -> Option<DVec3>) -> Rgb {
        match &self.shape {
            EmissionShape::Constant => self.radiance,
            EmissionShape::Grid(field) => self.radiance * Rgb(field.at_index(index_of(&field.map))),
            EmissionShape::Temperature { kelvin, table, scale } => {
                let t = index_of(&kelvin.map).map_or(0.0, |index| kelvin.at(index));
                if t <= COLD {
                    return Rgb::BLACK;
                }
                let glow = self.radiance * table.at(t);
                scale.as_ref().map_or(glow, |field| glow * Rgb(field.at_index(index_of(&field.map))))
            }
        }
    }

    /// Whether all its grids have this map.
    pub fn lies_on(&self, map: &IndexMap) -> bool {
        match &self.shape {
            EmissionShape::Constant => true,
            EmissionShape::Grid(field) => field.map == *map,
            EmissionShape::Temperature { kelvin, scale, .. } => {
                kelvin.map == *map && scale.as_ref().is_none_or(|field| field.map == *map)
            }
        }
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        match &self.shape {
            EmissionShape::Constant => 0,
            EmissionShape::Grid(field) => field.grid.memory(),
            EmissionShape::Temperature { kelvin, table, scale } => {
                kelvin.grid.memory()
                    + table.entries.len() * size_of::<Rgb>()
                    + scale.as_ref().map_or(0, |field| field.grid.memory())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_of_black_bodies_rises_as_known() {
        // Ratio of luminances at 2000 K and 1000 K from Planck's law at 600 nm or so: exp(C2/λ (1/1000 − 1/2000)) ≈ 1.6e5.
        let ratio = luminance(2000.0) / luminance(1000.0);
        assert!((1.0e5..3.0e5).contains(&ratio), "{ratio}");
        // Luminance is monotone, and at the peak scale a body of 5500 K is close to 1 (its peak is in the green).
        let near_peak = luminance(5500.0) / planck(2.897_771_955e6 / 5500.0, 5500.0);
        assert!((0.95..1.0).contains(&near_peak), "{near_peak}");
        let at = |scale| f64::from(BlackbodyTable::new(6000.0, scale).at(5500.0).luminance());
        let (peak, relative) = (at(BlackbodyScale::Peak), at(BlackbodyScale::Relative(5500.0)));
        assert!(
            (peak / (106.856_895 * near_peak) - 1.0).abs() < 1e-3 && (relative - 1.0).abs() < 1e-3,
            "{peak} {relative}"
        );
    }
}
