//! A safe wrapper of the parts of Embree that a renderer uses, over Embree 4 or 3.13 (see `embree4-sys`).
//!
//! A [`Device`] makes [`Geometry`]s; a [`SceneBuilder`] takes them in; [`SceneBuilder::commit`] makes the immutable
//! [`Scene`], which answers rays from any number of threads. Everything that Embree reads through pointers (buffers, user
//! geometry, filters, instanced scenes) is owned by the scene, so nothing can be freed or changed under a query.
//!
//! All `unsafe` of the Embree backend is in this crate. Embree's callbacks are Rust traits here; a panic in one is caught
//! before it reaches C and goes on in the thread that asked, or becomes the error of the commit that met it.
//!
//! Source: Embree's API reference, versions 3.13 and 4.3.

#![warn(missing_docs)]

mod callbacks;
mod device;
mod geometry;
mod query;
mod scene;

pub use device::{Device, Error};
pub use embree4_sys::header_version as version;
pub use geometry::{CurveKind, Filter, Geometry, HitFilter, QuaternionKey, UserGeometry, UserHit};
pub use query::{Candidate, Hit, Ray};
pub use scene::{Scene, SceneBuilder};
