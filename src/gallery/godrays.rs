//! The scene `godrays`: the nave of a church. The sun, low in front and to the right, shines through tall windows into thin
//! haze, past mullions and bars; all else is light that comes back from the floor, and a dim sky. Metres; y is up, the nave
//! runs along z.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::GalleryError;
use super::masonry::{self, Opening, arch, band, laid, pillar, vault};
use super::mesh::Mesh;
use super::text::{Dice, Point, SceneText, View};

/// Half the nave's width.
const HALF: f32 = 4.6;
/// Where the vault begins.
const SPRING: f32 = 8.0;
/// How far beyond the middle the centres of the vault's sides lie.
const POINTED: f32 = 1.2;
/// A bay's length along the nave.
const BAY: f32 = 4.5;
const BAYS: u32 = 6;
/// Where the nave ends.
const END: f32 = BAY * BAYS as f32;
/// Walls.
const THICK: f32 = 0.8;
/// From the world towards the sun.
const SUN: Vec3 = Vec3::new(0.6, 0.6, 0.53);
/// The windows along the nave.
const WINDOW: Opening = Opening { half: 0.95, sill: 2.3, spring: 5.6 };

/// Writes every file of the scene.
pub fn write(folder: &Path) -> Result<(), GalleryError> {
    masonry::write_texture(&folder.join("stone.png"))?;
    text().write(&folder.join("godrays.pbrt"))
}

fn text() -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-0.7, 1.9, 0.8), Vec3::new(1.6, 3.9, 14.0));
    let view = View { eye, target, fov: 47.0, iso: 320.0, samples: 128, bounces: 5 };
    t.begin("godrays", "The nave of a church; units are metres", &view);
    t.haze([Vec3::new(-HALF - 0.4, -0.1, -0.4), Vec3::new(HALF + 0.4, 14.0, END + 0.4)], 0.011, 0.0005, 0.6, [0.0; 3]);
    t.add(format_args!("\n# The sun and a dim sky"));
    t.add(format_args!(
        "LightSource \"distant\" \"point3 from\" [{}] \"point3 to\" [0 0 0] \"rgb L\" [34 29 22]",
        Point(SUN)
    ));
    t.add(format_args!("LightSource \"infinite\" \"rgb L\" [0.16 0.22 0.3]"));
    t.add(format_args!("\n# Materials"));
    masonry::material(&mut t, 0.8);
    t.diffuse(&[
        ("plaster", [0.5, 0.47, 0.41]),
        ("oak", [0.13, 0.075, 0.04]),
        ("cloth", [0.62, 0.59, 0.52]),
        ("carpet", [0.28, 0.03, 0.03]),
        ("lead", [0.06, 0.06, 0.065]),
    ]);
    t.add(format_args!(
        "MakeNamedMaterial \"brass\" \"string type\" \"conductor\" \"spectrum eta\" \"metal-CuZn-eta\" \"spectrum k\" \"metal-CuZn-k\" \"float roughness\" 0.2"
    ));
    define(&mut t);
    nave(&mut t);
    ends(&mut t);
    pews(&mut t);
    altar(&mut t);
    t
}

fn define(t: &mut SceneText) {
    t.object("window", |t| {
        t.of("stone", |t| t.mesh(&laid(&WINDOW.wall(0.5 * BAY, SPRING + 0.3, THICK))));
        t.of("lead", |t| t.mesh(&WINDOW.bars(0.16, 4, 0.55 * THICK)));
    });
    t.object("pier", |t| t.of("stone", |t| t.mesh(&laid(&pillar(0.3, SPRING)))));
    t.object("pew", |t| {
        t.add(format_args!("NamedMaterial \"oak\""));
        let (low, high) = (-1.25, 1.25);
        t.cuboid(Vec3::new(low, 0.42, -0.22), Vec3::new(high, 0.47, 0.2));
        t.block(|t| {
            t.add(format_args!("Translate 0 0.45 -0.2 Rotate -8 1 0 0"));
            t.cuboid(Vec3::new(low, 0.0, -0.04), Vec3::new(high, 0.5, 0.0));
            t.cuboid(Vec3::new(low, 0.5, -0.07), Vec3::new(high, 0.55, 0.03));
        });
        for x in [low, high] {
            t.cuboid(Vec3::new(x - 0.05, 0.0, -0.3), Vec3::new(x + 0.05, 0.7, 0.24));
            t.cuboid(Vec3::new(x - 0.06, 0.0, -0.32), Vec3::new(x + 0.06, 0.98, -0.2));
        }
    });
}

/// Floor, walls with their windows, pilasters, ribs and vault.
fn nave(t: &mut SceneText) {
    t.add(format_args!("\n# The nave"));
    t.of("stone", |t| {
        let reach = HALF + THICK;
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-reach, -0.3, -1.0), Vec3::new(reach, 0.0, END + 1.0), None)));
    });
    let wall = |t: &mut SceneText, object: &str, p: Vec3, turn: f32| t.instance(object, p, turn);
    for bay in 0..BAYS {
        let z = BAY * (bay as f32 + 0.5);
        // Turned so that its bars lie towards the outside.
        wall(t, "window", Vec3::new(HALF, 0.0, z), 90.0);
        wall(t, "window", Vec3::new(-HALF, 0.0, z), -90.0);
    }
    let profile: Vec<Vec2> = arch(HALF + 0.1, POINTED, 20).iter().map(|p| *p + Vec2::new(0.0, SPRING)).collect();
    for i in 0..=BAYS {
        let z = BAY * i as f32;
        for x in [-HALF, HALF] {
            t.instance("pier", Vec3::new(x, 0.0, z), 0.0);
        }
        t.of("stone", |t| t.mesh(&laid(&band(&profile, 0.4, z - 0.2, z + 0.2))));
    }
    t.of("plaster", |t| {
        t.mesh(&vault(&profile, -1.0, END + 1.0));
        for (y, half) in [(SPRING - 0.25, 0.12), (WINDOW.sill - 0.35, 0.1)] {
            for x in [-HALF, HALF] {
                t.cuboid(Vec3::new(x - half, y, 0.0), Vec3::new(x + half, y + 0.22, END));
            }
        }
    });
}

/// The walls at both ends: one closed, one with three windows above the altar.
fn ends(t: &mut SceneText) {
    t.add(format_args!("\n# The walls at both ends"));
    t.of("stone", |t| {
        let reach = HALF + THICK;
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-reach, -0.3, -THICK), Vec3::new(reach, 15.0, 0.0), None)));
        let height = [9.8, 11.4, 9.8];
        for (i, spring) in [7.0, 8.6, 7.0].into_iter().enumerate() {
            let window = Opening { half: 0.75, sill: 4.2, spring };
            let x = 2.5 * (i as f32 - 1.0);
            t.block(|t| {
                t.add(format_args!("Translate {}", Point(Vec3::new(x, 0.0, END))));
                t.mesh(&laid(&window.wall(1.25, height[i], THICK)));
                t.of("lead", |t| t.mesh(&window.bars(0.14, 4, 0.55 * THICK)));
            });
            t.mesh(&laid(&Mesh::cuboid(
                Vec3::new(x - 1.25, height[i], END),
                Vec3::new(x + 1.25, 15.0, END + THICK),
                None,
            )));
        }
        for x in [-reach, 3.75] {
            t.mesh(&laid(&Mesh::cuboid(Vec3::new(x, 0.0, END), Vec3::new(x + reach - 3.75, 15.0, END + THICK), None)));
        }
    });
}

fn pews(t: &mut SceneText) {
    t.add(format_args!("\n# Pews, and a carpet between them"));
    let mut dice = Dice::new(1122);
    for row in 0..11 {
        for x in [-2.25, 2.25] {
            let z = 4.6 + 1.15 * row as f32;
            t.instance("pew", Vec3::new(x, 0.0, z + dice.between(-0.03, 0.03)), 0.0);
        }
    }
    t.of("carpet", |t| t.cuboid(Vec3::new(-0.55, 0.0, 1.0), Vec3::new(0.55, 0.012, 19.5)));
}

/// Steps, the altar with a cross and candlesticks.
fn altar(t: &mut SceneText) {
    t.add(format_args!("\n# The altar"));
    t.of("stone", |t| {
        for (i, z) in [19.5, 19.9, 20.3].into_iter().enumerate() {
            let top = 0.17 * (i + 1) as f32;
            t.mesh(&laid(&Mesh::cuboid(Vec3::new(-HALF, 0.0, z), Vec3::new(HALF, top, END), None)));
        }
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-1.2, 0.5, 23.3), Vec3::new(1.2, 1.5, 24.2), None)));
    });
    t.of("cloth", |t| {
        t.cuboid(Vec3::new(-1.3, 1.5, 23.2), Vec3::new(1.3, 1.53, 24.3));
        t.cuboid(Vec3::new(-0.55, 0.8, 23.19), Vec3::new(0.55, 1.53, 23.21));
    });
    t.of("brass", |t| {
        for x in [-0.95, 0.95] {
            t.block(|t| {
                t.add(format_args!("Translate {}", Point(Vec3::new(x, 1.53, 23.9))));
                let stick = [(0.11, 0.0), (0.03, 0.06), (0.02, 0.5), (0.07, 0.52), (0.001, 0.53)];
                t.mesh(&Mesh::revolved(&stick.map(|(r, y)| Vec2::new(r, y)), 16));
            });
        }
        t.cuboid(Vec3::new(-0.04, 1.53, 23.9), Vec3::new(0.04, 2.75, 23.96));
        t.cuboid(Vec3::new(-0.32, 2.27, 23.9), Vec3::new(0.32, 2.35, 23.96));
    });
    t.of("cloth", |t| {
        for x in [-0.95, 0.95] {
            t.block(|t| {
                t.add(format_args!("Translate {}", Point(Vec3::new(x, 2.05, 23.9))));
                t.mesh(&Mesh::pole(0.025, 0.0, 0.45));
            });
        }
    });
}
