//! Ways along a ray: the integrator's own free flights and transmittances.

use lanternfish::geometry::Ray;
use lanternfish::integrator::flight::{PathState, PathWeight, sample_flight, transmittance};
use lanternfish::integrator::{Scratch, World};
use lanternfish::math::sampler::Stream;

/// Tracks along a ray; what gets through, in red.
pub type Track = fn(&World, &Ray, &mut Stream, &mut Scratch) -> f32;

/// Delta tracking: 1 where nothing scatters.
pub fn flight(world: &World, ray: &Ray, stream: &mut Stream, scratch: &mut Scratch) -> f32 {
    let mut path =
        PathState { weight: PathWeight::START, regions: world.camera_regions.clone(), hero: None, links: None };
    let vertex = sample_flight(world, ray, &mut path, true, stream, scratch, |weight, _, emission, _| {
        std::hint::black_box(weight.alone() * emission);
    });
    f32::from(u8::from(vertex.is_none()))
}

/// Ratio tracking.
pub fn through(world: &World, ray: &Ray, stream: &mut Stream, scratch: &mut Scratch) -> f32 {
    let seed = (stream.next_f32() * 16_777_216.0) as u64;
    transmittance(world, ray, &world.camera_regions, || Stream::from_seed(seed), scratch).value[0]
}

/// What tracking along many rays came to.
#[derive(Clone, Copy, Debug)]
pub struct Tracked {
    /// Look-ups of density.
    pub steps: u64,
    /// The mean over the rays of what got through, and its standard error.
    pub through: [f64; 2],
}

/// Sums up `each` of `count` rays, which gives what gets through.
pub fn sum(count: usize, mut each: impl FnMut(usize) -> f32) -> [f64; 2] {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..count {
        let value = f64::from(each(i));
        sum += value;
        squares += value * value;
    }
    let mean = sum / count as f64;
    [mean, ((squares / count as f64 - mean * mean).max(0.0) / count as f64).sqrt()]
}

/// Tracks along every ray.
pub fn run(world: &World, rays: &[Ray], seed: u64, track: Track) -> Tracked {
    let mut scratch = Scratch::default();
    let mut stream = Stream::from_seed(seed);
    let through = sum(rays.len(), |i| track(world, &rays[i], &mut stream, &mut scratch));
    let counters = scratch.counters;
    let steps = counters.flight_steps + counters.transmittance_steps + counters.emission_points;
    Tracked { steps, through }
}
