//! Renders that are killed, stopped, asked to keep what they have, and that go on: to the same pixels, with nothing half-written on the way.

use std::time::{Duration, Instant};

use lanternfish::film::ChannelImage;
use lanternfish::film::exr::read_exr_layers;

use crate::program::{Folder, LAMP, Random, Run, is_ignored};

/// Kills of each scene. `LANTERNFISH_KILLS` says another number, for a longer look.
const KILLS: u32 = 12;

/// The lamp's scene, in more pixels.
fn lamp() -> String {
    LAMP.replace(
        "\"integer xresolution\" 16 \"integer yresolution\" 12",
        "\"integer xresolution\" 96 \"integer yresolution\" 72",
    )
}

/// With so many lamps that which of them are hidden is learned.
fn learned() -> String {
    let lamps = (0..40).map(|i| {
        let (x, y, z) = (i % 7 - 3, f64::from(i % 5) - 0.9, f64::from(i % 6) - 2.0);
        format!("LightSource \"point\" \"rgb I\" [0.4 0.3 0.2] \"point3 from\" [{x} {y} {z}]\n")
    });
    lamp() + &lamps.collect::<String>()
}

/// With a haze, in which points are drawn.
fn hazy() -> String {
    lamp()
        + "MakeNamedMedium \"haze\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [0.05 0.05 0.05] \"rgb sigma_a\" [0.01 0.01 0.01]\n\
           LightSource \"point\" \"point3 from\" [1 2 -3]\n\
           AttributeBegin Material \"interface\" MediumInterface \"haze\" \"\" Shape \"sphere\" \"float radius\" 4.5 AttributeEnd\n"
}

/// The pixels of an image, bit by bit.
fn pixels(folder: &Folder, name: &str) -> Vec<(String, Vec<u32>)> {
    let ChannelImage { channels, .. } = read_exr_layers(&folder.path(name)).expect("a whole image");
    channels.into_iter().map(|(name, values)| (name, values.into_iter().map(f32::to_bits).collect())).collect()
}

fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["render", "s.pbrt", "-o", "out.exr", "--quiet", "--threads", "2"], more].concat()
}

/// Starts a render that would take minutes, and waits until it is on its way.
fn on_its_way(folder: &Folder, more: &[&str]) -> crate::program::Running {
    let arguments = ["render", "s.pbrt", "-o", "out.exr", "--spp", "4000"];
    let running = folder.start_within(&[&arguments[..], more].concat(), 4 << 20, 120);
    let start = Instant::now();
    while !running.errors().contains("spp") {
        assert!(start.elapsed() < Duration::from_secs(60), "it does not start: {}", running.errors());
        std::thread::sleep(Duration::from_millis(5));
    }
    running
}

/// Kills renders of a scene at random moments and lets others go on, until one is through.
fn survives(name: &str, text: &str) {
    let folder = Folder::new(name);
    folder.write("s.pbrt", text);
    let spp = ["--spp", "64"];
    let start = Instant::now();
    folder.run(&render(&[&spp[..], &["--checkpoint", "off"]].concat())).code(0);
    let whole = start.elapsed();
    let expected = pixels(&folder, "out.exr");
    let kills = std::env::var("LANTERNFISH_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(KILLS);
    let mut random = Random(7);
    let (mut killed, mut rounds, mut went_on) = (0, 0, 0);
    while killed < kills {
        rounds += 1;
        let _ = std::fs::remove_file(folder.path("out.exr"));
        loop {
            let from = folder.listing().contains_key("out.exr.checkpoint");
            let running = folder.start(&render(&[&spp[..], &["--checkpoint", "2i", "--recover"]].concat()));
            // Some live for a moment, some to their end.
            std::thread::sleep(whole.mul_f64(random.below(1000) as f64 / 1200.0));
            let ended_by_itself = !running.signal("KILL");
            let Run { code, err, .. } = running.end();
            assert!(!err.contains("checkpoint") && !err.contains("panicked"), "{err}");
            went_on += u32::from(from);
            if code == Some(0) {
                break;
            }
            assert!(!ended_by_itself, "{code:?} {err}");
            killed += 1;
            // Nothing is there under its final name that is not whole.
            if folder.listing().contains_key("out.exr") {
                assert!(pixels(&folder, "out.exr") == expected, "{name}: after {killed} kills");
            }
        }
        assert!(pixels(&folder, "out.exr") == expected, "{name}: after {killed} kills, in round {rounds}");
        assert!(!folder.listing().contains_key("out.exr.checkpoint"), "a render that is done needs no checkpoint");
    }
    println!("{name}: {killed} kills in {rounds} rounds, {went_on} went on from a checkpoint");
    assert!(went_on > 0);
}

#[test]
fn a_killed_render_goes_on() {
    survives("killed", &lamp());
}

#[test]
fn a_killed_render_that_learns_goes_on() {
    survives("killed-learned", &learned());
}

#[test]
fn a_killed_render_of_a_haze_goes_on() {
    survives("killed-hazy", &hazy());
}

#[test]
fn requests_are_heard() {
    let folder = Folder::new("requests");
    folder.write("s.pbrt", learned());
    // To keep what there is, and go on.
    let running = on_its_way(&folder, &[]);
    let start = Instant::now();
    running.signal("HUP");
    // Not where the tests themselves were started to outlive a terminal: then nobody is meant to hear it.
    while !is_ignored(1) && !folder.listing().contains_key("out.exr.checkpoint") {
        assert!(start.elapsed() < Duration::from_secs(60), "nothing was kept: {}", running.errors());
        std::thread::sleep(Duration::from_millis(5));
    }
    // To stop: the image so far, and what it takes to go on.
    assert!(running.signal("USR1"));
    running.end().code(130).says("--resume");
    assert!(folder.listing().contains_key("out.exr"));
    let some: f32 =
        read_exr_layers(&folder.path("out.exr")).expect("an image").channel("samples").expect("counts").iter().sum();
    // Going on until stopped again: there is more than before.
    let running = on_its_way(&folder, &["--resume", "--exit-at", "2s"]);
    running.end().code(130);
    let more: f32 =
        read_exr_layers(&folder.path("out.exr")).expect("an image").channel("samples").expect("counts").iter().sum();
    assert!(more > some, "{more} {some}");
    // Not of this render; damaged; not there.
    folder.run(&render(&["--spp", "8", "--resume"])).code(3).says("another render").says("options");
    let recovered = ["render", "s.pbrt", "-o", "out.exr", "--spp", "8", "--recover"];
    folder.run(&recovered).code(0).says("another render").says("from the start");
    folder.run(&render(&["--spp", "8", "--resume"])).code(3).says("no such file");
    folder.write("out.exr.checkpoint", "LFCHECK5 and so on");
    folder.run(&render(&["--spp", "8", "--resume"])).code(3).says("damaged");
    // What is there of this very render is not rendered again.
    folder.run(&recovered).code(0).says("is there already");
    folder.write("out.exr.checkpoint", "LFCHECK5 and so on");
    std::fs::remove_file(folder.path("out.exr")).expect("it is there");
    folder.run(&recovered).code(0).says("damaged").says("from the start");
    for wrong in ["0i", "often", "5"] {
        folder.run(&render(&["--checkpoint", wrong])).code(2).says("--checkpoint");
    }
}

#[test]
fn a_scene_that_has_changed_is_another() {
    let folder = Folder::new("changed");
    folder.write("s.pbrt", lamp());
    let running = on_its_way(&folder, &[]);
    assert!(running.signal("TERM"));
    running.end().code(130);
    folder.write("s.pbrt", lamp() + "\n");
    folder.run(&render(&["--spp", "4000", "--resume"])).code(3).says("the scene file s.pbrt");
}
