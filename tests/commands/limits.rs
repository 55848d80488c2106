//! What a farm allows a render: memory, processors, a place behind others.

use lanternfish::film::ChannelImage;
use lanternfish::film::exr::read_exr_layers;

use crate::program::{Folder, LAMP};

/// The pixels of an image, bit by bit.
fn pixels(folder: &Folder, name: &str) -> Vec<(String, Vec<u32>)> {
    let ChannelImage { channels, .. } = read_exr_layers(&folder.path(name)).expect("a whole image");
    channels.into_iter().map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect())).collect()
}

/// The most that the last render with `--stats s.json` had in memory, in bytes.
fn peak(folder: &Folder) -> u64 {
    folder.json("s.json")["peak_memory"].as_u64().expect("a number")
}

/// The lamp's scene with waves of 2 n² triangles.
fn heavy(folder: &Folder, n: u32) -> String {
    let count = n + 1;
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        count * count,
        2 * n * n
    )
    .into_bytes();
    for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))) {
        let (x, z) = (i as f32 / n as f32 - 0.5, j as f32 / n as f32 - 0.5);
        [x, 0.1 * (9.0 * x).sin() * (7.0 * z).cos(), z].iter().for_each(|value| ply.extend(value.to_le_bytes()));
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let at = i * count + j;
        for triangle in [[at, at + 1, at + count], [at + 1, at + count + 1, at + count]] {
            ply.push(3);
            triangle.iter().for_each(|index| ply.extend(index.to_le_bytes()));
        }
    }
    folder.write("waves.ply", ply);
    format!("{LAMP}Shape \"plymesh\" \"string filename\" \"waves.ply\"\n")
}

#[test]
fn what_does_not_fit_is_told_with_what_took_it() {
    let folder = Folder::new("memory");
    folder.write("s.pbrt", heavy(&folder, 1500));
    let render = ["render", "s.pbrt", "-o", "out.exr", "--stats", "s.json", "--spp", "1"];
    folder.start_within(&render, 16 << 20, 60).end().code(0);
    let free = peak(&folder);
    println!("{free} bytes without a limit");
    assert!(free > 400 << 20, "{free} bytes are no test of a limit of 200 MB");
    folder.start_within(&[&render[..], &["--memory-limit", "2GB"]].concat(), 16 << 20, 60).end().code(0);
    std::fs::remove_file(folder.path("out.exr")).expect("it was written");
    let run = folder.start_within(&[&render[..], &["--memory-limit", "200MB"]].concat(), 16 << 20, 60).end().code(4);
    let said = run.says("--memory-limit").says("MiB").err;
    assert!(said.contains("geometry") || said.contains("acceleration structure"), "{said}");
    assert!(!folder.listing().contains_key("out.exr"));
    for wrong in ["0", "much", "1 parsec"] {
        folder.run(&[&render[..], &["--memory-limit", wrong]].concat()).code(2).says("--memory-limit");
    }
}

/// A wall of 40 pictures of 1024 × 1024 pixels: 168 MB with all their levels.
fn gallery(folder: &Folder) -> String {
    let image = image::RgbImage::from_fn(1024, 1024, |x, y| image::Rgb([x as u8, y as u8, (x * y / 64) as u8]));
    image.save(folder.path("0.png")).expect("the image can be written");
    let mut text =
        "Camera \"perspective\" \"float fov\" 40 Film \"rgb\" \"integer xresolution\" 80 \"integer yresolution\" 80\n\
         Sampler \"zsobol\" \"integer pixelsamples\" 8\nWorldBegin LightSource \"infinite\"\n"
            .to_owned();
    for i in 0..40 {
        let name = format!("{i}.png");
        if i > 0 {
            std::fs::hard_link(folder.path("0.png"), folder.path(&name)).expect("another name");
        }
        let (x, y) = (f64::from(i % 8) * 0.09 - 0.36, f64::from(i / 8) * 0.144 - 0.36);
        let (right, top) = (x + 0.09, y + 0.144);
        text += &format!(
            "Texture \"t{i}\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\nMaterial \"diffuse\" \"texture reflectance\" \"t{i}\"\n\
             Shape \"bilinearmesh\" \"point3 P\" [{x} {y} 1 {right} {y} 1 {x} {top} 1 {right} {top} 1]\n"
        );
    }
    text
}

#[test]
fn tiles_of_textures_make_way() {
    let folder = Folder::new("memory-textures");
    let text = gallery(&folder);
    folder.write("s.pbrt", text);
    let render = ["render", "s.pbrt", "-o", "out.exr", "--stats", "s.json", "--texture-levels", "finest"];
    folder.start_within(&[&render[..], &["--texture-memory", "2GiB"]].concat(), 16 << 20, 60).end().code(0);
    let (whole, free) = (pixels(&folder, "out.exr"), peak(&folder));
    assert!(free > 180 << 20, "{free}");
    // Of a size that the reading of an image, 8 MiB of which may count as taken for a while after, is well below the tenth more that ends a render.
    let limited = [&render[..], &["--memory-limit", "110MB"]].concat();
    let run = folder.start_within(&limited, 16 << 20, 60).end().code(0);
    run.says("--memory-limit leaves no more");
    let within = peak(&folder);
    println!("{free} bytes without a limit, {within} with one of 110 MB");
    assert!(within < 110_000_000 * 115 / 100, "{within}");
    assert!(pixels(&folder, "out.exr") == whole);
    assert!(folder.json("s.json")["texture_cache"]["reads"].as_u64() > Some(0));
}

/// A picture that takes more than all textures may have, twice that to read and as much again for its levels, is cut row by row.
#[test]
fn an_image_larger_than_the_memory_is_cut_within_it() {
    let folder = Folder::new("memory-picture");
    let image = image::RgbImage::from_fn(6000, 6000, |x, y| image::Rgb([x as u8, (y ^ x) as u8, (x * y / 64) as u8]));
    image.save(folder.path("0.png")).expect("the image can be written");
    drop(image);
    folder.write(
        "s.pbrt",
        "Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 40\n\
         Sampler \"zsobol\" \"integer pixelsamples\" 4\nWorldBegin LightSource \"infinite\"\n\
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"0.png\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n\
         Shape \"bilinearmesh\" \"point3 P\" [-2 -2 1  2 -2 1  -2 2 1  2 2 1]\n",
    );
    let render = ["render", "s.pbrt", "-o", "out.exr", "--stats", "s.json", "--texture-memory"];
    folder.start_within(&[&render[..], &["1GiB"]].concat(), 16 << 20, 60).end().code(0);
    let (whole, free) = (pixels(&folder, "out.exr"), peak(&folder));
    folder.start_within(&[&render[..], &["32MiB"]].concat(), 16 << 20, 60).end().code(0);
    let within = peak(&folder);
    println!("{free} bytes with memory for all of it, {within} with 32 MiB");
    assert!(free > 200 << 20 && within < 100 << 20, "{free} {within}");
    assert!(pixels(&folder, "out.exr") == whole);
}

#[cfg(target_os = "linux")]
#[test]
fn checkpoints_take_no_copy_under_a_limit() {
    let folder = Folder::new("memory-checkpoints");
    let large = LAMP.replace(
        "\"integer xresolution\" 16 \"integer yresolution\" 12",
        "\"integer xresolution\" 400 \"integer yresolution\" 300",
    );
    folder.write("s.pbrt", large);
    let whole = ["render", "s.pbrt", "-o", "whole.exr", "--spp", "4", "--checkpoint", "off"];
    folder.run(&whole).code(0);
    // There is room for the image (some 50 MB as it is held), but not for 29 MB of checkpoint in a list that doubles.
    let limit = "90MB";
    let render = ["render", "s.pbrt", "-o", "out.exr", "--spp", "4", "--checkpoint", "1i", "--memory-limit", limit];
    folder.run(&[&render[..], &["--quiet"]].concat()).code(0);
    assert!(pixels(&folder, "out.exr") == pixels(&folder, "whole.exr"));
    // What is written from where it is is what a copy would be: a render goes on from it.
    // On a busy machine it may take long to begin.
    let stopped = ["300ms", "1s", "3s", "10s"].into_iter().map(|at| {
        let stop = ["render", "s.pbrt", "-o", "out.exr", "--spp", "24", "--memory-limit", limit, "--exit-at", at];
        folder.run(&stop)
    });
    let stopped = stopped.into_iter().find(|run| !run.err.contains("before anything was rendered"));
    stopped.expect("it begins").code(130).says("--resume");
    let go_on = ["render", "s.pbrt", "-o", "out.exr", "--spp", "24", "--resume"];
    folder.run(&go_on).code(0);
    folder.run(&["render", "s.pbrt", "-o", "whole.exr", "--spp", "24"]).code(0);
    assert!(pixels(&folder, "out.exr") == pixels(&folder, "whole.exr"));
}

/// A file of `/proc` of a running process, once it says something.
#[cfg(target_os = "linux")]
fn proc(running: &crate::program::Running, name: &str) -> String {
    std::fs::read_to_string(format!("/proc/{}/{name}", running.child.id())).unwrap_or_default()
}

#[cfg(target_os = "linux")]
fn wait_for_rendering(running: &crate::program::Running) {
    let start = std::time::Instant::now();
    while !running.errors().contains("rendering") {
        assert!(start.elapsed().as_secs() < 60, "it does not start: {}", running.errors());
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn renders_let_others_go_first() {
    let folder = Folder::new("nice");
    folder.write("s.pbrt", LAMP);
    let running = folder.start(&["render", "s.pbrt", "-o", "out.exr", "--spp", "100000000", "--nice", "7"]);
    wait_for_rendering(&running);
    let tasks = std::fs::read_dir(format!("/proc/{}/task", running.child.id())).expect("it runs");
    for task in tasks.flatten() {
        let stat = std::fs::read_to_string(task.path().join("stat")).expect("it runs");
        // The 19th field; the second, in brackets, may hold anything.
        let nice = stat.rsplit_once(") ").and_then(|(_, rest)| rest.split(' ').nth(16)).expect("a number");
        assert_eq!(nice, "7", "{stat}");
    }
    running.interrupt();
    running.end().code(130);
    for wrong in ["20", "x"] {
        folder.run(&["render", "s.pbrt", "--nice", wrong]).code(2).says("--nice");
    }
}

/// Threads follow the processors that the process may use.
#[cfg(target_os = "linux")]
#[test]
fn threads_follow_the_processors_allowed() {
    let status = std::fs::read_to_string("/proc/self/status").expect("proc");
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).expect("it is there").trim();
    let first = allowed.split([',', '-']).next().expect("one");
    if std::process::Command::new("taskset").arg("--version").output().is_err() {
        return println!("skipped: there is no taskset");
    }
    let folder = Folder::new("taskset");
    folder.write("s.pbrt", LAMP);
    let pinned = format!("exec taskset -c {first} \"$@\"");
    for backend in if cfg!(feature = "embree") { &["embree", "native"][..] } else { &["native"] } {
        let render = ["render", "s.pbrt", "-o", "out.exr", "--stats", "s.json", "--backend", backend];
        folder.start_by(&pinned, &render).end().code(0);
        assert_eq!(folder.json("s.json")["threads"], 1, "{backend}");
        // Three threads, whatever is allowed, where they are asked for.
        folder.start_by(&pinned, &[&render[..], &["--threads", "3"]].concat()).end().code(0);
        assert_eq!(folder.json("s.json")["threads"], 3, "{backend}");
        // The main thread, one that hears signals, one that renders; Embree has no thread beside it.
        let running = folder.start_by(&pinned, &[&render[..], &["--spp", "100000000"]].concat());
        wait_for_rendering(&running);
        let status = proc(&running, "status");
        let threads = status.lines().find_map(|line| line.strip_prefix("Threads:")).map(str::trim);
        assert_eq!(threads, Some("3"), "{backend}");
        running.interrupt();
        running.end().code(130);
    }
}
