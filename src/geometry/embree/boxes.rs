//! Boxes around what a geometry has, found once for all that is asked of them: units ([`super::scale`]) and what is apart ([`super::kinds`]).

use glam::Vec3;
use rayon::prelude::*;

use super::kinds::Kind;
use crate::geometry::build::MAX_COORDINATE;
use crate::geometry::extent::union;
use crate::geometry::{Geometry, ShapeId, ShapeKind};

/// Low and high corner.
pub(super) type Bounds = (Vec3, Vec3);

/// One for each kind, and one for boundaries.
type Slots = [Option<Bounds>; Kind::ALL.len() + 1];

/// Boxes, without what Embree leaves out.
pub(super) struct Boxes {
    /// Of each prototype in its own space; `None` where there is nothing in it.
    pub prototypes: Vec<Option<Bounds>>,
    /// In render space: what rays hit of each kind in the order of [`Kind::ALL`], boundaries that are no part of prototypes.
    slots: Slots,
}

impl Boxes {
    /// Of all that `geometry` has. Vertex numbers may still be out of range here.
    pub fn new(geometry: &Geometry) -> Self {
        let of_prototype =
            |shapes: &[ShapeId]| shapes.par_iter().filter_map(|&id| of_shape(geometry, id)).reduce_with(union);
        let prototypes: Vec<_> = geometry.prototypes.par_iter().map(|all| of_prototype(&all.shapes)).collect();
        let shapes = geometry.top_level.par_iter().filter_map(|&id| {
            let shape = &geometry.shapes[id.0 as usize];
            let slot = if shape.is_boundary { Kind::ALL.len() } else { Kind::of(shape) as usize };
            Some((slot, of_shape(geometry, id)?))
        });
        let instances = geometry.instances.par_iter().filter_map(|instance| {
            let (low, high) = prototypes[instance.prototype as usize]?;
            let bounds = Some(instance.transform.bounds(low, high)).filter(is_valid)?;
            Some((Kind::of_instance(instance) as usize, bounds))
        });
        let add = |mut slots: Slots, (slot, bounds): (usize, Bounds)| {
            slots[slot] = either(slots[slot], Some(bounds));
            slots
        };
        let join = |a: Slots, b: Slots| std::array::from_fn(|slot| either(a[slot], b[slot]));
        let slots = shapes.chain(instances).fold(Slots::default, add).reduce(Slots::default, join);
        Self { prototypes, slots }
    }

    /// Around what rays hit of that kind.
    pub fn of(&self, kind: Kind) -> Option<Bounds> {
        self.slots[kind as usize]
    }

    /// Around everything.
    pub fn whole(&self) -> Option<Bounds> {
        self.slots.iter().copied().fold(None, either)
    }
}

fn either(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    a.into_iter().chain(b).reduce(union)
}

/// The box around a shape in its space.
fn of_shape(geometry: &Geometry, id: ShapeId) -> Option<Bounds> {
    let shape = &geometry.shapes[id.0 as usize];
    match &shape.kind {
        ShapeKind::Triangles(mesh) => mesh.positions.iter().map(|&p| (p, p)).filter(is_valid).reduce(union),
        _ => (0..shape.primitive_count()).map(|primitive| shape.bounds(primitive)).filter(is_valid).reduce(union),
    }
}

/// Whether Embree takes in what has this box: it leaves out what is not a number or beyond 1.8e18.
fn is_valid((low, high): &Bounds) -> bool {
    let most = Vec3::splat(MAX_COORDINATE);
    (low.abs().cmple(most) & high.abs().cmple(most)).all()
}
