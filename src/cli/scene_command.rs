//! `lanternfish scene`: writes one of the project's own scenes.

use std::io::Write;

use super::ExitStatus;
use super::arguments::SceneArguments;
use super::diagnostics::{print_message, say};
use super::interrupt::Interrupts;
use crate::gallery::{self, GalleryError};

/// The scenes' names, descriptions and numbers of lights, a line each.
pub fn list() -> String {
    let lines = gallery::SCENES.iter().map(|scene| {
        let volume = if scene.takes_volume() { "; takes --vdb" } else { "" };
        format!("\n  {:<10} {}; {}{volume}", scene.name, scene.description, scene.lights_in_words())
    });
    format!("Scenes:{}", lines.collect::<String>())
}

/// Runs the command. An unknown name is a usage error that lists the names, and so is a number of lights that the scene cannot
/// have, or a volume for a scene without.
pub fn run(arguments: &SceneArguments) -> ExitStatus {
    let Some(scene) = gallery::find(&arguments.name) else {
        print_message(&format!("no scene is called \"{}\"", arguments.name));
        say(list());
        return ExitStatus::Usage;
    };
    Interrupts::listen();
    match scene.write_around(&arguments.out, arguments.lights, arguments.vdb.as_deref()) {
        Ok(path) => {
            let _ = writeln!(std::io::stdout(), "{}", path.display());
            ExitStatus::Done
        }
        Err(error) => {
            print_message(&error.to_string());
            match &error {
                GalleryError::Lights { .. } | GalleryError::NoVolumeToReplace { .. } => ExitStatus::Usage,
                GalleryError::Volume(kind) => kind.into(),
                GalleryError::Output(_) | GalleryError::NoVolumes => ExitStatus::Failed,
            }
        }
    }
}
