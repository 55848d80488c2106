//! The scene's two .vdb files: banks of fog, and the fire (density of soot and smoke, temperature in kelvin).

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{FloatExt, Vec3};
use openvdb::{Compression, Precision, VdbWriter};

use super::super::GalleryError;
use super::{FIRE, FIRE_BOX, FOG_BOX};
use crate::system::output::write_atomically;

fn noise(seed: i32, frequency: f32, octaves: i32) -> FastNoiseLite {
    let mut noise = FastNoiseLite::with_seed(seed);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(octaves));
    noise.set_frequency(Some(frequency));
    noise
}

fn at(noise: &FastNoiseLite, p: Vec3) -> f32 {
    noise.get_noise_3d(p.x, p.y, p.z)
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A grid of `value` at voxels of edge `voxel` all over `region`.
fn grid(
    writer: &mut VdbWriter,
    name: &str,
    [low, high]: [Vec3; 2],
    voxel: f32,
    value: impl Fn(Vec3) -> f32,
) -> Result<(), openvdb::VdbError> {
    let size = ((high - low) / voxel).ceil().as_uvec3();
    writer.fog_grid(name, Precision::Half, 0.0, f64::from(voxel), (low + 0.5 * voxel).as_dvec3().to_array())?;
    writer.dense([0; 3], size.to_array(), 0.0, |x, y, z| {
        value(low + (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * voxel)
    })
}

fn save(path: &Path, fill: impl FnOnce(&mut VdbWriter) -> Result<(), openvdb::VdbError>) -> Result<(), GalleryError> {
    let write = |file: &Path| {
        let mut writer = VdbWriter::new()?;
        fill(&mut writer)?;
        writer.write(file, Compression::Zip)
    };
    Ok(write_atomically(path, |file| write(file.path()).map_err(|error| error.to_string()))?)
}

/// Fog: drifting banks, densest on the water.
pub fn write_fog(path: &Path) -> Result<(), GalleryError> {
    let (banks, wisps) = (noise(21, 0.075, 4), noise(22, 0.35, 3));
    save(path, |writer| {
        grid(writer, "density", FOG_BOX, 0.4, |p| {
            let bank =
                0.5 + 0.9 * at(&banks, p * Vec3::new(0.7, 2.0, 1.0)) + 0.25 * at(&wisps, p * Vec3::new(1.0, 1.8, 1.0));
            let top = 1.0 + 2.2 * bank.clamp(0.0, 1.0);
            let edge = smoothstep(0.0, 6.0, (FOG_BOX[1].x - p.x.abs()).min(FOG_BOX[1].z - p.z).min(p.z - FOG_BOX[0].z));
            1.6 * smoothstep(0.1, 1.0, bank) * (-p.y / 1.1).exp() * smoothstep(top, 0.5 * top, p.y) * edge
        })
    })
}

/// What the fire is at a point, in metres from the middle of the brazier's rim.
struct Fire {
    sway: FastNoiseLite,
    tongues: FastNoiseLite,
    smoke: FastNoiseLite,
}

impl Fire {
    const HEIGHT: f32 = 2.5;

    fn new() -> Self {
        Self { sway: noise(31, 0.9, 2), tongues: noise(32, 1.9, 4), smoke: noise(33, 0.9, 4) }
    }

    /// How deep inside the flames: above 0 within.
    fn depth(&self, p: Vec3) -> f32 {
        let h = (p.y + 0.3) / Self::HEIGHT;
        if !(0.0..=1.15).contains(&h) {
            return -1.0;
        }
        // Rising gas sways more the higher it is, and is drawn out along its way.
        let slow = p * Vec3::new(1.0, 0.55, 1.0);
        let sway = Vec3::new(at(&self.sway, slow), 0.0, at(&self.sway, slow + 17.0)) * 0.55 * h;
        let q = p + sway - Vec3::new(0.12 * h * h, 0.0, 0.0);
        let radius = 0.56 * (1.0 - h).max(0.0).powf(0.75) * (0.8 + 0.9 * h.min(0.35));
        let radial = (q.x * q.x + q.z * q.z).sqrt();
        let tongues = at(&self.tongues, q * Vec3::new(1.0, 0.42, 1.0));
        (radius - radial) / 0.35 + (0.25 + 1.3 * h) * tongues
    }

    /// Kelvin; 0 where nothing glows.
    fn temperature(&self, p: Vec3) -> f32 {
        let depth = self.depth(p);
        if depth <= 0.0 {
            return 0.0;
        }
        let h = ((p.y + 0.3) / Self::HEIGHT).clamp(0.0, 1.0);
        let core = smoothstep(0.0, 1.1, depth);
        1250.0 + 620.0 * core * 1.0f32.lerp(0.55, h) + 60.0 * at(&self.tongues, 2.0 * p)
    }

    /// Soot in the flames, smoke above them.
    fn density(&self, p: Vec3) -> f32 {
        let depth = self.depth(p);
        let soot =
            if depth > 0.0 { smoothstep(0.0, 0.35, depth) * (0.75 + 0.5 * at(&self.tongues, 1.7 * p)) } else { 0.0 };
        let above = p.y - 1.3;
        let smoke = if above > 0.0 {
            let drift = Vec3::new(0.06 * above * above, 0.0, 0.0);
            let q = p - drift + 0.25 * above.sqrt() * Vec3::new(at(&self.smoke, p), 0.0, at(&self.smoke, p + 9.0));
            let radius = 0.28 + 0.16 * above;
            let radial = (q.x * q.x + q.z * q.z).sqrt();
            let billows = at(&self.smoke, q * 1.6);
            let fade = smoothstep(0.0, 0.8, above) * smoothstep(4.6, 2.0, above);
            0.55 * fade * smoothstep(0.0, 0.6, (radius - radial) / 0.4 + 0.9 * billows)
        } else {
            0.0
        };
        soot.max(smoke)
    }
}

/// The fire and its smoke.
pub fn write_fire(path: &Path) -> Result<(), GalleryError> {
    let fire = Fire::new();
    let region = FIRE_BOX.map(|p| p + FIRE);
    save(path, |writer| {
        grid(writer, "density", region, 0.04, |p| fire.density(p - FIRE))?;
        grid(writer, "temperature", region, 0.04, |p| fire.temperature(p - FIRE))
    })
}
