//! How much memory images on surfaces may take, and what they do where that is not enough.
//!
//! Images that fit, all levels of all of them, are read before rendering and stay. Where they do not, each is read when somebody first looks at it, cut into
//! tiles on disk, and the tiles looked at of late are held.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use rayon::prelude::*;

use super::MipMap;
use super::cache::{TileCache, TileCacheStatistics};
use crate::scene::{SceneError, SceneErrorKind, Span, Warnings};

/// Images that are cut into tiles have this part of the memory, tiles that are held have the rest.
const CUTTING: u64 = 4;

/// What may be said about the memory of images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureSettings {
    /// Bytes that images on surfaces may take.
    pub limit: u64,
    /// Where tiles are kept from render to render; `None` for nowhere.
    pub folder: Option<PathBuf>,
}

impl Default for TextureSettings {
    fn default() -> Self {
        Self { limit: 2 << 30, folder: None }
    }
}

/// What went wrong with an image.
#[derive(Clone, Debug)]
pub enum Fault {
    /// It cannot be read.
    Unreadable {
        /// The image.
        path: PathBuf,
        /// Where the scene names it.
        span: Span,
        /// In words.
        reason: String,
        /// What happens without it, in words.
        instead: &'static str,
    },
    /// It holds values that are not finite.
    NotFinite {
        /// The image.
        path: PathBuf,
        /// Where the scene names it.
        span: Span,
        /// How many.
        count: usize,
    },
    /// Its tiles cannot be written.
    NoRoom {
        /// The image.
        path: PathBuf,
        /// Where they should have gone.
        folder: PathBuf,
        /// In words.
        reason: String,
    },
}

/// What the images of a scene share.
#[derive(Debug)]
pub struct TextureMemory {
    settings: TextureSettings,
    /// Whether any fault ends the render.
    strict: bool,
    /// There once it is known that not everything fits.
    cache: OnceLock<TileCache>,
    faults: Mutex<Vec<Fault>>,
    has_failed: AtomicBool,
    /// Bytes that images take while they are cut into tiles.
    cutting: Mutex<u64>,
    /// Some of them were given back.
    given_back: Condvar,
}

/// Memory to cut an image into tiles, until it is dropped.
pub(super) struct Room<'a> {
    memory: &'a TextureMemory,
    bytes: u64,
}

impl Drop for Room<'_> {
    fn drop(&mut self) {
        *self.memory.cutting() -= self.bytes;
        self.memory.given_back.notify_all();
    }
}

impl TextureMemory {
    /// Nothing is known of the images yet.
    pub fn new(settings: TextureSettings, strict: bool) -> Self {
        Self {
            settings,
            strict,
            cache: OnceLock::new(),
            faults: Mutex::default(),
            has_failed: AtomicBool::new(false),
            cutting: Mutex::default(),
            given_back: Condvar::default(),
        }
    }

    pub(super) fn folder(&self) -> Option<&Path> {
        self.settings.folder.as_deref()
    }

    /// Where tiles are held, if not everything fits.
    #[inline]
    pub fn cache(&self) -> Option<&TileCache> {
        self.cache.get()
    }

    /// What the cache did, if there is one.
    pub fn statistics(&self) -> Option<TileCacheStatistics> {
        self.cache().map(TileCache::statistics)
    }

    /// Waits until there is room to cut an image into tiles that takes so many bytes meanwhile; one that is too large for the room
    /// that there is waits until nobody else is at it.
    pub(super) fn room(&self, bytes: u64) -> Room<'_> {
        let mut cutting = self.cutting();
        while *cutting > 0 && *cutting + bytes > self.settings.limit / CUTTING {
            cutting = self.given_back.wait(cutting).unwrap_or_else(PoisonError::into_inner);
        }
        *cutting += bytes;
        Room { memory: self, bytes }
    }

    fn cutting(&self) -> MutexGuard<'_, u64> {
        self.cutting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a fault, once for each image.
    pub(super) fn note(&self, fault: Fault) {
        if self.strict || matches!(fault, Fault::NoRoom { .. }) {
            self.has_failed.store(true, Ordering::Relaxed);
        }
        let mut faults = self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        if !faults.iter().any(|known| known.path() == fault.path()) {
            faults.push(fault);
        }
    }

    /// Whether there is no point in rendering on.
    #[inline]
    pub fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// All images are known: reads them if they fit, else sees to it that they are read as needed.
    pub fn settle<'a>(&self, images: impl Iterator<Item = &'a MipMap>) {
        let images: Vec<&MipMap> = images.collect();
        let whole: u64 = images.iter().map(|image| image.whole()).sum();
        if whole <= self.settings.limit {
            images.par_iter().for_each(|image| {
                image.view();
            });
            return;
        }
        let resident: u64 = images.iter().map(|image| image.resident() as u64).sum();
        let largest = images.iter().map(|image| image.largest_tile()).max().unwrap_or(0);
        let cutting = self.settings.limit / CUTTING;
        let limit = self.settings.limit.saturating_sub(resident + cutting);
        let _ = self.cache.set(TileCache::new(limit, largest, rayon::current_num_threads()));
    }

    /// Takes down what went wrong so far as warnings.
    ///
    /// # Errors
    /// `System` where tiles could not be written, and under `strict` the first fault of any kind.
    pub fn report(&self, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
        let mut faults = std::mem::take(&mut *self.faults.lock().unwrap_or_else(PoisonError::into_inner));
        // They come in the order of threads.
        faults.sort_by(|a, b| a.path().cmp(b.path()));
        for fault in faults {
            match fault {
                Fault::NoRoom { path, folder, reason } => {
                    let message =
                        format!("the tiles of {} cannot be written to {}: {reason}", path.display(), folder.display());
                    return Err(SceneError::new(SceneErrorKind::System(message)).help("--texture-cache names a folder with room, --texture-memory says how much memory images may take"));
                }
                Fault::Unreadable { path, span, reason, .. } if self.strict => {
                    return Err(SceneError::at(span, SceneErrorKind::File { path, reason }));
                }
                Fault::Unreadable { path, span, reason, instead } => {
                    warnings.add(Some(span), format!("cannot read {}: {reason}; {instead}", path.display()));
                }
                Fault::NotFinite { path, span, count } => {
                    let message = format!("{count} values of {} are not finite: 0 is used instead", path.display());
                    if self.strict {
                        return Err(SceneError::at(span, SceneErrorKind::File { path, reason: message }));
                    }
                    warnings.add(Some(span), message);
                }
            }
        }
        Ok(())
    }
}

impl Fault {
    fn path(&self) -> &Path {
        let (Self::Unreadable { path, .. } | Self::NotFinite { path, .. } | Self::NoRoom { path, .. }) = self;
        path
    }
}
