//! Tests of the whole parser: what directives mean, where errors are placed, and that no text brings it down.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};
use proptest::prelude::*;

use super::*;
use crate::math::Rgb;
use crate::math::spectrum::Spectrum;
use crate::scene::{MaterialIndex, MediumInterface, ParamValue, SceneErrorKind};

/// A folder with files, of which the first is the scene.
struct Files {
    folder: tempfile::TempDir,
    main: PathBuf,
}

impl Files {
    fn new(files: &[(&str, &[u8])]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, content).unwrap();
        }
        let main = folder.path().join(files[0].0);
        Self { folder, main }
    }

    fn load(&self) -> (Result<SceneDescription, Box<SceneError>>, Sources, Warnings) {
        let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
        let scene = load(&self.main, &mut sources, &mut warnings);
        (scene, sources, warnings)
    }

    /// The error as one line, without the folder.
    fn error(&self) -> String {
        let (scene, sources, _) = self.load();
        let line = scene.expect_err("this text must be refused").one_line(&sources);
        line.replace(&format!("{}/", self.folder.path().display()), "")
    }
}

fn text(main: &str) -> Files {
    Files::new(&[("main.pbrt", main.as_bytes())])
}

fn scene(main: &str) -> SceneDescription {
    let (scene, sources, _) = text(main).load();
    scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)))
}

fn warnings(main: &str) -> Vec<String> {
    let (scene, sources, warnings) = text(main).load();
    scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)));
    warnings.list().iter().map(|w| w.message.clone()).collect()
}

/// All scene files below `folder`.
fn scene_files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .flat_map(|e| if e.path().is_dir() { scene_files(&e.path()) } else { vec![e.path()] })
        .filter(|p| p.to_string_lossy().ends_with(".pbrt") || p.to_string_lossy().ends_with(".pbrt.gz"))
        .collect();
    files.sort();
    files
}

/// Scenes that lie beside the project on some machines; the test says nothing where they are absent.
#[test]
fn shared_scenes_parse() {
    for folder in ["../shared/data/pbrt/scenes", "../shared/refs"] {
        for path in scene_files(Path::new(folder)) {
            let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
            if let Err(error) = load(&path, &mut sources, &mut warnings) {
                panic!("{}", error.one_line(&sources));
            }
        }
    }
}

#[test]
fn an_empty_world_has_the_formats_defaults() {
    let scene = scene("WorldBegin");
    let kinds = [&scene.camera, &scene.film, &scene.filter, &scene.sampler, &scene.integrator].map(|e| e.kind.as_str());
    assert_eq!(kinds, ["perspective", "rgb", "gaussian", "zsobol", "volpath"]);
    assert_eq!(scene.camera_transform.start, DMat4::IDENTITY);
    assert_eq!(scene.transform_times, [0.0, 1.0]);
    assert_eq!(scene.materials.len(), 1);
}

#[test]
fn parameter_values() {
    let scene = scene(
        "\u{feff}WorldBegin # comment \"with quotes\"\nShape\"sphere\"\"float a\"[1 -2.5e-1 .5 +3.]\"integer i\"7 \"integer j\" [ 64.0 -1 ]\n\
         \"bool yes\" true \"bool both\" [ \"false\" true ] \"string s\" [\"a\\\"b\\\\\\n\" \"\"] \"point2 uv\" [1 2 3 4]\n\
         \"point3 P\" [1 2 3] \"normal N\" [0 0 1] \"vector3 V\" [] \"texture alpha\" \"holes\" \"float r\" 2 # end\n\
         \"rgb c\" [.1 .2 .3 1 1 1] \"blackbody b\" [2700] \"spectrum g\" \"glass-BK7\" \"spectrum p\" [400 1 700 0.5]\n\
         Texture \"holes\" \"float\" \"constant\" \"float value\" 1",
    );
    let params = &scene.shapes[0].entity.params;
    let value = |name: &str| params.get(name).unwrap().value.clone();
    assert_eq!(value("a"), ParamValue::Float(vec![1.0, -0.25, 0.5, 3.0]));
    assert_eq!(value("i"), ParamValue::Integer(vec![7]));
    assert_eq!(value("j"), ParamValue::Integer(vec![64, -1]));
    assert_eq!(value("yes"), ParamValue::Bool(vec![true]));
    assert_eq!(value("both"), ParamValue::Bool(vec![false, true]));
    assert_eq!(value("s"), ParamValue::String(vec!["a\"b\\\n".into(), String::new()]));
    assert_eq!(value("uv"), ParamValue::Vec2(vec![[1.0, 2.0], [3.0, 4.0]]));
    assert_eq!(value("P"), ParamValue::Vec3(vec![[1.0, 2.0, 3.0]]));
    assert_eq!(value("V"), ParamValue::Vec3(vec![]));
    assert_eq!(value("alpha"), ParamValue::Texture("holes".into()));
    let rgb = [Rgb::new(0.1, 0.2, 0.3), Rgb::WHITE].map(Spectrum::Rgb);
    assert_eq!(value("c"), ParamValue::Spectrum(rgb.to_vec()));
    assert_eq!(value("b"), ParamValue::Spectrum(vec![Spectrum::Blackbody(2700.0)]));
    assert_eq!(value("g"), ParamValue::Spectrum(vec![Spectrum::named("glass-BK7").unwrap()]));
    assert_eq!(value("p"), ParamValue::Spectrum(vec![Spectrum::Samples(vec![(400.0, 1.0), (700.0, 0.5)])]));
    assert_eq!(params.owner, "Shape \"sphere\"");
    assert_eq!((params.span.line, params.span.column, params.span.length), (2, 1, 5));
    assert_eq!(params.get("i").unwrap().span.column, 41);
}

fn first_shape_transform(text: &str) -> DMat4 {
    scene(&format!("WorldBegin\n{text}\nShape \"sphere\"")).shapes[0].transform.start
}

#[test]
fn transforms_compose_from_the_right() {
    let at = |text: &str, p: [f64; 3]| first_shape_transform(text).transform_point3(p.into());
    let close =
        |found: DVec3, wanted: [f64; 3]| assert!((found - DVec3::from(wanted)).length() < 1e-12, "{found}, {wanted:?}");
    close(at("Translate 1 2 3 Scale 2 2 2", [1.0, 0.0, 0.0]), [3.0, 2.0, 3.0]);
    close(at("Scale 2 2 2 Translate 1 2 3", [1.0, 0.0, 0.0]), [4.0, 4.0, 6.0]);
    close(at("Rotate 90 0 0 1", [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    close(at("Transform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]", [0.0; 3]), [5.0, 6.0, 7.0]);
    close(at("Scale 2 2 2 ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]", [0.0; 3]), [10.0, 12.0, 14.0]);
    close(at("Scale 2 2 2 Identity", [1.0; 3]), [1.0; 3]);
    close(at("Translate 1 0 0 CoordinateSystem \"a\" Identity CoordSysTransform \"a\"", [0.0; 3]), [1.0, 0.0, 0.0]);
    close(at("Translate 1 0 0 CoordSysTransform \"world\"", [0.0; 3]), [0.0; 3]);
    // LookAt maps the eye to the origin, the target onto +z; x points to the right of a left-handed frame.
    close(at("LookAt 1 2 3  1 2 8  0 1 0", [1.0, 2.0, 3.0]), [0.0; 3]);
    close(at("LookAt 1 2 3  1 2 8  0 1 0", [2.0, 2.0, 8.0]), [1.0, 0.0, 5.0]);
}

/// As in pbrt-v4: `CoordSysTransform` sets both keys whichever are active, `TransformBegin` saves the whole graphics state.
#[test]
fn named_systems_and_transform_blocks_are_pbrts() {
    let still = scene(
        "WorldBegin Translate 5 0 0 CoordinateSystem \"a\" Identity ActiveTransform EndTime CoordSysTransform \"a\" Shape \"sphere\"",
    );
    assert!(!still.shapes[0].transform.is_animated());
    let both = scene("WorldBegin TransformBegin Translate 1 0 0 Material \"conductor\" TransformEnd Shape \"sphere\"");
    assert_eq!(both.shapes[0].transform.start, DMat4::IDENTITY);
    assert_eq!(both.materials[both.shapes[0].material.0 as usize].entity.kind, "diffuse");
}

#[test]
fn the_camera_stores_world_to_camera_and_names_its_system() {
    let scene = scene(
        "MediumInterface \"\" \"air\" LookAt 0 0 -5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40 WorldBegin\n\
         CoordSysTransform \"camera\" Shape \"sphere\" MakeNamedMedium \"air\" \"string type\" \"homogeneous\"",
    );
    assert!((scene.camera_position() - DVec3::new(0.0, 0.0, -5.0)).length() < 1e-12);
    assert_eq!(scene.camera_medium, "air");
    // The medium interface outlives WorldBegin, the transform does not.
    let shape = &scene.shapes[0];
    assert!((shape.transform.start.transform_point3(DVec3::ZERO) - DVec3::new(0.0, 0.0, -5.0)).length() < 1e-12);
    assert_eq!(
        shape.medium_interface.as_deref(),
        Some(&MediumInterface { inside: String::new(), outside: "air".into() })
    );
}

#[test]
fn motion() {
    let scene = scene(
        "TransformTimes 0 2 WorldBegin AttributeBegin ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Translate 0 1 0\n\
         Shape \"sphere\" AttributeEnd ActiveTransform StartTime Translate 0 0 1 Shape \"disk\"",
    );
    assert_eq!(scene.transform_times, [0.0, 2.0]);
    let [sphere, disk] = &scene.shapes[..] else { panic!("two shapes") };
    assert_eq!(sphere.transform.start, DMat4::from_translation(DVec3::new(0.0, 1.0, 0.0)));
    assert_eq!(sphere.transform.end, DMat4::from_translation(DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(disk.transform.start, DMat4::from_translation(DVec3::new(0.0, 0.0, 1.0)));
    assert_eq!(disk.transform.end, DMat4::IDENTITY);
}

#[test]
fn attribute_blocks_restore_everything() {
    let scene = scene(
        "WorldBegin Material \"diffuse\" Shape \"a\"\n\
         AttributeBegin Translate 1 0 0 ReverseOrientation AreaLightSource \"diffuse\" Material \"conductor\"\n\
         MediumInterface \"m\" Attribute \"shape\" \"float radius\" 3 ColorSpace \"rec2020\"\n\
         Shape \"b\" Shape \"c\" \"float radius\" 4 AttributeEnd Shape \"d\" LightSource \"point\" \"rgb I\" [1 0 0]\n\
         MakeNamedMedium \"m\" \"string type\" \"homogeneous\"",
    );
    let [a, b, c, d] = &scene.shapes[..] else { panic!("four shapes") };
    assert_eq!([a, b, c, d].map(|s| s.reverse_orientation), [false, true, true, false]);
    assert_eq!([a, b, c, d].map(|s| s.area_light), [None, Some(0), Some(0), None]);
    assert_eq!([a, b, c, d].map(|s| s.material.0), [1, 2, 2, 1]);
    assert_eq!([a, b, c, d].map(|s| s.entity.params.float("radius", 1.0).unwrap()), [1.0, 3.0, 4.0, 1.0]);
    assert_eq!(b.medium_interface.as_deref(), Some(&MediumInterface { inside: "m".into(), outside: "m".into() }));
    assert_eq!(d.medium_interface, None);
    assert_eq!(d.transform.start, DMat4::IDENTITY);
    assert_eq!(scene.lights[0].entity.params.spectrum("I").unwrap(), Some(&Spectrum::Rgb(Rgb::new(1.0, 0.0, 0.0))));
    assert_eq!(scene.area_lights.len(), 1);
}

#[test]
fn attribute_defaults_are_never_called_unused() {
    let scene = scene("WorldBegin Attribute \"shape\" \"float a\" 1 Shape \"sphere\" \"float b\" 2");
    let mut warnings = Warnings::default();
    scene.shapes[0].entity.params.warn_unused(&mut warnings);
    let messages: Vec<&str> = warnings.list().iter().map(|w| w.message.as_str()).collect();
    assert_eq!(messages, ["parameter \"b\" of Shape \"sphere\" is not used"]);
}

#[test]
fn colour_spaces_convert_when_read() {
    let scene = scene(
        "WorldBegin ColorSpace \"rec2020\" Material \"diffuse\" \"rgb reflectance\" [1 0 0] Material \"diffuse\" \"rgb reflectance\" [1 1 1]",
    );
    let colour = |i: usize| scene.materials[i].entity.params.spectrum("reflectance").unwrap().unwrap().to_albedo();
    assert!((colour(1).0 - glam::Vec3::new(1.6605, -0.1246, -0.0182)).abs().max_element() < 2e-4);
    assert!((colour(2).0 - glam::Vec3::ONE).abs().max_element() < 1e-6);
}

#[test]
fn materials_may_be_named_before_they_are_made() {
    let scene = scene(
        "WorldBegin NamedMaterial \"late\" Shape \"a\" MakeNamedMaterial \"early\" \"string type\" \"conductor\" NamedMaterial \"early\"\n\
         Shape \"b\" MakeNamedMaterial \"late\" \"string type\" \"mix\" \"string materials\" [\"early\" \"early\"]",
    );
    let names = scene.shapes.iter().map(|s| scene.materials[s.material.0 as usize].name.as_deref());
    assert_eq!(names.collect::<Vec<_>>(), [Some("late"), Some("early")]);
    assert_eq!(scene.materials[1].entity.kind, "conductor");
    assert_eq!(scene.shapes[0].material, MaterialIndex(2));
}

#[test]
fn objects_and_instances() {
    let text = "WorldBegin Translate 1 0 0 ObjectBegin \"o\" Translate 0 1 0 AreaLightSource \"diffuse\" Shape \"sphere\" Shape \"disk\" ObjectEnd\n\
                Scale 2 2 2 ObjectInstance \"o\" ObjectInstance \"o\"";
    let scene = scene(text);
    assert!(scene.shapes.is_empty());
    let object = &scene.objects[0];
    assert_eq!((object.name.as_str(), object.shapes.len()), ("o", 2));
    assert_eq!(object.shapes[0].transform.start, DMat4::from_translation(DVec3::new(1.0, 1.0, 0.0)));
    assert_eq!(object.shapes[0].area_light, None);
    assert_eq!(scene.instances.len(), 2);
    let expected = DMat4::from_translation(DVec3::X) * DMat4::from_scale(DVec3::splat(2.0));
    assert_eq!(scene.instances[1].transform.start, expected);
    let warnings = warnings(text);
    assert!(warnings.iter().any(|w| w.contains("inside object definitions")), "{warnings:?}");
}

#[test]
fn options_in_both_forms() {
    let scene = scene(
        "Option \"seed\" 5 Option \"string rendercoordsys\" \"camera\" Option \"disablepixeljitter\" true WorldBegin",
    );
    assert_eq!(scene.options.integer("seed", 0).unwrap(), 5);
    assert_eq!(scene.options.string("rendercoordsys").unwrap(), Some("camera"));
    assert!(scene.options.bool("disablepixeljitter", false).unwrap());
}

#[test]
fn warnings_name_what_happens() {
    for (text, part) in [
        ("Accelerator \"kdtree\" WorldBegin", "Accelerator \"kdtree\""),
        ("WorldBegin TransformBegin TransformEnd", "TransformBegin is deprecated"),
        ("WorldBegin Shape \"a\" \"float r\" 1 \"float r\" 2", "given twice"),
        ("Film \"rgb\" Film \"rgb\" WorldBegin", "Film is given twice"),
        ("WorldBegin AttributeBegin", "never ended"),
        ("WorldBegin AreaLightSource \"diffuse\"", "in force at no shape"),
    ] {
        let found = warnings(text);
        assert!(found.iter().any(|w| w.contains(part)), "{text}: {found:?}");
    }
}

#[test]
fn errors_have_their_place() {
    let mut wrong = Vec::new();
    for (text, expected) in [
        ("", "main.pbrt:1:1: the file ends before WorldBegin"),
        ("WorldBegin\nShpae \"sphere\"", "main.pbrt:2:1: unknown directive `Shpae`"),
        ("WorldBegin\n  \"float x\" 1", "main.pbrt:2:3: expected a directive, found `float x`"),
        ("WorldBegin\nTranslate 1 2 3 4", "main.pbrt:2:17: expected a directive, found the number `4`"),
        ("WorldBegin\nTranslate 1 2\nShape \"a\"", "main.pbrt:3:1: expected a number, found `Shape`"),
        ("WorldBegin\nTranslate 1 2", "main.pbrt:2:14: the file ends where a number should follow"),
        ("Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 2]", "main.pbrt:1:44: expected ] after 16 numbers, found `2`"),
        ("WorldBegin Shape \"a\" \"float x\" [1 2 nan]", "main.pbrt:1:37: expected a number, found `nan`"),
        (
            "WorldBegin Shape \"a\" \"float x\" [1 2 1e39]",
            "main.pbrt:1:37: the number `1e39` is too large or not finite",
        ),
        ("WorldBegin Shape \"a\" \"float x\" -inf", "main.pbrt:1:32: the number `-inf` is too large or not finite"),
        ("WorldBegin Translate 1e400 0 0", "main.pbrt:1:22: the number `1e400` is too large or not finite"),
        (
            "WorldBegin Scale 1e200 1 1 Scale 1e200 1 1",
            "main.pbrt:1:28: the current transformation's numbers become too large",
        ),
        ("WorldBegin Shape \"a\" \"integer x\" 1.5", "main.pbrt:1:34: expected an integer, found `1.5`"),
        ("WorldBegin Shape \"a\" \"integer x\" 3e9", "main.pbrt:1:34: the integer `3e9` does not fit in 32 bits"),
        ("WorldBegin Shape \"a\" \"bool x\" 1", "main.pbrt:1:31: expected true or false, found `1`"),
        ("WorldBegin Shape \"a\" \"string x\" 1", "main.pbrt:1:33: expected a string in quotes, found `1`"),
        ("WorldBegin Shape \"a\" \"float x\" \"1\"", "main.pbrt:1:32: expected a number, found the string \"1\""),
        (
            "WorldBegin Shape \"a\" \"point3 P\" [1 2]",
            "main.pbrt:1:22: point3 values come in groups of 3; 2 numbers do not divide by that",
        ),
        ("WorldBegin Shape \"a\" \"float x\" [1 2", "main.pbrt:1:32: this [ is never closed"),
        ("WorldBegin Shape \"a\" \"float x\" [1 [2", "main.pbrt:1:35: brackets within brackets"),
        ("WorldBegin Shape \"a\" \"float x\" ]", "main.pbrt:1:32: found ] where the parameter's value should stand"),
        ("WorldBegin Shape \"a\" \"float\" 1", "main.pbrt:1:22: expected \"type name\", found \"float\""),
        ("WorldBegin Shape \"a\" \"color x\" [1 1 1]", "main.pbrt:1:22: \"color\" is no parameter type of pbrt-v4"),
        ("WorldBegin Shape \"a\" \"flaot x\" 1", "main.pbrt:1:22: unknown parameter type \"flaot\""),
        ("WorldBegin Shape \"a\" 5", "main.pbrt:1:22: expected a parameter (\"type name\") or a directive, found `5`"),
        (
            "WorldBegin Shape \"a\" \"rgb c\" [1 1]",
            "main.pbrt:1:22: rgb values come in groups of 3; 2 numbers do not divide by that",
        ),
        (
            "WorldBegin Shape \"a\" \"blackbody c\" 0",
            "main.pbrt:1:22: a black body's temperature is in kelvin and above 0, found 0",
        ),
        (
            "WorldBegin Shape \"a\" \"spectrum c\" [500 1 400 1]",
            "main.pbrt:1:22: a spectrum's wavelengths must rise, found 400 after 500",
        ),
        (
            "WorldBegin Shape \"a\" \"spectrum c\" \"metal-Au-et\"",
            "main.pbrt:1:35: \"metal-Au-et\" is neither a named spectrum nor a file",
        ),
        ("WorldBegin Shape \"sphere\n\"", "main.pbrt:1:18: this string has no closing quote"),
        ("WorldBegin Shape \"a\\q\"", "main.pbrt:1:20: unknown escape \\q in a string"),
        ("Shape \"a\"", "main.pbrt:1:1: Shape may stand only after WorldBegin"),
        ("WorldBegin\nCamera \"perspective\"", "main.pbrt:2:1: Camera may stand only before WorldBegin"),
        ("WorldBegin AttributeEnd", "main.pbrt:1:12: AttributeEnd without its begin"),
        (
            "WorldBegin ObjectBegin \"o\" AttributeEnd",
            "main.pbrt:1:28: AttributeEnd where the ObjectBegin of line 1 is still open",
        ),
        ("WorldBegin ObjectBegin \"o\"", "main.pbrt:1:12: this ObjectBegin is never ended"),
        (
            "WorldBegin ObjectBegin \"o\" ObjectBegin \"p\"",
            "main.pbrt:1:28: object definitions cannot nest: \"o\" of line 1 is open",
        ),
        ("WorldBegin ObjectInstance \"o\"", "main.pbrt:1:27: no object called \"o\" is defined above"),
        ("WorldBegin NamedMaterial \"m\"", "main.pbrt:1:26: no material is called \"m\""),
        ("WorldBegin MediumInterface \"m\" \"\"", "main.pbrt:1:28: no medium is called \"m\""),
        ("WorldBegin Material \"diffuse\" \"texture reflectance\" \"t\"", "main.pbrt:1:31: no texture is called \"t\""),
        (
            "WorldBegin Texture \"t\" \"float\" \"scale\" \"texture tex\" \"t\"",
            "main.pbrt:1:40: no texture called \"t\" is defined above",
        ),
        (
            "WorldBegin Texture \"t\" \"color\" \"scale\"",
            "main.pbrt:1:24: a texture's type is float or spectrum, found \"color\"",
        ),
        ("WorldBegin MakeNamedMaterial \"m\"", "main.pbrt:1:30: MakeNamedMaterial \"m\" lacks its type"),
        ("ColorSpace \"adobe\"", "main.pbrt:1:12: unknown colour space \"adobe\""),
        ("CoordSysTransform \"x\"", "main.pbrt:1:19: no coordinate system is called \"x\""),
        ("Rotate 90 0 0 0", "main.pbrt:1:1: Rotate's axis is zero"),
        (
            "LookAt 0 0 0 0 0 1 0 0 1",
            "main.pbrt:1:1: LookAt's eye and target coincide, or its up vector points along the view or is zero",
        ),
        (
            "Scale 1 1 0 Camera \"perspective\"",
            "main.pbrt:1:13: the camera's transform cannot be inverted: it flattens space",
        ),
        ("ActiveTransform Now", "main.pbrt:1:17: expected StartTime, EndTime or All, found `Now`"),
    ] {
        let found = text_error(text);
        if found != expected {
            wrong.push(format!("{text}\n     found {found}\n  expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn text_error(main: &str) -> String {
    text(main).error()
}

#[test]
fn advice_helps() {
    for (main, advice) in [
        ("WorldBegin Shpae \"sphere\"", "did you mean Shape?"),
        ("WorldBegin WorldEnd", "pbrt-v4 files have no WorldEnd: remove the line"),
        ("WorldBegin Shape \"a\" \"spectrum c\" \"metal-Au-et\"", "did you mean metal-Au-eta?"),
        ("WorldBegin Shape \"a\" \"color c\" [1 1 1]", "give the colour as linear \"rgb\""),
    ] {
        let error = text(main).load().0.unwrap_err();
        assert_eq!(error.help.as_deref(), Some(advice), "for {main}");
    }
}

#[test]
fn includes_splice_and_imports_do_not_leak() {
    let files = Files::new(&[
        ("main.pbrt", b"Include \"parts/head.pbrt\" WorldBegin Include \"parts/state.pbrt\" \"float radius\" 2 Shape \"b\"\nImport \"parts/import.pbrt\" Shape \"e\""),
        ("parts/head.pbrt", b"Camera \"perspective\" # no line end"),
        // The parameter list of the last shape continues in the including file; the nested name is beside this file
        // only.
        ("parts/state.pbrt", b"Translate 1 0 0 Include \"nested.pbrt\" Shape \"a\""),
        ("parts/nested.pbrt", b"Scale 2 2 2"),
        ("parts/import.pbrt", b"Identity Shape \"c\" AttributeBegin Shape \"d\" AttributeEnd"),
    ]);
    let (scene, sources, _) = files.load();
    let scene = scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)));
    let kinds: Vec<&str> = scene.shapes.iter().map(|s| s.entity.kind.as_str()).collect();
    assert_eq!(kinds, ["a", "b", "c", "d", "e"]);
    assert_eq!(scene.shapes[0].entity.params.float("radius", 1.0).unwrap(), 2.0);
    let expected = DMat4::from_translation(DVec3::X) * DMat4::from_scale(DVec3::splat(2.0));
    assert_eq!(scene.shapes[1].transform.start, expected);
    assert_eq!(scene.shapes[2].transform.start, DMat4::IDENTITY);
    assert_eq!(scene.shapes[4].transform.start, expected);
}

#[test]
fn bad_includes() {
    let error = |files: &[(&str, &[u8])]| Files::new(files).error();
    assert!(
        error(&[("a.pbrt", b"WorldBegin\nInclude \"gone.pbrt\"")]).starts_with("a.pbrt:2:9: cannot read gone.pbrt")
    );
    assert!(
        error(&[("a.pbrt", b"Include \"b.pbrt\""), ("b.pbrt", b"\nInclude \"a.pbrt\"")])
            .contains("b.pbrt:2:9: a.pbrt includes itself")
    );
    assert_eq!(
        error(&[("a.pbrt", b"Include \"b.pbrt\""), ("b.pbrt", b"\n  Foo")]),
        "b.pbrt:2:3: unknown directive `Foo`"
    );
    let import: &[(&str, &[u8])] = &[("a.pbrt", b"WorldBegin Import \"b.pbrt\""), ("b.pbrt", b"\n  AttributeBegin")];
    assert_eq!(error(import), "b.pbrt:2:3: this block is not ended in the imported file");
    assert_eq!(
        error(&[("a.pbrt", b"WorldBegin Import \"b.pbrt\""), ("b.pbrt", b"AttributeEnd")]),
        "b.pbrt:1:1: AttributeEnd without its begin"
    );
    assert_eq!(error(&[("a.pbrt", b"WorldBegin\n \xff")]), "a.pbrt:2:2: this byte is not valid UTF-8 text");
    assert!(error(&[("a.pbrt", b"\x1f\x8b\x08garbage")]).contains("damaged or cut off"));
    // A chain deeper than allowed, then a doubling that would expand to 2^60 directives.
    let names: Vec<String> = (0..80).map(|i| format!("{i}.pbrt")).collect();
    let chain: Vec<String> = (1..=80).map(|i| format!("Include \"{i}.pbrt\"")).collect();
    let files: Vec<(&str, &[u8])> = names.iter().map(String::as_str).zip(chain.iter().map(String::as_bytes)).collect();
    assert!(error(&files).contains("include each other in a chain"));
    let double: Vec<String> = (1..=60).map(|i| format!("Include \"{i}.pbrt\" Include \"{i}.pbrt\"")).collect();
    let mut files: Vec<(&str, &[u8])> =
        names.iter().map(String::as_str).zip(double.iter().map(String::as_bytes)).collect();
    files.push(("60.pbrt", b""));
    assert!(error(&files).contains("Include and Import directives"));
}

#[test]
fn gzip_by_content_and_its_limit() {
    use std::io::Write;
    let pack = |content: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(content).unwrap();
        encoder.finish().unwrap()
    };
    // The name does not say gzip, the bytes do.
    let (scene, ..) = Files::new(&[("a.pbrt", &pack(b"WorldBegin Shape \"sphere\""))]).load();
    assert_eq!(scene.unwrap().shapes.len(), 1);
    let bomb = Files::new(&[("a.pbrt.gz", &pack(&vec![b' '; 80 << 20]))]);
    assert!(matches!(bomb.load().0.unwrap_err().kind, SceneErrorKind::Limit(_)));
}

#[test]
fn spectrum_files() {
    let files = Files::new(&[
        ("a.pbrt", b"WorldBegin LightSource \"point\" \"spectrum I\" \"s/x.spd\" LightSource \"point\" \"spectrum I\" \"s/bad.spd\""),
        ("s/x.spd", b"# comment\n400 1.0\n500, 2 # more\n\n600 3"),
        ("s/bad.spd", b"400 1\n500 x"),
    ]);
    assert!(files.error().starts_with("a.pbrt:1:88: s/bad.spd:2: expected a number"), "{}", files.error());
}

#[test]
fn deep_nesting_is_limited_not_fatal() {
    let deep = format!("WorldBegin {}", "AttributeBegin ".repeat(70_000));
    assert!(text_error(&deep).contains("blocks within each other"));
    let many =
        format!("WorldBegin Shape \"a\" {}", (0..5000).map(|i| format!("\"float p{i}\" 1 ")).collect::<String>());
    assert!(text_error(&many).contains("4096 parameters"));
}

#[test]
fn files_of_the_command_line_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    for name in ["", "absent.pbrt"] {
        let error = load(&folder.path().join(name), &mut sources, &mut warnings).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::File { .. }), "{error}");
    }
}

/// A scene that uses most of the grammar: the start for mutations.
const SAMPLE: &str = r#"Option "seed" 3
LookAt 0 -6 2 0 0 1 0 0 1
Camera "perspective" "float fov" [ 40 ]
Film "rgb" "integer xresolution" 64 "string filename" "a\"b.exr"
ActiveTransform EndTime Rotate 30 0 0 1 ActiveTransform All
WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [.1 .2 .3]
Texture "t" "spectrum" "constant" "rgb value" [1 0.5 0]
AttributeBegin
  Attribute "shape" "float radius" 2
  AreaLightSource "diffuse" "blackbody L" 3000 "bool twosided" true
  Material "diffuse" "texture reflectance" "t"
  MediumInterface "fog" ""
  Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]
AttributeEnd
ObjectBegin "o" Shape "sphere" ObjectEnd
Scale 2 2 2 ObjectInstance "o"
NamedMaterial "m" Shape "disk"
MakeNamedMaterial "m" "string type" "dielectric" "spectrum eta" "glass-BK7"
LightSource "distant" "spectrum L" [400 1 700 2] "point3 from" [0 0 1]
"#;

fn survives(bytes: &[u8]) {
    let files = Files::new(&[("main.pbrt", bytes)]);
    let (scene, sources, _) = files.load();
    if let Err(error) = scene {
        // Rendering the place must not fail either.
        let _ = error.one_line(&sources);
        if let Some(span) = error.span {
            assert!(span.line >= 1 && span.column >= 1);
            let _ = sources.line(span.file, span.line);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        survives(&bytes);
    }

    #[test]
    fn mutated_scenes_never_panic(
        cut in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..8),
    ) {
        let mut bytes = SAMPLE.as_bytes().to_vec();
        for (place, other, value, kind) in edits {
            let (i, j) = (place.index(bytes.len()), other.index(bytes.len()));
            match kind {
                0 => bytes[i] = value,
                1 => bytes.swap(i, j),
                2 => { let part = bytes[i.min(j)..i.max(j)].to_vec(); bytes.splice(i..i, part); }
                _ => { bytes.drain(i.min(j)..(i.max(j)).min(i.min(j) + 9)); }
            }
            if bytes.is_empty() { bytes.push(b' '); }
        }
        if cut.index(3) == 0 { let end = cut.index(bytes.len()); bytes.truncate(end); }
        survives(&bytes);
    }

    #[test]
    fn shuffled_words_never_panic(words in prop::collection::vec(0..64usize, 0..60)) {
        let all: Vec<&str> = SAMPLE.split_ascii_whitespace().collect();
        let text: Vec<&str> = words.into_iter().map(|w| all[w % all.len()]).collect();
        survives(format!("WorldBegin {}", text.join(" ")).as_bytes());
    }
}

#[test]
fn the_sample_is_valid() {
    assert_eq!(scene(SAMPLE).shapes.len(), 2);
}

/// Prints how fast inline meshes are read: `cargo test --release --lib scene::pbrt::tests::speed -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a measurement"]
fn speed() {
    use std::fmt::Write;
    let mut main = String::from("WorldBegin Shape \"trianglemesh\" \"point3 P\" [");
    for i in 0..3_000_000u32 {
        let _ = write!(main, " {:.6}", f64::from(i.wrapping_mul(2_654_435_761)) * 1e-7 - 200.0);
    }
    main.push_str("] \"integer indices\" [");
    for i in 0..3_000_000u32 {
        let _ = write!(main, " {}", i % 1_000_000);
    }
    main.push(']');
    let files = text(&main);
    let start = std::time::Instant::now();
    assert_eq!(files.load().0.unwrap().shapes[0].entity.params.vec3s("P").unwrap().len(), 1_000_000);
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.1} MB in {seconds:.3} s: {:.0} MB/s", main.len() as f64 * 1e-6, main.len() as f64 * 1e-6 / seconds);
}
