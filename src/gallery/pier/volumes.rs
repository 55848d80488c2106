//! The scene's two .vdb files: banks of fog, and the fire (density of soot and smoke, temperature in kelvin).

use std::path::Path;

use glam::Vec3;

use super::super::GalleryError;
use super::super::flames::Fire;
use super::super::volume::{self, at, noise, smoothstep};
use super::{FIRE, FIRE_BOX, FOG_BOX};

/// Fog: drifting banks, densest on the water.
pub fn write_fog(path: &Path) -> Result<(), GalleryError> {
    let (banks, wisps) = (noise(21, 0.075, 4), noise(22, 0.35, 3));
    let density = |p: Vec3| {
        let bank =
            0.5 + 0.9 * at(&banks, p * Vec3::new(0.7, 2.0, 1.0)) + 0.25 * at(&wisps, p * Vec3::new(1.0, 1.8, 1.0));
        let top = 1.0 + 2.2 * bank.clamp(0.0, 1.0);
        let edge = smoothstep(0.0, 6.0, (FOG_BOX[1].x - p.x.abs()).min(FOG_BOX[1].z - p.z).min(p.z - FOG_BOX[0].z));
        1.6 * smoothstep(0.1, 1.0, bank) * (-p.y / 1.1).exp() * smoothstep(top, 0.5 * top, p.y) * edge
    };
    volume::write(path, FOG_BOX, 0.4, ["density"], |p| [density(p)])
}

/// The fire and its smoke.
pub fn write_fire(path: &Path) -> Result<(), GalleryError> {
    let fire = Fire::new(31);
    volume::write(path, FIRE_BOX.map(|p| p + FIRE), 0.04, Fire::GRIDS, |p| fire.at(p - FIRE))
}
