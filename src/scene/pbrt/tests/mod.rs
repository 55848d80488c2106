//! Tests of the whole parser: what directives mean, where errors are placed, and that no text brings it down.

mod damage;
mod files;
mod messages;
mod state;
mod values;

use std::path::PathBuf;

use super::*;
use crate::scene::SceneErrorKind;

/// A folder with files, of which the first is the scene.
struct Files {
    folder: tempfile::TempDir,
    main: PathBuf,
}

impl Files {
    fn new(files: &[(&str, &[u8])]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, content).unwrap();
        }
        let main = folder.path().join(files[0].0);
        Self { folder, main }
    }

    fn load(&self) -> (Result<SceneDescription, Box<SceneError>>, Sources, Warnings) {
        let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
        let scene = load(&self.main, &mut sources, &mut warnings);
        (scene, sources, warnings)
    }

    /// The error as one line, without the folder.
    fn error(&self) -> String {
        let (scene, sources, _) = self.load();
        let line = scene.expect_err("this text must be refused").one_line(&sources);
        line.replace(&format!("{}/", self.folder.path().display()), "")
    }
}

fn text(main: &str) -> Files {
    Files::new(&[("main.pbrt", main.as_bytes())])
}

fn scene(main: &str) -> SceneDescription {
    let (scene, sources, _) = text(main).load();
    scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)))
}

fn warnings(main: &str) -> Vec<String> {
    let (scene, sources, warnings) = text(main).load();
    scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)));
    warnings.list().iter().map(|w| w.message.clone()).collect()
}

fn text_error(main: &str) -> String {
    text(main).error()
}
