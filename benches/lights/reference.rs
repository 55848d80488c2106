//! References: the same program with other seeds and many samples, in two halves. They are kept under `target/`, by all that they depend on.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::{Errors, Picture};
use super::run::{Task, fail, render};
use super::settings::Settings;
use super::variants::defaults;

/// The seeds of the halves; a benchmark's own are smaller.
const SEEDS: [u64; 2] = [1_000_000_007, 1_000_000_009];

pub struct Reference {
    pub halves: [Picture; 2],
    pub about: About,
}

/// What a reference is worth.
#[derive(Clone, Debug, Serialize)]
pub struct About {
    pub seeds: [u64; 2],
    pub spp: u32,
    /// Mean of the light that was gathered.
    pub mean: f64,
    /// Its own error, as far as its halves tell.
    pub rmse: f64,
}

impl Reference {
    pub fn of(folder: &Path, scene: &Path, (name, lights): (&str, u64), settings: &Settings) -> Self {
        let half = (settings.reference_spp / 2).max(1);
        let content = content(scene.parent().expect("a file in a folder")).unwrap_or_else(|e| fail(&e.to_string()));
        let halves = SEEDS.map(|seed| {
            let key = format!("{name}-{lights}-{}-{half}-{seed}-{content:016x}.exr", settings.size);
            let output = folder.join("references").join(key);
            if !output.is_file() {
                let (arguments, size) = (defaults(settings.sampling).arguments, settings.size.as_str());
                render(&Task { scene, arguments, size, spp: half, seed, output: &output });
            }
            Picture::read(&output)
        });
        let rmse = Errors::own(halves.each_ref());
        let mean = 0.5 * (halves[0].mean() + halves[1].mean());
        Self { halves, about: About { seeds: SEEDS, spp: 2 * half, mean, rmse } }
    }
}

/// A hash of all files of a scene: another scene has another reference.
fn content(folder: &Path) -> std::io::Result<u64> {
    let mut files =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<PathBuf>>>()?;
    files.sort();
    let mut hasher = DefaultHasher::new();
    for file in files.iter().filter(|file| file.is_file()) {
        std::fs::read(file)?.hash(&mut hasher);
    }
    Ok(hasher.finish())
}
