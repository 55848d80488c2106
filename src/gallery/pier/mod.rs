//! The scene `pier`: a timber pier at night hung with paper lanterns, more of them adrift on black water, boats with
//! lights in their rigging, a far shore, low fog, and a fire in a brazier on a raft. Metres; y is up, the pier runs along z.
//!
//! With more lights than that it is a night of festival: see [`festival`].

mod crowd;
mod fair;
mod festival;
mod lanterns;
mod objects;
mod town;
mod volumes;
mod water;

use std::path::Path;

use glam::Vec3;

use super::mesh::Mesh;
use super::text::{Dice, Number, Point, SceneText};
use super::{GalleryError, wood};

/// How many lights it has: lanterns, candles, windows, lamps, embers, moon and sky.
pub const DEFAULT_LIGHTS: u32 = 777;
/// Those of them that even the smallest version has: moon, sky and what the fire has.
const FIXED_LIGHTS: u32 = 15;

/// Height of the deck above the water.
const DECK: f32 = 1.0;
/// The pier's left and right edge.
const EDGES: [f32; 2] = [-0.2, 2.6];
/// Where posts stand along the pier.
fn post_rows() -> impl Iterator<Item = f32> {
    (0..14).map(|i| -3.6 + 3.2 * i as f32)
}
/// Height of the posts above the water.
const POST_TOP: f32 = 3.7;
/// Where the camera is.
const EYE: Vec3 = Vec3::new(-2.5, 2.3, -5.5);
/// The middle of the brazier's rim.
const FIRE: Vec3 = Vec3::new(-5.6, 0.95, 5.5);
/// The region that the fog's file fills.
const FOG_BOX: [Vec3; 2] = [Vec3::new(-48.0, 0.0, -10.0), Vec3::new(48.0, 3.6, 76.0)];
/// The region of the fire and its smoke, from the brazier's rim.
const FIRE_BOX: [Vec3; 2] = [Vec3::new(-1.4, -0.35, -1.4), Vec3::new(2.4, 6.0, 1.4)];

/// A boat at its mooring: where, its heading in degrees, and whether it has a mast.
type Mooring = (Vec3, f32, bool);

const BOATS: [Mooring; 10] = [
    (Vec3::new(-1.9, 0.0, 3.2), 8.0, false),
    (Vec3::new(-11.5, 0.0, 14.5), 118.0, true),
    (Vec3::new(-4.6, 0.0, 17.0), -24.0, true),
    (Vec3::new(-18.5, 0.0, 23.0), 75.0, false),
    (Vec3::new(-15.0, 0.0, 32.0), -60.0, true),
    (Vec3::new(-7.0, 0.0, 36.0), 15.0, true),
    (Vec3::new(4.6, 0.0, 12.0), -6.0, false),
    (Vec3::new(6.5, 0.0, 24.0), 20.0, true),
    (Vec3::new(-25.0, 0.0, 40.0), 100.0, true),
    (Vec3::new(5.0, 0.0, 36.0), 160.0, false),
];

/// Writes every file of the scene with `lights` lights.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    volumes::write_fog(&folder.join("fog.vdb"))?;
    volumes::write_fire(&folder.join("fire.vdb"))?;
    wood::write_texture(&folder.join("planks.png"))?;
    water::text().write(&folder.join("water.pbrt"))?;
    let more = lights.saturating_sub(DEFAULT_LIGHTS);
    // So many lanterns more need less exposure.
    let iso = if more > 0 { 160 } else { 220 };
    let mut t = text(lights.saturating_sub(FIXED_LIGHTS), iso);
    if more > 0 {
        festival::write(folder, &mut t, more)?;
    }
    t.write(&folder.join("pier.pbrt"))
}

/// The scene with so many lanterns, of which not all are there if there are few.
fn text(lanterns: u32, iso: u32) -> SceneText {
    let mut t = SceneText::default();
    header(&mut t, iso);
    let mut dice = Dice::new(2024);
    t.add(format_args!("WorldBegin"));
    sky(&mut t);
    volumes_text(&mut t);
    objects::materials(&mut t);
    objects::define(&mut t);
    objects::pier(&mut t, &mut dice);
    objects::raft(&mut t, &mut dice);
    objects::boats(&mut t);
    objects::far_shore(&mut t);
    t.add(format_args!("\n# The water's surface\nInclude \"water.pbrt\""));
    fire_lights(&mut t);
    let mut keep = lanterns::Keep::new(lanterns);
    lanterns::hung(&mut t, &mut dice, &mut keep);
    lanterns::rigging(&mut t, &mut dice, &mut keep);
    lanterns::adrift(&mut t, &mut dice, &mut keep);
    lanterns::houses(&mut t, &mut dice, &mut keep);
    t
}

fn header(t: &mut SceneText, iso: u32) {
    let target = EYE + Vec3::new(-1.5, -0.33, 17.0);
    t.add(format_args!("# A pier at night. Written by `lanternfish scene pier`; units are metres, y is up."));
    t.add(format_args!("LookAt {}  {}  0 1 0", Point(EYE), Point(target)));
    t.add(format_args!(
        "Camera \"perspective\" \"float fov\" 40 \"float lensradius\" 0.018 \"float focaldistance\" 11.5"
    ));
    t.add(format_args!(
        "Film \"rgb\" \"integer xresolution\" 640 \"integer yresolution\" 360 \"float iso\" {iso} \"string filename\" \"pier.exr\""
    ));
    t.add(format_args!("PixelFilter \"gaussian\""));
    t.add(format_args!("Sampler \"zsobol\" \"integer pixelsamples\" 96"));
    t.add(format_args!("Integrator \"volpath\" \"integer maxdepth\" 4"));
}

fn sky(t: &mut SceneText) {
    t.add(format_args!("\n# The night: a dim sky and a low moon"));
    t.add(format_args!("LightSource \"infinite\" \"rgb L\" [0.0028 0.0048 0.0095]"));
    t.block(|t| {
        t.add(format_args!(
            "LightSource \"distant\" \"point3 from\" [0.8 0.9 -0.2] \"point3 to\" [0 0 0] \"rgb L\" [0.04 0.055 0.09]"
        ));
    });
}

fn volumes_text(t: &mut SceneText) {
    t.add(format_args!(
        "\n# Fog over the water, and the fire with its smoke; grids lie where their files' transforms say"
    ));
    t.add(format_args!("MakeNamedMedium \"fog\" \"string type\" \"openvdb\" \"string filename\" \"fog.vdb\""));
    t.add(format_args!("  \"float sigma_s\" 0.1 \"float sigma_a\" 0.002 \"float g\" 0.35"));
    t.add(format_args!("MakeNamedMedium \"fire\" \"string type\" \"openvdb\" \"string filename\" \"fire.vdb\""));
    t.add(format_args!("  \"string temperature\" \"temperature\" \"float temperaturereference\" 1800"));
    t.add(format_args!("  \"float Le\" 4.5 \"float sigma_a\" 1.6 \"float sigma_s\" 0.12"));
    for (name, [low, high]) in [("fog", FOG_BOX), ("fire", FIRE_BOX.map(|p| p + FIRE))] {
        t.block(|t| {
            t.add(format_args!("Material \"interface\" MediumInterface \"{name}\" \"\""));
            t.mesh(&Mesh::cuboid(low, high, None));
        });
    }
}

/// Lamps in the flames. A path meets the glowing gas only by chance, so the gas gives the flames their look and part of
/// their light, and these lamps at their hearts the rest. They have a size, since smoke drifts around them: light from a
/// point is unbounded close by.
fn fire_lights(t: &mut SceneText) {
    t.add(format_args!("\n# The fire's light on its surroundings. The glowing gas is found only by paths that happen to meet it, so these"));
    t.add(format_args!(
        "# unseen globes (alpha 0) inside the flames carry most of their light; the gas itself is what is seen."
    ));
    const RADIUS: f32 = 0.35;
    for (height, intensity) in [(0.55, 2.6), (0.9, 2.6), (1.35, 1.3)] {
        let p = Point(FIRE + Vec3::new(0.05 * height, height, 0.0));
        let radiance = Number(intensity / (std::f32::consts::PI * RADIUS * RADIUS));
        t.block(|t| {
            t.add(format_args!("AreaLightSource \"diffuse\" \"blackbody L\" [1750] \"float scale\" {radiance}"));
            t.add(format_args!("Translate {p} Shape \"sphere\" \"float radius\" {RADIUS} \"float alpha\" 0"));
        });
    }
}
