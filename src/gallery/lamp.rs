//! The scene `lamp`: a globe of opal glass on a desk in a dark room, and no other light. Metres; the desk's top is at y = 0.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::text::{Dice, Number, Point, SceneText, View};
use super::{GalleryError, wood};

/// Where the lamp stands.
const LAMP: Vec3 = Vec3::new(-0.34, 0.0, 0.16);
/// The room, from the desk's middle.
const ROOM: [Vec3; 2] = [Vec3::new(-1.7, -0.75, -2.2), Vec3::new(1.7, 1.75, 0.5)];

/// Writes every file of the scene.
pub fn write(folder: &Path) -> Result<(), GalleryError> {
    wood::write_texture(&folder.join("planks.png"))?;
    text().write(&folder.join("lamp.pbrt"))
}

fn text() -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(0.3, 0.42, -1.35), Vec3::new(-0.04, 0.16, 0.1));
    let view = View { eye, target, fov: 38.0, iso: 260.0, samples: 64, bounces: 6 };
    t.begin("lamp", "A lamp on a desk; units are metres", &view);
    materials(&mut t);
    room(&mut t);
    lamp(&mut t);
    things(&mut t);
    t
}

fn materials(t: &mut SceneText) {
    t.add(format_args!("Texture \"boards\" \"spectrum\" \"imagemap\" \"string filename\" \"planks.png\""));
    t.add(format_args!("Texture \"oak\" \"spectrum\" \"scale\" \"texture tex\" \"boards\" \"float scale\" 2.2"));
    t.add(format_args!(
        "MakeNamedMaterial \"oak\" \"string type\" \"coateddiffuse\" \"texture reflectance\" \"oak\" \"float roughness\" 0.25"
    ));
    t.add(format_args!(
        "MakeNamedMaterial \"brass\" \"string type\" \"conductor\" \"spectrum eta\" \"metal-CuZn-eta\" \"spectrum k\" \"metal-CuZn-k\" \"float roughness\" 0.12"
    ));
    t.add(format_args!(
        "MakeNamedMaterial \"glaze\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [0.08 0.2 0.3] \"float roughness\" 0.05"
    ));
    t.diffuse(&[
        ("wall", [0.5, 0.52, 0.46]),
        ("page", [0.8, 0.77, 0.7]),
        ("red", [0.42, 0.07, 0.05]),
        ("green", [0.1, 0.22, 0.13]),
        ("blue", [0.08, 0.12, 0.3]),
        ("ochre", [0.5, 0.32, 0.08]),
        ("dark", [0.05, 0.045, 0.04]),
        ("leaf", [0.09, 0.25, 0.06]),
        ("clay", [0.5, 0.22, 0.12]),
    ]);
}

fn room(t: &mut SceneText) {
    t.add(format_args!("\n# The room and the desk"));
    let [low, high] = ROOM;
    t.of("wall", |t| {
        const THICK: f32 = 0.1;
        for axis in 0..3 {
            for (level, outwards) in [(low, -THICK), (high, THICK)] {
                let (mut a, mut b) = (low - THICK, high + THICK);
                (a[axis], b[axis]) = (level[axis].min(level[axis] + outwards), level[axis].max(level[axis] + outwards));
                t.cuboid(a, b);
            }
        }
    });
    t.of("oak", |t| {
        for i in 0..4 {
            let z = -0.36 + 0.2 * i as f32;
            let board = Some([0.0, 0.125 * i as f32 + 0.01, 1.0, 0.125 * i as f32 + 0.115]);
            t.mesh(&Mesh::cuboid(Vec3::new(-0.85, -0.035, z), Vec3::new(0.85, 0.0, z + 0.1985), board));
        }
        t.cuboid(Vec3::new(-0.85, -0.75, -0.3), Vec3::new(-0.8, -0.035, 0.42));
        t.cuboid(Vec3::new(0.8, -0.75, -0.3), Vec3::new(0.85, -0.035, 0.42));
    });
    t.add(format_args!("\n# A picture"));
    t.of("dark", |t| t.cuboid(Vec3::new(0.02, 0.42, 0.47), Vec3::new(0.6, 0.84, 0.5)));
    t.of("page", |t| t.cuboid(Vec3::new(0.05, 0.45, 0.465), Vec3::new(0.57, 0.81, 0.47)));
    for (name, low, high) in [
        ("blue", Vec3::new(0.12, 0.52, 0.462), Vec3::new(0.5, 0.6, 0.465)),
        ("ochre", Vec3::new(0.12, 0.6, 0.462), Vec3::new(0.5, 0.74, 0.465)),
        ("red", Vec3::new(0.36, 0.63, 0.46), Vec3::new(0.42, 0.69, 0.462)),
    ] {
        t.of(name, |t| t.cuboid(low, high));
    }
}

fn lamp(t: &mut SceneText) {
    t.add(format_args!("\n# The lamp"));
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(LAMP)));
        t.of("brass", |t| {
            let foot = [(0.001, 0.0), (0.085, 0.0), (0.09, 0.008), (0.085, 0.016), (0.03, 0.028), (0.012, 0.05)];
            let stem = [
                (0.009, 0.12),
                (0.016, 0.15),
                (0.009, 0.18),
                (0.008, 0.3),
                (0.012, 0.31),
                (0.045, 0.34),
                (0.001, 0.345),
            ];
            let profile: Vec<Vec2> = foot.iter().chain(&stem).map(|&(r, y)| Vec2::new(r, y)).collect();
            t.mesh(&Mesh::revolved(&profile, 48));
        });
        t.add(format_args!("AreaLightSource \"diffuse\" \"blackbody L\" [2700] \"float scale\" 9"));
        t.add(format_args!("Translate 0 0.415 0 Shape \"sphere\" \"float radius\" 0.085"));
    });
}

/// Books, a notebook with a pencil, a cup, a plant.
fn things(t: &mut SceneText) {
    t.add(format_args!("\n# Things on the desk"));
    let mut dice = Dice::new(17);
    let mut height = 0.0;
    for (name, thick) in [("blue", 0.035), ("red", 0.028), ("ochre", 0.022)] {
        let (turn, thick) = (Number(dice.between(-16.0, 16.0)), thick);
        let at = Point(Vec3::new(0.42 + dice.between(-0.02, 0.02), height, 0.2));
        t.block(|t| {
            t.add(format_args!("Translate {at} Rotate {turn} 0 1 0"));
            t.of(name, |t| {
                t.cuboid(Vec3::new(-0.15, 0.0, -0.105), Vec3::new(0.15, 0.003, 0.105));
                t.cuboid(Vec3::new(-0.15, thick - 0.003, -0.105), Vec3::new(0.15, thick, 0.105));
                t.cuboid(Vec3::new(-0.15, 0.0, 0.1), Vec3::new(0.15, thick, 0.105));
            });
            t.of("page", |t| t.cuboid(Vec3::new(-0.144, 0.003, -0.1), Vec3::new(0.144, thick - 0.003, 0.1)));
        });
        height += thick;
    }
    let upright = [
        ("green", 0.05, 0.25),
        ("dark", 0.035, 0.22),
        ("red", 0.042, 0.24),
        ("ochre", 0.03, 0.2),
        ("blue", 0.05, 0.26),
    ];
    let mut x = -0.8;
    for (name, thick, tall) in upright {
        t.of(name, |t| t.cuboid(Vec3::new(x, 0.0, 0.24), Vec3::new(x + thick - 0.002, tall, 0.4)));
        x += thick;
    }
    t.block(|t| {
        t.add(format_args!("Translate 0.02 0 -0.1 Rotate 12 0 1 0"));
        t.of("page", |t| {
            for side in [-1.0, 1.0] {
                let (inner, outer) = (Vec3::new(0.003 * side, 0.0, -0.1), Vec3::new(0.15 * side, 0.008, 0.1));
                t.cuboid(inner.min(outer), inner.max(outer));
            }
        });
        t.of("red", |t| {
            t.add(format_args!("Translate 0.07 0.013 -0.03 Rotate 35 0 1 0 Rotate 90 1 0 0"));
            t.mesh(&Mesh::revolved(
                &[(0.0005, -0.085), (0.004, -0.07), (0.004, 0.085), (0.0005, 0.085)].map(|(r, y)| Vec2::new(r, y)),
                6,
            ));
        });
    });
    t.of("glaze", |t| {
        t.add(format_args!("Translate 0.24 0 0.02"));
        let cup =
            [(0.001, 0.0), (0.03, 0.0), (0.038, 0.02), (0.041, 0.085), (0.037, 0.085), (0.034, 0.02), (0.001, 0.012)];
        t.mesh(&Mesh::revolved(&cup.map(|(r, y)| Vec2::new(r, y)), 40));
    });
    t.block(|t| {
        t.add(format_args!("Translate 0.7 0 0.28"));
        t.of("clay", |t| {
            let pot = [
                (0.001, 0.0),
                (0.05, 0.0),
                (0.07, 0.11),
                (0.078, 0.11),
                (0.078, 0.13),
                (0.066, 0.13),
                (0.06, 0.1),
                (0.001, 0.1),
            ];
            t.mesh(&Mesh::revolved(&pot.map(|(r, y)| Vec2::new(r, y)), 32));
        });
        t.of("leaf", |t| {
            for i in 0..16 {
                let turn = 137.5 * i as f32 + dice.between(-15.0, 15.0);
                t.mesh(&blade(turn.to_radians(), dice.between(0.16, 0.3), dice.between(0.25, 1.0)));
            }
        });
    });
}

/// A leaf that grows from the pot's middle and bends outwards.
fn blade(turn: f32, length: f32, bend: f32) -> Mesh {
    const STEPS: u32 = 8;
    let mut mesh = Mesh::default();
    let (out, across) = (Vec3::new(turn.cos(), 0.0, turn.sin()), Vec3::new(-turn.sin(), 0.0, turn.cos()));
    for i in 0..=STEPS {
        let s = i as f32 / STEPS as f32;
        let lean = bend * s;
        let middle = Vec3::new(0.0, 0.1, 0.0) + length * s * (out * lean.sin() + Vec3::Y * lean.cos());
        let half = 0.022 * (1.0 - s).powf(0.6) * (0.4 + 2.0 * s).min(1.0);
        mesh.positions.extend([middle - half * across, middle, middle + half * across]);
    }
    mesh.join_rings(STEPS + 1, 3, false);
    mesh
}
