//! What a medium makes of a grid that came from a file. It emits by the grid as well, if that is small: others take as long to survey as they do in a
//! render.

use std::sync::Arc;

use glam::{DAffine3, IVec3};
use lanternfish::math::Rgb;
use lanternfish::medium::grid::emission::{Emission, EmissionShape};
use lanternfish::medium::grid::field::{AnyGrid, Field, ScalarGrid};
use lanternfish::medium::grid::map::{Frustum, IndexMap};
use lanternfish::medium::grid::sparse::SparseGrid;
use lanternfish::medium::grid::{GridMedium, GridMediumParts};

/// Builds a medium of the grid and looks voxels up.
pub fn build(voxels: Arc<SparseGrid<f32>>, world_from_index: DAffine3, frustum: Option<Frustum>) {
    let (low, high) = voxels.bounds().unwrap_or_default();
    for ijk in [low, high, IVec3::MIN, IVec3::MAX, IVec3::ZERO, low.saturating_sub(IVec3::ONE)] {
        assert!(voxels.value(ijk) >= 0.0);
        assert!(voxels.sample(ijk.as_dvec3() + 0.5) >= 0.0);
    }
    let Some(map) = IndexMap::new(world_from_index, frustum) else { return };
    let is_small = voxels.tiles().iter().all(|tile| tile.edge == 8) && voxels.leaves().count() <= 2;
    let density = Field { grid: ScalarGrid::Single(voxels), map, scale: 1.0, offset: 0.0 };
    let glow = Field { grid: AnyGrid::Scalar(density.grid.clone()), map, scale: 1.0, offset: 0.0 };
    let medium = GridMedium::new(GridMediumParts {
        density: Some(density),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::WHITE,
        sigma_s: Rgb::WHITE,
        scale: 1.0,
        emission: is_small.then_some(Emission {
            radiance: Rgb::WHITE,
            shape: EmissionShape::Grid(glow),
            direct: false,
        }),
        g: 0.0,
        motion: None,
        clip: None,
    });
    assert!(medium.largest_extinction() >= 0.0);
}
