//! A tracer that writes down what it is asked, so that a benchmark can ask the very same again. Renders never use it.

use std::sync::{Mutex, PoisonError};

use super::{BoundaryCrossing, Ray, RayHit, Tracer};

/// What was asked about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// [`Tracer::closest`].
    Closest,
    /// [`Tracer::occluded`].
    Occlusion,
}

/// A tracer that keeps every closest-hit and occlusion query in order, over one that answers them. Queries for boundaries
/// are passed on and not kept.
pub struct RecordingTracer {
    inner: Tracer,
    queries: Mutex<Vec<(Query, Ray)>>,
}

impl RecordingTracer {
    /// Listens to what `inner` is asked.
    pub fn new(inner: Tracer) -> Self {
        Self { inner, queries: Mutex::default() }
    }

    /// The tracer that answered, and what it was asked. In the order of the path if one thread rendered.
    pub fn finish(self) -> (Tracer, Vec<(Query, Ray)>) {
        (self.inner, self.queries.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    fn keep(&self, query: Query, ray: &Ray) {
        self.queries.lock().unwrap_or_else(PoisonError::into_inner).push((query, *ray));
    }

    /// See [`Tracer::closest`].
    pub fn closest(&self, ray: &Ray) -> Option<RayHit> {
        self.keep(Query::Closest, ray);
        self.inner.closest(ray)
    }

    /// See [`Tracer::occluded`].
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.keep(Query::Occlusion, ray);
        self.inner.occluded(ray)
    }

    /// See [`Tracer::may_cross`].
    pub fn may_cross(&self, ray: &Ray) -> bool {
        self.inner.may_cross(ray)
    }

    /// See [`Tracer::boundaries`].
    pub fn boundaries(&self, ray: &Ray, crossings: &mut Vec<BoundaryCrossing>) {
        self.inner.boundaries(ray, crossings);
    }

    /// The tracer that answers.
    pub fn inner(&self) -> &Tracer {
        &self.inner
    }
}
