//! The scene `explosion`: a ball of fire inside billows of dark smoke, in a yard at night. What glows lies deep, so that its light
//! comes out of the creases between the billows and is scattered before it does. Metres; y is up.

mod fireball;
mod yard;

use std::path::Path;

use glam::Vec3;

use super::own_volume::{GridMedium, OwnVolume};
use super::text::{SceneText, View};
use super::{GalleryError, masonry};

/// The middle of the explosion, on the ground.
const PLACE: Vec3 = Vec3::new(0.6, 0.0, 15.0);
/// The region of fire and smoke, from there.
const SMOKE_BOX: [Vec3; 2] = [Vec3::new(-6.5, 0.0, -5.5), Vec3::new(6.5, 10.5, 5.5)];

/// Writes every file of the scene, with the volume `own` in place of the one written here.
pub fn write(folder: &Path, own: Option<&OwnVolume>) -> Result<(), GalleryError> {
    if own.is_none() {
        fireball::write(&folder.join("explosion.vdb"))?;
    }
    masonry::write_texture(&folder.join("stone.png"))?;
    text(own).write(&folder.join("explosion.pbrt"))
}

fn text(own: Option<&OwnVolume>) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-1.2, 1.7, 0.0), Vec3::new(0.2, 4.1, 15.0));
    let view = View { eye, target, fov: 42.0, iso: 125.0, samples: 64, bounces: 16 };
    t.begin("explosion", "An explosion in a yard; units are metres", &view);
    t.add(format_args!("\n# The night: a dim sky and the moon"));
    t.add(format_args!("LightSource \"infinite\" \"rgb L\" [0.005 0.008 0.015]"));
    t.add(format_args!(
        "LightSource \"distant\" \"point3 from\" [-0.7 0.8 -0.4] \"point3 to\" [0 0 0] \"rgb L\" [0.09 0.12 0.17]"
    ));
    t.add(format_args!("\n# Fire and smoke"));
    let medium = GridMedium {
        name: "smoke",
        file: "explosion.vdb",
        region: SMOKE_BOX.map(|p| p + PLACE),
        hottest: Some(fireball::HOTTEST),
        parameters: "\"float temperaturereference\" 2000 \"float Le\" 55 \"float sigma_s\" 3.5 \"float sigma_a\" 1.5 \"float g\" 0.3",
        outside: "",
    };
    medium.add(&mut t, own);
    yard::add(&mut t);
    t
}
