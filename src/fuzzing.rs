//! Readers that only files reach, for the fuzz targets in `fuzz/`: those hand over bytes, millions of times, where the program opens a file. Not a
//! part of the library's interface; whatever else is fuzzed is public anyway.

use std::path::Path;

use crate::geometry::camera::prescription::Prescription;
use crate::medium::grid::nanovdb::{self, NanoFile};
use crate::scene::SceneError;
use crate::scene::pbrt::parameter::spectrum_of_file;
use crate::scene::ply::{self, PlyMesh};

/// What a .ply file of these bytes holds.
pub fn mesh(bytes: &[u8]) -> Result<PlyMesh, Box<SceneError>> {
    ply::parse(bytes, Path::new("fuzz.ply"))
}

/// What a .nvdb file of these bytes holds; no grid of more than `limit` bytes is read.
pub fn volume(bytes: &[u8], limit: u64) -> Result<NanoFile, String> {
    nanovdb::parse(bytes, limit)
}

/// The numbers of pairs of wavelength and value in a spectrum file of this text.
pub fn spectrum(text: &str) -> Result<Vec<f32>, String> {
    spectrum_of_file(text, Path::new("fuzz.spd"))
}

/// Focal length, pupil magnification and stop diameter of the lens that this text describes.
pub fn lens(text: &str) -> Result<[f32; 3], String> {
    let lens = Prescription::parse(text)?;
    Ok([lens.focal_length, lens.pupil_magnification, lens.stop_diameter])
}
