//! Truncated, corrupted and nonsensical files through the built program: each is refused with exit code 3 and a message that
//! names the file and the place, or renders; nothing panics, hangs, takes more than 2 s of processor time or 4 GiB, and
//! a refused scene leaves no file behind.

mod program;

use program::{Folder, HEAD, Random, damage};

/// What a scene must come to.
#[derive(Clone, Copy, Debug)]
enum Fate {
    /// Exit code 3 and this in the message.
    Refused(&'static str),
    /// Exit code 4 and this in the message.
    Limit(&'static str),
    /// An image.
    Renders,
    /// An image and this in a warning.
    Warned(&'static str),
    /// Exit code 3, or an image with a warning that a block is never ended.
    Told,
    /// Either, as long as it is orderly.
    Orderly,
}
use Fate::*;

/// What went wrong in the cases of one test: all of them are told at its end.
#[derive(Default)]
struct Faults(Vec<String>);

impl Drop for Faults {
    fn drop(&mut self) {
        assert!(std::thread::panicking() || self.0.is_empty(), "{} cases:\n{}", self.0.len(), self.0.join("\n----\n"));
    }
}

impl Faults {
    /// Renders `scene.pbrt` of the folder and checks what must hold of every run.
    fn render(&mut self, folder: &Folder, what: &str, fate: Fate) {
        if let Err(fault) = render(folder, fate) {
            self.0.push(format!("{what}: {fault}"));
        }
    }
}

fn render(folder: &Folder, fate: Fate) -> Result<(), String> {
    let before = folder.listing();
    let arguments =
        ["render", "scene.pbrt", "-o", "out.exr", "--stats", "out.json", "--png", "out.png", "--threads", "1"];
    let run = folder.start_within(&arguments, 4 << 20, 2).end();
    let mut after = folder.listing();
    let flat = run.err.split_whitespace().collect::<Vec<_>>().join(" ");
    let check = |holds: bool, what: &str| match holds {
        true => Ok(()),
        false => Err(format!("{what}; it ended with {:?} and\n{}", run.code, run.err)),
    };
    check(!run.err.contains("panicked"), "it panicked")?;
    let mut written = 0;
    for file in ["out.exr", "out.json", "out.png"] {
        written += i32::from(after.remove(file).is_some());
        let _ = std::fs::remove_file(folder.path(file));
    }
    check(matches!(run.code, Some(0 | 3 | 4)), "neither done nor refused")?;
    check(written == if run.code == Some(0) { 3 } else { 0 }, "output is missing or left behind")?;
    check(before == after, "files were left behind")?;
    check(run.code == Some(0) || run.err.contains("error: "), "no message")?;
    // A place: scene.pbrt:4:1, or the file that is at fault.
    let placed = flat.contains("scene.pbrt:") || flat.contains("junk:") || flat.contains("cannot read");
    let (code, needle) = match fate {
        Refused(needle) => (Some(3), needle),
        Limit(needle) => (Some(4), needle),
        Renders => (Some(0), ""),
        Warned(needle) => (Some(0), needle),
        Told if run.code == Some(0) => (Some(0), "never ended"),
        Told => (Some(3), ""),
        Orderly => (run.code, ""),
    };
    check(run.code == code, &format!("expected to end with {code:?}"))?;
    check(flat.contains(needle), &format!("expected {needle:?}"))?;
    check(run.code == Some(0) || placed, "no place")
}

fn each(cases: &[(&str, Fate)]) {
    let folder = Folder::new("nonsense");
    let mut faults = Faults::default();
    for (text, fate) in cases {
        let text = if text.contains("WorldBegin") { (*text).to_owned() } else { format!("{HEAD}{text}\n") };
        folder.write("scene.pbrt", &text);
        faults.render(&folder, &text, *fate);
    }
}

/// Everything within one pair of attributes, so that no beginning of it is a scene.
const WHOLE: &str = r#"# a scene
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40 "float lensradius" 0.01 "float focaldistance" 5
Film "rgb" "integer xresolution" 8 "integer yresolution" 6 "string filename" "out.exr"
PixelFilter "gaussian" "float xradius" 1.5
Sampler "zsobol" "integer pixelsamples" 2
Integrator "volpath" "integer maxdepth" 4
WorldBegin
AttributeBegin
  MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_s" [0.1 0.2 0.3] "rgb sigma_a" [0.1 0.1 0.1] "float g" 0.3
  MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [0.8 0.1 0.1]
  Texture "t" "spectrum" "scale" "rgb tex" [0.5 0.5 0.5] "float scale" 2
  AttributeBegin
    AreaLightSource "diffuse" "blackbody L" 3000 "float scale" 2
    Translate 0 2 0
    Shape "sphere" "float radius" 0.5
  AttributeEnd
  LightSource "spot" "point3 from" [0 3 -3] "point3 to" [0 0 0] "rgb I" [9 9 9]
  ObjectBegin "thing"
    NamedMaterial "red"
    Shape "disk" "float radius" 0.3
    Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 1]
  ObjectEnd
  ObjectInstance "thing"
  AttributeBegin
    Material "interface"
    MediumInterface "fog" ""
    Shape "sphere" "float radius" 1.5
  AttributeEnd
  Material "coateddiffuse" "texture reflectance" "t" "float roughness" 0.1
  Shape "trianglemesh" "point3 P" [-5 -1 -5  5 -1 -5  5 -1 5  -5 -1 5] "integer indices" [0 1 2 0 2 3]
  Shape "curve" "point3 P" [-1 0 0  0 1 0  0 -1 0  1 0 0] "float width" 0.1
AttributeEnd
"#;

#[test]
fn no_beginning_of_a_scene_is_a_scene() {
    let folder = Folder::new("beginnings");
    let mut faults = Faults::default();
    folder.write("scene.pbrt", WHOLE);
    faults.render(&folder, "the whole", Renders);
    let length = WHOLE.trim_end().len();
    for part in 0..40 {
        let text = &WHOLE[..part * length / 40];
        folder.write("scene.pbrt", text);
        // pbrt only warns of a block that the end of the file ends.
        faults.render(&folder, &format!("the first {} bytes", text.len()), Told);
    }
}

#[test]
fn damaged_scenes() {
    let folder = Folder::new("damaged");
    let mut faults = Faults::default();
    let mut random = Random(1);
    for number in 0..60 {
        let bytes = damage(WHOLE.as_bytes(), &mut random);
        folder.write("scene.pbrt", &bytes);
        faults.render(&folder, &format!("damage {number}: {}", String::from_utf8_lossy(&bytes)), Orderly);
    }
}

const PLY: &str = "Material \"diffuse\"\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n";

/// A mesh of 4 × 4 vertices.
fn ply(binary: bool) -> Vec<u8> {
    let format = if binary { "binary_little_endian" } else { "ascii" };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment a sheet\nelement vertex 16\nproperty float x\nproperty float y\nproperty float z\n\
         element face 9\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for i in 0..16 {
        let point = [(i % 4) as f32, (i / 4) as f32, ((i * 7) % 3) as f32 * 0.1];
        match binary {
            true => point.iter().for_each(|v| bytes.extend(v.to_le_bytes())),
            false => bytes.extend(format!("{} {} {}\n", point[0], point[1], point[2]).bytes()),
        }
    }
    for i in 0..9 {
        let corner = i % 3 + i / 3 * 4;
        let face = [corner, corner + 1, corner + 5, corner + 4];
        match binary {
            true => {
                bytes.push(4);
                face.iter().for_each(|v: &i32| bytes.extend(v.to_le_bytes()));
            }
            false => bytes.extend(format!("4 {} {} {} {}\n", face[0], face[1], face[2], face[3]).bytes()),
        }
    }
    bytes
}

#[test]
fn damaged_meshes() {
    let folder = Folder::new("ply");
    let mut faults = Faults::default();
    folder.write("scene.pbrt", format!("{HEAD}{PLY}"));
    for binary in [false, true] {
        let whole = ply(binary);
        folder.write("mesh.ply", &whole);
        faults.render(&folder, "the whole", Renders);
        let length = whole.trim_ascii_end().len();
        for part in 0..10 {
            folder.write("mesh.ply", &whole[..part * length / 10]);
            faults.render(&folder, &format!("the first {part}/10"), Refused("mesh.ply"));
        }
        let mut random = Random(2);
        for number in 0..30 {
            folder.write("mesh.ply", damage(&whole, &mut random));
            faults.render(&folder, &format!("damage {number}, binary: {binary}"), Orderly);
        }
    }
    let header = |vertices: &str, faces: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let three = "0 0 0\n1 0 0\n0 1 0\n";
    for (text, fate) in [
        (header("4000000000", "1") + three, Refused("mesh.ply")),
        (header("18446744073709551615", "1") + three, Refused("mesh.ply")),
        (header("-3", "1") + three, Refused("mesh.ply")),
        (header("3", "1") + three + "3 0 1 2147483647\n", Refused("mesh.ply")),
        (header("3", "1") + three + "3 0 1 -1\n", Refused("mesh.ply")),
        (header("3", "1") + three + "3 0 1 3\n", Refused("mesh.ply")),
        (header("3", "1") + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", Refused("mesh.ply")),
        (header("3", "1") + "0 0 0\ninf 0 0\n0 1 0\n3 0 1 2\n", Refused("mesh.ply")),
        (header("3", "1") + "0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n", Renders),
        (header("3", "1") + "0 0 0\n1e38 0 0\n0 1e38 0\n3 0 1 2\n", Orderly),
        ("this is text".to_owned(), Refused("mesh.ply")),
        (String::new(), Refused("mesh.ply")),
    ] {
        folder.write("mesh.ply", &text);
        faults.render(&folder, &text, fate);
    }
}

#[test]
fn missing_files_and_wrong_ones() {
    let folder = Folder::new("files");
    let mut faults = Faults::default();
    std::fs::create_dir(folder.path("folder")).expect("a folder");
    folder.write(
        "junk",
        (0..5000u32).flat_map(|i| (i.wrapping_mul(2_654_435_761) ^ i).to_le_bytes()).collect::<Vec<_>>(),
    );
    folder
        .write("junk.png", folder.read("junk"))
        .write("junk.ply", folder.read("junk"))
        .write("junk.vdb", folder.read("junk"));
    folder.write("empty", "").write("cut.exr", [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
    folder.write("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0");
    folder.write("loop.pbrt", "Include \"loop.pbrt\"\n").write("cut.pbrt.gz", [0x1f, 0x8b, 8, 0, 1, 2, 3]);
    for name in ["missing", "folder", "junk", "empty"] {
        for text in [
            format!("Include \"{name}\""),
            format!("Import \"{name}\""),
            format!("Shape \"plymesh\" \"string filename\" \"{name}\""),
            format!(
                "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\""
            ),
            format!("LightSource \"infinite\" \"string filename\" \"{name}\""),
            format!(
                "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"{name}\"\nMaterial \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\""
            ),
        ] {
            // An empty file to include holds nothing, which is no error.
            let fate = match text.as_bytes()[0] {
                b'I' if name == "empty" => Renders,
                // A missing texture is magenta, unless --strict says otherwise.
                b'T' => Warned(name),
                _ => Refused(name),
            };
            folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
            faults.render(&folder, &text, fate);
        }
    }
    for (text, named) in [
        ("Include \"loop.pbrt\"", "loop.pbrt"),
        ("Include \"cut.pbrt.gz\"", "cut.pbrt.gz"),
        ("LightSource \"infinite\" \"string filename\" \"cut.png\"", "cut.png"),
        ("LightSource \"infinite\" \"string filename\" \"cut.exr\"", "cut.exr"),
        ("LightSource \"infinite\" \"string filename\" \"junk.png\"", "junk.png"),
        ("Shape \"plymesh\" \"string filename\" \"junk.ply\"", "junk.ply"),
    ] {
        folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
        let run = folder.start_within(&["render", "scene.pbrt", "-o", "out.exr"], 4 << 20, 2).end();
        assert!(matches!(run.code, Some(3 | 4)), "{text}: {run:?}");
        run.says(named);
    }
    for name in ["missing.pbrt", "folder", "junk", "empty", "junk.png", "junk.vdb", "cut.exr"] {
        let before = folder.listing();
        folder.run(&["render", name]).code(3).says(name);
        folder.run(&["info", name]).code(3).says(name);
        folder.run(&["compare", name, name]).code(3).says(name);
        assert_eq!(before, folder.listing());
    }
}

#[test]
fn nonsensical_settings() {
    let with = |line: &str| format!("{line}\n{}", &HEAD[HEAD.find("WorldBegin").expect("it is there")..]);
    let folder = Folder::new("settings");
    let mut faults = Faults::default();
    for (text, fate) in [
        ("Camera \"perspective\" \"float fov\" 0", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" -20", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" 180", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" 1e30", Refused("fov")),
        ("Camera \"perspective\" \"float fov\" nan", Refused("nan")),
        ("Camera \"perspective\" \"float lensradius\" -1", Refused("lensradius")),
        ("Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 0", Refused("focaldistance")),
        ("Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 0", Refused("shutter")),
        ("Camera \"perspective\" \"float screenwindow\" [0 0 0 0]", Refused("screenwindow")),
        ("Camera \"perspective\" \"float frameaspectratio\" 0", Refused("frameaspectratio")),
        ("Camera \"nonsense\"", Refused("nonsense")),
        ("LookAt 0 0 0 0 0 0 0 1 0\nCamera \"perspective\"", Refused("LookAt")),
        ("LookAt 0 0 0 0 1 0 0 1 0\nCamera \"perspective\"", Refused("LookAt")),
        ("Scale 0 1 1\nCamera \"perspective\"", Refused("scene.pbrt")),
        ("Transform [0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1]\nCamera \"perspective\"", Refused("scene.pbrt")),
        ("Translate 1e38 1e38 1e38\nTranslate 1e38 1e38 1e38\nCamera \"perspective\"", Orderly),
        ("Film \"rgb\" \"integer xresolution\" 0", Refused("xresolution")),
        ("Film \"rgb\" \"integer xresolution\" -5", Refused("xresolution")),
        ("Film \"rgb\" \"integer xresolution\" 100000 \"integer yresolution\" 100000", Limit("pixels")),
        ("Film \"rgb\" \"integer xresolution\" 16777215 \"integer yresolution\" 16", Limit("memory")),
        ("Film \"rgb\" \"integer xresolution\" 2147483648", Refused("2147483648")),
        ("Film \"rgb\" \"float cropwindow\" [0.5 0.5 0 1]", Refused("crop")),
        ("Film \"rgb\" \"float cropwindow\" [0 1]", Refused("cropwindow")),
        ("Film \"rgb\" \"float iso\" 0", Refused("iso")),
        ("PixelFilter \"gaussian\" \"float xradius\" 0", Refused("xradius")),
        ("PixelFilter \"gaussian\" \"float sigma\" -1", Refused("sigma")),
        ("PixelFilter \"box\" \"float xradius\" 1e30", Orderly),
        ("Sampler \"zsobol\" \"integer pixelsamples\" 0", Refused("pixelsamples")),
        ("Sampler \"zsobol\" \"integer pixelsamples\" -3", Refused("pixelsamples")),
        ("Sampler \"zsobol\" \"integer pixelsamples\" 2147483648", Refused("2147483648")),
        ("Integrator \"volpath\" \"integer maxdepth\" -1", Refused("maxdepth")),
        ("Integrator \"volpath\" \"float maxdepth\" 3", Refused("maxdepth")),
    ] {
        folder.write("scene.pbrt", with(text));
        let tiny = ["Film", "Sampler"].iter().any(|d| text.starts_with(d));
        if !tiny {
            folder.write("scene.pbrt", with(&format!("{text}\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6\nSampler \"zsobol\" \"integer pixelsamples\" 2")));
        }
        faults.render(&folder, text, fate);
    }
}

#[test]
fn nonsensical_shapes() {
    each(&[
        ("Shape \"sphere\" \"float radius\" -1", Refused("radius")),
        ("Shape \"sphere\" \"float radius\" 0", Refused("radius")),
        ("Shape \"sphere\" \"float radius\" 1e30", Orderly),
        ("Shape \"sphere\" \"float radius\" 1e-30", Orderly),
        ("Shape \"sphere\" \"float phimax\" 0", Orderly),
        ("Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 1", Orderly),
        ("Shape \"disk\" \"float radius\" -1", Refused("radius")),
        ("Shape \"disk\" \"float radius\" 1 \"float innerradius\" 2", Refused("innerradius")),
        ("Shape \"trianglemesh\"", Refused("\"P\"")),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2147483647]",
            Refused("indices"),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 -1]", Refused("indices")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]", Refused("indices")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]", Refused("indices")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point3 P\" [0 0 0]", Refused("\"P\"")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2]", Refused("groups of 3")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 nan 0 0 0 1 0] \"integer indices\" [0 1 2]", Refused("nan")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1e999 0 0 0 1 0] \"integer indices\" [0 1 2]", Refused("1e999")),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]", Renders),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal3 N\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal3 N\" [0 0 1] \"integer indices\" [0 1 2]",
            Refused("\"N\""),
        ),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [0 0] \"integer indices\" [0 1 2]",
            Refused("\"uv\""),
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [-3e38 0 0 3e38 0 0 0 3e38 0] \"integer indices\" [0 1 2]", Orderly),
        ("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0 0 0 0]", Renders),
        ("Shape \"curve\" \"point3 P\" [0 0 0 0 0 0 0 0 0 0 0 0]", Orderly),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"float width\" -1", Orderly),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0]", Refused("control points")),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"integer degree\" 99", Refused("degree")),
        ("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"integer splitdepth\" 1000", Orderly),
        ("Shape \"nonsense\"", Warned("nonsense")),
        ("Scale 0 1 1\nShape \"sphere\"", Refused("scene.pbrt")),
        ("Scale 0 0 0\nShape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]", Orderly),
        ("Rotate 30 0 0 0\nShape \"sphere\"", Orderly),
        ("Scale 1e30 1e30 1e30\nScale 1e30 1e30 1e30\nShape \"sphere\"", Orderly),
        ("Scale 1e-30 1e-30 1e-30\nScale 1e-30 1e-30 1e-30\nShape \"sphere\"", Orderly),
        ("ActiveTransform EndTime\nScale 0 0 0\nActiveTransform All\nShape \"sphere\"", Refused("flattened")),
        ("ObjectBegin \"a\"\nObjectInstance \"a\"\nObjectEnd\nObjectInstance \"a\"", Orderly),
        ("ObjectInstance \"nothing\"", Refused("nothing")),
        ("Scale 1e10 1e10 1e10\nShape \"sphere\" \"float radius\" 1e10", Refused("beyond")),
        ("# \u{e9}\nShape \"sphere\"", Renders),
        ("Attribute \"shape\" \"float zork\" 1\nShape \"sphere\"", Warned("\"zork\" of Attribute")),
        (
            "AreaLightSource \"diffuse\"\nMaterial \"interface\"\nShape \"sphere\"",
            Warned("area light on a shape of material"),
        ),
        ("ObjectBegin \"a\"\nObjectEnd\nObjectInstance \"a\"", Renders),
        ("ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 0 0 0\nObjectInstance \"a\"", Warned("flattened")),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nActiveTransform EndTime\nScale 0 1 1\nObjectInstance \"a\"",
            Refused("flattened"),
        ),
        (
            "ObjectBegin \"a\"\nShape \"sphere\"\nObjectEnd\nScale 1e15 1e15 1e15\nScale 1e15 1e15 1e15\nObjectInstance \"a\"",
            Refused("instance"),
        ),
        ("ActiveTransform EndTime\nTranslate 1e30 0 0\nActiveTransform All\nShape \"sphere\"", Refused("beyond")),
        ("AttributeEnd", Refused("AttributeEnd")),
        ("ObjectEnd", Refused("ObjectEnd")),
        ("WorldBegin\nWorldBegin", Refused("WorldBegin")),
        ("Include \"scene.pbrt\"", Refused("scene.pbrt")),
    ]);
}

#[test]
fn nonsensical_lights() {
    each(&[
        ("LightSource \"point\" \"rgb I\" [-1 -1 -1]", Orderly),
        ("LightSource \"point\" \"rgb I\" [1e38 1e38 1e38] \"float scale\" 1e38", Orderly),
        ("LightSource \"point\" \"blackbody I\" 0", Orderly),
        ("LightSource \"point\" \"blackbody I\" -5", Refused("scene.pbrt")),
        ("LightSource \"point\" \"float power\" -5", Orderly),
        ("LightSource \"point\" \"point3 from\" [0 0 -5]\nShape \"sphere\"", Renders),
        ("LightSource \"spot\" \"point3 from\" [0 0 0] \"point3 to\" [0 0 0]", Refused("scene.pbrt")),
        ("LightSource \"spot\" \"float coneangle\" 0", Orderly),
        ("LightSource \"spot\" \"float coneangle\" 400", Orderly),
        ("LightSource \"distant\" \"point3 from\" [0 0 0] \"point3 to\" [0 0 0]", Refused("scene.pbrt")),
        ("LightSource \"infinite\" \"rgb L\" [1 1]", Refused("groups of 3")),
        ("LightSource \"nonsense\"", Warned("nonsense")),
        ("Scale 0 0 0\nLightSource \"point\"", Orderly),
        ("AreaLightSource \"nonsense\"\nShape \"sphere\"", Warned("nonsense")),
        (
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        ("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"disk\" \"float radius\" 1e-30", Orderly),
        (
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float power\" 5\nShape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]",
            Renders,
        ),
        ("AreaLightSource \"diffuse\" \"string filename\" \"missing.png\"\nShape \"sphere\"", Orderly),
    ]);
}

#[test]
fn nonsensical_materials() {
    each(&[
        ("Material \"nonsense\"\nShape \"sphere\"", Orderly),
        ("NamedMaterial \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"diffuse\" \"texture reflectance\" \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"diffuse\" \"rgb reflectance\" [1e30 -1 5]\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" 0\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" -1.5\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"float eta\" 1e30\nShape \"sphere\"", Orderly),
        ("Material \"dielectric\" \"spectrum eta\" \"nothing\"\nShape \"sphere\"", Refused("nothing")),
        ("Material \"conductor\" \"float roughness\" -1\nShape \"sphere\"", Orderly),
        ("Material \"conductor\" \"float roughness\" 1e30\nShape \"sphere\"", Orderly),
        ("Material \"coateddiffuse\" \"float thickness\" -1\nShape \"sphere\"", Orderly),
        (
            "Material \"coateddiffuse\" \"integer maxdepth\" 2147483647 \"integer nsamples\" 2147483647\nShape \"sphere\"",
            Refused("maxdepth"),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"]\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("\"a\""),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\" \"string materials\" [\"b\" \"b\"]\nMakeNamedMaterial \"b\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"]\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("scene.pbrt"),
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mix\"\nNamedMaterial \"a\"\nShape \"sphere\"",
            Refused("materials"),
        ),
        ("MakeNamedMaterial \"a\"\nNamedMaterial \"a\"\nShape \"sphere\"", Refused("type")),
        (
            "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"t\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"",
            Refused("\"t\""),
        ),
        ("Texture \"t\" \"nonsense\" \"constant\"", Refused("nonsense")),
        (
            "Texture \"t\" \"float\" \"nonsense\"\nMaterial \"diffuse\"\nShape \"sphere\" \"texture alpha\" \"t\"",
            Orderly,
        ),
        (
            "Texture \"t\" \"spectrum\" \"imagemap\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"",
            Refused("filename"),
        ),
        ("Shape \"sphere\" \"float alpha\" -3", Orderly),
        ("Shape \"sphere\" \"texture alpha\" \"nothing\"", Refused("nothing")),
    ]);
}

#[test]
fn nonsensical_media() {
    let inside = "\nMaterial \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\" \"float radius\" 2";
    let medium = |parameters: &str| format!("MakeNamedMedium \"m\" \"string type\" {parameters}{inside}");
    let folder = Folder::new("media");
    let mut faults = Faults::default();
    let mut cases = vec![
        (medium("\"nonsense\""), Refused("nonsense")),
        (medium("\"cloud\""), Refused("cloud")),
        (medium("\"openvdb\""), Refused("openvdb")),
        (format!("MakeNamedMedium \"m\"{inside}"), Refused("type")),
        (inside.to_owned(), Refused("\"m\"")),
        ("MediumInterface \"nothing\" \"\"\nMaterial \"interface\"\nShape \"sphere\"".to_owned(), Refused("nothing")),
        (medium("\"homogeneous\" \"float g\" 1"), Renders),
        (medium("\"homogeneous\" \"float g\" -1"), Renders),
        (medium("\"homogeneous\" \"float g\" 1.5"), Refused("\"g\"")),
        (medium("\"homogeneous\" \"float scale\" -1"), Refused("scale")),
        (medium("\"homogeneous\" \"rgb sigma_s\" [-1 -1 -1] \"rgb sigma_a\" [-1 -1 -1]"), Orderly),
        (medium("\"uniformgrid\""), Refused("density")),
        (medium("\"uniformgrid\" \"float density\" [1 1 1] \"integer nx\" 2"), Refused("density")),
        (medium("\"uniformgrid\" \"float density\" [1] \"integer nx\" 0"), Refused("nx")),
        (medium("\"uniformgrid\" \"float density\" [1] \"integer nx\" -7"), Refused("nx")),
        (
            medium(
                "\"uniformgrid\" \"float density\" [1] \"integer nx\" 2147483647 \"integer ny\" 2147483647 \"integer nz\" 2147483647",
            ),
            Refused("density"),
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [0 0 0 0 0 0 0 0] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2",
            ),
            Renders,
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [-1 1 1e38 1 1 1 1 1] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2",
            ),
            Refused("extinction"),
        ),
        (medium("\"uniformgrid\" \"float density\" [nan]"), Refused("nan")),
        (
            medium("\"uniformgrid\" \"float density\" [1] \"point3 p0\" [0 0 0] \"point3 p1\" [0 0 0]"),
            Refused("volume"),
        ),
        (
            medium(
                "\"uniformgrid\" \"float density\" [1] \"point3 p0\" [-3e38 -3e38 -3e38] \"point3 p1\" [3e38 3e38 3e38]",
            ),
            Orderly,
        ),
        (
            format!(
                "AttributeBegin\nScale 0 1 1\nMakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"float density\" [1]\nAttributeEnd{inside}"
            ),
            Refused("scene.pbrt"),
        ),
        (medium("\"rgbgrid\""), Refused("sigma")),
        (medium("\"rgbgrid\" \"rgb sigma_s\" [1 1 1 1 1 1]"), Refused("sigma_s")),
        (
            medium("\"rgbgrid\" \"rgb sigma_s\" [1e38 1e38 1e38] \"rgb sigma_a\" [1e38 1e38 1e38]"),
            Refused("extinction"),
        ),
        (medium("\"rgbgrid\" \"rgb sigma_s\" [1 1 1] \"float Lescale\" 2 \"rgb Le\" [1 1 1]"), Refused("Le")),
    ];
    for strength in ["0", "1e-9", "1e-30", "1e9", "1e30", "3e38"] {
        let coefficients =
            format!("\"rgb sigma_s\" [{strength} {strength} {strength}] \"rgb sigma_a\" [{strength} 0 {strength}]");
        let fate = |is_too_much| if is_too_much { Refused("\"m\"") } else { Renders };
        cases.push((medium(&format!("\"homogeneous\" {coefficients}")), fate(strength == "3e38")));
        cases.push((
            medium(&format!("\"homogeneous\" {coefficients} \"float scale\" {strength} \"rgb Le\" [1 1 1]")),
            fate(strength.ends_with('0') && !strength.contains('-') && strength != "0" || strength == "3e38"),
        ));
        cases.push((medium(&format!("\"uniformgrid\" {coefficients} \"float density\" [1 2 3 4 0 0 0 1] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\" [-2 -2 -2] \"point3 p1\" [2 2 2]")), fate(["1e9", "1e30", "3e38"].contains(&strength))));
    }
    for (text, fate) in &cases {
        let text = format!("{HEAD}{text}\n");
        folder.write("scene.pbrt", &text);
        faults.render(&folder, &text, *fate);
    }
}

/// Names that name each other twice double at every level: textures, mixes, objects.
#[test]
fn what_doubles_at_every_level_is_bounded() {
    let levels = |count: usize, first: &str, line: &dyn Fn(usize) -> String, last: &str| {
        let lines: Vec<String> = (1..count).map(line).collect();
        format!("{first}\n{}\n{last}", lines.join("\n"))
    };
    let image = "Texture \"t0\" \"float\" \"imagemap\" \"string filename\" \"junk.png\"";
    let scale = |i: usize| {
        let below = i - 1;
        format!("Texture \"t{i}\" \"float\" \"scale\" \"texture tex\" \"t{below}\" \"texture scale\" \"t{below}\"")
    };
    let rough = |top: usize| format!("Material \"conductor\" \"texture roughness\" \"t{top}\"\nShape \"sphere\"");
    let mix = |i: usize| {
        let below = i - 1;
        format!("MakeNamedMaterial \"m{i}\" \"string type\" \"mix\" \"string materials\" [\"m{below}\" \"m{below}\"]")
    };
    let object = |i: usize| {
        let below = i - 1;
        format!("ObjectBegin \"o{i}\" ObjectInstance \"o{below}\" ObjectInstance \"o{below}\" ObjectEnd")
    };
    let folder = Folder::new("doubling");
    image::GrayImage::from_pixel(2, 2, image::Luma([99])).save(folder.path("junk.png")).expect("a picture");
    let mut faults = Faults::default();
    for (what, text, fate) in [
        ("few textures", levels(5, image, &scale, &rough(4)), Renders),
        ("textures", levels(40, image, &scale, &rough(39)), Limit("look-ups")),
        ("deep textures", levels(20_000, image, &scale, &rough(19_999)), Limit("within each other")),
        (
            "mixes",
            levels(
                20_000,
                "MakeNamedMaterial \"m0\" \"string type\" \"diffuse\"",
                &mix,
                "NamedMaterial \"m40\"\nMediumInterface \"\" \"\"\nShape \"sphere\"",
            ),
            Renders,
        ),
        (
            "objects",
            levels(40, "ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd", &object, "ObjectInstance \"o39\""),
            Limit("parts"),
        ),
        (
            "deep objects",
            levels(20_000, "ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd", &object, "ObjectInstance \"o9\""),
            Limit("objects within each other"),
        ),
    ] {
        folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
        faults.render(&folder, what, fate);
    }
}

/// Files of OpenVDB, written here: whole, cut short and damaged, with each compression.
#[cfg(feature = "openvdb")]
mod volumes {
    use openvdb::{Compression, Precision, VdbWriter};

    use super::*;

    const VOLUME: &str = "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"fog.vdb\"\n\
                          Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\" \"float radius\" 3\n";

    fn write(folder: &Folder, compression: Compression, value: impl FnMut(i32, i32, i32) -> f32) -> Vec<u8> {
        let mut writer = VdbWriter::new().expect("a writer");
        writer.fog_grid("density", Precision::Single, 0.0, 0.125, [-1.0; 3]).expect("a grid");
        writer.dense([0; 3], [16; 3], 0.0, value).expect("voxels");
        writer.write(&folder.path("fog.vdb"), compression).expect("a file");
        folder.read("fog.vdb")
    }

    #[test]
    fn damaged_volumes() {
        let folder = Folder::new("vdb");
        let mut faults = Faults::default();
        folder.write("scene.pbrt", format!("{HEAD}{VOLUME}"));
        for compression in [Compression::Blosc, Compression::Zip] {
            let whole = write(&folder, compression, |x, y, z| (x + y * z) as f32 * 0.01);
            faults.render(&folder, "the whole", Renders);
            for part in 0..10 {
                folder.write("fog.vdb", &whole[..part * whole.len() / 10]);
                faults.render(&folder, &format!("{compression:?}: the first {part}/10"), Refused("fog.vdb"));
            }
            let mut random = Random(3);
            for number in 0..30 {
                folder.write("fog.vdb", damage(&whole, &mut random));
                faults.render(&folder, &format!("{compression:?}: damage {number}"), Orderly);
            }
        }
    }

    #[test]
    fn odd_volumes() {
        let folder = Folder::new("odd-vdb");
        let mut faults = Faults::default();
        folder.write("scene.pbrt", format!("{HEAD}{VOLUME}"));
        for (what, value, fate) in [
            ("nothing", 0.0, Warned("no active voxels")),
            ("NaN", f32::NAN, Warned("NaN")),
            ("infinite", f32::INFINITY, Warned("infinite")),
            ("negative", -1.0, Warned("negative")),
            ("too dense", 1e30, Refused("extinction")),
        ] {
            write(&folder, Compression::Zip, |_, _, _| value);
            faults.render(&folder, what, fate);
        }
        write(&folder, Compression::Zip, |_, _, _| f32::NAN);
        folder.run(&["render", "scene.pbrt", "--strict"]).code(3).says("NaN");
        write(&folder, Compression::Zip, |_, _, _| 1.0);
        folder.write(
            "scene.pbrt",
            format!("{HEAD}AttributeBegin\nScale 0 1 1\n{}", VOLUME.replacen('\n', "\nAttributeEnd\n", 1)),
        );
        faults.render(&folder, "a transform that cannot be inverted", Refused("inverted"));
        folder.write(
            "scene.pbrt",
            format!("{HEAD}{}", VOLUME.replacen("\"fog.vdb\"", "\"fog.vdb\" \"string density\" \"smoke\"", 1)),
        );
        faults.render(&folder, "a grid that is not there", Refused("smoke"));
    }
}
