//! The scene `beams`: searchlights over a harbour at night. Spots of 1° cross in a thin haze that fills a box 1000 units
//! wide; nothing else shines. Units may be taken as metres; y is up and the water lies at y = 0.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::GalleryError;
use super::mesh::Mesh;
use super::text::{Dice, Number, Point, SceneText, View};

/// The haze: from here …
const LOW: Vec3 = Vec3::new(-500.0, -4.0, -500.0);
/// … to here.
const HIGH: Vec3 = Vec3::new(500.0, 420.0, 500.0);
/// Where the land behind the harbour begins.
const QUAY: f32 = 60.0;
/// Its height.
const LAND: f32 = 5.0;
/// Where the ship lies.
const SHIP: Vec3 = Vec3::new(70.0, 0.0, -120.0);
/// Where most beams meet.
const MEETINGS: [Vec3; 4] = [
    Vec3::new(-120.0, 190.0, 40.0),
    Vec3::new(10.0, 250.0, 130.0),
    Vec3::new(140.0, 170.0, 20.0),
    Vec3::new(-20.0, 130.0, -20.0),
];

/// Writes the scene with `lights` searchlights.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    text(lights).write(&folder.join("beams.pbrt"))
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-30.0, 16.0, -430.0), Vec3::new(-8.0, 88.0, 100.0));
    let view = View { eye, target, fov: 44.0, iso: 650.0, samples: 128, bounces: 1 };
    t.begin("beams", "Searchlights over a harbour; units are metres", &view);
    // What the haze itself glows is the shine of a far city: it shows what stands before it.
    t.haze([LOW, HIGH], 0.0017, 0.0001, 0.45, [0.03, 0.04, 0.07]);
    t.add(format_args!("\n# Materials"));
    t.add(format_args!(
        "MakeNamedMaterial \"water\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [0.01 0.014 0.016] \"float roughness\" 0.12 \"bool remaproughness\" false"
    ));
    t.diffuse(&[
        ("land", [0.2, 0.19, 0.17]),
        ("brick", [0.3, 0.16, 0.11]),
        ("stone", [0.4, 0.37, 0.32]),
        ("steel", [0.12, 0.13, 0.15]),
        ("white", [0.6, 0.6, 0.58]),
        ("rust", [0.25, 0.07, 0.04]),
    ]);
    ground(&mut t);
    let mut dice = Dice::new(99);
    let roofs = town(&mut t, &mut dice);
    harbour(&mut t);
    searchlights(&mut t, &roofs, lights);
    t
}

fn ground(t: &mut SceneText) {
    t.add(format_args!("\n# Water and land"));
    t.of("water", |t| t.cuboid(LOW, Vec3::new(HIGH.x, 0.0, HIGH.z)));
    t.of("land", |t| {
        t.cuboid(Vec3::new(LOW.x, -1.0, QUAY), Vec3::new(HIGH.x, LAND, HIGH.z));
        t.cuboid(Vec3::new(-290.0, -1.0, -170.0), Vec3::new(-262.0, 3.5, QUAY));
        t.cuboid(Vec3::new(235.0, -1.0, -60.0), Vec3::new(262.0, 4.0, QUAY));
    });
}

/// Rows of houses behind the quay; returns the middles of the flat roofs.
fn town(t: &mut SceneText, dice: &mut Dice) -> Vec<Vec3> {
    t.add(format_args!("\n# The town"));
    let mut roofs = vec![];
    for row in 0..6 {
        let z = QUAY + 18.0 + 46.0 * row as f32;
        let mut x = LOW.x + dice.between(0.0, 20.0);
        while x < HIGH.x - 40.0 {
            let (wide, deep) = (dice.between(14.0, 34.0), dice.between(14.0, 26.0));
            let centre = 1.0 - ((x + 0.5 * wide) / 330.0).abs().min(1.0);
            let tall = dice.between(9.0, 17.0) + 7.0 * row as f32 * centre * dice.between(0.3, 1.3);
            let (low, high) = (Vec3::new(x, 0.0, z), Vec3::new(x + wide, LAND + tall, z + deep));
            t.of(dice.pick(&["brick", "stone", "land"]), |t| {
                t.cuboid(low, high);
                if dice.happens(0.45) {
                    t.mesh(&gable(low.with_y(high.y), high, 0.35 * deep));
                } else {
                    roofs.push(Vec3::new(x + 0.5 * wide, high.y, z + 0.5 * deep));
                    // A chimney or a lift's head.
                    let p = Vec3::new(x + 0.2 * wide, high.y, z + 0.3 * deep);
                    t.cuboid(p, p + Vec3::new(3.0, dice.between(2.0, 4.5), 3.0));
                }
            });
            x += wide + dice.pick(&[0.5, 0.5, 5.0, 11.0]);
        }
    }
    t.add(format_args!("\n# A bell tower, and the dome beside it"));
    t.of("stone", |t| {
        t.cuboid(Vec3::new(-64.0, 0.0, 96.0), Vec3::new(-50.0, 92.0, 110.0));
        t.cuboid(Vec3::new(-66.0, 70.0, 94.0), Vec3::new(-48.0, 73.0, 112.0));
        t.block(|t| {
            t.add(format_args!("Translate -57 92 103 Rotate 45 0 1 0"));
            t.mesh(&Mesh::revolved(&[Vec2::new(10.5, 0.0), Vec2::new(7.0, 6.0), Vec2::new(0.1, 34.0)], 4));
        });
        t.add(format_args!("Translate 18 0 150"));
        let dome: Vec<Vec2> = [(24.0, 0.0), (24.0, 44.0)]
            .into_iter()
            .chain((0..=12).map(|i| {
                let angle = std::f32::consts::FRAC_PI_2 * i as f32 / 12.0;
                (22.0 * angle.cos() + 0.1, 46.0 + 24.0 * angle.sin())
            }))
            .chain([(2.5, 70.0), (2.5, 80.0), (0.1, 88.0)])
            .map(|(r, y)| Vec2::new(r, y))
            .collect();
        t.mesh(&Mesh::revolved(&dome, 40));
    });
    roofs
}

/// A roof between two corners of its foot.
fn gable(low: Vec3, high: Vec3, rise: f32) -> Mesh {
    let (z, top) = (0.5 * (low.z + high.z), high.y + rise);
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    Mesh {
        positions: vec![
            p(low.x, low.y, low.z),
            p(high.x, low.y, low.z),
            p(high.x, low.y, high.z),
            p(low.x, low.y, high.z),
            p(low.x, top, z),
            p(high.x, top, z),
        ],
        indices: vec![0, 4, 1, 1, 4, 5, 2, 5, 3, 3, 5, 4, 0, 3, 4, 1, 5, 2],
        ..Mesh::default()
    }
}

/// Cranes, a ship and a lighthouse on its mole.
fn harbour(t: &mut SceneText) {
    t.add(format_args!("\n# Cranes"));
    t.object("crane", |t| {
        t.add(format_args!("NamedMaterial \"steel\""));
        for x in [-7.0, 7.0] {
            for z in [-6.0, 6.0] {
                t.cuboid(Vec3::new(x - 0.8, 0.0, z - 0.8), Vec3::new(x + 0.8, 34.0, z + 0.8));
            }
            t.cuboid(Vec3::new(x - 0.6, 16.0, -6.0), Vec3::new(x + 0.6, 17.5, 6.0));
        }
        t.cuboid(Vec3::new(-8.0, 33.0, -8.0), Vec3::new(8.0, 36.0, 26.0));
        t.cuboid(Vec3::new(-4.0, 36.0, 6.0), Vec3::new(4.0, 42.0, 20.0));
        t.cuboid(Vec3::new(-1.2, 36.0, -1.2), Vec3::new(1.2, 56.0, 1.2));
        t.block(|t| {
            t.add(format_args!("Translate 0 36 0 Rotate 24 1 0 0"));
            t.cuboid(Vec3::new(-1.2, 0.0, -62.0), Vec3::new(1.2, 2.2, 0.0));
        });
        t.rope(Vec3::new(0.0, 56.0, 0.0), Vec3::new(0.0, 61.5, -55.0), 0.0, 0.5);
        t.rope(Vec3::new(0.0, 60.0, -54.0), Vec3::new(0.0, 22.0, -54.0), 0.0, 0.4);
        t.cuboid(Vec3::new(-3.0, 18.0, -57.0), Vec3::new(3.0, 22.0, -51.0));
    });
    for (x, z, turn) in
        [(-276.0, -90.0, 8.0), (-275.0, 10.0, -12.0), (150.0, 74.0, 30.0), (248.0, -20.0, 20.0), (205.0, 76.0, -6.0)]
    {
        t.instance("crane", Vec3::new(x, 3.5, z), turn);
    }
    t.add(format_args!("\n# A ship"));
    t.block(|t| {
        t.add(format_args!("Translate {} Rotate -68 0 1 0", Point(SHIP)));
        t.of("rust", |t| {
            t.add(format_args!("Translate 0 11 0"));
            t.mesh(&Mesh::hull(130.0, 19.0, 13.0));
        });
        t.of("steel", |t| t.cuboid(Vec3::new(-7.5, 9.5, -52.0), Vec3::new(7.5, 10.5, 46.0)));
        t.of("white", |t| {
            t.cuboid(Vec3::new(-7.0, 10.0, -50.0), Vec3::new(7.0, 22.0, -32.0));
            t.cuboid(Vec3::new(-8.5, 22.0, -46.0), Vec3::new(8.5, 26.0, -34.0));
            t.mesh(&Mesh::pole(0.6, 10.0, 40.0));
        });
        for (i, z) in [-22.0, -8.0, 8.0, 22.0].into_iter().enumerate() {
            t.of(["brick", "land", "stone", "brick"][i], |t| {
                t.cuboid(Vec3::new(-6.5, 10.5, z - 6.0), Vec3::new(6.5, 16.0 + 2.6 * (i % 3) as f32, z + 6.0));
            });
        }
        t.of("rust", |t| {
            t.add(format_args!("Translate 0 0 -44"));
            t.mesh(&Mesh::pole(3.0, 22.0, 33.0));
        });
    });
    t.add(format_args!("\n# The lighthouse and its mole"));
    t.of("land", |t| t.cuboid(Vec3::new(-190.0, -2.0, -300.0), Vec3::new(-100.0, 2.6, -288.0)));
    t.of("white", |t| {
        t.add(format_args!("Translate -106 2 -294"));
        let tower =
            [(4.2, 0.0), (2.8, 27.0), (4.0, 27.5), (4.0, 28.5), (2.0, 28.5), (2.0, 32.0), (2.6, 32.0), (0.1, 35.0)];
        t.mesh(&Mesh::revolved(&tower.map(|(r, y)| Vec2::new(r, y)), 24));
    });
}

/// Searchlights on roofs, moles and quays. Most point to where beams meet in the sky; each fifth lights ship or tower.
fn searchlights(t: &mut SceneText, roofs: &[Vec3], lights: u32) {
    t.add(format_args!("\n# Searchlights: 1° from the axis to the edge of the beam"));
    t.object("housing", |t| {
        t.add(format_args!("NamedMaterial \"steel\""));
        // Along y, with its lamp at the bottom and a hole for the beam at the top. Haze close to a lamp that is a point would be bright without
        // bound; none is to be seen there.
        let drum = [(0.1, -0.5), (0.9, -0.5), (1.15, 5.2), (1.15, 6.0), (0.16, 6.0)];
        t.mesh(&Mesh::revolved(&drum.map(|(r, y)| Vec2::new(r, y)), 20));
    });
    // Dice of their own: with more lights, the first ones stay as they are.
    let mut dice = Dice::new(1001);
    for i in 0..lights {
        let place = match i % 4 {
            0 if i % 8 == 0 => dice.pick(roofs) + Vec3::Y,
            // Behind the town, so that it stands before the beam.
            0 => Vec3::new(dice.between(-260.0, 260.0), LAND, dice.between(360.0, 440.0)),
            1 => Vec3::new(dice.between(-420.0, 420.0), LAND, QUAY + dice.between(4.0, 14.0)),
            2 => Vec3::new(-276.0 + dice.between(-9.0, 9.0), 3.5, dice.between(-165.0, 50.0)),
            _ => Vec3::new(248.0 + dice.between(-10.0, 10.0), 4.0, dice.between(-55.0, 50.0)),
        } + 2.5 * Vec3::Y;
        let target = if i % 5 == 4 {
            dice.pick(&[
                SHIP + Vec3::new(0.0, 14.0, 0.0),
                SHIP + Vec3::new(-30.0, 14.0, -8.0),
                Vec3::new(-57.0, 84.0, 103.0),
                Vec3::new(18.0, 62.0, 150.0),
            ])
        } else {
            dice.pick(&MEETINGS) + dice.within(Vec3::splat(-34.0), Vec3::splat(34.0))
        };
        let kelvin = dice.pick(&[4800.0, 5600.0, 6500.0, 7500.0]);
        let strength = Number(dice.between(1.2e7, 2.4e7));
        let axis = (target - place).normalize();
        let turn = Vec3::Y.cross(axis).normalize_or(Vec3::X);
        let lean = Number(Vec3::Y.angle_between(axis).to_degrees());
        t.block(|t| {
            t.add(format_args!("Translate {} Rotate {lean} {}", Point(place), Point(turn)));
            t.add(format_args!("ObjectInstance \"housing\""));
            t.add(format_args!(
                "LightSource \"spot\" \"point3 to\" [0 1 0] \"blackbody I\" [{kelvin}] \"float scale\" {strength}"
            ));
            t.add(format_args!("  \"float coneangle\" 1 \"float conedeltaangle\" 0.25"));
        });
    }
}
