//! The fairground on the far shore: a big wheel, a roundabout, tents, and the people before them.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::super::glow::Glow;
use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};

/// The wheel's hub and radius.
const HUB: Vec3 = Vec3::new(-40.0, 16.0, 75.0);
const WHEEL: f32 = 13.5;
/// Gondolas, and twice as many spokes.
const GONDOLAS: u32 = 18;
/// The ground's level.
const GROUND: f32 = 1.2;
/// Roofs: where, how wide and high up to eaves and top.
const ROOFS: [(Vec3, f32, [f32; 2]); 4] = [
    (Vec3::new(-4.0, GROUND, 76.0), 5.5, [3.6, 6.6]),
    (Vec3::new(-19.0, GROUND, 76.5), 4.5, [3.0, 7.5]),
    (Vec3::new(-61.0, GROUND, 77.0), 5.0, [3.0, 8.5]),
    (Vec3::new(9.0, GROUND, 77.0), 6.0, [3.2, 9.5]),
];
/// Ribs of a roof.
const RIBS: u32 = 12;

/// Adds the fairground with `count` bulbs.
pub fn write(t: &mut SceneText, dice: &mut Dice, count: u32) {
    t.add(format_args!("\n# The fairground"));
    t.of("rock", |t| t.cuboid(Vec3::new(-74.0, -1.5, 70.5), Vec3::new(24.0, GROUND, 84.0)));
    wheel(t);
    for (place, radius, [eaves, top]) in ROOFS {
        t.of(dice.pick(&["canvas-red", "canvas-white", "canvas-blue"]), |t| {
            t.add(format_args!("Translate {}", Point(place)));
            let roof = [(radius, eaves - 0.5), (radius, eaves), (0.05, top)].map(|(r, y)| Vec2::new(r, y));
            t.mesh(&Mesh::revolved(&roof, RIBS));
            t.mesh(&Mesh::pole(0.15, 0.0, top + 1.2));
            for rib in 0..RIBS {
                let angle = TAU * rib as f32 / RIBS as f32;
                t.block(|t| {
                    t.add(format_args!(
                        "Translate {}",
                        Point(0.96 * radius * Vec3::new(angle.cos(), 0.0, angle.sin()))
                    ));
                    t.mesh(&Mesh::pole(0.07, 0.0, eaves));
                });
            }
        });
    }
    for _ in 0..(count / 12).clamp(4, 320) {
        let p = Vec3::new(dice.between(-62.0, 18.0), GROUND, dice.between(70.8, 74.0));
        t.instance("person", p, dice.between(0.0, 360.0));
    }
    bulbs(t, dice, count);
}

/// A point of the wheel.
fn on_wheel(radius: f32, turn: f32, z: f32) -> Vec3 {
    let angle = TAU * turn;
    HUB + Vec3::new(radius * angle.sin(), radius * angle.cos(), z)
}

fn wheel(t: &mut SceneText) {
    t.of("iron", |t| {
        t.add(format_args!("Translate {}", Point(HUB)));
        for z in [-0.8f32, 0.8] {
            t.block(|t| {
                let z = Number(z);
                t.add(format_args!("Translate 0 0 {z} Rotate 90 1 0 0"));
                for r in [WHEEL, 0.72 * WHEEL] {
                    let ring = [(r - 0.12, 0.0), (r, 0.12), (r + 0.12, 0.0), (r, -0.12), (r - 0.12, 0.0)];
                    t.mesh(&Mesh::revolved(&ring.map(|(r, y)| Vec2::new(r, y)), 72));
                }
            });
            for spoke in 0..2 * GONDOLAS {
                let degrees = Number(360.0 * spoke as f32 / (2 * GONDOLAS) as f32);
                t.block(|t| {
                    t.add(format_args!("Rotate {degrees} 0 0 1"));
                    t.cuboid(Vec3::new(-0.05, 0.3, z - 0.05), Vec3::new(0.05, WHEEL, z + 0.05));
                });
            }
        }
        // Legs.
        for degrees in [-158.0, 158.0] {
            t.block(|t| {
                t.add(format_args!("Rotate {degrees} 0 0 1"));
                for z in [-1.6, 1.3] {
                    t.cuboid(Vec3::new(-0.25, 0.0, z), Vec3::new(0.25, 17.0, z + 0.3));
                }
            });
        }
    });
    for gondola in 0..GONDOLAS {
        let p = on_wheel(WHEEL, gondola as f32 / GONDOLAS as f32, 0.0);
        t.of(["canvas-red", "canvas-white", "canvas-blue"][gondola as usize % 3], |t| {
            t.cuboid(p + Vec3::new(-0.7, -1.9, -0.6), p + Vec3::new(0.7, -1.1, 0.6));
            t.cuboid(p + Vec3::new(-0.75, -0.35, -0.65), p + Vec3::new(0.75, -0.2, 0.65));
        });
    }
}

/// Half of the bulbs are the wheel's, on rims and spokes; the others run along the roofs' ribs and eaves.
fn bulbs(t: &mut SceneText, dice: &mut Dice, count: u32) {
    let glows = [
        Glow::Kelvin(2400.0),
        Glow::Kelvin(3200.0),
        Glow::Paper([1.6, 0.2, 0.12]),
        Glow::Paper([0.25, 0.7, 1.3]),
        Glow::Paper([1.4, 0.4, 1.0]),
    ];
    let mut places = [(); 5].map(|()| vec![]);
    let of_wheel = count / 2;
    for i in 0..of_wheel {
        let z = if i % 2 == 0 { -1.3 } else { 1.3 };
        let step = i / 2;
        if step % 5 < 2 {
            let radius = if step % 5 == 0 { WHEEL } else { 0.72 * WHEEL };
            places[(step % 5) as usize].push(on_wheel(radius, step as f32 / (of_wheel as f32 * 0.5), z));
        } else {
            let spoke = dice.below(2 * GONDOLAS as usize);
            let radius = WHEEL * dice.between(0.06, 0.98);
            places[2 + spoke % 3].push(on_wheel(radius, spoke as f32 / (2 * GONDOLAS) as f32, z));
        }
    }
    for i in of_wheel..count {
        let which = i as usize % ROOFS.len();
        let (place, radius, [eaves, top]) = ROOFS[which];
        let (s, angle) = (dice.between(0.0, 1.0), TAU * dice.below(RIBS as usize) as f32 / RIBS as f32);
        let p = if i % 3 == 0 {
            let angle = TAU * s;
            Vec3::new((radius + 0.4) * angle.cos(), eaves - 0.3, (radius + 0.4) * angle.sin())
        } else {
            let r = radius * (1.0 - s);
            Vec3::new(r * angle.cos(), eaves + (top - eaves) * s + 0.45, r * angle.sin())
        };
        places[(which + 1) % 5].push(place + p);
    }
    for (glow, places) in glows.into_iter().zip(places) {
        glow.bulbs(t, &places, 0.13, 2.0);
    }
}
