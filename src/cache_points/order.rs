//! Spatial order: candidates sorted along a Morton curve, so that neighbours in space are near in memory and the order does not depend on
//! where the candidates came from. Source: Li et al. 2024, section 3.1.1; Morton 1966.

use glam::Vec3;
use rayon::prelude::*;

use super::seed::Candidate;

/// The box of all candidates as a map to the unit cube: neighbour searches run in it, so squares of distances neither overflow nor vanish
/// whatever the scene's unit is.
#[derive(Clone, Copy, Debug)]
pub struct UnitSpace {
    low: Vec3,
    /// Edge of the cube in render space, above 0.
    pub extent: f32,
    inverse: f32,
}

impl UnitSpace {
    /// The smallest cube that holds the points.
    pub fn around(points: impl Iterator<Item = Vec3>) -> Self {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        points.for_each(|p| (low, high) = (low.min(p), high.max(p)));
        let extent = (high - low).max_element();
        let extent = if extent > 0.0 { extent } else { 1.0 };
        Self { low: if low.is_finite() { low } else { Vec3::ZERO }, extent, inverse: extent.recip().min(f32::MAX) }
    }

    /// Render space to unit space.
    #[inline]
    pub fn to_unit(&self, p: Vec3) -> Vec3 {
        (p - self.low) * self.inverse
    }
}

/// Sorts `candidates` along the Morton curve of their box; equal places keep their order.
pub fn sort_spatially(candidates: &mut Vec<Candidate>) {
    let space = UnitSpace::around(candidates.iter().map(|c| c.p));
    let mut order: Vec<(u64, u32)> =
        candidates.par_iter().enumerate().map(|(i, c)| (morton_code(space.to_unit(c.p)), i as u32)).collect();
    order.par_sort_unstable();
    *candidates = order.into_par_iter().map(|(_, i)| candidates[i as usize]).collect();
}

/// The bits of x, y and z (21 of each) interleaved; `unit` in the unit cube.
fn morton_code(unit: Vec3) -> u64 {
    const CELLS: f32 = (1 << 21) as f32;
    let spread = |x: f32| {
        let mut bits = (x * CELLS).clamp(0.0, CELLS - 1.0) as u64;
        bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
        bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
        bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
        bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
        (bits | bits << 2) & 0x1249_2492_4924_9249
    };
    spread(unit.x) | spread(unit.y) << 1 | spread(unit.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_bits() {
        assert_eq!(morton_code(Vec3::ZERO), 0);
        assert_eq!(morton_code(Vec3::ONE), (1 << 63) - 1);
        let cell = 1.0 / (1 << 21) as f32;
        assert_eq!(morton_code(Vec3::new(cell, 0.0, 0.0)), 0b001);
        assert_eq!(morton_code(Vec3::new(0.0, 3.0 * cell, 0.0)), 0b010_010);
        assert_eq!(morton_code(Vec3::new(cell, 2.0 * cell, cell)), 0b010_101);
    }

    #[test]
    fn any_unit_will_do() {
        for scale in [1e-18, 1.0, 1e17] {
            let space = UnitSpace::around([Vec3::ZERO, Vec3::new(4.0, 2.0, 1.0) * scale].into_iter());
            let p = space.to_unit(Vec3::new(2.0, 2.0, 0.0) * scale);
            assert!((p - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-6, "{p}");
        }
        assert_eq!(UnitSpace::around([Vec3::ONE].into_iter()).to_unit(Vec3::ONE), Vec3::ZERO);
    }
}
