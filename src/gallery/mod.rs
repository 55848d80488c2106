//! The project's own scenes, each written by code to a folder: pbrt text, .vdb volumes and PNG textures. Nothing random is
//! left to chance: the same scene always comes out the same.
//!
//! A scene is a file with a row in [`SCENES`].

mod mesh;
mod pier;
mod text;

use std::path::{Path, PathBuf};

use crate::system::output::OutputError;

/// A scene that can be written.
#[derive(Clone, Copy, Debug)]
pub struct GalleryScene {
    /// Its name on the command line; `name.pbrt` is the file to render.
    pub name: &'static str,
    /// What is to be seen, in a line.
    pub description: &'static str,
    write: fn(&Path) -> Result<(), GalleryError>,
}

/// Every scene there is.
pub const SCENES: &[GalleryScene] = &[GalleryScene {
    name: "pier",
    description: "a pier at night: several hundred lanterns, fog over the water, a fire on a raft",
    write: pier::write,
}];

/// Why a scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum GalleryError {
    /// A file or the folder cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scene has volumes and this build cannot write them.
    #[error("this build cannot write .vdb files: build with the cargo feature \"openvdb\"")]
    NoVolumes,
}

/// The scene called `name`.
pub fn find(name: &str) -> Option<&'static GalleryScene> {
    SCENES.iter().find(|scene| scene.name == name)
}

impl GalleryScene {
    /// Writes the scene's files to `folder`, which is made if it is not there; returns the file to render. Files of the
    /// same names are replaced.
    ///
    /// # Errors
    /// What cannot be written, and builds without OpenVDB for scenes that have volumes.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, GalleryError> {
        std::fs::create_dir_all(folder).map_err(|error| OutputError::new(folder, error))?;
        (self.write)(folder)?;
        Ok(folder.join(self.name).with_extension("pbrt"))
    }
}
