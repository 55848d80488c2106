//! Meshes from PLY files (G. Turk 1994), text or binary of both byte orders, gzipped or not, through the crate
//! `ply-rs-bw`.
//!
//! Assumes nothing of the file: counts are checked against its size before the first element is read, indices against
//! the number of vertices, numbers for being finite. Elements stream into the mesh one by one.

use std::io::BufRead;
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};

use super::pbrt::file::{Source, read_bytes, unreadable};
use super::{SceneError, SceneErrorKind};

/// A mesh as its file states it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyMesh {
    /// Positions in object space.
    pub positions: Vec<[f32; 3]>,
    /// Normals, one a vertex, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one a vertex, or empty.
    pub uvs: Vec<[f32; 2]>,
    /// Faces of three corners.
    pub triangles: Vec<[u32; 3]>,
    /// Faces of four corners, in order around the face.
    pub quads: Vec<[u32; 4]>,
}

#[derive(Default)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let place = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" | "texture_u" | "texture_s" => &mut self.uv[0],
            "v" | "t" | "texture_v" | "texture_t" => &mut self.uv[1],
            _ => return PropertyAccessResult::Ignored,
        };
        match property.to_f32_lossy() {
            Some(value) => *place = value,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

#[derive(Default)]
struct Face {
    corners: Vec<u32>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListUInt(list) => list,
            // A negative index becomes one that no mesh holds: the range check names it.
            Property::ListInt(list) => list.into_iter().map(|i| i as u32).collect(),
            other => match other.to_u32_list() {
                Some(list) => list,
                None => return PropertyAccessResult::UnsupportedType,
            },
        };
        PropertyAccessResult::Set
    }
}

/// An element that nobody wants.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Text lines beyond this are no element of a mesh; splitting them into words would cost many times their size.
const LONGEST_LINE: usize = 1 << 20;

/// Reads a mesh. Vertex properties `x y z`, `nx ny nz`, and `u v`, `s t`, `texture_u texture_v` or `texture_s
/// texture_t`; face property `vertex_indices` or `vertex_index`; whatever else there is (colours, pbrt's
/// `face_indices`) is passed over.
///
/// # Errors
/// `File` where the file cannot be read, is cut off or contradicts itself, `Unsupported` for faces of more than four
/// corners, `Limit` for more vertices than 32 bits count. Errors have no span: the caller knows who named the file.
pub fn read(path: &Path) -> Result<PlyMesh> {
    parse(&read_bytes(path, Source::Regular)?, path)
}

/// [`read`] from bytes; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<PlyMesh> {
    let header_parser = Parser::<Skipped>::new();
    let mut reader = Reader::new(bytes);
    let header = header_parser.read_header(&mut reader).map_err(|e| damaged(path, &e.to_string()))?;
    let mut mesh = PlyMesh::default();
    let mut rest = *reader.get_ref();
    let mut line = String::new();
    for element in header.elements.values() {
        check_count(element, header.encoding, rest.len(), path)?;
        let mut next = Next { encoding: header.encoding, element, rest: &mut rest, line: &mut line, path };
        match element.name.as_str() {
            "vertex" => read_vertices(&mut next, &mut mesh)?,
            "face" => read_faces(&mut next, &mut mesh)?,
            _ => {
                for index in 0..element.count {
                    next.read::<Skipped>(index)?;
                }
            }
        }
    }
    let count = mesh.positions.len();
    let all = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened());
    if let Some(bad) = all.copied().find(|&i| i as usize >= count) {
        return Err(damaged(path, &format!("a face names vertex {}, but there are {count}", bad as i32)));
    }
    Ok(mesh)
}

/// Reads one element after the other from what is left of the file.
struct Next<'a, 'b> {
    encoding: Encoding,
    element: &'a ElementDef,
    rest: &'a mut &'b [u8],
    line: &'a mut String,
    path: &'a Path,
}

impl Next<'_, '_> {
    fn read<E: PropertyAccess>(&mut self, index: usize) -> Result<E> {
        let parser = Parser::<E>::new();
        let element = match self.encoding {
            Encoding::BinaryLittleEndian => parser.read_little_endian_element(self.rest, self.element),
            Encoding::BinaryBigEndian => parser.read_big_endian_element(self.rest, self.element),
            Encoding::Ascii => {
                self.line.clear();
                if self.rest.len() > LONGEST_LINE && !self.rest[..LONGEST_LINE].contains(&b'\n') {
                    return Err(self.damaged(index, "the line is longer than 1 MiB"));
                }
                match self.rest.read_line(self.line) {
                    Ok(0) => return Err(self.damaged(index, "the file ends")),
                    Ok(_) => parser.read_ascii_element(self.line, self.element),
                    Err(e) => return Err(self.damaged(index, &e.to_string())),
                }
            }
        };
        element.map_err(|e| self.damaged(index, &e.to_string()))
    }

    fn damaged(&self, index: usize, reason: &str) -> Box<SceneError> {
        damaged(self.path, &format!("{} {index} of {}: {reason}", self.element.name, self.element.count))
    }
}

fn read_vertices(next: &mut Next, mesh: &mut PlyMesh) -> Result<()> {
    let element = next.element;
    let has = |names: &[&str]| names.iter().all(|n| element.properties.contains_key(*n));
    if !has(&["x", "y", "z"]) {
        return Err(damaged(next.path, "its vertices lack x, y or z"));
    }
    if element.count > u32::MAX as usize {
        let what = format!("{} holds more vertices than 32-bit indices reach", next.path.display());
        return Err(SceneError::new(SceneErrorKind::Limit(what)));
    }
    let normals = has(&["nx", "ny", "nz"]);
    let uvs = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]].iter().any(|n| has(n));
    mesh.positions.reserve_exact(element.count);
    for index in 0..element.count {
        let vertex: Vertex = next.read(index)?;
        let numbers = vertex.position.iter().chain(&vertex.normal).chain(&vertex.uv);
        if numbers.into_iter().any(|v| !v.is_finite()) {
            return Err(next.damaged(index, "a number is not finite"));
        }
        mesh.positions.push(vertex.position);
        if normals {
            mesh.normals.push(vertex.normal);
        }
        if uvs {
            mesh.uvs.push(vertex.uv);
        }
    }
    Ok(())
}

fn read_faces(next: &mut Next, mesh: &mut PlyMesh) -> Result<()> {
    let properties = &next.element.properties;
    if !properties.contains_key("vertex_indices") && !properties.contains_key("vertex_index") {
        return Err(damaged(next.path, "its faces lack vertex_indices"));
    }
    for index in 0..next.element.count {
        let face: Face = next.read(index)?;
        match face.corners[..] {
            [a, b, c] => mesh.triangles.push([a, b, c]),
            [a, b, c, d] => mesh.quads.push([a, b, c, d]),
            _ => {
                let count = face.corners.len();
                let what = format!("face {index} of {} has {count} corners", next.path.display());
                return Err(SceneError::new(SceneErrorKind::Unsupported(what))
                    .help("faces have 3 or 4 corners: triangulate the mesh when exporting it"));
            }
        }
    }
    Ok(())
}

/// The declared number of elements fits into the bytes that are left.
fn check_count(element: &ElementDef, encoding: Encoding, left: usize, path: &Path) -> Result<()> {
    let size = |scalar: &ScalarType| match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least: usize = match encoding {
        // A character and a separator each; the very last separator may be missing.
        Encoding::Ascii => 2 * element.properties.len(),
        _ => element.properties.values().fold(0usize, |sum, p| {
            sum.saturating_add(match &p.data_type {
                PropertyType::Scalar(scalar) => size(scalar),
                PropertyType::List(count, _) => size(count),
            })
        }),
    };
    if element.count > 0 && least == 0 {
        return Err(damaged(path, &format!("element {} has no properties", element.name)));
    }
    if element.count.saturating_mul(least) > left.saturating_add(1) {
        let message =
            format!("it declares {} of element {}, but only {left} bytes follow", element.count, element.name);
        return Err(damaged(path, &message));
    }
    Ok(())
}

/// An error about the file's content; long reasons (they may quote a whole line) are cut short.
fn damaged(path: &Path, reason: &str) -> Box<SceneError> {
    let first = reason.lines().next().unwrap_or("");
    let short: String = first.chars().take(200).collect();
    unreadable(path, short)
}

#[cfg(test)]
mod tests {
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
            quads: vec![[0, 1, 3, 2]],
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
            ("3 2 1 3 8", "5 0 1 2 3 0 8", "5 corners"),
            ("3 2 1 3 8", "2 0 1 8", "2 corners"),
            ("3 2 1 3 8", "4000000000 0 1 8", ""),
            ("0 0 0.5", "0 nan 0.5", "vertex 0"),
            ("0 0 0.5", "0 1e99 0.5", "finite"),
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

    /// Prints how fast a binary mesh is read.
    #[test]
    #[ignore = "a measurement"]
    fn speed() {
        let (n, header) = (1_000_000u32, "property float x\nproperty float y\nproperty float z\n");
        let faces = "property list uchar int vertex_indices\nend_header\n";
        let head =
            format!("ply\nformat binary_little_endian 1.0\nelement vertex {n}\n{header}element face {n}\n{faces}");
        let mut bytes = head.into_bytes();
        (0..3 * n).for_each(|i| bytes.extend((i as f32).to_le_bytes()));
        for i in 0..n {
            bytes.push(3);
            [i, (i + 1) % n, (i + 2) % n].iter().for_each(|i| bytes.extend(i.to_le_bytes()));
        }
        let start = std::time::Instant::now();
        assert_eq!(from(&bytes).unwrap().triangles.len(), n as usize);
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{:.1} MB in {seconds:.3} s: {:.0} MB/s",
            bytes.len() as f64 * 1e-6,
            bytes.len() as f64 * 1e-6 / seconds
        );
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
}
