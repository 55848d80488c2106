//! Statistical assertions have the rates of [`crate::math::chi2`].

use glam::{DAffine3, DVec3};
use std::sync::Arc;

use super::*;
use crate::math::chi2::{assert_sphere, integrate_sphere};
use crate::math::sampler::Stream;
use crate::medium::grid::emission::{Emission, EmissionShape};
use crate::medium::grid::field::{Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};

/// A medium of `size` voxels whose densities `value` gives, turned and stretched.
fn medium(size: [u32; 3], scale: f32, value: impl Fn(usize) -> f32) -> GridMedium {
    let grid = ScalarGrid::Single(Arc::new(SparseGrid::from_dense(size, value, 0.0)));
    let place = DAffine3::from_translation(DVec3::new(-0.7, 0.2, -0.4))
        * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7)
        * DAffine3::from_scale(DVec3::new(0.2, 0.15, 0.3));
    GridMedium::new(GridMediumParts {
        density: Some(Field { grid, map: IndexMap::new(place, None).expect("invertible"), scale: 1.0, offset: 0.0 }),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::new(1.0, 2.0, 0.5),
        sigma_s: Rgb::BLACK,
        scale,
        emission: Some(Emission { radiance: Rgb::new(3.0, 2.0, 1.0), shape: EmissionShape::Constant, direct: false }),
        g: 0.0,
        clip: None,
        motion: None,
    })
}

fn shuffled(i: usize) -> f32 {
    if i * 37 % 61 < 20 { (i * 37 % 61) as f32 } else { 0.0 }
}

#[test]
fn directions_follow_their_pdf() {
    for (size, scale) in [([5, 6, 4], 1e-3), ([40, 9, 12], 0.1), ([1, 1, 1], 1.0)] {
        let medium = medium(size, scale, |i| if size == [1; 3] { 1.0 } else { shuffled(i) });
        let grid = medium.energy().expect("it emits").clone();
        assert!(!grid.is_empty());
        let (low, high) = grid.bounds();
        let middle = 0.5 * (low + high);
        // Inside, at a corner of the box, outside and beside it.
        for p in [middle, low, middle + 0.2 * (high - low), high + 0.3 * (high - low)] {
            let whole = integrate_sphere(|w| f64::from(grid.along(p, w).pdf));
            assert!((whole - 1.0).abs() < 4e-3, "the pdf integrates to {whole} from {p}");
            let mut stream = Stream::from_seed(3);
            let mut u = || stream.next_f32();
            let mut sample = || {
                let w = grid.sample(p, [u(), u()], f64::from(u()) + f64::from(u()) / f64::from(1 << 24));
                assert!(w.is_none_or(|w| grid.along(p, w).pdf > 0.0));
                w
            };
            assert_sphere("energy", 100_000, &mut sample, |w| f64::from(grid.along(p, w).pdf));
        }
    }
}

/// The estimate of a thin medium's radiance is its radiance but for the grid's coarseness: over all directions they add up to the same.
#[test]
fn estimates_add_up_to_the_fluence() {
    let medium = medium([40, 9, 12], 1e-3, shuffled);
    let grid = medium.energy().expect("it emits");
    let (low, high) = grid.bounds();
    let (middle, size) = (0.5 * (low + high), (high - low).length());
    let p = middle + Vec3::new(0.3, 0.9, -0.3) * size;
    let estimated = integrate_sphere(|w| f64::from(grid.along(p, w).radiance[1]));
    // ∫ L dω = ∫ μ_a L_e / d² dV.
    let (n, mut sum) = (60, 0.0);
    for i in 0..n * n * n {
        let at = Vec3::new((i / n / n) as f32, (i / n % n) as f32, (i % n) as f32) + 0.5;
        let q = low + (high - low) * at / n as f32;
        sum += f64::from(medium.point(q, 0.0).emission[1] / q.distance_squared(p));
    }
    let expected = sum * f64::from((high - low).element_product()) / f64::from(n * n * n);
    assert!((estimated / expected - 1.0).abs() < 0.05, "{estimated} and {expected}");
}

/// Far from the origin and from the fire, directions lead to it.
#[test]
fn far_away_it_is_still_met() {
    let medium = medium([5, 6, 4], 1.0, shuffled);
    let grid = medium.energy().expect("it emits");
    let mut stream = Stream::from_seed(4);
    for distance in [1e2f32, 1e4, 1e6] {
        let p = Vec3::new(0.6, 0.0, 0.8) * distance;
        let mut met = 0;
        for _ in 0..1000 {
            let w = grid.sample(p, [stream.next_f32(), stream.next_f32()], f64::from(stream.next_f32()));
            let line = w.map_or(Line::default(), |w| grid.along(p, w));
            assert!(line.pdf.is_finite() && line.radiance.is_finite());
            met += u32::from(line.pdf > 0.0);
        }
        assert!(met > if distance < 1e5 { 950 } else { 500 }, "{met} of 1000 at {distance}");
    }
}

#[test]
fn what_does_not_emit_has_none() {
    assert!(medium([2, 2, 2], 1.0, |_| 0.0).energy().is_none());
}
