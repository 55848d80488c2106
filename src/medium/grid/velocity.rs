//! Velocities as grids store them: signed, unlike everything else that grids of media hold, and in one grid of vectors or three of numbers.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::bounds::Lattice;
use super::majorants::MajorantsBuilder;
use super::map::IndexMap;
use super::sparse::{SparseGrid, TileOf, Voxel};

/// Voxel edges or units of the medium's space per unit of time, as the file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity(pub [f32; 3]);

/// One component of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component(pub f32);

/// No component may be larger: its square still fits.
const FASTEST: f32 = 1e18;

/// A component without what is not finite, or as good as infinite; whether it was.
fn cleaned(component: f32) -> (f32, bool) {
    if component.abs() <= FASTEST { (component, false) } else { (0.0, true) }
}

impl Voxel for Velocity {
    type Value = Vec3;
    #[inline]
    fn get(self) -> Vec3 {
        Vec3::from_array(self.0)
    }
    fn put(value: Vec3) -> Self {
        Self(value.to_array())
    }
    /// The speed.
    fn maximum(value: Vec3) -> f32 {
        value.length()
    }
    /// Only what is not finite, or as good as infinite, is replaced by 0.
    fn cleaned(self) -> (Self, bool) {
        let parts = self.0.map(cleaned);
        (Self(parts.map(|part| part.0)), parts.iter().any(|part| part.1))
    }
}

impl Voxel for Component {
    type Value = f32;
    #[inline]
    fn get(self) -> f32 {
        self.0
    }
    fn put(value: f32) -> Self {
        Self(value)
    }
    /// How fast that is.
    fn maximum(value: f32) -> f32 {
        value.abs()
    }
    /// As for vectors.
    fn cleaned(self) -> (Self, bool) {
        let (value, is_bad) = cleaned(self.0);
        (Self(value), is_bad)
    }
}

/// The same velocities at the voxels' centres, of a staggered grid: there each component lies on the face towards the voxel below (OpenVDB's
/// `GRID_STAGGERED`).
pub fn centred(staggered: &SparseGrid<Velocity>) -> SparseGrid<Velocity> {
    let values = staggered.leaves().flat_map(|(origin, leaf)| {
        leaf.iter().enumerate().map(move |(i, v)| {
            let at = origin + IVec3::new(i as i32 >> 6, i as i32 >> 3 & 7, i as i32 & 7);
            let below = v.get();
            let above = |axis: usize| staggered.value(at.saturating_add(IVec3::AXES[axis]))[axis];
            Velocity((0.5 * (below + Vec3::new(above(0), above(1), above(2)))).to_array())
        })
    });
    let origins = staggered.leaves().map(|(origin, _)| origin).collect();
    let tiles =
        staggered.tiles().iter().map(|t| TileOf { origin: t.origin, edge: t.edge, value: Velocity::put(t.value) });
    SparseGrid::new(Velocity::put(staggered.background()), origins, values.collect(), tiles.collect())
}

/// A grid of velocities, shared.
pub type VelocityGrid = Arc<SparseGrid<Velocity>>;
/// A grid of one component, shared.
pub type ComponentGrid = Arc<SparseGrid<Component>>;

/// Velocities all over a medium.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a medium has one, and asks it in its inner loop")]
pub enum VelocityField {
    /// One grid of vectors, in its place.
    Vectors(VelocityGrid, IndexMap),
    /// A grid for each component, each in a place of its own (those of staggered grids lie half a voxel apart).
    Components(Box<[(ComponentGrid, IndexMap); 3]>),
}

/// A vector is at most this many times as long as its largest component.
const LENGTH_OVER_COMPONENT: f32 = 1.732_051;

impl VelocityField {
    /// The velocity at `p`, in render space; 0 where that has no place in a grid.
    #[inline]
    pub fn at(&self, p: Vec3) -> Vec3 {
        match self {
            Self::Vectors(grid, map) => map.to_index(p).map_or(Vec3::ZERO, |index| grid.sample(index)),
            Self::Components(parts) => {
                let [x, y, z] = &**parts;
                let of =
                    |(grid, map): &(ComponentGrid, IndexMap)| map.to_index(p).map_or(0.0, |index| grid.sample(index));
                Vec3::new(of(x), of(y), of(z))
            }
        }
    }

    /// A bound of all speeds.
    pub fn largest(&self) -> f32 {
        match self {
            Self::Vectors(grid, _) => grid.largest(),
            Self::Components(parts) => Vec3::from(parts.each_ref().map(|(grid, _)| grid.largest())).length(),
        }
    }

    /// A bound of the speed where no grid says anything.
    pub fn background(&self) -> f32 {
        match self {
            Self::Vectors(grid, _) => grid.background().length(),
            // As below: where one component is stored the others may be those of the background.
            Self::Components(parts) => {
                LENGTH_OVER_COMPONENT * parts.iter().map(|(grid, _)| grid.background().abs()).fold(0.0, f32::max)
            }
        }
    }

    /// Raises the cells of `lattice` to `bound` of a bound of the speed there.
    pub(super) fn add(&self, lattice: &Lattice, builder: &mut MajorantsBuilder, bound: impl Fn(f32) -> f32) {
        match self {
            Self::Vectors(grid, map) => lattice.add(builder, (grid, map), bound),
            Self::Components(parts) => {
                for (grid, map) in parts.iter() {
                    lattice.add(builder, (grid, map), |speed| bound(LENGTH_OVER_COMPONENT * speed));
                }
            }
        }
    }

    /// Bytes.
    pub fn memory(&self) -> usize {
        match self {
            Self::Vectors(grid, _) => grid.memory(),
            Self::Components(parts) => parts.iter().map(|(grid, _)| grid.memory()).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::medium::grid::sparse::LEAF_SIZE;

    #[test]
    fn negative_components_stay_and_nonsense_goes() {
        let mut values = vec![Velocity([-1.0, 2.0, -3.0]); LEAF_SIZE];
        values[0] = Velocity([f32::NAN, 1.0, f32::NEG_INFINITY]);
        let grid = SparseGrid::new(Velocity([0.0; 3]), vec![IVec3::ZERO], values, vec![]);
        assert_eq!(grid.value(IVec3::ZERO), Vec3::new(0.0, 1.0, 0.0));
        assert_eq!(grid.value(IVec3::ONE), Vec3::new(-1.0, 2.0, -3.0));
        assert_eq!(grid.bad_voxels(), 1);
        assert!((grid.largest() - 14f32.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn staggered_components_move_to_the_centre() {
        // The face of x between voxels i−1 and i holds i, so the centre of voxel i has i + ½.
        let value = |i: usize| Velocity([(i >> 6) as f32, 10.0 * (i >> 3 & 7) as f32, 100.0 * (i & 7) as f32]);
        let grid = SparseGrid::new(Velocity([0.0; 3]), vec![IVec3::ZERO], (0..LEAF_SIZE).map(value).collect(), vec![]);
        let found = centred(&grid).value(IVec3::new(2, 3, 4));
        assert_eq!(found, Vec3::new(2.5, 35.0, 450.0));
        // Beyond the leaf there is the background.
        assert_eq!(centred(&grid).value(IVec3::new(7, 3, 4)).x, 3.5);
    }
}
