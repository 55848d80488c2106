//! Whether the image fits into memory, asked before it is allocated.
//!
//! Only the film is foreseen. Everything else in memory comes from files that are there, and reading them is bounded by
//! limits of its own (text by what is left while its shapes pile up, images by size, volumes by the reader process's memory).

use super::splitting::Splitting;
use crate::film::{Film, FilmSettings};
use crate::scene::{SceneDescription, SceneError, SceneErrorKind};
use crate::system::memory::available;

/// Bytes a pixel for writing the image: 26 channels of 4 bytes, once as planes and once as the encoder holds them.
const WRITING: usize = 2 * 26 * 4;

/// Bytes for rendering and writing an image.
pub fn of_film(film: &FilmSettings) -> usize {
    Film::memory_for(film, true).saturating_add(film.bounds.area().saturating_mul(WRITING))
}

/// Refuses a film that does not fit into what is left.
///
/// # Errors
/// `Limit`, at the film's place, with both sizes.
pub fn check_film(scene: &SceneDescription, film: &FilmSettings) -> Result<(), Box<SceneError>> {
    // And for splitting camera rays, should the scene have a use for that.
    let needed = of_film(film).saturating_add(Splitting::memory_for(film.bounds.area())) as u64;
    match available() {
        Some(left) if needed > left => {
            let (width, height) = (film.bounds.width(), film.bounds.height());
            let message = format!(
                "an image of {width} × {height} pixels takes about {} of memory, {} are left",
                gibibytes(needed),
                gibibytes(left)
            );
            Err(SceneError::at(scene.film.span(), SceneErrorKind::Limit(message))
                .help("render it in parts with --crop, or smaller with --resolution"))
        }
        _ => Ok(()),
    }
}

fn gibibytes(bytes: u64) -> String {
    format!("{:.2} GiB", bytes as f64 / f64::from(1 << 30))
}
