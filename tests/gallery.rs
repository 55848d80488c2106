//! The project's own scenes: written, written again the same, and rendered, through the program itself.

use std::path::Path;

use assert_cmd::Command;

/// Scenes that need no volumes from files, with a small and a larger number of lights that they can have.
const PLAIN: [(&str, [u32; 2]); 5] =
    [("foliage", [1, 700]), ("house", [16, 300]), ("rooms", [16, 75]), ("beams", [1, 40]), ("lamp", [1, 1])];

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

/// Writes a scene with so many lights.
fn write_scene(name: &str, lights: u32, folder: &Path) {
    let mut command = lanternfish();
    command.args(["scene", name, "--lights", &lights.to_string(), "--out"]).arg(folder).assert().success();
}

/// The names and contents of a folder's files.
fn files(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let mut files: Vec<_> =
        entries.map(|entry| (entry.file_name(), std::fs::read(entry.path()).expect("a file"))).collect();
    files.sort();
    files
}

/// How many lights the plan of a scene says that it has, after a render without warnings.
fn rendered_lights(scene: &Path) -> String {
    let image = scene.with_extension("exr");
    let mut command = lanternfish();
    command.arg("render").arg(scene).arg("-o").arg(image).args(["--resolution", "16x9", "--spp", "1"]);
    let output = command.args(["--lights", "power"]).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !text.contains("warning"), "{}: {text}", scene.display());
    let output = lanternfish().arg("info").arg(scene).output().expect("it runs");
    let plan = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = plan.lines().find(|line| line.contains("build     lights ")).unwrap_or_default();
    line.split_whitespace().nth(2).unwrap_or_default().to_owned()
}

#[test]
fn scenes_have_exactly_the_lights_asked_for_and_come_out_the_same_twice() {
    for (name, counts) in PLAIN {
        for count in counts {
            let folders = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
            for folder in &folders {
                write_scene(name, count, folder.path());
            }
            let [a, b] = folders.each_ref().map(|folder| files(folder.path()));
            assert!(a == b, "{name} with {count} lights differs from itself");
            let scene = folders[0].path().join(name).with_extension("pbrt");
            assert_eq!(rendered_lights(&scene), count.to_string(), "{name}");
        }
    }
}

#[test]
fn a_number_of_lights_out_of_range_is_wrong_usage_and_names_the_range() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, lights, range) in [("house", "15", "16 to"), ("beams", "0", "1 to"), ("lamp", "2", "1 light, not 2")] {
        let mut command = lanternfish();
        command.args(["scene", name, "--lights", lights, "--out"]).arg(folder.path());
        let output = command.output().expect("it runs");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && text.contains(range), "{text}");
    }
    assert!(files(folder.path()).is_empty());
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
fn a_pier_may_have_fewer_lights_or_more() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for count in [16, 778] {
        write_scene("pier", count, folder.path());
        // The fire is one besides.
        assert_eq!(rendered_lights(&folder.path().join("pier.pbrt")), (count + 1).to_string());
    }
    // With as many as it has by itself it is the same.
    let [a, b] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    write_pier(a.path());
    write_scene("pier", 777, b.path());
    let text = |folder: &Path| std::fs::read(folder.join("pier.pbrt")).expect("it was written");
    assert!(text(a.path()) == text(b.path()));
    write_scene("pier", 3000, a.path());
    write_scene("pier", 3000, b.path());
    // Its festival has fires of its own.
    assert_eq!(rendered_lights(&a.path().join("pier.pbrt")), "3004");
    for name in ["pier.pbrt", "town0.pbrt"] {
        let read = |folder: &Path| std::fs::read(folder.join(name)).expect("it was written");
        assert!(read(a.path()) == read(b.path()), "{name} differs");
    }
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
