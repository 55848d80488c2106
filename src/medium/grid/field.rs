//! A grid as a medium uses it: values with their place in render space, scaled and offset.

use std::sync::Arc;

use glam::{DVec3, IVec3, Vec3};
use half::f16;

use super::map::IndexMap;
use super::sparse::SparseGrid;

/// A grid of scalars in either precision.
#[derive(Clone, Debug)]
pub enum ScalarGrid {
    /// 32 bits a value.
    Single(Arc<SparseGrid<f32>>),
    /// 16 bits a value.
    Half(Arc<SparseGrid<f16>>),
}

/// Does the same with either precision.
macro_rules! with_scalar {
    ($grid:expr, $name:ident => $body:expr) => {
        match $grid {
            $crate::medium::grid::field::ScalarGrid::Single($name) => $body,
            $crate::medium::grid::field::ScalarGrid::Half($name) => $body,
        }
    };
}
pub(crate) use with_scalar;

impl ScalarGrid {
    /// Trilinear interpolation at an index position.
    #[inline]
    pub fn sample(&self, index: DVec3) -> f32 {
        with_scalar!(self, grid => grid.sample(index))
    }

    /// The value of a voxel.
    pub fn value(&self, ijk: IVec3) -> f32 {
        with_scalar!(self, grid => grid.value(ijk))
    }

    /// The value where nothing is stored.
    pub fn background(&self) -> f32 {
        with_scalar!(self, grid => grid.background())
    }

    /// An upper bound of all values.
    pub fn largest(&self) -> f32 {
        with_scalar!(self, grid => grid.largest())
    }

    /// Bounding box of what is stored, inclusive.
    pub fn bounds(&self) -> Option<(IVec3, IVec3)> {
        with_scalar!(self, grid => grid.bounds())
    }

    /// NaN, infinite and negative values that became 0.
    pub fn bad_voxels(&self) -> u64 {
        with_scalar!(self, grid => grid.bad_voxels())
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        with_scalar!(self, grid => grid.memory())
    }
}

/// A grid of scalars or of colours.
#[derive(Clone, Debug)]
pub enum AnyGrid {
    /// Scalars.
    Scalar(ScalarGrid),
    /// Colours.
    Vector(Arc<SparseGrid<[f32; 3]>>),
}

impl AnyGrid {
    /// Bytes in use.
    pub fn memory(&self) -> usize {
        match self {
            Self::Scalar(grid) => grid.memory(),
            Self::Vector(grid) => grid.memory(),
        }
    }

    /// NaN, infinite and negative values that became 0.
    pub fn bad_voxels(&self) -> u64 {
        match self {
            Self::Scalar(grid) => grid.bad_voxels(),
            Self::Vector(grid) => grid.bad_voxels(),
        }
    }

    /// Bounding box of what is stored, inclusive.
    pub fn bounds(&self) -> Option<(IVec3, IVec3)> {
        match self {
            Self::Scalar(grid) => grid.bounds(),
            Self::Vector(grid) => grid.bounds(),
        }
    }

    /// An upper bound of all components.
    pub fn largest(&self) -> f32 {
        match self {
            Self::Scalar(grid) => grid.largest(),
            Self::Vector(grid) => grid.largest(),
        }
    }

    #[inline]
    fn sample(&self, index: DVec3) -> Vec3 {
        match self {
            Self::Scalar(grid) => Vec3::splat(grid.sample(index)),
            Self::Vector(grid) => grid.sample(index),
        }
    }

    /// The value where nothing is stored.
    pub fn background(&self) -> Vec3 {
        match self {
            Self::Scalar(grid) => Vec3::splat(grid.background()),
            Self::Vector(grid) => grid.background(),
        }
    }
}

/// A grid in its place: scale · value + offset, never below 0.
#[derive(Clone, Debug)]
pub struct Field<G> {
    /// The values.
    pub grid: G,
    /// Their place.
    pub map: IndexMap,
    /// Factor.
    pub scale: f32,
    /// Summand, after the factor.
    pub offset: f32,
}

impl<G> Field<G> {
    /// Scale and offset applied to one value.
    #[inline]
    pub fn adjust(&self, value: f32) -> f32 {
        (self.scale * value + self.offset).max(0.0)
    }

    /// An upper bound of the adjusted values of voxels that hold at most `value` (and at least 0); rises with it.
    pub fn bound(&self, value: f32) -> f32 {
        self.adjust(value).max(self.offset.max(0.0) * f32::from(u8::from(self.scale < 0.0)))
    }
}

impl Field<ScalarGrid> {
    /// The adjusted value at an index position.
    #[inline]
    pub fn at(&self, index: DVec3) -> f32 {
        self.adjust(self.grid.sample(index))
    }
}

impl Field<AnyGrid> {
    /// The adjusted value at a point of render space; the background behind a frustum's apex.
    #[inline]
    pub fn at_point(&self, p: Vec3) -> Vec3 {
        self.at_index(self.map.to_index(p))
    }

    /// The adjusted value at an index position.
    #[inline]
    pub fn at_index(&self, index: Option<DVec3>) -> Vec3 {
        let value = index.map_or_else(|| self.grid.background(), |index| self.grid.sample(index));
        (value * self.scale + Vec3::splat(self.offset)).max(Vec3::ZERO)
    }

    /// An upper bound of every component anywhere.
    pub fn largest(&self) -> f32 {
        self.bound(self.grid.largest())
    }
}
