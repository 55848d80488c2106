//! What a .nvdb file holds, for people, in the words that are used of .vdb files.

use std::path::Path;

use glam::DVec3;

use super::{Facts, NanoGrid, Skipped, read};
use crate::medium::grid::file::{GridSummary, VdbSummary};
use crate::scene::SceneErrorKind;

/// Every grid of the file `path`, whether it can be used or why not.
///
/// # Errors
/// `File`, as [`read`].
pub fn describe(path: &Path) -> Result<VdbSummary, SceneErrorKind> {
    let file = read(path).map_err(|reason| SceneErrorKind::File { path: path.to_owned(), reason })?;
    let bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let mut grids: Vec<GridSummary> =
        file.grids.iter().map(of_grid).chain(file.skipped.iter().map(of_skipped)).collect();
    grids.sort_by(|a, b| a.name.cmp(&b.name));
    for i in 1..grids.len() {
        if grids[i].name == grids[i - 1].name {
            grids[i].index = grids[i - 1].index + 1;
        }
    }
    Ok(VdbSummary { path: path.display().to_string(), bytes, grids })
}

fn summary(name: &str, facts: &Facts) -> GridSummary {
    GridSummary {
        name: name.to_owned(),
        index: 0,
        value_type: facts.value_type.to_owned(),
        class: facts.class.to_owned(),
        active_voxels: facts.active_voxels,
        leaves: 0,
        tiles: 0,
        bounds: facts.bounds,
        voxel_size: [f64::NAN; 3],
        map: "AffineMap".to_owned(),
        half: false,
        range: None,
        bad_voxels: 0,
        note: None,
        loads: false,
        metadata: vec![],
    }
}

fn of_grid(grid: &NanoGrid) -> GridSummary {
    let edge = |axis: DVec3| grid.world_from_index.transform_vector3(axis).length();
    let converted = grid.was_level_set.then(|| "level set, converted to a fog volume".to_owned());
    GridSummary {
        leaves: grid.voxels.leaves().count() as u64,
        tiles: grid.voxels.tiles().len() as u64,
        voxel_size: DVec3::AXES.map(edge),
        range: grid.voxels.range(),
        bad_voxels: grid.voxels.bad_voxels(),
        note: converted,
        loads: true,
        ..summary(&grid.name, &grid.facts)
    }
}

fn of_skipped(grid: &Skipped) -> GridSummary {
    GridSummary { note: Some(grid.reason.clone()), ..summary(&grid.name, &grid.facts) }
}
