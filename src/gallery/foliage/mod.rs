//! The scene `foliage`: a festival at night in an orchard on a hillside, a path leading up to it between hedges. Leaves are cards
//! that a texture cuts out; small bulbs hang among them, so that what a bulb lights depends on which leaves are in between,
//! and every place is lit by the few plants around it out of hundreds. A dim sky, lanterns along the path, thin mist. Metres; y is
//! up, the path leads along z.

mod ground;
mod leaf;
mod planting;
mod tree;

use std::path::Path;

use glam::{Vec2, Vec3};

use self::ground::{Ground, HIGH, LOW, across, path_at};
use self::planting::Place;
use super::glow::Glow;
use super::mesh::Mesh;
use super::text::{Dice, Point, SceneText, View};
use super::{GalleryError, furniture};

/// Writes the scene with `lights` lights.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    leaf::write_textures(&folder.join("leaf.png"), &folder.join("leaf-mask.png"))?;
    text(lights).write(&folder.join("foliage.pbrt"))
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let ground = Ground::new();
    let (x, z) = (path_at(-9.5) + 0.3, -9.5);
    let eye = ground.at(x, z) + 1.75 * Vec3::Y;
    let target = eye + Vec3::new(0.3, -0.55, 10.0);
    let what = "A festival in an orchard on a hillside; units are metres";
    t.begin("foliage", what, &View { eye, target, fov: 40.0, iso: 260.0, samples: 96, bounces: 5 });
    t.add(format_args!("LightSource \"infinite\" \"rgb L\" [0.0012 0.0019 0.0036]"));
    t.haze([Vec3::new(LOW.x, -3.0, LOW.y), Vec3::new(HIGH.x, 50.0, HIGH.y)], 0.0004, 0.0001, 0.3, [0.0; 3]);
    materials(&mut t);
    furniture::define(&mut t);
    let mut dice = Dice::new(3110);
    let small = lights < planting::BULBS;
    let kinds = planting::kinds(&mut dice, if small { 2 } else { 3 });
    let bunches = leaf::bunches(&mut dice);
    leaf::define(&mut t, &bunches);
    for (kind, tree) in kinds.iter().enumerate() {
        tree.define(&mut t, &format!("plant{kind}"));
    }
    t.add(format_args!("\n# The ground"));
    t.of("grass", |t| t.mesh(&ground.mesh()));
    ground.path(&mut t, &mut dice);
    let (bushes, far) = if small { (20, 25.0) } else { (200, 95.0) };
    ground.tufts(&mut t, &mut dice, if small { 30 } else { 260 });
    let places = planting::places(&mut dice, &ground, lights);
    let feet: Vec<Vec2> = places.iter().map(Place::foot).collect();
    ground.bushes(&mut t, &mut dice, (bushes, far), &feet);
    walkers(&mut t, &ground);
    planting::plant(&mut t, &places);
    // One light is the sky.
    let rest = lights - 1;
    let lanterns = (lights / 400).clamp(2, 24).min(rest);
    along_the_path(&mut t, &mut dice, &ground, lanterns);
    planting::bulbs(&mut t, &mut dice, &ground, (&kinds, &bunches), &places, rest - lanterns);
    t
}

fn materials(t: &mut SceneText) {
    t.add(format_args!("\n# Materials"));
    t.add(format_args!("Texture \"leaf\" \"spectrum\" \"imagemap\" \"string filename\" \"leaf.png\""));
    t.add(format_args!(
        "Texture \"mask\" \"float\" \"imagemap\" \"string filename\" \"leaf-mask.png\" \"string encoding\" \"linear\""
    ));
    t.add(format_args!("MakeNamedMaterial \"leaf\" \"string type\" \"diffuse\" \"texture reflectance\" \"leaf\""));
    t.diffuse(&[
        ("bark", [0.17, 0.12, 0.08]),
        ("grass", [0.07, 0.1, 0.035]),
        ("gravel", [0.24, 0.22, 0.19]),
        ("stone", [0.3, 0.28, 0.25]),
        // What bulbs reflect is nothing beside what they emit.
        ("globe", [0.0; 3]),
    ]);
}

/// People on a walk: how far along the path, how far across it, and where they look.
fn walkers(t: &mut SceneText, ground: &Ground) {
    t.add(format_args!("\n# People on a walk"));
    let people = [(4.2, -0.3, 172.0), (4.5, 0.35, 186.0), (17.0, 0.2, 10.0), (31.0, -0.4, 150.0), (31.4, 0.3, 195.0)];
    for (z, off, turn) in people {
        let p = Vec3::new(path_at(z), 0.0, z) + off * across(z);
        t.instance("person", ground.at(p.x, p.z) + 0.05 * Vec3::Y, turn);
    }
}

/// Lanterns on posts at both sides.
fn along_the_path(t: &mut SceneText, dice: &mut Dice, ground: &Ground, count: u32) {
    t.add(format_args!("\n# Lanterns along the path"));
    for i in 0..count {
        let z = -3.5 + 4.6 * i as f32;
        let side = if i % 2 == 0 { -1.15 } else { 1.15 };
        let p = Vec3::new(path_at(z), 0.0, z) + side * across(z);
        let p = ground.at(p.x, p.z);
        t.of("metal", |t| {
            t.add(format_args!("Translate {}", Point(p)));
            t.mesh(&Mesh::pole(0.025, -0.2, 0.69));
            let lid = [(0.15, 1.03), (0.02, 1.12)].map(|(r, y)| Vec2::new(r, y));
            t.mesh(&Mesh::revolved(&lid, 8));
        });
        let glow = Glow::Kelvin(dice.pick(&[2000.0, 2200.0]));
        t.of("globe", |t| glow.bulb(t, p + Vec3::Y * 0.83, 0.11, 4.0));
    }
}
