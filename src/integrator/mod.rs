//! The path: surfaces, media, next-event estimation, MIS. [`path`] reads top to bottom; what happens on the way is in [`through_media`], what at its end in
//! [`at_surface`], what a path carries in [`walk`].

mod at_surface;
pub mod counters;
pub mod direct;
pub mod flight;
mod fog_glow;
mod glow_line;
pub mod in_scatter;
mod layers;
pub mod light_choice;
pub mod path;
pub mod record;
mod through_media;
pub mod view_ray;
mod volume_light;
mod walk;
pub mod world;

pub use counters::Counters;
pub use light_choice::LightChoice;
pub use path::{CameraRay, PathSettings, Scratch, trace_path};
pub use world::World;
