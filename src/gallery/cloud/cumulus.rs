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
        (-480.0, 60.0, 40.0, 190.0),
        (-250.0, 170.0, -90.0, 240.0),
        (-40.0, 300.0, 30.0, 300.0),
        (60.0, 560.0, 0.0, 235.0),
        (-60.0, 720.0, 60.0, 150.0),
        (230.0, 210.0, -60.0, 260.0),
        (300.0, 330.0, 110.0, 210.0),
        (480.0, 120.0, 20.0, 200.0),
        (690.0, 50.0, -20.0, 130.0),
        (-680.0, 20.0, 30.0, 95.0),
        (100.0, 80.0, -240.0, 190.0),
        (-150.0, 60.0, 220.0, 200.0),
        (330.0, 60.0, 240.0, 190.0),
    ];
    let heaps = heaps.map(|(x, y, z, radius)| (middle + Vec3::new(x, BASE + y, z), radius));
    let mut dice = Dice::new(5150);
    let puffs = grow(&mut dice, &heaps, 12, 0.42, BASE + 10.0);
    let (bumps, small, fray) = (Bumps::new(51, 0.0095, 2), Bumps::new(52, 0.03, 2), noise(53, 0.02, 4));
    let density = |p: Vec3| {
        let inside = depth(&puffs, p);
        // Bumps reach no further.
        if inside < -75.0 {
            return 0.0;
        }
        let frayed = at(&fray, p);
        let q = p + 14.0 * Vec3::new(frayed, at(&fray, p + 311.0), at(&fray, p - 173.0));
        let inside = inside - 35.0 + 78.0 * bumps.at(q) + 24.0 * small.at(q) + 16.0 * frayed;
        // The base is flat and thin.
        let above = p.y - BASE - 22.0 * at(&fray, p * Vec3::new(0.5, 0.0, 0.5));
        smoothstep(0.0, 34.0, inside) * smoothstep(-25.0, 45.0, above) * (0.82 + 0.35 * frayed).clamp(0.3, 1.0)
    };
    volume::write(path, CLOUD_BOX, VOXEL, &[("density", &density)])
}
