//! Ray differentials: how a ray would begin and where it would go, were its pixel or its random numbers a little different.
//!
//! Sources: Igehy, "Tracing Ray Differentials", SIGGRAPH 1999 (transfer: equations 10 to 12; reflection: 14 and 15; refraction: 16 to 19); Christensen et al.
//! 2006, "Ray Tracing for the Movie 'Cars'", section 3 (rays that rough surfaces scatter stand for a share of all directions each). Of all samples of a pixel each has a
//! share of it, as in pbrt-v4 (section 10.1.3): an eighth of its width at least.

use glam::{Vec2, Vec3};

use super::camera::Camera;
use super::{Geometry, Ray, RayHit};

/// A ray is treated as if it met surfaces no more grazingly than at this cosine: beyond, its cross-section there is endless.
const LEAST_COSINE: f32 = 1e-3;

/// The widest that a ray may spread, in radians.
const WIDEST: f32 = 1.0;

/// What to know of how wide rays are: the share of a pixel, along x and y, that one of its samples stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleShare(pub f32);

/// Two neighbours of a ray, by what tells them from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferentials {
    /// The change of its origin, or of the point where it arrived.
    pub dp: [Vec3; 2],
    /// The change of its (unit) direction.
    pub dd: [Vec3; 2],
    /// What the rays that it becomes go by.
    pub share: SampleShare,
}

impl SampleShare {
    /// That of one among so many samples of a pixel.
    pub fn of(samples: u32) -> Self {
        Self((samples.max(1) as f32).sqrt().recip().max(0.125))
    }
}

impl RayDifferentials {
    /// Those of a camera's ray through `film`, by the rays through places on the film beside it.
    pub fn of_camera(camera: &Camera, ray: &Ray, film: Vec2, lens: [f32; 2], u_time: f32, share: SampleShare) -> Self {
        // Finite differences over a whole pixel, scaled down: over a small part of one, little but rounding would be left.
        let [x, y] = [Vec2::X, Vec2::Y].map(|step| camera.ray(film + step, lens, u_time));
        Self {
            dp: [x.origin - ray.origin, y.origin - ray.origin].map(|d| d * share.0),
            dd: [x.direction - ray.direction, y.direction - ray.direction].map(|d| d * share.0),
            share,
        }
    }

    /// Follows them for `t` along `direction` (unit) through empty space or a medium.
    #[inline]
    pub fn pass(&mut self, t: f32) {
        for (dp, dd) in self.dp.iter_mut().zip(&self.dd) {
            *dp += *dd * t;
        }
    }

    /// Follows them for `t` along `direction` (unit) onto a surface of unit normal `n` (Igehy, equations 10 and 12).
    #[inline]
    pub fn transfer(&mut self, direction: Vec3, t: f32, n: Vec3) {
        self.pass(t);
        let cosine = direction.dot(n);
        let cosine = if cosine.abs() < LEAST_COSINE { LEAST_COSINE.copysign(cosine) } else { cosine };
        for dp in &mut self.dp {
            *dp -= direction * (dp.dot(n) / cosine);
        }
    }

    /// Reflects `direction` by a mirror of unit normal `n`, which changes by `dn` (Igehy, equations 14 and 15).
    pub fn reflect(&mut self, direction: Vec3, n: Vec3, dn: [Vec3; 2]) {
        let cosine = direction.dot(n);
        for (dd, dn) in self.dd.iter_mut().zip(dn) {
            let change = dd.dot(n) + direction.dot(dn);
            *dd -= (dn * cosine + n * change) * 2.0;
        }
        self.limit();
    }

    /// Refracts `direction` into `refracted` at a surface of unit normal `n`, which changes by `dn`; `eta` is the index of refraction
    /// on the far side over that on the near one (Igehy, equations 16 to 19, whose η is its inverse).
    pub fn refract(&mut self, direction: Vec3, refracted: Vec3, n: Vec3, dn: [Vec3; 2], eta: f32) {
        let eta = eta.recip();
        // Igehy's normal is on the near side.
        let side = if direction.dot(n) > 0.0 { -1.0 } else { 1.0 };
        let n = n * side;
        let (before, after) = (direction.dot(n), refracted.dot(n));
        let mu = eta * before - after;
        let after = if after.abs() < LEAST_COSINE { -LEAST_COSINE } else { after };
        let rate = eta - eta * eta * before / after;
        for (dd, dn) in self.dd.iter_mut().zip(dn) {
            let dn = dn * side;
            let change = rate * (dd.dot(n) + direction.dot(dn));
            *dd = *dd * eta - dn * mu - n * change;
        }
        self.limit();
    }

    /// Scatters them into `direction` (unit), of density `pdf` by solid angle: one of n rays stands for a solid angle of 1 / (n pdf), which comes on top of
    /// how far they were spread already.
    pub fn scatter(&mut self, direction: Vec3, pdf: f32) {
        let spread = self.share.0 * self.share.0 / pdf;
        let before = 0.5 * (self.dd[0].length_squared() + self.dd[1].length_squared());
        let width = (spread + before).sqrt().min(WIDEST);
        let (x, y) = direction.any_orthonormal_pair();
        self.dd = [x, y].map(|axis| axis * if width.is_finite() { width } else { WIDEST });
    }

    /// Keeps what curved mirrors and lenses spread within bounds.
    fn limit(&mut self) {
        for dd in &mut self.dd {
            *dd = if dd.is_finite() { dd.clamp_length_max(WIDEST) } else { Vec3::ZERO };
        }
    }
}

impl Geometry {
    /// By how much the unit shading normal at a hit, taken as pointing along `ns`, changes where the point moves by each of `dp` within the surface. 0 for
    /// fibres, and for patches with normals of their own.
    pub fn normal_change(&self, ray: &Ray, hit: &RayHit, ns: Vec3, dp: [Vec3; 2]) -> [Vec3; 2] {
        let shape = &self.shapes[hit.shape.0 as usize];
        let [n, dx, dy] = match hit.instance {
            None => shape.normal_change(hit.primitive, hit.uv, dp),
            Some(instance) => {
                let to_render = self.instances[instance.0 as usize].transform.at(ray.time);
                let inverse = super::affine::linear(&to_render).inverse();
                let dp = dp.map(|dp| (inverse * dp.as_dvec3()).as_vec3());
                let [n, dx, dy] = shape.normal_change(hit.primitive, hit.uv, dp);
                super::affine::normal_change(&to_render, n.as_dvec3(), [dx, dy])
            }
        };
        let side = if n.dot(ns) < 0.0 { -1.0 } else { 1.0 };
        [dx, dy].map(|d| if d.is_finite() { d * side } else { Vec3::ZERO })
    }
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Quat};

    use super::*;
    use crate::geometry::cylinder::Cylinder;
    use crate::geometry::triangle::TriangleMesh;
    use crate::geometry::{InstanceId, MotionTransform, ShapeId, ShapeKind, fixtures};

    const SHARE: SampleShare = SampleShare(1.0);

    /// What neighbours of a ray become, by following them as rays of their own.
    fn neighbours(
        follow: impl Fn(Vec3, Vec3) -> (Vec3, Vec3),
        p: Vec3,
        d: Vec3,
        start: &RayDifferentials,
    ) -> [Vec3; 4] {
        const STEP: f32 = 2e-3;
        let (p0, d0) = follow(p, d);
        let [a, b] = [0, 1].map(|i| {
            let (q, e) = follow(p + start.dp[i] * STEP, (d + start.dd[i] * STEP).normalize());
            ((q - p0) / STEP, (e - d0) / STEP)
        });
        [a.0, b.0, a.1, b.1]
    }

    fn on_sphere(p: Vec3, d: Vec3, radius: f32) -> Vec3 {
        let middle = -p.dot(d);
        let half = (radius * radius - (p + d * middle).length_squared()).sqrt();
        p + d * (middle - half)
    }

    #[test]
    fn mirrors_and_lenses_do_to_neighbours_what_they_do_to_rays() {
        let (p, d) = (Vec3::new(0.3, 4.0, 0.2), Vec3::new(0.05, -1.0, 0.02).normalize());
        let across = |v: Vec3| v - d * v.dot(d);
        let start = RayDifferentials {
            dp: [Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.1)],
            dd: [across(Vec3::new(0.02, 0.0, 0.01)), across(Vec3::new(0.0, 0.01, -0.03))],
            share: SHARE,
        };
        const ETA: f32 = 1.5;
        for refracts in [false, true] {
            let follow = |p: Vec3, d: Vec3| {
                let q = on_sphere(p, d, 2.0);
                let n = q / 2.0;
                let cosine = -d.dot(n);
                let bent = if refracts {
                    let sine2 = (1.0 - cosine * cosine) / (ETA * ETA);
                    d / ETA + n * (cosine / ETA - (1.0 - sine2).sqrt())
                } else {
                    d + n * (2.0 * cosine)
                };
                (q, bent)
            };
            let (q, bent) = follow(p, d);
            let n = q / 2.0;
            let mut found = start;
            found.transfer(d, (q - p).length(), n);
            // On a sphere the normal turns by what the point moves, over the radius.
            let dn = found.dp.map(|dp| dp / 2.0);
            if refracts {
                found.refract(d, bent, n, dn, ETA);
            } else {
                found.reflect(d, n, dn);
            }
            let expected = neighbours(follow, p, d, &start);
            for (found, expected) in found.dp.iter().chain(&found.dd).zip(expected) {
                assert!((*found - expected).length() < 1e-2 * (0.1 + expected.length()), "{found} {expected}");
            }
        }
    }

    #[test]
    fn scattered_rays_share_the_directions() {
        let mut rays = RayDifferentials { dp: [Vec3::ZERO; 2], dd: [Vec3::ZERO; 2], share: SampleShare::of(16) };
        // Of 16 rays over a hemisphere each stands for 1/16 of it.
        let pdf = std::f32::consts::TAU.recip();
        rays.scatter(Vec3::Z, pdf);
        let solid_angle = rays.dd[0].cross(rays.dd[1]).length();
        assert!((solid_angle * 16.0 * pdf - 1.0).abs() < 1e-5);
        assert!(rays.dd.iter().all(|dd| dd.dot(Vec3::Z).abs() < 1e-6));
        rays.scatter(Vec3::X, 1e-9);
        assert!((rays.dd[0].length() - WIDEST).abs() < 1e-6);
        assert_eq!(SampleShare::of(1), SampleShare(1.0));
        assert_eq!(SampleShare::of(1 << 20), SampleShare(0.125));
    }

    #[test]
    fn normals_change_as_finite_differences_say() {
        let turned = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 2.0, 0.7),
            Quat::from_rotation_x(0.7),
            Vec3::new(3.0, 0.0, 1.0),
        );
        let inverse = crate::geometry::affine::linear(&turned).inverse();
        let cylinder = || Cylinder { radius: 1.5, z_min: -1.0, z_max: 2.0, phi_max: 6.0, to_shape: turned, inverse };
        let triangle = |normals| TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::new(2.0, 0.3, 0.0), Vec3::new(0.1, 1.0, -0.4)],
            indices: vec![[0, 1, 2]],
            normals,
            uvs: vec![],
        };
        let round = || vec![Vec3::new(-0.4, 0.1, 1.0), Vec3::new(0.5, -0.3, 2.0), Vec3::new(0.1, 0.6, 0.8)];
        let kinds: [&dyn Fn() -> ShapeKind; 4] = [
            &|| ShapeKind::Sphere(fixtures::sphere(1.5, turned)),
            &|| ShapeKind::Cylinder(cylinder()),
            &|| ShapeKind::Triangles(triangle(round())),
            &|| ShapeKind::Triangles(triangle(vec![])),
        ];
        for kind in kinds {
            check(&fixtures::geometry_of(vec![fixtures::shape(kind())]), None);
            let instanced = fixtures::instanced(fixtures::shape(kind()), MotionTransform::Fixed(turned));
            check(&instanced, Some(InstanceId(0)));
        }
    }

    fn check(geometry: &Geometry, instance: Option<InstanceId>) {
        const STEP: f32 = 1e-3;
        let ray = fixtures::ray(Vec3::ZERO, Vec3::Z);
        let at = |uv: [f32; 2]| {
            let hit = RayHit { shape: ShapeId(0), primitive: 0, instance, t: 1.0, uv };
            (hit, geometry.surface_point(&ray, &hit))
        };
        let uv = [0.31, 0.27];
        let (hit, point) = at(uv);
        let [a, b] = [[uv[0] + STEP, uv[1]], [uv[0], uv[1] + STEP]].map(|uv| at(uv).1);
        let dp = [a.p - point.p, b.p - point.p];
        let found = geometry.normal_change(&ray, &hit, point.ns, dp);
        for (found, there) in found.iter().zip([a, b]) {
            let expected = there.ns - point.ns;
            assert!((*found - expected).length() < 1e-5 + 0.02 * expected.length(), "{found} {expected}");
        }
    }
}
