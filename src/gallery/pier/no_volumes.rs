//! Stands in for `volumes` in builds without OpenVDB: says that there is no writing .vdb files.

use std::path::Path;

use super::super::GalleryError;

/// Refuses.
pub fn write_fog(_: &Path) -> Result<(), GalleryError> {
    Err(GalleryError::NoVolumes)
}

/// Refuses.
pub fn write_fire(_: &Path) -> Result<(), GalleryError> {
    Err(GalleryError::NoVolumes)
}
