//! What goes wrong on farms: disks that are full, folders that are read-only, files that vanish, memory that runs out, processes that are killed. Whatever it is, an
//! earlier image of the same name stays as it was, and nothing else is left behind.

use std::process::Command;

use crate::program::{Folder, LAMP, Run};

/// The lamp's scene, in more pixels.
fn lamp(width: u32, height: u32) -> String {
    let size = format!("\"integer xresolution\" {width} \"integer yresolution\" {height}");
    LAMP.replace("\"integer xresolution\" 16 \"integer yresolution\" 12", &size)
}

/// How a process gets a file system of its own to mount things in, if it can here.
fn unshared() -> Option<&'static str> {
    let works = |how: &str| {
        let script = format!("{how} sh -c 'mount -t tmpfs -o size=64k tmpfs /mnt'");
        Command::new("sh").args(["-c", &script]).output().is_ok_and(|output| output.status.success())
    };
    let found = ["unshare -m", "unshare -Urm"].into_iter().find(|how| works(how));
    if found.is_none() {
        println!("skipped: nothing can be mounted here");
    }
    found
}

/// Runs the program where `prepare` has mounted something on the folder `place`. What is there when it has ended comes to `after`.
fn run_mounted(folder: &Folder, prepare: &str, arguments: &[&str]) -> Option<Run> {
    let how = unshared()?;
    std::fs::create_dir_all(folder.path("place")).expect("a folder");
    std::fs::create_dir_all(folder.path("after")).expect("a folder");
    let inner = format!("{prepare} || exit 99; \"$@\"; code=$?; cp -a place/. after; exit $code");
    let script = format!("exec {how} sh -c '{inner}' sh \"$@\"");
    Some(folder.start_by(&script, arguments).end())
}

/// A disk of so many KiB with these files of the folder on it.
fn small_disk(kib: u32, files: &str) -> String {
    format!("mount -t tmpfs -o size={kib}k tmpfs place && cp {files} place")
}

/// Names in the folder `after`.
fn after(folder: &Folder) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path("after")).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A full disk for each kind of file: exit code 1, the file is named and why, and what was there before is there still.
#[test]
fn full_disks_are_told_and_leave_what_was_there() {
    let folder = Folder::new("full");
    folder.write("s.pbrt", lamp(160, 120));
    for file in ["out.exr", "out.png", "s.json"] {
        folder.write(file, format!("the {file} of before"));
    }
    let cases = [
        ("out.exr", &["-o", "place/out.exr", "--checkpoint", "off"][..]),
        ("out.png", &["-o", "a.exr", "--png", "place/out.png"]),
        ("s.json", &["-o", "a.exr", "--stats", "place/s.json"]),
    ];
    for (file, arguments) in cases {
        let arguments = [&["render", "s.pbrt", "--spp", "1", "--quiet"], arguments].concat();
        let Some(run) = run_mounted(&folder, &small_disk(8, file), &arguments) else { return };
        run.code(1).says(&format!("cannot write place/{file}")).says("No space left");
        assert_eq!(after(&folder), [file], "{file}");
        assert_eq!(folder.read(&format!("after/{file}")), folder.read(file), "{file}");
        std::fs::remove_file(folder.path(&format!("after/{file}"))).expect("it is there");
    }
}

/// A checkpoint that does not fit is warned of, the render goes on, and the checkpoint of before stays.
#[test]
fn a_checkpoint_that_does_not_fit_ends_no_render() {
    let folder = Folder::new("full-checkpoint");
    folder.write("s.pbrt", lamp(96, 72)).write("out.exr.checkpoint", "the checkpoint of before");
    let render = ["render", "s.pbrt", "-o", "place/out.exr", "--checkpoint", "1i"];
    folder.run(&["render", "s.pbrt", "-o", "a.exr", "--spp", "4", "--checkpoint", "off"]).code(0);
    // Room for the image, but not for what it is made of.
    let kib = u32::try_from(folder.listing()["a.exr"] / 1024 + 40).expect("a small file");
    let disk = small_disk(kib, "out.exr.checkpoint");
    let Some(run) = run_mounted(&folder, &disk, &[&render[..], &["--spp", "4"]].concat()) else { return };
    run.code(0).says("warning: cannot write place/out.exr.checkpoint").says("No space left").says("4 spp in");
    let stopped = [&render[..], &["--spp", "100000", "--exit-at", "300ms"]].concat();
    let run = run_mounted(&folder, &disk, &stopped).expect("it could be mounted");
    let run = run.code(130).says("warning: cannot write place/out.exr.checkpoint");
    assert!(!run.err.contains("--resume"), "{}", run.err);
    assert_eq!(after(&folder), ["out.exr", "out.exr.checkpoint"]);
    assert_eq!(folder.read("after/out.exr.checkpoint"), folder.read("out.exr.checkpoint"));
}

/// A folder that may not be written to is known before anything is rendered.
#[test]
fn read_only_folders_are_refused_at_once() {
    let folder = Folder::new("read-only");
    folder.write("s.pbrt", lamp(16, 12));
    std::fs::create_dir_all(folder.path("place")).expect("a folder");
    folder.write("place/out.exr", "the image of before");
    let bind = "mount --bind place place && mount -o remount,ro,bind place";
    let render = ["render", "s.pbrt", "--spp", "100000000"];
    for (file, arguments) in [
        ("out.exr", &["-o", "place/out.exr"][..]),
        ("out.png", &["-o", "a.exr", "--png", "place/out.png"]),
        ("s.json", &["-o", "a.exr", "--stats", "place/s.json"]),
    ] {
        let Some(run) = run_mounted(&folder, bind, &[&render[..], arguments].concat()) else { return };
        run.code(1).says(&format!("cannot write place/{file}")).says("Read-only");
        assert_eq!(after(&folder), ["out.exr"]);
        assert_eq!(folder.read("after/out.exr"), b"the image of before");
    }
    assert!(!folder.listing().contains_key("a.exr"));
}

/// Memory that runs out, by the system's limit and by the program's own: exit code 4, and the image of before stays.
#[test]
fn memory_that_runs_out_leaves_what_was_there() {
    let folder = Folder::new("exhausted");
    folder.write("s.pbrt", lamp(4000, 3000)).write("out.exr", "the image of before");
    let render = ["render", "s.pbrt", "-o", "out.exr"];
    folder.start_within(&render, 1 << 20, 10).end().code(4).says("4000 × 3000 pixels takes about").says("--crop");
    let limited = [&render[..], &["--memory-limit", "1GB"]].concat();
    folder.run(&limited).code(4).says("4000 × 3000 pixels takes about").says("--memory-limit is");
    assert_eq!(folder.listing().keys().collect::<Vec<_>>(), ["out.exr", "s.pbrt"]);
    assert_eq!(folder.read("out.exr"), b"the image of before");
}

/// What a process that was killed while writing left is gone once the same file is written again.
#[test]
fn what_killed_renders_left_goes() {
    let folder = Folder::new("killed-writing");
    folder.write("s.pbrt", lamp(400, 300));
    let render = ["render", "s.pbrt", "-o", "out.exr", "--checkpoint", "1i", "--quiet"];
    let hidden = || folder.listing().into_keys().filter(|name| name.starts_with('.')).collect::<Vec<_>>();
    for tries in 0.. {
        let running = folder.start(&[&render[..], &["--spp", "4000"]].concat());
        let start = std::time::Instant::now();
        while hidden().is_empty() || !folder.listing().contains_key("out.exr.checkpoint") {
            assert!(start.elapsed().as_secs() < 60, "nothing is written: {}", running.errors());
            std::thread::yield_now();
        }
        assert!(running.signal("KILL"));
        running.end();
        if hidden().len() == 1 {
            break;
        }
        // It was quicker than its end.
        assert!(tries < 50 && hidden().is_empty(), "{:?}", hidden());
    }
    let [left] = hidden().try_into().expect("one file");
    assert!(left.starts_with(".lanternfish-out.exr"), "{left}");
    folder.run(&[&render[..], &["--spp", "2"]].concat()).code(0);
    assert_eq!(folder.listing().keys().collect::<Vec<_>>(), ["out.exr", "s.pbrt"]);
}

#[cfg(feature = "openvdb")]
mod files_that_vanish {
    use super::*;

    /// A scene with a texture and a volume, and a script in place of the program that reads volumes, which first does something to the files. By then the scene, and the
    /// beginning of the texture, have been read.
    fn scene(name: &str, deed: &str) -> (Folder, String) {
        let folder = Folder::new(name);
        folder.run(&["scene", "torch", "--out", "."]).code(0);
        let listing = folder.listing();
        let volume = listing.keys().find(|name| name.ends_with(".vdb")).expect("a volume").clone();
        for name in listing.keys().filter(|name| **name != volume) {
            std::fs::remove_file(folder.path(name)).expect("it is there");
        }
        let image = image::RgbImage::from_fn(300, 200, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
        image.save(folder.path("wall.png")).expect("the image can be written");
        let text = lamp(16, 12)
            + &format!("MakeNamedMedium \"v\" \"string type\" \"openvdb\" \"string filename\" \"{volume}\"\n")
            + "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wall.png\"\n\
               AttributeBegin Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\" \"float radius\" 0.6 AttributeEnd\n\
               AttributeBegin Material \"interface\" MediumInterface \"v\" \"\" Shape \"sphere\" \"float radius\" 1.5 AttributeEnd\n";
        folder.write("s.pbrt", text).write("out.exr", "the image of before");
        let reader = std::path::Path::new(env!("CARGO_BIN_EXE_lanternfish-vdb")).display();
        let deed = deed.replace("VOLUME", &volume);
        folder.write("reader", format!("#!/bin/sh\n{deed}\nexec {reader} \"$@\"\n"));
        Command::new("chmod").arg("+x").arg(folder.path("reader")).status().expect("chmod is there");
        let script = format!("export LANTERNFISH_VDB='{}'; exec \"$@\"", folder.path("reader").display());
        (folder, script)
    }

    const RENDER: [&str; 5] = ["render", "s.pbrt", "-o", "out.exr", "--spp=4"];

    fn refused(folder: &Folder, script: &str, more: &[&str]) -> Run {
        let run = folder.start_by(script, &[&RENDER[..], more].concat()).end();
        let hidden = folder.listing().into_keys().filter(|name| name.starts_with('.')).count();
        assert_eq!((folder.read("out.exr"), hidden), (b"the image of before".to_vec(), 0), "{}", run.err);
        run
    }

    /// As one that was never there: the image has magenta, with a warning, and `--strict` ends with 3.
    #[test]
    fn a_texture() {
        for memory in ["1GiB", "1kB"] {
            let (folder, script) = scene("vanished-texture", "rm -f wall.png");
            let more = ["--texture-memory", memory];
            refused(&folder, &script, &[&more[..], &["--strict"]].concat()).code(3).says("wall.png");
            let image = image::RgbImage::from_pixel(300, 200, image::Rgb([9, 99, 9]));
            image.save(folder.path("wall.png")).expect("the image can be written");
            let run = folder.start_by(&script, &[&RENDER[..], &more].concat()).end().code(0);
            let run = run.says("warning: s.pbrt:").says("cannot read wall.png").says("magenta").says(", 1 warning");
            assert_eq!(run.err.matches("wall.png").count(), 1, "{}", run.err);
        }
    }

    #[test]
    fn a_volume() {
        let (folder, script) = scene("vanished-volume", "mv VOLUME gone");
        refused(&folder, &script, &[]).code(3).says("cannot read").says(".vdb").says("s.pbrt:");
    }

    #[test]
    fn half_a_volume() {
        let (folder, script) = scene("half-volume", "head -c 20000 VOLUME > half; mv half VOLUME");
        refused(&folder, &script, &[]).code(3).says("cannot read").says(".vdb").says("s.pbrt:");
    }

    /// The reader's own memory is limited as well.
    #[test]
    fn a_volume_that_does_not_fit() {
        let (folder, script) = scene("large-volume", "");
        refused(&folder, &script, &["--memory-limit", "25MB"]).code(4).says("--memory-limit");
        folder.start_by(&script, &[&RENDER[..], &["--memory-limit", "300MB"]].concat()).end().code(0);
    }
}
