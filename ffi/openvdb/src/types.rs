//! What a file holds, in Rust's own types.

use std::path::PathBuf;
use std::time::Duration;

use half::f16;

/// What went wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum VdbError {
    /// The file cannot be opened or read at all.
    #[error("{path}: {reason}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why, in words.
        reason: String,
    },
    /// The file is not OpenVDB's or is damaged.
    #[error("{path}: damaged or not a readable OpenVDB file ({reason})")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Why, in words.
        reason: String,
    },
    /// Reading needs more memory or time than is allowed.
    #[error("{path}: {reason}")]
    Limit {
        /// The file.
        path: PathBuf,
        /// Which limit, in words.
        reason: String,
    },
    /// The worker process, which reads and writes, could not be started or does not speak our language: a fault of the
    /// installation, not of the file.
    #[error("cannot use {program}, the program that reads and writes OpenVDB files: {reason}")]
    Reader {
        /// The executable.
        program: PathBuf,
        /// Why, in words.
        reason: String,
    },
    /// Somebody stopped the reader process.
    #[error("{path}: its reader was stopped by {signal}")]
    Stopped {
        /// The file.
        path: PathBuf,
        /// The signal's name.
        signal: &'static str,
    },
    /// Writing failed.
    #[error("cannot write OpenVDB grids: {0}")]
    Write(String),
}

/// Limits on the reader process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Address space in bytes, most of which is only reserved; `None` derives it from the file's size.
    pub memory: Option<u64>,
    /// Memory in bytes that may be written to (resident or not), and what all grids may take; `None` derives it from the file's size, and
    /// it is never more than that.
    pub data: Option<u64>,
    /// Processor time; `None` derives it from the file's size.
    pub cpu: Option<Duration>,
    /// Wall-clock time; `None` derives it from the file's size.
    pub wall: Option<Duration>,
    /// Whether the values are wanted, or only what the grids are (values count as absent then).
    pub values: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: None, data: None, cpu: None, wall: None, values: true }
    }
}

/// Limits in force for one file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Address space in bytes.
    pub memory: u64,
    /// Memory in bytes that may be written to.
    pub data: u64,
    /// Processor time.
    pub cpu: Duration,
    /// Wall-clock time.
    pub wall: Duration,
}

impl Bounds {
    /// Bytes of memory for each byte of a file. A leaf of 8³ voxels that are all alike takes some 170 bytes of a packed file, and in memory (as OpenVDB
    /// holds it and as it is handed on) 4 KiB if its values are floats, 12 KiB if they are vectors of them, 18 KiB if those are of doubles. 2.5 MB of
    /// smoke as it comes need 8 MiB.
    const SPREAD: u64 = 100;

    /// For a file of `length` bytes. A small file that is damaged takes less than 2 s and 1 GiB, whatever it says: libraries take some 35 MiB and
    /// 30 ms of that. One processor of 2023 reads 1 MB of a real file in 6 to 25 ms, in
    /// 130 ms where it is packed as well as can be, and gets 500 ms for it.
    fn of(length: u64) -> Self {
        let packed = length.saturating_mul(Self::SPREAD);
        Self {
            memory: (4u64 << 30).saturating_add(packed),
            data: (768u64 << 20).saturating_add(packed),
            cpu: Duration::from_secs(1 + length / 2_000_000),
            wall: Duration::from_secs(60 + length / 500_000),
        }
    }
}

impl Limits {
    /// The limits in force for a file of `length` bytes.
    pub fn resolve(&self, length: u64) -> Bounds {
        let derived = Bounds::of(length);
        let memory = self.memory.unwrap_or(derived.memory);
        Bounds {
            memory,
            data: self.data.map_or(derived.data, |data| data.min(derived.data)).min(memory),
            cpu: self.cpu.unwrap_or(derived.cpu),
            wall: self.wall.unwrap_or(derived.wall),
        }
    }
}

/// What a grid's values mean, by its own account.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridClass {
    /// A density.
    FogVolume,
    /// A signed distance (converted to a fog volume when read).
    LevelSet,
    /// Vectors on cell faces.
    Staggered,
    /// Not said.
    Unknown,
}

impl GridClass {
    /// From OpenVDB's word for it.
    pub fn from_word(word: &str) -> Self {
        match word {
            "fog volume" => Self::FogVolume,
            "level set" => Self::LevelSet,
            "staggered" => Self::Staggered,
            _ => Self::Unknown,
        }
    }

    /// OpenVDB's word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::FogVolume => "fog volume",
            Self::LevelSet => "level set",
            Self::Staggered => "staggered",
            Self::Unknown => "unknown",
        }
    }
}

/// How index space (voxel centres at whole numbers) maps to world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridMap {
    /// World = M · index: a column-major 4×4 matrix that acts on column vectors.
    Affine([f64; 16]),
    /// OpenVDB's `NonlinearFrustumMap`: a box of index space is tapered, then mapped affinely.
    Frustum {
        /// Low corner of the box in index space.
        min: [f64; 3],
        /// High corner of the box in index space.
        max: [f64; 3],
        /// Width of the near plane over that of the far plane.
        taper: f64,
        /// Depth of the frustum in widths of the near plane.
        depth: f64,
        /// The affine map that follows (column-major, acts on column vectors).
        second: [f64; 16],
    },
}

/// What a grid is, without its values.
#[derive(Clone, Debug, PartialEq)]
pub struct GridHeader {
    /// Name as its maker gave it, without the suffix that tells repeated names apart.
    pub name: String,
    /// Which of the grids of this name it is, counted from 0.
    pub index: u32,
    /// OpenVDB's type: `Tree_float_5_4_3` and so on.
    pub type_name: String,
    /// `float`, `double`, `vec3s` and so on.
    pub value_type: String,
    /// Class, by its own account (before any conversion).
    pub class: GridClass,
    /// OpenVDB's name for the map: `UniformScaleTranslateMap` and so on.
    pub map_name: String,
    /// The map.
    pub map: GridMap,
    /// The value where nothing is stored; scalars use the first component.
    pub background: [f32; 3],
    /// Active voxels, tiles' included.
    pub active_voxels: u64,
    /// Bounding box of active voxels, inclusive; `None` where there are none.
    pub index_bounds: Option<([i32; 3], [i32; 3])>,
    /// Stored with half precision in the file.
    pub saved_as_half: bool,
    /// A level set that was made into a fog volume: 1 inside, falling to 0 at the surface over the band's width.
    pub was_level_set: bool,
    /// Number of leaves.
    pub leaf_count: u64,
    /// Number of tiles that are active or differ from the background.
    pub tile_count: u64,
    /// Why the values are not read, for kinds of grids that are not.
    pub skipped: Option<String>,
    /// Metadata as text; long values are cut.
    pub metadata: Vec<(String, String)>,
}

/// Values of leaves: 512 per leaf, z fastest: offset = (x·8 + y)·8 + z.
#[derive(Clone, Debug, PartialEq)]
pub enum GridValues {
    /// Nothing was read.
    Absent,
    /// `float`, or `double` rounded.
    F32(Vec<f32>),
    /// Grids saved with half precision.
    F16(Vec<f16>),
    /// Vectors, one after the other.
    Vec3(Vec<[f32; 3]>),
}

/// A cube of one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Low corner; a multiple of the size.
    pub origin: [i32; 3],
    /// Edge in voxels: 8, 128 or 4096.
    pub size: i32,
    /// The value; scalars use the first component.
    pub value: [f32; 3],
    /// Whether its voxels are active.
    pub active: bool,
}

/// A grid.
#[derive(Clone, Debug, PartialEq)]
pub struct VdbGrid {
    /// What it is.
    pub header: GridHeader,
    /// Low corners of the leaves (8³ voxels each), multiples of 8.
    pub leaf_origins: Vec<[i32; 3]>,
    /// Their values, inactive voxels' included.
    pub values: GridValues,
    /// Tiles that are active or differ from the background.
    pub tiles: Vec<Tile>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_files_get_little_and_large_ones_what_they_may_need() {
        let small = Limits::default().resolve(100_000);
        assert!(small.data < 1 << 30 && small.cpu < Duration::from_secs(2), "{small:?}");
        // 2 GB, packed to a twentieth: as OpenVDB holds it and as it is handed on.
        let large = Limits::default().resolve(2_000_000_000);
        assert!(large.data > 2 * 20 * 2_000_000_000 && large.cpu > Duration::from_secs(600), "{large:?}");
        assert!(large.memory > large.data && large.wall > large.cpu, "{large:?}");
        assert_eq!(Limits::default().resolve(u64::MAX).data, u64::MAX);
    }

    #[test]
    fn what_is_asked_for_only_tightens_the_limit_on_data() {
        let of = |memory, data| Limits { memory, data, ..Limits::default() }.resolve(1000).data;
        let usual = of(None, None);
        assert_eq!((of(None, Some(1 << 20)), of(Some(1 << 20), None)), (1 << 20, 1 << 20));
        assert_eq!((of(None, Some(1 << 40)), of(Some(1 << 40), None)), (usual, usual));
    }
}
