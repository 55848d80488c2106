//! What empty space costs: boxes of 256³ voxels of which 1 % is filled, in a few balls or in leaves (8³ voxels) anywhere, against the same box full.
//!
//! The tracker is timed alone, without the integrator around it: it is the grid that has to find its way through what is empty. Rays are
//! chords of the box; those that are called empty meet no voxel and no bound of any. `depth` is the optical depth of the densest
//! voxels across the box.

use lanternfish::bench::estimate::Estimate;
use std::sync::Arc;

use glam::{DAffine3, DVec3, IVec3, Vec3};
use lanternfish::geometry::Ray;
use lanternfish::integrator::World;
use lanternfish::math::Rgb;
use lanternfish::math::sampler::Stream;
use lanternfish::medium::grid::field::{Field, ScalarGrid};
use lanternfish::medium::grid::map::IndexMap;
use lanternfish::medium::grid::sparse::SparseGrid;
use lanternfish::medium::grid::{GridMedium, GridMediumParts};
use lanternfish::medium::tracker::{Flights, Tracker, Transmittance};
use lanternfish::medium::{Medium, MediumId};
use serde::Serialize;

use super::DEPTHS;
use super::common::time;
use super::scene::{chords, of};

/// Edge of the box in leaves.
const LEAVES: i32 = 32;
/// The share that is filled.
const SHARE: f64 = 0.01;
/// Rays in a group at least, for its figures to count.
const FEWEST: usize = 50;

#[derive(Serialize)]
pub struct EmptyResult {
    pub kind: &'static str,
    pub depth: f32,
    /// The share of leaves that are filled, and of the rays that meet empty space alone.
    pub filled: f64,
    pub empty_rays: f64,
    /// Nanoseconds a ray, in the full box and in this one.
    pub full_ns: Estimate,
    pub all_ns: Estimate,
    pub empty_ns: Option<Estimate>,
    /// As shares of the cost in the full box, repetition by repetition.
    pub all_over_full: Estimate,
    pub empty_over_full: Option<Estimate>,
}

/// A box of side 1 whose leaves are filled where `is_filled` says so: noise from 0 to 1 whose cube is taken, so that most of it is much thinner
/// than its bounds, as in smoke.
fn medium(is_filled: impl Fn(IVec3) -> bool, depth: f32) -> (World, f64) {
    let (mut origins, mut values) = (vec![], vec![]);
    let mut stream = Stream::from_seed(7);
    for i in 0..LEAVES * LEAVES * LEAVES {
        let leaf = IVec3::new(i / LEAVES / LEAVES, i / LEAVES % LEAVES, i % LEAVES);
        if is_filled(leaf) {
            origins.push(leaf * 8);
            values.extend((0..512).map(|_| stream.next_f32().powi(3)));
        }
    }
    let filled = origins.len() as f64 / f64::from(LEAVES.pow(3));
    let edge = 1.0 / f64::from(8 * LEAVES);
    let map = IndexMap::new(DAffine3::from_scale(DVec3::splat(edge)), None).expect("it can be inverted");
    let grid = ScalarGrid::Single(Arc::new(SparseGrid::new(0.0, origins, values, vec![])));
    let parts = GridMediumParts {
        density: Some(Field { grid, map, scale: 1.0, offset: 0.0 }),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::splat(0.5),
        sigma_s: Rgb::splat(0.5),
        scale: depth,
        emission: None,
        g: 0.0,
        clip: None,
        motion: None,
    };
    (of(Medium::Grid(Box::new(GridMedium::new(parts)))), filled)
}

/// Four balls of 1 % of the box in all.
fn balls(leaf: IVec3) -> bool {
    let p = (leaf.as_dvec3() + 0.5) / f64::from(LEAVES);
    let radius = (SHARE / 4.0 * 0.75 / std::f64::consts::PI).cbrt();
    [[0.25, 0.3, 0.7], [0.7, 0.2, 0.4], [0.6, 0.75, 0.8], [0.3, 0.7, 0.2]]
        .iter()
        .any(|&c| p.distance(DVec3::from(c)) < radius)
}

/// One leaf in a hundred.
fn anywhere(leaf: IVec3) -> bool {
    let number = (leaf.x * LEAVES + leaf.y) * LEAVES + leaf.z;
    f64::from(Stream::from_seed(number as u64).next_f32()) < SHARE
}

/// Nanoseconds a ray of ratio tracking alone.
fn cost(world: &World, rays: &[&Ray], seed: u64) -> f64 {
    let mut stream = Stream::from_seed(seed);
    // Groups may be small: each is timed for about as long.
    let rounds = (20_000 / rays.len().max(1)).max(1);
    let (_, cpu, _) = time(|| {
        for ray in std::iter::repeat_n(rays, rounds).flatten() {
            let mut steps = 0;
            let [origin, direction] = [ray.origin, ray.direction];
            let (mut flights, stretch) = (Flights::new(), [0.0, ray.t_max]);
            let mut tracker =
                Tracker::new(&mut flights, &world.media, &[MediumId(0)], origin, direction, stretch, &mut stream);
            let mut passed = Transmittance::CLEAR;
            passed.track(&mut tracker, &world.media, ray, &mut stream, &mut steps);
            std::hint::black_box((passed.value, steps));
        }
    });
    cpu * 1e9 / (rounds * rays.len()) as f64
}

pub fn measure(count: u64, seed: u64, repetitions: u64) -> Vec<EmptyResult> {
    let rays = chords(Vec3::ZERO, Vec3::ONE, count, seed);
    let all: Vec<&Ray> = rays.iter().collect();
    let mut results = vec![];
    println!("empty space: 1 % of 256³ voxels filled against all of them, ratio tracking alone");
    for depth in DEPTHS {
        let (full, _) = medium(|_| true, depth);
        for (kind, is_filled) in [("in 4 balls", balls as fn(IVec3) -> bool), ("in leaves anywhere", anywhere)] {
            let (sparse, filled) = medium(is_filled, depth);
            let is_empty = |ray: &&&Ray| {
                sparse.media[0].majorants(ray.origin, ray.direction, 0.0, ray.t_max).all(|s| s.majorant == 0.0)
            };
            let empty: Vec<&Ray> = all.iter().filter(is_empty).copied().collect();
            let mut costs = [vec![], vec![], vec![]];
            for repetition in 0..repetitions {
                costs[0].push(cost(&full, &all, seed + repetition));
                costs[1].push(cost(&sparse, &all, seed + repetition));
                if empty.len() >= FEWEST {
                    costs[2].push(cost(&sparse, &empty, seed + repetition));
                }
            }
            let over_full = |costs: &[f64], full: &[f64]| -> Estimate {
                Estimate::of(&costs.iter().zip(full).map(|(a, b)| a / b).collect::<Vec<_>>())
            };
            let [full_costs, all_costs, empty_costs] = &costs;
            let is_measured = !empty_costs.is_empty();
            let result = EmptyResult {
                kind,
                depth,
                filled,
                empty_rays: empty.len() as f64 / all.len() as f64,
                full_ns: Estimate::of(full_costs),
                all_ns: Estimate::of(all_costs),
                empty_ns: is_measured.then(|| Estimate::of(empty_costs)),
                all_over_full: over_full(all_costs, full_costs),
                empty_over_full: is_measured.then(|| over_full(empty_costs, full_costs)),
            };
            print(&result);
            results.push(result);
        }
    }
    results
}

fn print(r: &EmptyResult) {
    let percent = |e: &Estimate| Estimate { mean: 100.0 * e.mean, half_width: 100.0 * e.half_width }.show(1);
    let empty = match (&r.empty_ns, &r.empty_over_full) {
        (Some(ns), Some(share)) => format!("{} ns = {} %", ns.show(0), percent(share)),
        _ => "too few".to_owned(),
    };
    println!(
        "  {:.2} % filled {}, depth {}: full {} ns a ray; all rays {} ns = {} %; {:.0} % of them in empty space alone: {empty}",
        100.0 * r.filled,
        r.kind,
        r.depth,
        r.full_ns.show(0),
        r.all_ns.show(0),
        percent(&r.all_over_full),
        100.0 * r.empty_rays,
    );
}
