//! The functions that Embree calls. Each catches panics: unwinding into C would abort the process.
//!
//! All queries here are of single rays, so every packet has one member and its "structure of arrays" is the plain struct.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;

use embree4_sys as sys;

use crate::geometry::{Data, HitFilter, UserGeometry, UserHit};
use crate::query::{Candidate, Hit, QueryContext, valid_id};

/// More hits than any primitive has; ends the walk along one even if a user geometry reports hits out of its interval.
const MAX_HITS_PER_PRIMITIVE: usize = 64;

/// Runs `body` unless an earlier callback of this query panicked; keeps a panic for [`QueryContext::finish`].
#[inline(always)]
fn guarded<R>(context: &mut QueryContext, or: R, body: impl FnOnce(&mut QueryContext) -> R) -> R {
    if context.panic.is_some() {
        return or;
    }
    match catch_unwind(AssertUnwindSafe(|| body(context))) {
        Ok(value) => value,
        Err(panic) => {
            context.panic = Some(panic);
            or
        }
    }
}

/// Whether a candidate counts.
#[inline(always)]
fn accepts(filter: &HitFilter, context: &mut QueryContext, candidate: &Candidate) -> bool {
    match filter {
        HitFilter::None => true,
        HitFilter::Test(filter) => filter.accept(candidate),
        HitFilter::Collect => {
            if let Some(sink) = &mut context.sink {
                sink(candidate);
            }
            false
        }
    }
}

/// Filter of triangles and curves, for closest hits and occlusion alike.
pub(crate) unsafe extern "C" fn filter(args: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes live arguments for the time of the call, of one ray (N = 1) because only single-ray queries
    // exist here; the context is the first member of the QueryContext that the query made, which nothing else touches
    // meanwhile; the user data is the geometry's Data, alive as long as the scene. `ray` and `hit` are read by f32 and u32
    // at the places that RTCRay and RTCHit of one ray have: org 0..3, dir 4..7, tfar 8, id 10; Ng 0..3, uv 3..5, prim 5, geom 6.
    unsafe {
        let args = &*args;
        debug_assert_eq!(args.N, 1);
        if *args.valid == 0 {
            return;
        }
        let data = &*args.geometryUserPtr.cast::<Data>();
        let context = &mut *args.context.cast::<QueryContext>();
        let ray = args.ray.cast::<f32>();
        let hit = args.hit.cast::<f32>();
        let candidate = Candidate {
            hit: Hit {
                t: *ray.add(8),
                uv: [*hit.add(3), *hit.add(4)],
                normal: [*hit, *hit.add(1), *hit.add(2)],
                primitive: *hit.add(5).cast::<u32>(),
                geometry: *hit.add(6).cast::<u32>(),
                instance: valid_id(context.raw.instID[0]),
            },
            direction: [*ray.add(4), *ray.add(5), *ray.add(6)],
            ray_id: *ray.add(10).cast::<u32>(),
        };
        if !guarded(context, false, |context| accepts(&data.filter, context, &candidate)) {
            *args.valid = 0;
        }
    }
}

/// Bounds of one user primitive.
pub(crate) unsafe extern "C" fn bounds(args: *const sys::RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes live arguments; the user data is the geometry's Data; `bounds_o` is one RTCBounds to write.
    unsafe {
        let args = &*args;
        let data = &*args.geometryUserPtr.cast::<Data>();
        let found = match &data.user {
            Some(user) => catch_unwind(AssertUnwindSafe(|| user.bounds(args.primID))),
            None => Ok(None),
        };
        let found = found.unwrap_or_else(|panic| {
            let mut slot = data.build_panic.lock().unwrap_or_else(PoisonError::into_inner);
            slot.get_or_insert_with(|| panic_message(panic.as_ref()));
            None
        });
        // Embree leaves out primitives whose bounds are not numbers.
        let ([lx, ly, lz], [ux, uy, uz]) = found.unwrap_or(([f32::NAN; 3], [f32::NAN; 3]));
        let out = &mut *args.bounds_o;
        (out.lower_x, out.lower_y, out.lower_z) = (lx, ly, lz);
        (out.upper_x, out.upper_y, out.upper_z) = (ux, uy, uz);
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("no message").to_owned()
}

/// Closest hit with one user primitive.
pub(crate) unsafe extern "C" fn intersect(args: *const sys::RTCIntersectFunctionNArguments) {
    // SAFETY: as in `filter`; with N = 1 the RTCRayHit's ray and hit lie at floats 0 and 12.
    unsafe {
        let args = &*args;
        debug_assert_eq!(args.N, 1);
        if *args.valid == 0 {
            return;
        }
        let data = &*args.geometryUserPtr.cast::<Data>();
        let context = &mut *args.context.cast::<QueryContext>();
        let ray = args.rayhit.cast::<f32>();
        let found = walk(data, context, ray, args.primID, args.geomID);
        *args.valid = if found.is_some() { -1 } else { 0 };
        if let Some(found) = found {
            *ray.add(8) = found.t;
            let hit = ray.add(12);
            // No one reads the normal of user geometry: its owner knows better.
            (*hit, *hit.add(1), *hit.add(2)) = (0.0, 0.0, 0.0);
            (*hit.add(3), *hit.add(4)) = (found.uv[0], found.uv[1]);
            *hit.add(5).cast::<u32>() = args.primID;
            *hit.add(6).cast::<u32>() = args.geomID;
            *hit.add(7).cast::<u32>() = context.raw.instID[0];
        }
    }
}

/// Occlusion by one user primitive.
pub(crate) unsafe extern "C" fn occluded(args: *const sys::RTCOccludedFunctionNArguments) {
    // SAFETY: as in `filter`.
    unsafe {
        let args = &*args;
        debug_assert_eq!(args.N, 1);
        if *args.valid == 0 {
            return;
        }
        let data = &*args.geometryUserPtr.cast::<Data>();
        let context = &mut *args.context.cast::<QueryContext>();
        let ray = args.ray.cast::<f32>();
        let found = walk(data, context, ray, args.primID, args.geomID);
        *args.valid = if found.is_some() { -1 } else { 0 };
        if found.is_some() {
            *ray.add(8) = f32::NEG_INFINITY;
        }
    }
}

/// The first hit on a user primitive that its filter accepts: a rejected hit uncovers the ones behind it.
///
/// # Safety
/// `ray` points to the floats of one RTCRay.
#[inline(always)]
unsafe fn walk(
    data: &Data,
    context: &mut QueryContext,
    ray: *const f32,
    primitive: u32,
    geometry: u32,
) -> Option<UserHit> {
    let at = |place: usize| {
        // SAFETY: the caller's promise; places are within the twelve floats of an RTCRay.
        unsafe { *ray.add(place) }
    };
    let user: &dyn UserGeometry = &**data.user.as_ref()?;
    let origin = [at(0), at(1), at(2)];
    let direction = [at(4), at(5), at(6)];
    let (mut t_min, t_max, ray_id) = (at(3), at(8), at(10).to_bits());
    let instance = valid_id(context.raw.instID[0]);
    guarded(context, None, |context| {
        for _ in 0..MAX_HITS_PER_PRIMITIVE {
            let found = user.intersect(primitive, origin, direction, t_min, t_max)?;
            let hit = Hit { t: found.t, uv: found.uv, normal: [0.0; 3], primitive, geometry, instance };
            if accepts(&data.filter, context, &Candidate { hit, direction, ray_id }) {
                return Some(found);
            }
            t_min = found.t.max(t_min).next_up();
        }
        None
    })
}
