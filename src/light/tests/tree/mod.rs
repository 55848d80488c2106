//! The light hierarchy: what its tests share.

mod choice;
mod figures;
mod shape;

use super::*;
use crate::light::tree::{Below, LightTree, ROOT};
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

/// The nodes from the root to the leaf of light `id`.
fn path(tree: &LightTree, id: LightId) -> Vec<u32> {
    let mut path = vec![ROOT];
    let mut turns = tree.trail(id.0).expect("it shines");
    while let Below::Nodes(children) = tree.below(path[path.len() - 1]) {
        path.push(children[(turns & 1) as usize]);
        turns >>= 1;
    }
    path
}

/// Depth of the tree; fails where the sphere of a node does not hold the leaves below or its energy is not theirs.
fn check_shape(tree: &LightTree, node: u32, above: &mut Vec<u32>) -> usize {
    match tree.below(node) {
        Below::Light(_) => {
            let leaf = tree.node(node);
            for parent in above.iter().map(|&parent| tree.node(parent)) {
                let reach = parent.centre.as_dvec3().distance(leaf.centre.as_dvec3()) + f64::from(leaf.radius);
                assert!(reach <= f64::from(parent.radius) * (1.0 + 1e-5), "{reach} {}", parent.radius);
                assert!(leaf.energy <= parent.energy && leaf.energy > 0.0);
            }
            above.len()
        }
        Below::Nodes(children) => {
            above.push(node);
            let depth = children.map(|child| check_shape(tree, child, above)).into_iter().max();
            above.pop();
            depth.unwrap_or(0)
        }
    }
}
