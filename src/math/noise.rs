//! Perlin's noise and sums of it.
//!
//! Sources: Perlin, "Improving Noise" (2002), with his permutation; the choice of gradients and the sums are pbrt-v4's (section 10.6 and its third edition's
//! 10.6.1 to 10.6.3), so that scenes look alike. Sums have all their octaves: those that are finer than what a ray covers are left to the samples of a pixel.

use glam::Vec3;

#[rustfmt::skip]
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69, 142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148,
    247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175,
    74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54,
    65, 25, 63, 161, 1, 216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100, 109, 198, 173, 186, 3, 64,
    52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213,
    119, 248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110, 79, 113, 224, 232, 178, 185, 112, 104,
    218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179, 162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157,
    184, 84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78, 66, 215, 61, 156, 180,
];

/// By how much each octave is finer than the one before.
const LACUNARITY: f32 = 1.99;

fn permuted(i: i32) -> i32 {
    i32::from(PERMUTATION[(i & 255) as usize])
}

/// The slope at a lattice point, along the way to the point that it is evaluated at.
fn slope(hash: i32, d: Vec3) -> f32 {
    let h = hash & 15;
    let turned = h == 12 || h == 13;
    let u = if h < 8 || turned { d.x } else { d.y };
    let v = if h < 4 || turned { d.y } else { d.z };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// Noise in −1..1, 0 at whole numbers; 0 where `p` is not finite.
pub fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let d = p - cell;
    if !d.is_finite() {
        return 0.0;
    }
    // The lattice repeats after 256, so what is lost of coordinates beyond 2^31 does not matter.
    let [x, y, z] = [cell.x, cell.y, cell.z].map(|c| (c.rem_euclid(256.0)) as i32);
    let at = |dx: i32, dy: i32, dz: i32| {
        let hash = permuted(permuted(permuted(x + dx) + y + dy) + z + dz);
        slope(hash, d - Vec3::new(dx as f32, dy as f32, dz as f32))
    };
    let weight = |t: f32| t * t * t * ((6.0 * t - 15.0) * t + 10.0);
    let [wx, wy, wz] = [d.x, d.y, d.z].map(weight);
    let lerp = |t: f32, a: f32, b: f32| a + (b - a) * t;
    let plane = |dz: i32| {
        let near = lerp(wx, at(0, 0, dz), at(1, 0, dz));
        lerp(wy, near, lerp(wx, at(0, 1, dz), at(1, 1, dz)))
    };
    lerp(wz, plane(0), plane(1))
}

/// The slope of noise along each axis, as pbrt-v4 has it: by finite differences.
pub fn noise_slope(p: Vec3) -> Vec3 {
    const STEP: f32 = 0.01;
    let here = noise(p);
    Vec3::AXES.map(|axis| (noise(p + STEP * axis) - here) / STEP).into()
}

/// Fractional Brownian motion: `octaves` of noise, each finer than the one before and `omega` as strong.
pub fn fbm(p: Vec3, omega: f32, octaves: u32) -> f32 {
    sum(p, omega, octaves, noise)
}

/// The same of noise's absolute value.
pub fn turbulence(p: Vec3, omega: f32, octaves: u32) -> f32 {
    sum(p, omega, octaves, |p| noise(p).abs())
}

fn sum(p: Vec3, omega: f32, octaves: u32, noise: impl Fn(Vec3) -> f32) -> f32 {
    let (mut sum, mut frequency, mut strength) = (0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += strength * noise(frequency * p);
        frequency *= LACUNARITY;
        strength *= omega;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::Stream;

    #[test]
    fn every_number_is_there_once() {
        let mut sorted = PERMUTATION;
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &n)| i == usize::from(n)));
    }

    #[test]
    fn noise_is_smooth_bounded_and_zero_on_the_lattice() {
        let mut stream = Stream::from_seed(3);
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            let p = Vec3::from_array(std::array::from_fn(|_| stream.next_f32() * 512.0 - 256.0));
            let value = noise(p);
            assert!(value.abs() <= 1.0);
            // Across cells too: it is continuous with its derivatives, which are below 4.
            assert!((noise(p + Vec3::splat(1e-3)) - value).abs() < 1e-2);
            assert!(noise(p.floor()) == 0.0);
            sum += f64::from(value);
            squares += f64::from(value * value);
        }
        // Its mean is 0, its standard deviation about a quarter.
        assert!((sum / 1e5).abs() < 5e-3 && (0.04..0.12).contains(&(squares / 1e5)), "{sum} {squares}");
        for odd in [f32::NAN, f32::INFINITY, -1e38, 1e30] {
            assert!(noise(Vec3::new(odd, 0.5, 0.5)).is_finite());
        }
    }

    #[test]
    fn sums_have_their_octaves() {
        let p = Vec3::new(0.3, 1.7, -2.4);
        assert_eq!(fbm(p, 0.5, 1), noise(p));
        assert!((fbm(p, 0.5, 2) - noise(p) - 0.5 * noise(LACUNARITY * p)).abs() < 1e-6);
        assert!(turbulence(p, 0.5, 8) >= fbm(p, 0.5, 8).abs());
    }
}
