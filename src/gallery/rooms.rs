//! The scene `rooms`: a building at night whose front is left out, as in a doll's house. Its rooms are closed on all other
//! sides and several deep, so from inside a room only that room's lamps are seen, and from the street only those of the
//! front rooms. Metres; y is up, the front lies at z = 0 and the building behind it.

use std::path::Path;

use glam::{UVec3, Vec3};

use super::glow::Glow;
use super::text::{Dice, Number, Point, SceneText, View, share};
use super::{GalleryError, furniture};

/// A room with half of each wall around it.
const ROOM: Vec3 = Vec3::new(4.4, 3.1, 4.2);
/// Walls and floors.
const THICK: f32 = 0.2;
/// Lamps in a room, about.
const LAMPS: u32 = 8;
/// Paints of the rooms.
const PAINTS: [(&str, [f32; 3]); 7] = [
    ("chalk", [0.7, 0.68, 0.63]),
    ("sand", [0.62, 0.52, 0.38]),
    ("sage", [0.4, 0.5, 0.38]),
    ("sky", [0.38, 0.5, 0.58]),
    ("rose", [0.6, 0.36, 0.33]),
    ("mustard", [0.6, 0.44, 0.14]),
    ("plum", [0.33, 0.2, 0.3]),
];

/// Writes the scene with `lights` lamps.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    text(lights).write(&folder.join("rooms.pbrt"))
}

/// Rooms across, up and deep: about twice as wide as high, and as deep as it takes.
fn size(lights: u32) -> UVec3 {
    let rooms = lights.div_ceil(LAMPS).max(2);
    let deep = ((rooms as f32 / 50.0).cbrt().round() as u32).max(1) + u32::from(rooms > 50);
    let front = rooms.div_ceil(deep);
    let up = ((front as f32 / 1.9).sqrt().round() as u32).max(1);
    UVec3::new(front.div_ceil(up), up, deep)
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let size = size(lights);
    let front = size.as_vec3() * ROOM;
    // The whole front if it is small, else a part of it from across the street.
    let far = (1.2 * front.y.max(0.5625 * front.x) + 1.0).min(27.0);
    let eye = Vec3::new(-0.42 * far, (0.35 * front.y).min(0.3 * far) + 1.0, -0.92 * far);
    let target = Vec3::new(0.0, (0.45 * front.y).min(0.38 * far), 0.0);
    t.begin(
        "rooms",
        "A building of closed rooms; units are metres",
        &View { eye, target, fov: 47.0, iso: 130.0, samples: 64, bounces: 5 },
    );
    t.add(format_args!("\n# Materials"));
    t.diffuse(&PAINTS);
    t.diffuse(&[("concrete", [0.32, 0.31, 0.3]), ("parquet", [0.3, 0.19, 0.1]), ("ceiling", [0.75, 0.74, 0.7])]);
    t.add(format_args!(
        "MakeNamedMaterial \"street\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [0.06 0.06 0.065] \"float roughness\" 0.35"
    ));
    furniture::define(&mut t);
    for (paint, _) in PAINTS {
        t.object(&format!("room-{paint}"), |t| lining(t, paint));
    }
    building(&mut t, size);
    let mut dice = Dice::new(404);
    let count = size.x * size.y * size.z;
    for index in 0..count {
        // Front rooms first, so that they have their lamps however few there are.
        let cell = UVec3::new(index % size.x, index / size.x % size.y, index / (size.x * size.y));
        room(&mut t, &mut dice, size, cell, share(lights, count, index));
    }
    t
}

/// Walls, floors and the street.
fn building(t: &mut SceneText, size: UVec3) {
    t.add(format_args!("\n# The building and the street"));
    let all = size.as_vec3() * ROOM;
    let (left, half) = (-0.5 * all.x, 0.5 * THICK);
    t.of("concrete", |t| {
        for i in 0..=size.x {
            let x = left + ROOM.x * i as f32;
            t.cuboid(Vec3::new(x - half, 0.0, 0.0), Vec3::new(x + half, all.y, all.z));
        }
        for i in 0..=size.y {
            let y = ROOM.y * i as f32;
            t.cuboid(Vec3::new(left - half, y - half, -0.25), Vec3::new(-left + half, y + half, all.z));
        }
        for i in 1..=size.z {
            let z = ROOM.z * i as f32;
            t.cuboid(Vec3::new(left - half, 0.0, z - half), Vec3::new(-left + half, all.y, z + half));
        }
        // The roof's edge and what stands on the roof.
        t.cuboid(Vec3::new(left - half, all.y, -0.25), Vec3::new(-left + half, all.y + 0.7, 0.1));
        t.cuboid(Vec3::new(0.1 * all.x, all.y, 1.0), Vec3::new(0.1 * all.x + 3.5, all.y + 2.4, 3.5));
    });
    t.of("street", |t| {
        let reach = 2.0 * all.x + 40.0;
        t.cuboid(Vec3::new(-reach, -1.0, -reach), Vec3::new(reach, -0.12, all.z + 20.0));
    });
}

/// The inner faces of a room, open to the front; around the middle of its front edge on the floor.
fn lining(t: &mut SceneText, paint: &str) {
    let (x, y, z) = (0.5 * (ROOM.x - THICK), ROOM.y - THICK, ROOM.z - THICK);
    const SKIN: f32 = 0.02;
    t.add(format_args!("NamedMaterial \"{paint}\""));
    t.cuboid(Vec3::new(-x, 0.0, 0.0), Vec3::new(-x + SKIN, y, z));
    t.cuboid(Vec3::new(x - SKIN, 0.0, 0.0), Vec3::new(x, y, z));
    t.cuboid(Vec3::new(-x, 0.0, z - SKIN), Vec3::new(x, y, z));
    t.add(format_args!("NamedMaterial \"ceiling\""));
    t.cuboid(Vec3::new(-x, y - SKIN, 0.0), Vec3::new(x, y, z));
    t.cuboid(Vec3::new(-x + SKIN, 0.0, z - 2.0 * SKIN), Vec3::new(x - SKIN, 0.1, z - SKIN));
    t.add(format_args!("NamedMaterial \"parquet\""));
    t.cuboid(Vec3::new(-x, -SKIN, 0.0), Vec3::new(x, 0.0, z));
    // A window sill in front.
    t.add(format_args!("NamedMaterial \"metal\""));
    t.cuboid(Vec3::new(-x, 0.86, 0.0), Vec3::new(x, 0.9, 0.04));
    for i in 0..=14 {
        let at = -x + 2.0 * x * i as f32 / 14.0;
        t.cuboid(Vec3::new(at - 0.01, 0.0, 0.01), Vec3::new(at + 0.01, 0.86, 0.03));
    }
}

/// Furniture and `lamps` lamps.
fn room(t: &mut SceneText, dice: &mut Dice, size: UVec3, cell: UVec3, lamps: u32) {
    let middle = 0.5 * size.x as f32;
    let corner = Vec3::new(
        (cell.x as f32 + 0.5 - middle) * ROOM.x,
        cell.y as f32 * ROOM.y + 0.5 * THICK,
        cell.z as f32 * ROOM.z,
    );
    let corner = corner + if cell.z > 0 { Vec3::new(0.0, 0.0, 0.5 * THICK) } else { Vec3::ZERO };
    let paint = dice.pick(&PAINTS).0;
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(corner)));
        t.add(format_args!("ObjectInstance \"room-{paint}\""));
        let office = dice.happens(0.45);
        if office { office_room(t, dice, lamps) } else { living_room(t, dice, lamps) }
    });
}

fn put(t: &mut SceneText, object: &str, x: f32, z: f32, degrees: f32) {
    t.instance(object, Vec3::new(x, 0.0, z), degrees);
}

/// Desks in rows under tubes of light.
fn office_room(t: &mut SceneText, dice: &mut Dice, lamps: u32) {
    let mut spots = vec![];
    for (x, z) in [(-1.15, 1.3), (1.1, 1.4), (-1.1, 3.0), (1.15, 2.9)] {
        let turn = dice.pick(&[0.0, 180.0]) + dice.between(-4.0, 4.0);
        put(t, "desk", x, z, turn);
        let seat = -0.62 * Vec3::new(turn.to_radians().sin(), 0.0, turn.to_radians().cos());
        put(t, "chair", x + seat.x, z + seat.z, turn + 180.0 + dice.between(-30.0, 30.0));
        if dice.happens(0.5) {
            put(t, "sitter", x + seat.x, z + seat.z, turn + 180.0);
        }
        spots.push((x, z, turn));
    }
    put(t, dice.pick(&["shelf", "plant", "person"]), dice.between(-0.4, 0.4), 3.7, 0.0);
    let white = Glow::Kelvin(dice.pick(&[3500.0, 4200.0, 5200.0]));
    let bright = dice.pick(&[1.3, 2.0, 2.6]);
    for lamp in 0..lamps {
        match lamp % 4 {
            0 | 2 if lamp < 8 => {
                let (x, z) = ([-1.1, 1.1][(lamp / 2 % 2) as usize], 0.7 + 1.6 * (lamp / 4) as f32);
                white.panel(t, Vec3::new(x - 0.09, 2.78, z), Vec3::X * 0.18, Vec3::Z * 1.3, 3.0 * bright);
            }
            1 if lamp < 16 => {
                let (x, z, turn) = spots[(lamp / 4) as usize];
                t.block(|t| {
                    t.add(format_args!("Translate {x} 0 {z} Rotate {} 0 1 0", Number(turn)));
                    let screen = Glow::Paper(dice.pick(&[[0.5, 0.7, 1.0], [0.8, 0.9, 1.0], [0.4, 0.8, 0.9]]));
                    screen.panel(t, Vec3::new(-0.29, 0.86, 0.2), Vec3::Y * 0.34, Vec3::X * 0.58, 1.6);
                });
            }
            _ => {
                let (x, z, _) = spots[(lamp / 4 % 4) as usize];
                let p =
                    Vec3::new(x + dice.between(-0.6, 0.6), 1.0 + dice.between(0.0, 0.25), z + dice.between(-0.2, 0.2));
                Glow::Kelvin(2900.0).bulb(t, p, 0.08, 5.5);
            }
        }
    }
}

/// A home: a table, a sofa or a bed, with warm lamps and a string of small ones.
fn living_room(t: &mut SceneText, dice: &mut Dice, lamps: u32) {
    match dice.pick(&[0, 1, 2]) {
        0 => {
            put(t, "table", 0.0, 2.0, 0.0);
            for (x, z, turn) in [(-0.4, 1.35, 180.0), (0.4, 1.4, 170.0), (-0.4, 2.65, 0.0), (0.45, 2.6, 8.0)] {
                put(t, "chair", x, z, turn);
            }
            put(t, dice.pick(&["person", "sitter"]), dice.between(-0.4, 0.4), 1.38, 180.0);
        }
        1 => {
            put(t, "sofa", dice.between(-0.3, 0.3), 3.3, 0.0);
            put(t, "table", 0.0, 1.9, 0.0);
            put(t, "person", dice.between(-1.5, 1.5), dice.between(0.7, 1.2), dice.between(0.0, 360.0));
        }
        _ => put(t, "bed", dice.between(-0.6, 0.6), 2.7, 0.0),
    }
    put(t, "shelf", 1.98, 2.4, 90.0);
    put(t, "plant", -1.75, dice.between(0.6, 3.5), dice.between(0.0, 360.0));
    let warm = Glow::Kelvin(dice.pick(&[2200.0, 2500.0, 2800.0]));
    let mut small = vec![];
    for lamp in 0..lamps {
        match lamp {
            0 => warm.bulb(t, Vec3::new(dice.between(-0.3, 0.3), 2.2, 2.0), 0.14, 9.0),
            1 => warm.bulb(t, Vec3::new(-1.6, 1.45, 3.5), 0.11, 8.0),
            2 => warm.bulb(t, Vec3::new(1.6, 1.3, 0.7), 0.1, 7.0),
            // A string along the back wall.
            _ => {
                let s = (lamp - 3) as f32 / (lamps - 3).max(2) as f32 + 0.1;
                small.push(Vec3::new(-1.9 + 3.8 * s, 2.35 - 0.25 * (3.0 * std::f32::consts::PI * s).sin().abs(), 3.75));
            }
        }
    }
    Glow::Kelvin(2000.0).bulbs(t, &small, 0.045, 12.5);
}
