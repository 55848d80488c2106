//! Warps from the unit square to the shapes that renderers sample, each with its pdf.
//! Source: Pharr, Jakob, Humphreys, "Physically Based Rendering" (4th ed.), appendix A.5; Shirley & Chiu 1997 for the disk.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{Vec2, Vec3};

/// A uniform point in the unit disk, by the concentric map (Shirley & Chiu 1997), which keeps strata compact.
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let offset = 2.0 * Vec2::from_array(u) - Vec2::ONE;
    if offset == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, theta) = if offset.x.abs() > offset.y.abs() {
        (offset.x, FRAC_PI_4 * (offset.y / offset.x))
    } else {
        (offset.y, FRAC_PI_2 - FRAC_PI_4 * (offset.x / offset.y))
    };
    radius * Vec2::new(theta.cos(), theta.sin())
}

/// A direction in the upper hemisphere with pdf cos θ / π (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = concentric_disk(u);
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// The solid-angle pdf of [`cosine_hemisphere`]; 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// A uniform direction on the sphere; its pdf is [`UNIFORM_SPHERE_PDF`].
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = TAU * u[1];
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// 1 / (4π).
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// A uniform direction in the cone around +z whose half angle has 1 − cos θ = `one_minus_cos_max`.
///
/// The cone is given by 1 − cos θ because that keeps its precision for lights that look like points.
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos_max: f32) -> Vec3 {
    let one_minus_cos = u[0] * one_minus_cos_max;
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let phi = TAU * u[1];
    Vec3::new(sin * phi.cos(), sin * phi.sin(), 1.0 - one_minus_cos)
}

/// The solid-angle pdf of [`uniform_cone`].
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos_max)
}

/// Barycentric coordinates of a uniform point in a triangle (Heitz 2019, low distortion); the weights of vertices 0, 1, 2.
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 3] {
    let (b0, b1) = if u[0] < u[1] {
        let b0 = u[0] * 0.5;
        (b0, u[1] - b0)
    } else {
        let b1 = u[1] * 0.5;
        (u[0] - b1, b1)
    };
    [b0, b1, 1.0 - b0 - b1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::chi2::{assert_counts, assert_sphere};
    use crate::math::sampler::Stream;

    const N: usize = 200_000;

    fn pairs(seed: u64) -> impl FnMut() -> [f32; 2] {
        let mut rng = Stream::from_seed(seed);
        move || [rng.next_f32(), rng.next_f32()]
    }

    #[test]
    fn directions_follow_their_pdf() {
        let mut u = pairs(1);
        assert_sphere("cosine", N, || Some(cosine_hemisphere(u())), |w| f64::from(cosine_hemisphere_pdf(w.z)));
        let mut u = pairs(2);
        assert_sphere("sphere", N, || Some(uniform_sphere(u())), |_| f64::from(UNIFORM_SPHERE_PDF));
        // Cones that end on a row of the test's grid: the pdf jumps there.
        for (i, one_minus_cos) in [0.25, 1.0, 2.0].into_iter().enumerate() {
            let mut u = pairs(3 + i as u64);
            let pdf =
                |w: Vec3| f64::from(if w.z >= 1.0 - one_minus_cos { uniform_cone_pdf(one_minus_cos) } else { 0.0 });
            assert_sphere(&format!("cone {one_minus_cos}"), N, || Some(uniform_cone(u(), one_minus_cos)), pdf);
        }
    }

    #[test]
    fn the_disk_is_uniform() {
        let (rings, sectors) = (10, 16);
        let mut counts = vec![0.0; rings * sectors];
        let mut u = pairs(10);
        for _ in 0..N {
            let p = concentric_disk(u());
            assert!(p.length() <= 1.0 + 1e-6);
            // Rings of equal area.
            let ring = ((p.length_squared() * rings as f32) as usize).min(rings - 1);
            let sector = (p.y.atan2(p.x).rem_euclid(TAU) / TAU * sectors as f32) as usize;
            counts[ring * sectors + sector.min(sectors - 1)] += 1.0;
        }
        assert_counts("disk", &counts, &vec![N as f64 / (rings * sectors) as f64; rings * sectors]);
    }

    #[test]
    fn the_triangle_is_uniform() {
        // The parametrisation (1 − √(1−b), …) has Jacobian 1: cells of equal area.
        let side = 12;
        let mut counts = vec![0.0; side * side];
        let mut u = pairs(11);
        for _ in 0..N {
            let b = uniform_triangle(u());
            assert!(b.iter().all(|&b| (-1e-6..=1.0).contains(&b)) && (b.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            let s = (1.0 - b[0]).max(0.0);
            let t = if s > 0.0 { b[1] / s } else { 0.0 };
            let cell = |x: f32| ((x * side as f32) as usize).min(side - 1);
            counts[cell(s * s) * side + cell(t)] += 1.0;
        }
        assert_counts("triangle", &counts, &vec![N as f64 / (side * side) as f64; side * side]);
    }

    #[test]
    fn narrow_cones_keep_their_precision() {
        let one_minus_cos = 1e-9;
        let w = uniform_cone([1.0, 0.25], one_minus_cos);
        let sin = (w.x * w.x + w.y * w.y).sqrt();
        assert!((sin - (2.0f32 * one_minus_cos).sqrt()).abs() < 1e-9);
    }
}
