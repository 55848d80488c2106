//! Whether the image fits into memory, asked before it is allocated, and how a limit on the memory of the process is shared.
//!
//! The film is foreseen. Everything else in memory comes from files that are there, and reading them is bounded by
//! limits of its own (text by what is left while its shapes pile up, images by size, volumes by the reader process's memory). Where the process has a limit
//! ([`system::memory::set_limit`](crate::system::memory::set_limit)) caches get what the rest leaves, and what has no room is told with what took it.

use bytesize::ByteSize;

use super::splitting::Splitting;
use crate::cache_points::seed::{MOST_IN_BOXES, MOST_PILOTS};
use crate::cache_points::{CacheSettings, CacheStatistics};
use crate::film::{Film, FilmSettings};
use crate::geometry::Geometry;
use crate::scene::{SceneDescription, SceneError, SceneErrorKind, Warnings};
use crate::system::memory::{available, limit, resident};
use crate::system::taken;

/// Bytes that an acceleration structure takes for a primitive while it is built, about: of a ball of 2.1 million triangles Embree's takes 70 in the end, and the native
/// one took 330 on its way.
const STRUCTURE: u64 = 330;

/// Bytes that a candidate for a cache point takes while points are made of candidates, and what stays of it: in `house`, with all of 1.1 million, 664.
const CANDIDATE: u64 = 700;

/// Cache points may take this part of the limit.
const CACHE_POINTS: u64 = 4;

/// The process has come to its limit on memory.
#[derive(Debug, thiserror::Error)]
#[error("out of memory: {0}")]
pub struct ExhaustedMemory(String);

impl ExhaustedMemory {
    /// That of this moment, with what took most.
    pub fn now() -> Self {
        Self(account().unwrap_or_else(|| format!("{} are resident", ByteSize(resident()))))
    }
}

/// How much of the limit is taken, and by what; `None` where there is no limit.
pub fn account() -> Option<String> {
    let (limit, resident) = (ByteSize(limit()?), ByteSize(resident()));
    Some(format!("{resident} are in memory, --memory-limit is {limit}: {}", taken::largest()))
}

/// Bytes that images on surfaces may have at most where `asked` was asked for: under a limit half of what the image, an acceleration structure that is still to be
/// built and all that is in memory now leave of it.
pub fn for_textures(asked: u64, film: &FilmSettings, geometry: &Geometry) -> u64 {
    let Some(limit) = limit() else { return asked };
    let primitives: u64 = geometry.shapes.iter().map(|shape| u64::from(shape.primitive_count())).sum();
    let others = (of_film(film) as u64).saturating_add(primitives * STRUCTURE);
    asked.min(limit.saturating_sub(resident()).saturating_sub(others) / 2)
}

/// The same settings with no more candidates than suit the limit, where there is one. What is left at the moment has no say in it: images are to be the same to the
/// last bit whenever they are rendered.
pub fn for_cache_points(settings: CacheSettings) -> CacheSettings {
    let fits = limit().map(|limit| u32::try_from(limit / CACHE_POINTS / CANDIDATE).unwrap_or(u32::MAX));
    let most = fits.filter(|&fits| (fits as usize) < MOST_PILOTS + MOST_IN_BOXES);
    let candidates = most.map(|most| settings.candidates.map_or(most, |asked| asked.min(most)));
    CacheSettings { candidates: candidates.or(settings.candidates), ..settings }
}

/// How many candidates cache points came of, where [`for_cache_points`] left them fewer than they would have had with `settings`.
pub fn few_candidates(statistics: &CacheStatistics, settings: CacheSettings) -> Option<u32> {
    let fitted = for_cache_points(settings);
    let are_used_up = |most: &u32| statistics.pilots + statistics.in_boxes >= *most as usize;
    fitted.candidates.filter(are_used_up).filter(|_| fitted != settings)
}

/// Warns where that is so.
pub fn warn_few_candidates(statistics: &CacheStatistics, settings: CacheSettings, warnings: &mut Warnings) {
    if let Some(most) = few_candidates(statistics, settings) {
        warnings.add(None, format!("cache points come of {most} candidates: --memory-limit leaves no more to them"));
    }
}

/// Bytes a pixel for writing the image: 27 channels of 4 bytes, and 3 for a PNG.
const WRITING: usize = (27 + 3) * 4;

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
