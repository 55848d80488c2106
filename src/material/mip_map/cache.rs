//! Tiles held in memory, up to a limit: what is looked up often stays, what is not goes.
//!
//! Two layers. Each thread remembers the few tiles that it looked at last, which takes neither lock nor shared counter; behind that is one cache for all
//! threads (the crate `quick_cache`: S3-FIFO, in parts with a lock each), where each tile is read by one thread while others that want it wait.

use std::cell::RefCell;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use quick_cache::sync::Cache;
use quick_cache::{DefaultHashBuilder, OptionsBuilder, Weighter};

use super::texels::Texels;

/// A tile among all of the process: a MIP map's number, and the tile's there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TileKey {
    /// [`super::MipMap`]'s, never 0.
    pub map: u32,
    /// Counted over its levels.
    pub tile: u32,
}

/// Tiles that a thread remembers.
const REMEMBERED: usize = 32;

/// What a tile takes besides its texels: entries of tables, the allocation's own.
const OVERHEAD: u64 = 128;

/// What was looked up and what that took.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct TileCacheStatistics {
    /// The most bytes that may be held.
    pub limit: u64,
    /// The most that were, as the threads' common cache counts them. What threads remember besides is not in it; the limit has room for that.
    pub held: u64,
    /// Look-ups of tiles, nearly: each thread adds its own up now and then.
    pub lookups: u64,
    /// Of those, tiles that had to be read.
    pub reads: u64,
    /// The share of look-ups that found their tile in memory.
    pub hit_rate: f64,
}

/// The cache behind the threads' own.
#[derive(Debug)]
pub struct TileCache {
    tiles: Cache<TileKey, Arc<Texels>, Weight>,
    limit: u64,
    /// However little memory is left, so many bytes of tiles are held.
    least: u64,
    held: AtomicU64,
    lookups: AtomicU64,
    reads: AtomicU64,
}

#[derive(Clone, Copy, Debug)]
struct Weight;

impl Weighter<TileKey, Arc<Texels>> for Weight {
    fn weight(&self, _: &TileKey, tile: &Arc<Texels>) -> u64 {
        tile.as_bytes().len() as u64 + OVERHEAD
    }
}

/// What a thread remembers: a tile's place follows from its key.
struct Recent {
    keys: [TileKey; REMEMBERED],
    tiles: [Option<Arc<Texels>>; REMEMBERED],
    /// Not yet added up.
    lookups: u64,
}

thread_local! {
    static RECENT: RefCell<Recent> = const {
        RefCell::new(Recent { keys: [TileKey { map: 0, tile: 0 }; REMEMBERED], tiles: [const { None }; REMEMBERED], lookups: 0 })
    };
}

impl TileCache {
    /// Holds at most `limit` bytes, of tiles of at most `largest`, for so many threads.
    pub fn new(limit: u64, largest: usize, threads: usize) -> Self {
        let largest = largest as u64 + OVERHEAD;
        // What threads remember may have gone from the cache.
        let remembered = (threads * REMEMBERED) as u64 * largest;
        let shared = limit.saturating_sub(remembered).max(limit / 2);
        // No part may be so small that it holds a few tiles only: what falls into which is chance.
        let parts = (shared / (64 * largest)).clamp(1, 4 * threads.max(1) as u64) as usize;
        let options = OptionsBuilder::new()
            .weight_capacity(shared)
            .estimated_items_capacity((shared / largest).clamp(1, 1 << 16) as usize)
            .shards(parts)
            .build();
        let options = options.expect("all that must be stated is");
        let tiles = Cache::with_options(options, Weight, DefaultHashBuilder::default(), Default::default());
        let least = 8 * threads as u64 * largest;
        Self { tiles, limit, least, held: AtomicU64::new(0), lookups: AtomicU64::new(0), reads: AtomicU64::new(0) }
    }

    /// Looks at a tile, which `read` reads where nobody holds it.
    ///
    /// # Errors
    /// What `read` says.
    #[inline]
    pub fn with<R>(
        &self,
        key: TileKey,
        read: impl FnOnce() -> io::Result<Texels>,
        look: impl FnOnce(&Texels) -> R,
    ) -> io::Result<R> {
        RECENT.with_borrow_mut(|recent| {
            recent.lookups += 1;
            let place = place(key);
            if let (true, Some(tile)) = (recent.keys[place] == key, &recent.tiles[place]) {
                return Ok(look(tile));
            }
            let tile = self.shared(key, recent, read)?;
            let result = look(&tile);
            (recent.keys[place], recent.tiles[place]) = (key, Some(tile));
            Ok(result)
        })
    }

    #[cold]
    fn shared(
        &self,
        key: TileKey,
        recent: &mut Recent,
        read: impl FnOnce() -> io::Result<Texels>,
    ) -> io::Result<Arc<Texels>> {
        self.lookups.fetch_add(std::mem::take(&mut recent.lookups), Ordering::Relaxed);
        let tile = self.tiles.get_or_insert_with(&key, || {
            self.reads.fetch_add(1, Ordering::Relaxed);
            read().map(Arc::new)
        });
        self.held.fetch_max(self.tiles.weight(), Ordering::Relaxed);
        tile
    }

    /// Lets tiles go that take so many bytes, but no more than leaves a few, and holds that many less from now on. Returns how many went.
    pub fn shed(&self, bytes: u64) -> u64 {
        let before = self.tiles.weight();
        let fewest = self.least.min(self.tiles.capacity());
        self.tiles.set_capacity(before.saturating_sub(bytes).max(fewest));
        before.saturating_sub(self.tiles.weight())
    }

    /// What was done so far.
    pub fn statistics(&self) -> TileCacheStatistics {
        let [held, lookups, reads] = [&self.held, &self.lookups, &self.reads].map(|n| n.load(Ordering::Relaxed));
        let hit_rate = 1.0 - reads as f64 / lookups.max(reads).max(1) as f64;
        TileCacheStatistics { limit: self.limit, held, lookups, reads, hit_rate }
    }
}

/// Where a thread remembers a tile: neighbours, of whichever level, fall apart.
#[inline]
fn place(key: TileKey) -> usize {
    let both = u64::from(key.map) << 32 | u64::from(key.tile);
    (both.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 59) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_goes_and_is_read_again() {
        let read = |value: u8| move || Ok(Texels::Bytes(vec![value; 4096].into()));
        let value = |texels: &Texels| texels.as_bytes()[0];
        let cache = TileCache::new(200 << 10, 4096, 1);
        let mut looked = 0;
        for round in 0..3 {
            for tile in 0..200u32 {
                let key = TileKey { map: u32::MAX - 7, tile };
                for _ in 0..5 {
                    looked += 1;
                    let found = cache.with(key, read(tile as u8), value).expect("it can be read");
                    assert_eq!(found, tile as u8, "{round}");
                }
            }
        }
        let TileCacheStatistics { held, lookups, reads, hit_rate, .. } = cache.statistics();
        assert!(held <= 200 << 10, "{held}");
        assert!(lookups <= looked && lookups + 5 > looked, "{lookups} {looked}");
        // 800 kB pass three times through 100 that are shared: most tiles are gone when their turn comes.
        assert!((300..=600).contains(&reads), "{reads}");
        assert!((hit_rate - (1.0 - reads as f64 / lookups as f64)).abs() < 1e-9);
    }

    #[test]
    fn tiles_make_way_and_come_back() {
        let cache = TileCache::new(4 << 20, 4096, 1);
        let look = |tile: u32| {
            let key = TileKey { map: u32::MAX - 9, tile };
            let read = || Ok(Texels::Bytes(vec![tile as u8; 4096].into()));
            assert_eq!(cache.with(key, read, |texels| texels.as_bytes()[0]).expect("it can be read"), tile as u8);
        };
        (0..200).for_each(look);
        let held = cache.tiles.weight();
        assert!(held > 200 * 4096);
        let gone = cache.shed(held / 2);
        assert!(gone >= held / 2 && cache.tiles.weight() == held - gone, "{gone} of {held}");
        (0..200).for_each(look);
        assert!(cache.tiles.weight() <= held - held / 2, "{}", cache.tiles.weight());
        cache.shed(u64::MAX);
        assert!(cache.tiles.weight() <= 8 * (4096 + OVERHEAD));
        (0..200).for_each(look);
    }

    #[test]
    fn what_fits_is_read_once() {
        let cache = TileCache::new(4 << 20, 4096, 2);
        for _ in 0..10 {
            for tile in 0..200u32 {
                let key = TileKey { map: u32::MAX - 8, tile };
                cache.with(key, || Ok(Texels::Bytes(vec![0; 4096].into())), |_| ()).expect("it can be read");
            }
        }
        assert_eq!(cache.statistics().reads, 200);
        let failed = cache.with(TileKey { map: u32::MAX - 8, tile: 999 }, || Err(io::Error::other("no")), |_| ());
        assert!(failed.is_err());
    }
}
