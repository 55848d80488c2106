//! Triangle meshes of simple things: boxes, bodies of revolution, hulls.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

/// A triangle mesh; normals and texture coordinates may be absent.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// None or one per vertex.
    pub normals: Vec<Vec3>,
    /// None or one pair per vertex.
    pub uv: Vec<[f32; 2]>,
    /// Three per triangle, anticlockwise from outside.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// An axis-aligned box, its sides facing outwards. Each side shows the texture's rectangle `uv` (u0, v0, u1, v1), the
    /// longer side along u.
    pub fn cuboid(low: Vec3, high: Vec3, uv: Option<[f32; 4]>) -> Self {
        let mut mesh = Self::default();
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            for (side, level) in [low, high].iter().enumerate() {
                let corner = |s: f32, t: f32| {
                    let mut p = *level;
                    p[a] = low[a] + (high[a] - low[a]) * s;
                    p[b] = low[b] + (high[b] - low[b]) * t;
                    p
                };
                let first = mesh.positions.len() as u32;
                let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
                mesh.positions.extend(corners.map(|(s, t)| corner(s, t)));
                if let Some([u0, v0, u1, v1]) = uv {
                    let along_a = high[a] - low[a] > high[b] - low[b];
                    mesh.uv.extend(corners.map(|(s, t)| {
                        let (s, t) = if along_a { (s, t) } else { (t, s) };
                        [u0 + (u1 - u0) * s, v0 + (v1 - v0) * t]
                    }));
                }
                let order = if side == 1 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                mesh.indices.extend(order.map(|i| first + i));
            }
        }
        mesh
    }

    /// The surface that a profile of (radius, height) sweeps around the y axis, in `sides` flat sides. Without normals, so
    /// that edges stay sharp where sides are few.
    pub fn revolved(profile: &[Vec2], sides: u32) -> Self {
        let mut mesh = Self::default();
        for &Vec2 { x: radius, y } in profile {
            mesh.positions.extend((0..sides).map(|i| {
                let angle = TAU * i as f32 / sides as f32;
                Vec3::new(radius * angle.cos(), y, radius * angle.sin())
            }));
        }
        mesh.join_rings(profile.len() as u32, sides, true);
        mesh
    }

    /// A round pole from y = `low` to `high`, with a lid.
    pub fn pole(radius: f32, low: f32, high: f32) -> Self {
        Self::revolved(&[Vec2::new(radius, low), Vec2::new(radius * 0.9, high), Vec2::new(0.01 * radius, high)], 10)
    }

    /// A boat's hull along z: `length` long, `beam` wide, `depth` deep below its rim (at y = 0 amidships), its ends drawn
    /// together and raised.
    pub fn hull(length: f32, beam: f32, depth: f32) -> Self {
        const SECTIONS: u32 = 14;
        const RIBS: u32 = 9;
        let mut mesh = Self::default();
        for section in 0..SECTIONS {
            let s = 2.0 * section as f32 / (SECTIONS - 1) as f32 - 1.0;
            // Blunt at the stern, sharp at the bow.
            let fullness =
                (1.0 - s.abs().powf(if s < 0.0 { 4.0 } else { 2.2 }) * if s < 0.0 { 0.55 } else { 0.98 }).max(0.02);
            let rise = 0.35 * depth * s * s;
            mesh.positions.extend((0..RIBS).map(|rib| {
                let around = std::f32::consts::PI * rib as f32 / (RIBS - 1) as f32;
                let x = 0.5 * beam * fullness * around.cos();
                let y = rise - depth * fullness.sqrt() * around.sin().max(0.0).powf(0.7);
                Vec3::new(x, y, 0.5 * length * s)
            }));
        }
        mesh.join_rings(SECTIONS, RIBS, false);
        mesh
    }

    /// Two triangles between each pair of neighbours of successive rings.
    pub fn join_rings(&mut self, rings: u32, sides: u32, closed: bool) {
        for ring in 0..rings - 1 {
            for side in 0..if closed { sides } else { sides - 1 } {
                let next = (side + 1) % sides;
                let [a, b] = [ring * sides + side, ring * sides + next];
                let [c, d] = [a + sides, b + sides];
                self.indices.extend([a, c, b, b, c, d]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The volume inside a closed mesh, positive if its triangles face outwards.
    fn volume(mesh: &Mesh) -> f32 {
        let corner = |i: &u32| mesh.positions[*i as usize];
        mesh.indices.chunks_exact(3).map(|t| corner(&t[0]).dot(corner(&t[1]).cross(corner(&t[2]))) / 6.0).sum()
    }

    #[test]
    fn closed_meshes_face_outwards() {
        let cuboid = Mesh::cuboid(Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0), None);
        assert!((volume(&cuboid) - 6.0).abs() < 1e-4);
        let profile = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 2.0), Vec2::new(0.0, 2.0)];
        let drum = volume(&Mesh::revolved(&profile, 64));
        assert!((drum / TAU - 1.0).abs() < 0.01, "a cylinder of radius 1 and height 2 holds 2π, found {drum}");
    }
}
