//! A scene as the benchmark needs to know it before it renders: that it loads, how large its image is, how many lights there are, and a
//! number for all that its files hold.

use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::BenchError;
use super::lean::Facts;
use super::settings::{Entry, Origin, Settings};
use crate::film::{FilmOverrides, PixelBounds};
use crate::gallery::{self, GalleryScene};
use crate::render::{Job, RenderSettings, inputs, load};
use crate::scene::{Sources, Warnings};
use crate::system::output::OutputError;

/// A scene that can be rendered.
pub struct Subject<'a> {
    /// What shall be done with it.
    pub entry: &'a Entry,
    /// Its file.
    pub file: PathBuf,
    /// Lights.
    pub lights: usize,
    /// The pixels to render, of the full image.
    pub bounds: PixelBounds,
    /// The full image.
    pub display: PixelBounds,
    /// Of the content of its files: another scene has another one.
    pub content: u64,
    /// What it has and what it leaves out.
    pub facts: Facts,
    /// What loading it warned of.
    pub warnings: usize,
}

impl<'a> Subject<'a> {
    /// Writes it, if it is one of the gallery's, and loads it.
    ///
    /// # Errors
    /// What is wrong with the scene, with an excerpt of its file; what cannot be written.
    pub fn of(entry: &'a Entry, settings: &Settings) -> Result<Self, BenchError> {
        let file = match &entry.origin {
            Origin::File(path) => path.clone(),
            Origin::Gallery(name, lights) => written(&settings.out.join("scenes"), name, *lights)?,
        };
        let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
        let film = FilmOverrides { resolution: settings.resolution, crop: None };
        let wanted = RenderSettings { plan_only: true, film, ..RenderSettings::default() };
        let loaded = load(&file, &mut sources, &mut warnings).and_then(|(scene, timings)| {
            let job = Job::prepare(&scene, &wanted, timings, &mut warnings)?;
            Ok((job, inputs(&scene, &sources)))
        });
        let (job, files) = match loaded {
            Ok(loaded) => loaded,
            Err(error) => return Err(BenchError::Scene { error: Box::new(error), sources: Box::new(sources) }),
        };
        let [width, height] = job.film.resolution;
        Ok(Self {
            entry,
            file,
            lights: job.world.lights.len(),
            bounds: job.film.bounds,
            display: PixelBounds::full(width, height),
            content: content(files),
            facts: Facts::of(&job),
            warnings: warnings.list().len(),
        })
    }

    /// How many lights all pixels together ask with `spp` samples each, if each asks all of them once.
    pub fn questions(&self, spp: u32) -> f64 {
        self.lights as f64 * self.bounds.area() as f64 * f64::from(spp)
    }
}

/// The file to render, after the gallery has written it.
fn written(folder: &Path, name: &str, lights: u32) -> Result<PathBuf, BenchError> {
    let scene: &GalleryScene =
        gallery::find(name).ok_or_else(|| BenchError::Usage(format!("no scene is called \"{name}\"")))?;
    let folder = folder.join(format!("{name}-{lights}"));
    std::fs::create_dir_all(&folder).map_err(|error| OutputError::new(&folder, error))?;
    Ok(scene.write(&folder, Some(lights))?)
}

/// A hash of the names and bytes of files. What cannot be read counts as empty: loading has judged it.
fn content(mut files: Vec<PathBuf>) -> u64 {
    files.sort();
    files.dedup();
    let mut hasher = DefaultHasher::new();
    let mut buffer = vec![0; 1 << 20];
    for path in files {
        hasher.write(path.file_name().unwrap_or_default().as_encoded_bytes());
        let Ok(mut file) = File::open(&path) else { continue };
        while let Ok(count @ 1..) = file.read(&mut buffer) {
            hasher.write(&buffer[..count]);
        }
    }
    hasher.finish()
}
