//! The one interface to rays. Both backends answer the same three questions: the closest hit, whether anything blocks a
//! segment, and which medium boundaries a segment crosses.
//!
//! Shapes of material `interface` ([`super::Shape::is_boundary`]) block nothing and are never hit: they live in an acceleration
//! structure of their own, asked only by [`Tracer::boundaries`], so that a shadow ray asks nothing but whether something is in the way.

use std::sync::Arc;

use glam::Vec3;

use super::{Geometry, InstanceId, ShapeId};

/// A ray, or the segment of one.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin in render space, already offset from the surface it leaves.
    pub origin: Vec3,
    /// Direction; unit length.
    pub direction: Vec3,
    /// Hits at or beyond this distance do not count; may be infinite.
    pub t_max: f32,
    /// Time within the animation interval, 0..=1.
    pub time: f32,
    /// Decides stochastic opacity: one ray sees one answer for one primitive.
    pub opacity_seed: u32,
}

/// The closest hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct RayHit {
    /// Distance along the ray.
    pub t: f32,
    /// The shape.
    pub shape: ShapeId,
    /// The instance, where the shape belongs to a prototype.
    pub instance: Option<InstanceId>,
    /// The primitive within the shape: triangle, patch, curve segment; 0 for quadrics.
    pub primitive: u32,
    /// The primitive's own parameters: barycentric weights of vertices 1 and 2 for triangles, (u, v) for the rest.
    pub uv: [f32; 2],
}

/// Where a segment passes through a medium boundary.
#[derive(Clone, Copy, Debug)]
pub struct BoundaryCrossing {
    /// Distance along the ray.
    pub t: f32,
    /// The boundary's shape.
    pub shape: ShapeId,
    /// The instance, where the shape belongs to a prototype.
    pub instance: Option<InstanceId>,
    /// Whether the ray goes to the inside (against the oriented geometric normal).
    pub entering: bool,
}

/// The end, left out, of what boundaries are looked for along: just before a ray's origin, so that one which starts exactly on a boundary crosses
/// it. Two rays from there in opposite directions then agree about what lies on each side. Not denormal, which processors may take for 0.
pub(super) const BOUNDARY_T_MIN: f32 = -f32::MIN_POSITIVE;

/// Puts crossings in order of distance, ties by shape and instance; each once. Where a ray enters and leaves the same region at one
/// distance, nothing of it lies between: both are left out, whichever would come first (a box without thickness, a corner just touched).
pub(super) fn put_in_order(crossings: &mut Vec<BoundaryCrossing>) {
    for crossing in crossings.iter_mut() {
        // −0 becomes 0: both are one distance.
        crossing.t += 0.0;
    }
    crossings.sort_unstable_by(|a, b| {
        a.t.total_cmp(&b.t).then_with(|| (a.shape, a.instance, a.entering).cmp(&(b.shape, b.instance, b.entering)))
    });
    // Both triangles of a shared edge report the crossing; so may one triangle, twice.
    crossings.dedup_by(|a, b| (a.t, a.shape, a.instance, a.entering) == (b.t, b.shape, b.instance, b.entering));
    let is_pair = |a: &BoundaryCrossing, b: &BoundaryCrossing| (a.t, a.shape, a.instance) == (b.t, b.shape, b.instance);
    if crossings.windows(2).any(|pair| is_pair(&pair[0], &pair[1])) {
        let all = std::mem::take(crossings);
        let alone = |i: usize| {
            let before = i.checked_sub(1).is_some_and(|before| is_pair(&all[before], &all[i]));
            !before && all.get(i + 1).is_none_or(|after| !is_pair(&all[i], after))
        };
        crossings.extend((0..all.len()).filter(|&i| alone(i)).map(|i| all[i]));
    }
}

/// Which library traces the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// Debian's Embree.
    Embree,
    /// Pure Rust, on the `obvhs` BVH crate.
    Native,
}

impl Backend {
    /// Embree where it is built in.
    pub const DEFAULT: Self = if cfg!(feature = "embree") { Self::Embree } else { Self::Native };

    /// Its name, and the library's version where it is one, for logs and headers.
    pub fn label(self) -> String {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => format!("embree {}", ::embree::version()),
            #[cfg(not(feature = "embree"))]
            Self::Embree => "embree".to_owned(),
            Self::Native => "native".to_owned(),
        }
    }
}

/// A point of a primitive, wherever it appears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimitivePoint {
    /// The shape.
    pub shape: ShapeId,
    /// The instance, where the shape belongs to a prototype.
    pub instance: Option<InstanceId>,
    /// The primitive within the shape.
    pub primitive: u32,
    /// The primitive's own parameters: [`RayHit::uv`].
    pub uv: [f32; 2],
}

/// Decides whether a point of a shape with an `alpha` is there for a ray.
pub trait Opacity: Send + Sync {
    /// Whether the surface stops the ray with this seed at `at`. Must give the same answer when asked again: robust traversal may
    /// ask twice.
    fn is_opaque(&self, geometry: &Geometry, at: &PrimitivePoint, opacity_seed: u32) -> bool;
}

/// Why an acceleration structure could not be built.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The backend was left out of this build.
    #[error("this lanternfish was built without the backend \"{0}\" (cargo feature \"{0}\")")]
    Missing(&'static str),
    /// The library ran out of memory.
    #[error("{0}")]
    Memory(String),
    /// The library said no.
    #[error("{0}")]
    Library(String),
    /// The geometry cannot be put into an acceleration structure: too large, too many, too nested.
    #[error("{0}")]
    Geometry(String),
}

/// An acceleration structure over a [`Geometry`].
#[cfg_attr(
    feature = "embree",
    expect(clippy::large_enum_variant, reason = "there is one, and every ray goes through it")
)]
pub enum Tracer {
    /// See [`Backend::Embree`].
    #[cfg(feature = "embree")]
    Embree(super::embree::EmbreeTracer),
    /// See [`Backend::Native`].
    Native(super::native::NativeTracer),
    /// Either of them, listened to by a benchmark.
    Recording(Box<super::recording::RecordingTracer>),
}

impl Tracer {
    /// Builds the acceleration structures, on the current rayon pool. `opacity` is asked only for shapes that have
    /// [`super::Shape::has_opacity`].
    pub fn build(
        geometry: Arc<Geometry>,
        opacity: Option<Arc<dyn Opacity>>,
        backend: Backend,
    ) -> Result<Self, TraceError> {
        match backend {
            #[cfg(feature = "embree")]
            Backend::Embree => Ok(Self::Embree(super::embree::EmbreeTracer::build(geometry, opacity)?)),
            #[cfg(not(feature = "embree"))]
            Backend::Embree => Err(TraceError::Missing("embree")),
            Backend::Native => Ok(Self::Native(super::native::NativeTracer::build(geometry, opacity)?)),
        }
    }

    /// The closest hit before `ray.t_max` on anything but boundaries.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<RayHit> {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(tracer) => tracer.closest(ray),
            Self::Native(tracer) => tracer.closest(ray),
            Self::Recording(tracer) => tracer.closest(ray),
        }
    }

    /// Whether anything but boundaries lies before `ray.t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(tracer) => tracer.occluded(ray),
            Self::Native(tracer) => tracer.occluded(ray),
            Self::Recording(tracer) => tracer.occluded(ray),
        }
    }

    /// Whether `ray` may cross a boundary: false only where it is known in next to no time that it does not.
    #[inline]
    pub fn may_cross(&self, ray: &Ray) -> bool {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(tracer) => tracer.may_cross(ray),
            Self::Native(tracer) => tracer.may_cross(ray),
            Self::Recording(tracer) => tracer.may_cross(ray),
        }
    }

    /// All boundary crossings in [0, `ray.t_max`), appended to `crossings` (cleared first) in order of distance. A crossing on
    /// an edge shared by two triangles may be reported twice; users must treat entering twice as entering once.
    pub fn boundaries(&self, ray: &Ray, crossings: &mut Vec<BoundaryCrossing>) {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(tracer) => tracer.boundaries(ray, crossings),
            Self::Native(tracer) => tracer.boundaries(ray, crossings),
            Self::Recording(tracer) => tracer.boundaries(ray, crossings),
        }
    }

    /// The backend's name, for logs and headers.
    pub fn name(&self) -> String {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(_) => Backend::Embree.label(),
            Self::Native(_) => Backend::Native.label(),
            Self::Recording(tracer) => tracer.inner().name(),
        }
    }

    /// Bytes held by the acceleration structures, as far as known.
    pub fn memory(&self) -> usize {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(tracer) => tracer.memory(),
            Self::Native(tracer) => tracer.memory(),
            Self::Recording(tracer) => tracer.inner().memory(),
        }
    }
}
