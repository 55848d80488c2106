//! A coarse survey of what a medium given by grids emits: cell by cell the mean of its emission and extinction, sampled, and of the bounds
//! that say how densely emission is gathered.
//!
//! Cells are cubes of 2^k voxels of the bounds' lattice, so that they nest in the hierarchy of bounds and whatever it knows to be dark
//! is skipped. A cell is visited piece by piece, and every piece has samples at jittered places of its own: a flame that is a voxel thin
//! in a cell of a hundred is seen.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DAffine3, DVec3, IVec3, Vec3};
use rayon::prelude::*;

use super::gathering::Gathering;
use super::majorants::Majorants;
use crate::math::Rgb;
use crate::math::sampler::{Stream, mix};
use crate::medium::MediumPoint;

/// Cells along the longest side at most.
pub const RESOLUTION: i64 = 32;

/// Emission below this share of the largest bound is left out of the survey's box.
const FAINTEST: f32 = 1e-6;

/// Up to so many pieces each has 4³ samples, up to eight times as many 2³, else one.
const MANY_PIECES: usize = 1 << 15;

/// More pieces than this are not visited one by one: a tile of a few bytes may come to any number of them.
const MOST_PIECES: usize = 1 << 22;

/// What is known of one cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Surveyed {
    /// Mean emission, per unit length.
    pub emission: Rgb,
    /// Mean over the channels of the mean extinction.
    pub extinction: f64,
    /// Mean of [`Gathering::measure`].
    pub measure: f64,
}

/// The cells, z fastest.
#[derive(Debug)]
pub(super) struct Survey {
    /// Render space to cells, which are unit cubes from the origin on.
    pub cells_from_render: DAffine3,
    /// How many there are along each axis.
    pub size: IVec3,
    /// All of them.
    pub cells: Vec<Surveyed>,
}

impl Survey {
    /// Over all that `bounds` says may emit (beyond its background), within `clip`; `None` where nothing does.
    pub fn new(
        bounds: &Majorants,
        lattice: &DAffine3,
        clip: Option<(IVec3, IVec3)>,
        point: impl Fn(Vec3) -> MediumPoint + Sync,
    ) -> Option<Self> {
        let faintest = bounds.background().max(FAINTEST * bounds.largest());
        let (low, high) = bounds.box_above(faintest)?;
        let (low, high) = clip.map_or((low, high), |(a, b)| (low.max(a), high.min(b)));
        if low.cmpgt(high).any() {
            return None;
        }
        let mut shift = 0;
        let count = |shift: u32| (high >> shift as i32).as_i64vec3() - (low >> shift as i32).as_i64vec3() + 1;
        while count(shift).max_element() > RESOLUTION {
            shift += 1;
        }
        let (base, size) = (low >> shift as i32, count(shift).as_ivec3());
        let edge = f64::from(1u32 << shift);
        let corner = base.as_dvec3() * edge;
        let mut visitor = Visitor { bounds, point: &point, render_from_lattice: lattice.inverse(), finest: 0 };
        let places: Vec<IVec3> = (0..size.element_product())
            .map(|i| base + IVec3::new(i / size.z / size.y, i / size.z % size.y, i % size.z))
            .map(|cell| IVec3::from_array(cell.to_array().map(|c| c.wrapping_shl(shift))))
            .collect();
        let pieces = loop {
            let counted = AtomicUsize::new(0);
            places.par_iter().for_each(|&place| visitor.count(place, shift, &counted));
            let pieces = counted.into_inner();
            if pieces <= MOST_PIECES {
                break pieces;
            }
            visitor.finest = visitor.finest.max(2) + 1;
        };
        let fineness = match pieces / MANY_PIECES {
            0 => 4,
            1..8 => 2,
            _ => 1,
        };
        let cells = places.par_iter().map(|&place| visitor.survey(place, shift, fineness)).collect();
        let cells_from_render =
            DAffine3::from_scale(DVec3::splat(1.0 / edge)) * DAffine3::from_translation(-corner) * *lattice;
        Some(Self { cells_from_render, size, cells })
    }

    /// Lengths of a cell's edges in render space.
    pub fn edges(&self) -> DVec3 {
        let m = self.cells_from_render.matrix3.inverse();
        DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
    }

    /// The columns of cells along `axis`, each as the first cell's number; and the step from cell to cell and how many there are.
    pub fn columns(&self, axis: usize) -> (impl Iterator<Item = usize>, usize, usize) {
        let size = self.size.as_uvec3();
        let strides = [(size.y * size.z) as usize, size.z as usize, 1];
        let [a, b] = [[1, 2], [0, 2], [0, 1]][axis];
        let (across, stride) = ((size[a] as usize, size[b] as usize), [strides[a], strides[b]]);
        let first = (0..across.0).flat_map(move |i| (0..across.1).map(move |j| i * stride[0] + j * stride[1]));
        (first, strides[axis], size[axis] as usize)
    }

    /// What [`Gathering::measure`] adds up to along a ray: the mean over the columns of all axes, each weighted by its own sum.
    pub fn typical(&self) -> f64 {
        let edges = self.edges();
        let mean = |axis: usize| {
            let (columns, step, count) = self.columns(axis);
            let sum = |first: usize| (0..count).map(|i| self.cells[first + i * step].measure).sum::<f64>();
            let (whole, squares) = columns.map(sum).fold((0.0, 0.0), |(s, q), sum| (s + sum, q + sum * sum));
            edges[axis] * squares / whole
        };
        (mean(0) + mean(1) + mean(2)) / 3.0
    }
}

struct Visitor<'a, P> {
    bounds: &'a Majorants,
    point: &'a P,
    render_from_lattice: DAffine3,
    /// Cubes of 2^this voxels are not divided.
    finest: u32,
}

impl<P: Fn(Vec3) -> MediumPoint> Visitor<'_, P> {
    /// Visits the parts of the cube of 2^`shift` voxels at `place` that have one bound, above 0.
    fn visit(&self, place: IVec3, shift: u32, f: &mut impl FnMut(IVec3, u32, f32)) {
        let (known, bound) = self.bounds.cell(place);
        if known.max(self.finest) >= shift {
            if bound > 0.0 {
                f(place, shift, bound);
            }
            return;
        }
        let half = 1 << (shift - 1);
        for part in 0..8 {
            self.visit(place + half * IVec3::new(part >> 2, part >> 1 & 1, part & 1), shift - 1, f);
        }
    }

    /// Adds the parts of a cube to `counted`, if those are not too many already.
    fn count(&self, place: IVec3, shift: u32, counted: &AtomicUsize) {
        if shift > self.finest && counted.load(Ordering::Relaxed) > MOST_PIECES {
            return;
        }
        let (known, bound) = self.bounds.cell(place);
        if known.max(self.finest) >= shift {
            if bound > 0.0 {
                counted.fetch_add(1, Ordering::Relaxed);
            }
            return;
        }
        let half = 1 << (shift - 1);
        for part in 0..8 {
            self.count(place + half * IVec3::new(part >> 2, part >> 1 & 1, part & 1), shift - 1, counted);
        }
    }

    fn survey(&self, place: IVec3, shift: u32, fineness: u32) -> Surveyed {
        let mut sum = Surveyed::default();
        let whole = f64::from(1u32 << shift);
        self.visit(place, shift, &mut |low, piece, bound| {
            let edge = f64::from(1u32 << piece);
            let share = (edge / whole).powi(3);
            sum.measure += share * Gathering::measure(bound);
            let stratum = edge / f64::from(fineness);
            let each = share / f64::from(fineness.pow(3));
            let hashed = low.to_array().iter().fold(0, |seed, &c| mix(seed ^ u64::from(c as u32)));
            let mut stream = Stream::from_seed(hashed);
            for i in 0..fineness.pow(3) {
                let at = [i / fineness / fineness, i / fineness % fineness, i % fineness];
                let at = DVec3::from(at.map(|n| f64::from(n) + f64::from(stream.next_f32())));
                let p = self.render_from_lattice.transform_point3(low.as_dvec3() + at * stratum);
                let found = (self.point)(p.as_vec3());
                sum.emission += found.emission * each as f32;
                sum.extinction += each * f64::from((found.absorption + found.scattering).mean());
            }
        });
        sum
    }
}
