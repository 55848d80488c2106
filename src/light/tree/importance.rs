//! How much the lights below a node may matter at a receiver: energy over squared distance, times bounds of the cosines at the receiver
//! and at the emitters. Source: Conty Estevez & Kulla, HPG 2018, section 4.2, equation 3.
//!
//! Conservative: positive wherever a light below can contribute. Distances are never taken as less than the node's radius, and from
//! within its sphere any direction may lead to a light and any side may show, so the value is finite everywhere.

use glam::Vec3;

use super::node::Node;
use crate::light::Receiver;
use crate::light::emitters::{INSIDE, cos_less, larger};

/// Above this no importance goes, so that two of them have a finite sum.
const MAX_IMPORTANCE: f32 = f32::MAX / 4.0;

/// What a cosine may be off by rounding.
const SLACK: f32 = 1e-6;

/// So many nodes are judged side by side.
pub const LANES: usize = 8;

/// [`Node::importance`] of several nodes at once: where all face all ways there is no branch, and the processor takes several in one step.
#[inline]
pub fn importances(nodes: [&Node; LANES], receiver: &Receiver) -> [f32; LANES] {
    if !nodes.iter().all(|node| node.faces_all_ways()) {
        return nodes.map(|node| node.importance(receiver));
    }
    let (normal, is_surface, two_sided) = match *receiver {
        Receiver::Medium { .. } => (Vec3::ZERO, false, false),
        Receiver::Surface { ns, two_sided, .. } => (ns, true, two_sided),
    };
    let p = receiver.p();
    let [x, y, z] = [0, 1, 2].map(|axis| nodes.map(|node| node.centre[axis] - p[axis]));
    let (radius, energy) = (nodes.map(|node| node.radius), nodes.map(|node| node.energy));
    let means = nodes.map(|node| node.mean_cosines(receiver));
    let mut importances = [0.0; LANES];
    for i in 0..LANES {
        let square = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
        let radius_squared = radius[i] * radius[i];
        let outer = larger(larger(square, radius_squared), f32::MIN_POSITIVE);
        let outside = square - radius_squared * (1.0 / 3.0);
        let inside = (square + radius_squared) * (1.0 / 3.0);
        let near = larger(if square > radius_squared { outside } else { inside }, f32::MIN_POSITIVE);
        let sin_squared = radius_squared / outer;
        let cos = (normal.x * x[i] + normal.y * y[i] + normal.z * z[i]) * (1.0 / outer.sqrt());
        let cos = if two_sided { cos.abs() } else { cos };
        let facing = larger(cos_less(cos, larger(1.0 - sin_squared, 0.0).sqrt()) + SLACK, 0.0);
        let largest = if is_surface { facing } else { 1.0 };
        let around = if largest > 0.0 { largest + sin_squared * (means[i] - largest) } else { 0.0 };
        let cosines = if square <= radius_squared * INSIDE { means[i] } else { around };
        let importance = larger(energy[i] / near * cosines, f32::MIN_POSITIVE).min(MAX_IMPORTANCE);
        importances[i] = if cosines > 0.0 { importance } else { 0.0 };
    }
    importances
}

impl Node {
    /// The importance of the lights below for `receiver`: 0 only where none of them can contribute.
    #[inline(always)]
    pub fn importance(&self, receiver: &Receiver) -> f32 {
        let to_light = self.centre - receiver.p();
        let square = to_light.length_squared();
        let radius_squared = self.radius * self.radius;
        let outer = larger(larger(square, radius_squared), f32::MIN_POSITIVE);
        // The mean of 1/d² over a ball is 3/r² at its centre, 3/(2r²) at its surface and 1/d² far away: this follows it to 5 %.
        let mean_square = if square > radius_squared {
            square - radius_squared * (1.0 / 3.0)
        } else {
            (square + radius_squared) * (1.0 / 3.0)
        };
        let near = larger(mean_square, f32::MIN_POSITIVE);
        let sin_squared = radius_squared / outer;
        let cosines = if square <= radius_squared * INSIDE {
            self.mean_cosines(receiver)
        } else {
            let largest = self.cosines(receiver, to_light * (1.0 / outer.sqrt()), sin_squared);
            if largest > 0.0 { largest + sin_squared * (self.mean_cosines(receiver) - largest) } else { 0.0 }
        };
        if cosines > 0.0 { (self.energy / near * cosines).clamp(f32::MIN_POSITIVE, MAX_IMPORTANCE) } else { 0.0 }
    }

    /// The product of both cosines' means over all directions.
    #[inline(always)]
    fn mean_cosines(&self, receiver: &Receiver) -> f32 {
        let received = match *receiver {
            Receiver::Medium { .. } => 1.0,
            Receiver::Surface { two_sided: false, .. } => 0.25,
            Receiver::Surface { two_sided: true, .. } => 0.5,
        };
        received
            * match (self.is_lambertian(), self.is_two_sided()) {
                (false, _) => 1.0,
                (true, false) => 0.25,
                (true, true) => 0.5,
            }
    }

    /// The largest product of the cosines at both ends that the bounds allow, seen from outside the sphere: its centre in the unit
    /// direction `wi`, the squared sine of its angular radius given.
    #[inline(always)]
    fn cosines(&self, receiver: &Receiver, wi: Vec3, sin_squared: f32) -> f32 {
        let cos_spread = larger(1.0 - sin_squared, 0.0).sqrt();
        let received = match *receiver {
            Receiver::Medium { .. } => 1.0,
            Receiver::Surface { ns, two_sided: false, .. } => cos_less(ns.dot(wi), cos_spread) + SLACK,
            Receiver::Surface { ns, two_sided: true, .. } => cos_less(ns.dot(wi).abs(), cos_spread) + SLACK,
        };
        if received <= 0.0 || self.faces_all_ways() {
            return larger(received, 0.0);
        }
        let cos = -self.axis().dot(wi);
        let cos = if self.is_two_sided() { cos.abs() } else { cos };
        // The normals' cone, widened by what the sphere spans.
        let facing = cos_less(cos_less(cos, self.cos_normals()), cos_spread);
        if facing + SLACK < self.cos_emission() {
            return 0.0;
        }
        received * if self.is_lambertian() { larger(facing, SLACK) } else { 1.0 }
    }

    /// Squared radius over squared distance, below 1 outside the sphere: all that the spread of 1/d² depends on.
    #[inline(always)]
    pub(super) fn squared_extent(&self, receiver: &Receiver) -> f32 {
        let square = (self.centre - receiver.p()).length_squared();
        let radius_squared = self.radius * self.radius;
        // No extent where there is no radius, also at the very spot.
        if radius_squared > 0.0 { radius_squared / larger(square, f32::MIN_POSITIVE) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::tree::LightBounds;
    use crate::math::sampler::Stream;
    use crate::math::warp::uniform_sphere;

    /// All face all ways, or some do not.
    fn nodes(stream: &mut Stream, all_ways: bool) -> [Node; LANES] {
        std::array::from_fn(|lane| {
            let mut next = || stream.next_f32();
            let low = Vec3::from([(); 3].map(|()| 8.0 * next() - 4.0));
            // A point among them, and large ones, which a receiver may lie in.
            let size = if lane == 0 { 0.0 } else { 5.0 * next() * next() };
            let mut bounds = LightBounds::of_point(low, 10.0 * next());
            bounds.high = low + Vec3::splat(size);
            bounds.radius = 0.5 * size * 3f32.sqrt();
            bounds.lambertian = lane % 2 == 0;
            bounds.two_sided = lane % 3 == 0;
            if !all_ways && lane > 4 {
                (bounds.axis, bounds.cos_normals) = (uniform_sphere([next(), next()]), next());
            }
            Node::new(&bounds, false, 0)
        })
    }

    #[test]
    fn several_nodes_are_judged_as_each_by_itself() {
        let mut stream = Stream::from_seed(5);
        for i in 0..3000 {
            let nodes = nodes(&mut stream, i % 4 > 0);
            let mut next = || stream.next_f32();
            let p = Vec3::from([(); 3].map(|()| 12.0 * next() - 6.0));
            // At the very spot of a light, too.
            let p = if i % 10 == 0 { nodes[0].centre } else { p };
            let ns = uniform_sphere([next(), next()]);
            for receiver in [Receiver::medium(p), Receiver::surface(p, ns, false), Receiver::surface(p, ns, true)] {
                let found = importances(nodes.each_ref(), &receiver);
                for (node, found) in nodes.iter().zip(found) {
                    let alone = node.importance(&receiver);
                    assert!((found - alone).abs() <= 1e-4 * alone.max(1e-3), "{found} {alone} {node:?} {receiver:?}");
                    assert_eq!(found > 0.0, alone > 0.0, "{node:?} {receiver:?}");
                }
            }
        }
    }
}
