//! The native backend: rays in pure Rust. One hierarchy holds the primitives of render space, one each those of a prototype,
//! and one the instances. Moving instances have boxes that hold during the whole motion and are placed at each ray's time.
//! Medium boundaries live in structures of their own, which exist only where there are any.

mod bvh;
mod group;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use self::bvh::Bvh;
use self::group::{Group, LocalHit, LocalRay, Mask};
use super::trace::put_in_order;
use super::trace::{Opacity, TraceError};
use super::{BoundaryCrossing, Geometry, InstanceId, MotionTransform, Ray, RayHit, ShapeId, affine};

/// Acceleration structures in pure Rust.
pub struct NativeTracer {
    geometry: Arc<Geometry>,
    opacity: Option<Arc<dyn Opacity>>,
    surfaces: Box<World>,
    boundaries: Option<Box<World>>,
}

/// An instance whose prototype has something in this world.
#[derive(Clone, Copy)]
struct Placed {
    instance: u32,
    prototype: u32,
    /// For those that do not move: the inverse linear part, and the translation.
    fixed: Option<(DMat3, DVec3)>,
}

/// What one kind of query sees: surfaces or boundaries.
struct World {
    top_level: Group,
    prototypes: Vec<Group>,
    instances: Bvh<Placed>,
}

impl World {
    fn build(geometry: &Geometry, boundaries: bool) -> Result<Self, TraceError> {
        let mine = |ids: &[ShapeId]| -> Vec<ShapeId> {
            ids.iter().copied().filter(|id| geometry.shapes[id.0 as usize].is_boundary == boundaries).collect()
        };
        let top_level = Group::build(geometry, &mine(&geometry.top_level))?;
        let prototypes: Vec<Group> = geometry
            .prototypes
            .par_iter()
            .map(|prototype| Group::build(geometry, &mine(&prototype.shapes)))
            .collect::<Result<_, _>>()?;
        let mut placed = Vec::new();
        let mut boxes = Vec::new();
        for (number, instance) in geometry.instances.iter().enumerate() {
            let Some((low, high)) = prototypes[instance.prototype as usize].bounds() else { continue };
            let fixed = match &instance.transform {
                MotionTransform::Fixed(transform) => {
                    let inverse = affine::linear(transform).inverse();
                    if !inverse.is_finite() {
                        continue;
                    }
                    Some((inverse, affine::translation(transform)))
                }
                MotionTransform::Moving { .. } => None,
            };
            placed.push(Placed { instance: number as u32, prototype: instance.prototype, fixed });
            boxes.push(instance.transform.bounds(low, high));
        }
        Ok(Self { top_level, prototypes, instances: Bvh::build(&placed, &boxes)? })
    }

    fn is_empty(&self) -> bool {
        self.top_level.bounds().is_none() && self.prototypes.iter().all(|group| group.bounds().is_none())
    }

    fn memory(&self) -> usize {
        self.top_level.memory() + self.instances.memory() + self.prototypes.iter().map(Group::memory).sum::<usize>()
    }

    /// Calls `visit` with the group and the ray in its space for each instance that the segment may meet.
    #[inline]
    fn each_instance(
        &self,
        geometry: &Geometry,
        ray: &Ray,
        outer: &LocalRay,
        t_max: &mut f32,
        mut visit: impl FnMut(InstanceId, &Group, &LocalRay, &mut f32) -> bool,
    ) -> bool {
        self.instances.walk(outer.boxes(), t_max, |placed, t_max| {
            let local = match placed.fixed {
                Some((inverse, translation)) => {
                    let o = inverse * (ray.origin.as_dvec3() - translation);
                    let d = inverse * ray.direction.as_dvec3();
                    Some((o.as_vec3(), d.as_vec3()))
                }
                None => geometry.instances[placed.instance as usize].transform.ray_to_local(
                    ray.time,
                    ray.origin,
                    ray.direction,
                ),
            };
            let Some((origin, direction)) = local else { return false };
            if direction == Vec3::ZERO || !direction.is_finite() || !origin.is_finite() {
                return false;
            }
            let group = &self.prototypes[placed.prototype as usize];
            visit(InstanceId(placed.instance), group, &LocalRay::new(origin, direction), t_max)
        })
    }
}

/// Whether a ray means anything; a NaN would only waste time, but a zero direction has no shear.
fn is_sound(ray: &Ray) -> bool {
    ray.origin.is_finite() && ray.direction.is_finite() && ray.direction != Vec3::ZERO && ray.t_max > 0.0
}

fn world_hit(hit: LocalHit, instance: Option<InstanceId>) -> RayHit {
    RayHit { t: hit.t, shape: hit.shape, instance, primitive: hit.primitive, uv: hit.uv }
}

impl NativeTracer {
    /// Builds the hierarchies, prototypes in parallel on the current rayon pool. Fails where the geometry is beyond the limits
    /// of 32-bit numbering or of f32 areas.
    pub fn build(geometry: Arc<Geometry>, opacity: Option<Arc<dyn Opacity>>) -> Result<Self, TraceError> {
        let surfaces = Box::new(World::build(&geometry, false)?);
        let boundaries = if geometry.shapes.iter().any(|shape| shape.is_boundary) {
            Some(World::build(&geometry, true)?).filter(|world| !world.is_empty()).map(Box::new)
        } else {
            None
        };
        Ok(Self { geometry, opacity, surfaces, boundaries })
    }

    fn mask(&self, ray: &Ray) -> Mask<'_> {
        Mask { geometry: &self.geometry, opacity: self.opacity.as_deref(), instance: None, seed: ray.opacity_seed }
    }

    /// The closest hit before `ray.t_max` on anything but boundaries.
    pub fn closest(&self, ray: &Ray) -> Option<RayHit> {
        if !is_sound(ray) {
            return None;
        }
        let mask = self.mask(ray);
        let outer = LocalRay::new(ray.origin, ray.direction);
        let mut best = self.surfaces.top_level.closest(&outer, ray.t_max, &mask).map(|hit| world_hit(hit, None));
        let mut limit = best.map_or(ray.t_max, |hit| hit.t);
        self.surfaces.each_instance(&self.geometry, ray, &outer, &mut limit, |instance, group, local, limit| {
            if let Some(hit) = group.closest(local, *limit, &Mask { instance: Some(instance), ..mask }) {
                *limit = hit.t;
                best = Some(world_hit(hit, Some(instance)));
            }
            false
        });
        best
    }

    /// Whether anything but boundaries lies before `ray.t_max`.
    pub fn occluded(&self, ray: &Ray) -> bool {
        if !is_sound(ray) {
            return false;
        }
        let mask = self.mask(ray);
        let outer = LocalRay::new(ray.origin, ray.direction);
        let mut limit = ray.t_max;
        self.surfaces.top_level.occluded(&outer, ray.t_max, &mask)
            || self.surfaces.each_instance(&self.geometry, ray, &outer, &mut limit, |instance, group, local, limit| {
                group.occluded(local, *limit, &Mask { instance: Some(instance), ..mask })
            })
    }

    /// Whether `ray` may cross a boundary.
    pub fn may_cross(&self, ray: &Ray) -> bool {
        self.boundaries.is_some() && is_sound(ray)
    }

    /// All boundary crossings in [0, `ray.t_max`) in order of distance; `crossings` is cleared first. Boundaries have no holes:
    /// their alpha is not asked.
    pub fn boundaries(&self, ray: &Ray, crossings: &mut Vec<BoundaryCrossing>) {
        crossings.clear();
        let Some(world) = &self.boundaries else { return };
        if !is_sound(ray) {
            return;
        }
        let geometry = &*self.geometry;
        let mut add = |hit: LocalHit, instance, direction: Vec3| {
            let normal = geometry.shapes[hit.shape.0 as usize].oriented_normal(hit.primitive, hit.uv, direction);
            let entering = normal.dot(direction) < 0.0;
            crossings.push(BoundaryCrossing { t: hit.t, shape: hit.shape, instance, entering });
        };
        let outer = LocalRay::new(ray.origin, ray.direction);
        world.top_level.all(geometry, &outer, ray.t_max, |hit| add(hit, None, ray.direction));
        let mut limit = ray.t_max;
        world.each_instance(geometry, ray, &outer, &mut limit, |instance, group, local, limit| {
            group.all(geometry, local, *limit, |hit| add(hit, Some(instance), local.direction));
            false
        });
        put_in_order(crossings);
    }

    /// Bytes held by the hierarchies.
    pub fn memory(&self) -> usize {
        self.surfaces.memory() + self.boundaries.as_ref().map_or(0, |world| world.memory())
    }
}
