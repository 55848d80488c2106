//! The scene `torch`: a crypt with a fire in a brazier and no other light. Thin mist that scatters forwards glows around the
//! fire, and pillars and tombs cast their shadows through it. Metres; y is up.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::GalleryError;
use super::flames::Fire;
use super::masonry::{self, arch, band, laid, pillar};
use super::mesh::Mesh;
use super::own_volume::{GridMedium, OwnVolume};
use super::text::{Dice, Number, Point, SceneText, View};
use super::volume;

/// A bay's edge.
const BAY: f32 = 4.0;
/// Bays to either side of the middle line, and along it.
const BAYS: [i32; 2] = [2, 5];
/// Where the crypt begins along z.
const NEAR: f32 = -4.0;
/// Where the vaults begin.
const SPRING: f32 = 1.75;
/// The middle of the brazier's rim.
const FIRE: Vec3 = Vec3::new(0.25, 1.2, 6.2);
/// How large the fire is, to that of [`Fire`].
const SIZE: f32 = 0.3;
/// The region of the fire and its smoke, from the brazier's rim.
const FIRE_BOX: [Vec3; 2] = [Vec3::new(-0.4, -0.1, -0.4), Vec3::new(0.6, 1.6, 0.4)];

/// Writes every file of the scene, with the volume `own` in place of the one written here.
pub fn write(folder: &Path, own: Option<&OwnVolume>) -> Result<(), GalleryError> {
    if own.is_none() {
        let fire = Fire::new(71);
        let place = FIRE_BOX.map(|p| p + FIRE);
        volume::write(&folder.join("torch.vdb"), place, 0.0125, Fire::GRIDS, |p| fire.fanned((p - FIRE) / SIZE))?;
    }
    masonry::write_texture(&folder.join("stone.png"))?;
    text(own).write(&folder.join("torch.pbrt"))
}

fn text(own: Option<&OwnVolume>) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-1.9, 1.5, 0.3), Vec3::new(-0.55, 1.5, 6.5));
    let view = View { eye, target, fov: 39.0, iso: 200.0, samples: 128, bounces: 4 };
    t.begin("torch", "A fire in a crypt; units are metres", &view);
    let (x, far) = (BAY * BAYS[0] as f32, NEAR + BAY * BAYS[1] as f32);
    t.haze([Vec3::new(-x - 0.2, -0.1, NEAR - 0.2), Vec3::new(x + 0.2, 4.2, far + 0.2)], 0.03, 0.001, 0.8, [0.0; 3]);
    fire(&mut t, own);
    t.add(format_args!("\n# Materials"));
    masonry::material(&mut t, 0.85);
    t.diffuse(&[("bone", [0.55, 0.5, 0.4]), ("wood", [0.12, 0.07, 0.04]), ("earth", [0.11, 0.09, 0.07])]);
    t.add(format_args!(
        "MakeNamedMaterial \"iron\" \"string type\" \"conductor\" \"rgb reflectance\" [0.22 0.2 0.18] \"float roughness\" 0.35"
    ));
    crypt(&mut t);
    brazier(&mut t);
    things(&mut t);
    t
}

fn fire(t: &mut SceneText, own: Option<&OwnVolume>) {
    t.add(format_args!("\n# The fire"));
    let medium = GridMedium {
        name: "fire",
        file: "torch.vdb",
        region: FIRE_BOX.map(|p| p + FIRE),
        hottest: Some(Fire::HOTTEST),
        parameters: "\"float temperaturereference\" 2100 \"float Le\" 700 \"float sigma_a\" 4 \"float sigma_s\" 0.3",
        outside: "haze",
    };
    medium.add(t, own);
}

/// A groined vault over a bay from (0, 0) to (BAY, BAY): where two round barrels meet.
fn groins() -> Mesh {
    const STEPS: u32 = 32;
    let radius = 0.5 * BAY;
    let place = |i: u32| radius * -(std::f32::consts::PI * i as f32 / STEPS as f32).cos();
    let mut mesh = Mesh::default();
    for i in 0..=STEPS {
        for k in 0..=STEPS {
            let (x, z) = (place(i), place(k));
            let y = (radius * radius - x.abs().min(z.abs()).powi(2)).max(0.0).sqrt();
            mesh.positions.push(Vec3::new(x + radius, y, z + radius));
        }
    }
    mesh.join_rings(STEPS + 1, STEPS + 1, false);
    mesh
}

fn crypt(t: &mut SceneText) {
    t.add(format_args!("\n# The crypt: pillars, vaults and walls"));
    t.object("bay", |t| {
        t.add(format_args!("NamedMaterial \"stone\""));
        t.mesh(&laid(&groins()));
        let ring = arch(0.5 * BAY, 0.0, 16);
        for turn in [false, true] {
            t.block(|t| {
                if turn {
                    t.add(format_args!("Rotate -90 0 1 0"));
                }
                t.add(format_args!("Translate {} 0 0", Number(0.5 * BAY)));
                t.mesh(&laid(&band(&ring, 0.16, -0.22, 0.22)));
            });
        }
    });
    t.object("pillar", |t| t.of("stone", |t| t.mesh(&laid(&pillar(0.27, SPRING)))));
    let half = BAY * BAYS[0] as f32;
    for row in 0..BAYS[1] {
        let z = NEAR + BAY * row as f32;
        for column in -BAYS[0]..BAYS[0] {
            t.instance("bay", Vec3::new(BAY * column as f32, SPRING, z), 0.0);
        }
        for column in -BAYS[0]..=BAYS[0] {
            t.instance("pillar", Vec3::new(BAY * column as f32, 0.0, z), 0.0);
        }
    }
    let far = NEAR + BAY * BAYS[1] as f32;
    t.of("stone", |t| {
        for (low, high) in [
            (Vec3::new(-half - 0.5, -0.3, NEAR - 0.5), Vec3::new(half + 0.5, 0.0, far + 0.5)),
            (Vec3::new(-half - 0.5, 0.0, NEAR), Vec3::new(-half, 4.5, far)),
            (Vec3::new(half, 0.0, NEAR), Vec3::new(half + 0.5, 4.5, far)),
            (Vec3::new(-half - 0.5, 0.0, NEAR - 0.5), Vec3::new(half + 0.5, 4.5, NEAR)),
            (Vec3::new(-half - 0.5, 0.0, far), Vec3::new(half + 0.5, 4.5, far + 0.5)),
        ] {
            t.mesh(&laid(&Mesh::cuboid(low, high, None)));
        }
    });
}

/// A bowl on three legs, with a few logs.
fn brazier(t: &mut SceneText) {
    t.add(format_args!("\n# The brazier"));
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(FIRE)));
        t.of("iron", |t| {
            let bowl =
                [(0.02, -0.2), (0.13, -0.17), (0.2, -0.08), (0.22, 0.0), (0.205, 0.0), (0.18, -0.07), (0.001, -0.15)];
            t.mesh(&Mesh::revolved(&bowl.map(|(r, y)| Vec2::new(r, y)), 32));
            for i in 0..3 {
                let angle = 0.5 + std::f32::consts::TAU * i as f32 / 3.0;
                let out = Vec3::new(angle.cos(), 0.0, angle.sin());
                t.rope(0.2 * out - 0.02 * Vec3::Y, 0.3 * out - FIRE.y * Vec3::Y, 0.0, 0.03);
                t.rope(0.26 * out - 0.75 * Vec3::Y, -0.45 * Vec3::Y, -0.05, 0.02);
            }
        });
        t.of("wood", |t| {
            for (turn, lean) in [(10.0, 62.0), (130.0, 70.0), (250.0, 58.0)] {
                t.block(|t| {
                    t.add(format_args!("Translate 0 -0.09 0 Rotate {turn} 0 1 0 Rotate {lean} 0 0 1"));
                    t.mesh(&Mesh::pole(0.028, -0.15, 0.16));
                });
            }
        });
    });
}

/// Tombs between the pillars, with lids one of which lies askew, rubble and a ladder.
fn things(t: &mut SceneText) {
    t.add(format_args!("\n# Tombs and rubble"));
    t.object("tomb", |t| {
        t.add(format_args!("NamedMaterial \"stone\""));
        for (low, high) in [
            (Vec3::new(-0.6, 0.0, -1.15), Vec3::new(0.6, 0.12, 1.15)),
            (Vec3::new(-0.48, 0.12, -1.03), Vec3::new(0.48, 0.7, 1.03)),
        ] {
            t.mesh(&laid(&Mesh::cuboid(low, high, None)));
        }
    });
    t.object("lid", |t| {
        t.add(format_args!("NamedMaterial \"stone\""));
        t.mesh(&laid(&Mesh::cuboid(Vec3::new(-0.56, 0.0, -1.1), Vec3::new(0.56, 0.14, 1.1), None)));
    });
    for (x, z, turn, askew) in [
        (-2.0, 4.2, 0.0, 0.0),
        (-2.0, 8.4, 0.0, 0.0),
        (2.3, 2.6, 0.0, 14.0),
        (2.2, 10.2, 90.0, 0.0),
        (-6.0, 6.0, 0.0, 0.0),
        (6.0, 6.0, 0.0, 0.0),
    ] {
        let p = Vec3::new(x, 0.0, z);
        t.instance("tomb", p, turn);
        t.instance("lid", p + Vec3::new(0.02 * askew, 0.7, 0.0), turn + askew);
    }
    let mut dice = Dice::new(404);
    t.of("stone", |t| {
        for _ in 0..26 {
            let p = Vec3::new(dice.between(-3.2, 3.4), 0.0, dice.between(1.0, 9.0));
            let size = dice.between(0.03, 0.13);
            t.block(|t| {
                t.add(format_args!(
                    "Translate {} Rotate {} {}",
                    Point(p + 0.5 * size * Vec3::Y),
                    Number(dice.between(0.0, 360.0)),
                    Point(dice.within(Vec3::ZERO, Vec3::ONE))
                ));
                let half = Vec3::new(size, 0.6 * size, 0.8 * size);
                t.mesh(&laid(&Mesh::cuboid(-half, half, None)));
            });
        }
    });
}
