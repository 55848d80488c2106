//! The cloud's density: heaps of balls on a flat base, with bumps like a cauliflower's, their edges frayed by noise.

use std::path::Path;

use glam::Vec3;

use super::super::GalleryError;
use super::super::billows::{Bumps, depth, grow};
use super::super::text::Dice;
use super::super::volume::{self, at, noise, smoothstep};
use super::CLOUD_BOX;

/// Edge of a voxel.
const VOXEL: f32 = 8.0;
/// Height of the cloud's base.
const BASE: f32 = 720.0;

/// Writes the file.
pub fn write(path: &Path) -> Result<(), GalleryError> {
    let middle = 0.5 * (CLOUD_BOX[0] + CLOUD_BOX[1]).with_y(0.0);
    let heaps = [
        // A low heap to the left …
        (-620.0, 60.0, 0.0, 140.0),
        (-440.0, 140.0, -40.0, 185.0),
        (-400.0, 310.0, 20.0, 130.0),
        // … the tower …
        (-120.0, 200.0, 0.0, 265.0),
        (-170.0, 440.0, 30.0, 230.0),
        (-110.0, 670.0, -10.0, 205.0),
        (-200.0, 850.0, 10.0, 140.0),
        (-50.0, 920.0, 20.0, 105.0),
        // … and a lower one to the right.
        (150.0, 120.0, -80.0, 225.0),
        (360.0, 180.0, 40.0, 225.0),
        (410.0, 390.0, 0.0, 170.0),
        (460.0, 520.0, 20.0, 110.0),
        (620.0, 80.0, -40.0, 165.0),
        (800.0, 40.0, 20.0, 105.0),
        (100.0, 80.0, -260.0, 180.0),
        (-250.0, 60.0, 230.0, 190.0),
        (330.0, 60.0, 260.0, 180.0),
    ];
    let heaps = heaps.map(|(x, y, z, radius)| (middle + Vec3::new(x, BASE + y, z), radius));
    let mut dice = Dice::new(5150);
    let puffs = grow(&mut dice, &heaps, 12, 0.42, BASE + 10.0);
    let (bumps, small, fray) = (Bumps::new(51, 0.0095, 2), Bumps::new(52, 0.03, 2), noise(53, 0.02, 4));
    let density = |p: Vec3| {
        let inside = depth(&puffs, p);
        // Bumps reach no further.
        if inside < -85.0 {
            return 0.0;
        }
        let frayed = at(&fray, p);
        let q = p + 14.0 * Vec3::new(frayed, at(&fray, p + 311.0), at(&fray, p - 173.0));
        let inside = inside - 55.0 + 100.0 * bumps.at(q) + 34.0 * small.at(q) + 16.0 * frayed;
        // The base is flat and thin.
        let above = p.y - BASE - 22.0 * at(&fray, p * Vec3::new(0.5, 0.0, 0.5));
        smoothstep(0.0, 34.0, inside) * smoothstep(-25.0, 45.0, above) * (0.82 + 0.35 * frayed).clamp(0.3, 1.0)
    };
    volume::write(path, CLOUD_BOX, VOXEL, ["density"], |p| [density(p)])
}
