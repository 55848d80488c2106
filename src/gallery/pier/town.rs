//! The hills behind the bay and the town on them: houses by the thousand, each with a lit window and many points of light
//! along its walls. The points are in files of their own, since there may be millions of them.

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{FloatExt, Quat, Vec3};

use super::super::GalleryError;
use super::super::glow::Glow;
use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText, share};
use super::festival::Shares;

/// Where the hills begin and end.
const DEEP: [f32; 2] = [98.0, 1300.0];
/// The most houses.
const MOST_HOUSES: u32 = 20_000;
/// Lights a house has before there is another.
const LIGHTS_A_HOUSE: u32 = 24;
/// Points of light in a file: some ten megabytes.
const POINTS_A_FILE: u32 = 500_000;
/// Colours of the points.
const GLOWS: [Glow; 6] = [
    Glow::Kelvin(1900.0),
    Glow::Kelvin(2200.0),
    Glow::Kelvin(2700.0),
    Glow::Kelvin(4000.0),
    Glow::Paper([1.5, 0.35, 0.15]),
    Glow::Paper([0.4, 1.1, 1.2]),
];
/// Radiant intensity of all points together: a town with more of them is strung with dimmer ones.
const INTENSITY: f32 = 4000.0;

/// A house.
struct House {
    at: Vec3,
    turn: f32,
    size: f32,
}

/// Adds the town to `t`, which includes the files with its points.
pub fn write(folder: &Path, t: &mut SceneText, shares: &Shares) -> Result<(), GalleryError> {
    let mut dice = Dice::new(8086);
    let hills = Hills::new();
    t.add(format_args!("\n# The hills and the town"));
    t.diffuse(&[
        ("meadow", [0.1, 0.11, 0.07]),
        ("wall", [0.5, 0.45, 0.38]),
        ("brick", [0.36, 0.19, 0.13]),
        ("tiles", [0.2, 0.08, 0.05]),
    ]);
    t.of("meadow", |t| t.mesh(&hills.mesh()));
    for (kind, wall) in ["wall", "brick"].into_iter().enumerate() {
        t.object(&format!("house{kind}"), |t| house(t, wall));
    }
    let count = ((shares.windows + shares.points) / LIGHTS_A_HOUSE).clamp(1, MOST_HOUSES);
    let houses: Vec<House> = (0..count).map(|_| hills.house(&mut dice)).collect();
    for house in &houses {
        let (turn, size, kind) = (Number(house.turn.to_degrees()), Number(house.size), dice.below(2));
        let at = Point(house.at);
        t.block(|t| {
            t.add(format_args!(
                "Translate {at} Rotate {turn} 0 1 0 Scale {size} {size} {size} ObjectInstance \"house{kind}\""
            ));
        });
    }
    windows(t, &mut dice, &houses, shares.windows);
    let files = shares.points.div_ceil(POINTS_A_FILE);
    let intensity = INTENSITY / shares.points.max(100_000) as f32;
    for file in 0..files {
        let name = format!("town{file}.pbrt");
        t.add(format_args!("Include \"{name}\""));
        let mut points = SceneText::default();
        points.add(format_args!("# Lights of the town: part of pier.pbrt"));
        // Each file has some lights of every house.
        let mut places = GLOWS.map(|_| vec![]);
        let here = share(shares.points, files, file);
        for (i, house) in houses.iter().enumerate() {
            for _ in 0..share(here, count, i as u32) {
                // A house is lit in two colours.
                let glow = (i * 5 + dice.below(2) * (1 + i % 4)) % GLOWS.len();
                places[glow].push(house.on_wall(&mut dice));
            }
        }
        for (glow, places) in GLOWS.into_iter().zip(places) {
            glow.points(&mut points, &places, intensity);
        }
        points.write(&folder.join(name))?;
    }
    Ok(())
}

/// Glowing globes before the walls that face the bay.
fn windows(t: &mut SceneText, dice: &mut Dice, houses: &[House], count: u32) {
    let mut places = [(); 3].map(|()| vec![]);
    for (i, house) in houses.iter().enumerate() {
        for _ in 0..share(count, houses.len() as u32, i as u32) {
            let p = house.at + house.size * Vec3::new(dice.between(-4.0, 4.0), dice.between(1.0, 4.5), -5.2);
            places[dice.below(3)].push(p);
        }
    }
    for (kelvin, places) in [2100.0, 2600.0, 3600.0].into_iter().zip(places) {
        Glow::Kelvin(kelvin).bulbs(t, &places, 0.28, 5.0);
    }
}

/// A house around the origin, sunk into the slope.
fn house(t: &mut SceneText, wall: &str) {
    t.add(format_args!("NamedMaterial \"{wall}\""));
    t.cuboid(Vec3::new(-4.0, -6.0, -3.0), Vec3::new(4.0, 4.6, 3.0));
    t.add(format_args!("NamedMaterial \"tiles\""));
    let roof =
        [(-4.4, 4.4, -3.5), (4.4, 4.4, -3.5), (4.4, 4.4, 3.5), (-4.4, 4.4, 3.5), (-4.4, 7.4, 0.0), (4.4, 7.4, 0.0)];
    let indices = vec![0, 4, 1, 1, 4, 5, 2, 5, 3, 3, 5, 4, 0, 3, 4, 1, 5, 2];
    t.mesh(&Mesh { positions: roof.map(Vec3::from).to_vec(), indices, ..Mesh::default() });
}

impl House {
    /// A place some way before one of its walls, or now and then beside the street: closer by, light of a point is without bounds.
    fn on_wall(&self, dice: &mut Dice) -> Vec3 {
        let (s, up) = (dice.between(-1.0, 1.0), dice.between(1.0, 3.8));
        let p = match dice.below(9) {
            0 => Vec3::new(9.0 * s, 3.0, -7.5),
            1..=4 => Vec3::new(4.4 * s, up, -4.4),
            5..=6 => Vec3::new(5.3, up, 3.3 * s),
            _ => Vec3::new(-5.3, up, 3.3 * s),
        };
        self.at + self.size * (Quat::from_rotation_y(self.turn) * p)
    }
}

/// The lie of the land.
struct Hills(FastNoiseLite);

impl Hills {
    fn new() -> Self {
        let mut noise = FastNoiseLite::with_seed(19);
        noise.set_noise_type(Some(NoiseType::OpenSimplex2));
        noise.set_fractal_type(Some(FractalType::FBm));
        noise.set_fractal_octaves(Some(4));
        noise.set_frequency(Some(0.0028));
        Self(noise)
    }

    fn height(&self, x: f32, z: f32) -> f32 {
        let back = z - DEEP[0];
        let rise = 4.0 + 0.25 * back * (1.0 - 0.25 * back / (DEEP[1] - DEEP[0]));
        (rise * (1.0 + 0.75 * self.0.get_noise_2d(x, z)) + 6.0 * self.0.get_noise_2d(5.0 * x, 5.0 * z)).max(0.5)
    }

    /// Half the width of what is seen at z, and then some.
    fn reach(z: f32) -> f32 {
        60.0 + 0.8 * z
    }

    fn mesh(&self) -> Mesh {
        const ROWS: u32 = 110;
        const ACROSS: u32 = 150;
        let mut mesh = Mesh::default();
        for row in 0..ROWS {
            let s = row as f32 / (ROWS - 1) as f32;
            let z = DEEP[0].lerp(DEEP[1], s * s);
            mesh.positions.extend((0..ACROSS).map(|i| {
                let x = 1.25 * Self::reach(z) * (2.0 * i as f32 / (ACROSS - 1) as f32 - 1.0);
                Vec3::new(x, self.height(x, z), z)
            }));
        }
        mesh.join_rings(ROWS, ACROSS, false);
        mesh
    }

    /// A house somewhere on the slopes, its front to the bay; denser near the water.
    fn house(&self, dice: &mut Dice) -> House {
        let z = 108.0 + 1080.0 * dice.between(0.0, 1.0).powf(1.5);
        let x = Self::reach(z) * dice.between(-1.0, 1.0) - 0.09 * z;
        // Terraces: streets follow the slope.
        let z = (z / 16.0).round() * 16.0 + 5.0 * self.0.get_noise_2d(3.0 * x, z);
        let at = Vec3::new(x, self.height(x, z), z);
        House { at, turn: dice.between(-0.3, 0.3), size: dice.between(0.75, 1.3) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hills_face_up() {
        let mesh = Hills::new().mesh();
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
