//! The project's own scenes, each written by code to a folder: pbrt text, .vdb volumes and PNG textures. Nothing random is
//! left to chance: the same scene with as many lights always comes out the same.
//!
//! A scene is a file or folder with a row in [`SCENES`]. It can be had with any number of lights in its range: with few it is
//! small and quick to render, with many it shows what a production scene does to light selection.

mod beams;
mod billows;
mod cloud;
mod explosion;
mod fire;
mod flames;
mod foliage;
mod furniture;
mod glow;
mod godrays;
mod house;
mod lamp;
mod masonry;
mod mesh;
mod museum;
mod own_volume;
mod pier;
mod rooms;
mod text;
mod torch;
pub(crate) mod volume;
mod wood;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use self::own_volume::OwnVolume;
use crate::scene::SceneErrorKind;
use crate::system::output::OutputError;

/// Writes a scene to a folder around a volume.
type WriteAround = fn(&Path, &OwnVolume) -> Result<(), GalleryError>;

/// A scene that can be written.
#[derive(Clone, Debug)]
pub struct GalleryScene {
    /// Its name on the command line; `name.pbrt` is the file to render.
    pub name: &'static str,
    /// What is to be seen, in a line.
    pub description: &'static str,
    /// How many lights it has unless told otherwise.
    pub default_lights: u32,
    /// How many it can have.
    pub lights: RangeInclusive<u32>,
    write: fn(&Path, u32) -> Result<(), GalleryError>,
    /// Writes it with another volume in place of its own, if it is a scene of one volume.
    around: Option<WriteAround>,
}

/// Every scene there is.
pub const SCENES: &[GalleryScene] = &[
    GalleryScene {
        name: "pier",
        description: "a pier at night: lanterns, fog over the water, a fire on a raft; with more, a festival and its town",
        default_lights: pier::DEFAULT_LIGHTS,
        lights: 16..=10_000_000,
        write: pier::write,
        around: None,
    },
    GalleryScene {
        name: "foliage",
        description: "a festival in an orchard on a hillside: small bulbs among leaves cut out by a texture; mist",
        default_lights: 38_720,
        lights: 1..=5_000_000,
        write: foliage::write,
        around: None,
    },
    GalleryScene {
        name: "house",
        description: "a house whose rooms are lit behind doors ajar, seen from its hall; thin mist",
        default_lights: 4_406,
        lights: 16..=200_000,
        write: house::write,
        around: None,
    },
    GalleryScene {
        name: "rooms",
        description: "a building of closed rooms, cut open towards the street",
        default_lights: 10_000,
        lights: 16..=200_000,
        write: rooms::write,
        around: None,
    },
    GalleryScene {
        name: "beams",
        description: "searchlights over a harbour: narrow spots in a wide, thin haze",
        default_lights: 24,
        lights: 1..=10_000,
        write: beams::write,
        around: None,
    },
    GalleryScene {
        name: "lamp",
        description: "a table lamp on a desk: one light, no fog, nothing to choose",
        default_lights: 1,
        lights: 1..=1,
        write: |folder, _| lamp::write(folder),
        around: None,
    },
    GalleryScene {
        name: "museum",
        description: "a hall of paintings under a lamp each: with 1200, 20 GB of textures",
        default_lights: museum::DEFAULT_LIGHTS,
        lights: 1..=4_000,
        write: museum::write,
        around: None,
    },
    GalleryScene {
        name: "torch",
        description: "a fire in a brazier in a crypt: the glow of thin mist that scatters forwards",
        default_lights: 1,
        lights: 1..=1,
        write: |folder, _| torch::write(folder, None),
        around: Some(|folder, own| torch::write(folder, Some(own))),
    },
    GalleryScene {
        name: "godrays",
        description: "the sun through the windows of a church: shafts of light in thin haze",
        default_lights: 2,
        lights: 2..=2,
        write: |folder, _| godrays::write(folder),
        around: None,
    },
    GalleryScene {
        name: "fire",
        description: "a tall fire of thin gas over the polished floor of a hall",
        default_lights: 1,
        lights: 1..=1,
        write: |folder, _| fire::write(folder, None),
        around: Some(|folder, own| fire::write(folder, Some(own))),
    },
    GalleryScene {
        name: "cloud",
        description: "a cumulus over the sea: light that is scattered many times",
        default_lights: 2,
        lights: 2..=2,
        write: |folder, _| cloud::write(folder, None),
        around: Some(|folder, own| cloud::write(folder, Some(own))),
    },
    GalleryScene {
        name: "explosion",
        description: "fire inside thick smoke, in a yard at night",
        default_lights: 3,
        lights: 3..=3,
        write: |folder, _| explosion::write(folder, None),
        around: Some(|folder, own| explosion::write(folder, Some(own))),
    },
];

/// Why a scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum GalleryError {
    /// A file or the folder cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scene cannot have so many lights, or so few.
    #[error("the scene \"{name}\" has {}, not {wanted}", in_words(range))]
    Lights {
        /// The scene.
        name: &'static str,
        /// What was asked for.
        wanted: u32,
        /// What it can have.
        range: RangeInclusive<u32>,
    },
    /// The scene is not one of a single volume, which could be replaced.
    #[error("the scene \"{name}\" has no volume to replace: {} have", with_volumes())]
    NoVolumeToReplace {
        /// The scene.
        name: &'static str,
    },
    /// The volume that was given cannot be used.
    #[error(transparent)]
    Volume(SceneErrorKind),
    /// The scene has volumes and this build cannot write them.
    #[error("this build cannot write .vdb files: build with the cargo feature \"openvdb\"")]
    NoVolumes,
}

/// `16 to 200000 lights`.
fn in_words(range: &RangeInclusive<u32>) -> String {
    match (range.start(), range.end()) {
        (1, 1) => "1 light".to_owned(),
        (low, high) if low == high => format!("{low} lights"),
        (low, high) => format!("{low} to {high} lights"),
    }
}

/// The names of the scenes of one volume: `torch, fire, cloud, explosion`.
fn with_volumes() -> String {
    let names: Vec<&str> = SCENES.iter().filter(|scene| scene.takes_volume()).map(|scene| scene.name).collect();
    names.join(", ")
}

/// The scene called `name`.
pub fn find(name: &str) -> Option<&'static GalleryScene> {
    SCENES.iter().find(|scene| scene.name == name)
}

impl GalleryScene {
    /// How many lights it has and may have, for lists: `24 lights (1 to 10000)`.
    pub fn lights_in_words(&self) -> String {
        let default = in_words(&(self.default_lights..=self.default_lights));
        if self.lights.start() == self.lights.end() {
            return default;
        }
        format!("{default} ({} to {})", self.lights.start(), self.lights.end())
    }

    /// Whether its volume can be replaced by another.
    pub fn takes_volume(&self) -> bool {
        self.around.is_some()
    }

    /// Writes the scene's files with `lights` lights, by default as many as it has by itself, to `folder`, which is made if it
    /// is not there; returns the file to render. Files of the same names are replaced.
    ///
    /// # Errors
    /// A number of lights out of the scene's range, what cannot be written, and builds without OpenVDB for scenes that have
    /// volumes.
    pub fn write(&self, folder: &Path, lights: Option<u32>) -> Result<PathBuf, GalleryError> {
        self.write_around(folder, lights, None)
    }

    /// The same, with a copy of the .vdb file `volume`, if there is one, in place of the scene's own.
    ///
    /// # Errors
    /// Those of [`GalleryScene::write`]; a scene whose volume cannot be replaced, and a file that cannot be read or holds nothing to
    /// show. Nothing is written then.
    pub fn write_around(
        &self,
        folder: &Path,
        lights: Option<u32>,
        volume: Option<&Path>,
    ) -> Result<PathBuf, GalleryError> {
        let wanted = lights.unwrap_or(self.default_lights);
        if !self.lights.contains(&wanted) {
            return Err(GalleryError::Lights { name: self.name, wanted, range: self.lights.clone() });
        }
        let around = match (volume, self.around) {
            (None, _) => None,
            (Some(_), None) => return Err(GalleryError::NoVolumeToReplace { name: self.name }),
            (Some(volume), Some(write)) => Some((OwnVolume::read(volume)?, write)),
        };
        std::fs::create_dir_all(folder).map_err(|error| OutputError::new(folder, error))?;
        match around {
            None => (self.write)(folder, wanted)?,
            Some((own, write)) => {
                own.copy_to(folder)?;
                write(folder, &own)?;
            }
        }
        Ok(folder.join(self.name).with_extension("pbrt"))
    }
}
