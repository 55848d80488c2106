//! What a lens that is described surface by surface comes to as a thin lens: the nearest kin of pbrt-v4's `realistic` camera.
//!
//! The text has four numbers for each surface, from the front to the film: radius of curvature, thickness up to the next surface, index of refraction
//! behind it, and diameter, in millimetres; a radius of 0 is the aperture stop (pbrt-v4, section 5.4.1 of the third edition). Rays close to the axis, as
//! (height, slope), change linearly at each: Hecht, "Optics", section 6.2.1.

use std::path::Path;

use crate::scene::{SceneError, SceneErrorKind, Span};
use crate::system::input::read_regular;

/// A description is a few lines: more than this is not one.
const MAX_BYTES: u64 = 1 << 20;

/// A lens as far as rays close to its axis go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prescription {
    /// Focal length in millimetres.
    pub focal_length: f32,
    /// Height at which a ray parallel to the axis has to enter to pass the stop at the height 1.
    pub pupil_magnification: f32,
    /// The stop's diameter in millimetres, as the description has it.
    pub stop_diameter: f32,
}

impl Prescription {
    /// That of the file, which `span` names.
    ///
    /// # Errors
    /// The file cannot be read, is not made of fours of numbers, or does not focus.
    pub fn read(path: &Path, span: Span) -> Result<Self, Box<SceneError>> {
        let fail = |reason: String| SceneError::at(span, SceneErrorKind::File { path: path.to_owned(), reason });
        let bytes = read_regular(path, MAX_BYTES).map_err(|e| fail(e.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| fail("it is not text".to_owned()))?;
        Self::parse(&text).map_err(fail)
    }

    /// That of the text of a file.
    pub fn parse(text: &str) -> Result<Self, String> {
        let words = text.lines().flat_map(|line| line.split('#').next().unwrap_or("").split_whitespace());
        let numbers = words
            .map(|word| {
                word.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(|| format!("\"{word}\" is no number"))
            })
            .collect::<Result<Vec<f64>, String>>()?;
        if numbers.is_empty() || !numbers.len().is_multiple_of(4) {
            return Err(format!("{} numbers are not four for each surface of a lens", numbers.len()));
        }
        // A ray parallel to the axis, from the front.
        let (mut height, mut slope, mut index) = (1.0f64, 0.0f64, 1.0f64);
        let (mut at_stop, mut stop_diameter) = (1.0, 0.0);
        for surface in numbers.chunks_exact(4) {
            let [radius, thickness, eta, diameter] = [surface[0], surface[1], surface[2], surface[3]];
            if radius == 0.0 {
                (at_stop, stop_diameter) = (height, diameter);
            } else {
                // pbrt's files have 0 for air, at the stop above all.
                let behind = if eta == 0.0 { 1.0 } else { eta };
                slope = (index * slope - height * (behind - index) / radius) / behind;
                index = behind;
            }
            height += slope * thickness;
        }
        // In single precision, as they are used: there a length of 1e-50 is none.
        let [focal_length, pupil_magnification] = [(-1.0 / slope) as f32, (1.0 / at_stop) as f32];
        if ![focal_length, pupil_magnification].iter().all(|x| *x > 0.0 && x.is_finite()) {
            return Err("the lens does not focus light that comes from afar".to_owned());
        }
        let stop_diameter = stop_diameter as f32;
        if !(stop_diameter >= 0.0 && stop_diameter.is_finite()) {
            return Err("the diameter of the lens's stop is negative or too large".to_owned());
        }
        Ok(Self { focal_length, pupil_magnification, stop_diameter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_lens_has_the_lensmakers_focal_length() {
        // Biconvex, n = 1.5, R = 100, thickness 10; the stop behind it.
        let text = "# a lens\n100 10 1.5 20\n-100 5 1 20 # its back\n0 80 0 8\n";
        let lens = Prescription::parse(text).expect("a lens");
        let power = 0.5 * (2.0 / 100.0 - 0.5 * 10.0 / (1.5 * 100.0 * 100.0));
        assert!((lens.focal_length - 1.0 / power as f32).abs() < 1e-3, "{lens:?}");
        // The front vertex is where the ray enters; 5 behind the back it has come down by the back focal distance's share.
        let back = 1.0 - 10.0 * 0.5 / (1.5 * 100.0);
        assert!((lens.pupil_magnification - 1.0 / (back - 5.0 * power) as f32).abs() < 1e-4, "{lens:?}");
        assert_eq!(lens.stop_diameter, 8.0);
    }

    #[test]
    fn what_is_no_lens_is_refused() {
        for text in [
            "",
            "1 2 3",
            "1 2 3 nan",
            "1 2 3 x",
            "0 10 0 5",
            "-100 10 1.5 20 100 5 1 20",
            "1e-50 10 1.5 20",
            "1e60 10 1.5 20",
            "0 0 0 -1 100 5 2 20",
            "0 0 0 1e39 100 5 2 20",
        ] {
            assert!(Prescription::parse(text).is_err(), "{text}");
        }
    }
}
