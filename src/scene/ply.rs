//! Meshes from PLY files (G. Turk 1994), text or binary of both byte orders, gzipped or not, through the crate
//! `ply-rs-bw`.
//!
//! Assumes nothing of the file: counts are checked against its size before the first element is read, indices against
//! the number of vertices. Elements stream into the mesh one by one. What is not finite is left out, with the faces that
//! need it; faces of many corners are cut into triangles: see `faults.rs`.

mod ascii;
mod ears;
mod faults;
#[cfg(test)]
mod tests;

use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};

pub use self::faults::Fault;
use self::faults::Polygons;
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
    /// Faces of three corners, and the triangles of those of more than four.
    pub triangles: Vec<[u32; 3]>,
    /// The number of faces, as the file states them, that the triangles are of.
    pub triangle_faces: u32,
    /// Faces of four corners, in order around the face.
    pub quads: Vec<[u32; 4]>,
    /// What was left out.
    pub faults: Vec<Fault>,
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

/// Reads a mesh. Vertex properties `x y z`, `nx ny nz`, and `u v`, `s t`, `texture_u texture_v` or `texture_s
/// texture_t`; face property `vertex_indices` or `vertex_index`; whatever else there is (colours, pbrt's
/// `face_indices`) is passed over.
///
/// # Errors
/// `File` where the file cannot be read, is cut off or contradicts itself, `Limit` for more vertices than 32 bits count. Errors have no span: the
/// caller knows who named the file.
pub fn read(path: &Path) -> Result<PlyMesh> {
    parse(&read_bytes(path, Source::Regular)?, path)
}

/// [`read`] from bytes; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<PlyMesh> {
    let header_parser = Parser::<Skipped>::new();
    let mut reader = Reader::new(bytes);
    let header = header_parser.read_header(&mut reader).map_err(|e| damaged(path, &e.to_string()))?;
    let (mut mesh, mut polygons) = (PlyMesh::default(), Polygons::default());
    let mut rest = *reader.get_ref();
    for element in header.elements.values() {
        check_count(element, header.encoding, rest.len(), path)?;
        let mut next = Next { encoding: header.encoding, element, rest: &mut rest, path };
        match element.name.as_str() {
            "vertex" => read_vertices(&mut next, &mut mesh)?,
            "face" => read_faces(&mut next, &mut mesh, &mut polygons)?,
            _ => {
                for index in 0..element.count {
                    next.read::<Skipped>(index)?;
                }
            }
        }
    }
    let count = mesh.positions.len();
    let all = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened()).chain(polygons.corners());
    if let Some(bad) = all.copied().find(|&i| i as usize >= count) {
        return Err(damaged(path, &format!("a face names vertex {}, but there are {count}", bad as i32)));
    }
    mesh.mend(polygons);
    Ok(mesh)
}

/// Reads one element after the other from what is left of the file.
struct Next<'a, 'b> {
    encoding: Encoding,
    element: &'a ElementDef,
    rest: &'a mut &'b [u8],
    path: &'a Path,
}

impl Next<'_, '_> {
    fn read<E: PropertyAccess>(&mut self, index: usize) -> Result<E> {
        let parser = Parser::<E>::new();
        let element = match self.encoding {
            Encoding::BinaryLittleEndian => parser.read_little_endian_element(self.rest, self.element),
            Encoding::BinaryBigEndian => parser.read_big_endian_element(self.rest, self.element),
            Encoding::Ascii => {
                return ascii::read_element(self.rest, self.element).map_err(|what| self.damaged(index, &what));
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

fn read_faces(next: &mut Next, mesh: &mut PlyMesh, polygons: &mut Polygons) -> Result<()> {
    let properties = &next.element.properties;
    if !properties.contains_key("vertex_indices") && !properties.contains_key("vertex_index") {
        return Err(damaged(next.path, "its faces lack vertex_indices"));
    }
    for index in 0..next.element.count {
        let face: Face = next.read(index)?;
        match face.corners[..] {
            [a, b, c] => mesh.triangles.push([a, b, c]),
            [a, b, c, d] => mesh.quads.push([a, b, c, d]),
            _ => polygons.push(&face.corners),
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
