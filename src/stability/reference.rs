//! Independent answers in double precision.

use std::f64::consts::PI;

/// The integral of `f` from `a` to `b`, by Gauss's rule of five points on `n` pieces.
pub fn integrate(a: f64, b: f64, n: usize, f: impl Fn(f64) -> f64) -> f64 {
    const RULE: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let half = (b - a) / n as f64 / 2.0;
    let pieces = (0..n).map(|i| {
        let middle = a + (2 * i + 1) as f64 * half;
        RULE.iter().map(|&(x, w)| w * f(middle + half * x)).sum::<f64>()
    });
    half * pieces.sum::<f64>()
}

/// What a grid of one voxel of density 1 holds at an index position, whose centre is 0: nothing but this one voxel enters the interpolation.
pub fn tent(index: [f64; 3]) -> f64 {
    index.iter().map(|x| (1.0 - x.abs()).max(0.0)).product()
}

/// The integral of `density` along the line from `from` to `to`.
pub fn depth(from: [f64; 3], to: [f64; 3], pieces: usize, density: impl Fn([f64; 3]) -> f64) -> f64 {
    let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
    integrate(0.0, 1.0, pieces, |t| length * density(std::array::from_fn(|k| from[k] + t * way[k])))
}

/// What a half-space that scatters isotropically, with this albedo, reflects towards its normal under a sky of radiance 1:
/// 1 − √(1 − ϖ) H(1), H being Chandrasekhar's function (Radiative Transfer, 1960, sections 38 and 39), iterated on midpoints.
pub fn half_space(albedo: f64) -> f64 {
    const N: usize = 64;
    // Midpoints of squares, which crowd towards 0, where H is steep.
    let points: Vec<(f64, f64)> =
        (0..N).map(|i| (i as f64 + 0.5) / N as f64).map(|u| (u * u, 2.0 * u / N as f64)).collect();
    let root = (1.0 - albedo).sqrt();
    let next = |mu: f64, h: &[f64]| {
        let sum: f64 = points.iter().zip(h).map(|(&(x, w), h)| w * x * h / (mu + x)).sum();
        1.0 / (root + 0.5 * albedo * sum)
    };
    let mut h = vec![1.0; N];
    // The closer to white, the slower.
    for _ in 0..2000 {
        h = points.iter().map(|&(mu, _)| next(mu, &h)).collect();
    }
    1.0 - root * next(1.0, &h)
}

/// The irradiance at the origin, with normal +z, from a polygon of radiance 1 above the horizon, whichever way round its corners go (Lambert
/// 1760): ½ |Σ γ_i Γ_i · n|, γ_i being the angle that edge i subtends and Γ_i the normal of its plane with the origin.
pub fn polygon(corners: &[[f64; 3]]) -> f64 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f64 = edges
        .map(|(a, b)| {
            let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            let sine = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
            let cosine: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
            if sine > 0.0 { sine.atan2(cosine) * cross[2] / sine } else { 0.0 }
        })
        .sum();
    sum.abs() / 2.0
}

/// The irradiance on a plane from a line of radiance times width 1 that lies parallel to it at `distance`, reaching `half` to both sides of the
/// point: the integral of d² / (x² + d²)².
pub fn line(distance: f64, half: f64) -> f64 {
    let d = distance;
    half / (half * half + d * d) + (half / d).atan() / d
}

/// The radiance of a diffuse surface under this irradiance.
pub fn diffuse(reflectance: f64, irradiance: f64) -> f64 {
    reflectance / PI * irradiance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chandrasekhar's table XI.
    #[test]
    fn half_spaces_are_chandrasekhars() {
        for (albedo, h) in [(0.5f64, 1.2513), (0.9, 1.8501)] {
            assert!((half_space(albedo) - (1.0 - (1.0 - albedo).sqrt() * h)).abs() < 1e-4, "{albedo}");
        }
        // H(1) is 2.9078 at albedo 1, and 1 − √(3 (1 − ϖ)) times that close to it.
        let root = 1e-2;
        let expected = 1.0 - root * 2.9078 * (1.0 - 3f64.sqrt() * root);
        assert!((half_space(1.0 - root * root) - expected).abs() < 3e-5, "{}", half_space(1.0 - root * root));
    }

    /// Against Howell's B-4 (a rectangle over its corner), and lines against narrow rectangles.
    #[test]
    fn polygons_and_lines_have_their_form_factors() {
        let (x, y) = (0.5f64, 1.5f64);
        let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        let factor = (x / sx * (y / sx).atan() + y / sy * (x / sy).atan()) / (2.0 * PI);
        let corners = [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 3.0, 2.0], [0.0, 3.0, 2.0]];
        assert!((polygon(&corners) / PI - factor).abs() < 1e-12);
        let w = 1e-4;
        let narrow = [[-1.0, -w, 2.0], [1.0, -w, 2.0], [1.0, w, 2.0], [-1.0, w, 2.0]];
        assert!((polygon(&narrow) / (2.0 * w) / line(2.0, 1.0) - 1.0).abs() < 1e-6);
    }
}
