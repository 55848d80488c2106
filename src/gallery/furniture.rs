//! Furniture and people as objects for instances: plain shapes that stand on y = 0 around the origin, their backs towards +z.
//! Metres.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::text::SceneText;

/// What [`define`] makes furniture of.
const MATERIALS: [(&str, [f32; 3]); 9] = [
    ("beech", [0.42, 0.28, 0.16]),
    ("walnut", [0.16, 0.09, 0.05]),
    ("linen", [0.62, 0.57, 0.48]),
    ("velvet", [0.3, 0.05, 0.07]),
    ("navy", [0.07, 0.1, 0.22]),
    ("metal", [0.1, 0.1, 0.11]),
    ("leaves", [0.1, 0.24, 0.07]),
    ("clay", [0.45, 0.2, 0.12]),
    ("coat", [0.18, 0.17, 0.18]),
];

/// The objects `table`, `desk`, `chair`, `sofa`, `bed`, `shelf`, `plant`, `person` and `sitter`, and their materials.
pub fn define(t: &mut SceneText) {
    t.add(format_args!("\n# Furniture"));
    t.diffuse(&MATERIALS);
    t.object("table", |t| {
        t.add(format_args!("NamedMaterial \"walnut\""));
        board(t, [0.0, 0.74, 0.0], [1.5, 0.04, 0.85]);
        legs(t, 0.66, 0.34, 0.72, 0.05);
    });
    t.object("desk", |t| {
        t.add(format_args!("NamedMaterial \"beech\""));
        board(t, [0.0, 0.73, 0.0], [1.4, 0.035, 0.7]);
        t.add(format_args!("NamedMaterial \"metal\""));
        legs(t, 0.65, 0.3, 0.71, 0.04);
        // A screen's foot; the screen is a light, or off.
        board(t, [0.0, 0.79, 0.2], [0.06, 0.1, 0.05]);
        board(t, [0.0, 1.03, 0.215], [0.62, 0.38, 0.02]);
    });
    t.object("chair", |t| {
        t.add(format_args!("NamedMaterial \"walnut\""));
        board(t, [0.0, 0.45, 0.0], [0.44, 0.05, 0.44]);
        board(t, [0.0, 0.8, 0.2], [0.42, 0.36, 0.03]);
        legs(t, 0.18, 0.18, 0.43, 0.04);
        board(t, [-0.19, 0.6, 0.2], [0.03, 0.5, 0.03]);
        board(t, [0.19, 0.6, 0.2], [0.03, 0.5, 0.03]);
    });
    t.object("sofa", |t| {
        t.add(format_args!("NamedMaterial \"velvet\""));
        board(t, [0.0, 0.25, 0.0], [1.9, 0.38, 0.85]);
        board(t, [0.0, 0.55, 0.36], [1.9, 0.65, 0.18]);
        board(t, [-0.92, 0.4, 0.0], [0.16, 0.5, 0.85]);
        board(t, [0.92, 0.4, 0.0], [0.16, 0.5, 0.85]);
        t.add(format_args!("NamedMaterial \"linen\""));
        for x in [-0.43, 0.43] {
            board(t, [x, 0.48, -0.06], [0.82, 0.1, 0.66]);
        }
    });
    t.object("bed", |t| {
        t.add(format_args!("NamedMaterial \"walnut\""));
        board(t, [0.0, 0.22, 0.0], [1.5, 0.2, 2.0]);
        board(t, [0.0, 0.55, 1.0], [1.5, 0.9, 0.06]);
        t.add(format_args!("NamedMaterial \"linen\""));
        board(t, [0.0, 0.42, 0.0], [1.44, 0.2, 1.94]);
        for x in [-0.35, 0.35] {
            board(t, [x, 0.57, 0.72], [0.55, 0.12, 0.36]);
        }
        t.add(format_args!("NamedMaterial \"navy\""));
        board(t, [0.0, 0.46, -0.3], [1.52, 0.17, 1.36]);
    });
    t.object("shelf", shelf);
    t.object("plant", |t| {
        t.add(format_args!("NamedMaterial \"clay\""));
        turned(t, &[(0.01, 0.0), (0.16, 0.0), (0.21, 0.34), (0.18, 0.34), (0.01, 0.3)], 14);
        t.add(format_args!("NamedMaterial \"leaves\""));
        for i in 0..26 {
            let turn = 2.4 * i as f32;
            let (lean, length) = (0.2 + 0.045 * i as f32, 0.9 - 0.012 * i as f32);
            let out = Vec3::new(turn.cos() * lean.sin(), lean.cos(), turn.sin() * lean.sin());
            let across = 0.05 * Vec3::new(-turn.sin(), 0.0, turn.cos());
            let foot = Vec3::new(0.0, 0.32, 0.0);
            let mid = foot + 0.55 * length * out;
            let tip = foot + length * out - Vec3::new(0.0, 0.22 * lean, 0.0);
            let positions = vec![foot, mid - across, mid + across, tip];
            t.mesh(&Mesh { positions, indices: vec![0, 1, 2, 2, 1, 3], ..Mesh::default() });
        }
    });
    t.object("person", |t| person(t, 0.0));
    t.object("sitter", |t| person(t, 0.42));
}

/// A box of this size around `middle`.
fn board(t: &mut SceneText, middle: [f32; 3], size: [f32; 3]) {
    let (middle, half) = (Vec3::from(middle), 0.5 * Vec3::from(size));
    t.cuboid(middle - half, middle + half);
}

/// Four legs.
fn legs(t: &mut SceneText, x: f32, z: f32, tall: f32, thick: f32) {
    for (x, z) in [(-x, -z), (x, -z), (-x, z), (x, z)] {
        board(t, [x, 0.5 * tall, z], [thick, tall, thick]);
    }
}

fn turned(t: &mut SceneText, profile: &[(f32, f32)], sides: u32) {
    let profile: Vec<Vec2> = profile.iter().map(|&(r, y)| Vec2::new(r, y)).collect();
    t.mesh(&Mesh::revolved(&profile, sides));
}

/// Full of books.
fn shelf(t: &mut SceneText) {
    t.add(format_args!("NamedMaterial \"beech\""));
    board(t, [0.0, 1.0, 0.14], [1.2, 2.0, 0.02]);
    for x in [-0.6, 0.6] {
        board(t, [x, 1.0, 0.0], [0.03, 2.0, 0.3]);
    }
    for i in 0..6 {
        board(t, [0.0, 0.02 + 0.39 * i as f32, 0.0], [1.2, 0.03, 0.3]);
    }
    let colours = ["velvet", "navy", "linen", "walnut", "clay", "leaves"];
    for row in 0..5usize {
        let mut x = -0.57;
        for book in 0..(7 + row * 5 % 4) {
            let number = row * 11 + book * 7;
            let (wide, tall) = (0.04 + 0.012 * (number % 5) as f32, 0.22 + 0.025 * (number % 4) as f32);
            t.add(format_args!("NamedMaterial \"{}\"", colours[(row + book) % colours.len()]));
            board(t, [x + 0.5 * wide, 0.035 + 0.39 * row as f32 + 0.5 * tall, -0.01], [wide - 0.004, tall, 0.2]);
            x += wide;
        }
    }
}

/// A standing figure, or one that sits: `sunk` lower, its thighs forward (−z).
fn person(t: &mut SceneText, sunk: f32) {
    let at = |r: f32, y: f32| (r, y - sunk);
    t.add(format_args!("NamedMaterial \"coat\""));
    turned(t, &[at(0.01, 0.86), at(0.17, 0.88), at(0.16, 1.1), at(0.21, 1.38), at(0.12, 1.48), at(0.06, 1.54)], 12);
    for x in [-0.1, 0.1] {
        if sunk > 0.0 {
            board(t, [x, 0.5, -0.2], [0.14, 0.14, 0.5]);
            board(t, [x, 0.22, -0.42], [0.11, 0.46, 0.12]);
        } else {
            board(t, [x, 0.44, 0.0], [0.14, 0.88, 0.17]);
        }
        board(t, [2.35 * x, 1.1 - sunk, if sunk > 0.0 { -0.1 } else { 0.0 }], [0.09, 0.56, 0.12]);
    }
    t.add(format_args!("NamedMaterial \"clay\""));
    turned(t, &[at(0.01, 1.5), at(0.07, 1.54), at(0.105, 1.63), at(0.1, 1.7), at(0.06, 1.77), at(0.01, 1.79)], 12);
}
