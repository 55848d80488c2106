//! The program as its users meet it: every flag of every command through the built program, exit codes, what is written and
//! what is left alone.

use std::time::{Duration, Instant};

use crate::program::{Folder, HEAD, LAMP, Running};

fn lamp(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("lamp.pbrt", LAMP);
    folder
}

/// `info --json` of a file.
fn info(folder: &Folder, file: &str) -> serde_json::Value {
    serde_json::from_str(&folder.run(&["info", file, "--json"]).code(0).out).expect("JSON")
}

fn names(folder: &Folder) -> Vec<String> {
    folder.listing().into_keys().collect()
}

#[test]
fn render_alone_takes_name_and_samples_from_the_file() {
    let folder = lamp("alone");
    folder.run(&["render", "lamp.pbrt"]).code(0).says("4 spp");
    assert_eq!(names(&folder), ["lamp.exr", "lamp.pbrt"]);
    folder.write("named.pbrt", LAMP.replace("Film \"rgb\"", "Film \"rgb\" \"string filename\" \"picture.png\""));
    folder.run(&["render", "named.pbrt", "--png"]).code(0);
    assert_eq!(names(&folder), ["lamp.exr", "lamp.pbrt", "named.pbrt", "picture.exr", "picture.png"]);
    // The same image, wherever it goes.
    folder.run(&["render", "lamp.pbrt", "-o", "other.exr", "--png", "small.png", "--quiet"]).code(0);
    let same = folder.run(&["compare", "other.exr", "lamp.exr", "--json"]).code(0).out;
    let same: serde_json::Value = serde_json::from_str(&same).expect("JSON");
    assert_eq!(same["rmse"], 0.0, "{same}");
    assert!(folder.read("small.png").starts_with(b"\x89PNG"));
}

#[test]
fn quiet_says_nothing() {
    let folder = lamp("quiet");
    let run = folder.run(&["render", "lamp.pbrt", "--quiet", "--stats", "s.json"]).code(0);
    assert_eq!((run.out.as_str(), run.err.as_str()), ("", ""));
    // Errors it does say.
    assert!(folder.run(&["render", "gone.pbrt", "--quiet"]).code(3).err.contains("gone.pbrt"));
}

#[test]
fn wrong_usage_ends_with_2() {
    let folder = lamp("usage");
    for arguments in [
        &["render"][..],
        &["nonsense"],
        &[],
        &["render", "lamp.pbrt", "--spp", "2", "--time", "1"],
        &["render", "lamp.pbrt", "--spp", "2", "--error", "0.1"],
        &["render", "lamp.pbrt", "--time", "1", "--error", "0.1"],
        &["render", "lamp.pbrt", "--spp", "0"],
        &["render", "lamp.pbrt", "--spp", "2147483648"],
        &["render", "lamp.pbrt", "--spp", "-1"],
        &["render", "lamp.pbrt", "--time", "0"],
        &["render", "lamp.pbrt", "--error", "nan"],
        &["render", "lamp.pbrt", "--lights", "some"],
        &["render", "lamp.pbrt", "--backend", "magic"],
        &["render", "lamp.pbrt", "--resolution", "0x5"],
        &["render", "lamp.pbrt", "--resolution", "5"],
        &["render", "lamp.pbrt", "--crop", "0.5,0.5,0,1"],
        &["render", "lamp.pbrt", "--crop", "0,2,0,1"],
        &["render", "lamp.pbrt", "--threads", "0"],
        &["render", "lamp.pbrt", "--max-depth", "-1"],
        &["compare", "lamp.pbrt"],
        &["info"],
    ] {
        let run = folder.run(arguments).code(2);
        assert!(!run.err.is_empty(), "{arguments:?}");
    }
    assert_eq!(names(&folder), ["lamp.pbrt"]);
    assert!(folder.run(&["--help"]).code(0).out.contains("130 interrupted"));
    assert!(folder.run(&["--version"]).code(0).out.contains(env!("CARGO_PKG_VERSION")));
    if cfg!(not(feature = "embree")) {
        folder.run(&["render", "lamp.pbrt", "--backend", "embree"]).code(2).says("cargo feature \"embree\"");
    }
}

#[test]
fn statistics_tell_what_was_done() {
    let folder = lamp("statistics");
    let odd = LAMP.replace("\"float fov\" 40", "\"float fov\" 40 \"float odd\" 1");
    folder.write("odd.pbrt", odd);
    folder.run(&["render", "odd.pbrt", "--stats", "s.json", "--spp", "8", "--seed", "7", "--threads", "2"]).code(0);
    let stats = folder.json("s.json");
    for name in [
        "parse",
        "volumes_and_textures",
        "geometry_load",
        "geometry_build",
        "lights",
        "first_sample",
        "render",
        "write",
    ] {
        assert!(stats["seconds"][name].as_f64().is_some_and(|s| s >= 0.0), "{name}: {stats}");
    }
    let count = |name: &str| stats["counters"][name].as_u64().unwrap_or_else(|| panic!("{name}: {stats}"));
    assert_eq!(count("paths"), 16 * 12 * 8);
    assert!(count("closest_rays") >= count("paths") && count("shadow_rays") > 0);
    assert_eq!(count("flight_steps") + count("transmittance_steps") + count("boundary_rays"), 0);
    assert_eq!((stats["seed"].as_u64(), stats["threads"].as_u64()), (Some(7), Some(2)));
    assert_eq!(stats["samples_per_pixel"], 8);
    let seconds = |name: &str| stats[name].as_f64().unwrap_or_else(|| panic!("{name}: {stats}"));
    assert!((0.0..=seconds("cpu_seconds")).contains(&seconds("cpu_seconds_rendering")), "{stats}");
    assert!(stats["peak_memory"].as_u64().is_some_and(|bytes| bytes > 1 << 20));
    assert!(stats["plan"]["systems"].as_array().is_some_and(|systems| systems.len() > 8));
    let warnings = stats["warnings"].to_string();
    assert!(warnings.contains("odd.pbrt:2:") && warnings.contains("\\\"odd\\\""), "{warnings}");
}

#[test]
fn settings_reach_the_image() {
    let folder = lamp("settings");
    let backends: &[&str] = if cfg!(feature = "embree") { &["embree", "native"] } else { &["native"] };
    for backend in backends {
        folder.run(&["render", "lamp.pbrt", "-q", "-o", &format!("{backend}.exr"), "--backend", backend]).code(0);
        assert!(info(&folder, &format!("{backend}.exr")).to_string().contains(backend));
    }
    for lights in ["auto", "uniform", "power", "optimal"] {
        folder.run(&["render", "lamp.pbrt", "-q", "--lights", lights]).code(0);
    }
    let rmse = |a: &str, b: &str| {
        let out = folder.run(&["compare", a, b, "--json"]).code(0).out;
        serde_json::from_str::<serde_json::Value>(&out).expect("JSON")["rmse"].as_f64().expect("a number")
    };
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "seed.exr", "--seed", "5"]).code(0);
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "deep.exr", "--max-depth", "1"]).code(0);
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "one.exr", "--threads", "1"]).code(0);
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "three.exr", "--threads", "3"]).code(0);
    assert!(rmse("lamp.exr", "seed.exr") > 0.0, "another seed, another noise");
    assert!(rmse("lamp.exr", "deep.exr") > 0.0, "indirect light is left out");
    assert_eq!(rmse("one.exr", "three.exr"), 0.0, "threads make no difference");

    folder
        .run(&["render", "lamp.pbrt", "-q", "-o", "crop.exr", "--resolution", "40x20", "--crop", "0.25,0.5,0,1"])
        .code(0);
    let image = lanternfish::film::exr::read_exr_layers(&folder.path("crop.exr")).expect("an image");
    let bounds = image.bounds;
    assert_eq!([bounds.x0, bounds.x1, bounds.y0, bounds.y1], [10, 20, 0, 20]);
    assert_eq!([image.display.x1, image.display.y1], [40, 20]);
}

#[test]
fn time_and_error_end_a_render() {
    let folder = lamp("budgets");
    folder.run(&["render", "lamp.pbrt", "--time", "0.2", "--stats", "t.json"]).code(0);
    let stats = folder.json("t.json");
    assert!(stats["samples_per_pixel"].as_u64().is_some_and(|n| n > 4), "{stats}");
    folder.run(&["render", "lamp.pbrt", "--error", "0.1", "--stats", "e.json"]).code(0);
    let stats = folder.json("e.json");
    assert!(stats["error"].as_f64().is_some_and(|e| e > 0.0 && e <= 0.1), "{stats}");
}

#[test]
fn headers_say_where_an_image_comes_from() {
    let folder = lamp("headers");
    folder.run(&["render", "lamp.pbrt", "-q", "--seed", "3"]).code(0);
    let image = lanternfish::film::exr::read_exr_layers(&folder.path("lamp.exr")).expect("an image");
    let attribute = |name: &str| {
        let found = image.attributes.iter().find(|(n, _)| n == &format!("lanternfish.{name}"));
        found.unwrap_or_else(|| panic!("no {name} in {:?}", image.attributes)).1.clone()
    };
    assert!(attribute("command").ends_with("render lamp.pbrt -q --seed 3"));
    assert_eq!(attribute("seed"), "3");
    assert_eq!(attribute("version"), env!("CARGO_PKG_VERSION"));
    assert!(attribute("plan").starts_with("geometry, lights, view rays, film; without "));
    assert!(attribute("seconds").contains("geometry_build"));
    assert!(attribute("scene").contains("lamp.pbrt"));
    assert!(folder.run(&["info", "lamp.exr"]).code(0).out.contains("lanternfish.seed"));
}

#[test]
fn info_tells_the_plan() {
    let folder = lamp("info");
    let plan = info(&folder, "lamp.pbrt");
    let systems = plan["plan"]["systems"].as_array().expect("a list").clone();
    let built = |name: &str| {
        let system = systems.iter().find(|s| s["name"] == name).unwrap_or_else(|| panic!("no {name} in {plan}"));
        assert!(system["reason"].as_str().is_some_and(|r| !r.is_empty()));
        system["built"].as_bool().expect("a truth value")
    };
    for name in ["geometry", "lights", "film"] {
        assert!(built(name), "{name}");
    }
    for name in ["media", "textures", "motion blur", "opacity", "light selection", "volume reader", "instances"] {
        assert!(!built(name), "{name}");
    }
    assert_eq!(plan["samples_per_pixel"], 4);
    assert!(plan["memory_bytes"].as_u64().is_some_and(|b| b > 0));
    let text = folder.run(&["info", "lamp.pbrt"]).code(0).out;
    assert!(text.contains("leave out media") && text.contains("the scene has no media"), "{text}");
    assert_eq!(names(&folder), ["lamp.pbrt"], "info writes nothing");
}

#[test]
fn compare_measures_and_draws() {
    let folder = lamp("compare");
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "a.exr", "--seed", "1"]).code(0);
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "b.exr", "--seed", "2"]).code(0);
    let text = folder.run(&["compare", "a.exr", "b.exr", "--png", "difference.png"]).code(0).out.to_lowercase();
    assert!(text.contains("rmse") && text.contains("bias"), "{text}");
    assert!(folder.read("difference.png").starts_with(b"\x89PNG"));
    folder.run(&["compare", "a.exr", "lamp.pbrt"]).code(3).says("lamp.pbrt");
    folder.run(&["compare", "a.exr", "b.exr", "--png", "nowhere/d.png"]).code(1).says("nowhere");
    folder.run(&["render", "lamp.pbrt", "-q", "-o", "c.exr", "--resolution", "8x8"]).code(0);
    folder.run(&["compare", "a.exr", "c.exr"]).code(3);
}

#[test]
fn failures_leave_what_is_there_alone() {
    let folder = lamp("failures");
    folder.write("lamp.exr", "precious").write("lamp.png", "precious");
    let before = folder.listing();
    // 1: no such folder, a folder in the way. Known before anything is rendered.
    folder.run(&["render", "lamp.pbrt", "-o", "nowhere/out.exr"]).code(1).says("nowhere/out.exr");
    folder.run(&["render", "lamp.pbrt", "--png", "nowhere/out.png"]).code(1).says("nowhere/out.png");
    folder.run(&["render", "lamp.pbrt", "--stats", "nowhere/out.json"]).code(1).says("nowhere/out.json");
    folder.run(&["render", "lamp.pbrt", "-o", "."]).code(1).says("folder");
    folder.run(&["render", "lamp.pbrt", "-o", "lamp.png"]).code(2).says(".exr");
    folder.run(&["render", "lamp.pbrt", "-o", "gone/a.exr"]).code(1).says("there is no folder gone");
    // 3: bad input.
    folder.write("lamp.pbrt", LAMP.replace("WorldBegin", "WorldBegin\nNonsense"));
    folder.run(&["render", "lamp.pbrt", "--png"]).code(3).says("lamp.pbrt:6:1");
    folder.write("lamp.pbrt", LAMP);
    // 4: limits.
    folder.run(&["render", "lamp.pbrt", "--png", "--resolution", "100000x100000"]).code(4).says("pixels");
    let run = folder.start_within(&["render", "lamp.pbrt", "--png", "--resolution", "16000x16000"], 4 << 20, 10).end();
    run.code(4).says("memory");
    assert_eq!(folder.listing(), before);
    assert_eq!(folder.read("lamp.exr"), b"precious");
}

/// Starts a render that would take hours and waits until it is rendering.
fn endless(folder: &Folder) -> Running {
    let running = folder.start(&["render", "lamp.pbrt", "--spp", "100000000", "--threads", "1", "--png"]);
    let start = Instant::now();
    while !running.errors().contains("rendering") {
        assert!(start.elapsed() < Duration::from_secs(60), "it does not start: {}", running.errors());
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    running
}

#[test]
fn an_interrupted_render_writes_what_it_has() {
    let folder = lamp("interrupted");
    let running = endless(&folder);
    assert!(running.interrupt());
    running.end().code(130).says("interrupted");
    assert_eq!(names(&folder), ["lamp.exr", "lamp.exr.checkpoint", "lamp.pbrt", "lamp.png"]);
    let image = lanternfish::film::exr::read_exr_layers(&folder.path("lamp.exr")).expect("a whole image");
    assert!(image.channel("samples").expect("counts").iter().all(|&n| n >= 1.0));
    assert!(image.attributes.iter().any(|(name, _)| name == "lanternfish.interrupted"));
}

#[test]
fn a_second_interrupt_ends_at_once() {
    let folder = lamp("twice");
    folder.write("lamp.exr", "precious");
    let running = endless(&folder);
    let start = Instant::now();
    assert!(running.interrupt());
    // It may be over by now.
    running.interrupt();
    let run = running.end();
    assert_eq!(run.code, Some(130), "{}", run.err);
    assert!(start.elapsed() < Duration::from_secs(20), "it took {:?}", start.elapsed());
    assert!(names(&folder).iter().all(|name| !name.starts_with(".lanternfish")), "left behind: {:?}", names(&folder));
    // Either it was quick enough to write the image, whole, or the old one is there.
    if folder.read("lamp.exr") != b"precious" {
        lanternfish::film::exr::read_exr_layers(&folder.path("lamp.exr")).expect("a whole image");
    }
}

/// Requests to end it are heard, whoever has stopped listening to it.
#[test]
fn a_closed_error_output_keeps_nothing_alive() {
    let folder = lamp("closed");
    // `false` closes its end of the pipe at once; what is written from then on fails.
    let script = format!(
        "{{ {0} render lamp.pbrt --spp 100000000 --threads 1 & echo $! >pid; wait $!; echo $? >code; }} 2>&1 | false",
        crate::program::PROGRAM
    );
    let mut shell =
        std::process::Command::new("sh").args(["-c", &script]).current_dir(folder.path("")).spawn().expect("a shell");
    let start = Instant::now();
    let number = loop {
        let pid = std::fs::read_to_string(folder.path("pid")).unwrap_or_default();
        if pid.ends_with('\n') {
            break pid;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "it does not start");
        std::thread::sleep(Duration::from_millis(5));
    };
    // It listens once it catches SIGTERM.
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", number.trim())).unwrap_or_default();
        let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok());
        mask.is_some_and(|mask| mask >> 14 & 1 == 1)
    };
    while !listens() {
        assert!(start.elapsed() < Duration::from_secs(60), "it does not listen");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    let kill =
        |signal: &str| std::process::Command::new("sh").args(["-c", &format!("kill -{signal} {number}")]).status();
    assert!(kill("TERM").expect("sh is there").success());
    while shell.try_wait().expect("it can be waited for").is_none() || !folder.path("code").exists() {
        if start.elapsed() > Duration::from_secs(60) {
            let _ = kill("KILL");
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(folder.read("code"), b"130\n");
}

/// One lamp and a floor: what comes on top of loading the geometry until the first samples are there. The least of several
/// runs, because other programs' work counts in the others.
#[test]
fn the_first_sample_comes_quickly() {
    let folder = lamp("startup");
    let least = (0..5)
        .map(|_| {
            folder.run(&["render", "lamp.pbrt", "-q", "--stats", "s.json"]).code(0);
            let stats = folder.json("s.json");
            let seconds = |name: &str| stats["seconds"][name].as_f64().expect("a number");
            seconds("parse")
                + seconds("volumes_and_textures")
                + seconds("geometry_build")
                + seconds("lights")
                + seconds("first_sample")
        })
        .fold(f64::INFINITY, f64::min);
    assert!(least < 0.030, "{:.1} ms", least * 1e3);
}

#[test]
fn strict_makes_doubt_an_error() {
    let folder = lamp("strict");
    let texture = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"gone.png\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"\n";
    folder.write("doubt.pbrt", format!("{HEAD}{texture}"));
    folder.run(&["render", "doubt.pbrt"]).code(0).says("gone.png");
    folder.run(&["render", "doubt.pbrt", "--strict"]).code(3).says("gone.png");
}

#[cfg(not(feature = "openvdb"))]
#[test]
fn what_was_left_out_is_named() {
    let folder = lamp("left-out");
    let medium = "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"fog.vdb\"\nMaterial \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\"\n";
    folder.write("fog.vdb", [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0]).write("fog.pbrt", format!("{HEAD}{medium}"));
    folder.run(&["render", "fog.pbrt"]).code(3).says("openvdb");
    folder.run(&["info", "fog.vdb"]).code(3).says("openvdb");
}

#[cfg(feature = "openvdb")]
#[test]
fn info_of_a_volume() {
    use openvdb::{Compression, Precision, VdbWriter};
    let folder = lamp("volume");
    let mut writer = VdbWriter::new().expect("a writer");
    writer.fog_grid("density", Precision::Single, 0.0, 0.5, [0.0; 3]).expect("a grid");
    writer.dense([0; 3], [8; 3], 0.0, |x, _, _| 1.0 + x as f32).expect("voxels");
    writer.write(&folder.path("fog.vdb"), Compression::Zip).expect("a file");
    let file = info(&folder, "fog.vdb");
    assert_eq!(file["grids"][0]["name"], "density");
    assert_eq!(file["grids"][0]["active_voxels"], 512);
    assert!(folder.run(&["info", "fog.vdb"]).code(0).out.contains("512 active voxels"));
}

#[test]
fn info_of_a_nanovdb_file() {
    let folder = Folder::new("nanovdb-info");
    let data = |name: &str| {
        std::fs::read(format!("{}/tests/data/nanovdb/{name}", env!("CARGO_MANIFEST_DIR"))).expect("it is there")
    };
    folder.write("fog.nvdb", data("density-fp8.nvdb")).write("three.NVDB", data("grids-zip.nvdb"));
    let fog = info(&folder, "fog.nvdb");
    let grid = &fog["grids"][0];
    assert_eq!(
        (&grid["name"], &grid["value_type"], &grid["class"]),
        (&"density".into(), &"fp8".into(), &"fog volume".into())
    );
    assert_eq!(grid["active_voxels"], 7153);
    assert_eq!(grid["bounds"], serde_json::json!([[-9, -19, -12], [15, 5, 12]]));
    assert_eq!((&grid["voxel_size"][1], &grid["range"][1], &grid["loads"]), (&0.5.into(), &1.0.into(), &true.into()));
    let three = folder.run(&["info", "three.NVDB"]).code(0).out;
    for part in ["density[0]", "shell[0]", "temperature[0]", "level set, converted", "values 0 to 1, 0 bad"] {
        assert!(three.contains(part), "{part}: {three}");
    }
    folder.write("cut.nvdb", &data("density-fp8.nvdb")[..3000]);
    folder.run(&["info", "cut.nvdb"]).code(3).says("cut.nvdb");
}

#[test]
fn two_things_never_go_to_one_file() {
    let folder = lamp("overlap");
    for arguments in [
        &["render", "lamp.pbrt", "-o", "lamp.pbrt"][..],
        &["render", "lamp.pbrt", "-o", "o.exr", "--png", "o.exr"],
        &["render", "lamp.pbrt", "-o", "o.exr", "--png", "./o.exr"],
        &["render", "lamp.pbrt", "--png", "p.png", "--stats", "p.png"],
        &["render", "lamp.pbrt", "--stats", "./lamp.pbrt"],
    ] {
        folder.run(arguments).code(2).says("asked for twice");
        assert_eq!(folder.read("lamp.pbrt"), LAMP.as_bytes(), "{arguments:?}");
    }
    assert_eq!(names(&folder), ["lamp.pbrt"]);
}

/// Whatever a scene names in whatever way is not written over.
#[test]
fn what_a_scene_names_is_never_written_over() {
    let folder = Folder::new("named");
    image::RgbImage::from_pixel(2, 2, image::Rgb([128, 128, 255])).save(folder.path("map.png")).expect("written");
    let ies = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 50\n0 90\n0\n100 50\n";
    folder.write("a.ies", ies).write("lens.dat", "100 10 1.5 20\n-100 5 1 20\n0 80 0 8\n");
    // What photometric files name in turn, and spectra, too.
    folder
        .write("tilted.ies", ies.replace("NONE", "tilt.txt"))
        .write("tilt.txt", "1 2\n0 90\n1 .5\n")
        .write("s.spd", "400 1 700 2\n");
    for (name, text) in [
        ("tilt.txt", "LightSource \"point\" \"string ies\" \"tilted.ies\"\nShape \"sphere\""),
        ("s.spd", "LightSource \"point\" \"spectrum I\" \"s.spd\"\nShape \"sphere\""),
        ("map.png", "Material \"diffuse\" \"string normalmap\" \"map.png\"\nShape \"sphere\""),
        ("map.png", "LightSource \"goniometric\" \"string filename\" \"map.png\"\nShape \"sphere\""),
        ("a.ies", "LightSource \"point\" \"string ies\" \"a.ies\"\nShape \"sphere\""),
    ] {
        let before = folder.read(name);
        folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
        folder.run(&["render", "scene.pbrt", "-o", "o.exr", "--stats", name]).code(2).says("asked for twice");
        assert_eq!(folder.read(name), before, "{text}");
    }
    let lens = HEAD.replace("\"perspective\" \"float fov\" 40", "\"realistic\" \"string lensfile\" \"lens.dat\"");
    folder.write("scene.pbrt", format!("{lens}Shape \"sphere\"\n"));
    folder.run(&["render", "scene.pbrt", "-o", "o.exr", "--stats", "lens.dat"]).code(2).says("asked for twice");
    assert!(!folder.path("o.exr").exists());
}

#[test]
fn an_error_goal_ends_also_where_nothing_is_lit() {
    let folder = Folder::new("black");
    folder.write(
        "black.pbrt",
        "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\nShape \"sphere\"\n",
    );
    folder.run(&["render", "black.pbrt", "--error", "0.1"]).code(0).says("8 spp");
    // Something shines and is not seen yet: it may be rare.
    let hidden = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\nShape \"sphere\"\n\
                  LightSource \"point\" \"point3 from\" [0 0 5]\n";
    folder.write("hidden.pbrt", hidden);
    folder.run(&["render", "hidden.pbrt", "--error", "0.1"]).code(0).says("1024 spp");
}
