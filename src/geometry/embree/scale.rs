//! The units that Embree is given.
//!
//! Embree's triangle test (Plücker coordinates; `kernels/geometry/triangle_intersector_pluecker.h`) knows two limits. Four times the area of a triangle
//! as the ray sees it counts as zero below 1e-18, and then the hit is at a corner: so it is everywhere in a scene of less than some 1e-9 units. And a
//! product of three lengths overflows where triangles are larger than some 1e12 units: they block no segment then, and none of them is the
//! nearest. So a space whose coordinates are all small is handed over in units in which the largest of them is between 1 and 2, and one that
//! reaches far in units in which it is between 2^38 and 2^39. The factor is a power of two: it rounds nothing.
//!
//! Render space has one, and each prototype one of its own, because an instance may be what makes a scene small. Both structures share them. Rays'
//! distances are in the units of render space; a direction is longer in a prototype by the ratio of the factors, by which the instance's linear part
//! is larger.
//!
//! A scene may hold things 21 decades apart ([`MAX_COORDINATE`] and a millimetre), Embree's test spans about as much: where a scene reaches to 1e18
//! units, triangles of less than some 2e-3 units have a corner for every hit.

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::build::MAX_COORDINATE;
use crate::geometry::extent::union;
use crate::geometry::{Geometry, ShapeId, ShapeKind};

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
    fn of_box(bounds: Option<(Vec3, Vec3)>) -> Self {
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
    /// What suits a geometry.
    pub fn new(geometry: &Geometry) -> Self {
        let prototypes: Vec<_> =
            geometry.prototypes.par_iter().map(|prototype| box_around(geometry, &prototype.shapes)).collect();
        let instances = geometry.instances.par_iter().filter_map(|instance| {
            let (low, high) = prototypes[instance.prototype as usize]?;
            Some(instance.transform.bounds(low, high))
        });
        let instances = instances.filter(is_valid).reduce_with(union);
        let all = [box_around(geometry, &geometry.top_level), instances].into_iter().flatten().reduce(union);
        Self { render: Scale::of_box(all), prototypes: prototypes.into_iter().map(Scale::of_box).collect() }
    }
}

/// The box around shapes of one space. Vertex numbers may still be out of range here.
fn box_around(geometry: &Geometry, shapes: &[ShapeId]) -> Option<(Vec3, Vec3)> {
    let of_shape = |id: &ShapeId| {
        let shape = &geometry.shapes[id.0 as usize];
        match &shape.kind {
            ShapeKind::Triangles(mesh) => mesh.positions.iter().map(|&p| (p, p)).filter(is_valid).reduce(union),
            _ => (0..shape.primitive_count()).map(|primitive| shape.bounds(primitive)).filter(is_valid).reduce(union),
        }
    };
    shapes.par_iter().filter_map(of_shape).reduce_with(union)
}

/// Whether Embree takes in what has this box: it leaves out what is not a number or beyond 1.8e18.
fn is_valid((low, high): &(Vec3, Vec3)) -> bool {
    let most = Vec3::splat(MAX_COORDINATE);
    (low.abs().cmple(most) & high.abs().cmple(most)).all()
}
