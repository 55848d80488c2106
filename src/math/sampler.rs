//! Random numbers by address: every number is a function of (seed, pixel, sample, dimension), with no state that
//! crosses pixels. So an image does not depend on the number of threads, and any sample can be replayed alone.
//!
//! The points are Owen-scrambled Sobol' (crate `openqmc`, after Burley 2020 and Ahmed 2024), padded: each
//! [`Dimension`] is an independently scrambled four-dimensional block. Unbounded streams (free-flight distances and
//! their events, walks in layers) come from a PCG generator that starts anew at each address.

use openqmc::SobolSampler;
use rand_core::Rng as _;
use rand_pcg::Pcg32;

/// Which sample of which pixel, under which seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleId {
    /// The render's seed.
    pub seed: u32,
    /// Pixel position, counted from the corner of the full image (not of the crop).
    pub pixel: [u32; 2],
    /// The sample's index in its pixel.
    pub sample: u32,
}

/// What a block of random numbers is for. Blocks of different purpose or vertex are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Dimension {
    /// Position in the pixel (2) and on the lens (2).
    Camera = 0,
    /// Time in the shutter (1), hero channel (1).
    Time = 1,
    /// BSDF or phase function sampling (3, 2) and then Russian roulette (1).
    Scatter = 2,
    /// Choice of a light (1), point on it (2), part of it (1). Where it is resampled: choice of lights (1), of one among them (1), point on it (2).
    Light = 3,
    /// Choice among mixed materials (1).
    Mix = 4,
    /// Free-flight distances and their events: seeds a stream.
    Flight = 5,
    /// Transmittance along shadow rays: seeds a stream.
    Transmittance = 6,
    /// Stochastic opacity: a hash handed to the ray.
    Opacity = 7,
    /// Random walks inside layered materials: seeds a stream.
    Layers = 8,
    /// Part of a light that is resampled (1).
    Resample = 9,
    /// Distance of in-scatter sampling (1), whether there is one (1), choice among overlapping media (1).
    InScatter = 10,
    /// Emission along a ray that nothing but the ray finds: where its points lie (1); seeds a stream too.
    Glow = 11,
    /// The sign of a filter with negative lobes (1).
    Filter = 12,
}

const DIMENSIONS_PER_VERTEX: u32 = 16;

/// log2 of the length of one Sobol' sequence.
const SEQUENCE_BITS: u32 = 16;

/// All random numbers of one sample of one pixel.
#[derive(Clone, Copy)]
pub struct SamplePoint {
    root: SobolSampler,
    key: u64,
}

impl SamplePoint {
    /// The numbers of the sample `id`, well distributed over the samples of its pixel.
    pub fn new(id: SampleId) -> Self {
        Self::of(id, false)
    }

    /// The numbers of the sample `id`, independent of those of all others.
    pub fn independent(id: SampleId) -> Self {
        Self::of(id, true)
    }

    fn of(id: SampleId, is_independent: bool) -> Self {
        let SampleId { seed, pixel: [x, y], sample } = id;
        // openqmc tells pixels apart by the low eight bits of x and y: the rest goes in as a domain of its own.
        // Its sequences are 2^16 points long, and it would go on with those of the next frame: the seed is no frame, and both the seed and
        // the number of the sequence go into the domain too.
        let sequence = mix(u64::from(seed) << 32 | u64::from(sample >> SEQUENCE_BITS));
        let page = mix(sequence ^ (u64::from(x >> 8) << 32 | u64::from(y >> 8))) as i32;
        let in_sequence = (sample & ((1 << SEQUENCE_BITS) - 1)) as i32;
        let key = mix(mix(u64::from(seed) << 32 | u64::from(sample)) ^ (u64::from(x) << 32 | u64::from(y)));
        // The first point of a sequence scrambled for this sample alone depends on no other.
        let (page, in_sequence) = if is_independent { (mix(key) as i32, 0) } else { (page, in_sequence) };
        let root = SobolSampler::new((x & 255) as i32, (y & 255) as i32, 0, in_sequence);
        Self { root: root.new_domain(page), key }
    }

    /// `N` (at most 4) well-distributed numbers in [0, 1) for `dimension` at path vertex `vertex` (0 is the camera).
    #[inline]
    pub fn draw<const N: usize>(&self, vertex: u32, dimension: Dimension) -> [f32; N] {
        self.root.new_domain(Self::address(vertex, dimension) as i32).draw_sample_f32::<N>()
    }

    /// As [`SamplePoint::draw`], for the draw number `n` of several with one purpose at one vertex; `n` = 0 is the same as `draw`.
    #[inline]
    pub fn draw_nth<const N: usize>(&self, vertex: u32, dimension: Dimension, n: u32) -> [f32; N] {
        let domain = self.root.new_domain(Self::address(vertex, dimension) as i32);
        if n == 0 { domain } else { domain.new_domain(n as i32) }.draw_sample_f32::<N>()
    }

    /// An unbounded stream of independent numbers that starts anew at this address.
    #[inline]
    pub fn stream(&self, vertex: u32, dimension: Dimension) -> Stream {
        Stream(Pcg32::new(mix(self.key ^ u64::from(Self::address(vertex, dimension))), 0x0a02_bdbf_7bb3_c0a7))
    }

    /// A 32-bit hash of this address.
    #[inline]
    pub fn hash(&self, vertex: u32, dimension: Dimension) -> u32 {
        mix(self.key ^ u64::from(Self::address(vertex, dimension))) as u32
    }

    #[inline]
    fn address(vertex: u32, dimension: Dimension) -> u32 {
        vertex.wrapping_mul(DIMENSIONS_PER_VERTEX).wrapping_add(dimension as u32)
    }
}

/// A stream of independent uniform numbers (PCG XSH-RR 64/32).
#[derive(Clone, Debug)]
pub struct Stream(Pcg32);

impl Stream {
    /// The next number in [0, 1), a multiple of 2^-24.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// The next number with density e^-τ on τ > 0: the optical depth to the next collision.
    ///
    /// Both tails are resolved to a relative 2^-8 or better down to probabilities of 2^-56: media so thin that hardly anything meets
    /// them are met as often as they should be, and depths up to 44 occur.
    #[inline]
    pub fn next_exponential(&mut self) -> f32 {
        const UNIT: f32 = 1.0 / 4_294_967_296.0;
        /// Below this many units more random bits are needed.
        const FEW: u32 = 256;
        let n = self.0.next_u32();
        let is_near = n < 1 << 31;
        // The distance from the nearer end of (0, 1), in units.
        let steps = if is_near { n } else { !n };
        let fraction = if steps < FEW { (self.0.next_u32() as f32 + 0.5) * UNIT } else { 0.5 };
        let u = (steps as f32 + fraction) * UNIT;
        // τ = −ln(1 − u) near 0; far from it u is the probability of the tail.
        if is_near { -(-u).ln_1p() } else { -u.ln() }
    }

    /// A stream for tests and tools that have no pixel: a function of `seed` alone.
    pub fn from_seed(seed: u64) -> Self {
        Self(Pcg32::new(mix(seed), 0x0a02_bdbf_7bb3_c0a7))
    }
}

/// A 64-bit finaliser with good avalanche (Stafford's variant 13 of the MurmurHash3 finaliser, as in SplitMix64).
#[inline]
pub fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::chi2::{Moments, assert_counts};

    fn point(seed: u32, pixel: [u32; 2], sample: u32) -> SamplePoint {
        SamplePoint::new(SampleId { seed, pixel, sample })
    }

    #[test]
    fn numbers_are_a_function_of_the_address() {
        let (a, b) = (point(1, [5, 9], 3), point(1, [5, 9], 3));
        assert_eq!(a.draw::<4>(2, Dimension::Light), b.draw::<4>(2, Dimension::Light));
        assert_eq!(a.hash(2, Dimension::Opacity), b.hash(2, Dimension::Opacity));
        let first = a.stream(1, Dimension::Flight).next_f32();
        assert_eq!(first, b.stream(1, Dimension::Flight).next_f32());
        for other in [point(2, [5, 9], 3), point(1, [6, 9], 3), point(1, [5, 9], 4), point(1, [261, 9], 3)] {
            assert_ne!(a.draw::<4>(2, Dimension::Light), other.draw::<4>(2, Dimension::Light));
            assert_ne!(first, other.stream(1, Dimension::Flight).next_f32());
        }
        assert_ne!(a.draw::<2>(2, Dimension::Light), a.draw::<2>(3, Dimension::Light));
        assert_ne!(a.draw::<2>(2, Dimension::Light), a.draw::<2>(2, Dimension::Scatter));
    }

    /// Owen-scrambled Sobol' points are (0, m, 1)-nets in each dimension and a (0, m, 2)-net in the first two: every
    /// elementary interval of the first 2^m holds exactly one.
    #[test]
    fn samples_of_a_pixel_are_nets() {
        for (pixel, dimension) in
            [([0, 0], Dimension::Camera), ([300, 7], Dimension::Light), ([17, 1000], Dimension::Scatter)]
        {
            for m in [4u32, 6, 8] {
                let n = 1u32 << m;
                let points: Vec<[f32; 4]> = (0..n).map(|i| point(7, pixel, i).draw(1, dimension)).collect();
                assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
                for d in 0..4 {
                    let mut seen = vec![false; n as usize];
                    for p in &points {
                        assert!(
                            !std::mem::replace(&mut seen[(p[d] * n as f32) as usize], true),
                            "dimension {d}, n {n}"
                        );
                    }
                }
                for log_columns in 0..=m {
                    let (columns, rows) = (1u32 << log_columns, 1u32 << (m - log_columns));
                    let mut seen = vec![false; n as usize];
                    for p in &points {
                        let (x, y) = ((p[0] * columns as f32) as u32, (p[1] * rows as f32) as u32);
                        let cell = (y * columns + x) as usize;
                        assert!(!std::mem::replace(&mut seen[cell], true), "{columns} × {rows} of {pixel:?}");
                    }
                }
            }
        }
    }

    /// A sequence is 2^16 points long: what follows is a sequence of its own, not that of another seed.
    #[test]
    fn long_renders_do_not_repeat_other_seeds() {
        for k in 0..64 {
            let after = point(5, [3, 4], (1 << SEQUENCE_BITS) + k).draw::<4>(1, Dimension::Light);
            for (seed, sample) in [(5, k), (6, k), (4, k)] {
                assert_ne!(after, point(seed, [3, 4], sample).draw::<4>(1, Dimension::Light), "seed {seed}");
            }
        }
    }

    /// Correlation of what pixels far apart draw: 0 within its error. Pixels 256 apart share openqmc's own coordinates.
    #[test]
    fn pixels_far_apart_are_independent() {
        for offset in [[256, 0], [0, 256], [512, 256], [1, 0]] {
            let mut product = Moments::default();
            for i in 0..4096u32 {
                let pixel = [i % 64, i / 64];
                let there = [pixel[0] + offset[0], pixel[1] + offset[1]];
                let [a] = point(3, pixel, 0).draw::<1>(1, Dimension::Light);
                let [b] = point(3, there, 0).draw::<1>(1, Dimension::Light);
                product.add(f64::from(a - 0.5) * f64::from(b - 0.5));
            }
            product.assert_mean(&format!("offset {offset:?}"), 0.0);
        }
    }

    #[test]
    fn first_samples_of_pixels_and_vertices_are_uniform() {
        let mut counts = vec![0.0; 256];
        let mut across_vertices = vec![0.0; 256];
        let cell = |[x, y]: [f32; 2]| (x * 16.0) as usize * 16 + (y * 16.0) as usize;
        for i in 0..65_536u32 {
            counts[cell(point(1, [i % 512, i / 512 * 3], 0).draw(1, Dimension::Light))] += 1.0;
            across_vertices[cell(point(1, [3, 4], 0).draw(i, Dimension::Light))] += 1.0;
        }
        assert_counts("pixels", &counts, &[256.0; 256]);
        assert_counts("vertices", &across_vertices, &[256.0; 256]);
    }

    /// Pairs of numbers of one sample, and the same number of successive samples of one pixel and of samples of neighbours, fall evenly over 16 × 16
    /// cells, and some cells stay empty for as long as chance has it.
    #[test]
    fn independent_samples_are_uniform_and_independent() {
        let at = |pixel, sample| {
            let [a, b] = SamplePoint::independent(SampleId { seed: 4, pixel, sample }).draw(1, Dimension::Light);
            [a, b]
        };
        let cell = |x: f32, y: f32| (x * 16.0) as usize * 16 + (y * 16.0) as usize;
        let (mut within, mut after, mut beside) = (vec![0.0; 256], vec![0.0; 256], vec![0.0; 256]);
        for i in 0..65_536u32 {
            let [[a, b], [c, _], [d, _]] = [at([3, 4], i), at([3, 4], i + 1), at([4, 4], i)];
            within[cell(a, b)] += 1.0;
            after[cell(a, c)] += 1.0;
            beside[cell(a, d)] += 1.0;
        }
        for (name, counts) in [("within", within), ("after", after), ("beside", beside)] {
            assert_counts(name, &counts, &[256.0; 256]);
        }
        // Sobol' points would leave none of 256 intervals empty; of independent ones e^-1 are.
        let mut is_met = [false; 256];
        (0..256).for_each(|i| is_met[(at([9, 9], i)[0] * 256.0) as usize] = true);
        let empty = is_met.iter().filter(|is_met| !**is_met).count();
        assert!((60..130).contains(&empty), "{empty}");
    }

    #[test]
    fn streams_are_uniform_and_their_starts_too() {
        let mut stream = Stream::from_seed(9);
        let (mut along, mut starts, mut pairs) = (vec![0.0; 64], vec![0.0; 64], vec![0.0; 256]);
        for i in 0..100_000u32 {
            along[(stream.next_f32() * 64.0) as usize] += 1.0;
            let mut start = point(0, [i % 1000, i / 1000], 0).stream(2, Dimension::Flight);
            let (a, b) = (start.next_f32(), start.next_f32());
            starts[(a * 64.0) as usize] += 1.0;
            pairs[(a * 16.0) as usize * 16 + (b * 16.0) as usize] += 1.0;
        }
        assert_counts("along", &along, &[100_000.0 / 64.0; 64]);
        assert_counts("starts", &starts, &[100_000.0 / 64.0; 64]);
        assert_counts("pairs", &pairs, &[100_000.0 / 256.0; 256]);
    }
}
