//! `trianglemesh`, `bilinearmesh`, `plymesh` and `loopsubdiv`.

use std::path::PathBuf;

use glam::{DVec3, Vec2, Vec3};

use super::super::{ShapeKind, shape::BilinearMesh, shape::TriangleMesh};
use super::loop_subdivision::subdivide;
use super::{Kinds, Placement, Result};
use crate::scene::{ParamSet, SceneError, SceneErrorKind, Warnings};

/// Vertex attributes as stated.
pub(super) struct Vertices<'a> {
    pub positions: &'a [[f32; 3]],
    /// As many, or none.
    pub normals: &'a [[f32; 3]],
    /// As many, or none.
    pub uvs: &'a [[f32; 2]],
}

impl Placement<'_> {
    /// The numbers in "indices" in groups of N, each checked against the vertex count; what is left over is cut off with a warning, as in pbrt-v4.
    fn groups<const N: usize>(
        &self,
        params: &ParamSet,
        vertices: usize,
        warnings: &mut Warnings,
    ) -> Result<Vec<[u32; N]>> {
        let indices = params.integers("indices")?;
        if !params.has("indices") {
            if vertices == N {
                return Ok(vec![std::array::from_fn(|i| i as u32)]);
            }
            let what = format!("\"indices\" are missing; only with exactly {N} points can they be, found {vertices}");
            return Err(self.unusable(params, what));
        }
        let (groups, rest) = indices.as_chunks::<N>();
        if !rest.is_empty() {
            let what = format!("the number of \"indices\" must be a multiple of {N}, found {}", indices.len());
            warnings.add_fault(params.span, format!("{}: {what}", params.owner), "those left over are cut off");
        }
        groups
            .iter()
            .map(|group| {
                if let Some(bad) = group.iter().find(|&&i| i < 0 || i as usize >= vertices) {
                    let what = format!("index {bad} is out of range: there are {vertices} points in \"P\"");
                    return Err(self.unusable(params, what));
                }
                Ok(group.map(|i| i as u32))
            })
            .collect()
    }

    /// Leaves lists out that do not go with the points, with a warning, as pbrt-v4 does.
    fn check_counts(&self, params: &ParamSet, vertices: &mut Vertices, warnings: &mut Warnings) -> Result<()> {
        let points = vertices.positions.len();
        let mut goes_with = |name: &str, count: usize| {
            let goes = count == 0 || count == points;
            if !goes {
                let what = format!("{}: \"{name}\" has {count} values for {points} points in \"P\"", params.owner);
                warnings.add_fault(params.span, what, "they are left out");
            }
            goes
        };
        if !goes_with("N", vertices.normals.len()) {
            vertices.normals = &[];
        }
        if !goes_with("uv", vertices.uvs.len()) {
            vertices.uvs = &[];
        }
        if let Some(i) = vertices.uvs.iter().position(|uv| !uv.iter().all(|c| c.is_finite())) {
            return Err(self.error(params, format!("\"uv\" number {i} is not finite")));
        }
        Ok(())
    }

    fn triangles(&self, params: &ParamSet, vertices: &Vertices, indices: Vec<[u32; 3]>) -> Result<ShapeKind> {
        if let Some(displacement) = self.displacement {
            return self.displaced(displacement, params, vertices, &indices, &[]);
        }
        Ok(ShapeKind::Triangles(TriangleMesh {
            positions: self.points(params, "P", vertices.positions)?,
            indices,
            normals: self.normals(params, vertices.normals, self.reverse)?,
            uvs: vertices.uvs.iter().copied().map(Vec2::from).collect(),
        }))
    }

    fn patches(&self, params: &ParamSet, vertices: &Vertices, indices: Vec<[u32; 4]>) -> Result<ShapeKind> {
        if let Some(displacement) = self.displacement {
            return self.displaced(displacement, params, vertices, &[], &indices);
        }
        Ok(ShapeKind::Bilinear(BilinearMesh {
            positions: self.points(params, "P", vertices.positions)?,
            indices,
            normals: self.normals(params, vertices.normals, self.reverse)?,
            uvs: vertices.uvs.iter().copied().map(Vec2::from).collect(),
        }))
    }
}

fn stated(params: &ParamSet) -> Result<Vertices<'_>> {
    Ok(Vertices { positions: params.vec3s("P")?, normals: params.vec3s("N")?, uvs: params.vec2s("uv")? })
}

fn no_points(params: &ParamSet, placement: &Placement, vertices: &Vertices) -> Option<Box<SceneError>> {
    vertices.positions.is_empty().then(|| placement.unusable(params, "\"P\" is missing or empty"))
}

/// Marks what pbrt-v4's meshes take besides and what changes no image: numbers of faces, which only Ptex asks for, a way to sample an emitter, the one
/// scheme of subdivision.
fn without_effect(params: &ParamSet) {
    for name in ["faceIndices", "emissionfilename", "scheme"] {
        params.get(name);
    }
}

pub(super) fn triangle_mesh(params: &ParamSet, placement: &Placement, warnings: &mut Warnings) -> Result<Kinds> {
    without_effect(params);
    params.warn_ignored("S", "tangents are those of the texture coordinates", warnings);
    let mut vertices = stated(params)?;
    if let Some(error) = no_points(params, placement, &vertices) {
        return Err(error);
    }
    placement.check_counts(params, &mut vertices, warnings)?;
    let indices = placement.groups::<3>(params, vertices.positions.len(), warnings)?;
    Ok(vec![placement.triangles(params, &vertices, indices)?])
}

pub(super) fn bilinear_mesh(params: &ParamSet, placement: &Placement, warnings: &mut Warnings) -> Result<Kinds> {
    without_effect(params);
    let mut vertices = stated(params)?;
    if let Some(error) = no_points(params, placement, &vertices) {
        return Err(error);
    }
    placement.check_counts(params, &mut vertices, warnings)?;
    let indices = placement.groups::<4>(params, vertices.positions.len(), warnings)?;
    Ok(vec![placement.patches(params, &vertices, indices)?])
}

/// The most faces that a subdivision surface may come to: with its normals, some 5 GiB.
const MOST_FACES: u64 = 1 << 26;

/// A subdivision surface, as the triangles and normals it has after "levels".
pub(super) fn loop_subdivision(params: &ParamSet, placement: &Placement, warnings: &mut Warnings) -> Result<Kinds> {
    without_effect(params);
    let points = params.vec3s("P")?;
    let control = Vertices { positions: points, normals: &[], uvs: &[] };
    if let Some(error) = no_points(params, placement, &control) {
        return Err(error);
    }
    let levels = match params.integer("levels", 3)? {
        levels @ 0..=12 => levels as u32,
        _ => return Err(params.wrong("levels", "from 0 to 12")),
    };
    let faces = placement.groups::<3>(params, points.len(), warnings)?;
    if (faces.len() as u64) << (2 * levels) > MOST_FACES {
        let what = format!("{} faces at {levels} levels come to more than {MOST_FACES} triangles", faces.len());
        return Err(SceneError::at(params.span, SceneErrorKind::Limit(what)).help("ask for fewer \"levels\""));
    }
    // Before anything is computed with them: whether they are finite.
    placement.points(params, "P", points)?;
    let control = points.iter().map(|p| Vec3::from_array(*p).as_dvec3()).collect();
    let surface = subdivide(control, faces, levels).map_err(|what| placement.unusable(params, what))?;
    let single = |list: &[DVec3]| -> Vec<[f32; 3]> { list.iter().map(|v| v.as_vec3().to_array()).collect() };
    let (positions, normals) = (single(&surface.positions), single(&surface.normals));
    let vertices = Vertices { positions: &positions, normals: &normals, uvs: &[] };
    Ok(vec![placement.triangles(params, &vertices, surface.faces)?])
}

/// A PLY file's triangles, and its quads as bilinear patches: a face's vertices go around, a patch's in rows. Displaced, they are one mesh.
pub(super) fn ply_mesh(
    params: &ParamSet,
    placement: &Placement,
    base: &dyn Fn(&str) -> PathBuf,
    warnings: &mut Warnings,
) -> Result<Kinds> {
    let Some(name) = params.string("filename")? else {
        return Err(placement.error(params, "\"filename\" is missing"));
    };
    let mesh = crate::scene::ply::read(&base(name)).map_err(|mut error| {
        error.span.get_or_insert(params.span);
        error
    })?;
    for fault in &mesh.faults {
        warnings.add_fault(params.span, format!("{name}: {}", fault.what), fault.instead);
    }
    let mut vertices = Vertices { positions: &mesh.positions, normals: &mesh.normals, uvs: &mesh.uvs };
    placement.check_counts(params, &mut vertices, warnings)?;
    let count = vertices.positions.len();
    let in_range = |i: &u32| (*i as usize) < count;
    if let Some(bad) = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened()).find(|i| !in_range(i)) {
        return Err(placement.error(params, format!("{name}: vertex {bad} is out of range, there are {count}")));
    }
    let rows: Vec<[u32; 4]> = mesh.quads.iter().map(|&[a, b, c, d]| [a, b, d, c]).collect();
    let mut kinds = Kinds::new();
    match placement.displacement {
        Some(displacement) if !(mesh.triangles.is_empty() && rows.is_empty()) => {
            kinds.push(placement.displaced(displacement, params, &vertices, &mesh.triangles, &rows)?);
            placement.stated_faces.set(Some(mesh.triangle_faces + rows.len() as u32));
            return Ok(kinds);
        }
        _ => {}
    }
    if mesh.triangle_faces as usize != mesh.triangles.len() {
        placement.stated_faces.set(Some(mesh.triangle_faces));
    }
    if !mesh.triangles.is_empty() {
        kinds.push(placement.triangles(params, &vertices, mesh.triangles.clone())?);
    }
    if !rows.is_empty() {
        kinds.push(placement.patches(params, &vertices, rows)?);
    }
    Ok(kinds)
}
