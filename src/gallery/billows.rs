//! Billowing shapes, for clouds and smoke: balls that smaller balls grow on, with rounded bumps all over.

use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, FractalType, NoiseType};
use glam::Vec3;

use super::text::Dice;

/// A ball: its middle and radius.
pub type Puff = (Vec3, f32);

/// Grows `count` smaller balls on each of `puffs`, half sunk in, of `ratio` times its radius more or less, mostly on the sides that face
/// up and none below `floor`; returns all of them.
pub fn grow(dice: &mut Dice, puffs: &[Puff], count: u32, ratio: f32, floor: f32) -> Vec<Puff> {
    let mut all = puffs.to_vec();
    for &(middle, radius) in puffs {
        for _ in 0..count {
            // Uniform over the part of the sphere above a little below its equator.
            let up = dice.between(-0.35, 1.0);
            let (turn, out) = (dice.between(0.0, std::f32::consts::TAU), (1.0 - up * up).sqrt());
            let small = radius * ratio * dice.between(0.7, 1.35);
            let p = middle + 0.92 * radius * Vec3::new(out * turn.cos(), up, out * turn.sin());
            if p.y > floor {
                all.push((p, small));
            }
        }
    }
    all
}

/// How deep a point lies inside the balls, negative outside.
pub fn depth(puffs: &[Puff], p: Vec3) -> f32 {
    // Squares first: most balls are far.
    puffs.iter().fold(f32::NEG_INFINITY, |most, &(middle, radius)| {
        let reach = radius - most;
        let squared = middle.distance_squared(p);
        if reach > 0.0 && squared < reach * reach { radius - squared.sqrt() } else { most }
    })
}

/// Rounded bumps with creases between them, in about 0..1; `frequency` bumps a unit length, and smaller ones on them.
pub struct Bumps(FastNoiseLite);

impl Bumps {
    /// Another seed, other bumps.
    pub fn new(seed: i32, frequency: f32, octaves: i32) -> Self {
        let mut noise = FastNoiseLite::with_seed(seed);
        noise.set_noise_type(Some(NoiseType::Cellular));
        noise.set_cellular_distance_function(Some(CellularDistanceFunction::EuclideanSq));
        noise.set_cellular_return_type(Some(CellularReturnType::Distance));
        noise.set_fractal_type(Some(FractalType::FBm));
        noise.set_fractal_octaves(Some(octaves));
        noise.set_fractal_gain(Some(0.45));
        noise.set_frequency(Some(frequency));
        Self(noise)
    }

    /// How high they are at a point.
    pub fn at(&self, p: Vec3) -> f32 {
        -self.0.get_noise_3d(p.x, p.y, p.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_that_of_the_ball_a_point_is_deepest_in() {
        let puffs = [(Vec3::ZERO, 1.0), (Vec3::X, 2.0), (Vec3::new(9.0, 0.0, 0.0), 0.5)];
        for (x, wanted) in [(0.0, 1.0), (1.0, 2.0), (-1.0, 0.0), (9.0, 0.5), (-2.0, -1.0)] {
            assert!((depth(&puffs, Vec3::new(x, 0.0, 0.0)) - wanted).abs() < 1e-6, "at {x}");
        }
    }
}
