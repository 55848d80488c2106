//! Stalls at both sides of the pier and the people between them: they stand in the way of most lights.

use glam::Vec3;

use super::super::mesh::Mesh;
use super::super::text::{Dice, SceneText};
use super::{DECK, EDGES};

/// Adds stalls and people, fewer where there are few lights; returns the lines that bulbs hang from over the stalls.
pub fn write(t: &mut SceneText, dice: &mut Dice, more: u32) -> Vec<(Vec3, Vec3, f32)> {
    t.add(format_args!("\n# Stalls and people"));
    t.diffuse(&[
        ("canvas-red", [0.5, 0.1, 0.07]),
        ("canvas-white", [0.6, 0.56, 0.48]),
        ("canvas-blue", [0.1, 0.2, 0.38]),
    ]);
    for canvas in ["red", "white", "blue"] {
        t.object(&format!("stall-{canvas}"), |t| stall(t, canvas));
    }
    let mut lines = vec![];
    let count = (more / 40).clamp(2, 15);
    for i in 0..count {
        // Of the left side only the far part, or they would hide the bay.
        let left = i % 3 == 2;
        let z = if left { 14.0 + 1.55 * i as f32 } else { 1.4 + 2.35 * i as f32 };
        let (x, degrees) = if left { (EDGES[0] - 1.0, -90.0) } else { (EDGES[1] + 1.0, 90.0) };
        let canvas = ["red", "white", "blue"][dice.below(3)];
        t.instance(&format!("stall-{canvas}"), Vec3::new(x, DECK, z), degrees);
        // 90° turns the stall's front, −z, to −x. Before the front, under the ridge, and before the wall at the back, clear of canvas.
        let front = if left { 1.0 } else { -1.0 };
        for (x, y) in [(x + 1.3 * front, 2.25), (x, 2.25), (x - 0.5 * front, 1.95)] {
            lines.push((Vec3::new(x, DECK + y, z - 0.85), Vec3::new(x, DECK + y, z + 0.85), 0.12));
        }
    }
    for _ in 0..(more / 12).clamp(6, 110) {
        let z = 1.5 + 36.0 * dice.between(0.0, 1.0);
        let p = Vec3::new(dice.between(EDGES[0] + 0.25, EDGES[1] - 0.25), DECK, z);
        t.instance("person", p, dice.between(0.0, 360.0));
    }
    lines
}

/// A stall around the origin on the deck's level, its counter towards −z, standing on posts in the water.
fn stall(t: &mut SceneText, canvas: &str) {
    t.add(format_args!("NamedMaterial \"timber\""));
    t.cuboid(Vec3::new(-1.0, -0.1, -0.95), Vec3::new(1.0, -0.01, 0.95));
    t.cuboid(Vec3::new(-0.9, 0.0, -0.75), Vec3::new(0.9, 0.9, -0.7));
    t.cuboid(Vec3::new(-0.95, 0.9, -0.9), Vec3::new(0.95, 0.95, -0.4));
    t.cuboid(Vec3::new(-0.9, 0.0, 0.85), Vec3::new(0.9, 2.1, 0.9));
    for x in [-0.92, 0.92] {
        for (z, top) in [(-0.88, 1.95), (0.88, 2.3)] {
            t.cuboid(Vec3::new(x - 0.04, -2.5, z - 0.04), Vec3::new(x + 0.04, top, z + 0.04));
        }
    }
    t.add(format_args!("NamedMaterial \"canvas-{canvas}\""));
    // Roof and valance; goods on the counter below.
    let (low, high) = (2.05, 2.55);
    let positions = [
        (-1.05, low, -1.0),
        (1.05, low, -1.0),
        (1.05, high, 0.0),
        (-1.05, high, 0.0),
        (1.05, low + 0.15, 0.95),
        (-1.05, low + 0.15, 0.95),
    ];
    let indices = vec![0, 2, 1, 0, 3, 2, 3, 4, 2, 3, 5, 4];
    t.mesh(&Mesh { positions: positions.map(Vec3::from).to_vec(), indices, ..Mesh::default() });
    t.cuboid(Vec3::new(-1.05, low - 0.2, -1.01), Vec3::new(1.05, low, -1.0));
    for (i, goods) in ["canvas-blue", "canvas-white", "clay", "canvas-red", "leaves"].into_iter().enumerate() {
        t.add(format_args!("NamedMaterial \"{goods}\""));
        let x = -0.72 + 0.36 * i as f32;
        t.cuboid(Vec3::new(x - 0.13, 0.95, -0.78), Vec3::new(x + 0.13, 1.05 + 0.05 * (i % 3) as f32, -0.5));
    }
    t.add(format_args!("NamedMaterial \"coat\" Translate 0 0 0.2 ObjectInstance \"person\""));
}
