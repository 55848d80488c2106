//! What a scene file says: [`SceneDescription`], with the line each thing was said on and nothing derived.
//! One format today: pbrt-v4's text (`pbrt/`), with the meshes it refers to (`ply.rs`).

pub mod description;
pub mod error;
pub mod lint;
mod locate;
pub mod name;
pub mod params;
pub mod pbrt;
pub mod ply;
pub mod source;

pub use description::*;
pub use error::{SceneError, SceneErrorKind, Warning, Warnings};
pub(crate) use locate::{locate, with_slashes};
pub use name::{Name, Names};
pub use params::{Param, ParamSet, ParamValue, TextureOr};
pub(crate) use pbrt::finish::undefined;
pub use pbrt::load;
pub(crate) use pbrt::{did_you_mean, older};
pub use source::{FileId, Sources, Span};
