//! A scene made to need a system: a file beside the scene's that includes it and adds to it.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use tempfile::NamedTempFile;

use super::facts::Facts;
use super::place::Place;
use super::systems::{self, BOUNDARY, System, TRIANGLE};
use crate::bench::BenchError;
use crate::bench::method::Method;
use crate::bench::subject::Subject;
use crate::film::image::encode_png;
use crate::gallery::volume;
use crate::render::{Job, RenderSettings, load};
use crate::scene::{Sources, Warnings};
use crate::system::output::{OutputError, write_atomically};

/// The system that is a program of its own.
const READER: &str = "volume reader";

/// A scene that needs one system more.
pub struct Variant {
    /// The system.
    pub system: &'static System,
    /// Why the scene leaves it out.
    pub reason: String,
    /// Whether the scene has no use for the system.
    pub is_idle: bool,
    /// The arguments of its renders.
    pub method: Method,
    /// The text of its file; empty if arguments are enough.
    pub text: String,
    /// Whether another program reads volumes for it.
    pub has_helper: bool,
    /// Its file, which is there as long as this; none if arguments are enough.
    pub file: Option<NamedTempFile>,
}

/// Names of files that variants refer to.
struct Files {
    texture: String,
    volume: Result<String, String>,
}

/// A variant for each system that `subject` leaves out, and why there is none for the others. What they refer to is written to `folder`.
///
/// # Errors
/// Files that cannot be written.
pub fn of(subject: &Subject, folder: &Path) -> Result<(Vec<Variant>, Vec<String>), BenchError> {
    let facts = &subject.facts;
    let mut notes = vec![];
    let beyond: Vec<&str> = systems::beyond(facts).collect();
    if !beyond.is_empty() {
        notes.push(format!("left out too, but nothing can be added to the scene that needs it: {}", beyond.join(", ")));
    }
    let Some(place) = facts.place else {
        notes.push("the scene has no extent: there is no place for anything".to_owned());
        return Ok((vec![], notes));
    };
    let files = Files::write(folder)?;
    let mut variants = vec![];
    for (system, part) in systems::left_out(facts) {
        match variant(subject, system, place, &files)? {
            Ok((method, text, file)) => {
                let reason = part.reason.clone();
                let has_helper = system.name == READER || facts.has(READER);
                let is_idle = system.is_idle_in(facts);
                variants.push(Variant { system, reason, is_idle, method, text, has_helper, file });
            }
            Err(why) => notes.push(format!("{} is not measured: {why}", system.name)),
        }
    }
    Ok((variants, notes))
}

impl Files {
    fn write(folder: &Path) -> Result<Self, BenchError> {
        let texture = folder.join("texture.png");
        let png = encode_png(2, 2, &[128; 12]).map_err(|error| OutputError::new(&texture, error))?;
        write_atomically(&texture, |file| file.write_all(&png).map_err(|error| error.to_string()))?;
        let volume = folder.join("volume.vdb");
        let written = volume::write(&volume, [Vec3::ZERO, Vec3::ONE], 0.25, ["density"], |_| [1.0]);
        let volume = written.map(|()| quoted(&volume)).map_err(|error| error.to_string());
        Ok(Self { texture: quoted(&texture), volume })
    }
}

type Made = (Method, String, Option<NamedTempFile>);

/// The arguments, text and file that make `subject` need `system`, or why there are none.
fn variant(
    subject: &Subject,
    system: &System,
    place: Place,
    files: &Files,
) -> Result<Result<Made, String>, BenchError> {
    let arguments = system.arguments.iter().map(|&argument| argument.to_owned()).collect();
    let method = Method { name: system.name.to_owned(), arguments };
    // Lights to choose from are added where there are none only.
    if !system.arguments.is_empty() && subject.facts.lights > 1 {
        return Ok(Ok((method, String::new(), None)));
    }
    let volume = match &files.volume {
        Ok(volume) => volume,
        Err(why) if system.within.contains("{volume}") => return Ok(Err(why.clone())),
        Err(_) => "",
    };
    let text = text(&subject.file, system, place, &files.texture, volume);
    let file = beside(&subject.file, &text)?;
    Ok(match facts(file.path()) {
        Ok(facts) if facts.has(system.name) || !system.arguments.is_empty() => Ok((method, text, Some(file))),
        Ok(_) => Err("what was added does not make the scene need it".to_owned()),
        Err(why) => Err(format!("with it the scene cannot be loaded: {why}")),
    })
}

/// A file that includes `scene` and adds nothing: what variants are compared with, so that they differ by the system alone.
///
/// # Errors
/// If it cannot be written.
pub fn plain(scene: &Path) -> Result<NamedTempFile, OutputError> {
    beside(scene, &include(scene))
}

/// A file beside `scene`, where names of files mean the same.
fn beside(scene: &Path, text: &str) -> Result<NamedTempFile, OutputError> {
    let folder = scene.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = |error: std::io::Error| OutputError::new(folder, error);
    let mut file = tempfile::Builder::new().prefix(".lean-").suffix(".pbrt").tempfile_in(folder).map_err(fail)?;
    file.write_all(text.as_bytes()).map_err(fail)?;
    Ok(file)
}

fn include(scene: &Path) -> String {
    format!("Include \"{}\"\n", quoted(Path::new(scene.file_name().unwrap_or_default())))
}

/// The file that includes `scene` and adds what makes it need `system`.
fn text(scene: &Path, system: &System, place: Place, texture: &str, volume: &str) -> String {
    let Place { corner, size } = place;
    let fill = |text: &str| {
        let text = text.replace("{triangle}", TRIANGLE).replace("{boundary}", BOUNDARY);
        text.replace("{texture}", texture).replace("{volume}", volume).replace("{size}", &size.to_string())
    };
    let mut text = format!("{}\n{}", fill(system.before), include(scene));
    if !system.within.is_empty() {
        text += &format!(
            "AttributeBegin\nActiveTransform All\nIdentity\nTranslate {} {} {}\nScale {size} {size} {size}\nMediumInterface \"\" \"\"\n{}\nAttributeEnd\n",
            corner.x,
            corner.y,
            corner.z,
            fill(system.within)
        );
    }
    text.trim_start().to_owned()
}

/// A path as it stands within the quotes of a scene file.
fn quoted(path: &Path) -> String {
    path.display().to_string().replace('\\', "\\\\").replace('"', "\\\"")
}

/// What the scene in `file` has.
fn facts(file: &Path) -> Result<Facts, String> {
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let wanted = RenderSettings { plan_only: true, ..RenderSettings::default() };
    let (scene, timings) = load(file, &mut sources, &mut warnings).map_err(|error| error.to_string())?;
    let job = Job::prepare(&scene, &wanted, timings, &mut warnings).map_err(|error| error.to_string())?;
    Ok(Facts::of(&job))
}
