//! Where a medium given by grids emits, as a coarse grid that directions are drawn from: a cell in proportion to the energy that leaves it, a
//! point in it, and the direction is that to the point.
//!
//! Source: Li et al., DigiPro 2024, section 4.3 and its algorithm 2; Villemin & Hery, "Practical Illumination from Flames", JCGT 2013. Every
//! cell that a ray crosses could have produced its direction ω, so from p
//!
//! ```text
//! p(ω) = ∫ p_x(p + t ω) t² dt = Σ_cells p_x(cell) (t_out³ − t_in³) / 3,
//! ```
//!
//! with p_x the density of points, which is constant in a cell. **Ours:** energy is that which gets out: a cell's emission times the
//! transmittance of the cells around it, the mean over the six directions of the axes, so that the inside of a cloud of smoke is not
//! looked for. The same walk gives an estimate of the radiance that arrives, ∫ I p_x dt with I the energy of all cells.

use glam::{DAffine3, DVec3, IVec3, Vec3};

use super::survey::Survey;
use crate::math::Rgb;
use crate::math::alias::AliasTable;

/// Energy that no more than this share of gets out counts as if this share did.
const LEAST_ESCAPE: f64 = 1e-3;

/// Radiance and pdfs go no further, so that products with them stay finite.
const MOST: f32 = 1e30;

/// The coarse grid.
#[derive(Debug)]
pub struct EnergyGrid {
    /// Render space to cells, which are unit cubes from the origin on.
    cells_from_render: DAffine3,
    size: IVec3,
    /// Of each cell, z fastest.
    pmf: Box<[f32]>,
    /// One over a cell's volume in render space.
    per_volume: f64,
    /// Chooses among those with energy, whose numbers are `kept`.
    table: AliasTable,
    kept: Box<[u32]>,
    /// ∫ μ_a L_e dV as far as it gets out: radiant intensity, W/sr.
    intensity: Rgb,
    bounds: (Vec3, Vec3),
}

/// What a direction meets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Its solid-angle pdf.
    pub pdf: f32,
    /// An estimate of the radiance that arrives from there if nothing else is in the way.
    pub radiance: Rgb,
}

impl EnergyGrid {
    /// `None` where there is no energy, or none that can be counted.
    pub(super) fn new(survey: &Survey) -> Option<Self> {
        let volume = survey.cells_from_render.matrix3.determinant().abs().recip();
        let escape = escape(survey);
        let mut intensity = [0.0f64; 3];
        let energies: Vec<f64> = survey
            .cells
            .iter()
            .zip(&escape)
            .map(|(cell, escape)| {
                let share = volume * escape.max(LEAST_ESCAPE);
                for (sum, emission) in intensity.iter_mut().zip(cell.emission.to_array()) {
                    *sum += share * f64::from(emission);
                }
                share * f64::from(cell.emission.luminance())
            })
            .collect();
        let total: f64 = energies.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let pmf: Box<[f32]> = energies.iter().map(|energy| (energy / total) as f32).collect();
        let kept: Box<[u32]> = (0..pmf.len() as u32).filter(|&cell| pmf[cell as usize] > 0.0).collect();
        let weights: Vec<f32> = kept.iter().map(|&cell| pmf[cell as usize]).collect();
        let grid = Self {
            cells_from_render: survey.cells_from_render,
            size: survey.size,
            table: AliasTable::new(&weights)?,
            bounds: render_box(&survey.cells_from_render, survey.size, &kept),
            kept,
            pmf,
            per_volume: volume.recip(),
            intensity: Rgb::from(intensity.map(|sum| (sum as f32).min(MOST))),
        };
        grid.per_volume.is_finite().then_some(grid)
    }

    /// A box of render space around all cells with energy.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// ∫ μ_a L_e dV as far as it gets out: radiant intensity, W/sr.
    pub fn intensity(&self) -> Rgb {
        self.intensity
    }

    /// Cells with energy.
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// Whether there are none, which there always are.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// A unit direction from `p` to a point of a cell, drawn with numbers in [0, 1); `None` where that point is `p`.
    #[inline]
    pub fn sample(&self, p: Vec3, u: [f32; 2], u_cell: f64) -> Option<Vec3> {
        let (choice, rest) = self.table.sample(u_cell);
        let cell = self.kept[choice as usize] as i32;
        let corner = IVec3::new(cell / self.size.z / self.size.y, cell / self.size.z % self.size.y, cell % self.size.z);
        let at = corner.as_dvec3() + DVec3::new(f64::from(u[0]), f64::from(u[1]), rest);
        // The point from `p` on, in the cells' space, so that little is lost far from the origin.
        let from = self.cells_from_render.transform_point3(p.as_dvec3());
        let towards = self.cells_from_render.matrix3.inverse() * (at - from);
        towards.try_normalize().map(|w| w.as_vec3().normalize())
    }

    /// What the unit direction `w` from `p` meets.
    pub fn along(&self, p: Vec3, w: Vec3) -> Line {
        let origin = self.cells_from_render.transform_point3(p.as_dvec3());
        let direction = self.cells_from_render.transform_vector3(w.as_dvec3());
        let (mut cubes, mut lengths) = (0.0, 0.0);
        self.walk(origin, direction, |cell, t_in, t_out| {
            let pmf = f64::from(self.pmf[cell]);
            if pmf > 0.0 {
                let length = t_out - t_in;
                // (t_out³ − t_in³)/3 without cancellation.
                cubes += pmf * length * (t_out * t_out + t_out * t_in + t_in * t_in) * (1.0 / 3.0);
                lengths += pmf * length;
            }
        });
        let finite = |x: f64| if x < f64::from(MOST) { x as f32 } else { MOST };
        Line {
            pdf: finite(cubes * self.per_volume),
            radiance: self.intensity.map(|i| finite(f64::from(i) * lengths * self.per_volume)),
        }
    }

    /// The cells along a ray from t = 0 on, with where it enters and leaves them (Amanatides & Woo 1987). As many steps as the grid
    /// has cells along its three sides at most.
    #[inline]
    fn walk(&self, origin: DVec3, direction: DVec3, mut visit: impl FnMut(usize, f64, f64)) {
        let size = self.size.as_dvec3();
        let inverse = direction.recip();
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if !(0.0..size[axis]).contains(&origin[axis]) {
                    return;
                }
                continue;
            }
            let (a, b) = (-origin[axis] * inverse[axis], (size[axis] - origin[axis]) * inverse[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if !(enter < leave && leave.is_finite()) {
            return;
        }
        let mut cell = (origin + direction * enter).floor().as_ivec3().clamp(IVec3::ZERO, self.size - 1);
        let mut t = enter;
        let stride = IVec3::new(self.size.y * self.size.z, self.size.z, 1);
        let steps: IVec3 = IVec3::from_array(direction.to_array().map(|d| if d > 0.0 { 1 } else { -1 }));
        let side = |cell: IVec3, axis: usize| {
            if direction[axis] == 0.0 {
                return f64::INFINITY;
            }
            (f64::from(cell[axis] + i32::from(direction[axis] > 0.0)) - origin[axis]) * inverse[axis]
        };
        let mut next = DVec3::new(side(cell, 0), side(cell, 1), side(cell, 2));
        loop {
            let axis = if next.x <= next.y && next.x <= next.z {
                0
            } else if next.y <= next.z {
                1
            } else {
                2
            };
            let exit = next[axis].clamp(t, leave);
            if exit > t {
                visit(cell.dot(stride) as usize, t, exit);
            }
            cell[axis] += steps[axis];
            if exit >= leave || !(0..self.size[axis]).contains(&cell[axis]) {
                return;
            }
            t = exit;
            next[axis] = side(cell, axis);
        }
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.pmf) + size_of_val(&*self.kept) + self.table.memory()
    }
}

/// The share of each cell's emission that gets out of the grid, scattering counted as loss: the mean over the axes' six directions.
fn escape(survey: &Survey) -> Vec<f64> {
    let mut sum = vec![0.0; survey.cells.len()];
    for axis in 0..3 {
        let edge = survey.edges()[axis];
        let (columns, step, count) = survey.columns(axis);
        for first in columns {
            let mut pass = |order: &mut dyn Iterator<Item = usize>| {
                let mut passed = 1.0;
                for i in order {
                    let depth = edge * survey.cells[first + i * step].extinction;
                    let own = (-depth).exp();
                    // ∫ e^{−s} ds over the cell's own depth, relative to it.
                    let within = if depth > 1e-6 { (1.0 - own) / depth } else { 1.0 };
                    sum[first + i * step] += passed * within * (1.0 / 6.0);
                    passed *= own;
                }
            };
            pass(&mut (0..count));
            pass(&mut (0..count).rev());
        }
    }
    sum
}

/// A box of render space around the cells of these numbers.
fn render_box(cells_from_render: &DAffine3, size: IVec3, kept: &[u32]) -> (Vec3, Vec3) {
    let (mut low, mut high) = (size, IVec3::ZERO);
    for &cell in kept {
        let cell = cell as i32;
        let at = IVec3::new(cell / size.z / size.y, cell / size.z % size.y, cell % size.z);
        (low, high) = (low.min(at), high.max(at + 1));
    }
    let render_from_cells = cells_from_render.inverse();
    let corner = |p: DVec3| render_from_cells.transform_point3(p);
    let (low, high) = super::map::box_of_corners(low.as_dvec3(), high.as_dvec3(), corner);
    (low.as_vec3().map(f32::next_down), high.as_vec3().map(f32::next_up))
}

#[cfg(test)]
mod tests;
