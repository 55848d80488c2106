//! What a mesh of a file is taken for where it is not one of triangles and quads of finite numbers. pbrt-v4 leaves out all faces but those of 3 and 4
//! corners; here those of more are cut into triangles.

use super::PlyMesh;
use super::ears::{MOST_CORNERS, MOST_WORK, ears};

/// Something that was left out of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What is wrong with the file.
    pub what: String,
    /// What happens instead.
    pub instead: &'static str,
}

/// The faces that have neither 3 nor 4 corners.
#[derive(Default)]
pub(super) struct Polygons {
    /// Of each face the number of its corners, then these: fewer allocations than a list of lists.
    flat: Vec<u32>,
    /// Faces of fewer than 3 corners.
    too_small: u32,
}

impl Polygons {
    pub(super) fn push(&mut self, corners: &[u32]) {
        if corners.len() < 3 {
            self.too_small = self.too_small.saturating_add(1);
        } else {
            self.flat.push(corners.len() as u32);
            self.flat.extend(corners);
        }
    }

    fn faces(&self) -> impl Iterator<Item = &[u32]> {
        let mut rest = self.flat.as_slice();
        std::iter::from_fn(move || {
            let (&count, after) = rest.split_first()?;
            let (face, after) = after.split_at(count as usize);
            rest = after;
            Some(face)
        })
    }

    /// The vertices that they name.
    pub(super) fn corners(&self) -> impl Iterator<Item = &u32> {
        self.faces().flatten()
    }
}

impl PlyMesh {
    /// Cuts the polygons into triangles and leaves out what has no meaning. All vertices that faces name exist.
    pub(super) fn mend(&mut self, polygons: Polygons) {
        let is_finite = |numbers: &[f32]| numbers.iter().all(|v| v.is_finite());
        if !is_finite(self.normals.as_flattened()) {
            self.normals.clear();
            self.fault("some of its normals are not finite".to_owned(), "all of them are left out");
        }
        if !is_finite(self.uvs.as_flattened()) {
            self.uvs.clear();
            self.fault("some of its texture coordinates are not finite".to_owned(), "all of them are left out");
        }
        let good: Vec<bool> = self.positions.iter().map(|p| is_finite(p)).collect();
        let is_good = |face: &[u32]| face.iter().all(|&i| good[i as usize]);
        let stated = self.triangles.len() + self.quads.len() + polygons.faces().count();
        if good.contains(&false) {
            self.triangles.retain(|face| is_good(face));
            self.quads.retain(|face| is_good(face));
        }
        let (mut faces, mut work) = (self.triangles.len(), MOST_WORK);
        // A face may be joined around holes, where it comes by a vertex twice. One that comes by all of them more often is made to fill the memory.
        let is_sound = |face: &[u32]| face.len() <= 2 * self.positions.len();
        let unsound = polygons.faces().filter(|face| is_good(face) && !is_sound(face)).count();
        for face in polygons.faces().filter(|face| is_good(face) && is_sound(face)) {
            let cut = (face.len() <= MOST_CORNERS).then(|| {
                let corners: Vec<[f32; 3]> = face.iter().map(|&i| self.positions[i as usize]).collect();
                ears(&corners, &mut work)
            });
            match cut.flatten() {
                Some(cut) => self.triangles.extend(cut.into_iter().map(|triangle| triangle.map(|i| face[i]))),
                // A fan around the first corner: right for all faces that are convex.
                None => self.triangles.extend(face[1..].windows(2).map(|edge| [face[0], edge[0], edge[1]])),
            }
            faces += 1;
        }
        self.triangle_faces = u32::try_from(faces).unwrap_or(u32::MAX);
        if unsound > 0 {
            let what = format!("{unsound} of its faces have more than two corners for each of its vertices");
            self.fault(what, "they are left out");
        }
        let lost = stated - faces - self.quads.len() - unsound;
        if lost > 0 {
            let what = format!("{lost} of its faces have corners that are not finite");
            self.fault(what, "they are left out");
        }
        if polygons.too_small > 0 {
            let what = format!("{} of its faces have fewer than 3 corners", polygons.too_small);
            self.fault(what, "they are left out");
        }
        // Nothing uses those that are not finite any more; they must not count for the mesh's extent either.
        let stand_in = good.iter().position(|&good| good).map_or([0.0; 3], |i| self.positions[i]);
        for (position, _) in self.positions.iter_mut().zip(&good).filter(|(_, good)| !**good) {
            *position = stand_in;
        }
    }

    fn fault(&mut self, what: String, instead: &'static str) {
        self.faults.push(Fault { what, instead });
    }
}
