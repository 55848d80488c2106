//! Everything solid: posts, planks, frames and boats as objects with many instances; the raft, its brazier and the hills.

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{Vec2, Vec3};

use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};
use super::{BOATS, DECK, EDGES, FIRE, POST_TOP, post_rows};

/// Kinds of planks: each shows its own board of the texture.
const PLANKS: u32 = 8;
/// Size of a plank of the deck.
const PLANK: Vec3 = Vec3::new(EDGES[1] - EDGES[0] + 0.24, 0.06, 0.19);

/// Materials and the texture.
pub fn materials(t: &mut SceneText) {
    t.add(format_args!("\nTexture \"boards\" \"spectrum\" \"imagemap\" \"string filename\" \"planks.png\""));
    for (name, what) in [
        ("boards", "\"string type\" \"diffuse\" \"texture reflectance\" \"boards\""),
        ("timber", "\"string type\" \"diffuse\" \"rgb reflectance\" [0.13 0.095 0.07]"),
        ("paint", "\"string type\" \"diffuse\" \"rgb reflectance\" [0.16 0.21 0.24]"),
        ("rope", "\"string type\" \"diffuse\" \"rgb reflectance\" [0.2 0.16 0.11]"),
        ("paper", "\"string type\" \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]"),
        ("rock", "\"string type\" \"diffuse\" \"rgb reflectance\" [0.05 0.055 0.06]"),
        ("iron", "\"string type\" \"conductor\" \"rgb reflectance\" [0.3 0.28 0.26] \"float roughness\" 0.35"),
    ] {
        t.add(format_args!("MakeNamedMaterial \"{name}\" {what}"));
    }
}

/// The objects that are instanced.
pub fn define(t: &mut SceneText) {
    t.object("post", |t| {
        t.add(format_args!("NamedMaterial \"timber\""));
        t.mesh(&Mesh::pole(0.1, -1.5, POST_TOP));
        t.add(format_args!("NamedMaterial \"iron\""));
        t.mesh(&Mesh::pole(0.125, DECK + 0.35, DECK + 0.43));
    });
    for kind in 0..PLANKS {
        t.object(&format!("plank{kind}"), |t| {
            t.add(format_args!("NamedMaterial \"boards\""));
            let (low, high) = (kind as f32 / PLANKS as f32, (kind + 1) as f32 / PLANKS as f32);
            t.mesh(&Mesh::cuboid(-0.5 * PLANK, 0.5 * PLANK, Some([0.0, low + 0.005, 1.0, high - 0.005])));
        });
    }
    // For a lantern of radius 1: lids above and below, hoops, and the wire that it hangs by.
    t.object("frame", |t| {
        t.add(format_args!("NamedMaterial \"iron\""));
        for (low, high) in [(0.9, 1.05), (-1.05, -0.92)] {
            let r = 0.42;
            let lid = [Vec2::new(0.02, low), Vec2::new(r, low), Vec2::new(r, high), Vec2::new(0.02, high)];
            t.mesh(&Mesh::revolved(&lid, 10));
        }
        t.rope(Vec3::Y, 1.5 * Vec3::Y, 0.0, 0.07);
        for height in [-0.5f32, 0.0, 0.5] {
            let r = (1.0 - height * height).sqrt();
            let hoop = [(r, -0.025), (r + 0.03, 0.0), (r, 0.025)].map(|(r, y)| Vec2::new(r, height + y));
            t.mesh(&Mesh::revolved(&hoop, 16));
        }
    });
    t.object("boat", |t| {
        t.add(format_args!("NamedMaterial \"paint\" Translate 0 0.42 0"));
        t.mesh(&Mesh::hull(4.2, 1.4, 0.6));
        t.add(format_args!("NamedMaterial \"timber\""));
        for z in [-1.1, 0.1, 1.0] {
            t.mesh(&Mesh::cuboid(Vec3::new(-0.62, -0.12, z - 0.13), Vec3::new(0.62, -0.08, z + 0.13), None));
        }
        t.block(|t| {
            t.add(format_args!("Translate 0 0 -1.5"));
            t.mesh(&Mesh::pole(0.025, -0.4, 1.05));
        });
    });
    t.object("ship", |t| {
        t.add(format_args!("NamedMaterial \"paint\" Translate 0 0.75 0"));
        t.mesh(&Mesh::hull(6.2, 1.9, 1.0));
        t.add(format_args!("NamedMaterial \"timber\""));
        t.mesh(&Mesh::cuboid(Vec3::new(-0.6, -0.1, -1.7), Vec3::new(0.6, 0.45, -0.2), None));
        t.add(format_args!("Translate 0 -0.75 0.3"));
        t.mesh(&Mesh::pole(0.07, 0.3, 5.7));
        t.block(|t| {
            t.add(format_args!("Translate 0 1.7 0 Rotate -90 1 0 0"));
            t.mesh(&Mesh::pole(0.09, 0.0, 2.4));
        });
        t.add(format_args!("NamedMaterial \"rope\""));
        for end in [Vec3::new(0.0, 0.95, 2.6), Vec3::new(0.0, 0.85, -2.9)] {
            t.rope(Vec3::new(0.0, 5.6, 0.0), end, 0.15, 0.02);
        }
    });
}

/// Posts, planks and beams.
pub fn pier(t: &mut SceneText, dice: &mut Dice) {
    t.add(format_args!("\n# The pier"));
    for z in post_rows() {
        for x in EDGES {
            let lean = dice.between(0.0, 360.0);
            t.instance("post", Vec3::new(x, dice.between(-0.03, 0.03), z), lean);
        }
    }
    let middle = 0.5 * (EDGES[0] + EDGES[1]);
    let mut z = -9.0;
    while z < 38.5 {
        let kind = dice.pick(&[0, 1, 2, 3, 4, 5, 6, 7]);
        let p = Vec3::new(middle + dice.between(-0.05, 0.05), DECK - 0.03 + dice.between(-0.008, 0.008), z);
        let flip = dice.pick(&[0.0, 180.0]);
        t.instance(&format!("plank{kind}"), p, flip + dice.between(-0.5, 0.5));
        z += PLANK.z + dice.between(0.012, 0.03);
    }
    t.block(|t| {
        t.add(format_args!("NamedMaterial \"timber\""));
        for x in EDGES {
            t.mesh(&Mesh::cuboid(Vec3::new(x - 0.07, DECK - 0.3, -9.0), Vec3::new(x + 0.07, DECK - 0.07, 38.6), None));
        }
    });
    // Mooring line from the first boat to a post.
    t.block(|t| {
        t.add(format_args!("NamedMaterial \"rope\""));
        t.rope(Vec3::new(-1.6, 0.75, 5.2), Vec3::new(EDGES[0] - 0.1, DECK + 0.4, 2.8), 0.3, 0.045);
    });
}

/// The raft and the brazier with its logs.
pub fn raft(t: &mut SceneText, dice: &mut Dice) {
    t.add(format_args!("\n# The raft and its brazier"));
    let middle = Vec3::new(FIRE.x, 0.0, FIRE.z);
    t.block(|t| {
        t.add(format_args!("Translate {} Rotate 24 0 1 0 NamedMaterial \"boards\"", Point(middle)));
        for i in 0..9 {
            let x = 0.27 * (i as f32 - 4.0);
            let (low, high) = (i as f32 / 9.0, (i as f32 + 1.0) / 9.0);
            let top = 0.2 + dice.between(-0.012, 0.012);
            t.mesh(&Mesh::cuboid(
                Vec3::new(x - 0.125, -0.1, -1.3),
                Vec3::new(x + 0.125, top, 1.3),
                Some([0.0, low, 1.0, high]),
            ));
        }
    });
    t.block(|t| {
        t.add(format_args!("Translate {} NamedMaterial \"iron\"", Point(FIRE)));
        let bowl = [(0.05, -0.34), (0.3, -0.3), (0.5, -0.12), (0.58, 0.0), (0.54, 0.0), (0.3, -0.24), (0.01, -0.28)];
        t.mesh(&Mesh::revolved(&bowl.map(|(r, y)| Vec2::new(r, y)), 28));
        for angle in [20.0, 140.0, 260.0] {
            let angle = Number(angle);
            t.block(|t| {
                t.add(format_args!("Rotate {angle} 0 1 0 Translate 0.42 -0.78 0 Rotate 10 0 0 1"));
                t.mesh(&Mesh::pole(0.03, 0.0, 0.62));
            });
        }
        t.add(format_args!("NamedMaterial \"rock\""));
        for angle in [0.0, 55.0, 115.0, 180.0, 240.0, 300.0] {
            let (angle, lean) = (Number(angle), Number(dice.between(18.0, 34.0)));
            t.block(|t| {
                t.add(format_args!("Rotate {angle} 0 1 0 Translate 0.3 -0.2 0 Rotate {lean} 0 0 1"));
                t.mesh(&Mesh::pole(0.05, 0.0, 0.55));
            });
        }
        t.add(format_args!("AreaLightSource \"diffuse\" \"blackbody L\" [1300] \"float scale\" 2.5"));
        for _ in 0..10 {
            let (angle, r) = (dice.between(0.0, std::f32::consts::TAU), dice.between(0.05, 0.34));
            let p = Vec3::new(r * angle.cos(), -0.2 + 0.3 * r, r * angle.sin());
            let size = Number(dice.between(0.035, 0.06));
            t.block(|t| {
                t.add(format_args!("Translate {} Shape \"sphere\" \"float radius\" {size}", Point(p)));
            });
        }
    });
}

/// Boats at their moorings.
pub fn boats(t: &mut SceneText) {
    t.add(format_args!("\n# Boats"));
    for (place, heading, has_mast) in BOATS {
        t.instance(if has_mast { "ship" } else { "boat" }, place, heading);
    }
}

/// A ridge against the sky.
pub fn far_shore(t: &mut SceneText) {
    t.add(format_args!("\n# The far shore"));
    let mut noise = FastNoiseLite::with_seed(7);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(5));
    noise.set_frequency(Some(0.014));
    const ACROSS: u32 = 140;
    let mut mesh = Mesh::default();
    // Rows from the waterline up and back.
    for (z, rise) in [(77.0, 0.0), (79.0, 0.12), (88.0, 0.6), (100.0, 1.0)] {
        mesh.positions.extend((0..ACROSS).map(|i| {
            let x = -150.0 + 300.0 * i as f32 / (ACROSS - 1) as f32;
            let height = 11.0 + 9.0 * noise.get_noise_2d(x, 0.0) + 1.5 * noise.get_noise_2d(4.0 * x, z);
            Vec3::new(x, rise * height.max(2.0) - 0.1, z)
        }));
    }
    mesh.join_rings(4, ACROSS, false);
    t.block(|t| {
        t.add(format_args!("NamedMaterial \"rock\""));
        t.mesh(&mesh);
    });
}
