//! The project's own scenes: written, written again the same, and rendered, through the program itself.

use std::path::Path;

use assert_cmd::Command;

/// Scenes that need no volumes from files, with a small and a larger number of lights that they can have.
const PLAIN: [(&str, [u32; 2]); 6] = [
    ("foliage", [1, 700]),
    ("house", [16, 300]),
    ("rooms", [16, 75]),
    ("beams", [1, 40]),
    ("lamp", [1, 1]),
    ("godrays", [2, 2]),
];

/// Scenes of one volume, with their lights.
const VOLUMES: [(&str, u32); 4] = [("torch", 1), ("fire", 1), ("cloud", 2), ("explosion", 3)];

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
    let output = command.args(["--lights", "power", "--strict"]).output().expect("it runs");
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
    for name in VOLUMES.map(|(name, _)| name).into_iter().chain(["pier"]) {
        let output = lanternfish().args(["scene", name, "--out"]).arg(folder.path()).output().expect("it runs");
        assert_eq!(output.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&output.stderr).contains("feature \"openvdb\""));
    }
}

/// Writes a scene around another volume.
fn write_around(name: &str, volume: &Path, folder: &Path) -> std::process::Output {
    let mut command = lanternfish();
    command.args(["scene", name, "--out"]).arg(folder).arg("--vdb").arg(volume).output().expect("it runs")
}

#[test]
fn a_volume_that_cannot_be_shown_is_refused_by_name_and_nothing_is_written() {
    let [inputs, folder] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let text = inputs.path().join("text.vdb");
    std::fs::write(&text, "not a volume").expect("written");
    let (missing, image) = (inputs.path().join("missing.vdb"), inputs.path().join("picture.png"));
    std::fs::write(&image, "not a volume").expect("written");
    // Without OpenVDB no file is looked into.
    let unread = if cfg!(feature = "openvdb") { 3 } else { 1 };
    for (name, volume, code, said) in [
        ("godrays", &text, 2, "torch, fire, cloud, explosion"),
        ("pier", &text, 2, "\"pier\" has no volume"),
        ("fire", &image, 3, "picture.png"),
        ("fire", &text, unread, if unread == 3 { "text.vdb" } else { "openvdb" }),
        ("torch", &missing, unread, if unread == 3 { "missing.vdb" } else { "openvdb" }),
    ] {
        let output = write_around(name, volume, folder.path());
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(code) && text.contains(said), "{name}: {text}");
    }
    assert!(files(folder.path()).is_empty());
}

/// Whether two .vdb files hold the same grids; each has an identifier of its own, so that their bytes differ.
#[cfg(feature = "openvdb")]
fn same_volumes(a: &Path, b: &Path) -> bool {
    let read = |path: &Path| openvdb::read_vdb(path, &openvdb::Limits::default()).expect("a readable file");
    let (a, b) = (read(a), read(b));
    assert!(!a.is_empty() && a.iter().all(|grid| grid.header.active_voxels > 1_000));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.leaf_origins == b.leaf_origins && a.values == b.values)
}

#[cfg(feature = "openvdb")]
fn is_black(image: &Path) -> bool {
    let image = lanternfish::film::exr::read_exr_layers(image).expect("a readable image");
    ["R", "G", "B"].iter().all(|name| image.channel(name).expect("a colour").iter().all(|&v| v == 0.0))
}

#[cfg(feature = "openvdb")]
#[test]
fn scenes_of_one_volume_come_out_the_same_twice_and_show_any_other_in_its_place() {
    let mut before: Option<(tempfile::TempDir, std::path::PathBuf)> = None;
    for (name, lights) in VOLUMES {
        let folders = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
        for folder in &folders {
            write_scene(name, lights, folder.path());
        }
        let [a, b] = folders.each_ref().map(|folder| files(folder.path()));
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            let [x, y] = folders.each_ref().map(|folder| folder.path().join(&a.0));
            let same = if x.extension().is_some_and(|e| e == "vdb") { same_volumes(&x, &y) } else { a == b };
            assert!(same, "{name}: {:?} differs", a.0);
        }
        let [first, second] = folders;
        let scene = first.path().join(name).with_extension("pbrt");
        assert_eq!(rendered_lights(&scene), lights.to_string(), "{name}");
        assert!(!is_black(&scene.with_extension("exr")), "{name} is black");

        // Around the volume of the scene before: all that it needs is in its folder.
        if let Some((home, volume)) = before.take() {
            let folder = tempfile::tempdir().expect("a temporary folder");
            assert!(write_around(name, &volume, folder.path()).status.success());
            let copy = folder.path().join(volume.file_name().expect("a name"));
            assert!(std::fs::read(&copy).expect("a copy") == std::fs::read(&volume).expect("a file"), "{name}");
            drop(home);
            let scene = folder.path().join(name).with_extension("pbrt");
            assert_eq!(rendered_lights(&scene), lights.to_string(), "{name}");
            assert!(!is_black(&scene.with_extension("exr")), "{name} is black");
        }
        let volume = second.path().join(name).with_extension("vdb");
        before = Some((second, volume));
    }
}

#[cfg(feature = "openvdb")]
#[test]
fn a_volume_is_fitted_into_the_place_of_the_scenes_own() {
    let [one, other] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let volume = one.path().join("far \"away\".vdb");
    // A block of 100 × 200 × 100 units far from the origin, of a density of 5, without a temperature.
    let mut writer = openvdb::VdbWriter::new().expect("a writer");
    writer.fog_grid("smoke", openvdb::Precision::Half, 0.0, 10.0, [5000.0, -3000.0, 7000.0]).expect("a grid");
    writer.dense([0; 3], [10, 20, 10], 0.0, |_, _, _| 5.0).expect("voxels");
    writer.write(&volume, openvdb::Compression::Zip).expect("written");
    let output = write_around("explosion", &volume, other.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let scene = other.path().join("explosion.pbrt");
    assert_eq!(rendered_lights(&scene), "3");
    assert!(!is_black(&scene.with_extension("exr")));
    let text = std::fs::read_to_string(&scene).expect("text");
    assert!(text.contains(r#""string density" "smoke" "float densityscale" 0.2"#));
    // The box is 13 × 10.5 × 11; with the reach of its outer voxels the block is 110 × 210 × 110, so it is made 0.05 as large.
    assert!(text.contains(" Scale 0.05 0.05 0.05\n"), "{text}");
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
