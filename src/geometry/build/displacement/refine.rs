//! Triangles divided until no edge is longer than asked for: the longest edge of each is halved, again and again.
//!
//! Source: Rivara 1984, "Algorithms for refining triangular grids suitable for adaptive and multigrid techniques" (angles stay at least half of what they
//! were). Whether an edge is halved depends on its length alone, and the point on it on its ends alone, so the triangles on both sides divide it
//! alike and nothing cracks, in whatever order they are taken. All in double precision, where the points of edges halved up to 29 times are exact.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use super::control::{Control, area_normal};

/// How finely to divide.
pub struct Refinement {
    /// Lengths are measured after each of these.
    to_world: [DMat3; 2],
    longest: f64,
}

impl Refinement {
    /// Edges are to be at most `longest`, above 0, under both transforms.
    pub fn new(to_world: [DMat3; 2], longest: f64) -> Self {
        Self { to_world, longest }
    }

    /// How many triangles `mesh` comes to, unless more than `most` (at most 2^26). Allocates nothing that grows with that number.
    pub fn count(&self, mesh: &Control, most: u64) -> Option<u64> {
        // A triangle of edges of at most l has an area of at most √3/4 l².
        let largest = 0.25 * 3f64.sqrt() * self.longest * self.longest;
        let area = |corners: [DVec3; 3]| 0.5 * area_normal(corners.map(|p| self.to_world[0] * p)).length();
        let fewest: f64 = mesh.faces.iter().map(|face| (area(mesh.corners(face)) / largest).max(1.0)).sum();
        if !(fewest <= most as f64 * (1.0 + 1e-9)) {
            return None;
        }
        let (mut count, mut open) = (0, vec![]);
        for face in &mesh.faces {
            open.push(mesh.corners(face));
            while let Some([a, b, c]) = open.pop() {
                // An edge takes as many triangles as it has parts: so what goes on beyond is not deeper than 2^26 halvings reach.
                let Some(([a, b, c], length)) = self.too_long([a, b, c]) else {
                    count += 1;
                    if count > most {
                        return None;
                    }
                    continue;
                };
                if !(length <= self.longest * most as f64) {
                    return None;
                }
                let middle = a.midpoint(b);
                open.extend([[a, middle, c], [middle, b, c]]);
            }
        }
        Some(count)
    }

    /// Divides.
    pub fn refine(&self, mut mesh: Control) -> Control {
        let control = std::mem::take(&mut mesh.faces);
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut open = vec![];
        for face in control {
            open.push(face);
            while let Some(face) = open.pop() {
                let Some(first) = self.longest_edge(mesh.corners(&face)) else {
                    mesh.faces.push(face);
                    continue;
                };
                let [a, b, c] = [0, 1, 2].map(|i| face[(first + i) % 3]);
                let middle = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| mesh.halve(a, b));
                open.extend([[a, middle, c], [middle, b, c]]);
            }
        }
        mesh
    }

    /// The triangle turned such that its longest edge, if that is too long, leads from its first corner to the second; and its length.
    fn too_long(&self, corners: [DVec3; 3]) -> Option<([DVec3; 3], f64)> {
        let first = self.longest_edge(corners)?;
        let turned = [0, 1, 2].map(|i| corners[(first + i) % 3]);
        Some((turned, self.squared(turned[0], turned[1]).sqrt()))
    }

    /// The corner that the longest edge starts at, if that is too long.
    fn longest_edge(&self, [a, b, c]: [DVec3; 3]) -> Option<usize> {
        let squares = [self.squared(a, b), self.squared(b, c), self.squared(c, a)];
        let longest = if squares[0] >= squares[1] && squares[0] >= squares[2] {
            0
        } else if squares[1] >= squares[2] {
            1
        } else {
            2
        };
        (squares[longest] > self.longest * self.longest).then_some(longest)
    }

    /// The square of an edge's length in the world, the same from either end.
    fn squared(&self, a: DVec3, b: DVec3) -> f64 {
        let [start, end] = self.to_world.map(|m| (m * (b - a)).length_squared());
        start.max(end)
    }
}

impl Control {
    fn corners(&self, face: &[u32; 3]) -> [DVec3; 3] {
        face.map(|v| self.positions[v as usize])
    }

    /// A new vertex halfway between two.
    fn halve(&mut self, a: u32, b: u32) -> u32 {
        // In one order whichever way the edge is taken.
        let [a, b] = [a.min(b), a.max(b)].map(|v| v as usize);
        self.positions.push(self.positions[a].midpoint(self.positions[b]));
        let n = self.normals[a] + self.normals[b];
        self.normals.push(n.try_normalize().unwrap_or(self.normals[a]));
        self.uvs.push(self.uvs[a].midpoint(self.uvs[b]));
        self.positions.len() as u32 - 1
    }
}
