//! Meshes of all encodings, whole and damaged.

use proptest::prelude::*;

use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty float nx\n\
    property float ny\nproperty float nz\nproperty uchar red\nproperty float u\nproperty float v\nelement face 3\n\
    property list uchar int vertex_indices\nproperty int face_indices\nend_header\n";

fn expected() -> PlyMesh {
    let corner = |i: usize| [(i % 2) as f32, (i / 2) as f32];
    PlyMesh {
        positions: (0..4).map(|i| [corner(i)[0], corner(i)[1], 0.5]).collect(),
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: (0..4).map(corner).collect(),
        triangles: vec![[0, 1, 2], [2, 1, 3]],
        triangle_faces: 2,
        quads: vec![[0, 1, 3, 2]],
        faults: vec![],
    }
}

fn ascii() -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\ncomment made by hand\n{HEADER}");
    for (p, uv) in expected().positions.iter().zip(&expected().uvs) {
        text += &format!("{} {} {} 0 0 1 255 {} {}\n", p[0], p[1], p[2], uv[0], uv[1]);
    }
    text += "3 0 1 2 7\n4 0 1 3 2 7\n3 2 1 3 8\n";
    text.into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let name = if big { "big" } else { "little" };
    let mut out = format!("ply\nformat binary_{name}_endian 1.0\n{HEADER}").into_bytes();
    let float = |out: &mut Vec<u8>, v: f32| out.extend(if big { v.to_be_bytes() } else { v.to_le_bytes() });
    for (p, uv) in expected().positions.iter().zip(&expected().uvs) {
        float(&mut out, p[0]);
        float(&mut out, p[1]);
        let z = f64::from(p[2]);
        out.extend(if big { z.to_be_bytes() } else { z.to_le_bytes() });
        [0.0, 0.0, 1.0].into_iter().for_each(|v| float(&mut out, v));
        out.push(255);
        float(&mut out, uv[0]);
        float(&mut out, uv[1]);
    }
    for face in [&[0i32, 1, 2][..], &[0, 1, 3, 2], &[2, 1, 3]] {
        out.push(face.len() as u8);
        for i in face.iter().chain(&[7]) {
            out.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() });
        }
    }
    out
}

fn from(bytes: &[u8]) -> Result<PlyMesh> {
    parse(bytes, Path::new("test.ply"))
}

#[test]
fn reads_all_encodings() {
    for bytes in [ascii(), binary(false), binary(true)] {
        assert_eq!(from(&bytes).unwrap(), expected());
    }
}

#[test]
fn reads_gzip_and_names_the_file() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply.gz");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(&binary(false)).unwrap();
    let packed = encoder.finish().unwrap();
    std::fs::write(&path, &packed).unwrap();
    assert_eq!(read(&path).unwrap(), expected());
    std::fs::write(&path, &packed[..packed.len() / 2]).unwrap();
    assert!(read(&path).unwrap_err().to_string().contains("mesh.ply.gz"));
    assert!(read(&folder.path().join("absent.ply")).unwrap_err().to_string().contains("absent.ply"));
}

#[test]
fn every_truncation_is_an_error() {
    for bytes in [ascii(), binary(false), binary(true)] {
        // Text may lose its last line end, and its last number would still be one.
        let last = if bytes == ascii() { bytes.len() - 2 } else { bytes.len() };
        for length in 0..last {
            assert!(from(&bytes[..length]).is_err(), "{length} of {} bytes were taken for a mesh", bytes.len());
        }
    }
}

#[test]
fn refuses_nonsense() {
    let ascii = String::from_utf8(ascii()).unwrap();
    for (find, replacement, message) in [
        ("vertex 4", "vertex 4000000000000000000", "only"),
        ("vertex 4", "vertex 99999999999999999999999", ""),
        ("vertex 4", "vertex -4", ""),
        ("face 3", "face 1000000000", "only"),
        ("3 2 1 3 8", "3 2 1 4 8", "vertex 4"),
        ("3 2 1 3 8", "3 2 1 -1 8", "vertex -1"),
        ("3 2 1 3 8", "4000000000 0 1 8", "longer than the file"),
        ("3 2 1 3 8", "3 2 1 3.5 8", "`3.5` is no number"),
        ("3 2 1 3 8", "3 2 1 3", "the file ends"),
        ("0 0 0.5", "0 0.5 0.5.5", "vertex 0 of 4"),
        ("property float x", "property float w", "lack x"),
        ("vertex_indices", "corners", "lack vertex_indices"),
        ("list uchar int vertex_indices", "list uchar float vertex_indices", ""),
        ("element face 3", "element empty 1000000000\nelement face 3", "no properties"),
    ] {
        let text = ascii.replacen(find, replacement, 1);
        assert_ne!(text, ascii, "{find} was not found");
        let error = from(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(message), "{replacement}: {error}");
    }
}

/// The text mesh with some of it replaced.
fn with(changes: &[(&str, &str)]) -> PlyMesh {
    let mut text = String::from_utf8(ascii()).unwrap();
    for (find, replacement) in changes {
        assert!(text.contains(find), "{find} was not found");
        text = text.replacen(find, replacement, 1);
    }
    from(text.as_bytes()).unwrap()
}

fn said(mesh: &PlyMesh) -> Vec<String> {
    mesh.faults.iter().map(|fault| format!("{}: {}", fault.what, fault.instead)).collect()
}

#[test]
fn faces_of_many_corners_become_fans_and_are_still_one_face() {
    let mesh = with(&[("3 2 1 3 8", "5 0 1 3 2 0 8")]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3], [0, 3, 2], [0, 2, 0]]);
    assert_eq!((mesh.triangle_faces, mesh.quads.len(), mesh.faults.len()), (2, 1, 0));
}

#[test]
fn faces_of_few_corners_are_left_out_and_counted() {
    let mesh = with(&[("3 0 1 2 7", "2 0 1 7"), ("3 2 1 3 8", "0 8")]);
    assert_eq!((mesh.triangles.len(), mesh.triangle_faces, mesh.quads.len()), (0, 0, 1));
    assert_eq!(said(&mesh), ["2 of its faces have fewer than 3 corners: they are left out"]);
}

#[test]
fn what_is_not_finite_is_left_out() {
    // Vertex 3, which a quad and a triangle have.
    for bad in ["nan 1", "1 1e99", "-inf 1", "NaN 1"] {
        let mesh = with(&[("1 1 0.5", &format!("{bad} 0.5"))]);
        assert_eq!((mesh.triangles.as_slice(), mesh.quads.len(), mesh.triangle_faces), (&[[0, 1, 2]][..], 0, 1));
        assert_eq!(said(&mesh), ["2 of its faces have corners that are not finite: they are left out"]);
        assert!(mesh.positions.as_flattened().iter().all(|v| v.is_finite()));
    }
    // All corners of a face of five go together; a vertex that nothing uses harms nobody.
    let mesh = with(&[("1 1 0.5", "nan 1 0.5"), ("4 0 1 3 2 7", "5 0 1 2 1 3 7"), ("3 2 1 3 8", "3 2 1 0 8")]);
    assert_eq!((mesh.triangles.len(), mesh.triangle_faces, mesh.faults.len()), (2, 2, 1));
    let mesh = with(&[("1 1 0.5", "nan 1 0.5"), ("4 0 1 3 2 7", "3 0 1 2 7"), ("3 2 1 3 8", "3 2 1 0 8")]);
    assert_eq!((mesh.triangles.len(), mesh.faults.len()), (3, 0));
    // Nothing is left.
    let mesh = with(&[("0 0 0.5", "0 0 nan"), ("1 1 0.5", "1 1 inf")]);
    assert_eq!((mesh.triangles.len(), mesh.quads.len(), said(&mesh).len()), (0, 0, 1));
    // Normals and texture coordinates go alone.
    let mesh = with(&[("0 0 1 255", "0 nan 1 255")]);
    assert_eq!((mesh.normals.len(), mesh.uvs.len(), mesh.triangles.len()), (0, 4, 2));
    assert_eq!(said(&mesh), ["some of its normals are not finite: all of them are left out"]);
    let mesh = with(&[("255 1 1", "255 1 inf")]);
    assert_eq!((mesh.normals.len(), mesh.uvs.len(), mesh.triangles.len()), (4, 0, 2));
    assert_eq!(said(&mesh), ["some of its texture coordinates are not finite: all of them are left out"]);
}

/// Numbers in binary files are taken as they are in text.
#[test]
fn binary_numbers_that_are_not_finite_are_left_out() {
    let mut bytes = binary(false);
    let one = bytes.windows(4).position(|four| four == 1.0f32.to_le_bytes()).unwrap();
    bytes[one..one + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let mesh = from(&bytes).unwrap();
    assert_eq!((mesh.normals.len(), mesh.triangles.len(), mesh.faults.len()), (0, 2, 1));
}

#[test]
fn line_ends_of_text_mean_no_more_than_blanks() {
    let text = String::from_utf8(ascii()).unwrap();
    let (header, body) = text.split_at(text.find("end_header\n").unwrap() + "end_header\n".len());
    let one_line = body.replace('\n', " ");
    let one_a_line = body.replace(' ', "\n");
    let apart = body.replace('\n', "\r\n\r\n \t");
    let spelled = body.replace("0.5", ".5").replace(" 255 ", " +255 ");
    for body in [one_line, one_a_line, apart, spelled] {
        assert_eq!(from(format!("{header}{body}").as_bytes()).unwrap(), expected(), "{body}");
    }
    let lengths = text.replace("list uchar int", "list float int").replace("\n3 ", "\n3.0 ");
    assert_eq!(from(lengths.as_bytes()).unwrap(), expected());
    assert!(from(lengths.replace("\n4 ", "\n4.5 ").as_bytes()).unwrap_err().to_string().contains("4.5 is no length"));
}

/// Prints how fast a binary mesh is read.
#[test]
#[ignore = "a measurement"]
fn speed() {
    let (n, header) = (1_000_000u32, "property float x\nproperty float y\nproperty float z\n");
    let faces = "property list uchar int vertex_indices\nend_header\n";
    let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {n}\n{header}element face {n}\n{faces}");
    let mut bytes = head.into_bytes();
    (0..3 * n).for_each(|i| bytes.extend((i as f32).to_le_bytes()));
    for i in 0..n {
        bytes.push(3);
        [i, (i + 1) % n, (i + 2) % n].iter().for_each(|i| bytes.extend(i.to_le_bytes()));
    }
    let start = std::time::Instant::now();
    assert_eq!(from(&bytes).unwrap().triangles.len(), n as usize);
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.1} MB in {seconds:.3} s: {:.0} MB/s", bytes.len() as f64 * 1e-6, bytes.len() as f64 * 1e-6 / seconds);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damage_never_panics(which in 0..3u8, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = match which { 0 => ascii(), 1 => binary(false), _ => binary(true) };
        for (place, value) in edits {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if let Ok(mesh) = from(&bytes) {
            let count = mesh.positions.len() as u32;
            prop_assert!(mesh.triangles.as_flattened().iter().all(|i| *i < count));
        }
    }
}

#[test]
fn concave_faces_are_cut_within_them() {
    let l = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 0\n6 0 1 2 3 4 5\n";
    let mesh = from(l.as_bytes()).unwrap();
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    };
    let areas: Vec<f32> = mesh.triangles.iter().map(area).collect();
    assert!(areas.len() == 4 && areas.iter().all(|a| *a >= 0.0) && areas.iter().sum::<f32>() == 3.0, "{areas:?}");
    assert_eq!((mesh.triangle_faces, mesh.faults), (1, vec![]));
}

#[test]
fn a_face_of_more_corners_than_vertices_allow_is_left_out() {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\nproperty uchar z\n\
        element face 1\nproperty list uint uchar vertex_indices\nend_header\n"
        .to_vec();
    bytes.extend([0, 0, 0, 1, 0, 0, 0, 1, 0]);
    bytes.extend(1000u32.to_le_bytes());
    bytes.extend((0..1000).map(|i| (i % 3) as u8));
    let mesh = from(&bytes).unwrap();
    assert!(mesh.triangles.is_empty() && mesh.faults.len() == 1, "{:?}", mesh.faults);
    assert!(mesh.faults[0].what.contains("more than two corners for each"), "{:?}", mesh.faults);
}
