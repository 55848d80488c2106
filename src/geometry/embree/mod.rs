//! The Embree backend: a [`Geometry`] as Embree scenes, and the three questions put to them.
//!
//! Two kinds of structures, each only over what it is asked for: `opaque` holds the shapes that rays meet (with `apart`, where some of them are
//! near few rays: `kinds`), `boundaries` those of material `interface` (absent when there are none). Triangles and ray-facing curves are Embree's own; quadrics, patches and
//! ribbons are user geometry that calls the shapes' own intersection, so that both backends find the same points. Embree's
//! robust mode makes triangles watertight. Small scenes are given in larger units and vast ones in smaller (`scale`).
//!
//! Assumes what `ffi/embree` promises: no panic and no error crosses into a query.

mod adapters;
mod bounded;
mod boxes;
mod kinds;
mod motion;
mod scale;
mod structure;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use ::embree::{Candidate, Device, Error};

use self::bounded::Bounded;
use self::boxes::{Bounds, Boxes};
use self::kinds::{Kind, Members};
use self::scale::{Scale, Scales};
use self::structure::Structure;
use super::shape::{Shape, ShapeKind};
use super::trace::put_in_order;
use super::trace::{Opacity, TraceError};
use super::{BoundaryCrossing, Geometry, Ray, RayHit};
use crate::system::memory;

/// Acceleration structures in Embree.
pub struct EmbreeTracer {
    geometry: Arc<Geometry>,
    opaque: Structure,
    /// What is opaque too, but near few rays.
    apart: Vec<Bounded>,
    boundaries: Option<Bounded>,
    /// From render space to Embree's units.
    scale: Scale,
    device: Arc<Device>,
}

impl From<Error> for TraceError {
    fn from(error: Error) -> Self {
        let text = error.to_string();
        match error {
            Error::Memory(_) => Self::Memory(text),
            Error::Other(_) => Self::Library(text),
        }
    }
}

impl EmbreeTracer {
    /// Builds the structures with as many threads as the current rayon pool has. `opacity` is asked about shapes with
    /// [`Shape::has_opacity`]; without it they are opaque.
    ///
    /// # Errors
    /// What Embree said: out of memory, an unsupported CPU, vertex numbers out of range.
    pub fn build(geometry: Arc<Geometry>, opacity: Option<Arc<dyn Opacity>>) -> Result<Self, TraceError> {
        let boxes = Boxes::new(&geometry);
        let apart = kinds::apart(&geometry, &boxes);
        Self::with_apart(geometry, opacity, &boxes, &apart)
    }

    /// The same with these kinds apart, each with a box around it.
    fn with_apart(
        geometry: Arc<Geometry>,
        opacity: Option<Arc<dyn Opacity>>,
        boxes: &Boxes,
        apart: &[(Kind, Bounds)],
    ) -> Result<Self, TraceError> {
        let device = Device::new(rayon::current_num_threads())?;
        if memory::limit().is_some() {
            let left = memory::available().unwrap_or(u64::MAX);
            device.limit_memory(usize::try_from(left).unwrap_or(usize::MAX));
        }
        let scales = Scales::new(boxes);
        let build = |members: Members| Structure::build(&device, &geometry, opacity.as_ref(), &scales, members);
        let is_together = |kind: &Kind| apart.iter().all(|(other, _)| other != kind);
        let together: Vec<Kind> = Kind::ALL.into_iter().filter(is_together).collect();
        let opaque = build(Members::Opaque(&together))?;
        let apart = apart.iter().map(|&(kind, bounds)| Ok(Bounded::new(build(Members::Opaque(&[kind]))?, bounds)));
        let apart = apart.collect::<Result<_, Error>>()?;
        let boundaries = match geometry.bounds_of(|shape| shape.is_boundary) {
            Some(bounds) => Some(Bounded::new(build(Members::Boundaries)?, bounds)),
            None => None,
        };
        Ok(Self { geometry, opaque, apart, boundaries, scale: scales.render, device })
    }

    /// The closest hit before `ray.t_max` on anything but boundaries. A ray with a NaN hits nothing.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<RayHit> {
        let mut closest = self.closest_of(&self.opaque, ray);
        for all in &self.apart {
            let nearer = Ray { t_max: closest.map_or(ray.t_max, |hit| hit.t), ..*ray };
            if all.may_meet(&nearer) {
                closest = self.closest_of(&all.structure, &nearer).or(closest);
            }
        }
        closest
    }

    #[inline]
    fn closest_of(&self, structure: &Structure, ray: &Ray) -> Option<RayHit> {
        let hit = structure.scene.intersect(&self.embree_ray(ray))?;
        let (shape, instance) = structure.resolve(hit.geometry, hit.instance);
        let uv = shape_uv(&self.geometry.shapes[shape.0 as usize], hit.uv);
        Some(RayHit { t: hit.t * self.scale.from_embree, shape, instance, primitive: hit.primitive, uv })
    }

    /// Whether anything but boundaries lies before `ray.t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let is_in_the_way = |structure: &Structure| structure.scene.occluded(&self.embree_ray(ray));
        is_in_the_way(&self.opaque) || self.apart.iter().any(|all| all.may_meet(ray) && is_in_the_way(&all.structure))
    }

    /// Whether `ray` may cross a boundary.
    #[inline]
    pub fn may_cross(&self, ray: &Ray) -> bool {
        self.boundaries.as_ref().is_some_and(|all| all.may_meet(ray))
    }

    /// All boundary crossings in [0, `ray.t_max`) in the order of [`put_in_order`].
    pub fn boundaries(&self, ray: &Ray, crossings: &mut Vec<BoundaryCrossing>) {
        crossings.clear();
        let Some(Bounded { structure, .. }) = self.boundaries.as_ref().filter(|all| all.may_meet(ray)) else {
            return;
        };
        structure.scene.collect(&self.embree_ray(ray), &mut |candidate| {
            let (shape, instance) = structure.resolve(candidate.hit.geometry, candidate.hit.instance);
            let entering = is_entering(&self.geometry.shapes[shape.0 as usize], candidate);
            let t = candidate.hit.t * self.scale.from_embree;
            crossings.push(BoundaryCrossing { t, shape, instance, entering });
        });
        put_in_order(crossings);
    }

    /// Bytes that Embree holds. Vertices and indices are mostly read where [`Geometry`] has them and do not count.
    pub fn memory(&self) -> usize {
        self.device.memory()
    }

    /// The ray in Embree's units. Embree's interval is closed at its far end, [`Ray`]'s is open.
    #[inline]
    fn embree_ray(&self, ray: &Ray) -> ::embree::Ray {
        let t_max = if ray.t_max.is_finite() { ray.t_max.next_down() } else { ray.t_max };
        ::embree::Ray {
            origin: (ray.origin * self.scale.to_embree).to_array(),
            direction: ray.direction.to_array(),
            t_min: 0.0,
            t_max: t_max * self.scale.to_embree,
            time: ray.time,
            id: ray.opacity_seed,
        }
    }
}

/// Whether Embree has this shape's primitives of its own, as flat curves.
#[inline]
fn is_embree_curve(shape: &Shape) -> bool {
    matches!(&shape.kind, ShapeKind::Curves(curves) if curves.kind != super::curve::CurveKind::Ribbon)
}

/// The shape's parameters of Embree's: a flat curve has u along and v across in −1..=1 there, u across and v along here.
#[inline]
fn shape_uv(shape: &Shape, uv: [f32; 2]) -> [f32; 2] {
    if is_embree_curve(shape) { [(0.5 + 0.5 * uv[1]).clamp(0.0, 1.0), uv[0].clamp(0.0, 1.0)] } else { uv }
}

/// Whether the ray goes against the oriented geometric normal. Signs are compared in the shape's space: n · d is the same
/// there and in render space (up to a positive factor), because normals transform by the inverse transpose.
fn is_entering(shape: &Shape, candidate: &Candidate) -> bool {
    let direction = candidate.direction.into();
    let uv = shape_uv(shape, candidate.hit.uv);
    shape.oriented_normal(candidate.hit.primitive, uv, direction).dot(direction) < 0.0
}
