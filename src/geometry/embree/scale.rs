//! The units that Embree is given.
//!
//! Embree's triangle test (Plücker coordinates; `kernels/geometry/triangle_intersector_pluecker.h`) knows two limits. Four times the area of a triangle
//! as the ray sees it counts as zero below 1e-18, and then the hit is at a corner: so it is everywhere in a scene of less than some 1e-9 units. And a
//! product of three lengths overflows where triangles are larger than some 1e12 units: they block no segment then, and none of them is the
//! nearest. So a space whose coordinates are all small is handed over in units in which the largest of them is between 1 and 2, and one that
//! reaches far in units in which it is between 2^38 and 2^39. The factor is a power of two: it rounds nothing.
//!
//! Render space has one, and each prototype one of its own, because an instance may be what makes a scene small. All structures share them. Rays'
//! distances are in the units of render space; a direction is longer in a prototype by the ratio of the factors, by which the instance's linear part
//! is larger.
//!
//! A scene may hold things 21 decades apart (`MAX_COORDINATE` and a millimetre), Embree's test spans about as much: where a scene reaches to 1e18
//! units, triangles of less than some 2e-3 units have a corner for every hit.

use super::boxes::{Bounds, Boxes};

/// Spaces that reach this far are left as they are, and no vertex is copied: there only triangles of less than 1e-6 of the space can be lost.
const SMALL: f32 = 1.0 / 1024.0;

/// Spaces that reach farther are made smaller. A distance times a normal is at most 84 times the cube of the largest coordinate.
const LARGE: f32 = (1u64 << 39) as f32;

/// The largest binary exponent of a factor. The rest of the renderer is right down to scenes of 2^-60 units.
const MOST: i32 = 64;

/// A power of two by which a space's lengths are multiplied for Embree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// From the space's units to Embree's.
    pub to_embree: f32,
    /// The inverse.
    pub from_embree: f32,
}

impl Scale {
    /// No scaling.
    pub const ONE: Self = Self { to_embree: 1.0, from_embree: 1.0 };

    /// What suits a space within this box.
    fn of_box(bounds: Option<Bounds>) -> Self {
        let largest = bounds.map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element());
        let exponent = largest.log2().floor() as i32;
        let exponent = match largest {
            0.0 | SMALL..LARGE => 0,
            ..SMALL => (-exponent).min(MOST),
            _ => 38 - exponent,
        };
        Self { to_embree: 2f32.powi(exponent), from_embree: 2f32.powi(-exponent) }
    }
}

/// The factors of all spaces of a geometry.
pub(super) struct Scales {
    /// Render space's.
    pub render: Scale,
    /// Those of the prototypes, in their order.
    pub prototypes: Vec<Scale>,
}

impl Scales {
    /// What suits what has these boxes.
    pub fn new(boxes: &Boxes) -> Self {
        let prototypes = boxes.prototypes.iter().copied().map(Scale::of_box).collect();
        Self { render: Scale::of_box(boxes.whole()), prototypes }
    }
}
