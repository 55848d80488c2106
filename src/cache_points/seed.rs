//! Candidates: where cache points may come to be. Source: Li et al. 2024, section 3.1.1.
//!
//! The paper scatters 100,000 points in the boxes of the scene's objects, in proportion to their volume, and adds up to a million vertices
//! of pilot paths. **Ours:** the numbers follow the image, so that seeding costs the same share of any render; and narrow beams get points
//! along their axes (the paper's section 6 names beams that no point happens to lie in as its failure).

use glam::Vec3;

use crate::light::{LightId, Lights, Receiver};
use crate::math::sampler::{Stream, mix};

/// Points scattered in boxes, at most.
pub const MOST_IN_BOXES: usize = 100_000;
/// Vertices of pilot paths, at most.
pub const MOST_PILOTS: usize = 1_000_000;
/// Points along beams, at most, and along one of them.
const MOST_IN_BEAMS: usize = 20_000;
const MOST_IN_BEAM: usize = 256;
/// A cone of a smaller half angle is a beam.
const BEAM_COSINE: f32 = 0.94;

/// A place that light may be received at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Where, in render space.
    pub p: Vec3,
    /// The side of the surface that it lies on; zero off surfaces.
    pub normal: Vec3,
}

impl Candidate {
    /// A place in space.
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::ZERO }
    }

    /// A vertex of a path.
    pub fn at(receiver: &Receiver) -> Self {
        match *receiver {
            Receiver::Surface { p, ns, two_sided: false, .. } => Self { p, normal: ns },
            Receiver::Surface { p, .. } | Receiver::Medium { p, .. } => Self::in_space(p),
        }
    }
}

/// A box around something that receives light.
#[derive(Clone, Copy, Debug)]
pub struct ReceivingBox {
    /// Its own, by which its random numbers go: of a shape or an instance whose place in the scene's lists it tells, so that one more at their end changes no others'.
    pub number: u64,
    /// Low and high.
    pub corners: (Vec3, Vec3),
}

/// Scatters `count` candidates in `boxes` in proportion to their volumes. Each box has its own random numbers.
pub fn scatter_in_boxes(boxes: &[ReceivingBox], count: usize, out: &mut Vec<Candidate>) {
    let volume = |all: &ReceivingBox| {
        let (low, high) = all.corners;
        let size = (high - low).as_dvec3();
        size.x * size.y * size.z
    };
    let total: f64 = boxes.iter().map(volume).sum();
    if !(total > 0.0 && total.is_finite()) {
        return;
    }
    // Shares add up to the whole: each box gets what the rounded running sum grows by.
    let (mut sum, mut given) = (0.0, 0);
    for all in boxes {
        let ReceivingBox { number, corners } = *all;
        sum += volume(all);
        let due = (sum / total * count as f64).round() as usize;
        let mut stream = Stream::from_seed(mix(number));
        for _ in given..due {
            let u = Vec3::from([(); 3].map(|()| stream.next_f32()));
            out.push(Candidate::in_space(corners.0 + (corners.1 - corners.0) * u));
        }
        given = due;
    }
}

/// The lights that shine into narrow cones.
pub fn beams(lights: &Lights) -> impl Iterator<Item = LightId> + Clone {
    let is_narrow = |id: &LightId| lights.beam_after(*id, 0.0).is_some_and(|beam| beam.cos_end > BEAM_COSINE);
    lights.ids().filter(is_narrow).filter(|&id| !lights.is_dark(id))
}

/// Places along the axes of narrow beams, as far as `low` to `high` reaches: beams are seen only where something scatters in them, so
/// scenes without media need none.
pub fn along_beams(lights: &Lights, (low, high): (Vec3, Vec3), out: &mut Vec<Candidate>) {
    let beams = beams(lights);
    let count = beams.clone().count();
    if count == 0 {
        return;
    }
    let each = (MOST_IN_BEAMS / count).clamp(1, MOST_IN_BEAM);
    for (number, id) in beams.take(MOST_IN_BEAMS).enumerate() {
        let mut stream = Stream::from_seed(mix(0x0bea_0000 + number as u64));
        for k in 0..each {
            // One that moves is everywhere in turn: by the golden ratio, so that each length gets all times.
            let Some(beam) = lights.beam_after(id, (k as f32 * 0.618_034).fract()) else { continue };
            let length = distance_inside(beam.p, beam.axis, low, high);
            if !(length > 0.0 && length.is_finite()) {
                continue;
            }
            let tan = (1.0 - beam.cos_end * beam.cos_end).max(0.0).sqrt() / beam.cos_end;
            let t = length * (k as f32 + stream.next_f32()) / each as f32;
            let around = crate::math::warp::uniform_sphere([stream.next_f32(), stream.next_f32()]);
            out.push(Candidate::in_space(beam.p + t * (beam.axis + around * (0.5 * tan))));
        }
    }
}

/// How far from `p` along `direction` the box ends; 0 where the ray misses it.
fn distance_inside(p: Vec3, direction: Vec3, low: Vec3, high: Vec3) -> f32 {
    let (a, b) = ((low - p) / direction, (high - p) / direction);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    if leave > enter.max(0.0) { leave } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::SpotLight;
    use crate::math::Rgb;

    #[test]
    fn boxes_get_their_share() {
        let of = |number, low, high| ReceivingBox { number, corners: (low, high) };
        let cube = |x: f32, edge: f32| of(x as u64, Vec3::new(x, 0.0, 0.0), Vec3::new(x + edge, edge, edge));
        let flat = of(50, Vec3::splat(50.0), Vec3::new(60.0, 50.0, 60.0));
        let mut out = vec![];
        scatter_in_boxes(&[cube(0.0, 1.0), flat, cube(10.0, 2.0)], 900, &mut out);
        assert_eq!(out.len(), 900);
        assert_eq!(out.iter().filter(|c| c.p.x < 2.0).count(), 100);
        assert!(out.iter().all(|c| c.p.x < 12.0));
        scatter_in_boxes(&[flat], 900, &mut out);
        assert_eq!(out.len(), 900);
    }

    #[test]
    fn beams_get_points_in_their_cones() {
        let mut lights = Lights::default();
        let axis = Vec3::new(0.6, 0.8, 0.0);
        let (cos_start, cos_end) = (0.9999, 0.9998);
        lights.add_spot(SpotLight { p: Vec3::ZERO, axis, intensity: Rgb::WHITE, cos_start, cos_end });
        lights.add_spot(SpotLight { p: Vec3::ZERO, axis, intensity: Rgb::WHITE, cos_start, cos_end: 0.5 });
        let mut out = vec![];
        along_beams(&lights, (Vec3::splat(-1.0), Vec3::splat(80.0)), &mut out);
        assert_eq!(out.len(), MOST_IN_BEAM);
        assert!(out.iter().all(|c| c.p.normalize().dot(axis) > cos_end && c.p.length() < 101.0));
        assert!(out.iter().any(|c| c.p.length() > 98.0) && out.iter().any(|c| c.p.length() < 1.0));
    }
}
