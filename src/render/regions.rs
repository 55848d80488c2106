//! Which regions the camera stands in, found by looking: pbrt lets the file declare the medium around the camera, but a camera
//! that happens to be inside a volume's box should see that volume whether or not the file says so.

use glam::Vec3;

use crate::geometry::{InstanceId, Ray, ShapeId};
use crate::integrator::World;
use crate::medium::MediumId;
use crate::medium::regions::{MAX_OVERLAP, Regions};
use crate::scene::Warnings;

/// Directions with no component in common with axis-aligned boxes or with each other.
const PROBES: [Vec3; 3] = [
    Vec3::new(0.267_261_24, 0.534_522_5, 0.801_783_7),
    Vec3::new(-0.801_783_7, 0.267_261_24, -0.534_522_5),
    Vec3::new(0.534_522_5, -0.801_783_7, 0.267_261_24),
];

/// Surfaces that separate media and are passed on a probe, at most.
const MAX_SURFACES: usize = 64;

/// The regions at `p`. A probe that meets the inside of a region's boundary first starts within it; the probes
/// decide, two more of them for than against. `declared` is the medium that the file says surrounds the camera: where no region found holds
/// it, it surrounds the whole scene.
pub fn camera_regions(world: &World, p: Vec3, declared: Option<MediumId>, warnings: &mut Warnings) -> Regions {
    let mut votes: Vec<((ShapeId, Option<InstanceId>), i32)> = vec![];
    let mut crossings = vec![];
    for direction in PROBES {
        let ray = Ray { origin: p, direction, t_max: f32::INFINITY, time: 0.0, opacity_seed: 0 };
        world.tracer.boundaries(&ray, &mut crossings);
        let mut seen: Vec<(f32, (ShapeId, Option<InstanceId>), bool)> =
            crossings.iter().map(|c| (c.t, (c.shape, c.instance), c.entering)).collect();
        seen.extend(transmissive_surfaces(world, ray));
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut first_of: Vec<(ShapeId, Option<InstanceId>)> = vec![];
        for (_, region, entering) in seen {
            if !first_of.contains(&region) {
                first_of.push(region);
                let vote = if entering { -1 } else { 1 };
                match votes.iter_mut().find(|(r, _)| *r == region) {
                    Some((_, sum)) => *sum += vote,
                    None => votes.push((region, vote)),
                }
            }
        }
    }
    // A closed boundary around the camera is met by every probe.
    let inside: Vec<_> = votes.iter().filter(|(_, sum)| *sum >= 2).map(|(region, _)| *region).collect();
    let explained =
        inside.iter().filter_map(|(shape, _)| world.transition(*shape)).any(|interface| interface.inside == declared);
    let mut regions = Regions::new(declared.filter(|_| !explained));
    for (shape, instance) in inside {
        if !world.cross(&mut regions, shape, instance, true) {
            warnings.add(None, format!("the camera stands in more than {MAX_OVERLAP} media: one is left out"));
        }
    }
    regions
}

/// Real surfaces that separate media (glass filled with fog), in the order that `ray` passes them.
fn transmissive_surfaces(world: &World, mut ray: Ray) -> Vec<(f32, (ShapeId, Option<InstanceId>), bool)> {
    let mut found = vec![];
    let mut travelled = 0.0;
    for _ in 0..MAX_SURFACES {
        let Some(hit) = world.tracer.closest(&ray) else { break };
        let point = world.geometry.surface_point(&ray, &hit);
        travelled += hit.t;
        if world.transition(hit.shape).is_some() {
            found.push((travelled, (hit.shape, hit.instance), ray.direction.dot(point.ng) < 0.0));
        }
        ray.origin = crate::math::robust::offset_ray_origin(point.p, point.p_error, point.ng, ray.direction);
    }
    found
}
