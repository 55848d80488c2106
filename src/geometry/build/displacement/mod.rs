//! Displacement: meshes whose points are moved along their normals by a texture, once they are fine enough to show it.
//!
//! Sources: pbrt-v4's `plymesh` for the parameters, for refining until edges are short and for normals that are interpolated over the edges; Cook 1984, "Shade
//! Trees", section 4, for the idea. One idea a file: `control.rs` is the mesh as stated, `refine.rs` makes it finer, `places.rs` tells which vertices lie
//! at one place, and here they are moved.
//!
//! **Ours:** vertices that lie at one place but differ in normal or texture coordinates (seams) move together, by the mean of their heights along the
//! mean of their normals, so that no seam tears (in pbrt-v4 they do). Only where the normals cancel, as on the two sides of a sheet, does each go
//! its own way. Texture coordinates may be missing (pbrt-v4 refuses that), and quadrilaterals and subdivision surfaces can be displaced too.

mod control;
mod places;
mod refine;
#[cfg(test)]
mod tests;

use glam::{DAffine3, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use self::control::Control;
use self::places::Places;
use self::refine::Refinement;
use super::meshes::Vertices;
use super::{Placement, Result};
use crate::geometry::{ShapeKind, shape::TriangleMesh};
use crate::scene::{ParamSet, SceneError, SceneErrorKind, Span};
use crate::system::memory::available;

/// The length of edges where none is stated (pbrt-v4).
pub const EDGE_LENGTH: f32 = 1.0;

/// The most triangles that one mesh may come to.
const MOST_TRIANGLES: u64 = 1 << 26;

/// Bytes that a triangle takes while the mesh is made and when rays are traced: its share of vertices twice, of the table of halved edges and of the
/// acceleration structure. For what is refused before anything is allocated; a plane of 17 million triangles took 131 through Embree.
const BYTES_PER_TRIANGLE: u64 = 200;

/// Unit normals at one place are taken for one where the cosine between them is above this.
const SAME_NORMAL: f32 = 0.99;

/// More vertices at one place than this are no surface that could be smooth, and are not compared with each other.
const MOST_AT_ONE_PLACE: usize = 256;

/// Normals at one place cancel where their sum is shorter than this, times their number.
const CANCELLED: f64 = 1e-3;

/// How far the point at `p` (in world space, as the shape's own transform places it), with this unit normal and these texture coordinates, moves along
/// its normal: in units of the shape's own space.
pub type Height<'a> = dyn Fn(DVec3, Vec3, Vec2) -> f32 + Sync + 'a;

/// What moves the points of a mesh.
pub struct Displacement<'a> {
    /// How far.
    pub height: &'a Height<'a>,
    /// The shape's own space to the world (in an object: to the object's space), at both ends of its motion.
    pub to_world: [DAffine3; 2],
    /// Edges in the world are made at most as long, above 0.
    pub edge_length: f64,
    /// Where it was asked for.
    pub span: Span,
}

/// The kinds of shapes that are meshes: no other is displaced.
pub fn can_be_displaced(kind: &str) -> bool {
    matches!(kind, "trianglemesh" | "plymesh" | "bilinearmesh" | "loopsubdiv")
}

/// The length of edges that `params` ask for.
///
/// # Errors
/// Lengths that are not above 0.
pub fn edge_length(params: &ParamSet) -> Result<f32> {
    // The second name is shorter to write; pbrt-v4 has the first.
    let name = if params.has("displacement.edgelength") { "displacement.edgelength" } else { "edgelength" };
    params.positive(name, EDGE_LENGTH)
}

impl Placement<'_> {
    /// The displaced mesh over the vertices that `params` state.
    ///
    /// # Errors
    /// More triangles than are allowed or fit into memory, before they are made; heights that are not finite; points too far away.
    pub(super) fn displaced(
        &self,
        displacement: &Displacement,
        params: &ParamSet,
        vertices: &Vertices,
        triangles: &[[u32; 3]],
        patches: &[[u32; 4]],
    ) -> Result<ShapeKind> {
        let &Displacement { to_world, edge_length, span, .. } = displacement;
        self.stated_faces.set(Some((triangles.len() + patches.len()) as u32));
        let by_memory = available().map_or(u64::MAX, |left| left / BYTES_PER_TRIANGLE);
        let most = MOST_TRIANGLES.min(by_memory);
        let too_many = || {
            let why = if by_memory < MOST_TRIANGLES { ", more than fit into the memory that is left" } else { "" };
            let what = format!(
                "{}: with edges of at most {} it comes to more than {most} triangles{why}",
                params.owner, edge_length as f32
            );
            let help =
                "ask for longer edges in \"displacement.edgelength\": twice the length is a quarter of the triangles";
            SceneError::at(span, SceneErrorKind::Limit(what)).help(help)
        };
        if (triangles.len() + 2 * patches.len()) as u64 > most {
            return Err(too_many());
        }
        // Before anything is computed with them: whether they are finite.
        self.points(params, "P", vertices.positions)?;
        let control = Control::new(vertices.positions, vertices.normals, vertices.uvs, triangles, patches);
        let refinement = Refinement::new(to_world.map(|m| m.matrix3), edge_length);
        if refinement.count(&control, most).is_none() {
            return Err(too_many());
        }
        let has_normals = control.has_normals;
        let mesh = refinement.refine(control);
        let places = Places::of(&mesh.positions);
        let moved = self.moved(displacement, params, &mesh, &places)?;
        // Faceted meshes stay faceted.
        let normals = if has_normals { smooth_normals(&mesh, &moved, &places) } else { vec![] };
        let place = |(i, p): (usize, &DVec3)| self.point(params, "displaced P", i, *p);
        Ok(ShapeKind::Triangles(TriangleMesh {
            positions: moved.iter().enumerate().map(place).collect::<Result<_>>()?,
            indices: mesh.faces,
            normals: self.normals(params, &normals, self.reverse)?,
            uvs: mesh.uvs,
        }))
    }

    /// Where the vertices go, in the shape's own space.
    fn moved(
        &self,
        displacement: &Displacement,
        params: &ParamSet,
        mesh: &Control,
        places: &Places,
    ) -> Result<Vec<DVec3>> {
        let to_world = displacement.to_world[0];
        // A transform that flattens the shape leaves its normals no meaning in the world.
        let inverse = to_world.matrix3.inverse();
        let to_normal = if inverse.is_finite() { inverse.transpose() } else { glam::DMat3::IDENTITY };
        let height = |v: usize| {
            let n = (to_normal * mesh.normals[v].as_dvec3()).normalize_or_zero().as_vec3();
            (displacement.height)(to_world.transform_point3(mesh.positions[v]), n, mesh.uvs[v])
        };
        let heights: Vec<f32> = (0..mesh.positions.len()).into_par_iter().map(height).collect();
        if let Some(v) = heights.iter().position(|height| !height.is_finite()) {
            let uv = mesh.uvs[v];
            let what = format!("its displacement is not finite ({}) at u, v = {}, {}", heights[v], uv.x, uv.y);
            return Err(self.error(params, what));
        }
        let mut moved = mesh.positions.clone();
        for place in places.iter(&mesh.positions) {
            let sum: DVec3 = place.iter().map(|&v| mesh.normals[v as usize].as_dvec3()).sum();
            let is_seam = sum.length() > CANCELLED * place.len() as f64;
            let mean = place.iter().map(|&v| f64::from(heights[v as usize])).sum::<f64>() / place.len() as f64;
            for v in place.iter().map(|&v| v as usize) {
                let (n, height) =
                    if is_seam { (sum.normalize(), mean) } else { (mesh.normals[v].as_dvec3(), f64::from(heights[v])) };
                moved[v] += n * height;
            }
        }
        Ok(moved)
    }
}

/// Normals of the surface through `moved`: of the faces around each vertex, weighted by their areas, together with those around the vertices at the same
/// place that had the same normal before. On the side where the stated normals were, whichever way faces go around.
fn smooth_normals(mesh: &Control, moved: &[DVec3], places: &Places) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; moved.len()];
    for face in &mesh.faces {
        let corners = face.map(|v| v as usize);
        let stated: DVec3 = corners.iter().map(|&v| mesh.normals[v].as_dvec3()).sum();
        let before = control::area_normal(corners.map(|v| mesh.positions[v]));
        let after = control::area_normal(corners.map(|v| moved[v]));
        let after = if before.dot(stated) < 0.0 { -after } else { after };
        corners.iter().for_each(|&v| sums[v] += after);
    }
    let mut normals: Vec<[f32; 3]> = mesh.normals.iter().map(|n| n.to_array()).collect();
    for place in places.iter(&mesh.positions) {
        for &v in place {
            let n = mesh.normals[v as usize];
            let is_same = |other: &&u32| mesh.normals[**other as usize].dot(n) > SAME_NORMAL;
            let around = if place.len() > MOST_AT_ONE_PLACE {
                sums[v as usize]
            } else {
                place.iter().filter(is_same).map(|&u| sums[u as usize]).sum()
            };
            if let Some(smooth) = around.try_normalize() {
                normals[v as usize] = smooth.as_vec3().to_array();
            }
        }
    }
    normals
}
