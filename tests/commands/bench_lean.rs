//! `lanternfish bench --lean`: what is told of what a scene leaves out, and that nothing stays behind.

use crate::program::{Folder, LAMP};
use serde_json::Value;

/// A row of the report.
fn row<'a>(rows: &'a [Value], system: &str) -> &'a Value {
    rows.iter().find(|row| row["system"] == system).unwrap_or_else(|| panic!("{system}: {rows:?}"))
}

#[test]
fn each_system_that_is_left_out_has_a_row() {
    let folder = Folder::new("bench-lean");
    folder.write("lamp.pbrt", LAMP);
    let run = folder.run(&["bench", "lamp.pbrt", "--lean=only", "--spp", "4", "--runs", "2", "--out", "out"]).code(0);
    assert!(run.out.contains("lamp: what it leaves out") && run.out.contains("in-scatter sampling"), "{}", run.out);

    let report = folder.json("out/results.json");
    assert_eq!(report["scenes"], Value::Array(vec![]));
    let lean = &report["lean"][0];
    assert_eq!((&lean["scene"], &lean["spp"], &lean["pixels"][0]), (&"lamp".into(), &4.into(), &16.into()));
    let rows = lean["rows"].as_array().expect("rows").clone();
    for system in ["instances", "motion blur", "moving camera", "opacity", "textures", "media", "density bounds"] {
        assert!(row(&rows, system)["text"].as_str().is_some_and(|text| text.contains("Include \"lamp.pbrt\"")));
    }
    for system in ["in-scatter sampling", "volume lights", "light selection", "light linking", "curves", "relief"] {
        assert_eq!(row(&rows, system)["rounds"].as_array().map(Vec::len), Some(2), "{system}");
    }
    // There is a sphere; boundaries come with media; the camera's lens cannot be changed from outside.
    assert!(rows.iter().all(|row| row["system"] != "spheres, disks" && row["system"] != "medium boundaries"));
    assert!(lean["notes"][0].as_str().is_some_and(|note| note.contains("depth of field")), "{lean}");
    let has_reader = rows.iter().any(|row| row["system"] == "volume reader");
    assert_eq!(has_reader, cfg!(feature = "openvdb"));
    // What is out of sight changes no pixel; what changes the draws of lights does.
    for system in ["instances", "displacement", "opacity", "relief", "media", "light linking"] {
        assert_eq!(row(&rows, system)["is_same_image"], true, "{system}");
    }
    assert_eq!(row(&rows, "light selection")["is_same_image"], false);
    let choice = row(&rows, "cache points for lights");
    assert_eq!((&choice["arguments"][1], &choice["verdict"]), (&"cache-points".into(), &"in_use".into()));

    let csv = String::from_utf8(folder.read("out/lean.csv")).expect("text");
    assert_eq!(csv.lines().count(), 1 + 4 * rows.len());
    let page = String::from_utf8(folder.read("out/index.html")).expect("text");
    assert!(page.contains("What is left out") && page.contains("MakeNamedMedium &quot;lean&quot;"));
    // The scene's folder is as it was.
    assert_eq!(folder.listing().into_keys().collect::<Vec<_>>(), ["lamp.pbrt", "out"]);
}

#[test]
fn it_comes_after_the_errors_where_both_are_wanted() {
    let folder = Folder::new("bench-lean-also");
    folder.write("lamp.pbrt", LAMP);
    let all = ["bench", "lamp.pbrt", "--lean", "--methods", "auto", "--spp", "2", "--runs", "1", "--out", "out"];
    folder.run(&all).code(0);
    let report = folder.json("out/results.json");
    assert_eq!(report["scenes"][0]["curves"][0]["points"][0]["spp"], 2);
    assert!(report["lean"][0]["rows"].as_array().is_some_and(|rows| rows.len() > 10));
    folder.run(&["bench", "lamp.pbrt", "--lean=perhaps", "--out", "out"]).code(2);
}
