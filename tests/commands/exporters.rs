//! What other programs write: files of pbrt-v3 and older, of other systems, and of exporters with habits of their own. Each renders, or is refused with one
//! clear line that says what is not understood.

use crate::program::faults::*;
use crate::program::{Folder, HEAD};

const UPGRADE: &str = "pbrt --upgrade";

/// A scene of pbrt-v3 as its exporters write it: an error names the way out, or where there is none the first thing of that version.
#[test]
fn scenes_of_pbrt_v3_are_told_how_to_be_upgraded() {
    let scene = "Integrator \"path\" \"integer maxdepth\" [ 5 ]
Sampler \"02sequence\" \"integer pixelsamples\" [ 4 ]
PixelFilter \"triangle\" \"float xwidth\" [ 1.0 ] \"float ywidth\" [ 1.0 ]
Film \"image\" \"integer xresolution\" [ 8 ] \"integer yresolution\" [ 6 ] \"string filename\" [ \"x.png\" ]
Camera \"perspective\" \"float fov\" [ 35 ]
WorldBegin
MakeNamedMaterial \"Wall\" \"string type\" [ \"matte\" ] \"rgb Kd\" [ 0.7 0.7 0.7 ]
NamedMaterial \"Wall\"
Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point P\" [ -1 -1 3 1 -1 3 0 1 3 ] \"normal N\" [ 0 0 -1 0 0 -1 0 0 -1 ]
AttributeBegin
AreaLightSource \"diffuse\" \"rgb L\" [ 17 12 4 ]
Shape \"sphere\"
AttributeEnd
WorldEnd
";
    let folder = Folder::new("v3");
    folder.write("v3.pbrt", scene);
    for strict in [&[][..], &["--strict"]] {
        let run = folder.run(&[&["render", "v3.pbrt", "-o", "o.exr"], strict].concat()).code(3);
        let warnings = run.err.lines().filter(|line| line.starts_with("warning")).count();
        assert_eq!(warnings, 0, "the way out is told once: {}", run.err);
        assert_eq!(run.err.matches(UPGRADE).count(), 1, "{}", run.err);
        run.says("unknown directive `WorldEnd`").says(UPGRADE);
    }
    // Without its last line the film is what cannot be.
    folder.write("v3.pbrt", scene.replace("WorldEnd\n", ""));
    let run = folder
        .run(&["render", "v3.pbrt", "-o", "o.exr"])
        .code(3)
        .says("film type \"image\" is not known")
        .says(UPGRADE);
    assert!(!run.err.contains("is of pbrt-v3"), "{}", run.err);
    // What is left is replaced, in one line each.
    folder.write("v3.pbrt", scene.replace("WorldEnd\n", "").replace("Film \"image\"", "Film \"rgb\""));
    let run = folder.run(&["render", "v3.pbrt", "-o", "o.exr"]).code(0);
    let said: Vec<&str> = run.err.lines().filter(|line| line.starts_with("warning")).collect();
    for what in
        ["is of pbrt-v3", "sampler \"02sequence\"", "\"xwidth\"", "\"ywidth\"", "type \"matte\" is not supported"]
    {
        assert_eq!(said.iter().filter(|line| line.contains(what)).count(), 1, "{what}: {said:#?}");
    }
    assert_eq!(said.len(), 5, "{said:#?}");
}

#[test]
fn every_old_spelling_has_its_line() {
    each(&[
        ("Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"x.png\"", Refused(UPGRADE)),
        ("Material \"matte\" \"color Kd\" [1 0 0]", Refused(UPGRADE)),
        ("LightSource \"point\" \"xyz I\" [1 1 1]", Refused(UPGRADE)),
        ("WorldEnd", Refused(UPGRADE)),
        ("LightSource \"point\" \"blackbody I\" [6500 1]", Refused(UPGRADE)),
        ("LightSource \"infinite\" \"blackbody L\" [6000 1]", Warned("the first is used")),
        ("LightSource \"infinite\" \"rgb L\" [1 1 1 2 2 2]", Warned("the first is used")),
        ("AreaLightSource \"diffuse\" \"blackbody L\" [6500 1]\nShape \"sphere\"", Refused(UPGRADE)),
        ("LightSource \"point\" \"rgb scale\" [1 1 1]", Refused(UPGRADE)),
        ("AreaLightSource \"diffuse\" \"rgb scale\" [1 1 1]\nShape \"sphere\"", Refused(UPGRADE)),
        ("Texture2 \"x\"", Refused(UPGRADE)),
        ("Material \"uber\" \"rgb Kd\" [1 1 1] \"rgb Ks\" [0 0 0]\nShape \"sphere\"", Warned(UPGRADE)),
        (
            "MakeNamedMaterial \"m\" \"string type\" \"glass\" \"rgb Kr\" [1 1 1]\nNamedMaterial \"m\"\nShape \"sphere\"",
            Warned(UPGRADE),
        ),
        (
            "MakeNamedMedium \"m\" \"string type\" \"heterogeneous\"\nMediumInterface \"m\" \"\"\nMaterial \"interface\"\nShape \"sphere\"",
            Refused(UPGRADE),
        ),
        ("Shape \"nurbs\" \"integer nu\" 4", Warned(UPGRADE)),
        (
            "Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 0 0 0]",
            Warned("\"heightfield\" are not supported"),
        ),
        ("AreaLightSource \"area\" \"rgb L\" [1 1 1]\nShape \"sphere\"", Warned(UPGRADE)),
        ("LightSource \"infinite\" \"string mapname\" \"sky.exr\"", Warned("mapname")),
        (
            "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"float uv\" [0 0 1 0 0 1]",
            Refused("expected point2"),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 st\" [0 0 1 0 0 1]", Warned("\"st\"")),
        ("Material \"diffuse\" \"rgb Kd\" [1 0 0]\nShape \"sphere\"", Warned("\"Kd\"")),
        (
            "LightSource \"distant\" \"rgb L\" [1 1 1] \"point from\" [0 1 0] \"point to\" [0 0 0]\nShape \"sphere\"",
            Renders,
        ),
        ("Material \"none\"\nShape \"sphere\"", Orderly),
        ("TransformBegin\nShape \"sphere\"\nTransformEnd", Warned("deprecated")),
        ("CoordSysTransform \"camera\"\nShape \"sphere\"", Renders),
        ("CoordinateSystem \"here\"\nTranslate 1 0 0\nCoordSysTransform \"here\"\nShape \"sphere\"", Renders),
        (
            "MakeNamedMaterial \"m\" \"string type\" [ \"diffuse\" ] \"rgb reflectance\" [ 1 0 0 ]\nNamedMaterial \"m\"\nShape \"sphere\"",
            Renders,
        ),
        ("Shape \"plymesh\" \"string filename\" \"geometry\\mesh.ply\"", Refused("unknown escape \\m")),
        ("Include \"geometry\\mesh.pbrt\"", Refused("file names take / on every system")),
    ]);
    let header = |line: &str| HEAD.replace("WorldBegin", &format!("{line}\nWorldBegin"));
    let cases = [
        (header("Camera \"environment\""), Refused(UPGRADE)),
        (header("Film \"image\" \"integer xresolution\" 4"), Refused(UPGRADE)),
        (header("SurfaceIntegrator \"path\""), Refused(UPGRADE)),
        (header("Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 2"), Warned(UPGRADE)),
        (header("Integrator \"directlighting\" \"string strategy\" \"one\""), Warned(UPGRADE)),
        (header("Sampler \"nonsense\" \"integer pixelsamples\" 2"), Warned("sampler \"nonsense\"")),
        (header("PixelFilter \"lanczos\""), Warned("lanczos")),
    ];
    each(&cases.each_ref().map(|(text, fate)| (text.as_str(), *fate)));
}

/// Line ends, byte order marks, tabs and numbers of every kind make no difference, and neither do the slashes of file names.
#[test]
fn other_systems_write_the_same_scenes() {
    let folder = Folder::new("systems");
    std::fs::create_dir_all(folder.path("geometry")).expect("a folder");
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n-1 -1 0\n1 -1 0\n0 1 0\n3 0 1 2\n";
    folder
        .write("geometry/tri.PLY", mesh)
        .write("geometry/more.pbrt", "Translate 0.5 0 0\nShape \"sphere\" \"float radius\" 0.5");
    let plain = format!(
        "{HEAD}Shape \"plymesh\" \"string filename\" \"geometry/tri.PLY\"\nTranslate 1 0.5 -0.001\nShape \"disk\" \"float radius\" 0.75\nInclude \"geometry/more.pbrt\"\n"
    );
    let image = |text: &[u8]| {
        folder.write("scene.pbrt", text);
        folder.run(&["render", "scene.pbrt", "-o", "o.exr", "--png", "o.png", "--threads", "1"]).code(0);
        folder.read("o.png")
    };
    let expected = image(plain.as_bytes());
    let numbers = plain.replace("1 0.5 -0.001", "+1. .5 -1.e-3").replace("0.75", "[ 7.5E-1 ]");
    for (what, text) in [
        ("CRLF", plain.replace('\n', "\r\n")),
        ("CR", format!("# comment\r{}", plain.replace('\n', "\r"))),
        ("a byte order mark", format!("\u{feff}{plain}")),
        ("tabs", plain.replace(' ', "\t")),
        ("a comment without an end", format!("# first\n{plain}# last \"unclosed")),
        ("numbers", numbers),
        ("backslashes", plain.replace("geometry/", "geometry\\\\")),
        ("backslashes that are escapes", plain.replace("geometry/tri", "geometry\\tri")),
    ] {
        assert!(image(text.as_bytes()) == expected, "{what}: another image");
    }
    for (number, line) in
        [("-inf", "too large or not finite"), ("1,5", "1,5"), ("1e", "1e"), ("nan", "nan"), ("1.#INF", "1.#INF")]
    {
        folder.write("scene.pbrt", format!("{HEAD}Shape \"sphere\" \"float radius\" {number}\n"));
        folder.run(&["render", "scene.pbrt", "-o", "o.exr"]).code(3).says("scene.pbrt:").says(line);
    }
}

/// Text that is not UTF-8 is read where it can be text at all.
#[test]
fn other_encodings_are_read_or_named() {
    let folder = Folder::new("encodings");
    let render = ["render", "scene.pbrt", "-o", "o.exr"];
    let text = format!(
        "{HEAD}MakeNamedMaterial \"gr?n\" \"string type\" \"diffuse\"\nNamedMaterial \"gr?n\"\nShape \"sphere\"\n"
    );
    folder.write("scene.pbrt", text.bytes().map(|byte| if byte == b'?' { 0xfc } else { byte }).collect::<Vec<u8>>());
    let line = HEAD.lines().count() + 1;
    folder.run(&render).code(0).says(&format!("scene.pbrt:{line}:22: this byte is not UTF-8")).says("Latin-1");
    folder.write("scene.pbrt", text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>());
    folder.run(&render).code(3);
    let marked = "\u{feff}".to_owned() + &text;
    folder.write("scene.pbrt", marked.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>());
    folder.run(&render).code(3).says("scene.pbrt: it seems to be UTF-16 text").says("save it as UTF-8");
    folder.write("scene.pbrt", b"PK\x03\x04\x14\0\0\0");
    folder.run(&render).code(3).says("it seems to be a zip archive");
}

/// The path of an image on the exporter's machine: its own name is left. What the command line names is still an error.
#[test]
fn images_of_folders_that_are_not_here_go_to_this_one() {
    let folder = Folder::new("elsewhere");
    std::fs::create_dir(folder.path("out")).expect("a folder");
    for (name, image, warns) in [
        ("C:/Users/me/a.exr", "a.exr", true),
        ("C:\\\\Users\\\\me\\\\b.png", "b.exr", true),
        ("gone/c.exr", "c.exr", true),
        ("out/d.exr", "out/d.exr", false),
        ("out\\\\e.exr", "out/e.exr", false),
        ("f.exr", "f.exr", false),
    ] {
        let film =
            format!("Film \"rgb\" \"string filename\" \"{name}\" \"integer xresolution\" 4 \"integer yresolution\" 3");
        folder.write("scene.pbrt", format!("{film}\nWorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n"));
        let run = folder.run(&["render", "scene.pbrt", "--spp", "1"]).code(0);
        assert!(folder.path(image).is_file(), "{name}: {}", run.err);
        assert_eq!(run.err.contains("scene.pbrt:1:"), warns, "{name}: {}", run.err);
        if warns {
            run.says("there is no folder").says("-o names another place");
        }
        let run = folder.run(&["render", "scene.pbrt", "--spp", "1", "-o", "o.exr"]).code(0);
        assert!(!run.err.contains("warning"), "{}", run.err);
    }
    folder.run(&["render", "scene.pbrt", "-o", "gone/a.exr"]).code(1).says("there is no folder gone");
}
