//! Each statistical assertion fails by chance with probability 1e-6.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::*;
use crate::math::Rgb;
use crate::math::chi2::Moments;
use crate::math::sampler::Stream;
use crate::medium::grid::emission::{Emission, EmissionShape};
use crate::medium::grid::field::{AnyGrid, Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};

const LENGTH: usize = 200;

/// Emission along z that spans six orders of magnitude from cell to cell, dark in between; no extinction anywhere.
fn emission(z: usize) -> f32 {
    let height = [1.0, 1e-6, 0.0, 1e-3, 0.03, 0.0, 0.0, 1.0][z / 8 % 8];
    height * (1.0 + 0.9 * (z as f32 * 0.9).sin())
}

fn column(values: impl Fn(usize) -> f32) -> Field<AnyGrid> {
    let values: Vec<f32> = (0..LENGTH).map(values).collect();
    let grid = ScalarGrid::Single(Arc::new(SparseGrid::from_dense([1, 1, LENGTH as u32], |i| values[i], 0.0)));
    let map = IndexMap::new(DAffine3::IDENTITY, None).expect("the identity can be inverted");
    Field { grid: AnyGrid::Scalar(grid), map, scale: 1.0, offset: 0.0 }
}

fn fire(values: impl Fn(usize) -> f32) -> Medium {
    let AnyGrid::Scalar(grid) = column(|_| 0.0).grid else { unreachable!("a column is of scalars") };
    let field = column(values);
    let density = Field { grid, map: field.map, scale: 1.0, offset: 0.0 };
    let shape = EmissionShape::Grid(field);
    Medium::Grid(Box::new(GridMedium::new(GridMediumParts {
        density: Some(density),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::WHITE,
        sigma_s: Rgb::BLACK,
        scale: 1.0,
        emission: Some(Emission { radiance: Rgb::WHITE, shape, direct: true }),
        g: 0.0,
        clip: Some((DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, LENGTH as f64 - 1.0))),
        motion: None,
    })))
}

const ALONG: Ray =
    Ray { origin: Vec3::new(0.0, 0.0, -3.0), direction: Vec3::Z, t_max: f32::INFINITY, time: 0.0, opacity_seed: 0 };

/// The points of all media for one u, and what they add up to.
fn points(media: &[Medium], stretch: [f32; 2], u: &mut impl FnMut() -> f32) -> (Vec<EmissionPoint>, f64) {
    let active: Vec<MediumId> = (0..media.len() as u32).map(MediumId).collect();
    let mut walks = PointWalks::new();
    let mut points = EmissionPoints::new(&mut walks, media, &active, &ALONG, stretch, u);
    let all: Vec<_> = std::iter::from_fn(|| points.next_before(f64::INFINITY)).collect();
    let value = |point: &EmissionPoint| {
        let p = ALONG.origin + ALONG.direction * point.t;
        f64::from(media[point.medium.0 as usize].point(p, 0.0).emission[0]) / f64::from(point.rate)
    };
    let sum = all.iter().map(value).sum();
    (all, sum)
}

/// Linear between the voxels: the trapezoidal rule is exact.
fn integral(values: impl Fn(usize) -> f32, ends: std::ops::RangeInclusive<usize>) -> f64 {
    let (first, last) = (*ends.start(), *ends.end());
    (first..last).map(|z| 0.5 * (f64::from(values(z)) + f64::from(values(z + 1)))).sum()
}

#[test]
fn sums_are_unbiased_where_emission_varies() {
    let media = [fire(emission)];
    for (stretch, ends) in [([0.0, f32::INFINITY], 0..=LENGTH - 1), ([13.0, 93.0], 10..=90), ([5.0, 7.0], 2..=4)] {
        let (expected, mut stream, mut sums) = (integral(emission, ends), Stream::from_seed(3), Moments::default());
        for _ in 0..200_000 {
            sums.add(points(&media, stretch, &mut || stream.next_f32()).1);
        }
        println!("{stretch:?}: {} and {expected}", sums.mean());
        sums.assert_mean("emission", expected);
    }
}

#[test]
fn their_number_is_that_of_the_rate_and_they_are_in_order() {
    let other = |z: usize| if z > 120 { emission(LENGTH - 1 - z) } else { 0.0 };
    let media = [fire(emission), fire(other)];
    let rates = |medium: &Medium| -> f64 {
        let mut last = 0.0;
        let rates = medium.gathering_rates(ALONG.origin, ALONG.direction, 0.0, 300.0).expect("it glows");
        rates
            .map(|s| f64::from(s.majorant) * (f64::from(s.t_end) - std::mem::replace(&mut last, f64::from(s.t_end))))
            .sum()
    };
    let expected: f64 = media.iter().map(rates).sum();
    let (mut stream, mut sums, mut count) = (Stream::from_seed(4), Moments::default(), Moments::default());
    for _ in 0..20_000 {
        let (all, sum) = points(&media, [0.0, 300.0], &mut || stream.next_f32());
        assert!(all.is_sorted_by(|a, b| a.t <= b.t));
        assert!((all.len() as f64 - expected).abs() <= 2.0, "{} of {expected}", all.len());
        sums.add(sum);
        count.add(all.len() as f64);
    }
    sums.assert_mean("emission", integral(emission, 0..=LENGTH - 1) + integral(other, 0..=LENGTH - 1));
    count.assert_mean("count", expected);
}

/// A Poisson process of n points has the variance mean² / n where emission follows the rate; of a smooth flame a tenth of that is left.
#[test]
fn sums_vary_less_than_by_chance() {
    let smooth = |z: usize| (z as f32 / LENGTH as f32 * std::f32::consts::PI).sin();
    let media = [fire(smooth)];
    let (mut stream, mut sums, mut number) = (Stream::from_seed(5), Moments::default(), 0);
    for _ in 0..10_000 {
        let (all, sum) = points(&media, [0.0, 300.0], &mut || stream.next_f32());
        sums.add(sum);
        number = all.len();
    }
    let noise = sums.variance() / sums.mean().powi(2);
    println!("{noise} by {number} points");
    assert!(noise * number as f64 * 10.0 < 1.0, "{noise} by {number} points");
}

#[test]
fn where_nothing_glows_there_are_none() {
    let mut asked = 0;
    let mut u = || {
        asked += 1;
        0.0
    };
    assert!(points(&[fire(|_| 0.0)], [0.0, f32::INFINITY], &mut u).0.is_empty());
    // Bounds reach two voxels beyond the grid.
    assert!(points(&[fire(emission)], [206.0, f32::INFINITY], &mut u).0.is_empty());
}
