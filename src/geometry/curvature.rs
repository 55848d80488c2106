//! How the shading normal changes over a primitive: the curvature that ray differentials ask for. Source: Igehy 1999, section 3.3, equations 20 and 21 (triangles with
//! normals of their own); spheres and cylinders have it from their radius.

use glam::{DMat3, DVec3, Vec3};

use super::shape::Shape;
use super::triangle::TriangleMesh;
use super::{ShapeKind, affine};

impl Shape {
    /// A unit normal of one primitive, of either sign, and its change where the point moves by each of `dp` within the surface; all in the shape's
    /// space. What is flat does not change, and of patches and fibres it is not told.
    pub(super) fn normal_change(&self, primitive: u32, uv: [f32; 2], dp: [Vec3; 2]) -> [Vec3; 3] {
        let round = |inverse: &DMat3, to_shape, radius: f32, n: DVec3, along: DVec3| {
            let dn = dp.map(|dp| {
                let moved = *inverse * dp.as_dvec3();
                ((moved - along * along.dot(moved)) / f64::from(radius)).as_vec3()
            });
            affine::normal_change(to_shape, n, dn)
        };
        match &self.kind {
            ShapeKind::Triangles(mesh) => mesh.normal_change(primitive, uv, dp),
            ShapeKind::Sphere(sphere) => {
                round(&sphere.inverse, &sphere.to_shape, sphere.radius, sphere.outward(uv), DVec3::ZERO)
            }
            ShapeKind::Cylinder(cylinder) => {
                round(&cylinder.inverse, &cylinder.to_shape, cylinder.radius, cylinder.outward(uv), DVec3::Z)
            }
            ShapeKind::Bilinear(_) | ShapeKind::Disk(_) | ShapeKind::Curves(_) => [Vec3::Z, Vec3::ZERO, Vec3::ZERO],
        }
    }
}

impl TriangleMesh {
    fn normal_change(&self, primitive: u32, uv: [f32; 2], dp: [Vec3; 2]) -> [Vec3; 3] {
        let flat = [Vec3::Z, Vec3::ZERO, Vec3::ZERO];
        if self.normals.is_empty() {
            return flat;
        }
        let corners = self.indices[primitive as usize].map(|i| self.normals[i as usize].as_dvec3());
        let [p0, p1, p2] = self.triangle(primitive).map(|p| p.as_dvec3());
        let (a, b) = (p1 - p0, p2 - p0);
        let [n0, n1, n2] = corners;
        let (na, nb) = (n1 - n0, n2 - n0);
        let n = n0 + na * f64::from(uv[0]) + nb * f64::from(uv[1]);
        // Barycentric weights change by the dual basis of the edges.
        let across = a.cross(b);
        let area = across.length_squared();
        let length = n.length();
        if area == 0.0 || length == 0.0 {
            return flat;
        }
        let (to_a, to_b) = (b.cross(across) / area, across.cross(a) / area);
        let unit = n / length;
        let [dx, dy] = dp.map(|dp| {
            let dp = dp.as_dvec3();
            let change = (na * to_a.dot(dp) + nb * to_b.dot(dp)) / length;
            (change - unit * unit.dot(change)).as_vec3()
        });
        [unit.as_vec3(), dx, dy]
    }
}
