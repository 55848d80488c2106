//! `loopsubdiv`: triangle meshes refined towards a smooth surface.
//!
//! Sources: Loop, "Smooth Subdivision Surfaces Based on Triangles" (1987); for vertex weights, limit positions and tangents pbrt (3rd ed.), section 3.8
//! and Hoppe et al., "Piecewise Smooth Surface Reconstruction" (1994). All in double precision.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// A refined mesh on the limit surface.
#[derive(Debug)]
pub(super) struct Subdivided {
    /// Points of the limit surface.
    pub positions: Vec<DVec3>,
    /// Its unit normals there, on the side from which faces go around counterclockwise.
    pub normals: Vec<DVec3>,
    /// Three of them each.
    pub faces: Vec<[u32; 3]>,
}

/// The surface of the control mesh after this many levels.
///
/// # Errors
/// In words: faces that use a point twice, and meshes whose neighbouring faces do not go around alike or of which three share an edge.
pub(super) fn subdivide(
    mut positions: Vec<DVec3>,
    mut faces: Vec<[u32; 3]>,
    levels: u32,
) -> Result<Subdivided, String> {
    for _ in 0..levels {
        let rings = Rings::new(positions.len(), &faces)?;
        (positions, faces) = refine(&positions, &faces, &rings);
    }
    let rings = Rings::new(positions.len(), &faces)?;
    let limits = (0..positions.len()).map(|v| limit_position(&positions, &rings, v)).collect();
    let normals = (0..positions.len()).map(|v| limit_normal(&positions, &rings, v)).collect();
    Ok(Subdivided { positions: limits, normals, faces })
}

/// The neighbours of each vertex, in the order in which the faces go around it.
struct Rings {
    /// Of vertex v from `starts[v]` to `starts[v + 1]`.
    neighbours: Vec<u32>,
    starts: Vec<u32>,
    is_boundary: Vec<bool>,
}

impl Rings {
    fn new(vertices: usize, faces: &[[u32; 3]]) -> Result<Self, String> {
        // Around a, the face (a, b, c) leads from b to c.
        let mut next: HashMap<[u32; 2], u32> = HashMap::with_capacity(faces.len() * 3);
        let mut first = vec![None; vertices];
        for (number, &[a, b, c]) in faces.iter().enumerate() {
            if a == b || b == c || c == a {
                return Err(format!("face {number} uses a point twice"));
            }
            for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                if next.insert([a, b], c).is_some() {
                    return Err(format!("face {number} goes from point {a} to point {b} as another face does"));
                }
                first[a as usize].get_or_insert(b);
            }
        }
        let mut rings = Self { neighbours: Vec::with_capacity(faces.len() * 3), starts: vec![0], is_boundary: vec![] };
        for a in 0..vertices as u32 {
            let mut is_boundary = false;
            if let Some(start) = first[a as usize] {
                // On a boundary, back to the neighbour before which there is none: that the face at (b, a) leads from a there.
                let mut from = start;
                while let Some(&before) = next.get(&[from, a]) {
                    from = before;
                    if from == start {
                        break;
                    }
                }
                is_boundary = !next.contains_key(&[from, a]);
                rings.neighbours.push(from);
                let mut at = from;
                while let Some(&after) = next.get(&[a, at]) {
                    if after == from {
                        break;
                    }
                    rings.neighbours.push(after);
                    at = after;
                }
            }
            rings.is_boundary.push(is_boundary);
            rings.starts.push(rings.neighbours.len() as u32);
        }
        Ok(rings)
    }

    fn of(&self, vertex: usize) -> &[u32] {
        &self.neighbours[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

/// One level: each face becomes four.
fn refine(positions: &[DVec3], faces: &[[u32; 3]], rings: &Rings) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let p = |v: u32| positions[v as usize];
    let mut refined: Vec<DVec3> = (0..positions.len())
        .map(|v| {
            if rings.is_boundary[v] {
                along_boundary(positions, rings, v, 1.0 / 8.0)
            } else {
                of_ring(positions, rings, v, beta(rings.of(v).len()))
            }
        })
        .collect();
    // The point on each edge, by its two ends, and of the faces beside it the third points.
    let mut edges: HashMap<[u32; 2], (u32, u32)> = HashMap::with_capacity(faces.len() * 2);
    let key = |a: u32, b: u32| [a.min(b), a.max(b)];
    for &[a, b, c] in faces {
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            match edges.entry(key(a, b)) {
                std::collections::hash_map::Entry::Vacant(edge) => {
                    edge.insert((refined.len() as u32, c));
                    refined.push((p(a) + p(b)) * 0.5);
                }
                std::collections::hash_map::Entry::Occupied(edge) => {
                    let &(point, other) = edge.get();
                    refined[point as usize] = (p(a) + p(b)) * 0.375 + (p(c) + p(other)) * 0.125;
                }
            }
        }
    }
    let middle = |a: u32, b: u32| edges[&key(a, b)].0;
    let divided = faces.iter().flat_map(|&[a, b, c]| {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    let divided = divided.collect();
    (refined, divided)
}

/// What each neighbour of an inner vertex of this valence counts.
fn beta(valence: usize) -> f64 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f64) }
}

fn of_ring(positions: &[DVec3], rings: &Rings, vertex: usize, weight: f64) -> DVec3 {
    let ring = rings.of(vertex);
    let sum: DVec3 = ring.iter().map(|&n| positions[n as usize]).sum();
    if ring.is_empty() {
        positions[vertex]
    } else {
        positions[vertex] * (1.0 - ring.len() as f64 * weight) + sum * weight
    }
}

fn along_boundary(positions: &[DVec3], rings: &Rings, vertex: usize, weight: f64) -> DVec3 {
    let ring = rings.of(vertex);
    let sum = positions[ring[0] as usize] + positions[ring[ring.len() - 1] as usize];
    positions[vertex] * (1.0 - 2.0 * weight) + sum * weight
}

fn limit_position(positions: &[DVec3], rings: &Rings, vertex: usize) -> DVec3 {
    if rings.is_boundary[vertex] {
        return along_boundary(positions, rings, vertex, 1.0 / 5.0);
    }
    let valence = rings.of(vertex).len();
    of_ring(positions, rings, vertex, 1.0 / (valence as f64 + 3.0 / (8.0 * beta(valence))))
}

fn limit_normal(positions: &[DVec3], rings: &Rings, vertex: usize) -> DVec3 {
    let ring: Vec<DVec3> = rings.of(vertex).iter().map(|&n| positions[n as usize]).collect();
    let (n, v) = (ring.len(), positions[vertex]);
    if n < 2 {
        return DVec3::ZERO;
    }
    // Tangents s and t such that s × t is on the side from which the ring goes counterclockwise.
    let (s, t) = if rings.is_boundary[vertex] {
        // From the first neighbour to the last it is half a turn: s goes back along the boundary, t into the surface.
        let inward = match n {
            2 => ring[0] + ring[1] - 2.0 * v,
            3 => ring[1] - v,
            4 => -ring[0] + 2.0 * ring[1] + 2.0 * ring[2] - ring[3] - 2.0 * v,
            _ => {
                let theta = PI / (n - 1) as f64;
                let ends = (ring[0] + ring[n - 1]) * theta.sin();
                let inner: DVec3 =
                    (1..n - 1).map(|k| ring[k] * ((2.0 * theta.cos() - 2.0) * (k as f64 * theta).sin())).sum();
                -(ends + inner)
            }
        };
        (ring[0] - ring[n - 1], inward)
    } else {
        let turn = |k: usize| TAU * k as f64 / n as f64;
        let s = ring.iter().enumerate().map(|(k, p)| *p * turn(k).cos()).sum();
        let t = ring.iter().enumerate().map(|(k, p)| *p * turn(k).sin()).sum();
        (s, t)
    };
    s.cross(t).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let points = vec![DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let upper = (0..4).map(|i| [i, (i + 1) % 4, 4]);
        let lower = (0..4).map(|i| [(i + 1) % 4, i, 5]);
        (points, upper.chain(lower).collect())
    }

    #[test]
    fn a_closed_mesh_becomes_a_smooth_one_that_looks_outward() {
        let (points, faces) = octahedron();
        let ball = subdivide(points, faces, 3).expect("a surface");
        assert_eq!((ball.faces.len(), ball.positions.len()), (8 * 64, 8 * 64 / 2 + 2));
        for (p, n) in ball.positions.iter().zip(&ball.normals) {
            assert!(n.dot(p.normalize()) > 0.95 && (n.length() - 1.0).abs() < 1e-12, "{p} {n}");
        }
        // Known in closed form: the limit of a vertex of valence 4 with its ring's mean in the origin, γ = 1 / (4 + 3 / (8 · 3/32)) = 1/8.
        let (points, faces) = octahedron();
        let top = subdivide(points, faces, 0).expect("a surface").positions[4];
        assert!((top - DVec3::Z * 0.5).length() < 1e-12, "{top}");
        // Limit positions are limits: refining first changes nothing.
        assert!((ball.positions[4] - top).length() < 1e-12, "{}", ball.positions[4]);
    }

    #[test]
    fn flat_meshes_stay_flat_and_keep_their_boundary() {
        // A regular grid with slanted diagonals.
        let side = 5u32;
        let points: Vec<DVec3> =
            (0..side * side).map(|i| DVec3::new(f64::from(i % side), f64::from(i / side), 0.0)).collect();
        let faces = (0..(side - 1) * (side - 1)).flat_map(|i| {
            let a = i / (side - 1) * side + i % (side - 1);
            [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]
        });
        let flat = subdivide(points, faces.collect(), 2).expect("a surface");
        for (p, n) in flat.positions.iter().zip(&flat.normals) {
            assert!(p.z == 0.0 && (*n - DVec3::Z).length() < 1e-9, "{p} {n}");
            assert!(p.x >= 0.0 && p.x <= 4.0);
        }
        // Inside, linear functions are reproduced: a regular vertex stays where it is. Along a straight boundary too.
        for expected in [DVec3::new(2.0, 2.0, 0.0), DVec3::new(2.0, 0.0, 0.0)] {
            assert!(flat.positions.iter().any(|p| (*p - expected).length() < 1e-9), "{expected}");
        }
    }

    #[test]
    fn what_has_no_surface_is_refused() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        for faces in [vec![[0, 1, 1]], vec![[0, 1, 2], [0, 1, 3]], vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]] {
            assert!(subdivide(points.clone(), faces, 1).is_err());
        }
        let empty = subdivide(points, vec![], 2).expect("nothing");
        assert!(empty.faces.is_empty());
    }
}
