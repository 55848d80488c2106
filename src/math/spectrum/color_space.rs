//! The RGB colour spaces that scene files may use, and their conversion to linear Rec. 709. Each is defined by the xy
//! chromaticities of its primaries and white (SMPTE RP 177: the matrix follows from them).

use std::sync::OnceLock;

use glam::{DMat3, DVec3, Mat3, Vec3};

use crate::math::Rgb;

/// An RGB colour space, ready to convert to linear Rec. 709.
#[derive(Clone, Debug)]
pub struct RgbColorSpace {
    /// Its name in pbrt-v4.
    pub name: &'static str,
    /// `None` for Rec. 709 itself: its values pass bit for bit.
    to_rec709: Option<DMat3>,
}

/// xy of D65, the white of sRGB (Rec. 709), DCI-P3 as pbrt has it, and Rec. 2020.
const D65: [f64; 2] = [0.3127, 0.3290];
/// xy of the white of ACES (SMPTE ST 2065-1), near D60.
const ACES_WHITE: [f64; 2] = [0.32168, 0.33767];
const REC709: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
const DCI_P3: [[f64; 2]; 3] = [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]];
const REC2020: [[f64; 2]; 3] = [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]];
const ACES2065_1: [[f64; 2]; 3] = [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770]];

impl RgbColorSpace {
    /// The names that pbrt-v4's `ColorSpace` knows.
    pub const NAMES: [&'static str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];

    /// The colour space called `name` in pbrt-v4, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        static SPACES: OnceLock<[RgbColorSpace; 4]> = OnceLock::new();
        let spaces = SPACES.get_or_init(|| {
            let space = |name, primaries, white| Self { name, to_rec709: Some(between(primaries, white)) };
            [
                Self { name: Self::NAMES[0], to_rec709: None },
                space(Self::NAMES[1], DCI_P3, D65),
                space(Self::NAMES[2], REC2020, D65),
                space(Self::NAMES[3], ACES2065_1, ACES_WHITE),
            ]
        });
        spaces.iter().find(|s| s.name.eq_ignore_ascii_case(name))
    }

    /// sRGB's primaries, linear: pbrt's default.
    pub fn srgb() -> &'static Self {
        static SRGB: RgbColorSpace = RgbColorSpace { name: RgbColorSpace::NAMES[0], to_rec709: None };
        &SRGB
    }

    /// The linear Rec. 709 values of `rgb`, unclamped: colours outside its gamut get negative channels. The space's
    /// white becomes Rec. 709's white (von Kries adaptation with the Bradford matrix where the whites differ), so that
    /// a reflectance of 1 stays 1.
    pub fn to_rec709(&self, rgb: Rgb) -> Rgb {
        match &self.to_rec709 {
            None => rgb,
            Some(matrix) => {
                let v = *matrix * DVec3::from(rgb.0);
                Rgb(Vec3::new(v.x as f32, v.y as f32, v.z as f32))
            }
        }
    }
}

/// What colours of a space of stated primaries are multiplied by to be in linear Rec. 709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToRec709 {
    /// They are in it already.
    Same,
    /// This.
    Matrix(Mat3),
    /// What is stated makes no space of colours.
    NoSpace,
}

impl ToRec709 {
    /// From the space with these xy of red, green, blue and white.
    pub fn from_chromaticities(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Self {
        /// Files give a few decimals.
        const ROUNDED: f64 = 2e-3;
        let all = primaries.into_iter().chain([white]).zip(REC709.into_iter().chain([D65]));
        if all.clone().all(|(a, b)| (a[0] - b[0]).abs() < ROUNDED && (a[1] - b[1]).abs() < ROUNDED) {
            return Self::Same;
        }
        if !all.clone().all(|(a, _)| a.iter().all(|x| x.abs() <= 2.0)) || white[1] < 0.01 {
            return Self::NoSpace;
        }
        let [r, g, b] = primaries;
        let area = (g[0] - r[0]) * (b[1] - r[1]) - (b[0] - r[0]) * (g[1] - r[1]);
        let matrix = between(primaries, white).as_mat3();
        let is_space = area.abs() > 1e-3 && matrix.to_cols_array().iter().all(|x| x.abs() < 100.0);
        if is_space { Self::Matrix(matrix) } else { Self::NoSpace }
    }

    /// The matrix, where there is one.
    pub fn matrix(self) -> Option<Mat3> {
        if let Self::Matrix(matrix) = self { Some(matrix) } else { None }
    }
}

/// The matrix from XYZ to linear Rec. 709.
pub fn xyz_to_rec709() -> &'static DMat3 {
    static MATRIX: OnceLock<DMat3> = OnceLock::new();
    MATRIX.get_or_init(|| rgb_to_xyz(REC709, D65).inverse())
}

fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// RGB to XYZ: the primaries' columns scaled so that RGB (1, 1, 1) is the white with Y = 1.
fn rgb_to_xyz([r, g, b]: [[f64; 2]; 3], white: [f64; 2]) -> DMat3 {
    // Columns x, y, z of each primary, not x/y, 1, z/y: ACES' green has z = 0 and its blue a negative y.
    let column = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
    let primaries = DMat3::from_cols(column(r), column(g), column(b));
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz(white))
}

/// From the space of `primaries` and `white` to Rec. 709.
fn between(primaries: [[f64; 2]; 3], white: [f64; 2]) -> DMat3 {
    *xyz_to_rec709() * adapt(white) * rgb_to_xyz(primaries, white)
}

/// In linear Rec. 709: makes what has the chromaticity `white` white.
pub fn white_balance(white: [f64; 2]) -> Mat3 {
    (*xyz_to_rec709() * adapt(white) * xyz_to_rec709().inverse()).as_mat3()
}

/// In XYZ: from the eye that takes `white` for white to the one that takes D65 so.
fn adapt(white: [f64; 2]) -> DMat3 {
    // Lam 1985, the Bradford cone responses.
    let bradford = DMat3::from_cols_array(&[
        0.8951, -0.7502, 0.0389, //
        0.2664, 1.7135, -0.0685, //
        -0.1614, 0.0367, 1.0296,
    ]);
    let gain = (bradford * xyz(D65)) / (bradford * xyz(white));
    bradford.inverse() * DMat3::from_diagonal(gain) * bradford
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whites_stay_white_and_spaces_differ() {
        for name in RgbColorSpace::NAMES {
            let space = RgbColorSpace::named(name).unwrap();
            let white = space.to_rec709(Rgb::WHITE);
            assert!((white.0 - Vec3::ONE).abs().max_element() < 1e-6, "{name}: {white:?}");
        }
        assert!(RgbColorSpace::named("SRGB").is_some());
        assert!(RgbColorSpace::named("adobe").is_none());
    }

    #[test]
    fn any_primaries_make_a_space_or_none() {
        let of = ToRec709::from_chromaticities;
        assert_eq!(of([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], [0.3127, 0.329]), ToRec709::Same);
        let matrix = of(REC2020, D65).matrix().expect("it is another space");
        let green = RgbColorSpace::named("rec2020").unwrap().to_rec709(Rgb::new(0.0, 1.0, 0.0));
        assert!((matrix * Vec3::Y - green.0).abs().max_element() < 1e-6);
        let nowhere = [f64::NAN; 2];
        for (primaries, white) in [
            ([[0.0; 2]; 3], [0.0; 2]),
            ([[0.3; 2]; 3], D65),
            ([nowhere; 3], nowhere),
            (REC2020, [0.3, 0.0]),
            ([[f64::MAX; 2]; 3], D65),
        ] {
            assert_eq!(of(primaries, white), ToRec709::NoSpace, "{primaries:?} {white:?}");
        }
    }

    #[test]
    fn published_matrices() {
        // ITU-R BT.2087's inverse: Rec. 2020 red in Rec. 709.
        let red = RgbColorSpace::named("rec2020").unwrap().to_rec709(Rgb::new(1.0, 0.0, 0.0));
        assert!((red.0 - Vec3::new(1.6605, -0.1246, -0.0182)).abs().max_element() < 2e-4, "{red:?}");
        // IEC 61966-2-1: luminance row of sRGB.
        let to_xyz = xyz_to_rec709().inverse();
        for (column, y) in [0.2126, 0.7152, 0.0722].into_iter().enumerate() {
            assert!((to_xyz.col(column).y - y).abs() < 1e-4);
        }
        // ACES to linear Rec. 709 with Bradford (the ACES project's published matrix).
        let red = RgbColorSpace::named("aces2065-1").unwrap().to_rec709(Rgb::new(1.0, 0.0, 0.0));
        assert!((red.0 - Vec3::new(2.5217, -0.2766, -0.0154)).abs().max_element() < 2e-3, "{red:?}");
    }
}
