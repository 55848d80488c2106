//! Cuts flat faces that are not convex into triangles: ear by ear, as every simple polygon has two (G. H. Meisters, "Polygons have ears", 1975).

use glam::{DVec2, DVec3};

/// The most corners of faces that this is for: the time grows faster than their number.
pub(super) const MOST_CORNERS: usize = 64;

/// How far corners of a flat face may lie off its plane, relative to the face's size.
const TOLERANCE: f64 = 1e-3;

/// The sine of the angle by which a corner of a concave face turns the other way.
const LEAST_TURN: f64 = 1e-4;

/// How many triangles and corners of a file may be compared, about: half a second.
pub(super) const MOST_WORK: usize = 100_000_000;

/// The triangles of a flat, concave face, as places in `corners`; `None` for all other faces, where it crosses itself, and where the `work` that is left is not
/// enough.
pub(super) fn ears(corners: &[[f32; 3]], work: &mut usize) -> Option<Vec<[usize; 3]>> {
    let flat = flattened(corners)?;
    let size = flat.iter().fold(0.0f64, |size, p| size.max(p.length()));
    let small = TOLERANCE * size * size;
    let turn = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[b]);
    let n = flat.len();
    let is_convex = |i: usize| {
        let (a, c) = ((i + n - 1) % n, (i + 1) % n);
        turn(a, i, c) >= -LEAST_TURN * flat[i].distance(flat[a]) * flat[i].distance(flat[c])
    };
    if (0..n).all(is_convex) {
        return None;
    }
    // An eighth of all triples at worst, as spirals have it.
    *work = work.checked_sub(n * n * n / 8)?;
    let is_empty = |[a, b, c]: [usize; 3], rest: &[usize]| {
        let corners = [flat[a], flat[b], flat[c]];
        let is_within = |p: DVec2| (0..3).all(|i| (corners[(i + 1) % 3] - corners[i]).perp_dot(p - corners[i]) >= 0.0);
        // Corners at one place are where a face is joined around a hole.
        !rest.iter().map(|&i| flat[i]).any(|p| !corners.contains(&p) && is_within(p))
    };
    let (mut rest, mut triangles): (Vec<usize>, Vec<_>) = ((0..n).collect(), vec![]);
    while rest.len() > 3 {
        let count = rest.len();
        let around = |i: usize| [rest[(i + count - 1) % count], rest[i], rest[(i + 1) % count]];
        let is_ear = |i: &usize| {
            let [a, b, c] = around(*i);
            turn(a, b, c) > 0.0 && is_empty([a, b, c], &rest)
        };
        // Where all that is left lies on a line nothing is seen of its triangles.
        let is_straight = |i: &usize| {
            let [a, b, c] = around(*i);
            turn(a, b, c).abs() <= small * TOLERANCE
        };
        let ear = (0..count).find(is_ear).or_else(|| (0..count).find(is_straight))?;
        triangles.push(around(ear));
        rest.remove(ear);
    }
    triangles.push([rest[0], rest[1], rest[2]]);
    Some(triangles)
}

/// The corners in the plane of the face, around their mean and counter-clockwise, if they lie in one.
fn flattened(corners: &[[f32; 3]]) -> Option<Vec<DVec2>> {
    let points: Vec<DVec3> = corners.iter().map(|&p| DVec3::from(p.map(f64::from))).collect();
    let mean = points.iter().sum::<DVec3>() / points.len() as f64;
    // Newell's: twice the area.
    let next = points.iter().cycle().skip(1);
    let area: DVec3 = points.iter().zip(next).map(|(&a, &b)| (a - mean).cross(b - mean)).sum();
    let normal = area.try_normalize()?;
    let size = points.iter().fold(0.0f64, |size, p| size.max(p.distance(mean)));
    if points.iter().any(|&p| (p - mean).dot(normal).abs() > TOLERANCE * size) {
        return None;
    }
    let (x, y) = normal.any_orthonormal_pair();
    Some(points.iter().map(|&p| DVec2::new((p - mean).dot(x), (p - mean).dot(y))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[[f32; 3]], triangle: [usize; 3]) -> f64 {
        let [a, b, c] = triangle.map(|i| DVec3::from(corners[i].map(f64::from)));
        // Seen from +z.
        0.5 * (b - a).cross(c - a).z
    }

    #[test]
    fn flat_faces_that_are_not_convex_are_cut_without_overlap() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        // Around a square hole, whose corners 0 and 4 are stated twice.
        let ring = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        for (shape, whole) in [(&l[..], 3.0), (&ring, 8.0)] {
            for start in 0..shape.len() {
                for is_turned in [false, true] {
                    let mut corners: Vec<[f32; 3]> = shape.iter().map(|p| [p[0], p[1], 0.5]).collect();
                    corners.rotate_left(start);
                    if is_turned {
                        corners.reverse();
                    }
                    let triangles = ears(&corners, &mut MOST_WORK.clone()).expect("it is concave");
                    let areas: Vec<f64> = triangles
                        .iter()
                        .map(|t| if is_turned { -area(&corners, *t) } else { area(&corners, *t) })
                        .collect();
                    assert!(triangles.len() == corners.len() - 2 && areas.iter().all(|a| *a >= -1e-9), "{triangles:?}");
                    assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9, "from {start}: {triangles:?}");
                }
            }
        }
    }

    #[test]
    fn small_notches_stay_open_while_there_is_work_left() {
        let notched =
            [[0.0, 0.0], [0.4, 0.0], [0.4, 0.02], [0.42, 0.02], [0.42, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let corners = notched.map(|[x, y]| [x, y, 0.0]);
        let triangles = ears(&corners, &mut MOST_WORK.clone()).expect("it is concave");
        let whole: f64 = triangles.iter().map(|t| area(&corners, *t)).sum();
        assert!((whole - (1.0 - 0.02 * 0.02)).abs() < 1e-6, "{whole}");
        assert!(ears(&corners, &mut 63).is_none());
    }

    #[test]
    fn other_faces_are_left_to_a_fan() {
        let pentagon: Vec<[f32; 3]> =
            (0..5).map(|i| [(1.2566 * i as f32).cos(), (1.2566 * i as f32).sin(), 1.0]).collect();
        let mut bent = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]];
        let ears = |corners: &[[f32; 3]]| ears(corners, &mut MOST_WORK.clone());
        assert!(ears(&pentagon).is_none() && ears(&bent).is_none());
        bent.iter_mut().for_each(|p| *p = [1.0; 3]);
        assert!(ears(&bent).is_none());
    }
}
