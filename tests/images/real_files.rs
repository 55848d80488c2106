//! Scenes that another program's exporter wrote: every one of them renders, or is refused, by name, and nothing is left out silently.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::shared;
use lanternfish::film::exr::read_exr_layers;

/// What a scene is expected to say besides what all of them do (each names an accelerator, which is warned of). A scene that is not
/// listed says nothing else.
const SAYS: &[(&str, i32, &[&str])] = &[
    ("test_geolight_no_geo", 0, &["this block is never ended"]),
    // The image is not among the files.
    ("test_goniometriclight", 0, &["tex.exr"]),
    ("test_goniometriclight_no_color", 0, &["tex.exr"]),
    ("test_projectorlight", 0, &["tex.exr"]),
    ("test_projectorlight_no_color", 0, &["tex.exr"]),
    ("test_gridlight_tex", 0, &["tex.exr"]),
    ("test_callback_parm_material", 0, &["tex.exr"]),
    ("test_interior_cloud", 0, &["160 are made"]),
    ("test_interior_nanovdb", 3, &["NanoVDB's version 0.0.19: only 32.x can be read"]),
];

/// Scenes whose picture must be black: their only light is left out, or there is none.
const DARK: &[&str] = &["test_sunlight"];

fn scenes(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the folder can be listed") {
        let path = entry.expect("the folder can be listed").path();
        if path.is_dir() {
            scenes(&path, found);
        } else if path.extension().is_some_and(|e| e == "pbrt") {
            found.insert(path);
        }
    }
}

/// The message of a warning or error, without its place.
fn warnings(output: &str) -> impl Iterator<Item = &str> {
    output.lines().filter(|line| line.starts_with("warning:") || line.starts_with("error:"))
}

#[test]
fn exported_scenes_render_or_are_refused_by_name() {
    let Some(folder) = shared("data/pbrt/scenes") else {
        println!("skipped: the scenes are not on this machine");
        return;
    };
    let mut found = BTreeSet::new();
    scenes(&folder, &mut found);
    assert!(found.len() >= SAYS.len(), "scenes are missing");
    let output = tempfile::tempdir().expect("a temporary folder");
    for scene in found {
        let name = scene.file_stem().and_then(|s| s.to_str()).expect("names are text");
        let image = output.path().join(format!("{name}.exr"));
        let run = Command::new(env!("CARGO_BIN_EXE_lanternfish"))
            .args(["render", "--spp", "8", "--resolution", "64x48", "--threads", "2", "--output"])
            .args([&image, &scene])
            .output()
            .expect("the program starts");
        let text = String::from_utf8_lossy(&run.stderr).into_owned();
        let (code, says) =
            SAYS.iter().find(|(n, ..)| *n == name).map_or((0, &[][..]), |(_, code, says)| (*code, *says));
        assert_eq!(run.status.code(), Some(code), "{name}: {text}");
        for words in says {
            assert!(text.contains(words), "{name} does not say {words:?}: {text}");
        }
        assert!(!text.contains("NaN"), "{name}: {text}");
        let unexpected = warnings(&text).find(|line| !line.contains("Accelerator") && says.is_empty());
        assert_eq!(unexpected, None, "{name}");
        if code == 0 {
            let image = read_exr_layers(&image).expect("the image can be read");
            let values = || image.rgb("").expect("a beauty").into_iter().flatten();
            assert!(values().all(|v| v.is_finite() && *v >= 0.0), "{name}");
            assert_eq!(values().all(|v| *v == 0.0), DARK.contains(&name), "{name}: black or not");
        }
    }
}
