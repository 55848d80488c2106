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
        ("3", "1 of 2 lights emit nothing and are never sampled"),
        ("3", "a light that is stated here emits nothing"),
        ("5", "texture \"grey\" is not used"),
        ("8", "material \"other\" is not used"),
        ("11", "medium \"fog\" is not used"),
        ("12", "object \"thing\" has no instance"),
        ("14", "no medium on either side"),
    ];
    for (line, what) in expected {
        assert!(said.lines().any(|said| said.contains(&format!("s.pbrt:{line}:")) && said.contains(what)), "{what}");
    }
    assert_eq!(said.lines().filter(|line| line.starts_with("warning")).count(), expected.len(), "{said}");
    // What is as it should be has nothing to say, nor has what pbrt-v4 takes and what changes no image here.
    let header = HEADER.replace("Film \"rgb\"", "Film \"rgb\" \"float diagonal\" 35 \"bool savefp16\" true");
    let clean = format!(
        "{header} Accelerator \"bvh\" \"string splitmethod\" \"sah\" Integrator \"volpath\" \"string lightsampler\" \"bvh\" \"bool regularize\" true\n\
         Sampler \"halton\" \"string randomization\" \"none\" WorldBegin LightSource \"infinite\" LightSource \"infinite\" Shape \"sphere\""
    );
    folder.write("clean.pbrt", clean);
    folder.run(&["info", "--strict", "clean.pbrt"]).code(0);
}

/// What a strict look says of a scene, by line; all of it must have a place.
fn strictly(folder: &Folder, world: &str) -> Vec<(u32, String)> {
    folder.write("s.pbrt", format!("{HEADER}WorldBegin {world}"));
    let said = folder.run(&["info", "--strict", "s.pbrt"]).code(3).err;
    let placed = |line: &str| {
        let (line, rest) = line.strip_prefix("warning: s.pbrt:")?.split_once(':')?;
        Some((line.parse().ok()?, rest.split_once(": ")?.1.to_owned()))
    };
    let found: Vec<_> = said.lines().filter(|line| line.starts_with("warning")).map(placed).collect();
    found.into_iter().map(|place| place.unwrap_or_else(|| panic!("without a place: {said}"))).collect()
}

#[track_caller]
fn expect(mut found: Vec<(u32, String)>, expected: &[(u32, &str)]) {
    found.sort();
    let same = found.len() == expected.len()
        && found.iter().zip(expected).all(|(found, expected)| found.0 == expected.0 && found.1.contains(expected.1));
    assert!(same, "expected {expected:#?}, found {found:#?}");
}

/// Users that are not used themselves do not count, however long the chain; those that are do.
#[test]
fn what_only_unused_things_use_is_unused() {
    let folder = Folder::new("chains");
    let world = "LightSource \"infinite\"
Texture \"a\" \"spectrum\" \"constant\"
Texture \"b\" \"spectrum\" \"scale\" \"texture tex\" \"a\"
MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"texture reflectance\" \"b\"
MakeNamedMaterial \"mix\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]
Texture \"c\" \"spectrum\" \"constant\"
Texture \"d\" \"spectrum\" \"scale\" \"texture tex\" \"c\"
Texture \"h\" \"float\" \"constant\" \"float value\" 0.5
MakeNamedMaterial \"n\" \"string type\" \"diffuse\" \"texture reflectance\" \"d\"
MakeNamedMaterial \"mix2\" \"string type\" \"mix\" \"string materials\" [\"n\" \"n\"]
NamedMaterial \"mix2\"
ObjectBegin \"inner\" Shape \"sphere\" \"texture alpha\" \"h\" ObjectEnd
ObjectBegin \"outer\" ObjectInstance \"inner\" ObjectEnd
ObjectInstance \"outer\"
NamedMaterial \"mix\"
ObjectBegin \"lost\" Shape \"sphere\" ObjectEnd
ObjectBegin \"around\" ObjectInstance \"lost\" ObjectEnd
";
    let unused = [
        (3, "2 textures are not used: \"a\" (line 3), \"b\" (line 4)"),
        (5, "2 materials are not used: \"m\" (line 5), \"mix\" (line 6)"),
        (17, "object \"lost\" has no instance"),
        (18, "object \"around\" has no instance"),
    ];
    expect(strictly(&folder, world), &unused);
    // One shape more, and all of it is.
    let world = format!("{world}ObjectInstance \"around\"\n");
    folder.write("all.pbrt", format!("{HEADER}WorldBegin\n{world}"));
    let said = folder.run(&["info", "--strict", "all.pbrt"]).err;
    assert!(!said.contains("not used") && !said.contains("no instance"), "{said}");
}

#[test]
fn files_that_only_unused_things_name_are_looked_for() {
    let folder = Folder::new("unused-files");
    folder.write("there.png", "not looked into");
    std::fs::create_dir(folder.path("folder.png")).expect("a folder");
    let world = "LightSource \"infinite\" Shape \"sphere\"
Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"gone.png\"
Texture \"b\" \"spectrum\" \"imagemap\" \"string filename\" \"there.png\"
Texture \"c\" \"spectrum\" \"imagemap\" \"string filename\" \"folder.png\"
MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"string normalmap\" \"normal.png\"
ObjectBegin \"o\" Material \"diffuse\"
Shape \"plymesh\" \"string filename\" \"gone.ply\" ObjectEnd
MakeNamedMedium \"fog\" \"string type\" \"nanovdb\" \"string filename\" \"gone.nvdb\"
";
    let expected = [
        (3, "3 textures are not used: \"a\" (line 3), \"b\" (line 4), \"c\" (line 5)"),
        (3, "cannot read gone.png: No such file"),
        (5, "cannot read folder.png: not a file"),
        (6, "cannot read normal.png: No such file"),
        (6, "material \"m\" is not used"),
        (7, "object \"o\" has no instance"),
        (8, "cannot read gone.ply: No such file"),
        (9, "cannot read gone.nvdb: No such file"),
        (9, "medium \"fog\" is not used"),
    ];
    expect(strictly(&folder, world), &expected);
}

/// One that is stated anew before anything has returned to it is not used either.
#[test]
fn coordinate_systems_that_nothing_returns_to_are_told() {
    let folder = Folder::new("systems");
    let world = "LightSource \"infinite\" CoordinateSystem \"kept\"
CoordinateSystem \"twice\"
CoordinateSystem \"twice\" CoordSysTransform \"twice\"
CoordinateSystem \"lost\"
CoordSysTransform \"camera\" CoordSysTransform \"kept\" Shape \"sphere\"
";
    let expected = [(3, "coordinate system \"twice\" is not used"), (5, "coordinate system \"lost\" is not used")];
    expect(strictly(&folder, world), &expected);
}

/// Each where it stands; however many there are, the first few of them.
#[test]
fn lights_that_emit_nothing_are_told_where_they_stand() {
    let folder = Folder::new("dark");
    let world = "LightSource \"infinite\"
AttributeBegin
AreaLightSource \"diffuse\" \"rgb L\" [0 0 0]
Shape \"sphere\" Shape \"sphere\" \"float radius\" 2
AttributeEnd
LightSource \"point\"
LightSource \"point\" \"rgb I\" [0 0 0]
LightSource \"distant\" \"rgb L\" [0 0 0]
";
    let expected = [
        (4, "4 of 6 lights emit nothing and are never sampled"),
        (4, "emits nothing"),
        (8, "emits nothing"),
        (9, "emits nothing"),
    ];
    expect(strictly(&folder, world), &expected);
    // So many that they are chosen among by cache points.
    let many = format!("Shape \"sphere\"\n{}", "LightSource \"point\" \"rgb I\" [0 0 0]\n".repeat(500));
    let found = strictly(&folder, &format!("{}{many}", "LightSource \"point\"\n".repeat(500)));
    assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), (503..511).collect::<Vec<_>>());
}
