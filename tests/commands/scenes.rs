//! `lanternfish try` and `lanternfish info --strict`: what people who look after scenes ask.

use crate::program::Folder;

const HEADER: &str = "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6 Camera \"perspective\"\n";

/// A folder of scenes that work, warn, are wrong, and are no scenes.
#[test]
fn a_folder_of_scenes_is_tried_one_by_one() {
    let folder = Folder::new("tried");
    std::fs::create_dir_all(folder.path("scenes/below")).expect("folders");
    let write = |name: &str, text: String| folder.write(name, text);
    write("scenes/a.pbrt", format!("{HEADER}WorldBegin LightSource \"infinite\" Include \"part.pbrt\""));
    write("scenes/part.pbrt", "Shape \"sphere\"".to_owned());
    write("scenes/below/b.pbrt", format!("{HEADER}WorldBegin LightSource \"infinite\" \"float wattage\" 3"));
    write("scenes/wrong.pbrt", format!("{HEADER}WorldBegin\nShape \"sphere\" \"float radius\" -1"));
    let table = folder.run(&["try", "scenes", "--spp", "2", "--out", "out"]).code(3).out.clone();
    println!("{table}");
    let row =
        |name: &str| table.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{name}")).to_owned();
    assert!(!table.contains("part.pbrt"));
    assert!(row("a.pbrt").trim_end().ends_with("0  ok") && row("b.pbrt").trim_end().ends_with("1  ok"));
    let wrong = row("wrong.pbrt");
    assert!(wrong.contains("radius") && wrong.contains("wrong.pbrt:3:"), "{wrong}");
    assert!(table.contains("2 of 3 scenes work"));
    assert!(folder.path("out/001-a.png").is_file());
    let all =
        folder.run(&["try", "scenes/a.pbrt", "scenes/below", "--resolution", "4x4", "--json"]).code(0).out.clone();
    let rows: serde_json::Value = serde_json::from_str(&all).expect("JSON");
    assert_eq!((&rows[0]["verdict"], &rows[1]["warnings"].as_array().expect("a list").len()), (&"ok".into(), &1));
    assert!(rows[0]["seconds"].as_f64().is_some_and(|s| s > 0.0) && rows[0]["peak_memory"].as_u64().is_some());
    folder.run(&["try", "out"]).code(3).says("no scenes");
}

#[test]
fn a_scene_that_takes_too_long_is_ended() {
    let folder = Folder::new("slow");
    let scene = "Film \"rgb\" \"integer xresolution\" 400 \"integer yresolution\" 400 WorldBegin LightSource \"infinite\" Shape \"sphere\"";
    folder.write("slow.pbrt", scene);
    let table = folder.run(&["try", "slow.pbrt", "--spp", "1000000", "--time-limit", "0.5"]).code(3).out.clone();
    assert!(table.contains("not done after 0.5 s"), "{table}");
}

/// Everything that is stated to no effect, at its line.
#[test]
fn a_strict_look_names_what_is_unused() {
    let folder = Folder::new("linted");
    let scene = format!(
        "{HEADER}WorldBegin
LightSource \"infinite\" \"float scale\" 0
LightSource \"infinite\"
Texture \"grey\" \"spectrum\" \"constant\"
Texture \"used\" \"spectrum\" \"constant\"
MakeNamedMaterial \"plain\" \"string type\" \"diffuse\" \"texture reflectance\" \"used\"
MakeNamedMaterial \"other\" \"string type\" \"diffuse\"
MakeNamedMaterial \"mixed\" \"string type\" \"diffuse\"
MakeNamedMaterial \"mix\" \"string type\" \"mix\" \"string materials\" [\"mixed\" \"plain\"]
MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"
ObjectBegin \"thing\" Shape \"sphere\" ObjectEnd
NamedMaterial \"mix\" Shape \"sphere\"
Material \"interface\" Shape \"sphere\"
"
    );
    folder.write("s.pbrt", scene);
    assert!(!folder.run(&["info", "s.pbrt"]).code(0).err.contains("grey"));
    let said = folder.run(&["info", "--strict", "s.pbrt"]).code(3).err.clone();
    println!("{said}");
    let expected = [
        ("3", "\"scale\" is 0"),
        ("4", "2 infinite lights"),
        ("5", "texture \"grey\" is not used"),
        ("8", "material \"other\" is not used"),
        ("11", "medium \"fog\" is not used"),
        ("12", "object \"thing\" has no instance"),
        ("14", "no medium on either side"),
    ];
    for (line, what) in expected {
        assert!(said.lines().any(|said| said.contains(&format!("s.pbrt:{line}:")) && said.contains(what)), "{what}");
    }
    // And one without a place: how many lights emit nothing.
    assert_eq!(said.lines().filter(|line| line.starts_with("warning")).count(), expected.len() + 1, "{said}");
    // What is as it should be has nothing to say.
    let clean = format!("{HEADER}WorldBegin LightSource \"infinite\" Shape \"sphere\"");
    folder.write("clean.pbrt", clean);
    folder.run(&["info", "--strict", "clean.pbrt"]).code(0);
}
