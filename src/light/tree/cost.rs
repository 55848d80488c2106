//! Where to cut a set of lights in two: the surface area orientation heuristic over bins. Source: Conty Estevez & Kulla, HPG 2018, section 4.1,
//! equations 1 and 2; binning after Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
//!
//! Two things are ours. The area is that of the sphere around the box, which is what importance sees: unlike the box's own it is
//! not zero for lights in a line. And cones of normals are not merged light by light but judged by the mean of the normals, which is cheap to
//! add up: over a cone of half angle θ its length is (1 + cos θ)/2. The finished nodes have exact cones.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use super::Parts;
use super::bounds::LightBounds;
use super::build::{Item, PIECE};

/// How many bins there are for each axis.
const BINS: usize = 12;

/// What is known of the lights in one bin, or in several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bin {
    low: Vec3,
    high: Vec3,
    /// Sum of the cones' mean normals.
    normals: Vec3,
    cos_emission: f32,
    energy: f32,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        normals: Vec3::ZERO,
        cos_emission: 1.0,
        energy: 0.0,
        count: 0,
    };

    #[inline]
    fn add(&mut self, bounds: &LightBounds) {
        self.low = self.low.min(bounds.low);
        self.high = self.high.max(bounds.high);
        // What emits on both sides faces either way: one of them is as good as the other, if it is always the same.
        let turn = if bounds.two_sided && bounds.axis.dot(Vec3::new(1.0, 1.1, 1.2)) < 0.0 { -0.5 } else { 0.5 };
        self.normals += bounds.axis * (turn * (1.0 + bounds.cos_normals));
        self.cos_emission = self.cos_emission.min(bounds.cos_emission);
        self.energy += bounds.energy;
        self.count += 1;
    }

    #[inline]
    fn merge(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.normals += other.normals;
        self.cos_emission = self.cos_emission.min(other.cos_emission);
        self.energy += other.energy;
        self.count += other.count;
    }

    /// Energy × area × orientation measure.
    #[inline]
    fn cost(&self) -> f64 {
        let mean = self.normals.length() / self.count as f32;
        let area = f64::from((self.high - self.low).length_squared());
        f64::from(self.energy.min(f32::MAX)) * area * f64::from(orientation(2.0 * mean - 1.0, self.cos_emission))
    }
}

/// The measure of the directions that a cone of emitters covers, M_Ω (equation 1).
fn orientation(cos_normals: f32, cos_emission: f32) -> f32 {
    if cos_normals <= -1.0 + 1e-3 {
        return 2.0 * TAU;
    }
    let cos = cos_normals.min(1.0);
    let angle = cos.acos();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let to = (angle + cos_emission.clamp(-1.0, 1.0).acos()).min(PI);
    TAU * (1.0 - cos) + FRAC_PI_2 * (2.0 * to * sin - (angle - 2.0 * to).cos() - 2.0 * angle * sin + cos)
}

/// Which bin a point is in.
struct Binning {
    low: Vec3,
    scale: Vec3,
    last: u32,
}

impl Binning {
    #[inline(always)]
    fn bins(&self, p: Vec3) -> UVec3 {
        ((p - self.low) * self.scale).as_uvec3().min(UVec3::splat(self.last))
    }
}

/// A plane between two bins.
pub(super) struct Cut {
    binning: Binning,
    axis: usize,
    /// The last bin to its left.
    bin: u32,
}

impl Cut {
    /// Whether lights centred at `p` belong left.
    #[inline]
    pub(super) fn is_left(&self, p: Vec3) -> bool {
        self.binning.bins(p)[self.axis] <= self.bin
    }
}

/// The lights in each bin along each axis.
type Bins = [[Bin; BINS]; 3];

fn fill<T: Item>(list: &[T], parts: &impl Parts, binning: &Binning) -> Bins {
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in list {
        let bounds = item.bounds(parts);
        let at = binning.bins(bounds.centre());
        for axis in 0..3 {
            bins[axis][at[axis] as usize].add(&bounds);
        }
    }
    bins
}

/// The cheapest cut of `list`, whose centres span `low`..`high`; `None` where none leaves lights on both sides.
pub(super) fn cheapest_cut<T: Item>(list: &[T], parts: &impl Parts, low: Vec3, high: Vec3) -> Option<Cut> {
    let size = high - low;
    let count = BINS.min(2 * list.len());
    let scale = size.map(|s| if s > 0.0 { count as f32 / s } else { 0.0 });
    let binning = Binning { low, scale, last: count as u32 - 1 };
    let bins = if list.len() <= PIECE {
        fill(list, parts, &binning)
    } else {
        // Pieces are added up in order, so that sums do not depend on threads.
        let pieces: Vec<Bins> = list.par_chunks(PIECE).map(|piece| fill(piece, parts, &binning)).collect();
        let mut sum = [[Bin::EMPTY; BINS]; 3];
        let add =
            |piece: &Bins| sum.as_flattened_mut().iter_mut().zip(piece.as_flattened()).for_each(|(a, b)| a.merge(b));
        pieces.iter().for_each(add);
        sum
    };
    let mut best = (f64::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate().filter(|&(axis, _)| size[axis] > 0.0) {
        // Thin slices are dear (k_r, equation 2).
        let regularity = f64::from(size.max_element() / size[axis]);
        let mut right = [0.0; BINS];
        let mut sum = Bin::EMPTY;
        for k in (1..count).rev() {
            sum.merge(&bins[k]);
            right[k] = if sum.count > 0 { sum.cost() } else { f64::INFINITY };
        }
        let mut sum = Bin::EMPTY;
        for k in 0..count - 1 {
            sum.merge(&bins[k]);
            let cost = if sum.count > 0 { regularity * (sum.cost() + right[k + 1]) } else { f64::INFINITY };
            if cost < best.0 {
                best = (cost, axis, k as u32);
            }
        }
    }
    best.0.is_finite().then_some(Cut { binning, axis: best.1, bin: best.2 })
}
