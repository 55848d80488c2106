//! The Embree backend: a [`Geometry`] as Embree scenes, and the three questions put to them.
//!
//! Two structures, each only over what it is asked for: `opaque` holds the shapes that rays meet, `boundaries` those of
//! material `interface` (absent when there are none). Triangles and ray-facing curves are Embree's own; quadrics, patches and
//! ribbons are user geometry that calls the shapes' own intersection, so that both backends find the same points. Embree's
//! robust mode makes triangles watertight. Small scenes are given in larger units and vast ones in smaller (`scale`).
//!
//! Assumes what `ffi/embree` promises: no panic and no error crosses into a query.

mod adapters;
mod motion;
mod scale;
mod structure;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::Vec3;

use ::embree::{Candidate, Device, Error};

use self::scale::{Scale, Scales};
use self::structure::Structure;
use super::extent::within;
use super::shape::{Shape, ShapeKind};
use super::trace::put_in_order;
use super::trace::{Opacity, TraceError};
use super::{BoundaryCrossing, Geometry, Ray, RayHit};
use crate::system::memory;

/// Acceleration structures in Embree.
pub struct EmbreeTracer {
    geometry: Arc<Geometry>,
    opaque: Structure,
    boundaries: Option<Boundaries>,
    /// From render space to Embree's units.
    scale: Scale,
    device: Arc<Device>,
}

/// What rays cross. Many come nowhere near: asking Embree takes longer than finding that a ray passes all of it.
struct Boundaries {
    structure: Structure,
    /// A box around all of it, in render space.
    bounds: (Vec3, Vec3),
    /// The middle of a ball around that.
    middle: Vec3,
    /// The ball's radius, squared.
    radius_squared: f32,
}

impl Boundaries {
    fn new(structure: Structure, bounds: (Vec3, Vec3)) -> Self {
        let (low, high) = bounds;
        let half = 0.5 * (high - low);
        Self { structure, bounds, middle: low + half, radius_squared: 1.0001 * half.length_squared() }
    }

    /// Whether `ray` may come into the box. Most that do not are told by the ball, which takes no division.
    #[inline]
    fn may_meet(&self, ray: &Ray) -> bool {
        // Rounding of the difference below, which may be of large numbers.
        const ROUNDING: f32 = 1e-6;
        let to_middle = self.middle - ray.origin;
        let along = to_middle.dot(ray.direction);
        let distance_squared = to_middle.length_squared();
        // Also where the box has no end.
        let passes = distance_squared - along * along > self.radius_squared + ROUNDING * distance_squared;
        !passes && within(ray, self.bounds).is_some()
    }
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
        let device = Device::new(rayon::current_num_threads())?;
        if memory::limit().is_some() {
            let left = memory::available().unwrap_or(u64::MAX);
            device.limit_memory(usize::try_from(left).unwrap_or(usize::MAX));
        }
        let scales = Scales::new(&geometry);
        let opaque = Structure::build(&device, &geometry, opacity.as_ref(), &scales, false)?;
        let boundaries = match geometry.bounds_of(|shape| shape.is_boundary) {
            Some(bounds) => {
                let structure = Structure::build(&device, &geometry, None, &scales, true)?;
                Some(Boundaries::new(structure, bounds))
            }
            None => None,
        };
        Ok(Self { geometry, opaque, boundaries, scale: scales.render, device })
    }

    /// The closest hit before `ray.t_max` on anything but boundaries. A ray with a NaN hits nothing.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<RayHit> {
        let hit = self.opaque.scene.intersect(&self.embree_ray(ray))?;
        let (shape, instance) = self.opaque.resolve(hit.geometry, hit.instance);
        let uv = shape_uv(&self.geometry.shapes[shape.0 as usize], hit.uv);
        Some(RayHit { t: hit.t * self.scale.from_embree, shape, instance, primitive: hit.primitive, uv })
    }

    /// Whether anything but boundaries lies before `ray.t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.opaque.scene.occluded(&self.embree_ray(ray))
    }

    /// Whether `ray` may cross a boundary.
    #[inline]
    pub fn may_cross(&self, ray: &Ray) -> bool {
        self.boundaries.as_ref().is_some_and(|all| all.may_meet(ray))
    }

    /// All boundary crossings in [0, `ray.t_max`) in the order of [`put_in_order`].
    pub fn boundaries(&self, ray: &Ray, crossings: &mut Vec<BoundaryCrossing>) {
        crossings.clear();
        let Some(Boundaries { structure, .. }) = self.boundaries.as_ref().filter(|all| all.may_meet(ray)) else {
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
