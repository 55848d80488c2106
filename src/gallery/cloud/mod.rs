//! The scene `cloud`: a cumulus over the sea, seen from a headland, in the sun of an afternoon. Light is scattered in it many times, so paths are
//! long. Metres; y is up.

mod coast;
mod cumulus;
mod sky;

use std::path::Path;

use glam::Vec3;

use super::GalleryError;
use super::own_volume::{GridMedium, OwnVolume};
use super::text::{Point, SceneText, View};

/// From the world towards the sun.
const SUN: Vec3 = Vec3::new(-0.85, 0.5, -0.05);
/// The region of the cloud.
const CLOUD_BOX: [Vec3; 2] = [Vec3::new(-900.0, 640.0, 2300.0), Vec3::new(1150.0, 1920.0, 3500.0)];

/// Writes every file of the scene, with the volume `own` in place of the one written here.
pub fn write(folder: &Path, own: Option<&OwnVolume>) -> Result<(), GalleryError> {
    if own.is_none() {
        cumulus::write(&folder.join("cloud.vdb"))?;
    }
    sky::write(&folder.join("sky.png"))?;
    text(own).write(&folder.join("cloud.pbrt"))
}

fn text(own: Option<&OwnVolume>) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(0.0, 62.0, 0.0), Vec3::new(60.0, 800.0, 2900.0));
    let view = View { eye, target, fov: 39.0, iso: 100.0, samples: 32, bounces: 96 };
    t.begin("cloud", "A cumulus over the sea; units are metres", &view);
    t.add(format_args!("\n# The sun and the sky"));
    t.add(format_args!(
        "LightSource \"distant\" \"point3 from\" [{}] \"point3 to\" [0 0 0] \"rgb L\" [3.1 2.75 2.3]",
        Point(SUN)
    ));
    t.block(|t| {
        // The image's pole is z.
        t.add(format_args!("Rotate -90 1 0 0 LightSource \"infinite\" \"string filename\" \"sky.png\""));
    });
    t.add(format_args!("\n# The cloud"));
    let medium = GridMedium {
        name: "cloud",
        file: "cloud.vdb",
        region: CLOUD_BOX,
        hottest: None,
        parameters: "\"float sigma_s\" 0.06 \"float sigma_a\" 0.00001 \"float g\" 0.7",
        outside: "",
    };
    medium.add(&mut t, own);
    coast::add(&mut t);
    t
}
