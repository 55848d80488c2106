//! The scene `fire`: a tall fire in a temple's hall at night. Its gas is so thin that hardly any light is lost in it, and glows all the
//! more; polished tiles mirror it. Metres; y is up.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::GalleryError;
use super::flames::Fire;
use super::masonry::{self, laid, pillar};
use super::mesh::Mesh;
use super::own_volume::{GridMedium, OwnVolume};
use super::text::{Dice, Point, SceneText, View};
use super::volume;

/// The middle of the basin's rim.
const FIRE: Vec3 = Vec3::new(0.7, 0.62, 6.2);
/// The region of the flames, from there.
const FIRE_BOX: [Vec3; 2] = [Vec3::new(-1.2, -0.3, -1.2), Vec3::new(1.4, 2.7, 1.2)];
/// The hall.
const HALL: [Vec3; 2] = [Vec3::new(-7.0, 0.0, -4.0), Vec3::new(7.0, 6.0, 12.0)];
/// A tile's edge.
const TILE: f32 = 1.0;

/// Writes every file of the scene, with the volume `own` in place of the one written here.
pub fn write(folder: &Path, own: Option<&OwnVolume>) -> Result<(), GalleryError> {
    if own.is_none() {
        let fire = Fire::new(41);
        let place = FIRE_BOX.map(|p| p + FIRE);
        volume::write(&folder.join("fire.vdb"), place, 0.025, Fire::GRIDS, |p| fire.fanned(p - FIRE))?;
    }
    masonry::write_texture(&folder.join("stone.png"))?;
    text(own).write(&folder.join("fire.pbrt"))
}

fn text(own: Option<&OwnVolume>) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-1.4, 1.35, -1.2), Vec3::new(0.1, 1.25, 6.0));
    let view = View { eye, target, fov: 39.0, iso: 100.0, samples: 128, bounces: 5 };
    t.begin("fire", "A fire in a hall with a polished floor; units are metres", &view);
    t.add(format_args!("\n# The fire: little extinction, much glow"));
    let medium = GridMedium {
        name: "fire",
        file: "fire.vdb",
        region: FIRE_BOX.map(|p| p + FIRE),
        hottest: Some(Fire::HOTTEST),
        parameters: "\"float temperaturereference\" 2100 \"float Le\" 3000 \"float sigma_a\" 0.02 \"float sigma_s\" 0.002",
        outside: "",
    };
    medium.add(&mut t, own);
    t.add(format_args!("\n# Materials"));
    masonry::material(&mut t, 0.8);
    for (name, reflectance, roughness) in
        [("basalt", "0.14 0.14 0.15", 0.09), ("granite", "0.32 0.29 0.27", 0.14), ("bronze", "0.6 0.4 0.22", 0.16)]
    {
        t.add(format_args!(
            "MakeNamedMaterial \"{name}\" \"string type\" \"conductor\" \"rgb reflectance\" [{reflectance}] \"float roughness\" {roughness} \"bool remaproughness\" false"
        ));
    }
    for (name, reflectance) in [("glaze", "0.05 0.16 0.2"), ("marble", "0.62 0.58 0.52"), ("red", "0.35 0.05 0.03")] {
        t.add(format_args!(
            "MakeNamedMaterial \"{name}\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [{reflectance}] \"float roughness\" 0.08"
        ));
    }
    t.diffuse(&[("wood", [0.1, 0.06, 0.035])]);
    hall(&mut t);
    basin(&mut t);
    things(&mut t);
    t
}

/// The floor's tiles, walls, ceiling and columns.
fn hall(t: &mut SceneText) {
    t.add(format_args!("\n# The hall"));
    let [low, high] = HALL;
    let mut dice = Dice::new(88);
    let mut tiles = [Mesh::default(), Mesh::default()];
    let count = ((high - low) / TILE).as_uvec3();
    for i in 0..count.x {
        for k in 0..count.z {
            let corner = low + TILE * Vec3::new(i as f32, 0.0, k as f32);
            // Laid by hand.
            let top = dice.between(-0.002, 0.0);
            let tile = Mesh::cuboid(corner - 0.05 * Vec3::Y, corner + Vec3::new(TILE - 0.012, top, TILE - 0.012), None);
            masonry::join(&mut tiles[(i + k) as usize % 2], tile);
        }
    }
    for (name, tiles) in ["basalt", "granite"].into_iter().zip(&tiles) {
        t.of(name, |t| t.mesh(tiles));
    }
    t.of("stone", |t| {
        for (a, b) in [
            (Vec3::new(low.x - 0.5, -0.4, low.z - 0.5), Vec3::new(high.x + 0.5, -0.02, high.z + 0.5)),
            (Vec3::new(low.x - 0.5, high.y, low.z - 0.5), Vec3::new(high.x + 0.5, high.y + 0.5, high.z + 0.5)),
            (Vec3::new(low.x - 0.5, 0.0, low.z), Vec3::new(low.x, high.y, high.z)),
            (Vec3::new(high.x, 0.0, low.z), Vec3::new(high.x + 0.5, high.y, high.z)),
            (Vec3::new(low.x - 0.5, 0.0, high.z), Vec3::new(high.x + 0.5, high.y, high.z + 0.5)),
            (Vec3::new(low.x - 0.5, 0.0, low.z - 0.5), Vec3::new(high.x + 0.5, high.y, low.z)),
        ] {
            t.mesh(&laid(&Mesh::cuboid(a, b, None)));
        }
    });
    t.object("column", |t| t.of("stone", |t| t.mesh(&laid(&pillar(0.36, high.y)))));
    for z in [-1.0, 2.5, 6.0, 9.5] {
        for x in [-4.2, 4.2] {
            t.instance("column", Vec3::new(x, 0.0, z), 0.0);
        }
    }
    for x in [-1.4, 1.4] {
        t.instance("column", Vec3::new(x, 0.0, 10.6), 0.0);
    }
}

/// A bronze basin on steps, with logs.
fn basin(t: &mut SceneText) {
    t.add(format_args!("\n# The basin"));
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(FIRE)));
        let turned = |t: &mut SceneText, name: &str, profile: &[(f32, f32)], sides: u32| {
            let profile: Vec<Vec2> = profile.iter().map(|&(r, y)| Vec2::new(r, y)).collect();
            t.of(name, |t| t.mesh(&Mesh::revolved(&profile, sides)));
        };
        turned(t, "marble", &[(1.25, -0.62), (1.25, -0.47), (1.0, -0.47), (1.0, -0.32), (0.01, -0.32)], 8);
        turned(
            t,
            "bronze",
            &[
                (0.3, -0.32),
                (0.24, -0.26),
                (0.5, -0.2),
                (0.72, -0.03),
                (0.76, 0.0),
                (0.72, 0.0),
                (0.5, -0.14),
                (0.01, -0.18),
            ],
            48,
        );
        t.of("wood", |t| {
            for (turn, lean) in [(20.0, 66.0), (95.0, 74.0), (170.0, 62.0), (250.0, 70.0), (320.0, 60.0)] {
                t.block(|t| {
                    t.add(format_args!("Translate 0 -0.05 0 Rotate {turn} 0 1 0 Rotate {lean} 0 0 1"));
                    t.mesh(&Mesh::pole(0.07, -0.4, 0.5));
                });
            }
        });
    });
}

/// Jars, bronze balls on plinths, a bench.
fn things(t: &mut SceneText) {
    t.add(format_args!("\n# Jars and balls"));
    let jar: Vec<Vec2> = [
        (0.01, 0.0),
        (0.16, 0.0),
        (0.2, 0.06),
        (0.36, 0.35),
        (0.4, 0.55),
        (0.34, 0.78),
        (0.17, 0.95),
        (0.13, 1.02),
        (0.15, 1.12),
        (0.2, 1.16),
        (0.17, 1.16),
        (0.11, 1.05),
        (0.01, 0.6),
    ]
    .map(|(r, y)| Vec2::new(r, y))
    .to_vec();
    t.object("jar", |t| t.mesh(&Mesh::revolved(&jar, 48)));
    for (name, p, size) in [
        ("glaze", Vec3::new(-2.5, 0.0, 5.0), 1.0),
        ("red", Vec3::new(-1.75, 0.0, 5.6), 0.75),
        ("marble", Vec3::new(-2.9, 0.0, 6.3), 1.25),
        ("glaze", Vec3::new(2.9, 0.0, 8.3), 1.2),
    ] {
        t.of(name, |t| {
            t.add(format_args!("Translate {} Scale {size} {size} {size}", Point(p)));
            t.mesh(&Mesh::revolved(&jar, 48));
        });
    }
    for (x, z, radius) in [(2.65, 3.9, 0.36), (-0.75, 3.7, 0.17), (1.35, 3.2, 0.11)] {
        t.of("bronze", |t| {
            t.add(format_args!(
                "Translate {} Shape \"sphere\" \"float radius\" {radius}",
                Point(Vec3::new(x, radius, z))
            ));
        });
    }
    t.of("marble", |t| {
        t.cuboid(Vec3::new(-5.6, 0.0, 7.4), Vec3::new(-5.0, 0.45, 9.6));
        t.cuboid(Vec3::new(-5.7, 0.45, 7.3), Vec3::new(-4.9, 0.55, 9.7));
    });
}
