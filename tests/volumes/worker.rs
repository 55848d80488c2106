//! OpenVDB lives in the program `lanternfish-vdb` alone, and where that is missing, `lanternfish` says so.

#![cfg(all(feature = "openvdb", target_os = "linux"))]

use std::path::{Path, PathBuf};
use std::process::Command;

use openvdb::{Compression, Precision, VdbWriter, WORKER_NAME, WORKER_VARIABLE, set_worker};

const PROGRAM: &str = env!("CARGO_BIN_EXE_lanternfish");
const WORKER: &str = env!("CARGO_BIN_EXE_lanternfish-vdb");

/// Whether the executable names a shared library whose name begins so.
fn needs(program: &str, library: &str) -> bool {
    let bytes = std::fs::read(program).expect("the program was built");
    bytes.windows(library.len()).any(|window| window == library.as_bytes())
}

#[test]
fn lanternfish_does_not_link_openvdb() {
    assert!(needs(WORKER, "libopenvdb.so"), "the test looks in the right way");
    for library in ["libopenvdb.so", "libImath", "libboost"] {
        assert!(!needs(PROGRAM, library), "{library}");
    }
}

fn write_fog(folder: &Path) -> PathBuf {
    set_worker(WORKER);
    let path = folder.join("fog.vdb");
    let mut writer = VdbWriter::new().expect("a writer");
    writer.fog_grid("density", Precision::Single, 0.0, 0.5, [0.0; 3]).expect("a grid");
    writer.dense([0; 3], [8; 3], 0.0, |_, _, _| 1.0).expect("voxels");
    writer.write(&path, Compression::Zip).expect("written");
    path
}

/// Runs the program `program`; its exit code, and what it says, in words one space apart.
fn run(program: &Path, arguments: &[&Path], worker: Option<&str>) -> (Option<i32>, String) {
    let mut command = Command::new(program);
    command.args(arguments).env_remove(WORKER_VARIABLE).envs(worker.map(|path| (WORKER_VARIABLE, path)));
    let output = command.output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    (output.status.code(), text)
}

#[test]
fn a_missing_worker_is_named_and_not_the_files_fault() {
    let folder = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    let alone = folder.path().join("lanternfish");
    std::fs::hard_link(PROGRAM, &alone).or_else(|_| std::fs::copy(PROGRAM, &alone).map(drop)).expect("copied");
    let fog = write_fog(folder.path());
    let scene = folder.path().join("fog.pbrt");
    let medium = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\n\
                  MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"fog.vdb\"\n\
                  Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\"\n";
    std::fs::write(&scene, medium).expect("written");
    let image = folder.path().join("fog.exr");
    let (info, render, make) = (Path::new("info"), Path::new("render"), Path::new("scene"));
    for arguments in [
        &[info, &fog][..],
        &[info, &scene],
        &[render, &scene, Path::new("-o"), &image],
        &[make, Path::new("pier"), Path::new("--out"), &folder.path().join("pier")],
    ] {
        let (code, text) = run(&alone, arguments, None);
        assert_eq!(code, Some(1), "{arguments:?}: {text}");
        for part in [WORKER_NAME, WORKER_VARIABLE, &folder.path().display().to_string()] {
            assert!(text.contains(part), "{arguments:?} does not say {part}: {text}");
        }
    }
    let (code, text) = run(&alone, &[info, &fog], Some("/nowhere/reader"));
    assert!(code == Some(1) && text.contains("/nowhere/reader"), "{text}");
    let (code, text) = run(&alone, &[info, &fog], Some("/bin/true"));
    assert!(code == Some(1) && text.contains("/bin/true"), "{text}");
    let (code, text) = run(&alone, &[info, &fog], Some(WORKER));
    assert_eq!(code, Some(0), "{text}");
    // A damaged file is the file's fault.
    std::fs::write(&fog, &std::fs::read(&fog).expect("there")[..100]).expect("written");
    let (code, text) = run(Path::new(PROGRAM), &[info, &fog], None);
    assert!(code == Some(3) && text.contains("damaged"), "{text}");
}
