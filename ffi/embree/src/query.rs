//! Rays in, hits out, and the context that travels with a query into the callbacks.

use std::any::Any;

use embree4_sys as sys;

/// A ray, or the segment of one.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin.
    pub origin: [f32; 3],
    /// Direction; distances are in units of its length.
    pub direction: [f32; 3],
    /// Hits at or before this distance do not count; at least 0.
    pub t_min: f32,
    /// Hits beyond this distance do not count; may be infinite.
    pub t_max: f32,
    /// Time within the motion interval, 0..=1.
    pub time: f32,
    /// Handed to filters as it is.
    pub id: u32,
}

/// The closest hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance in units of the direction's length.
    pub t: f32,
    /// The primitive's parameters, as Embree or the user geometry gives them.
    pub uv: [f32; 2],
    /// Geometric normal in the geometry's space, not unit.
    pub normal: [f32; 3],
    /// Primitive within the geometry.
    pub primitive: u32,
    /// Geometry within the scene, or within the instanced scene where `instance` is given.
    pub geometry: u32,
    /// The instance's geometry number within the scene.
    pub instance: Option<u32>,
}

/// A hit that a filter decides on, in the space of the geometry that was hit.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// The hit.
    pub hit: Hit,
    /// The ray's direction in the geometry's space.
    pub direction: [f32; 3],
    /// [`Ray::id`].
    pub ray_id: u32,
}

/// What travels with one query: Embree's own context first, so that a pointer to it is a pointer to the whole.
#[repr(C)]
pub(crate) struct QueryContext<'a> {
    pub raw: sys::RTCRayQueryContext,
    /// Where geometries with [`crate::HitFilter::Collect`] send their hits.
    pub sink: Option<&'a mut dyn FnMut(&Candidate)>,
    /// A panic that a callback caught, to go on once Embree has returned.
    pub panic: Option<Box<dyn Any + Send>>,
}

impl<'a> QueryContext<'a> {
    #[inline(always)]
    pub fn new(sink: Option<&'a mut dyn FnMut(&Candidate)>) -> Self {
        Self { raw: sys::ray_query_context(), sink, panic: None }
    }

    /// Lets a caught panic go on.
    #[inline(always)]
    pub fn finish(self) {
        if let Some(panic) = self.panic {
            std::panic::resume_unwind(panic);
        }
    }
}

/// `id` unless it is Embree's "none".
#[inline(always)]
pub(crate) fn valid_id(id: u32) -> Option<u32> {
    (id != sys::RTC_INVALID_GEOMETRY_ID).then_some(id)
}

impl Ray {
    /// Embree's ray, unless it goes nowhere or a member is NaN or infinite where that makes no sense: such rays hit nothing, and Embree must
    /// not see them.
    #[inline(always)]
    pub(crate) fn to_raw(self) -> Option<sys::RTCRay> {
        let Self { origin: [ox, oy, oz], direction: [dx, dy, dz], t_min, t_max, time, id } = self;
        let finite = [ox, oy, oz, dx, dy, dz, t_min, time].iter().all(|x| x.is_finite());
        let goes = [dx, dy, dz] != [0.0; 3];
        // Written so that a NaN in t_max says no as well.
        if !(finite && goes && t_max > t_min.max(0.0)) {
            return None;
        }
        Some(sys::RTCRay {
            org_x: ox,
            org_y: oy,
            org_z: oz,
            tnear: t_min.max(0.0),
            dir_x: dx,
            dir_y: dy,
            dir_z: dz,
            time: time.clamp(0.0, 1.0),
            tfar: t_max,
            mask: u32::MAX,
            id,
            flags: 0,
        })
    }
}
