//! What colour the light is that a sensor is balanced for.

use glam::Mat3;

use super::{blackbody, color_space, observe};

/// Below this correlated colour temperature, in kelvin, there is no daylight; above the other its formula ends.
const DAYLIGHT: std::ops::RangeInclusive<f64> = 4000.0..=25_000.0;

/// The constant of Planck's law changed since daylight was defined.
const C2_NOW_AND_THEN: f64 = 1.4388 / 1.4380;

/// In linear Rec. 709: makes daylight of this temperature in kelvin (below 4000 a black body, as in pbrt-v4) white. `None` outside 1000 to 25000.
pub fn white_balance(kelvin: f32) -> Option<Mat3> {
    let kelvin = f64::from(kelvin) * C2_NOW_AND_THEN;
    if !(1000.0..=*DAYLIGHT.end() * C2_NOW_AND_THEN).contains(&kelvin) {
        return None;
    }
    let white = if kelvin < *DAYLIGHT.start() {
        let xyz = observe(blackbody(kelvin));
        let sum = xyz.x + xyz.y + xyz.z;
        [xyz.x / sum, xyz.y / sum]
    } else {
        daylight(kelvin)
    };
    Some(color_space::white_balance(white))
}

/// xy of daylight of a correlated colour temperature. Source: CIE 15:2004, section 3.1, equations 3.2 to 3.4.
fn daylight(kelvin: f64) -> [f64; 2] {
    let inverse = 1.0 / kelvin;
    let [c3, c2, c1, c0] = if kelvin <= 7000.0 {
        [-4.6070e9, 2.9678e6, 0.09911e3, 0.244063]
    } else {
        [-2.0064e9, 1.9018e6, 0.24748e3, 0.237040]
    };
    let x = ((c3 * inverse + c2) * inverse + c1) * inverse + c0;
    [x, (-3.0 * x + 2.870) * x - 0.275]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::spectrum::Spectrum;

    #[test]
    fn published_chromaticities() {
        // CIE 15:2004, table 11.3: D50, D55 and D65.
        for (kelvin, wanted) in
            [(5000.0, [0.34567, 0.35850]), (5500.0, [0.33242, 0.34743]), (6500.0, [0.31272, 0.32902])]
        {
            let [x, y] = daylight(kelvin * C2_NOW_AND_THEN);
            assert!((x - wanted[0]).abs() < 2e-4 && (y - wanted[1]).abs() < 2e-4, "{kelvin}: {x} {y}");
        }
    }

    #[test]
    fn what_it_is_balanced_for_is_white() {
        let even = white_balance(6500.0).expect("within") * Vec3::ONE;
        assert!((even - Vec3::ONE).abs().max_element() < 2e-3, "{even:?}");
        let lamp = Spectrum::Blackbody(3000.0).to_illuminant();
        let seen = white_balance(3000.0).expect("within") * lamp.0;
        assert!(seen.max_element() < 1.01 * seen.min_element(), "{seen:?}");
        let cold = white_balance(3000.0).expect("within") * Vec3::ONE;
        assert!(cold.z > 1.5 * cold.x, "{cold:?}");
        for kelvin in [0.0, -5.0, 900.0, 26_000.0, f32::NAN, f32::INFINITY] {
            assert!(white_balance(kelvin).is_none(), "{kelvin}");
        }
        assert!((1..=25).all(|k| white_balance(1000.0 * k as f32).is_some_and(|m| m.is_finite())));
    }
}
