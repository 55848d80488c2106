//! The house itself: materials, walls with door openings, doors that stand ajar, floors and ceilings.

use glam::Vec3;

use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};
use super::{HALL, HEIGHT, LONG, Plan, SALON, STOREY, THICK, WIDE};

/// A door's opening.
const DOOR: [f32; 2] = [0.92, 2.08];
/// Where the outer walls are.
const OUTSIDE: f32 = HALL + 2.0 * (THICK + WIDE);
/// Papers of the rooms.
const PAPERS: [&str; 4] = ["paper-green", "paper-red", "paper-blue", "paper-straw"];

/// Materials of walls, floors and doors.
pub fn materials(t: &mut SceneText) {
    t.add(format_args!("\n# Materials"));
    t.add(format_args!("Texture \"boards\" \"spectrum\" \"imagemap\" \"string filename\" \"planks.png\""));
    t.add(format_args!("Texture \"floor\" \"spectrum\" \"scale\" \"texture tex\" \"boards\" \"float scale\" 1.9"));
    t.add(format_args!(
        "MakeNamedMaterial \"floor\" \"string type\" \"coateddiffuse\" \"texture reflectance\" \"floor\" \"float roughness\" 0.3"
    ));
    t.diffuse(&[
        ("plaster", [0.68, 0.65, 0.58]),
        ("trim", [0.6, 0.56, 0.48]),
        ("door", [0.5, 0.46, 0.39]),
        ("runner", [0.28, 0.06, 0.06]),
        ("fringe", [0.5, 0.36, 0.14]),
        ("paper-green", [0.28, 0.38, 0.26]),
        ("paper-red", [0.45, 0.2, 0.16]),
        ("paper-blue", [0.24, 0.32, 0.42]),
        ("paper-straw", [0.6, 0.5, 0.32]),
    ]);
    t.add(format_args!(
        "MakeNamedMaterial \"brass\" \"string type\" \"conductor\" \"spectrum eta\" \"metal-CuZn-eta\" \"spectrum k\" \"metal-CuZn-k\" \"float roughness\" 0.2"
    ));
}

/// The door: its hinge along the y axis, the leaf along +x, four panels on either side.
pub fn define(t: &mut SceneText) {
    let [wide, tall] = DOOR;
    t.object("leaf", |t| {
        t.add(format_args!("NamedMaterial \"door\""));
        t.cuboid(Vec3::new(0.01, 0.01, -0.016), Vec3::new(wide - 0.01, tall - 0.01, 0.016));
        // Stiles and rails stand out.
        let strips = [
            ([0.01, 0.01], [0.12, tall - 0.01]),
            ([wide - 0.12, 0.01], [wide - 0.01, tall - 0.01]),
            ([0.5 * wide - 0.05, 0.01], [0.5 * wide + 0.05, tall - 0.01]),
            ([0.01, 0.01], [wide - 0.01, 0.2]),
            ([0.01, 0.85], [wide - 0.01, 0.98]),
            ([0.01, tall - 0.13], [wide - 0.01, tall - 0.01]),
        ];
        for ([x0, y0], [x1, y1]) in strips {
            t.cuboid(Vec3::new(x0, y0, -0.024), Vec3::new(x1, y1, 0.024));
        }
        t.add(format_args!("NamedMaterial \"brass\""));
        for z in [-0.06, 0.06] {
            t.add(format_args!(
                "AttributeBegin Translate {} 1 {z} Shape \"sphere\" \"float radius\" 0.028 AttributeEnd",
                wide - 0.07
            ));
        }
    });
}

/// Floor, ceiling, walls and doors of one storey.
pub fn storey(t: &mut SceneText, dice: &mut Dice, plan: &Plan, floor: f32) {
    let end = plan.end();
    let back = end + SALON;
    t.block(|t| {
        t.add(format_args!("Translate 0 {} 0", Number(floor)));
        floors(t, end, back);
        let salon = HALL + THICK + WIDE;
        t.of("plaster", |t| {
            // Ends of the house, the outer walls, and the salon's sides.
            t.cuboid(Vec3::new(-OUTSIDE - 0.2, 0.0, -0.2), Vec3::new(OUTSIDE + 0.2, STOREY, 0.5 * THICK));
            t.cuboid(Vec3::new(-OUTSIDE - 0.2, 0.0, back - 0.5 * THICK), Vec3::new(OUTSIDE + 0.2, STOREY, back + 0.2));
            for side in [-1.0, 1.0] {
                slab(t, side * OUTSIDE, side * (OUTSIDE + 0.2), -0.2, back);
                slab(t, side * salon, side * (salon + THICK), end, back);
            }
        });
        for side in [-1.0, 1.0] {
            for (row, near) in [HALL, HALL + THICK + WIDE].into_iter().enumerate() {
                let paper = dice.pick(&PAPERS);
                for bay in 0..plan.bays {
                    let z = bay as f32 * LONG;
                    // Doors of the hall do not face each other; those behind stand elsewhere.
                    let shift = if side > 0.0 { 1.0 } else { 2.4 } + if row == 1 { 0.6 } else { 0.0 };
                    let hinge = z + shift + dice.between(-0.2, 0.2);
                    wall_with_door(t, dice, side, near, [z, z + LONG], hinge);
                    // Between one bay and the next; in the last one it ends the row.
                    let (a, b) = (side * (near + THICK), side * (near + THICK + WIDE));
                    t.of(paper, |t| slab(t, a, b, z + LONG - 0.5 * THICK, z + LONG + 0.5 * THICK));
                }
            }
        }
        double_door(t, end);
    });
}

/// Boards, a runner, ceilings with beams.
fn floors(t: &mut SceneText, end: f32, back: f32) {
    t.of("floor", |t| {
        const BOARD: f32 = 0.36;
        let count = (2.0 * OUTSIDE / BOARD).ceil() as u32;
        let mut mesh = Mesh::default();
        for i in 0..count {
            let x = -OUTSIDE + BOARD * i as f32;
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(
                [(0.0, 0.0), (BOARD - 0.004, 0.0), (BOARD - 0.004, back), (0.0, back)]
                    .map(|(s, z)| Vec3::new(x + s, 0.0, z)),
            );
            let (v0, shift) = ((i * 5 % 8) as f32 / 8.0, 0.37 * i as f32);
            let length = back / 4.0;
            mesh.uv.extend([
                [shift, v0 + 0.01],
                [shift, v0 + 0.115],
                [shift + length, v0 + 0.115],
                [shift + length, v0 + 0.01],
            ]);
            mesh.indices.extend([0, 2, 1, 0, 3, 2].map(|corner| first + corner));
        }
        t.mesh(&mesh);
    });
    t.of("plaster", |t| {
        t.cuboid(Vec3::new(-OUTSIDE, -0.1, -0.2), Vec3::new(OUTSIDE, -0.004, back));
        t.cuboid(Vec3::new(-OUTSIDE - 0.2, HEIGHT, -0.2), Vec3::new(OUTSIDE + 0.2, STOREY - 0.1, back));
    });
    t.of("runner", |t| t.cuboid(Vec3::new(-0.55, 0.0, 0.3), Vec3::new(0.55, 0.012, end - 0.4)));
    t.of("fringe", |t| {
        for x in [-0.5, 0.46] {
            t.cuboid(Vec3::new(x, 0.0, 0.3), Vec3::new(x + 0.04, 0.014, end - 0.4));
        }
    });
    t.of("trim", |t| {
        // A skirting and a picture rail along the hall would bridge doors: the rail alone, above them.
        for side in [-1.0, 1.0] {
            let (a, b) = (side * (HALL - 0.025), side * HALL);
            t.cuboid(Vec3::new(a.min(b), 2.3, 0.0), Vec3::new(a.max(b), 2.36, end));
            t.cuboid(Vec3::new(a.min(b), HEIGHT - 0.09, 0.0), Vec3::new(a.max(b), HEIGHT, end));
        }
    });
}

/// A wall as high as the storey between two values of x, in either order.
fn slab(t: &mut SceneText, a: f32, b: f32, from: f32, to: f32) {
    t.cuboid(Vec3::new(a.min(b), 0.0, from), Vec3::new(a.max(b), STOREY - 0.1, to));
}

/// A wall along z whose inner face lies at x = `side` · `near`, with a door at z = `hinge` that opens away from the hall.
fn wall_with_door(t: &mut SceneText, dice: &mut Dice, side: f32, near: f32, [from, to]: [f32; 2], hinge: f32) {
    let [wide, tall] = DOOR;
    let (a, b) = (side * near, side * (near + THICK));
    let (low, high) = (a.min(b), a.max(b));
    t.of("plaster", |t| {
        slab(t, a, b, from, hinge);
        slab(t, a, b, hinge + wide, to);
        t.cuboid(Vec3::new(low, tall, hinge), Vec3::new(high, STOREY - 0.1, hinge + wide));
    });
    t.of("trim", |t| {
        // The frame, and skirtings on both faces.
        let (low, high) = (low - 0.02, high + 0.02);
        t.cuboid(Vec3::new(low, 0.0, hinge - 0.09), Vec3::new(high, tall + 0.09, hinge));
        t.cuboid(Vec3::new(low, 0.0, hinge + wide), Vec3::new(high, tall + 0.09, hinge + wide + 0.09));
        t.cuboid(Vec3::new(low, tall, hinge - 0.09), Vec3::new(high, tall + 0.09, hinge + wide + 0.09));
        t.cuboid(Vec3::new(low, 0.0, from), Vec3::new(high, 0.12, hinge));
        t.cuboid(Vec3::new(low, 0.0, hinge + wide), Vec3::new(high, 0.12, to));
    });
    let ajar = if dice.happens(0.35) { dice.between(50.0, 80.0) } else { dice.between(14.0, 40.0) };
    leaf(t, Vec3::new(b, 0.0, hinge), side * ajar - 90.0);
}

fn leaf(t: &mut SceneText, hinge: Vec3, degrees: f32) {
    t.block(|t| {
        t.add(format_args!("Translate {} Rotate {} 0 1 0 ObjectInstance \"leaf\"", Point(hinge), Number(degrees)));
    });
}

/// The wall at the end of the hall, with both leaves of its door half open into the salon.
fn double_door(t: &mut SceneText, end: f32) {
    let [wide, tall] = DOOR;
    let (from, to) = (end - 0.5 * THICK, end + 0.5 * THICK);
    t.of("plaster", |t| {
        slab(t, -HALL - THICK, -wide, from, to);
        slab(t, wide, HALL + THICK, from, to);
        t.cuboid(Vec3::new(-wide, tall, from), Vec3::new(wide, STOREY - 0.1, to));
    });
    t.of("trim", |t| {
        for x in [-wide - 0.1, wide] {
            t.cuboid(Vec3::new(x, 0.0, from - 0.02), Vec3::new(x + 0.1, tall + 0.1, to + 0.02));
        }
        t.cuboid(Vec3::new(-wide - 0.1, tall, from - 0.02), Vec3::new(wide + 0.1, tall + 0.1, to + 0.02));
    });
    leaf(t, Vec3::new(-wide, 0.0, to), -62.0);
    leaf(t, Vec3::new(wide, 0.0, to), 180.0 + 48.0);
}
