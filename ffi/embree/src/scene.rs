//! Scenes: geometries taken in, committed once, then asked by any number of threads.

use std::sync::Arc;

use embree4_sys as sys;

use crate::device::{Device, Error};
use crate::geometry::{Data, Geometry};
use crate::query::{Candidate, Hit, QueryContext, Ray, valid_id};

/// A scene that takes in geometries.
pub struct SceneBuilder {
    scene: Scene,
}

/// A committed scene. It never changes.
pub struct Scene {
    raw: sys::RTCScene,
    /// What the geometries' callbacks and buffers point to.
    data: Vec<Arc<Data>>,
    device: Arc<Device>,
}

// SAFETY: a committed scene is only read, which Embree allows from any number of threads at once; an uncommitted one is
// reached through `&mut` only. User geometries, filters and owners of buffers are Send + Sync by their bounds.
unsafe impl Send for Scene {}
// SAFETY: as for Send.
unsafe impl Sync for Scene {}

impl SceneBuilder {
    /// An empty scene. `robust` makes Embree's traversal and triangle test watertight.
    pub fn new(device: &Arc<Device>, robust: bool) -> Result<Self, Error> {
        // SAFETY: the device is alive; a null result is checked for.
        let raw = unsafe { sys::rtcNewScene(device.raw()) };
        if raw.is_null() {
            device.check()?;
            return Err(Error::Other("no scene was made".to_owned()));
        }
        let scene = Scene { raw, data: Vec::new(), device: device.clone() };
        let flags = if robust { sys::RTC_SCENE_FLAG_ROBUST } else { sys::RTC_SCENE_FLAG_NONE };
        // SAFETY: the scene is alive and not committed.
        unsafe { sys::rtcSetSceneFlags(raw, flags) };
        device.check()?;
        Ok(Self { scene })
    }

    /// Takes in a geometry; returns its number: 0, 1, 2, … in order.
    pub fn attach(&mut self, geometry: Geometry) -> Result<u32, Error> {
        if !Arc::ptr_eq(&geometry.device, &self.scene.device) {
            return Err(Error::Other("the geometry is of another device".to_owned()));
        }
        let id = self.scene.data.len() as u32;
        // SAFETY: both are alive and of one device; the scene takes a reference of its own, and the data that the geometry
        // points to goes into `self.scene.data`.
        unsafe { sys::rtcAttachGeometryByID(self.scene.raw, geometry.raw(), id) };
        self.scene.data.push(geometry.data.clone());
        self.scene.device.check()?;
        Ok(id)
    }

    /// Builds the acceleration structure, with the device's threads.
    pub fn commit(self) -> Result<Scene, Error> {
        // SAFETY: the scene is alive and no other thread has it.
        unsafe { sys::rtcCommitScene(self.scene.raw) };
        self.scene.data.iter().try_for_each(|data| data.check())?;
        self.scene.device.check()?;
        Ok(self.scene)
    }
}

impl Scene {
    /// The closest hit in (`t_min`, `t_max`].
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut rayhit = sys::RTCRayHit { ray: ray.to_raw()?, hit: no_hit() };
        let mut context = QueryContext::new(None);
        self.trace(&mut rayhit, &mut context);
        context.finish();
        let hit = &rayhit.hit;
        valid_id(hit.geomID).map(|geometry| Hit {
            t: rayhit.ray.tfar,
            uv: [hit.u, hit.v],
            normal: [hit.Ng_x, hit.Ng_y, hit.Ng_z],
            primitive: hit.primID,
            geometry,
            instance: valid_id(hit.instID[0]),
        })
    }

    /// Whether anything lies in (`t_min`, `t_max`].
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let Some(mut ray) = ray.to_raw() else {
            return false;
        };
        let mut context = QueryContext::new(None);
        let mut arguments = sys::occluded_arguments((&raw mut context).cast());
        // SAFETY: the scene is committed; ray, context and arguments are live locals; the context is a QueryContext's first
        // member, as the callbacks expect, and is not touched here until the call returns.
        unsafe { sys::rtcOccluded1(self.raw, &mut ray, &mut arguments) };
        context.finish();
        // Embree sets tfar to −∞ where something is in the way.
        ray.tfar < 0.0
    }

    /// Calls `sink` with every hit in (`t_min`, `t_max`] on geometries with [`crate::HitFilter::Collect`], in no order; one
    /// hit may come twice.
    pub fn collect(&self, ray: &Ray, sink: &mut dyn FnMut(&Candidate)) {
        let Some(ray) = ray.to_raw() else {
            return;
        };
        let mut rayhit = sys::RTCRayHit { ray, hit: no_hit() };
        let mut context = QueryContext::new(Some(sink));
        self.trace(&mut rayhit, &mut context);
        context.finish();
    }

    /// Embree's count of this scene's box: lower and upper corner; lower above upper when the scene is empty.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let mut bounds = std::mem::MaybeUninit::<sys::RTCBounds>::zeroed();
        // SAFETY: the scene is committed; Embree writes one RTCBounds, of floats only.
        let bounds = unsafe {
            sys::rtcGetSceneBounds(self.raw, bounds.as_mut_ptr());
            bounds.assume_init()
        };
        ([bounds.lower_x, bounds.lower_y, bounds.lower_z], [bounds.upper_x, bounds.upper_y, bounds.upper_z])
    }

    #[inline(always)]
    fn trace(&self, rayhit: &mut sys::RTCRayHit, context: &mut QueryContext) {
        let mut arguments = sys::intersect_arguments((&raw mut *context).cast());
        // SAFETY: the scene is committed; rayhit, context and arguments are live and used by no one else during the call; the
        // context is a QueryContext's first member, as the callbacks expect.
        unsafe { sys::rtcIntersect1(self.raw, rayhit, &mut arguments) };
    }

    pub(crate) fn raw(&self) -> sys::RTCScene {
        self.raw
    }

    pub(crate) fn device(&self) -> &Arc<Device> {
        &self.device
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: `raw` came from rtcNewScene and this reference is given back once. An instance of this scene keeps it in an
        // Arc, so it is not dropped before. `data` and `device` are dropped after this body.
        unsafe { sys::rtcReleaseScene(self.raw) };
    }
}

/// The hit part of a query's in-and-out struct, saying "none yet".
#[inline(always)]
fn no_hit() -> sys::RTCHit {
    // SAFETY: RTCHit is a C struct of floats and integers in every version; zeros are valid.
    let mut hit: sys::RTCHit = unsafe { std::mem::zeroed() };
    hit.geomID = sys::RTC_INVALID_GEOMETRY_ID;
    hit.instID = [sys::RTC_INVALID_GEOMETRY_ID; _];
    hit
}
