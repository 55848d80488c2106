//! All files that a scene is made of.

use std::path::{Path, PathBuf};

use crate::light::ies::read::tilt_file;
use crate::scene::{SceneDescription, Sources};

/// The files that `scene` was read from, spectra among them, those that it names, whether or not anything uses them, and those that these name: what
/// photometric files say of tilted luminaires. A file may be there more than once.
pub fn inputs(scene: &SceneDescription, sources: &Sources) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = sources.paths().map(Path::to_owned).chain(scene.named_files()).collect();
    // Lights by the thousand may name one file.
    let mut photometric: Vec<PathBuf> = scene.files_of(&["ies"]).collect();
    photometric.sort_unstable();
    photometric.dedup();
    files.extend(photometric.iter().filter_map(|file| tilt_file(file)));
    files
}
