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
    /// Address space in bytes; `None` derives it from the file's size.
    pub memory: Option<u64>,
    /// Memory in bytes that may be written to (resident or not), and what all grids may take; `None` for no other limit than `memory`.
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

impl Limits {
    /// The limits in force for a file of `length` bytes: memory (bytes), processor and wall-clock time.
    /// Derived ones leave room for the strongest compression that real files show (about 1:100).
    pub fn resolve(&self, length: u64) -> (u64, Duration, Duration) {
        let memory = self.memory.unwrap_or_else(|| (4u64 << 30).saturating_add(length.saturating_mul(100)));
        let cpu = self.cpu.unwrap_or_else(|| Duration::from_secs(20 + length / 2_000_000));
        let wall = self.wall.unwrap_or_else(|| Duration::from_secs(60 + length / 500_000));
        (memory, cpu, wall)
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
