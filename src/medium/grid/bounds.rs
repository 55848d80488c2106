//! Bounds over cells: of the extinction and of the emission of a medium given by grids, on one lattice of cells.
//!
//! The lattice is the density's own, but for frustums, which have no straight one, and for emission that is so much coarser that each of
//! its voxels would raise a great many of the density's cells.

use glam::{DAffine3, DVec3, IVec3};

use super::GridMediumParts;
use super::emission::{Emission, EmissionShape};
use super::field::{AnyGrid, Field, ScalarGrid, with_scalar};
use super::majorants::{Majorants, MajorantsBuilder};
use super::map::{IndexMap, box_of_corners};
use super::sparse::{SparseGrid, Voxel};
use crate::math::Rgb;

/// Cells along the longest side of a lattice that does not follow the density's.
const OWN_CELLS: f64 = 96.0;

/// Voxels of emission larger than this many of density's have cells of their own.
const COARSEST_EMISSION: f32 = 16.0;

/// A margin for rounding in the bounds themselves.
const ROUNDING: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Where the cells lie.
pub(super) struct Lattice {
    /// Render space to the cells' index space.
    pub cells_from_render: DAffine3,
    /// The map of the grids whose voxels are the cells' own.
    follows: Option<IndexMap>,
}

impl Lattice {
    /// The lattice that suits a medium.
    ///
    /// # Panics
    /// If neither density nor bound is given.
    pub fn of(parts: &GridMediumParts) -> Self {
        let source = source(parts);
        let direct = parts.emission.as_ref().filter(|emission| emission.direct).and_then(|e| match &e.shape {
            EmissionShape::Grid(field) => Some(field),
            _ => None,
        });
        let edge = |map: &IndexMap| voxel_edge(map.local_from_render());
        if source.map.is_linear()
            && direct.is_none_or(|field| edge(&field.map) <= COARSEST_EMISSION * edge(&source.map))
        {
            return Self { cells_from_render: *source.map.local_from_render(), follows: Some(source.map) };
        }
        Self { cells_from_render: cells_of_their_own(source, direct), follows: None }
    }

    /// Raises cells to `bound(value)` of every stored value of a grid. `bound` must not fall as the value rises.
    pub fn add<V: Voxel>(
        &self,
        builder: &mut MajorantsBuilder,
        (grid, map): (&SparseGrid<V>, &IndexMap),
        bound: impl Fn(f32) -> f32,
    ) {
        if self.follows == Some(*map) {
            builder.add(grid, bound);
        } else {
            add_placed(builder, grid, bound, |low, high| cells_box(&self.cells_from_render, map, low, high));
        }
    }

    fn add_scalars(&self, builder: &mut MajorantsBuilder, field: &Field<ScalarGrid>, bound: impl Fn(f32) -> f32) {
        with_scalar!(&field.grid, grid => self.add(builder, (grid, &field.map), bound));
    }

    /// Bounds of a field, times `factor`.
    fn bounds_of(&self, field: &Field<AnyGrid>, factor: f32) -> Majorants {
        let bound = |value: f32| (factor * field.bound(value)).min(f32::MAX);
        let mut builder = MajorantsBuilder::new(bound(field.grid.background().max_element()));
        match &field.grid {
            AnyGrid::Scalar(ScalarGrid::Single(grid)) => self.add(&mut builder, (grid, &field.map), bound),
            AnyGrid::Scalar(ScalarGrid::Half(grid)) => self.add(&mut builder, (grid, &field.map), bound),
            AnyGrid::Vector(grid) => self.add(&mut builder, (grid, &field.map), bound),
        }
        builder.build()
    }

    /// Bounds of μ_t, in every channel.
    pub fn extinction(&self, parts: &GridMediumParts) -> Majorants {
        let source = source(parts);
        let colour = |field: &Option<Field<AnyGrid>>| field.as_ref().map_or(1.0, Field::largest);
        let per_density = if parts.density.is_some() {
            parts.sigma_a * colour(&parts.absorption_colour) + parts.sigma_s * colour(&parts.scattering_colour)
        } else {
            Rgb::WHITE
        };
        let factor = per_density.max_channel() * parts.scale * ROUNDING;
        let bound = |value: f32| (factor * source.bound(value)).min(f32::MAX);
        let mut builder = MajorantsBuilder::new(bound(source.grid.background()));
        self.add_scalars(&mut builder, source, bound);
        builder.build()
    }

    /// A measure of the largest emission, positive wherever there is any: a bound of the emission where it is given directly, of μ_t L_e
    /// where it is μ_a L_e.
    pub fn emission(&self, emission: &Emission, extinction: &Majorants) -> Majorants {
        let most = emission.radiance.max_channel();
        let product = |a: f32, b: f32| (a * b).min(f32::MAX);
        let radiance = match &emission.shape {
            EmissionShape::Constant => MajorantsBuilder::new(most).build(),
            EmissionShape::Grid(field) => self.bounds_of(field, most),
            EmissionShape::Temperature { kelvin, table, scale } => {
                let bound = |value: f32| (most * table.at(kelvin.bound(value)).max_channel()).min(f32::MAX);
                let mut builder = MajorantsBuilder::new(bound(kelvin.grid.background()));
                self.add_scalars(&mut builder, kelvin, bound);
                let glow = builder.build();
                match scale {
                    Some(field) => glow.combined(&self.bounds_of(field, 1.0), product),
                    None => glow,
                }
            }
        };
        if emission.direct { radiance } else { extinction.combined(&radiance, product) }
    }
}

/// The grid that says where the medium is.
///
/// # Panics
/// If neither density nor bound is given.
pub(super) fn source(parts: &GridMediumParts) -> &Field<ScalarGrid> {
    parts.density.as_ref().or(parts.bound.as_ref()).expect("a density or a bound is given")
}

/// The shortest edge of a voxel, given the map to index space.
pub(super) fn voxel_edge(index_from_render: &DAffine3) -> f32 {
    let m = index_from_render.matrix3.inverse();
    m.x_axis.length().min(m.y_axis.length()).min(m.z_axis.length()).max(f64::from(f32::MIN_POSITIVE)) as f32
}

/// A grid of cells (8 "voxels" each) in render space around all that is stored.
fn cells_of_their_own(source: &Field<ScalarGrid>, more: Option<&Field<AnyGrid>>) -> DAffine3 {
    let boxes =
        [source.grid.bounds().map(|b| (b, source.map)), more.and_then(|field| Some((field.grid.bounds()?, field.map)))];
    let mut all = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for ((low, high), map) in boxes.into_iter().flatten() {
        let (a, b) = map.render_box(low.as_dvec3() - 1.0, high.as_dvec3() + 1.0);
        all = (all.0.min(a), all.1.max(b));
    }
    let size = (all.1 - all.0).max_element();
    if !(size > 0.0 && size.is_finite()) {
        return DAffine3::IDENTITY;
    }
    let scale = 8.0 * OWN_CELLS / size;
    DAffine3::from_scale(DVec3::splat(scale)) * DAffine3::from_translation(-all.0)
}

/// The cells that the voxels `low..=high` of another lattice can have an influence on.
fn cells_box(cells_from_render: &DAffine3, map: &IndexMap, low: IVec3, high: IVec3) -> (IVec3, IVec3) {
    let image = |p: DVec3| cells_from_render.transform_point3(map.to_render(p));
    let (a, b) = box_of_corners(low.as_dvec3() - 1.5, high.as_dvec3() + 1.5, image);
    (a.floor().as_ivec3(), b.ceil().as_ivec3())
}

/// Raises the boxes that `place` gives for leaves and tiles.
fn add_placed<V: Voxel>(
    builder: &mut MajorantsBuilder,
    grid: &SparseGrid<V>,
    bound: impl Fn(f32) -> f32,
    place: impl Fn(IVec3, IVec3) -> (IVec3, IVec3),
) {
    let leaves = grid.leaves().map(|(origin, leaf)| {
        let largest = leaf.iter().map(|v| V::maximum(v.get())).fold(0.0, f32::max);
        (origin, 8, largest)
    });
    let tiles = grid.tiles().iter().map(|t| (t.origin, t.edge, V::maximum(t.value)));
    for (origin, edge, value) in leaves.chain(tiles) {
        let m = bound(value);
        if m > 0.0 {
            let (low, high) = place(origin, origin.saturating_add(IVec3::splat(edge - 1)));
            builder.raise_box(low, high, m);
        }
    }
}
