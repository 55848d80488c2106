//! Procedural .vdb files: noise, and grids of a function's values all over a box. Builds without OpenVDB refuse to write them.

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::Vec3;

use super::GalleryError;

/// Fractal noise in about −1..1 with `frequency` features a unit length.
pub fn noise(seed: i32, frequency: f32, octaves: i32) -> FastNoiseLite {
    let mut noise = FastNoiseLite::with_seed(seed);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(octaves));
    noise.set_frequency(Some(frequency));
    noise
}

/// The noise at a point.
pub fn at(noise: &FastNoiseLite, p: Vec3) -> f32 {
    noise.get_noise_3d(p.x, p.y, p.z)
}

/// 0 up to `low`, 1 from `high` on (the other way round where `high` is less), smooth between.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Writes a file of grids, named `names`, with voxels of edge `voxel` all over `region`: `values` at their middles.
#[cfg(feature = "openvdb")]
pub fn write<const N: usize>(
    path: &Path,
    region: [Vec3; 2],
    voxel: f32,
    names: [&str; N],
    values: impl Fn(Vec3) -> [f32; N] + Sync,
) -> Result<(), GalleryError> {
    use openvdb::{Compression, Precision, VdbWriter};
    use rayon::prelude::*;

    let [low, high] = region;
    let size = ((high - low) / voxel).ceil().as_uvec3();
    let (row, layer) = (size.x as usize, (size.x * size.y) as usize);
    let mut voxels = vec![[0.0; N]; layer * size.z as usize];
    voxels.par_chunks_mut(row).enumerate().for_each(|(i, voxels)| {
        let (y, z) = (i as u32 % size.y, i as u32 / size.y);
        for (x, v) in voxels.iter_mut().enumerate() {
            *v = values(low + (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * voxel);
        }
    });
    let write = |file: &Path| {
        let mut writer = VdbWriter::new()?;
        let origin = (low + 0.5 * voxel).as_dvec3().to_array();
        for (grid, name) in names.into_iter().enumerate() {
            writer.fog_grid(name, Precision::Half, 0.0, f64::from(voxel), origin)?;
            writer.dense([0; 3], size.to_array(), 0.0, |x, y, z| {
                voxels[x as usize + y as usize * row + z as usize * layer][grid]
            })?;
        }
        writer.write(file, Compression::Zip)
    };
    let write = |file: &Path| write(file).map_err(|error| error.to_string());
    Ok(crate::system::output::write_atomically(path, |file| write(file.path()))?)
}

/// Refuses: this build cannot write .vdb files.
#[cfg(not(feature = "openvdb"))]
pub fn write<const N: usize>(
    _: &Path,
    _: [Vec3; 2],
    _: f32,
    _: [&str; N],
    _: impl Fn(Vec3) -> [f32; N] + Sync,
) -> Result<(), GalleryError> {
    Err(GalleryError::NoVolumes)
}
