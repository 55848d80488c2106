//! Truncated, corrupted and nonsensical files through the built program: each is refused with exit code 3 and a message that
//! names the file and the place, or renders; nothing panics, hangs, takes more than 2 s of processor time or 1 GiB, and
//! a refused scene leaves no file behind.

use crate::program::faults::*;
use crate::program::{Folder, HEAD, Random, damage};

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
    faults.tell("pbrt");
}

#[test]
fn damaged_scenes() {
    let folder = Folder::new("damaged");
    let mut faults = Faults::default();
    let mut random = Random(1);
    for number in 0..60 {
        let bytes = damage(WHOLE.as_bytes(), &mut random);
        let text = String::from_utf8_lossy(&bytes);
        // What is left may be sound, but an image of the default size takes more than its two seconds.
        let is_small = ["x", "y"].iter().all(|axis| text.contains(&format!("\"integer {axis}resolution\"")));
        folder.write("scene.pbrt", &bytes);
        let what = format!("damage {number}: {text}");
        if is_small { faults.render(&folder, &what, Orderly) } else { faults.render_small(&folder, &what, Orderly) }
    }
    faults.tell("pbrt");
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
        (header("3", "1") + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", Warned("1 of its faces have corners")),
        (header("3", "1") + "0 0 0\ninf 0 0\n0 1 0\n3 0 1 2\n", Warned("1 of its faces have corners")),
        (header("3", "1") + three + "2 0 1\n", Warned("1 of its faces have fewer than 3 corners")),
        (header("3", "1") + three + "5 0 1 2 1 0\n", Renders),
        (header("3", "1") + "0 0\n\n0 1 0 0 0 1 0 3 0\n1 2", Renders),
        (header("3", "1") + "0 0 0\n0 0 0\n0 0 0\n3 0 1 2\n", Renders),
        (header("3", "1") + "0 0 0\n1e38 0 0\n0 1e38 0\n3 0 1 2\n", Orderly),
        ("this is text".to_owned(), Refused("mesh.ply")),
        (String::new(), Refused("mesh.ply")),
    ] {
        folder.write("mesh.ply", &text);
        faults.render(&folder, &text, fate);
    }
    faults.tell("ply");
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
                // A missing texture is magenta, and so is the image of a light, unless --strict says otherwise.
                b'T' => Warned(name),
                b'L' if name == "missing" => Warned(name),
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
        faults.tell("vdb");
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
