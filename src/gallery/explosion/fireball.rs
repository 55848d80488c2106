//! The explosion's grids: smoke in billows, and how hot it is within.

use std::path::Path;

use glam::Vec3;

use super::super::GalleryError;
use super::super::billows::{Bumps, depth, grow};
use super::super::text::Dice;
use super::super::volume::{self, at, noise, smoothstep};
use super::{PLACE, SMOKE_BOX};

/// Edge of a voxel.
const VOXEL: f32 = 0.06;

/// The highest temperature, in kelvin.
pub const HOTTEST: f32 = 2300.0;

/// Writes the file.
pub fn write(path: &Path) -> Result<(), GalleryError> {
    let heaps = [
        (0.0, 2.6, 0.0, 2.1),
        (-1.6, 1.8, -0.4, 1.6),
        (1.8, 2.0, 0.2, 1.6),
        (0.3, 4.6, 0.1, 2.2),
        (-1.5, 5.2, 0.3, 1.5),
        (1.7, 5.6, -0.2, 1.5),
        (0.1, 6.8, 0.1, 1.7),
        (-3.1, 0.9, 0.2, 1.0),
        (3.2, 0.9, -0.3, 1.05),
        (0.2, 1.2, -1.9, 1.2),
        (-0.4, 1.2, 1.9, 1.3),
    ];
    let heaps = heaps.map(|(x, y, z, radius)| (PLACE + Vec3::new(x, y, z), radius));
    let mut dice = Dice::new(1945);
    let puffs = grow(&mut dice, &heaps, 9, 0.42, 0.3);
    let (bumps, small, fray) = (Bumps::new(81, 0.75, 2), Bumps::new(82, 2.4, 2), noise(83, 1.1, 4));
    // How deep below the billows' surface, and below the surface that the bumps stand on.
    let depths = |p: Vec3| {
        let inside = depth(&puffs, p);
        if inside < -1.1 {
            return None;
        }
        let frayed = at(&fray, p);
        let q = p + 0.22 * Vec3::new(frayed, at(&fray, p + 31.0), at(&fray, p - 17.0));
        let bumped = inside - 1.0 + 1.6 * bumps.at(q) + 0.3 * small.at(q) + 0.12 * frayed;
        Some((bumped, inside, frayed))
    };
    let values = |p: Vec3| {
        let Some((bumped, inside, frayed)) = depths(p) else { return [0.0; 2] };
        let thick = smoothstep(0.0, 0.3, bumped) * (0.85 + 0.4 * frayed).clamp(0.4, 1.2);
        // Gas too hot for smoke fills what the billows leave.
        let density = thick.max(0.1 * smoothstep(0.3, 0.8, inside));
        // Hot in the creases and deep inside; the billows' skins have cooled, and more so high up.
        let crease = smoothstep(-0.25, 0.6, inside + 0.35 * frayed) * smoothstep(1.1, 0.25, bumped);
        let core = 0.9 * smoothstep(0.9, 2.0, inside);
        let risen = smoothstep(PLACE.y + 3.0, PLACE.y + 9.5, p.y);
        let kelvin = HOTTEST * crease.max(core) * (1.0 - 0.4 * risen);
        [density, if kelvin < 700.0 { 0.0 } else { kelvin }]
    };
    volume::write(path, SMOKE_BOX.map(|p| p + PLACE), VOXEL, ["density", "temperature"], values)
}
