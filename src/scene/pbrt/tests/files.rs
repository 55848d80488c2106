//! The files of a scene: included, imported, packed, damaged, absent.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

use super::*;

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
        error(&[("a.pbrt", b"WorldBegin Import \"b.pbrt\""), ("b.pbrt", b"ObjectEnd")]),
        "b.pbrt:1:1: ObjectEnd without its begin"
    );
    assert_eq!(error(&[("a.pbrt", b"WorldBegin\r\n \xff\0")]), "a.pbrt:2:2: this byte is not valid UTF-8 text");
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
fn latin_1_is_read_with_one_warning_a_file() {
    let files = Files::new(&[
        ("main.pbrt", b"WorldBegin\nMakeNamedMaterial \"gr\xfcn\" \"string type\" \"diffuse\" Include \"b.pbrt\" Include \"b.pbrt\""),
        ("b.pbrt", b"NamedMaterial \"gr\xfcn\" Shape \"sph\xe4re\" # \xe4"),
    ]);
    let (scene, sources, warnings) = files.load();
    let scene = scene.unwrap_or_else(|e| panic!("{}", e.one_line(&sources)));
    assert_eq!((scene.shapes.len(), scene.shapes[0].entity.kind.as_str()), (2, "sph\u{e4}re"));
    assert_eq!(scene.materials[scene.shapes[0].material.0 as usize].name.as_deref(), Some("gr\u{fc}n"));
    let places: Vec<_> = warnings.list().iter().filter_map(|w| w.span).map(|s| (s.file.0, s.line, s.column)).collect();
    assert_eq!(places, [(0, 2, 22), (1, 1, 18)], "{warnings:?}");
    assert!(warnings.list().iter().all(|w| w.message.contains("taken for Latin-1")));
    // In comments anything may stand.
    let (scene, _, warnings) = Files::new(&[("a.pbrt", b"# \xfc\rWorldBegin # \xff")]).load();
    assert!(scene.is_ok() && warnings.list().is_empty(), "{warnings:?}");
}

#[test]
fn files_of_other_kinds_are_named() {
    for (start, what, help) in [
        (&b"\xff\xfeW\0o\0"[..], "UTF-16 text", "UTF-8"),
        (b"\xfe\xff\0W\0o", "UTF-16 text", "UTF-8"),
        (b"PK\x03\x04junk", "a zip archive", "unpack"),
        (b"\xfd7zXZ\0junk", "packed by xz", "unpack"),
    ] {
        for files in [&[("a.pbrt", start)][..], &[("a.pbrt", b"Include \"b.pbrt\""), ("b.pbrt", start)]] {
            let error = Files::new(files).load().0.unwrap_err();
            assert!(matches!(error.kind, SceneErrorKind::File { .. }) && error.to_string().contains(what), "{error}");
            assert!(error.help.as_deref().is_some_and(|text| text.contains(help)), "{error:?}");
        }
    }
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
fn files_of_the_command_line_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    for name in ["", "absent.pbrt"] {
        let error = load(&folder.path().join(name), &mut sources, &mut warnings).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::File { .. }), "{error}");
    }
}
