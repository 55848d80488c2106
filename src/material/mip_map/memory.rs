//! How much memory images on surfaces may take, and what they do where that is not enough.
//!
//! Images that fit, all levels of all of them, are read before rendering and stay. Where they do not, each is read when somebody first looks at it, cut into
//! tiles on disk, and the tiles looked at of late are held.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use rayon::prelude::*;

use bytesize::ByteSize;

use super::MipMap;
use super::cache::{TileCache, TileCacheStatistics};
use crate::scene::{SceneError, SceneErrorKind, Span, Warnings};
use crate::system::memory;

/// What one image takes for a while is not worth a word below this.
const WORTH_A_WARNING: u64 = 1 << 20;

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
    /// The process's limit on memory leaves too little to read it.
    NoMemory {
        /// The image.
        path: PathBuf,
        /// Where the scene names it.
        span: Span,
        /// What reading it takes, in bytes.
        bytes: u64,
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
    /// Bytes that images may take: those of the settings, or less where the process has less.
    limit: AtomicU64,
    /// Whether any fault ends the render.
    strict: bool,
    /// There once it is known that not everything fits.
    cache: OnceLock<TileCache>,
    faults: Mutex<Vec<Fault>>,
    has_failed: AtomicBool,
    /// Bytes that images take while they are cut into tiles.
    cutting: Mutex<u64>,
    /// What the last of them took and gave back, unless another one has it.
    returned: AtomicU64,
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
            limit: AtomicU64::new(settings.limit),
            settings,
            strict,
            cache: OnceLock::new(),
            faults: Mutex::default(),
            has_failed: AtomicBool::new(false),
            cutting: Mutex::default(),
            returned: AtomicU64::new(0),
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

    fn limit(&self) -> u64 {
        self.limit.load(Ordering::Relaxed)
    }

    /// What part of its memory images that are cut into tiles may have.
    pub(super) fn cutting_limit(&self) -> u64 {
        self.limit() / CUTTING
    }

    /// What was asked for.
    pub fn asked(&self) -> u64 {
        self.settings.limit
    }

    /// The process leaves images no more than so many bytes. To be called before [`Self::settle`].
    pub fn fit<'a>(&self, bytes: u64, images: impl Iterator<Item = &'a MipMap>, warnings: &mut Warnings) {
        let asked = self.limit.fetch_min(bytes, Ordering::Relaxed);
        let whole: u64 = images.map(MipMap::whole).sum();
        if bytes < asked && bytes < whole {
            let (bytes, asked) = (ByteSize(bytes), ByteSize(asked));
            warnings.add(None, format!("images on surfaces have {bytes} of memory in place of {asked} (--texture-memory): --memory-limit leaves no more to them"));
        }
    }

    /// Whether the process's limit leaves so many bytes, if tiles make way. What was given back may be counted as taken, until it is taken again: so what the image before had is there
    /// for this one, and a tenth more is allowed.
    pub(super) fn has_left(&self, bytes: u64) -> bool {
        let Some(limit) = memory::limit() else { return true };
        let left = limit.saturating_sub(memory::resident());
        if left >= bytes {
            return true;
        }
        let left = left + self.shed(bytes - left) + limit / 10;
        left >= bytes || left + self.returned.swap(0, Ordering::Relaxed) >= bytes
    }

    /// An image that took so many bytes was cut into tiles.
    pub(super) fn was_cut(&self, bytes: u64) {
        self.returned.store(bytes, Ordering::Relaxed);
    }

    /// Lets tiles go that take so many bytes, as far as there are so many, and holds that many less from now on. Returns how many went.
    pub fn shed(&self, bytes: u64) -> u64 {
        self.cache().map_or(0, |cache| cache.shed(bytes))
    }

    /// Waits until there is room to cut an image into tiles that takes so many bytes meanwhile; one that is too large for the room
    /// that there is waits until nobody else is at it.
    pub(super) fn room(&self, bytes: u64) -> Room<'_> {
        let mut cutting = self.cutting();
        while *cutting > 0 && *cutting + bytes > self.cutting_limit() {
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
        if self.strict || matches!(fault, Fault::NoRoom { .. } | Fault::NoMemory { .. }) {
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

    /// All images are known: reads them if they fit, else sees to it that they are read as needed. Names those that take more than all of the memory when their turn
    /// comes.
    pub fn settle<'a>(&self, images: impl Iterator<Item = &'a MipMap>, warnings: &mut Warnings) {
        let images: Vec<&MipMap> = images.collect();
        let whole: u64 = images.iter().map(|image| image.whole()).sum();
        if whole <= self.limit() {
            images.par_iter().for_each(|image| {
                image.view();
            });
            return;
        }
        let limit = self.limit();
        let much = limit.max(WORTH_A_WARNING);
        for image in images.iter().filter(|image| image.bytes_at_once() > much && image.is_cut_at_once()) {
            let (path, bytes, limit) = (image.path.display(), ByteSize(image.bytes_at_once()), ByteSize(limit));
            let message = format!(
                "cutting {path} into tiles takes {bytes} of memory for a while, more than the {limit} that images may take (--texture-memory): a PNG that is not interlaced is cut row by row"
            );
            warnings.add(Some(image.span), message);
        }
        let resident: u64 = images.iter().map(|image| image.resident() as u64).sum();
        let largest = images.iter().map(|image| image.largest_tile()).max().unwrap_or(0);
        let limit = self.limit().saturating_sub(resident + self.cutting_limit());
        let _ = self.cache.set(TileCache::new(limit, largest, rayon::current_num_threads()));
    }

    /// Takes down what went wrong so far as warnings.
    ///
    /// # Errors
    /// `System` where tiles could not be written, `Limit` where an image could not be read for lack of memory, and under `strict` the first fault of any kind.
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
                Fault::NoMemory { path, span, bytes } => {
                    let message = format!(
                        "reading {} takes about {} of memory, more than is left",
                        path.display(),
                        ByteSize(bytes)
                    );
                    return Err(SceneError::at(span, SceneErrorKind::Limit(message)));
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
        let (Self::Unreadable { path, .. }
        | Self::NotFinite { path, .. }
        | Self::NoMemory { path, .. }
        | Self::NoRoom { path, .. }) = self;
        path
    }
}
