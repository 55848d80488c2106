//! The mesh that is displaced: triangles whose every vertex has a normal and texture coordinates, stated or not.

use glam::{DVec3, Vec2, Vec3};

/// Triangles in the shape's own space.
#[derive(Clone, Debug, Default)]
pub struct Control {
    /// Positions.
    pub positions: Vec<DVec3>,
    /// A unit normal for each; zero for vertices of faces without area.
    pub normals: Vec<Vec3>,
    /// Texture coordinates for each.
    pub uvs: Vec<Vec2>,
    /// Three vertices each.
    pub faces: Vec<[u32; 3]>,
    /// Whether the normals were stated: the surface is meant to be smooth.
    pub has_normals: bool,
}

/// Texture coordinates of faces without any: pbrt's of triangles, and (u, v) itself of bilinear patches.
const TRIANGLE: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::ONE];
const PATCH: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];

/// A patch, whose vertices are at (0, 0), (1, 0), (0, 1) and (1, 1), as two triangles that look to the same side.
const HALVES: [[usize; 3]; 2] = [[0, 1, 3], [0, 3, 2]];

impl Control {
    /// From vertices (of normals and texture coordinates all or none) and the faces over them.
    ///
    /// Normals that are missing are those of the faces around each vertex, weighted by their areas. Without texture coordinates every face gets
    /// vertices of its own.
    pub fn new(
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        uvs: &[[f32; 2]],
        triangles: &[[u32; 3]],
        patches: &[[u32; 4]],
    ) -> Self {
        let positions: Vec<DVec3> = positions.iter().map(|p| Vec3::from_array(*p).as_dvec3()).collect();
        let halves = patches.iter().flat_map(|patch| HALVES.map(|half| half.map(|corner| patch[corner])));
        let faces: Vec<[u32; 3]> = triangles.iter().copied().chain(halves).collect();
        let mut sums = vec![DVec3::ZERO; positions.len()];
        for face in &faces {
            let across = area_normal(face.map(|v| positions[v as usize]));
            face.iter().for_each(|&v| sums[v as usize] += across);
        }
        let unit = |(v, sum): (usize, &DVec3)| {
            let stated = normals.get(v).and_then(|n| Vec3::from_array(*n).as_dvec3().try_normalize());
            stated.unwrap_or_else(|| sum.normalize_or_zero()).as_vec3()
        };
        let all = Self {
            normals: sums.iter().enumerate().map(unit).collect(),
            uvs: uvs.iter().copied().map(Vec2::from).collect(),
            positions,
            faces,
            has_normals: !normals.is_empty(),
        };
        if uvs.is_empty() { all.with_own_vertices(triangles, patches) } else { all }
    }

    /// The same with vertices of its own for each face, which have the texture coordinates that faces have by default.
    fn with_own_vertices(&self, triangles: &[[u32; 3]], patches: &[[u32; 4]]) -> Self {
        let mut own = Self { has_normals: self.has_normals, ..Self::default() };
        for triangle in triangles {
            let first = own.copy(self, triangle, &TRIANGLE);
            own.faces.push([0, 1, 2].map(|corner| first + corner));
        }
        for patch in patches {
            let first = own.copy(self, patch, &PATCH);
            own.faces.extend(HALVES.map(|half| half.map(|corner| first + corner as u32)));
        }
        own
    }

    /// Adds vertices of `other` with these texture coordinates; returns the number of the first.
    fn copy(&mut self, other: &Self, vertices: &[u32], uvs: &[Vec2]) -> u32 {
        let first = self.positions.len() as u32;
        self.positions.extend(vertices.iter().map(|&v| other.positions[v as usize]));
        self.normals.extend(vertices.iter().map(|&v| other.normals[v as usize]));
        self.uvs.extend(uvs);
        first
    }
}

/// Across the triangle, on the side from which it goes around counterclockwise, and twice as long as its area.
pub fn area_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
