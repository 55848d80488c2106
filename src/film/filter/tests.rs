//! Tests of filters with negative lobes; those without are tested with the film.

use std::f64::consts::PI;

use super::lobes::{mitchell, windowed_sinc};
use super::*;
use crate::film::tests::entity;
use crate::math::sampler::Stream;
use crate::scene::ParamValue;

fn signed() -> [PixelFilter; 3] {
    [
        PixelFilter::mitchell(Vec2::new(2.0, 3.0), [1.0 / 3.0; 2]),
        // The Catmull-Rom spline, the sharpest of its family.
        PixelFilter::mitchell(Vec2::splat(2.0), [0.0, 0.5]),
        PixelFilter::sinc(Vec2::new(4.0, 2.5), 3.0),
    ]
}

#[test]
fn the_formulas_meet_known_values() {
    // Mitchell and Netravali's own choice is 8/9 in the middle and 1/18 at half of its radius; cubics of the family sum to 1 on any grid.
    let at = |x: f64| mitchell(x, 2.0, 1.0 / 3.0, 1.0 / 3.0);
    assert!((at(0.0) - 8.0 / 9.0).abs() < 1e-12 && (at(1.0) - 1.0 / 18.0).abs() < 1e-12 && at(1.5) < 0.0);
    for x in [0.0, 0.3, 0.77] {
        let sum: f64 = (-3..=3).map(|i| at(x + f64::from(i))).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }
    let sinc = |x| windowed_sinc(x, 4.0, 3.0);
    assert!(sinc(0.0) == 1.0 && sinc(1.0).abs() < 1e-12 && sinc(4.0) == 0.0);
    // A negative lobe's −1 / 1.5π under a window of 2 / π.
    assert!((sinc(1.5) + 4.0 / (3.0 * PI * PI)).abs() < 1e-12, "{}", sinc(1.5));
}

/// Weighted positions integrate like the filter does: checked against cosines, which tell every part of it. False-alarm rate below 1e-6: a mean has a
/// standard error of at most 1.2e-3.
#[test]
fn weighted_samples_integrate_like_the_filter() {
    const GRID: usize = 256;
    const SAMPLES: usize = 2_000_000;
    for (index, filter) in signed().iter().enumerate() {
        let radius = filter.radius().as_dvec2();
        let waves = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 3.0], [5.0, 1.0]];
        let wave = |[k, l]: [f64; 2], x: f64, y: f64| (k * PI * x / radius.x).cos() * (l * PI * y / radius.y).cos();
        let (mut sampled, mut exact) = ([0.0; 5], [0.0; 5]);
        let at = |i: usize| (2 * i + 1) as f64 / GRID as f64 - 1.0;
        for pixel in 0..GRID * GRID {
            let [x, y] = [at(pixel % GRID) * radius.x, at(pixel / GRID) * radius.y];
            let value = f64::from(filter.evaluate(Vec2::new(x as f32, y as f32)));
            for (sum, k) in exact.iter_mut().zip(waves) {
                *sum += value * wave(k, x, y);
            }
        }
        let mut stream = Stream::from_seed(index as u64);
        for _ in 0..SAMPLES {
            let [u, v, lobe] = [(); 3].map(|()| stream.next_f32());
            let sample = filter.sample([u, v], || lobe);
            for (sum, k) in sampled.iter_mut().zip(waves) {
                *sum += f64::from(sample.weight) * wave(k, sample.offset.x.into(), sample.offset.y.into());
            }
        }
        for i in 0..5 {
            let [got, expected] = [sampled[i] / SAMPLES as f64, exact[i] / exact[0]];
            assert!((got - expected).abs() < 6e-3, "filter {index} wave {:?}: {got} for {expected}", waves[i]);
        }
    }
}

#[test]
fn parameters_come_from_the_scene_and_must_make_sense() {
    let build = |kind: &str, params: Vec<(&str, &str, ParamValue)>| {
        PixelFilter::build(&entity(kind, params), &mut Warnings::default())
    };
    let float = |name: &'static str, value: f32| vec![(name, "float", ParamValue::Float(vec![value]))];
    let default = build("mitchell", vec![]).expect("a filter");
    assert!(matches!(default, PixelFilter::Mitchell { radius, .. } if radius == Vec2::splat(2.0)));
    let wide = build("sinc", float("xradius", 6.0)).expect("a filter");
    assert_eq!(wide.radius(), Vec2::new(6.0, 4.0));
    assert!(build("sinc", float("tau", 0.0)).is_err());
    // With C = 40 the lobes take away all that the middle adds.
    assert!(build("mitchell", float("C", 40.0)).is_err());
}
