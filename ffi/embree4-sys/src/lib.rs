//! Raw bindings to the installed Embree, in Embree 4's shape whichever version it is.
//!
//! bindgen makes them from the installed header (see `build.rs`). On top of that this file writes what bindgen does not
//! emit (constants that are casts, `static inline` initialisers) and, over Embree 3.13, the few names in which the two
//! versions differ: the context is called `RTCRayQueryContext`, and `rtcIntersect1`/`rtcOccluded1` take their options in an
//! arguments struct. Everything that this renderer does not use (argument filters, packets, streams) stays as the installed
//! version has it. Source: Embree's API reference, versions 3.13 and 4.3.

#![allow(non_camel_case_types, non_snake_case, non_upper_case_globals)]
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments, clippy::pedantic, clippy::ptr_offset_with_cast)]

#[allow(dead_code, unnecessary_transmutes, clippy::all)]
mod bindings {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

pub use bindings::*;

/// "No geometry was hit", "not in an instance".
pub const RTC_INVALID_GEOMETRY_ID: u32 = u32::MAX;

/// The major version of the library that was bound: 3 or 4.
pub const EMBREE_MAJOR: u32 = if cfg!(embree4) { 4 } else { 3 };

/// The version of the headers that were bound, as `4.3.3`.
pub fn header_version() -> String {
    format!("{RTC_VERSION_MAJOR}.{RTC_VERSION_MINOR}.{RTC_VERSION_PATCH}")
}

#[cfg(embree3)]
mod shape {
    use super::bindings;

    /// Embree 3 calls it `RTCIntersectContext` and keeps the query's flags and filter in it.
    pub type RTCRayQueryContext = bindings::RTCIntersectContext;

    /// What Embree 4 calls a query's arguments; here they only carry the context.
    #[derive(Clone, Copy, Debug)]
    pub struct RTCIntersectArguments {
        pub context: *mut RTCRayQueryContext,
    }

    /// See [`RTCIntersectArguments`].
    pub type RTCOccludedArguments = RTCIntersectArguments;

    /// A fresh context, as `rtcInitIntersectContext` writes it: incoherent, no filter, outside of all instances.
    #[inline(always)]
    pub fn ray_query_context() -> RTCRayQueryContext {
        // SAFETY: RTCIntersectContext is a C struct of an enum, a nullable function pointer and integers; zeros are valid.
        let mut context: RTCRayQueryContext = unsafe { std::mem::zeroed() };
        context.instID = [super::RTC_INVALID_GEOMETRY_ID; _];
        context
    }

    /// Default arguments with this context.
    #[inline(always)]
    pub fn intersect_arguments(context: *mut RTCRayQueryContext) -> RTCIntersectArguments {
        RTCIntersectArguments { context }
    }

    /// Default arguments with this context.
    #[inline(always)]
    pub fn occluded_arguments(context: *mut RTCRayQueryContext) -> RTCOccludedArguments {
        RTCIntersectArguments { context }
    }

    /// Embree 4's closest hit of one ray.
    #[inline(always)]
    pub unsafe fn rtcIntersect1(
        scene: bindings::RTCScene,
        rayhit: *mut bindings::RTCRayHit,
        arguments: *mut RTCIntersectArguments,
    ) {
        // SAFETY: the caller passes what Embree 4 asks for: live pointers, and a context that outlives the call.
        unsafe { bindings::rtcIntersect1(scene, (*arguments).context, rayhit) }
    }

    /// Embree 4's occlusion test of one ray.
    #[inline(always)]
    pub unsafe fn rtcOccluded1(
        scene: bindings::RTCScene,
        ray: *mut bindings::RTCRay,
        arguments: *mut RTCOccludedArguments,
    ) {
        // SAFETY: as for rtcIntersect1.
        unsafe { bindings::rtcOccluded1(scene, (*arguments).context, ray) }
    }
}

#[cfg(embree4)]
mod shape {
    use super::bindings::{RTC_FEATURE_FLAG_ALL, RTCIntersectArguments, RTCOccludedArguments, RTCRayQueryContext};

    /// A fresh context, as `rtcInitRayQueryContext` writes it: outside of all instances.
    #[inline(always)]
    pub fn ray_query_context() -> RTCRayQueryContext {
        // Every member is an instance (primitive) id or, in builds with more levels, the depth of their stack.
        // SAFETY: the context is a C struct of integers; zeros are valid.
        let mut context: RTCRayQueryContext = unsafe { std::mem::zeroed() };
        context.instID = [super::RTC_INVALID_GEOMETRY_ID; _];
        context
    }

    /// Default arguments with this context: incoherent, all features, no filter.
    #[inline(always)]
    pub fn intersect_arguments(context: *mut RTCRayQueryContext) -> RTCIntersectArguments {
        // SAFETY: a C struct of integers, floats and nullable pointers; zeros are valid.
        let mut arguments: RTCIntersectArguments = unsafe { std::mem::zeroed() };
        arguments.feature_mask = RTC_FEATURE_FLAG_ALL;
        arguments.context = context;
        arguments
    }

    /// Default arguments with this context.
    #[inline(always)]
    pub fn occluded_arguments(context: *mut RTCRayQueryContext) -> RTCOccludedArguments {
        // SAFETY: as for intersect_arguments.
        let mut arguments: RTCOccludedArguments = unsafe { std::mem::zeroed() };
        arguments.feature_mask = RTC_FEATURE_FLAG_ALL;
        arguments.context = context;
        arguments
    }
}

// Named one by one because these take the place of the bindings' own.
#[cfg(embree3)]
pub use shape::{RTCIntersectArguments, RTCOccludedArguments, RTCRayQueryContext, rtcIntersect1, rtcOccluded1};
pub use shape::{intersect_arguments, occluded_arguments, ray_query_context};

/// The identity, as `rtcInitQuaternionDecomposition` writes it.
pub fn quaternion_decomposition() -> RTCQuaternionDecomposition {
    // SAFETY: a C struct of floats; zeros are valid.
    let mut identity: RTCQuaternionDecomposition = unsafe { std::mem::zeroed() };
    identity.scale_x = 1.0;
    identity.scale_y = 1.0;
    identity.scale_z = 1.0;
    identity.quaternion_r = 1.0;
    identity
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn installed_library_is_the_bound_version() {
        // SAFETY: a null configuration asks for the defaults; the device is used and released here only.
        unsafe {
            let device = rtcNewDevice(std::ptr::null());
            assert!(!device.is_null());
            let major = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MAJOR);
            rtcReleaseDevice(device);
            assert_eq!(major, EMBREE_MAJOR as _);
        }
    }
}
