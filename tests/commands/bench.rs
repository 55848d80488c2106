//! `lanternfish bench` through the built program: what it writes, that its parts agree, and what it refuses.

use crate::program::{Folder, LAMP, Run};
use serde_json::Value;

/// Two lamps over a floor, of very different power: uniform selection is worse than selection by power.
fn lamps(name: &str) -> Folder {
    let folder = Folder::new(name);
    let second = "AttributeBegin\n  AreaLightSource \"diffuse\" \"rgb L\" [0.01 0.01 0.01]\n  Translate -2 2 0\n  \
                  Shape \"sphere\" \"float radius\" 0.1\nAttributeEnd\n";
    folder.write("lamps.pbrt", LAMP.replacen("AttributeBegin", &format!("{second}AttributeBegin"), 1));
    folder
}

fn bench(folder: &Folder, more: &[&str]) -> Run {
    let all = ["bench", "lamps.pbrt", "--methods", "uniform,power", "--spp", "1,4,16", "--runs", "2", "--out", "out"];
    folder.run(&[&all, more].concat())
}

/// The numbers that do not depend on how fast the machine is.
fn errors(report: &Value) -> Vec<(String, Value, Value)> {
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let mut found = vec![];
    for curve in list(&report["scenes"][0]["curves"]) {
        for point in list(&curve["points"]) {
            for run in list(&point["runs"]) {
                found.push((curve["method"]["name"].to_string(), point["spp"].clone(), run["errors"].clone()));
            }
        }
    }
    found
}

#[test]
fn page_json_and_csv_agree_and_come_out_alike_again() {
    let folder = lamps("bench-all");
    let run = bench(&folder, &[]).code(0);
    assert!(
        run.out.contains("bench lamps.pbrt --methods uniform,power") && run.out.contains("out/index.html"),
        "{}",
        run.out
    );

    let report = folder.json("out/results.json");
    let found = errors(&report);
    assert_eq!(found.len(), 2 * 3 * 2);
    let scene = &report["scenes"][0];
    assert_eq!(
        (&scene["name"], &scene["lights"], &scene["pixels"]),
        (&"lamps".into(), &2.into(), &[16, 12].as_slice().into())
    );
    assert!(scene["reference"]["own_rmse"].as_f64().is_some_and(|own| own > 0.0), "{scene}");
    assert!(scene["reference"]["how"].as_str().is_some_and(|how| how.contains("exhaustive")), "{scene}");

    // More samples, smaller errors; the better method wins.
    let rmse = |curve: usize, point: usize| {
        scene["curves"][curve]["points"][point]["rmse"]["value"].as_f64().expect("above the reference's own error")
    };
    for curve in 0..2 {
        assert!(rmse(curve, 0) > rmse(curve, 1) && rmse(curve, 1) > rmse(curve, 2), "{scene}");
    }
    assert!(rmse(0, 2) > rmse(1, 2));

    let csv = String::from_utf8(folder.read("out/results.csv")).expect("text");
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| header.iter().position(|other| *other == name).unwrap_or_else(|| panic!("{name}"));
    let lines: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), found.len());
    for (line, (method, spp, errors)) in lines.iter().zip(&found) {
        assert_eq!(
            (format!("\"{}\"", line[column("method")]), line[column("spp")]),
            (method.clone(), spp.to_string().as_str())
        );
        for (name, of) in [("rmse", "rmse"), ("relative_mse", "relative_mse"), ("hdr_flip", "flip"), ("mse", "mse")] {
            let [csv, json] =
                [line[column(name)].parse::<f64>().expect("a number"), errors[of].as_f64().expect("a number")];
            assert!((csv - json).abs() <= 1e-12 * json.abs(), "{name}: {csv} {json}");
        }
        assert!(line[column("command")].contains("render lamps.pbrt --spp"));
    }

    let page = String::from_utf8(folder.read("out/index.html")).expect("text");
    for outside in ["http:", "https:", "src=\"/", "url(", "<script", "<link", "file:/"] {
        assert!(!page.contains(outside), "the page has {outside}");
    }
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,iVBOR") && page.contains("uniform"));
    for plot in ["rmse-cpu", "rmse-wall", "relative-mse-cpu", "flip-wall", "ttuv-cpu", "time"] {
        assert!(folder.read(&format!("out/plots/lamps-{plot}.png")).starts_with(b"\x89PNG"));
    }

    // Again, with the reference that is there now: the same errors to the last bit.
    let references = |folder: &Folder| std::fs::read_dir(folder.path("out/references")).expect("a folder").count();
    let before = references(&folder);
    bench(&folder, &["--quiet"]).code(0);
    assert_eq!((errors(&folder.json("out/results.json")), references(&folder)), (found, before));
}

#[test]
fn a_reference_of_ones_own_is_used_or_refused() {
    let folder = lamps("bench-reference");
    folder.run(&["render", "lamps.pbrt", "--spp", "256", "--seed", "99", "-o", "right.exr", "--quiet"]).code(0);
    folder.run(&["render", "lamps.pbrt", "--spp", "1", "--resolution", "12x16", "-o", "wrong.exr", "--quiet"]).code(0);
    folder.write("broken.exr", b"\x76\x2f\x31\x01 and no more");
    let one = ["--reference"];
    bench(&folder, &[&one[..], &["wrong.exr"]].concat()).code(3).says("of 12 × 16").says("of 16 × 12");
    bench(&folder, &[&one[..], &["broken.exr"]].concat()).code(3).says("broken.exr");
    bench(&folder, &[&one[..], &["gone.exr"]].concat()).code(3).says("gone.exr");
    assert!(!folder.path("out/results.json").exists());
    bench(&folder, &["--reference", "right.exr"]).code(0);
    let about = folder.json("out/results.json")["scenes"][0]["reference"].clone();
    assert!(about["how"].as_str().is_some_and(|how| how.contains("right.exr") && how.contains("variance")), "{about}");
    assert!(about["own_rmse"].as_f64().is_some_and(|own| own > 0.0), "{about}");
    assert!(!about["how"].to_string().contains("independent"), "{about}");
    // One that a render may share its samples with is named.
    folder.run(&["render", "lamps.pbrt", "--spp", "64", "--seed", "2", "-o", "shared.exr", "--quiet"]).code(0);
    bench(&folder, &["--reference", "shared.exr"]).code(0);
    let how = folder.json("out/results.json")["scenes"][0]["reference"]["how"].to_string();
    assert!(how.contains("seed 2, as one of the renders"), "{how}");
}

#[test]
fn nonsense_is_refused_before_anything_is_rendered() {
    let folder = lamps("bench-nonsense");
    let run = |arguments: &[&str]| folder.run(&[&["bench"], arguments].concat());
    run(&["lamps.pbrt", "--methods", "tree,best", "--out", "out"]).code(2).says("\"best\"").says("cache-points");
    run(&["lamps.pbrt", "--methods", "mine=--lights bright", "--out", "out"]).code(2).says("mine");
    run(&["lamps.pbrt", "--methods", "mine=--spp 4", "--out", "out"]).code(2).says("the benchmark itself says");
    run(&["lamps.pbrt", "--methods", "tree,tree", "--out", "out"]).code(2).says("twice");
    for wrong in
        [["--runs", "0"], ["--spp", "0"], ["--spp", "4,2"], ["--spp", "x"], ["--time", "0"], ["--suite", "all"]]
    {
        run(&[&["lamps.pbrt", "--out", "out"], &wrong[..]].concat()).code(2);
    }
    run(&["--out", "out"]).code(2);
    run(&["lamps.pbrt"]).code(2);
    run(&["gone.pbrt", "--out", "out"]).code(3).says("gone.pbrt");
    folder.write("odd.pbrt", "WorldBegin\nShape \"sphere\n");
    run(&["odd.pbrt", "--out", "out"]).code(3).says("odd.pbrt:2");
    folder.write("taken", "a file");
    run(&["lamps.pbrt", "--out", "taken"]).code(1).says("taken");
}

#[test]
fn methods_of_ones_own_and_time_in_place_of_samples() {
    let folder = lamps("bench-own");
    let own = "few=--lights cache-points --cache-entries 8 --cache-candidates 500";
    let all = ["bench", "lamps.pbrt", "--methods", "power", "--methods", own, "--time", "0.05", "--runs", "1"];
    let more = ["--reference-spp", "64", "--resolution", "8x6", "--threads", "1", "--out", "out"];
    folder.run(&[&all[..], &more].concat()).code(0);
    let curves = folder.json("out/results.json")["scenes"][0]["curves"].clone();
    assert_eq!(curves[1]["method"]["name"], "few");
    let command = curves[1]["points"][0]["runs"][0]["command"].as_str().expect("a command").to_owned();
    assert!(
        command
            .ends_with("--resolution 8x6 --threads 1 --lights cache-points --cache-entries 8 --cache-candidates 500"),
        "{command}"
    );
    assert_eq!(curves[0]["points"][0]["spp"], 1);
}
