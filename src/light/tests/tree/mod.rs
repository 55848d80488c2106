//! The light hierarchy: what its tests share.

mod alike;
mod choice;
mod figures;
mod shape;

use super::*;
use crate::light::tree::{Cluster, LightTree, Parts, Way};
use crate::math::warp::uniform_sphere;

/// Points in a cube of side 20 around the origin.
fn place(stream: &mut Stream) -> Vec3 {
    (Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32()) - 0.5) * 20.0
}

/// Lights of all types, `count` of each of the finite ones, strengths over six orders of magnitude.
fn many(count: usize, seed: u64) -> (Geometry, Lights) {
    let mut stream = Stream::from_seed(seed);
    let (mut geometry, mut lights) = (Geometry::default(), Lights::default());
    for i in 0..count {
        let (a, b) = (uniform_sphere(pair(&mut stream)), uniform_sphere(pair(&mut stream)));
        let p = place(&mut stream);
        let kind = match i % 4 {
            0 => sphere(p, 0.05 + 0.5 * stream.next_f32()),
            1 => quad(p, a, b),
            2 => patch([p, p + a, p + b, p + a + b + a.cross(b) * 0.4]),
            _ => disk(
                Affine3A::from_translation(p) * Affine3A::from_quat(glam::Quat::from_rotation_arc(Vec3::Z, a)),
                0.5,
                0.0,
                6.3,
            ),
        };
        let radiance = Rgb::splat(strength(&mut stream));
        push(&mut geometry, &mut lights, kind, radiance, i % 3 == 0, i % 2 == 0);
    }
    for i in 0..count {
        let intensity = Rgb::splat(if i == 3 { 0.0 } else { strength(&mut stream) });
        lights.add_point(PointLight { p: place(&mut stream), intensity });
        let (p, axis, cos_end) = (place(&mut stream), uniform_sphere(pair(&mut stream)), stream.next_f32() * 2.0 - 1.0);
        let cos_start = cos_end + (1.0 - cos_end) * stream.next_f32();
        lights.add_spot(SpotLight { p, axis, intensity: Rgb::splat(strength(&mut stream)), cos_start, cos_end });
    }
    for (_, distribution) in super::goniometric::all() {
        let (p, z) = (place(&mut stream), uniform_sphere(pair(&mut stream)));
        let frame = crate::math::Frame::from_z(z);
        let to_local = glam::Mat3::from_cols(frame.x, -frame.y, frame.z).transpose();
        let intensity = Rgb::splat(strength(&mut stream));
        lights.add_goniometric(GoniometricLight { p, intensity, to_local, distribution: distribution.into() });
    }
    (geometry, lights)
}

fn strength(stream: &mut Stream) -> f32 {
    10.0f32.powf(6.0 * stream.next_f32() - 3.0)
}

fn receiver(stream: &mut Stream) -> Receiver {
    let (p, ns) = (place(stream) * 1.3, uniform_sphere(pair(stream)));
    match (stream.next_f32() * 3.0) as u32 {
        0 => Receiver::medium(p),
        1 => Receiver::surface(p, ns, true),
        _ => Receiver::surface(p, ns, false),
    }
}

fn from_infinity(lights: &mut Lights) {
    lights.add_distant(DistantLight { wi: Vec3::new(0.6, 0.0, 0.8), irradiance: Rgb::splat(0.3) });
    lights.add_infinite(InfiniteLight::Constant(Rgb::splat(0.1)));
}

/// The clusters from the root to the light `id` itself.
fn path(tree: &LightTree, id: LightId) -> Vec<Cluster> {
    let place = tree.place(id.0).expect("it shines");
    let mut path = vec![tree.root()];
    while let Some(next) = tree.children(&path[path.len() - 1]).into_iter().find(|child| child.covers(place)) {
        path.push(next);
    }
    path
}

/// Depth of the tree; fails where the sphere of a node does not hold the lights below or its energy is not theirs.
fn check_shape(lights: &Lights, tree: &LightTree, cluster: Cluster, above: &mut Vec<u32>) -> usize {
    let is_node = above.last() != Some(&cluster.node);
    if let Some(light) = tree.light(&cluster) {
        let bounds = lights.bounds(light);
        for node in above.iter().map(|&node| tree.node(node)) {
            let reach = node.centre.as_dvec3().distance(bounds.centre().as_dvec3()) + f64::from(bounds.radius);
            assert!(reach <= f64::from(node.radius) * (1.0 + 1e-5), "{reach} {}", node.radius);
            assert!(bounds.energy <= node.energy && bounds.energy > 0.0);
        }
        return above.len() - usize::from(!is_node);
    }
    above.push(cluster.node);
    let children = tree.children(&cluster);
    assert_eq!(children.iter().map(|child| child.count).sum::<u32>(), cluster.count);
    let depth = children.into_iter().map(|child| check_shape(lights, tree, child, above)).max();
    above.pop();
    depth.unwrap_or(0)
}
