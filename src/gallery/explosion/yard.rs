//! The yard: concrete, a wall with windows behind, crates, barrels and rubble.

use glam::{Vec2, Vec3};

use super::super::masonry::{self, laid};
use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};
use super::PLACE;

/// Adds it.
pub fn add(t: &mut SceneText) {
    t.add(format_args!("\n# Materials"));
    masonry::material(t, 0.7);
    t.diffuse(&[
        ("concrete", [0.22, 0.21, 0.2]),
        ("brick", [0.26, 0.13, 0.09]),
        ("crate", [0.3, 0.2, 0.11]),
        ("slat", [0.22, 0.14, 0.08]),
        ("dark", [0.02, 0.02, 0.022]),
    ]);
    for (name, reflectance) in [("red", "0.36 0.05 0.03"), ("blue", "0.05 0.11 0.22"), ("steel", "0.18 0.19 0.2")] {
        t.add(format_args!(
            "MakeNamedMaterial \"{name}\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [{reflectance}] \"float roughness\" 0.2"
        ));
    }
    ground(t);
    crates(t);
    barrels(t);
    rubble(t);
}

/// Slabs of concrete, and a factory behind.
fn ground(t: &mut SceneText) {
    t.add(format_args!("\n# Ground and factory"));
    let mut slabs = Mesh::default();
    for i in -8..8 {
        for k in -2..10 {
            let corner = Vec3::new(3.0 * i as f32, -0.2, 3.0 * k as f32);
            masonry::join(&mut slabs, Mesh::cuboid(corner, corner + Vec3::new(2.97, 0.2, 2.97), None));
        }
    }
    t.of("concrete", |t| t.mesh(&slabs));
    t.of("dark", |t| t.cuboid(Vec3::new(-90.0, -0.5, -60.0), Vec3::new(90.0, -0.03, 90.0)));
    t.of("stone", |t| {
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-24.0, 0.0, 24.0), Vec3::new(24.0, 7.0, 25.0), None)));
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-24.0, 7.0, 23.8), Vec3::new(24.0, 7.4, 25.0), None)));
    });
    for i in 0..8 {
        let x = -21.0 + 6.0 * i as f32;
        t.of("dark", |t| t.cuboid(Vec3::new(x - 1.3, 2.2, 23.95), Vec3::new(x + 1.3, 5.6, 24.0)));
        t.of("steel", |t| {
            for k in 0..4 {
                let bar = x - 1.3 + 2.6 * k as f32 / 3.0;
                t.cuboid(Vec3::new(bar - 0.05, 2.2, 23.88), Vec3::new(bar + 0.05, 5.6, 23.95));
            }
            for y in [2.2, 3.35, 4.5, 5.6] {
                t.cuboid(Vec3::new(x - 1.35, y - 0.05, 23.88), Vec3::new(x + 1.35, y + 0.05, 23.95));
            }
        });
    }
    t.of("brick", |t| {
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-14.0, 0.0, 30.0), Vec3::new(-11.6, 19.0, 32.4), None)));
        t.block(|t| {
            t.add(format_args!("Translate 13 0 32"));
            t.mesh(&Mesh::pole(1.5, 0.0, 17.0));
        });
    });
}

fn crates(t: &mut SceneText) {
    t.add(format_args!("\n# Crates"));
    t.object("crate", |t| {
        t.of("crate", |t| t.cuboid(Vec3::new(-0.5, 0.02, -0.5), Vec3::new(0.5, 0.98, 0.5)));
        t.add(format_args!("NamedMaterial \"slat\""));
        for y in [0.0, 0.88] {
            t.cuboid(Vec3::new(-0.53, y, -0.53), Vec3::new(0.53, y + 0.12, 0.53));
        }
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let p = Vec3::new(0.47 * x, 0.0, 0.47 * z);
            t.cuboid(p - Vec3::new(0.065, 0.0, 0.065), p + Vec3::new(0.065, 1.0, 0.065));
        }
    });
    for (x, y, z, turn) in [
        (-4.6, 0.0, 9.3, 12.0),
        (-5.8, 0.0, 9.6, -6.0),
        (-5.1, 1.0, 9.45, 24.0),
        (-5.9, 0.0, 11.2, 40.0),
        (4.5, 0.0, 8.6, -20.0),
        (7.2, 0.0, 13.2, 8.0),
        (7.4, 0.0, 14.6, 3.0),
        (7.2, 1.0, 13.8, -9.0),
    ] {
        t.instance("crate", Vec3::new(x, y, z), turn);
    }
}

fn barrels(t: &mut SceneText) {
    t.add(format_args!("\n# Barrels"));
    let mut profile = vec![Vec2::new(0.001, 0.0), Vec2::new(0.3, 0.0)];
    for y in [0.3, 0.6] {
        profile.extend([(0.29, y - 0.02), (0.31, y), (0.29, y + 0.02)].map(|(r, y)| Vec2::new(r, y)));
    }
    profile.extend([(0.29, 0.88), (0.305, 0.9), (0.28, 0.88), (0.001, 0.88)].map(|(r, y)| Vec2::new(r, y)));
    let barrel = Mesh::revolved(&profile, 32);
    for (name, x, z, fallen) in [
        ("red", -2.9, 8.0, None),
        ("blue", -3.4, 8.7, None),
        ("red", 2.6, 7.0, Some(35.0)),
        ("steel", 5.4, 9.8, None),
        ("red", 5.9, 10.5, None),
        ("blue", -1.1, 6.6, Some(-70.0)),
    ] {
        t.of(name, |t| {
            t.add(format_args!("Translate {}", Point(Vec3::new(x, 0.0, z))));
            if let Some(turn) = fallen {
                t.add(format_args!("Translate 0 0.31 0 Rotate {turn} 0 1 0 Rotate 90 1 0 0"));
            }
            t.mesh(&barrel);
        });
    }
}

/// Pieces of masonry, the more the nearer to the explosion.
fn rubble(t: &mut SceneText) {
    t.add(format_args!("\n# Rubble"));
    let mut dice = Dice::new(666);
    t.of("stone", |t| {
        for _ in 0..90 {
            let (angle, away) = (dice.between(0.0, std::f32::consts::TAU), dice.between(0.0, 1.0));
            let size = dice.between(0.04, 0.2);
            let p = PLACE + (2.5 + 8.0 * away) * Vec3::new(angle.cos(), 0.0, angle.sin()) + 0.5 * size * Vec3::Y;
            let half = Vec3::new(size, 0.6 * size, 0.8 * size);
            let (turn, axis) = (Number(dice.between(0.0, 360.0)), Point(dice.within(Vec3::ZERO, Vec3::ONE)));
            // None in front of the camera.
            if p.z < 4.0 {
                continue;
            }
            t.block(|t| {
                t.add(format_args!("Translate {} Rotate {turn} {axis}", Point(p)));
                t.mesh(&laid(&Mesh::cuboid(-half, half, None)));
            });
        }
    });
}
