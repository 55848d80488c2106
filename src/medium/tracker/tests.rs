//! Each statistical assertion fails by chance with probability 1e-6.

use glam::{DAffine3, DVec3, Vec3};
use std::sync::Arc;

use super::*;
use crate::math::chi2::Moments;
use crate::medium::MediumPoint;
use crate::medium::grid::field::{Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};
use crate::medium::homogeneous::HomogeneousMedium;

fn homogeneous(extinction: Rgb) -> Medium {
    let point = MediumPoint { absorption: extinction, ..MediumPoint::default() };
    Medium::Homogeneous(HomogeneousMedium { point, g: 0.0 })
}

/// Density i at z = i for 0 ≤ i < 17, linear between, over 1 × 1 voxels in x and y; nothing outside 0 ≤ z ≤ 16.
fn ramp(sigma: Rgb) -> Medium {
    let values: Vec<f32> = (0..17).map(|i| i as f32).collect();
    let grid = ScalarGrid::Single(Arc::new(SparseGrid::from_dense([1, 1, 17], |i| values[i], 0.0)));
    let map = IndexMap::new(DAffine3::IDENTITY, None).expect("the identity can be inverted");
    Medium::Grid(Box::new(GridMedium::new(GridMediumParts {
        density: Some(Field { grid, map, scale: 1.0, offset: 0.0 }),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: sigma,
        sigma_s: Rgb::BLACK,
        scale: 1.0,
        emission: None,
        g: 0.0,
        clip: Some((DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 16.0))),
        motion: None,
    })))
}

const ALONG: (Vec3, Vec3) = (Vec3::new(0.0, 0.0, -3.0), Vec3::Z);

/// Mean ratio-tracking estimates of all media together along z from `start` to `end` (as t from z = −3), and the mean number of steps.
fn ratio(media: &[Medium], stretch: [f32; 2], count: u32) -> ([Moments; 3], f64) {
    let active: Vec<MediumId> = (0..media.len() as u32).map(MediumId).collect();
    let mut moments: [Moments; 3] = Default::default();
    let (mut stream, mut steps) = (Stream::from_seed(5), 0);
    for _ in 0..count {
        let (origin, direction) = ALONG;
        let mut flights = Flights::new();
        let mut tracker = Tracker::new(&mut flights, media, &active, origin, direction, stretch, &mut stream);
        let mut result = Transmittance::CLEAR;
        let ray = Ray { origin, direction, t_max: stretch[1], time: 0.0, opacity_seed: 0 };
        result.track(&mut tracker, media, &ray, &mut stream, &mut steps);
        for (moments, value) in moments.iter_mut().zip(result.value.to_array()) {
            moments.add(f64::from(value));
        }
    }
    (moments, steps as f64 / f64::from(count))
}

#[test]
fn ratio_tracking_is_unbiased_for_a_linear_density() {
    // ∫ from z = 2.5 to 13.25 of z dz.
    let depth = (13.25f64.powi(2) - 2.5f64.powi(2)) / 2.0;
    let sigma = Rgb::new(0.002, 0.01, 0.03);
    let (moments, _) = ratio(&[ramp(sigma)], [5.5, 16.25], 400_000);
    for (c, moments) in moments.iter().enumerate() {
        moments.assert_mean("ramp", (-depth * f64::from(sigma.to_array()[c])).exp());
    }
    // So dense that roulette comes in.
    let (moments, _) = ratio(&[ramp(Rgb::splat(0.06))], [5.5, 16.25], 1_000_000);
    moments[0].assert_mean("dense ramp", (-depth * 0.06).exp());
}

#[test]
fn media_together_are_their_sum() {
    let media = [
        ramp(Rgb::new(0.002, 0.004, 0.001)),
        homogeneous(Rgb::new(0.05, 0.02, 0.1)),
        ramp(Rgb::splat(0.002)),
        homogeneous(Rgb::splat(0.01)),
    ];
    let (moments, _) = ratio(&media, [1.0, 19.0], 400_000);
    let expected = [0.004f64, 0.006, 0.003].iter().zip([0.06, 0.03, 0.11]).map(|(a, b)| (-128.0 * a - 18.0 * b).exp());
    for (moments, expected) in moments.iter().zip(expected) {
        moments.assert_mean("sum", expected);
    }
    // The first collisions are those of one medium with the sum of the majorants.
    let media = [homogeneous(Rgb::splat(0.3)), homogeneous(Rgb::splat(0.5))];
    let (mut first, mut share) = (Moments::default(), Moments::default());
    let mut stream = Stream::from_seed(6);
    for _ in 0..100_000 {
        let (mut flights, stretch) = (Flights::new(), [2.0, f32::INFINITY]);
        let both = [MediumId(0), MediumId(1)];
        let mut tracker = Tracker::new(&mut flights, &media, &both, ALONG.0, ALONG.1, stretch, &mut stream);
        let collision = tracker.next(&mut stream).expect("a medium without end is met");
        first.add(f64::from(collision.t) - 2.0);
        share.add(f64::from(u8::from(collision.medium == MediumId(0))));
    }
    first.assert_mean("distance", 1.0 / 0.8);
    share.assert_mean("share", 0.3 / 0.8);
}

#[test]
fn where_there_is_nothing_nothing_is_met() {
    let mut stream = Stream::from_seed(7);
    for medium in [homogeneous(Rgb::BLACK), ramp(Rgb::BLACK), ramp(Rgb::WHITE)] {
        let media = [medium];
        // The ramp lies between z = 0 and 16, its bounds reach two voxels further: neither before nor behind, nor beside, is there
        // anything.
        for (origin, direction) in [
            (Vec3::new(0.0, 0.0, 19.0), Vec3::Z),
            (Vec3::new(5.0, 0.0, -3.0), Vec3::Z),
            (Vec3::new(0.0, 0.0, -3.0), -Vec3::Z),
        ] {
            for end in [1.0, f32::INFINITY] {
                let (mut flights, stretch) = (Flights::new(), [0.0, end]);
                let mut tracker =
                    Tracker::new(&mut flights, &media, &[MediumId(0)], origin, direction, stretch, &mut stream);
                assert!(tracker.next(&mut stream).is_none());
            }
        }
    }
    let media = [homogeneous(Rgb::WHITE)];
    assert!(
        Tracker::new(&mut Flights::new(), &media, &[], ALONG.0, ALONG.1, [0.0, f32::INFINITY], &mut stream)
            .next(&mut stream)
            .is_none()
    );
    assert!(
        Tracker::new(&mut Flights::new(), &media, &[MediumId(0)], ALONG.0, ALONG.1, [2.0, 2.0], &mut stream)
            .next(&mut stream)
            .is_none()
    );
}

#[test]
fn extinctions_of_all_magnitudes_side_by_side() {
    // Channels that differ by 10^18, over stretches that each can see, and over one without end.
    let medium = || [homogeneous(Rgb::new(1e-9, 1.0, 1e9))];
    for (length, expected) in
        [(1e-9f32, [1.0, 1.0, (-1f64).exp()]), (1.0, [1.0, (-1f64).exp(), 0.0]), (1e9, [(-1f64).exp(), 0.0, 0.0])]
    {
        let (moments, steps) = ratio(&medium(), [0.0, length], 100_000);
        for (moments, expected) in moments.iter().zip(expected) {
            if expected == 0.0 || expected == 1.0 {
                assert!((moments.mean() - expected).abs() < 1e-5, "{} at {length}", moments.mean());
            } else {
                moments.assert_mean("channel", expected);
            }
        }
        assert!(steps <= 3.0, "{steps} at {length}");
    }
    let (moments, steps) = ratio(&medium(), [0.0, f32::INFINITY], 1000);
    assert!(moments.iter().all(|m| m.mean() == 0.0) && steps <= 3.0);
    // A channel that is clear passes to infinity, in finitely many steps.
    let (moments, steps) = ratio(&[homogeneous(Rgb::new(0.0, 1.0, 0.5))], [0.0, f32::INFINITY], 1000);
    assert_eq!(moments.map(|m| m.mean()), [1.0, 0.0, 0.0]);
    assert!(steps <= 3.0);
    // A thick medium does not touch a thin one beside it. (Bounds may reach two voxels beyond a grid.)
    let (moments, _) = ratio(&[homogeneous(Rgb::splat(1e-9)), ramp(Rgb::splat(1e9))], [0.0, 0.9], 1000);
    assert_eq!(moments[0].mean(), 1.0);
}

/// Optical depths near 0 are not rounded to multiples of anything that matters: media thinner than 2^-24 are met as often as they should be.
#[test]
fn thin_media_are_met_as_rarely_as_they_should_be() {
    let mut stream = Stream::from_seed(8);
    let (mut near, mut rest) = (0u32, Moments::default());
    for _ in 0..1u32 << 25 {
        let tau = stream.next_exponential();
        if tau < 2f32.powi(-18) {
            near += 1;
            rest.add(f64::from((tau * 2f32.powi(24)).fract()));
        }
    }
    // Binomial with mean 128.
    assert!((f64::from(near) - 128.0).abs() < 4.9 * 128f64.sqrt(), "{near}");
    rest.assert_mean("what is left of the division by 2^-24", 0.5);
}
