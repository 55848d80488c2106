//! What is in the rooms: furniture, and the lights, exactly as many as a room is to have: lamps first, then candles, and
//! strings of small bulbs along the walls for all the rest. All are frosted globes that hang clear of walls and furniture: a small
//! bright bulb, or one close to a wall, would make the noise of the few paths that meet it, not that of choosing lights.

use glam::Vec3;

use super::super::glow::{CANDLES, Glow};
use super::super::mesh::Mesh;
use super::super::text::{Dice, Point, SceneText};
use super::Room;

/// Puts furniture into a room.
pub fn furnish(t: &mut SceneText, dice: &mut Dice, room: Room) {
    let mut put = |object: &str, across: f32, along: f32, degrees: f32| {
        t.instance(object, at(room, across, 0.0, along), degrees);
    };
    // 90° turns a back towards +x.
    let outwards = 90.0 * room.side;
    match dice.pick(&[0, 1, 2, 3]) {
        0 => {
            put("bed", 0.72, 0.62, outwards);
            put("chair", 0.4, 0.88, 20.0);
        }
        1 => {
            put("table", 0.55, 0.6, 90.0);
            for (across, turn) in [(0.38, -outwards), (0.72, outwards)] {
                put("chair", across, 0.52, turn);
                put("chair", across, 0.68, turn);
            }
            put("sitter", 0.72, 0.52, outwards);
        }
        2 => {
            put("sofa", 0.85, 0.6, outwards);
            put("table", 0.5, 0.6, 90.0);
            put("person", 0.35, 0.4, dice.between(0.0, 360.0));
        }
        _ => {
            put("desk", 0.8, 0.55, outwards);
            put("chair", 0.6, 0.55, -outwards);
        }
    }
    put("shelf", 0.5, 0.955, 0.0);
    put("plant", 0.92, 0.08, dice.between(0.0, 360.0));
}

/// The salon: sofas, a long table, people.
pub fn furnish_salon(t: &mut SceneText, dice: &mut Dice, room: Room) {
    for (object, x, z, degrees) in [
        ("table", -0.75, 3.4, 0.0),
        ("table", 0.75, 3.4, 0.0),
        ("sofa", -3.4, 4.6, -35.0),
        ("sofa", 3.4, 4.4, 40.0),
        ("shelf", 2.2, 6.5, 0.0),
        ("shelf", -2.2, 6.5, 0.0),
        ("plant", 0.0, 6.4, 0.0),
        ("person", 0.35, 2.2, 190.0),
        ("person", -0.6, 4.6, 20.0),
    ] {
        t.instance(object, Vec3::new(x, room.low.y, room.low.z + z), degrees);
    }
    for x in [-1.1, -0.4, 0.4, 1.1] {
        t.instance("chair", Vec3::new(x, room.low.y, room.low.z + 2.75), 180.0 + dice.between(-12.0, 12.0));
        t.instance("chair", Vec3::new(x, room.low.y, room.low.z + 4.05), dice.between(-12.0, 12.0));
    }
}

/// A place in a room: across from the hall's side, up in metres, along the hall; fractions of the room.
fn at(room: Room, across: f32, up: f32, along: f32) -> Vec3 {
    let across = if room.side > 0.0 { across } else { 1.0 - across };
    let size = room.high - room.low;
    Vec3::new(room.low.x + across * size.x, room.low.y + up, room.low.z + along * size.z)
}

/// `count` lights. However many there are, a room stays about as bright.
pub fn hang(t: &mut SceneText, dice: &mut Dice, room: Room, count: u32) {
    const LAMPS: u32 = 3;
    const CANDLES_AT_MOST: u32 = 8;
    let lamps = count.min(LAMPS);
    let candles = (count - lamps).min(CANDLES_AT_MOST).min((count - lamps).div_ceil(4));
    let small = count - lamps - candles;
    let area = (room.high.x - room.low.x) * (room.high.z - room.low.z) / 17.0;
    let warm = Glow::Kelvin(dice.pick(&[2200.0, 2400.0, 2700.0]));
    // A larger room has larger lamps.
    let size = area.sqrt().min(1.5);
    let places = [at(room, 0.5, 2.25, 0.5), at(room, 0.88, 1.45, 0.86), at(room, 0.86, 1.3, 0.3)];
    for (&p, radius) in places.iter().zip([0.2, 0.16, 0.13]).take(lamps as usize) {
        let radius = size * radius;
        stand(t, p, radius, room.low.y);
        warm.bulb(t, p, radius, 4.5 * area / (size * size));
    }
    for i in 0..candles {
        // In two rows, so that no two touch.
        let (across, along) = (0.4 + 0.0625 * (i % 4) as f32, 0.51 + 0.09 * (i / 4) as f32);
        let p = at(room, across + dice.between(0.0, 0.025), 0.0, along + dice.between(0.0, 0.05))
            + Vec3::new(0.0, 0.9 + dice.between(0.0, 0.1), 0.0);
        Glow::Kelvin(dice.pick(&CANDLES)).bulb(t, p, 0.045, 11.5);
    }
    strings(t, dice, room, small, area);
}

/// A lamp's rod down to the floor, or up to the ceiling from above head height.
fn stand(t: &mut SceneText, p: Vec3, radius: f32, floor: f32) {
    t.of("brass", |t| {
        if p.y - floor > 2.0 {
            t.rope(p + Vec3::Y * radius, Vec3::new(p.x, floor + super::HEIGHT, p.z), 0.0, 0.015);
            return;
        }
        t.add(format_args!("Translate {}", Point(Vec3::new(p.x, floor, p.z))));
        t.mesh(&Mesh::pole(0.015, 0.0, p.y - floor - radius));
        t.mesh(&Mesh::pole(0.14, 0.0, 0.02));
    });
}

/// Small bulbs in scallops along the four walls, in as many rounds above each other as it takes.
fn strings(t: &mut SceneText, dice: &mut Dice, room: Room, count: u32, area: f32) {
    const ROUND: u32 = 96;
    let inset = Vec3::new(0.22, 0.0, 0.22);
    let (low, high) = (room.low + inset, room.high - inset);
    let (x, z) = (high.x - low.x, high.z - low.z);
    let glow =
        dice.pick(&[Glow::Kelvin(1900.0), Glow::Kelvin(2200.0), Glow::Kelvin(2500.0), Glow::Paper([1.6, 0.7, 0.9])]);
    let rounds = count.div_ceil(ROUND).max(1);
    let mut places = Vec::with_capacity(count as usize);
    for i in 0..count {
        let (round, step) = (i % rounds, i / rounds);
        let s = (step as f32 + 0.5) / count.div_ceil(rounds) as f32;
        let along = s * 2.0 * (x + z);
        let (px, pz) = if along < x {
            (low.x + along, low.z)
        } else if along < x + z {
            (high.x, low.z + along - x)
        } else if along < 2.0 * x + z {
            (high.x - (along - x - z), high.z)
        } else {
            (low.x, high.z - (along - 2.0 * x - z))
        };
        let sag = 0.22 * (along / 1.1 * std::f32::consts::PI).sin().abs();
        // Above doors and pictures; dense rounds fill the space up to the ceiling.
        let up = 2.68 - 0.35 * (round as f32 / rounds as f32) - sag;
        places.push(Vec3::new(px, room.low.y + up + dice.between(-0.01, 0.01), pz));
    }
    // As bright together however many they are, and of one radiance as far as they have room.
    let each = area / count.max(20) as f32;
    let radius = (0.27 * each.sqrt()).clamp(0.014, 0.1);
    glow.bulbs(t, &places, radius, 0.7 * each / (radius * radius));
}
