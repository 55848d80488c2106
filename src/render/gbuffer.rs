//! What a `gbuffer` film is told of the surface that a camera ray meets first, in the coordinates that it asks for.

use glam::{Vec2, Vec3};

use super::Job;
use super::pass::CameraSample;
use crate::film::gbuffer::{Coordinates, SurfaceSample};
use crate::geometry::Ray;

impl Job {
    /// `surface`, which is in render space and met by `ray`, the ray of `sample`.
    pub(super) fn in_coordinates(
        &self,
        coordinates: Coordinates,
        surface: &SurfaceSample,
        ray: &Ray,
        sample: &CameraSample,
    ) -> SurfaceSample {
        let to_camera = self.camera.to_render(ray.time).inverse();
        // Where rays through the next pixels would meet the plane of the surface.
        let depth = |p: Vec3| to_camera.transform_point3(p).z;
        let next = |pixel: Vec2| {
            let next = self.camera.ray(sample.film + pixel, sample.lens, sample.u_time);
            let t = (surface.p - next.origin).dot(surface.ng) / next.direction.dot(surface.ng);
            depth(next.origin + t * next.direction) - depth(surface.p)
        };
        let slope = Vec2::new(next(Vec2::X), next(Vec2::Y));
        match coordinates {
            Coordinates::Camera => {
                // Normals go by the inverse transpose of what points go by.
                let normal_to_camera = to_camera.inverse().matrix3.transpose();
                let normal = |n: Vec3| (normal_to_camera * n).normalize_or_zero();
                SurfaceSample {
                    p: to_camera.transform_point3(surface.p),
                    ng: normal(surface.ng),
                    ns: normal(surface.ns),
                    slope,
                    ..*surface
                }
            }
            Coordinates::World => {
                SurfaceSample { p: (surface.p.as_dvec3() + self.origin).as_vec3(), slope, ..*surface }
            }
        }
    }
}
