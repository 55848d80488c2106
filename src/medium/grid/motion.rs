//! Media that move while the shutter is open, by a grid of velocities. Source: Kim & Ko, "Eulerian Motion Blur", Eurographics Workshop on Natural
//! Phenomena 2007: what is at x at the time t was at x − v(x) (t − t₀) when the grids were written, at t₀.
//!
//! One step back along the velocity at the point itself, so it is exact where velocity is the same all around, and rotations open a little into
//! spirals. Bounds of a cell are those of all cells that the step may come from.

use glam::{DAffine3, DMat3, IVec3, Mat3, Vec3};

use super::bounds::Lattice;
use super::majorants::{Majorants, MajorantsBuilder};
use super::map::IndexMap;
use super::velocity::VelocityField;

/// How the grids of a medium move.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Velocities.
    pub field: VelocityField,
    /// Velocity to displacement in render space over a normalised time of 1.
    pub render_from_velocity: Mat3,
    /// The normalised time t₀.
    pub written_at: f32,
}

/// More voxels of the density than this nothing may move by: bounds would have to be looked for all over the grid.
pub const FARTHEST: f64 = 1024.0;

/// Of more cells than this a cell's bound is not looked for one by one.
const MOST_CELLS: i64 = 1 << 15;

/// For large cubes of one speed no more cells than this are looked at in all: of half of them part by part, then for each cube as a whole, and what is left
/// has the bound of the whole medium.
const MOST_LOOKS: i64 = 1 << 24;

impl Motion {
    /// Where what is at `p` at the normalised time `time` was at t₀; render space.
    #[inline]
    pub fn back(&self, p: Vec3, time: f32) -> Vec3 {
        p - self.render_from_velocity * self.field.at(p) * (time - self.written_at)
    }

    /// How many voxels of a grid with this place anything moves by at most, near the grid's origin if it is a frustum.
    pub fn farthest(&self, map: &IndexMap) -> f64 {
        self.voxels(map.local_from_render()) * f64::from(self.field.largest())
    }

    /// How many voxels a velocity of 1 moves by at most.
    fn voxels(&self, index_from_render: &DAffine3) -> f64 {
        let linear = DMat3::from_cols_array(&self.render_from_velocity.to_cols_array().map(f64::from));
        norm(&(index_from_render.matrix3 * linear)) * f64::from(self.span())
    }

    /// The largest |t − t₀| while time is between 0 and 1.
    fn span(&self) -> f32 {
        self.written_at.abs().max((1.0 - self.written_at).abs())
    }

    /// `bounds` over the cells of `lattice` as they are while the medium moves.
    pub(super) fn moved(&self, lattice: &Lattice, bounds: &Majorants) -> Majorants {
        let most = self.voxels(&lattice.cells_from_render);
        let distance = |speed: f32| (most * f64::from(speed) * (1.0 + 1e-6)) as f32;
        let mut builder = MajorantsBuilder::new(distance(self.field.background()));
        self.field.add(lattice, &mut builder, distance);
        dilated(bounds, &builder.build())
    }
}

/// A bound of the length that a matrix makes of a unit vector: Frobenius' norm.
fn norm(m: &DMat3) -> f64 {
    m.to_cols_array().map(|x| x * x).iter().sum::<f64>().sqrt()
}

/// The bound of every cell raised to that of all within the distance (in voxels) that `distances` has there.
fn dilated(bounds: &Majorants, distances: &Majorants) -> Majorants {
    let mut out = bounds.to_builder();
    // Where nothing else is known all moves alike.
    let everywhere = reach(distances.background());
    if everywhere > 0 {
        bounds.each_cell(|low, edge, bound| {
            let high = low.saturating_add(IVec3::splat(edge - 1));
            let around = IVec3::splat(everywhere);
            out.raise_voxels(low.saturating_sub(around), high.saturating_add(around), bound);
        });
    }
    let mut looks = 0i64;
    distances.each_cell(|low, edge, distance| {
        if distance <= distances.background() {
            return;
        }
        let around = reach(distance);
        // Cell by cell of the finest there are, up to a size where that would take too long.
        let step = if looks < MOST_LOOKS / 2 { 8.max(edge / 16) } else { edge };
        let knows = edge <= 8 || looks < MOST_LOOKS;
        if edge > 8 {
            let cells_around = (i64::from(step) + 2 * i64::from(around)) / 8 + 1;
            looks += i64::from(edge / step).pow(3) * cells_around.pow(3).min(MOST_CELLS);
        }
        for x in 0..edge / step {
            for y in 0..edge / step {
                for z in 0..edge / step {
                    let low = low + step * IVec3::new(x, y, z);
                    let high = low + (step - 1);
                    let (a, b) = (low.saturating_sub(IVec3::splat(around)), high.saturating_add(IVec3::splat(around)));
                    let most = if knows { largest_within(bounds, a, b) } else { bounds.largest() };
                    if most > bounds.background() {
                        out.raise_voxels(low, high, most);
                    }
                }
            }
        }
    });
    out.build()
}

/// Whole voxels that a step of `distance` may come across, that which interpolation and rounding reach included.
fn reach(distance: f32) -> i32 {
    if distance > 0.0 { (distance.ceil().min(1e9) as i32).saturating_add(1) } else { 0 }
}

/// The largest bound of the cells that hold the voxels `low..=high`.
fn largest_within(bounds: &Majorants, low: IVec3, high: IVec3) -> f32 {
    let (first, last) = (low >> 3i32, high >> 3i32);
    let size = last.as_i64vec3() - first.as_i64vec3() + 1;
    if size.x.saturating_mul(size.y).saturating_mul(size.z) > MOST_CELLS {
        return bounds.largest();
    }
    let mut most = bounds.background();
    for x in first.x..=last.x {
        for y in first.y..=last.y {
            for z in first.z..=last.z {
                most = most.max(bounds.cell(IVec3::new(x, y, z) << 3i32).1);
            }
        }
    }
    most
}

#[cfg(test)]
mod tests;
