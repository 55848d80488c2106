//! Where the seconds went.

use serde::Serialize;

/// Wall-clock seconds of each step of a render.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Timings {
    /// Reading and parsing the scene file.
    pub parse: f64,
    /// Reading volumes and textures.
    pub volumes_and_textures: f64,
    /// Making shapes and instances.
    pub geometry_load: f64,
    /// Building acceleration structures.
    pub geometry_build: f64,
    /// Setting lights and their selection up.
    pub lights: f64,
    /// Building cache points.
    pub cache_points: f64,
    /// From the last of these to the first finished tile.
    pub first_sample: f64,
    /// Tracing.
    pub render: f64,
    /// Writing images.
    pub write: f64,
}

impl Timings {
    /// All steps together. Rendering holds the time to the first tile.
    pub fn total(&self) -> f64 {
        let Self {
            parse,
            volumes_and_textures,
            geometry_load,
            geometry_build,
            lights,
            cache_points,
            render,
            write,
            ..
        } = self;
        parse + volumes_and_textures + geometry_load + geometry_build + lights + cache_points + render + write
    }
}
