//! `lanternfish scene`: writes one of the project's own scenes.

use std::io::Write;

use super::ExitStatus;
use super::arguments::SceneArguments;
use super::diagnostics::{print_message, say};
use super::interrupt::Interrupts;
use crate::gallery;

/// The scenes' names and descriptions, a line each.
pub fn list() -> String {
    let lines = gallery::SCENES.iter().map(|scene| format!("\n  {:<10} {}", scene.name, scene.description));
    format!("Scenes:{}", lines.collect::<String>())
}

/// Runs the command. An unknown name is a usage error that lists the names.
pub fn run(arguments: &SceneArguments) -> ExitStatus {
    let Some(scene) = gallery::find(&arguments.name) else {
        print_message(&format!("no scene is called \"{}\"", arguments.name));
        say(list());
        return ExitStatus::Usage;
    };
    Interrupts::listen();
    match scene.write(&arguments.out) {
        Ok(path) => {
            let _ = writeln!(std::io::stdout(), "{}", path.display());
            ExitStatus::Done
        }
        Err(error) => {
            print_message(&error.to_string());
            ExitStatus::Failed
        }
    }
}
