//! The renderer's tracking against the plain one of [`super::reference`]: the same rays through the same fire.

use lanternfish::bench::estimate::Estimate;
use lanternfish::geometry::Ray;
use lanternfish::integrator::World;
use serde::Serialize;

use super::common::time;
use super::reference::Dense;
use super::track::{Track, Tracked, run};

#[derive(Serialize)]
pub struct AgainstReference {
    pub kind: &'static str,
    pub depth: f32,
    /// Million look-ups a second on one core.
    pub rate: Estimate,
    pub reference_rate: Estimate,
    /// Million rays a second on one core.
    pub rays: Estimate,
    pub reference_rays: Estimate,
    /// Rays a second over those of the reference, repetition by repetition.
    pub times_as_fast: Estimate,
    pub lookups_per_ray: f64,
    pub reference_lookups_per_ray: f64,
}

/// Both in turns.
pub fn measure(
    (kind, depth): (&'static str, f32),
    (world, track): (&World, Track),
    (dense, extinction): (&Dense, f32),
    rays: &[Ray],
    (seed, repetitions): (u64, u64),
) -> AgainstReference {
    let is_flight = kind == "flight";
    let count = rays.len() as f64;
    let (mut seconds, mut tracked) = ([vec![], vec![]], [Tracked { steps: 0, through: [0.0; 2] }; 2]);
    for repetition in 0..repetitions {
        for turn in 0..2 {
            // Whoever goes first in one repetition goes last in the next.
            let which = (turn + repetition as usize) % 2;
            let (result, cpu, _) = time(|| match which {
                0 => run(world, rays, seed, track),
                _ => dense.run(rays, seed, extinction, is_flight),
            });
            seconds[which].push(cpu);
            tracked[which] = result;
        }
    }
    let [own, plain] = &tracked;
    let error = own.through[1].hypot(plain.through[1]);
    let apart = (own.through[0] - plain.through[0]).abs();
    assert!(apart < 5.0 * error + 1e-4, "both see the same: {own:?} and {plain:?}");
    let rate = |which: usize, of: f64| Estimate::of(&seconds[which].iter().map(|s| of * 1e-6 / s).collect::<Vec<_>>());
    let ratios: Vec<f64> = seconds[0].iter().zip(&seconds[1]).map(|(own, plain)| plain / own).collect();
    let result = AgainstReference {
        kind,
        depth,
        rate: rate(0, own.steps as f64),
        reference_rate: rate(1, plain.steps as f64),
        rays: rate(0, count),
        reference_rays: rate(1, count),
        times_as_fast: Estimate::of(&ratios),
        lookups_per_ray: own.steps as f64 / count,
        reference_lookups_per_ray: plain.steps as f64 / count,
    };
    println!(
        "{kind:>13}, depth {depth:6}: {} million rays a second, plain {}: {} times as many; look-ups {} M/s ({:.1} a ray), plain {} M/s ({:.1} a ray); {:.4} and {:.4} ± {:.4} get through",
        result.rays.show(3),
        result.reference_rays.show(3),
        result.times_as_fast.show(2),
        result.rate.show(2),
        result.lookups_per_ray,
        result.reference_rate.show(2),
        result.reference_lookups_per_ray,
        own.through[0],
        plain.through[0],
        error,
    );
    result
}
