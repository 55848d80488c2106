//! Frames, and parts of frames: rendered apart, joined, refused where they do not belong together; what one render learned, used by another.

use std::collections::BTreeMap;

use lanternfish::film::ChannelImage;
use lanternfish::film::exr::read_exr_layers;

use crate::program::{Folder, LAMP, Random, lamps};

fn image(folder: &Folder, name: &str) -> ChannelImage {
    read_exr_layers(&folder.path(name)).expect("a whole image")
}

fn bits(folder: &Folder, name: &str) -> BTreeMap<String, Vec<u32>> {
    let bits = |(name, values): (String, Vec<f32>)| (name, values.into_iter().map(f32::to_bits).collect());
    image(folder, name).channels.into_iter().map(bits).collect()
}

fn render<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", "s.pbrt", "-o", out, "--quiet", "--checkpoint", "off"], more].concat()
}

/// Where nothing is learned, parts have the very samples of the whole.
#[test]
fn parts_add_up_to_the_whole() {
    let folder = Folder::new("parts");
    for (kind, text) in [("rgb", LAMP.to_owned()), ("gbuffer", LAMP.replace("Film \"rgb\"", "Film \"gbuffer\""))] {
        folder.write("s.pbrt", text);
        let plain = ["--spp", "23", "--view-rays", "off", "--lights", "uniform"];
        folder.run(&render("whole.exr", &plain)).code(0);
        let parts: Vec<String> = (1..=5).map(|k| format!("part{k}.exr")).collect();
        for (k, part) in parts.iter().enumerate() {
            let part_of = format!("{}/5", k + 1);
            folder.run(&render(part, &[&plain[..], &["--part", &part_of]].concat())).code(0);
        }
        let mut merge = vec!["merge", "-o", "merged.exr"];
        merge.extend(parts.iter().rev().map(String::as_str));
        folder.run(&merge).code(0).says("merged.exr: 23 spp from 5 images");
        let (whole, merged) = (image(&folder, "whole.exr"), image(&folder, "merged.exr"));
        assert_eq!(merged.channels.len(), whole.channels.len());
        for (name, expected) in &whole.channels {
            let values = merged.channel(name).expect("it is there");
            for (a, b) in expected.iter().zip(values) {
                assert!((a - b).abs() <= 1e-5 * a.abs().max(1e-2), "{kind} {name}: {b}, not {a}");
            }
        }
        for name in
            ["lanternfish.seed", "lanternfish.samples", "lanternfish.samplesPerPixel", "lanternfish.frameIdentity"]
        {
            assert_eq!(merged.attribute(name), whole.attribute(name), "{name}");
        }
        assert!(merged.attribute("lanternfish.part").is_none() && merged.attribute("lanternfish.incomplete").is_none());
        // In whatever order; and in steps, of which the first leaves something out.
        let before = bits(&folder, "merged.exr");
        merge[3..].sort_unstable();
        folder.run(&merge).code(0);
        assert!(before == bits(&folder, "merged.exr"), "the order matters");
        folder
            .run(&["merge", "part1.exr", "part4.exr", "-o", "some.exr", "--incomplete"])
            .code(0)
            .says("3 of 5 parts are missing: 2, 3, 5");
        assert!(image(&folder, "some.exr").attribute("lanternfish.incomplete").is_some());
        folder
            .run(&["merge", "some.exr", "part2.exr", "part3.exr", "part5.exr", "-o", "steps.exr", "--png", "steps.png"])
            .code(0);
        for (name, expected) in &whole.channels {
            let image = image(&folder, "steps.exr");
            let values = image.channel(name).expect("it is there");
            assert!(
                expected.iter().zip(values).all(|(a, b)| (a - b).abs() <= 2e-5 * a.abs().max(1e-2)),
                "{kind} {name}"
            );
        }
        assert!(folder.read("steps.png").starts_with(b"\x89PNG"));
    }
    // By ranges: some samples now, more of them later.
    let plain = ["--view-rays", "off", "--lights", "uniform", "--samples"];
    folder.run(&render("a.exr", &[&plain[..], &["0..8"]].concat())).code(0);
    folder.run(&render("b.exr", &[&plain[..], &["8..23"]].concat())).code(0);
    folder.run(&["merge", "a.exr", "b.exr", "-o", "ab.exr"]).code(0);
    let (a, b) = (image(&folder, "ab.exr"), image(&folder, "merged.exr"));
    let [a, b] = [&a, &b].map(|image| image.channel("R").expect("it is there"));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-2)));
}

/// Where a lesson is all that is known, parts have the very samples of the whole, however many passes they take.
#[test]
fn parts_that_learn_nothing_more_add_up_to_the_whole() {
    let folder = Folder::new("parts-frozen");
    folder.write("s.pbrt", lamps());
    let learned = ["--lights", "cache-points", "--view-rays", "off"];
    folder.run(&render("a.exr", &[&learned[..], &["--samples", "0..4", "--save-cache", "a.lesson"]].concat())).code(0);
    let frozen = |out: &str, samples: &str| {
        let more = ["--samples", samples, "--load-cache", "a.lesson", "--freeze-cache"];
        folder.run(&render(out, &[&learned[..], &more].concat())).code(0);
        image(&folder, out)
    };
    let whole = frozen("whole.exr", "4..27");
    ["4..9", "9..20", "20..27"]
        .iter()
        .enumerate()
        .for_each(|(k, samples)| drop(frozen(&format!("part{k}.exr"), samples)));
    let parts = ["part0.exr", "part1.exr", "part2.exr"];
    folder.run(&[&["merge", "--incomplete", "-o", "merged.exr"], &parts[..]].concat()).code(0).says("23 spp");
    let merged = image(&folder, "merged.exr");
    for name in ["R", "G", "B", "direct.R"] {
        let [a, b] = [&whole, &merged].map(|image| image.channel(name).expect("it is there"));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-2)), "{name}");
    }
    // With the first part they are a frame.
    folder.run(&[&["merge", "-o", "all.exr", "a.exr"], &parts[..]].concat()).code(0).says("27 spp");
    folder.run(&render("b.exr", &["--freeze-cache"])).code(2);
}

/// The first samples teach, and the parts are of the others.
#[test]
fn a_lesson_and_its_parts_are_a_frame() {
    let folder = Folder::new("parts-lesson");
    folder.write("s.pbrt", lamps());
    let learned = ["--lights", "cache-points", "--view-rays", "off"];
    let frozen = ["--load-cache", "s.lesson", "--freeze-cache"];
    let part = |of: &str, more: &[&str]| {
        let out = format!("part{}.exr", &of[..1]);
        folder.run(&render(&out, &[&learned[..], &["--spp", "27", "--part", of], more].concat())).code(0);
        image(&folder, &out).attribute("lanternfish.samples").map(str::to_owned)
    };
    assert_eq!(part("0/3", &["--save-cache", "s.lesson"]).as_deref(), Some("0:0..4"));
    let taken: Vec<_> = ["1/3", "2/3", "3/3"].iter().filter_map(|of| part(of, &frozen)).collect();
    assert_eq!(taken, ["0:4..11", "0:11..19", "0:19..27"]);
    let parts = ["part1.exr", "part2.exr", "part3.exr"];
    let merge = |out: &'static str, more: &[&'static str]| {
        folder.run(&[&["merge", "-o", out, "--incomplete"], &parts[..], more].concat()).code(0);
        image(&folder, out)
    };
    folder
        .run(&[&["merge", "-o", "x.exr"], &parts[..]].concat())
        .code(3)
        .says("part 0 is missing, the lesson of the others: samples 0..4 of seed 0");
    let merged = merge("merged.exr", &[]);
    // The other samples as one render.
    folder.run(&render("rest.exr", &[&learned[..], &["--samples", "4..27"], &frozen].concat())).code(0);
    let rest = image(&folder, "rest.exr");
    for name in ["R", "G", "B", "direct.R"] {
        let [a, b] = [&rest, &merged].map(|image| image.channel(name).expect("it is there"));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1e-2)), "{name}");
    }
    let whole = [&["merge", "-o", "whole.exr", "part0.exr"], &parts[..]].concat();
    folder.run(&whole).code(0).says("27 spp from 4 images");
    assert!(image(&folder, "whole.exr").attribute("lanternfish.incomplete").is_none());
    // A lesson without a pupil; fewer samples than parts.
    folder.run(&render("x.exr", &["--part", "0/3"])).code(2).says("--save-cache");
    let few = ["--spp", "3", "--part", "0/3", "--save-cache", "x.lesson"];
    folder.run(&render("x.exr", &few)).code(2).says("with a lesson there can be 2 parts at most");
    // What other samples of the frame taught is no lesson of its parts.
    let other = ["--samples", "0..4", "--save-cache", "other.lesson"];
    folder.run(&render("x.exr", &[&learned[..], &other].concat())).code(0);
    let by_it = ["--spp", "27", "--load-cache", "other.lesson", "--part"];
    folder.run(&render("x.exr", &[&learned[..], &by_it, &["1/3"]].concat())).code(3).says("samples 0..4 of seed 0");
    folder.run(&render("x.exr", &[&learned[..], &by_it, &["2/3"]].concat())).code(0);
    // An older lesson, of fewer samples, does not stand for this one.
    let older = ["--spp", "9", "--part", "0/3", "--save-cache", "older.lesson"];
    folder.run(&render("part0.exr", &[&learned[..], &older].concat())).code(0);
    folder.run(&whole).code(3).says("part 0 is missing");
}

/// Where lights are learned each part learns for itself, or goes by a lesson of the first samples: so the merged image has other noise than one render's, and the same mean: over the whole image and in blocks of it.
/// False-alarm rate: 4e-6.
#[test]
fn parts_that_learn_are_as_right_as_the_whole() {
    const SEEDS: u32 = 6;
    let folder = Folder::new("parts-learn");
    folder.write("s.pbrt", lamps());
    let run = |name: &str, seed: u32, more: &[&str]| {
        let seed = seed.to_string();
        let common = ["--lights", "cache-points", "--resolution", "64x64", "--spp", "32", "--seed", &seed];
        folder.run(&render(name, &[&common[..], more].concat())).code(0);
        name.to_owned()
    };
    let (mut wholes, mut parts, mut taught) = (vec![], vec![], vec![]);
    for seed in 0..SEEDS {
        wholes.push(run(&format!("whole{seed}.exr"), seed, &[]));
        let part = |k| run(&format!("part{seed}-{k}.exr"), 100 + seed, &["--part", &format!("{k}/8")]);
        parts.extend((1..=8).map(part));
        let lesson = ["--save-cache", "s.lesson"];
        let by_it = ["--load-cache", "s.lesson", "--freeze-cache"];
        let part = |k, more: &[&str]| {
            let of = format!("{k}/8");
            run(&format!("taught{seed}-{k}.exr"), 200 + seed, &[&["--part", of.as_str()], more].concat())
        };
        taught.push(part(0, &lesson));
        taught.extend((1..=8).map(|k| part(k, &by_it)));
    }
    for (images, merged) in [(&wholes, "whole.exr"), (&parts, "parts.exr"), (&taught, "taught.exr")] {
        let names: Vec<&str> = images.iter().map(String::as_str).collect();
        folder.run(&[&["merge", "-o", merged], &names[..]].concat()).code(0).says("192 spp from");
    }
    for merged in ["parts.exr", "taught.exr"] {
        let compared = folder.run(&["compare", merged, "whole.exr", "--json"]).code(0).out.clone();
        let compared: serde_json::Value = serde_json::from_str(&compared).expect("it is JSON");
        let number = |path: &str| compared.pointer(path).and_then(serde_json::Value::as_f64).expect(path);
        // The interval is one of 95 %.
        let error = (number("/bias/interval/1") - number("/bias/interval/0")) / (2.0 * 1.96);
        let (z, blocks) = (number("/bias/value") / error, number("/blocks/count"));
        let most = 1.0 + 6.5 * (2.0 / blocks).sqrt();
        let found = number("/blocks/mean_z_squared");
        println!("{merged}: bias {z:.2} standard errors, mean z² of {blocks} blocks {found:.2}, at most {most:.2}");
        assert!(error < 0.01 * number("/mean_b"), "{error} is too large to tell");
        assert!(z.abs() < 4.9 && found < most);
    }
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let folder = Folder::new("parts-refused");
    folder.write("s.pbrt", LAMP);
    for k in 1..=3 {
        folder.run(&render(&format!("p{k}.exr"), &["--spp", "6", "--part", &format!("{k}/3")])).code(0);
    }
    let merge = |parts: &[&str]| folder.run(&[&["merge", "-o", "out.exr"], parts].concat());
    merge(&["p1.exr", "p3.exr"]).code(3).says("1 of 3 parts are missing: 2; --incomplete merges what there is");
    merge(&["p1.exr", "p2.exr", "p2.exr", "p3.exr"])
        .code(3)
        .says("both have samples 2..4 of seed 0: they would count twice");
    merge(&["p1.exr", "p2.exr", "p3.exr", "none.exr"]).code(3).says("none.exr");
    // Of other options, another frame, another division, another size, another scene.
    for (more, why) in [
        (&["--part", "3/3", "--spp", "6", "--max-depth", "2"][..], "max_depth: Some(2)"),
        (&["--part", "3/3", "--spp", "6", "--frames", "7"], "the frame's number is not the same"),
        (&["--part", "4/4", "--spp", "8"], "the number of parts"),
        (&["--part", "3/3", "--spp", "6", "--resolution", "8x6"], "the options"),
    ] {
        folder.run(&render("other.exr", more)).code(0);
        merge(&["p1.exr", "p2.exr", "other.exr"]).code(3).says(why);
    }
    folder.write("s.pbrt", LAMP.replace("[5 5 5]", "[5 5 6]"));
    folder.run(&render("other.exr", &["--part", "3/3", "--spp", "6"])).code(0);
    merge(&["p1.exr", "p2.exr", "other.exr"]).code(3).says("the text of the scene is not the same");
    // Another seed has other samples: that is no fault, but here a part is missing.
    folder.write("s.pbrt", LAMP);
    folder.run(&render("other.exr", &["--part", "1/3", "--spp", "6", "--seed", "8"])).code(0);
    merge(&["p1.exr", "p2.exr", "p3.exr", "other.exr"]).code(0);
    // What another program wrote.
    folder.run(&["compare", "p1.exr", "p2.exr"]).code(0);
    let mut bare = image(&folder, "p3.exr");
    bare.attributes.clear();
    lanternfish::film::exr::write_exr(&folder.path("bare.exr"), bare).expect("it can be written");
    merge(&["p1.exr", "p2.exr", "bare.exr"])
        .code(3)
        .says("its header does not say which samples of which frame it has");
    // An output over an input; a part without samples; options that make no sense.
    folder.run(&["merge", "p1.exr", "p2.exr", "p3.exr", "-o", "p1.exr"]).code(2);
    folder.run(&render("x.exr", &["--spp", "2", "--part", "3/3"])).code(0);
    folder.run(&render("x.exr", &["--spp", "2", "--part", "1/3"])).code(2).says("part 1 of 3 has no sample");
    for wrong in [
        &["--part", "4/3"][..],
        &["--part", "1/2", "--samples", "0..2"],
        &["--samples", "3..3"],
        &["--samples", "0..4", "--time", "1"],
    ] {
        folder.run(&render("x.exr", wrong)).code(2);
    }
}

/// A part that was stopped is no part until it is done.
#[test]
fn stopped_parts_are_told() {
    let folder = Folder::new("parts-stopped");
    folder.write("s.pbrt", LAMP);
    let spp = ["--spp", "100000", "--resolution", "64x48"];
    let part = |k: &'static str, more: &[&'static str]| {
        let arguments = [
            &["render", "s.pbrt", "-o"],
            &[if k == "1/2" { "1.exr" } else { "2.exr" }][..],
            &spp,
            &["--part", k, "--quiet"],
            more,
        ]
        .concat();
        folder.run(&arguments)
    };
    part("1/2", &["--exit-at", "500ms"]).code(130);
    part("2/2", &["--exit-at", "500ms"]).code(130);
    folder.run(&["merge", "1.exr", "2.exr", "-o", "out.exr"]).code(3).says("was stopped before it was done");
    assert!(!folder.listing().contains_key("out.exr"));
    folder.run(&["merge", "1.exr", "2.exr", "-o", "out.exr", "--incomplete"]).code(0);
    assert!(image(&folder, "out.exr").attribute("lanternfish.incomplete").is_some());
    // Nobody begins with a lesson that is to go on.
    let lesson = ["render", "s.pbrt", "-o", "0.exr", "--part", "0/2", "--save-cache", "s.lesson", "--quiet"];
    folder.run(&[&lesson[..], &spp, &["--exit-at", "500ms"]].concat()).code(130);
    assert!(folder.listing().contains_key("0.exr") && !folder.listing().contains_key("s.lesson"));
}

#[test]
fn sequences_have_a_file_and_noise_for_each_frame() {
    let folder = Folder::new("sequence");
    for frame in 8..=11 {
        folder.write(&format!("shot.{frame:03}.pbrt"), LAMP);
    }
    let all = ["render", "shot.###.pbrt", "-o", "out.####.exr", "--png", "out.####.png", "--frames", "8..11"];
    let run = folder.run(&all).code(0).says("frame 10, 3 of 4");
    assert!(run.err.contains("out.0011.exr: 4 spp"), "{}", run.err);
    let noise: Vec<_> = (8..=11).map(|frame| bits(&folder, &format!("out.{frame:04}.exr"))["R"].clone()).collect();
    assert!((1..4).all(|i| noise[i] != noise[0]), "frames have the same noise");
    assert!(folder.listing().contains_key("out.0009.png"));
    // One frame by itself has the same bits.
    folder.run(&["render", "shot.###.pbrt", "-o", "one.exr", "--frames", "10", "--quiet"]).code(0);
    assert!(bits(&folder, "one.exr")["R"] == noise[2]);
    // With --recover those that are there are not rendered again.
    let _ = std::fs::remove_file(folder.path("out.0009.exr"));
    let again = folder.run(&[&all[..], &["--recover"]].concat()).code(0);
    assert_eq!(again.err.matches("is there already").count(), 3, "{}", again.err);
    assert!(bits(&folder, "out.0009.exr")["R"] == noise[1]);
    // Of another render they are.
    let other = folder.run(&[&all[..], &["--recover", "--spp", "5"]].concat()).code(0);
    assert!(!other.err.contains("is there already"), "{}", other.err);
    // Names follow from the scene's where none are given; one name for all frames is refused.
    folder.run(&["render", "shot.###.pbrt", "--frames", "8..9", "--quiet"]).code(0);
    assert!(["shot.008.exr", "shot.009.exr"].iter().all(|name| folder.listing().contains_key(*name)));
    folder.write("s.pbrt", LAMP);
    folder.run(&["render", "s.pbrt", "--frames", "8..9", "--quiet"]).code(0);
    assert!(folder.listing().contains_key("s.0008.exr"));
    folder
        .run(&["render", "s.pbrt", "--frames", "8..9", "-o", "same.exr"])
        .code(2)
        .says("same.exr has no place for the number");
    // The first frame that cannot be rendered ends it.
    let missing = folder.run(&["render", "shot.###.pbrt", "-o", "m.##.exr", "--frames", "10..13"]).code(3);
    assert!(missing.err.contains("shot.012.pbrt"), "{}", missing.err);
    assert!(folder.listing().contains_key("m.11.exr"));
}

#[test]
fn what_was_learned_serves_other_renders_of_the_scene() {
    let folder = Folder::new("lesson");
    folder.write("s.pbrt", lamps());
    let learned = ["--lights", "cache-points"];
    folder
        .run(&render("a.exr", &[&learned[..], &["--spp", "16", "--seed", "5", "--save-cache", "a.lesson"]].concat()))
        .code(0);
    let taught = |more: &[&'static str]| {
        let arguments = [
            "render",
            "s.pbrt",
            "-o",
            "b.exr",
            "--checkpoint",
            "off",
            "--lights",
            "cache-points",
            "--load-cache",
            "a.lesson",
        ];
        folder.run(&[&arguments[..], more].concat())
    };
    // At another size too.
    taught(&["--resolution", "20x20"]).code(0).says("cache points over 41 lights, loaded in");
    taught(&["--save-cache", "b.lesson", "--stats", "s.json"]).code(0).says("loaded in");
    assert_eq!(folder.json("s.json")["cache_points"]["are_loaded"], true);
    // The same samples must not be weighed by what they taught, nor by what that went on to teach.
    taught(&["--seed", "5"]).code(3).says("samples 0..16 of seed 5, which this render takes too");
    taught(&["--seed", "5", "--samples", "16..20"]).code(0);
    let [from, to] = ["a.lesson", "b.lesson"].map(|name| folder.path(name));
    std::fs::rename(to, &from).expect("they are there");
    taught(&["--seed", "5"]).code(3).says("samples 0..16 of seed 5");
    taught(&["--seed", "0"]).code(3).says("samples 0..4 of seed 0");
    // Of other options, of another scene, damaged, missing, over itself.
    taught(&["--seed", "9", "--cache-entries", "8"]).code(3).says("the options");
    taught(&["--seed", "9", "--save-cache", "a.lesson"]).code(2);
    let good = folder.read("a.lesson");
    let mut random = Random(3);
    for _ in 0..30 {
        folder.write("a.lesson", crate::program::damage(&good, &mut random));
        taught(&["--seed", "9"]).code(3).says("cannot use what was learned, a.lesson");
    }
    folder.write("a.lesson", &good[..good.len() / 2]);
    taught(&["--seed", "9"]).code(3).says("the file is damaged");
    std::fs::remove_file(&from).expect("it is there");
    taught(&["--seed", "9"]).code(3);
    folder.write("a.lesson", &good).write("s.pbrt", lamps() + "\nLightSource \"point\"\n");
    taught(&["--seed", "9"]).code(3).says("the text of the scene is not the same");
}
