//! From the grids of a .vdb file to [`super::sparse::SparseGrid`]s in their place, and what a file holds, for people.
//! Needs the feature `openvdb`; without it every file is refused with a message that says so.

use std::path::Path;

use serde::Serialize;

use crate::scene::SceneErrorKind;

/// What a .vdb or .nvdb file holds.
#[derive(Clone, Debug, Serialize)]
pub struct VdbSummary {
    /// The file.
    pub path: String,
    /// Its size in bytes.
    pub bytes: u64,
    /// Its grids, in order of name and number.
    pub grids: Vec<GridSummary>,
}

/// What a grid is.
#[derive(Clone, Debug, Serialize)]
pub struct GridSummary {
    /// Name.
    pub name: String,
    /// Which of the grids of this name, from 0.
    pub index: u32,
    /// OpenVDB's or NanoVDB's type of values: `float`, `vec3s`, `fp8` …
    pub value_type: String,
    /// Class by its own account: `fog volume`, `level set`, `staggered`, `unknown`.
    pub class: String,
    /// Active voxels, tiles' included.
    pub active_voxels: u64,
    /// Leaves of 8³ voxels.
    pub leaves: u64,
    /// Tiles that are active or differ from the background.
    pub tiles: u64,
    /// Bounding box of active voxels, inclusive.
    pub bounds: Option<([i32; 3], [i32; 3])>,
    /// Edges of a voxel in world units (at the middle of the near plane, for frustums); `null` where not finite.
    pub voxel_size: [f64; 3],
    /// OpenVDB's name for its kind of map.
    pub map: String,
    /// Stored with half precision.
    pub half: bool,
    /// The smallest and largest value in use (vectors: of the largest components, velocities: of the speeds), after any conversion.
    pub range: Option<(f32, f32)>,
    /// NaN, infinite and (but for velocities) negative values, which become 0.
    pub bad_voxels: u64,
    /// What was done to it, or why it cannot be used.
    pub note: Option<String>,
    /// Whether it can be used in a medium.
    pub loads: bool,
    /// Metadata as text.
    pub metadata: Vec<(String, String)>,
}

#[cfg(not(feature = "openvdb"))]
mod reading {
    use super::*;

    /// Why nothing can be read.
    pub const LEFT_OUT: &str = "this lanternfish was built without OpenVDB (cargo feature \"openvdb\")";

    /// Refuses.
    pub fn describe(path: &Path) -> Result<VdbSummary, SceneErrorKind> {
        Err(SceneErrorKind::Unsupported(format!("cannot read {}: {LEFT_OUT}", path.display())))
    }
}

#[cfg(feature = "openvdb")]
mod reading {
    use std::sync::Arc;

    use glam::{DAffine3, DMat4, DVec3, IVec3};
    use openvdb::{GridClass, GridMap, GridValues, Limits, VdbError, VdbGrid, read_vdb};

    use super::*;
    use crate::medium::grid::field::{AnyGrid, ScalarGrid};
    use crate::medium::grid::map::{Frustum, IndexMap};
    use crate::medium::grid::sparse::{SparseGrid, TileOf, Voxel};
    use crate::medium::grid::velocity::{Component, ComponentGrid, Velocity, VelocityGrid, centred};
    use crate::system::memory::{available, limit};

    /// What the worker gets even where little memory is left: most of it is only reserved.
    const LEAST_ADDRESS_SPACE: u64 = 2 << 30;

    /// And what it may write to, however little there is: stacks of threads and the libraries' own take some 40 MB of it, most of that only reserved.
    const LEAST_DATA: u64 = 64 << 20;

    /// Reads a file in the worker process.
    pub fn read(path: &Path) -> Result<Vec<VdbGrid>, SceneErrorKind> {
        let length = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        let allowed = Limits::default().resolve(length).memory;
        // No more than is left; but libraries alone need address space.
        let left = available();
        let memory = left.map(|left| allowed.min(left.max(LEAST_ADDRESS_SPACE)));
        // Under a limit of this process's own the worker may have half of what is left: what it sends is here as well.
        let data = left.filter(|_| limit().is_some()).map(|left| (left / 2).max(LEAST_DATA));
        read_vdb(path, &Limits { memory, data, ..Limits::default() }).map_err(|error| match error {
            VdbError::Limit { .. } => SceneErrorKind::Limit(error.to_string()),
            VdbError::Io { .. } | VdbError::Damaged { .. } => {
                let text = error.to_string();
                let reason = text.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&text).to_owned();
                SceneErrorKind::File { path: path.to_owned(), reason }
            }
            // Not the file's fault.
            VdbError::Reader { .. } | VdbError::Stopped { .. } | VdbError::Write(_) => {
                SceneErrorKind::System(error.to_string())
            }
        })
    }

    fn sparse<V: Voxel>(grid: &VdbGrid, values: Vec<V>, one: impl Fn([f32; 3]) -> V) -> Arc<SparseGrid<V>> {
        let origins = grid.leaf_origins.iter().map(|&o| IVec3::from_array(o)).collect();
        let tiles = grid.tiles.iter().map(|t| TileOf {
            origin: IVec3::from_array(t.origin),
            edge: t.size,
            value: one(t.value),
        });
        let tiles = tiles.collect();
        Arc::new(SparseGrid::new(one(grid.header.background), origins, values, tiles))
    }

    /// The voxels of a grid; `None` if it was not read.
    pub fn voxels(grid: &mut VdbGrid) -> Option<AnyGrid> {
        let values = std::mem::replace(&mut grid.values, GridValues::Absent);
        Some(match values {
            GridValues::Absent => return None,
            GridValues::F32(v) => AnyGrid::Scalar(ScalarGrid::Single(sparse(grid, v, |c| c[0]))),
            GridValues::F16(v) => AnyGrid::Scalar(ScalarGrid::Half(sparse(grid, v, |c| half::f16::from_f32(c[0])))),
            GridValues::Vec3(v) => AnyGrid::Vector(sparse(grid, v, |c| c)),
        })
    }

    /// The velocities that a grid of vectors holds, at the voxels' centres; `None` if it holds none.
    pub fn velocities(grid: &VdbGrid) -> Option<VelocityGrid> {
        let GridValues::Vec3(values) = &grid.values else { return None };
        let stored = sparse(grid, values.iter().copied().map(Velocity).collect(), Velocity);
        Some(if grid.header.class == GridClass::Staggered { Arc::new(centred(&stored)) } else { stored })
    }

    /// One component of velocities, as a grid of numbers holds it; `None` if it holds none.
    pub fn component(grid: &VdbGrid) -> Option<ComponentGrid> {
        let values = match &grid.values {
            GridValues::F32(values) => values.iter().copied().map(Component).collect(),
            GridValues::F16(values) => values.iter().map(|v| Component(v.to_f32())).collect(),
            GridValues::Absent | GridValues::Vec3(_) => return None,
        };
        Some(sparse(grid, values, |c| Component(c[0])))
    }

    /// The grid's place, given its medium's; `None` if the file's map cannot be inverted.
    pub fn place(grid: &VdbGrid, render_from_medium: &DAffine3) -> Option<IndexMap> {
        let (matrix, frustum) = match grid.header.map {
            GridMap::Affine(m) => (m, None),
            GridMap::Frustum { min, max, taper, depth, second } => {
                (second, Some(Frustum { min: min.into(), max: max.into(), taper, depth }))
            }
        };
        let medium_from_local = DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
        IndexMap::new(*render_from_medium * medium_from_local, frustum)
    }

    fn voxel_size(grid: &VdbGrid) -> [f64; 3] {
        let Some(map) = place(grid, &DAffine3::IDENTITY) else { return [f64::NAN; 3] };
        let at = match grid.header.map {
            GridMap::Affine(_) => DVec3::ZERO,
            GridMap::Frustum { min, max, .. } => DVec3::new(0.5 * (min[0] + max[0]), 0.5 * (min[1] + max[1]), min[2]),
        };
        DVec3::AXES.map(|axis| (map.to_render(at + axis) - map.to_render(at)).length())
    }

    /// Whether a grid of vectors holds velocities, as far as names tell, and no colours.
    fn is_velocity(grid: &VdbGrid) -> bool {
        let h = &grid.header;
        h.class == GridClass::Staggered || ["v", "vel", "velocity"].contains(&h.name.as_str())
    }

    /// Every grid of the file `path`, whether it can be used or why not.
    pub fn describe(path: &Path) -> Result<VdbSummary, SceneErrorKind> {
        let grids = read(path)?;
        let bytes = std::fs::metadata(path).map_or(0, |m| m.len());
        let grids = grids.into_iter().map(|mut grid| {
            let moving = velocities(&grid).filter(|_| is_velocity(&grid));
            let any = voxels(&mut grid);
            let h = &grid.header;
            let range = any.as_ref().and_then(|any| match (any, &moving) {
                (_, Some(g)) => g.range(),
                (AnyGrid::Scalar(ScalarGrid::Single(g)), None) => g.range(),
                (AnyGrid::Scalar(ScalarGrid::Half(g)), None) => g.range(),
                (AnyGrid::Vector(g), None) => g.range(),
            });
            let bad_voxels = match (&any, &moving) {
                (_, Some(g)) => g.bad_voxels(),
                (any, None) => any.as_ref().map_or(0, AnyGrid::bad_voxels),
            };
            let converted = h.was_level_set.then(|| "level set, converted to a fog volume".to_owned());
            GridSummary {
                name: h.name.clone(),
                index: h.index,
                value_type: h.value_type.clone(),
                class: h.class.word().to_owned(),
                active_voxels: h.active_voxels,
                leaves: h.leaf_count,
                tiles: h.tile_count,
                bounds: h.index_bounds,
                voxel_size: voxel_size(&grid),
                map: h.map_name.clone(),
                half: h.saved_as_half,
                range,
                bad_voxels,
                note: h.skipped.clone().or(converted),
                loads: any.is_some(),
                metadata: h.metadata.clone(),
            }
        });
        Ok(VdbSummary { path: path.display().to_string(), bytes, grids: grids.collect() })
    }
}

pub use reading::*;

impl std::fmt::Display for VdbSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for grid in &self.grids {
            let name = if grid.name.is_empty() { "(unnamed)" } else { &grid.name };
            writeln!(
                f,
                "{name}[{}]  {}, {}{}",
                grid.index,
                grid.value_type,
                grid.class,
                if grid.half { ", half" } else { "" }
            )?;
            write!(f, "  {} active voxels in {} leaves and {} tiles", grid.active_voxels, grid.leaves, grid.tiles)?;
            match grid.bounds {
                Some((low, high)) => writeln!(f, ", box {low:?} to {high:?}")?,
                None => writeln!(f, ", empty")?,
            }
            let [x, y, z] = grid.voxel_size;
            writeln!(f, "  {}, voxels {x:.6} × {y:.6} × {z:.6}", grid.map)?;
            if let Some((low, high)) = grid.range {
                writeln!(f, "  values {low} to {high}, {} bad", grid.bad_voxels)?;
            }
            match (&grid.note, grid.loads) {
                (Some(note), true) => writeln!(f, "  {note}")?,
                (Some(note), false) => writeln!(f, "  cannot be used: {note}")?,
                (None, _) => {}
            }
        }
        Ok(())
    }
}
