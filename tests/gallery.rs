//! The project's own scenes: written, written again the same, and rendered, through the program itself.

#[cfg(feature = "openvdb")]
use std::path::Path;

use assert_cmd::Command;

fn lanternfish() -> Command {
    Command::new(env!("CARGO_BIN_EXE_lanternfish"))
}

#[cfg(feature = "openvdb")]
fn write_pier(folder: &Path) {
    lanternfish().args(["scene", "pier", "--out"]).arg(folder).assert().success();
}

#[test]
fn an_unknown_name_is_wrong_usage_and_lists_the_known() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = lanternfish().args(["scene", "peer", "--out"]).arg(folder.path()).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("\"peer\"") && text.contains("pier "), "{text}");
    let help = lanternfish().args(["scene", "--help"]).output().expect("it runs");
    assert!(String::from_utf8_lossy(&help.stdout).contains("pier "));
}

#[cfg(not(feature = "openvdb"))]
#[test]
fn without_openvdb_a_scene_with_volumes_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = lanternfish().args(["scene", "pier", "--out"]).arg(folder.path()).output().expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("feature \"openvdb\""));
}

#[cfg(feature = "openvdb")]
#[test]
fn the_pier_is_written_the_same_twice_and_renders_without_warnings() {
    let folders = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    for folder in &folders {
        write_pier(folder.path());
    }
    let file = |which: usize, name: &str| std::fs::read(folders[which].path().join(name)).expect("it was written");
    for name in ["pier.pbrt", "water.pbrt", "planks.png"] {
        assert!(file(0, name) == file(1, name), "{name} differs");
    }
    for name in ["fog.vdb", "fire.vdb"] {
        // Files carry an identifier of their own; what is in them must not differ.
        let read = |folder: &Path| openvdb::read_vdb(&folder.join(name), &openvdb::Limits::default());
        let [a, b] = folders.each_ref().map(|folder| read(folder.path()).expect("a readable file"));
        assert!(!a.is_empty() && a.len() == b.len());
        for (a, b) in a.iter().zip(&b) {
            assert!(a.header.active_voxels > 10_000, "{name} {} holds little", a.header.name);
            assert!(a.leaf_origins == b.leaf_origins && a.values == b.values, "{name} {} differs", a.header.name);
        }
    }

    let scene = folders[0].path().join("pier.pbrt");
    let image = folders[0].path().join("pier.exr");
    let mut command = lanternfish();
    command.arg("render").arg(&scene).arg("-o").arg(&image).args(["--resolution", "32x18", "--spp", "1"]);
    let output = command.output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(!text.contains("warning"), "{text}");
    layers_add_up(&image);
}

/// The layers of light add up to the picture, and each of them has some.
#[cfg(feature = "openvdb")]
fn layers_add_up(image: &Path) {
    let image = lanternfish::film::exr::read_exr_layers(image).expect("a readable image");
    let layers = ["direct", "indirect", "emission", "volume"];
    for colour in ["R", "G", "B"] {
        let channel = |name: String| image.channel(&name).expect("every layer is there");
        let parts = layers.map(|layer| channel(format!("{layer}.{colour}")));
        for (i, &beauty) in channel(colour.to_owned()).iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - beauty).abs() <= 1e-4 * beauty.max(1e-3), "pixel {i}: {sum} is not {beauty}");
        }
        for (layer, part) in layers.iter().zip(parts) {
            assert!(part.iter().any(|&v| v > 0.0), "{layer}.{colour} is black");
        }
    }
}
