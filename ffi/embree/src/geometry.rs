//! Geometries: triangles, curves, user geometry and instances, each owning what Embree reads through pointers.

use std::any::Any;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::NoUninit;
use embree4_sys as sys;

use crate::callbacks;
use crate::device::{Device, Error};
use crate::query::Candidate;
use crate::scene::Scene;

/// Primitives of the caller's own making.
pub trait UserGeometry: Send + Sync {
    /// How many primitives there are.
    fn len(&self) -> u32;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Lower and upper corner of the box around a primitive; `None` leaves it out.
    fn bounds(&self, primitive: u32) -> Option<([f32; 3], [f32; 3])>;

    /// The first hit strictly between `t_min` and `t_max`. The direction need not have unit length.
    fn intersect(
        &self,
        primitive: u32,
        origin: [f32; 3],
        direction: [f32; 3],
        t_min: f32,
        t_max: f32,
    ) -> Option<UserHit>;
}

/// A hit on a [`UserGeometry`].
#[derive(Clone, Copy, Debug)]
pub struct UserHit {
    /// Distance in units of the direction's length.
    pub t: f32,
    /// The primitive's parameters.
    pub uv: [f32; 2],
}

/// Decides which hits count.
pub trait Filter: Send + Sync {
    /// Whether the hit counts. May be asked more than once for one hit and must then give the same answer.
    fn accept(&self, candidate: &Candidate) -> bool;
}

/// What happens at hits on a geometry.
#[derive(Clone, Default)]
pub enum HitFilter {
    /// All hits count.
    #[default]
    None,
    /// Hits count that the filter accepts.
    Test(Arc<dyn Filter>),
    /// No hit counts; all go to the sink of [`Scene::collect`].
    Collect,
}

/// Cross-sections of Bézier curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// A ribbon that always faces the ray; u runs along (0..=1), v across (−1..=1).
    Flat,
    /// A tube; u runs along, v is 0.
    Round,
}

/// One time step of a moving instance: M = T · R · S with S upper triangular.
#[derive(Clone, Copy, Debug)]
pub struct QuaternionKey {
    /// S's diagonal.
    pub scale: [f32; 3],
    /// S's (0,1), (0,2), (1,2).
    pub skew: [f32; 3],
    /// R as (real, i, j, k); unit.
    pub rotation: [f32; 4],
    /// T.
    pub translation: [f32; 3],
}

/// What a geometry's callbacks see, and what must live as long as Embree may read it.
pub(crate) struct Data {
    pub user: Option<Arc<dyn UserGeometry>>,
    pub filter: HitFilter,
    /// What a panic in a bounds callback said.
    pub build_panic: Mutex<Option<String>>,
    /// Owners of shared buffers, and instanced scenes.
    _kept: Vec<Arc<dyn Any + Send + Sync>>,
}

/// A geometry that is not yet part of a scene.
pub struct Geometry {
    raw: sys::RTCGeometry,
    pub(crate) data: Arc<Data>,
    pub(crate) device: Arc<Device>,
}

impl Geometry {
    fn new(
        device: &Arc<Device>,
        kind: sys::RTCGeometryType,
        user: Option<Arc<dyn UserGeometry>>,
        filter: HitFilter,
        kept: Vec<Arc<dyn Any + Send + Sync>>,
    ) -> Result<Self, Error> {
        let data = Arc::new(Data { user, filter, build_panic: Mutex::new(None), _kept: kept });
        // SAFETY: the device is alive; a null result is checked for.
        let raw = unsafe { sys::rtcNewGeometry(device.raw(), kind) };
        if raw.is_null() {
            device.check()?;
            return Err(Error::Other("no geometry was made".to_owned()));
        }
        let geometry = Self { raw, data, device: device.clone() };
        let user = Arc::as_ptr(&geometry.data).cast_mut().cast::<c_void>();
        // SAFETY: `user` points into the Arc that this geometry, then its scene, keeps until Embree has released the geometry;
        // callbacks only share what it points to. The filter functions have the signature that Embree asks for.
        unsafe {
            // The default is ~0 in Embree 3 and 1 in Embree 4.
            sys::rtcSetGeometryMask(raw, u32::MAX);
            sys::rtcSetGeometryUserData(raw, user);
            let is_user = kind == sys::RTC_GEOMETRY_TYPE_USER;
            if !is_user && !matches!(geometry.data.filter, HitFilter::None) {
                sys::rtcSetGeometryIntersectFilterFunction(raw, Some(callbacks::filter));
                sys::rtcSetGeometryOccludedFilterFunction(raw, Some(callbacks::filter));
            }
        }
        device.check()?;
        Ok(geometry)
    }

    /// Triangles over positions (three f32 each) and vertex numbers (three u32 each), both read where they are.
    ///
    /// Embree reads 4 bytes past the last position, so positions are copied unless the `Vec` has room for them.
    pub fn triangles<O, P, I>(
        device: &Arc<Device>,
        owner: Arc<O>,
        buffers: impl for<'a> FnOnce(&'a O) -> (&'a Vec<P>, &'a [I]),
        filter: HitFilter,
    ) -> Result<Self, Error>
    where
        O: Send + Sync + 'static,
        P: NoUninit,
        I: NoUninit,
    {
        const { assert!(size_of::<P>() == 12 && align_of::<P>() == 4) };
        const { assert!(size_of::<I>() == 12 && align_of::<I>() == 4) };
        let (positions, indices) = buffers(&owner);
        check_indices(bytemuck::cast_slice(indices), positions.len())?;
        let (vertex_count, triangle_count) = (positions.len(), indices.len());
        let has_room = positions.capacity() > positions.len();
        let copy: Option<Arc<Vec<f32>>> = (!has_room).then(|| Arc::new(padded(bytemuck::cast_slice(positions))));
        let vertices = copy.as_ref().map_or(positions.as_ptr().cast::<c_void>(), |copy| copy.as_ptr().cast());
        let indices = indices.as_ptr().cast::<c_void>();

        let mut kept: Vec<Arc<dyn Any + Send + Sync>> = Vec::new();
        if let Some(copy) = copy {
            kept.push(copy);
        }
        kept.push(owner);
        let geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_TRIANGLE, None, filter, kept)?;
        geometry.share(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, indices, 12, triangle_count);
        geometry.share(sys::RTC_BUFFER_TYPE_VERTEX, sys::RTC_FORMAT_FLOAT3, vertices, 12, vertex_count);
        geometry.finish()
    }

    /// Cubic Bézier segments. `vertices` are (x, y, z, radius); segment i uses four from number `first[i]` on.
    /// A flat curve is cut into `tessellation` pieces (1..=16).
    pub fn bezier_curves(
        device: &Arc<Device>,
        kind: CurveKind,
        vertices: Vec<[f32; 4]>,
        first: Vec<u32>,
        tessellation: u32,
        filter: HitFilter,
    ) -> Result<Self, Error> {
        if first.iter().any(|&first| first as usize + 4 > vertices.len()) {
            return Err(Error::Other("a curve segment's vertices are out of range".to_owned()));
        }
        let kind = match kind {
            CurveKind::Flat => sys::RTC_GEOMETRY_TYPE_FLAT_BEZIER_CURVE,
            CurveKind::Round => sys::RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE,
        };
        let (vertices, first) = (Arc::new(vertices), Arc::new(first));
        let kept: Vec<Arc<dyn Any + Send + Sync>> = vec![vertices.clone(), first.clone()];
        let geometry = Self::new(device, kind, None, filter, kept)?;
        geometry.share(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT, first.as_ptr().cast(), 4, first.len());
        geometry.share(
            sys::RTC_BUFFER_TYPE_VERTEX,
            sys::RTC_FORMAT_FLOAT4,
            vertices.as_ptr().cast(),
            16,
            vertices.len(),
        );
        // SAFETY: the geometry is alive and a curve.
        unsafe { sys::rtcSetGeometryTessellationRate(geometry.raw, tessellation.clamp(1, 16) as f32) };
        geometry.finish()
    }

    /// Primitives that the caller intersects.
    pub fn user(device: &Arc<Device>, user: Arc<dyn UserGeometry>, filter: HitFilter) -> Result<Self, Error> {
        let count = user.len();
        let geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_USER, Some(user), filter, Vec::new())?;
        // SAFETY: the geometry is alive; the callbacks have the signatures that Embree asks for and find what they need
        // behind the geometry's user data.
        unsafe {
            sys::rtcSetGeometryUserPrimitiveCount(geometry.raw, count);
            sys::rtcSetGeometryBoundsFunction(geometry.raw, Some(callbacks::bounds), std::ptr::null_mut());
            sys::rtcSetGeometryIntersectFunction(geometry.raw, Some(callbacks::intersect));
            sys::rtcSetGeometryOccludedFunction(geometry.raw, Some(callbacks::occluded));
        }
        geometry.finish()
    }

    /// An instance of `scene` (which must hold no instances) under an affine transform: columns x, y, z, translation.
    pub fn instance(device: &Arc<Device>, scene: &Arc<Scene>, columns: [f32; 12]) -> Result<Self, Error> {
        let geometry = Self::new_instance(device, scene)?;
        let format = sys::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
        // SAFETY: the geometry is an instance; Embree copies the twelve floats during the call.
        unsafe { sys::rtcSetGeometryTransform(geometry.raw, 0, format, columns.as_ptr().cast()) };
        geometry.finish()
    }

    /// A moving instance of `scene` with `keys` (2 to 129) spread evenly over the times 0..=1. Between keys T and S are
    /// interpolated linearly, R spherically.
    pub fn moving_instance(device: &Arc<Device>, scene: &Arc<Scene>, keys: &[QuaternionKey]) -> Result<Self, Error> {
        if !(2..=sys::RTC_MAX_TIME_STEP_COUNT as usize).contains(&keys.len()) {
            return Err(Error::Other(format!("{} time steps", keys.len())));
        }
        let geometry = Self::new_instance(device, scene)?;
        // SAFETY: the geometry is an instance; Embree copies each key during the call.
        unsafe { sys::rtcSetGeometryTimeStepCount(geometry.raw, keys.len() as u32) };
        for (step, key) in keys.iter().enumerate() {
            let mut raw = sys::quaternion_decomposition();
            [raw.scale_x, raw.scale_y, raw.scale_z] = key.scale;
            [raw.skew_xy, raw.skew_xz, raw.skew_yz] = key.skew;
            [raw.quaternion_r, raw.quaternion_i, raw.quaternion_j, raw.quaternion_k] = key.rotation;
            [raw.translation_x, raw.translation_y, raw.translation_z] = key.translation;
            // SAFETY: as above; `step` is below the count that was set.
            unsafe { sys::rtcSetGeometryTransformQuaternion(geometry.raw, step as u32, &raw) };
        }
        geometry.finish()
    }

    /// An instance's transform as Embree interpolates it: columns x, y, z, translation.
    pub fn transform_at(&self, time: f32) -> Result<[f32; 12], Error> {
        let mut columns = [0.0f32; 12];
        let format = sys::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
        // SAFETY: the geometry is alive (Embree reports an error if it is no instance) and twelve floats are written.
        unsafe { sys::rtcGetGeometryTransform(self.raw, time, format, columns.as_mut_ptr().cast()) };
        self.device.check()?;
        Ok(columns)
    }

    fn new_instance(device: &Arc<Device>, scene: &Arc<Scene>) -> Result<Self, Error> {
        if !Arc::ptr_eq(device, scene.device()) {
            return Err(Error::Other("the instanced scene is of another device".to_owned()));
        }
        let kept: Vec<Arc<dyn Any + Send + Sync>> = vec![scene.clone()];
        let geometry = Self::new(device, sys::RTC_GEOMETRY_TYPE_INSTANCE, None, HitFilter::None, kept)?;
        // SAFETY: both are alive and of one device.
        unsafe { sys::rtcSetGeometryInstancedScene(geometry.raw, scene.raw()) };
        Ok(geometry)
    }

    /// Points a buffer at memory that `self.data` keeps alive and unchanged.
    fn share(
        &self,
        buffer: sys::RTCBufferType,
        format: sys::RTCFormat,
        pointer: *const c_void,
        stride: usize,
        count: usize,
    ) {
        // SAFETY: private; the callers pass memory of `count` items owned by an Arc in `self.data`, padded as Embree asks.
        unsafe { sys::rtcSetSharedGeometryBuffer(self.raw, buffer, 0, format, pointer, 0, stride, count) };
    }

    fn finish(self) -> Result<Self, Error> {
        // SAFETY: the geometry is alive and nothing is being built from it yet.
        unsafe { sys::rtcCommitGeometry(self.raw) };
        self.device.check()?;
        Ok(self)
    }

    pub(crate) fn raw(&self) -> sys::RTCGeometry {
        self.raw
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: `raw` came from rtcNewGeometry and this reference is given back once. A scene holds its own.
        unsafe { sys::rtcReleaseGeometry(self.raw) };
    }
}

impl Data {
    /// What a bounds callback's panic said, as an error.
    pub fn check(&self) -> Result<(), Error> {
        match self.build_panic.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(message) => Err(Error::Other(format!("a bounds callback panicked: {message}"))),
            None => Ok(()),
        }
    }
}

fn check_indices(indices: &[u32], vertex_count: usize) -> Result<(), Error> {
    match indices.iter().max() {
        Some(&largest) if largest as usize >= vertex_count => {
            Err(Error::Other(format!("vertex number {largest} of {vertex_count} vertices")))
        }
        _ => Ok(()),
    }
}

/// A copy with the four bytes behind its end that Embree's 16-byte loads of 12-byte positions touch.
fn padded(positions: &[f32]) -> Vec<f32> {
    let mut copy = Vec::with_capacity(positions.len() + 1);
    copy.extend_from_slice(positions);
    copy.push(0.0);
    copy
}
