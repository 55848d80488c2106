//! The scene `house`: looking down the hall of a house at night. Two rows of rooms lie on either side, each behind a door that
//! is ajar, a salon at the end, and as much again upstairs, so that nearly every light is hidden from any place, and what
//! comes through the doors leaks from room to room. Thin mist. Metres; y is up, the hall runs along z.

mod hall;
mod lights;
mod walls;

use std::path::Path;

use glam::Vec3;

use super::text::{Dice, SceneText, View, share};
use super::{GalleryError, furniture, wood};

/// Half the width of the hall.
const HALL: f32 = 1.25;
/// From floor to ceiling.
const HEIGHT: f32 = 2.9;
/// From floor to floor.
const STOREY: f32 = 3.15;
/// Walls between rooms.
const THICK: f32 = 0.16;
/// A room's size across the hall …
const WIDE: f32 = 4.0;
/// … and along it.
const LONG: f32 = 4.6;
/// The salon's size along the hall.
const SALON: f32 = 7.0;
/// Lights in a room of the house as it is by default.
const LIGHTS_A_ROOM: f32 = 72.0;
/// The salon has as many lights as so many rooms.
const SALON_ROOMS: u32 = 3;

/// What the house has.
struct Plan {
    storeys: u32,
    /// Rooms one behind the other along each row.
    bays: u32,
}

impl Plan {
    fn new(lights: u32) -> Self {
        let storeys = if lights < 1500 { 1 } else { 2 };
        let rooms = lights as f32 / LIGHTS_A_ROOM / storeys as f32;
        let bays = ((rooms - SALON_ROOMS as f32) / 4.0).round().clamp(1.0, 10.0) as u32;
        Self { storeys, bays }
    }

    /// Where the hall ends.
    fn end(&self) -> f32 {
        self.bays as f32 * LONG
    }

    fn rooms(&self) -> u32 {
        self.storeys * (4 * self.bays + SALON_ROOMS)
    }
}

/// A space with furniture and lights.
#[derive(Clone, Copy)]
struct Room {
    low: Vec3,
    high: Vec3,
    /// 1 where the hall is towards −x, −1 where it is towards +x.
    side: f32,
}

/// Writes the scene with `lights` lights.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    wood::write_texture(&folder.join("planks.png"))?;
    text(lights).write(&folder.join("house.pbrt"))
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let plan = Plan::new(lights);
    // Not far from the end of the hall: behind the camera, too, are rooms.
    let eye = Vec3::new(-0.35, 1.55, (plan.end() - 9.2).max(0.35));
    let target = Vec3::new(0.1, 1.35, plan.end());
    let what = "The hall of a house at night; units are metres";
    t.begin("house", what, &View { eye, target, fov: 52.0, iso: 450.0, samples: 128, bounces: 6 });
    let reach = HALL + 2.0 * (WIDE + THICK) + 0.2;
    let top = plan.storeys as f32 * STOREY;
    t.haze(
        [Vec3::new(-reach, -0.1, -0.3), Vec3::new(reach, top, plan.end() + SALON + 0.3)],
        0.02,
        0.001,
        0.3,
        [0.0; 3],
    );
    walls::materials(&mut t);
    furniture::define(&mut t);
    walls::define(&mut t);
    let mut dice = Dice::new(1871);
    let in_hall = hall::share(lights, plan.bays);
    let (rooms, mut next) = (plan.rooms(), 0);
    let mut of_next = |places: u32| {
        next += places;
        (next - places..next).map(|place| share(lights - in_hall, rooms, place)).sum::<u32>()
    };
    for storey in 0..plan.storeys {
        let floor = STOREY * storey as f32;
        t.add(format_args!("\n# Storey {storey}"));
        walls::storey(&mut t, &mut dice, &plan, floor);
        for bay in 0..plan.bays {
            for (side, row) in [(-1.0, 0), (1.0, 0), (-1.0, 1), (1.0, 1)] {
                let room = room(side, row, bay, floor);
                lights::furnish(&mut t, &mut dice, room);
                lights::hang(&mut t, &mut dice, room, of_next(1));
            }
        }
        let salon = salon(&plan, floor);
        lights::furnish_salon(&mut t, &mut dice, salon);
        lights::hang(&mut t, &mut dice, salon, of_next(SALON_ROOMS));
    }
    hall::furnish(&mut t, &mut dice, plan.end(), in_hall);
    t
}

/// The room number `bay` along the hall, next to it (`row` 0) or behind that (1).
fn room(side: f32, row: u32, bay: u32, floor: f32) -> Room {
    let near = HALL + THICK + row as f32 * (WIDE + THICK);
    let (a, b) = (side * near, side * (near + WIDE));
    let z = bay as f32 * LONG;
    Room {
        low: Vec3::new(a.min(b), floor, z + 0.5 * THICK),
        high: Vec3::new(a.max(b), floor + HEIGHT, z + LONG - 0.5 * THICK),
        side,
    }
}

/// The room at the end of the hall.
fn salon(plan: &Plan, floor: f32) -> Room {
    let x = HALL + THICK + WIDE;
    let z = plan.end() + 0.5 * THICK;
    Room { low: Vec3::new(-x, floor, z), high: Vec3::new(x, floor + HEIGHT, z + SALON - THICK), side: 1.0 }
}
