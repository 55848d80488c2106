//! pbrt's medium type `cloud`: a cumulus made of noise in a box.
//!
//! Source: pbrt-v4, section 11.4.3 and its file format. There the density is computed wherever it is asked for; here on a grid, once, fine enough for
//! the finest of its octaves, so that it is a medium like any other: with tight bounds.

use glam::{DAffine3, DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

use super::uniform::Lattice;
use super::{Result, anisotropy, coefficient, factor, wrong};
use crate::math::Rgb;
use crate::math::noise::{noise, noise_slope};
use crate::medium::Medium;
use crate::medium::grid::field::ScalarGrid;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};
use crate::scene::{ParamSet, Warnings};

/// Octaves of the density, each 1.99 times as fine as the one before.
const OCTAVES: i32 = 5;
const LACUNARITY: f32 = 1.99;
/// Voxels in a cell of the finest octave.
const VOXELS: f64 = 2.5;
/// The most voxels along an axis.
const MOST: f64 = 160.0;

/// How a cloud looks.
struct Cloud {
    density: f32,
    wispiness: f32,
    frequency: f32,
}

impl Cloud {
    /// The density at `p` of the medium's space: 0 to 1.
    fn at(&self, p: Vec3) -> f32 {
        // Whatever the noise.
        if p.y <= 0.0 || p.y >= 1.0 {
            return f32::from(p.y <= 0.0);
        }
        let mut q = self.frequency * p;
        if self.wispiness > 0.0 {
            let (mut reach, mut scale) = (0.05 * self.wispiness, 10.0);
            for _ in 0..2 {
                q += reach * noise_slope(scale * q);
                reach *= 0.5;
                scale *= LACUNARITY;
            }
        }
        let (mut sum, mut strength, mut scale) = (0.0, 0.5, 1.0);
        for _ in 0..OCTAVES {
            sum += strength * noise(scale * q);
            strength *= 0.5;
            scale *= LACUNARITY;
        }
        // Thinner higher up, and filled below.
        let body = ((1.0 - p.y) * 4.5 * self.density * sum).clamp(0.0, 1.0);
        (body + 2.0 * (0.5 - p.y).max(0.0)).clamp(0.0, 1.0)
    }
}

/// Builds the medium.
pub fn cloud(params: &ParamSet, render_from_medium: &DAffine3, warnings: &mut Warnings) -> Result<Medium> {
    let look = Cloud {
        density: factor(params, "density", 1.0)?,
        wispiness: factor(params, "wispiness", 1.0)?,
        frequency: factor(params, "frequency", 5.0)?,
    };
    let corner = |name: &str, default: Vec3| -> Result<DVec3> {
        let corner = params.vec3(name)?.map_or(default, Vec3::from_array);
        if corner.is_finite() { Ok(corner.as_dvec3()) } else { Err(wrong(params, name, "must be finite")) }
    };
    let (p0, p1) = (corner("p0", Vec3::ZERO)?, corner("p1", Vec3::ONE)?);
    let fine = f64::from(look.frequency) * f64::from(LACUNARITY).powi(OCTAVES - 1) * VOXELS;
    let wanted = ((p1 - p0).abs() * fine).ceil();
    let size = wanted.clamp(DVec3::splat(8.0), DVec3::splat(MOST));
    if wanted.max_element() > MOST {
        let message = format!(
            "{}: {} voxels along an axis would show all of it, {MOST} are made",
            params.owner,
            wanted.max_element()
        );
        warnings.add(Some(params.span), message);
    }
    let size = size.as_uvec3().to_array();
    let lattice = Lattice::within(params, render_from_medium, p0, p1, size)?;
    let (low, cell) = (p0.min(p1), (p1 - p0).abs() / DVec3::from_array(size.map(f64::from)));
    let [nx, ny, nz] = size.map(|n| n as usize);
    // x fastest, as in pbrt's dense grids.
    let place = |i: usize| {
        let ijk = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
        (low + (ijk + 0.5) * cell).as_vec3()
    };
    let values: Vec<f16> = (0..nx * ny * nz).into_par_iter().map(|i| f16::from_f32(look.at(place(i)))).collect();
    let grid = SparseGrid::from_dense(size, |i| values[i], f16::ZERO);
    let parts = GridMediumParts {
        density: Some(lattice.field(ScalarGrid::Half(std::sync::Arc::new(grid)))),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: coefficient(params, "sigma_a", Rgb::WHITE)?,
        sigma_s: coefficient(params, "sigma_s", Rgb::WHITE)?,
        scale: factor(params, "scale", 1.0)?,
        emission: None,
        g: anisotropy(params, warnings)?,
        clip: Some(lattice.clip()),
        motion: None,
    };
    Ok(Medium::Grid(Box::new(GridMedium::new(parts))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_full_below_and_empty_above() {
        let cloud = Cloud { density: 1.0, wispiness: 1.0, frequency: 5.0 };
        let share = |y: f32| {
            let at = |i: u32| cloud.at(Vec3::new((i % 40) as f32 / 40.0, y, (i / 40) as f32 / 40.0));
            (0..1600).map(at).sum::<f32>() / 1600.0
        };
        assert!(share(0.0) == 1.0 && share(1.0) == 0.0);
        let (low, high) = (share(0.55), share(0.9));
        assert!(low > high && high > 0.0 && low < 0.9, "{low} {high}");
    }
}
