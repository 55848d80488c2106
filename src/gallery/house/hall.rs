//! The hall: candles on a table, globes along the ceiling, sconces, pictures and chairs.

use glam::Vec3;

use super::super::glow::{CANDLES, Glow};
use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};
use super::{HALL, HEIGHT, LONG};

/// Candles on the table.
const CANDLES_AT_MOST: u32 = 4;
/// Lights that a bay of the hall has room for: a globe at the ceiling and two sconces of two.
const A_BAY: u32 = 5;
/// How far the sconces' globes are from the wall: the spot of light behind them must not be what paths find by chance.
const OFF_WALL: f32 = 0.3;

/// How many lights the hall has of so many in the house.
pub fn share(lights: u32, bays: u32) -> u32 {
    (lights / 8).clamp(1, CANDLES_AT_MOST + A_BAY * bays)
}

/// Furniture and `count` lights of the hall, which ends at z = `end`.
pub fn furnish(t: &mut SceneText, dice: &mut Dice, end: f32, count: u32) {
    t.add(format_args!("\n# The hall"));
    table(t, dice, end - 0.4 * end.min(9.0), count.min(CANDLES_AT_MOST));
    for i in 0..count.saturating_sub(CANDLES_AT_MOST) {
        // From the far end on.
        let middle = end - LONG * ((i / A_BAY) as f32 + 0.5);
        match i % A_BAY {
            0 => globe(t, middle),
            k => sconce(t, middle, if k <= 2 { -1.0 } else { 1.0 }, if k % 2 == 0 { 0.17 } else { -0.17 }),
        }
    }
    pictures(t, dice, end);
    let turn = Number(-90.0);
    t.block(|t| {
        t.add(format_args!(
            "Translate {} 0 {} Rotate {turn} 0 1 0 ObjectInstance \"chair\"",
            Number(0.28 - HALL),
            Number(end - 0.6 * end.min(9.0))
        ))
    });
}

/// A small table against the wall with candles on it.
fn table(t: &mut SceneText, dice: &mut Dice, z: f32, candles: u32) {
    t.of("walnut", |t| {
        t.cuboid(Vec3::new(HALL - 0.36, 0.76, z - 0.45), Vec3::new(HALL - 0.03, 0.8, z + 0.45));
        for dz in [-0.4, 0.4] {
            t.cuboid(Vec3::new(HALL - 0.34, 0.0, z + dz - 0.02), Vec3::new(HALL - 0.3, 0.76, z + dz + 0.02));
        }
    });
    for i in 0..candles {
        let p = Vec3::new(HALL - 0.22 + dice.between(-0.04, 0.04), 0.8, z - 0.27 + 0.18 * i as f32);
        let tall = dice.between(0.1, 0.2);
        t.of("linen", |t| {
            t.add(format_args!("Translate {}", Point(p)));
            t.mesh(&Mesh::pole(0.018, 0.0, tall));
        });
        Glow::Kelvin(dice.pick(&CANDLES)).bulb(t, p + Vec3::Y * (tall + 0.06), 0.05, 3.5);
    }
}

/// A globe on a rod from the ceiling.
fn globe(t: &mut SceneText, z: f32) {
    let p = Vec3::new(0.0, HEIGHT - 0.62, z);
    t.of("brass", |t| t.rope(p + Vec3::Y * 0.15, Vec3::new(0.0, HEIGHT, z), 0.0, 0.012));
    Glow::Kelvin(2700.0).bulb(t, p, 0.15, 3.2);
}

/// One of the two globes of a sconce: it stands on an arm from the wall on that `side`.
fn sconce(t: &mut SceneText, z: f32, side: f32, along: f32) {
    let wall = Vec3::new(side * HALL, 1.62, z);
    let p = Vec3::new(side * (HALL - OFF_WALL), 1.78, z + along);
    t.of("brass", |t| t.rope(wall, p - Vec3::Y * 0.07, 0.06, 0.012));
    Glow::Kelvin(2400.0).bulb(t, p, 0.07, 4.0);
}

fn pictures(t: &mut SceneText, dice: &mut Dice, end: f32) {
    t.add(format_args!("\n# Pictures and chairs along the hall"));
    let mut z = 1.6;
    while z < end - 1.0 {
        for side in [-1.0f32, 1.0] {
            let (a, b) = (side * (HALL - 0.03), side * HALL);
            let (middle, half) = (z + dice.between(-0.3, 0.3) + 0.4 * side, dice.between(0.2, 0.34));
            t.of("walnut", |t| {
                t.cuboid(
                    Vec3::new(a.min(b), 1.45 - half, middle - 0.8 * half),
                    Vec3::new(a.max(b), 1.45 + half, middle + 0.8 * half),
                )
            });
            let a = side * (HALL - 0.034);
            t.of(dice.pick(&["paper-blue", "paper-green", "paper-straw", "paper-red"]), |t| {
                let inner = half - 0.05;
                t.cuboid(
                    Vec3::new(a.min(b), 1.45 - inner, middle - 0.8 * inner),
                    Vec3::new(a.max(b), 1.45 + inner, middle + 0.8 * inner),
                );
            });
        }
        z += LONG;
    }
}
