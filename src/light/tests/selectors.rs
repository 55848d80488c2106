//! Selectors: frequencies against probabilities, equal means, memory; and the contribution estimate they rest on.

use super::*;
use crate::math::warp::uniform_sphere;
use crate::scene::Warnings;

/// Lights of every type around the origin, one of them dark.
fn mixed() -> (Geometry, Lights) {
    let (mut geometry, mut lights) = one(quad(Vec3::new(-1.0, -1.0, 3.0), Vec3::Y, Vec3::X), false, false);
    push(&mut geometry, &mut lights, sphere(Vec3::new(2.0, 0.0, 0.2), 0.5), Rgb::splat(3.0), false, false);
    push(
        &mut geometry,
        &mut lights,
        disk(Affine3A::from_translation(Vec3::Z * -4.0), 1.0, 0.0, 6.3),
        Rgb::WHITE,
        true,
        false,
    );
    lights.add_point(PointLight { p: Vec3::new(0.0, 1.0, 1.0), intensity: Rgb::splat(0.5) });
    lights.add_point(PointLight { p: Vec3::ONE, intensity: Rgb::BLACK });
    let axis = Vec3::new(-1.0, 0.0, -1.0).normalize();
    lights.add_spot(SpotLight {
        p: Vec3::new(1.5, 0.1, 1.5),
        axis,
        intensity: Rgb::splat(2.0),
        cos_start: 0.99,
        cos_end: 0.9,
    });
    lights.add_distant(DistantLight { wi: Vec3::new(0.6, 0.0, 0.8), irradiance: Rgb::splat(0.3) });
    lights.add_infinite(InfiniteLight::Constant(Rgb::splat(0.1)));
    lights.set_scene_bounds(Vec3::splat(-5.0), Vec3::splat(5.0));
    (geometry, lights)
}

const RECEIVERS: [Receiver; 3] = [
    Receiver::Surface { p: Vec3::ZERO, ns: Vec3::Z, two_sided: false, links: LinkSet::ORDINARY },
    Receiver::Surface { p: Vec3::new(0.1, 0.2, 0.3), ns: Vec3::Y, two_sided: true, links: LinkSet::ORDINARY },
    Receiver::Medium { p: Vec3::new(-0.5, 0.2, 0.1), links: LinkSet::ORDINARY },
];

const KINDS: [SelectorKind; 4] =
    [SelectorKind::Uniform, SelectorKind::Power, SelectorKind::Optimal, SelectorKind::Tree];

#[test]
fn lights_are_chosen_as_often_as_their_probability_says() {
    let (_, lights) = mixed();
    for (k, kind) in KINDS.into_iter().enumerate() {
        // One draw a vertex; several are tested with the tree.
        let selector = LightSelector::build(kind, &lights, &mut Warnings::default()).with_splitting(0.0);
        let mut scratch = SelectorScratch::default();
        for (r, receiver) in RECEIVERS.iter().enumerate() {
            selector.prepare(&lights, receiver, &mut scratch);
            let mut stream = Stream::from_seed((k * 10 + r) as u64);
            let mut counts = vec![0.0; lights.len()];
            let mut rest = Mean::default();
            for _ in 0..100_000 {
                let u = selector::choice(stream.next_f32(), stream.next_f32());
                let (id, pmf, left) = selector.sample(&lights, 0, u, &scratch).expect("there are lights");
                assert_eq!(pmf, selector.pmf(&lights, id, &scratch));
                assert!((0.0..1.0).contains(&left));
                counts[id.0 as usize] += 1.0;
                rest.add(left);
            }
            rest.must_be(0.5, "what is left of u");
            let pmf: Vec<f64> = lights.ids().map(|id| f64::from(selector.pmf(&lights, id, &scratch))).collect();
            assert!((pmf.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            assert_eq!(pmf[4], 0.0, "the dark light");
            let expected: Vec<f64> = pmf.iter().map(|p| p * 1e5).collect();
            chi_squared(&counts, &expected, &format!("{kind:?} at receiver {r}"));
        }
    }
}

#[test]
fn every_selector_gives_the_same_light() {
    let (geometry, lights) = mixed();
    for (r, receiver) in RECEIVERS.iter().enumerate() {
        let cosine = |wi: Vec3| match *receiver {
            Receiver::Surface { ns, two_sided: false, .. } => ns.dot(wi).max(0.0),
            Receiver::Surface { ns, .. } => ns.dot(wi).abs(),
            Receiver::Medium { .. } => 1.0,
        };
        let mut stream = Stream::from_seed(100 + r as u64);
        let mut estimate = |id: LightId, part: f64| {
            let s = lights.sample(&geometry, id, receiver.p(), 0.0, pair(&mut stream), part);
            s.map_or(0.0, |s| f64::from(s.radiance[0] * cosine(s.wi) / s.pdf))
        };
        let (mut expected, mut variance) = (0.0, 0.0);
        let mut part = Stream::from_seed(200);
        for id in lights.ids() {
            let mut mean = Mean::default();
            (0..100_000).for_each(|_| mean.add(estimate(id, f64::from(part.next_f32()))));
            expected += mean.mean;
            variance += mean.error().powi(2);
        }
        for kind in KINDS {
            // One draw a vertex; several are tested with the tree.
            let selector = LightSelector::build(kind, &lights, &mut Warnings::default()).with_splitting(0.0);
            let mut scratch = SelectorScratch::default();
            selector.prepare(&lights, receiver, &mut scratch);
            let mut mean = Mean::default();
            for _ in 0..400_000 {
                let u = selector::choice(part.next_f32(), part.next_f32());
                let (id, pmf, left) = selector.sample(&lights, 0, u, &scratch).expect("there are lights");
                mean.add(estimate(id, left) / f64::from(pmf));
            }
            let error = mean.error().hypot(variance.sqrt());
            assert!((mean.mean - expected).abs() < 4.5 * error, "{kind:?} {r}: {} {expected} ± {error}", mean.mean);
            assert!(error < 0.05 * expected);
        }
    }
}

#[test]
fn what_contributes_has_a_positive_contribution() {
    let mut stream = Stream::from_seed(300);
    let mut lit = 0;
    for round in 0..400 {
        let centre = uniform_sphere(pair(&mut stream)) * stream.next_f32() * 3.0;
        let (a, b) = (uniform_sphere(pair(&mut stream)), uniform_sphere(pair(&mut stream)) * 2.0);
        let two_sided = round % 3 == 0;
        let kind = match round % 4 {
            0 => sphere(centre, 0.1 + stream.next_f32()),
            1 => quad(centre, a, b),
            2 => patch([centre, centre + a, centre + b, centre + a + b + a.cross(b) * 0.7]),
            _ => disk(
                Affine3A::from_translation(centre) * Affine3A::from_quat(glam::Quat::from_rotation_arc(Vec3::Z, a)),
                1.0,
                0.0,
                6.3,
            ),
        };
        let (geometry, lights) = one(kind, two_sided, round % 2 == 0);
        for _ in 0..50 {
            let (p, ns) = (uniform_sphere(pair(&mut stream)) * 1.5, uniform_sphere(pair(&mut stream)));
            let contribution = lights
                .contribution(LightId(0), &Receiver::Surface { p, ns, two_sided: false, links: LinkSet::ORDINARY });
            let fluence = lights.contribution(LightId(0), &Receiver::Medium { p, links: LinkSet::ORDINARY });
            assert!(contribution.is_finite() && fluence.is_finite());
            for _ in 0..20 {
                let u = pair(&mut stream);
                let Some(s) = lights.sample(&geometry, LightId(0), p, 0.0, u, f64::from(stream.next_f32())) else {
                    continue;
                };
                assert!(fluence > 0.0, "round {round}");
                if s.wi.dot(ns) > 1e-4 {
                    assert!(contribution > 0.0, "round {round}");
                    lit += 1;
                }
            }
        }
    }
    assert!(lit > 50_000, "{lit}");
}

#[test]
fn far_away_the_contribution_is_the_irradiance() {
    for (kind, normal) in
        [(sphere(Vec3::Z * 100.0, 1.0), Vec3::Z), (quad(Vec3::new(10.0, 0.0, 100.0), Vec3::Y, Vec3::X), Vec3::Z)]
    {
        let (geometry, lights) = one(kind, false, false);
        let exact = irradiance(&geometry, &lights, 0, Vec3::ZERO, normal, 20_000, 400).mean as f32;
        let receiver = Receiver::Surface { p: Vec3::ZERO, ns: normal, two_sided: false, links: LinkSet::ORDINARY };
        let ratio = lights.contribution(LightId(0), &receiver) / exact;
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}

#[test]
fn one_light_or_none_builds_nothing() {
    let mut lights = Lights::default();
    let mut warnings = Warnings::default();
    let scratch = SelectorScratch::default();
    let none = LightSelector::build(SelectorKind::Optimal, &lights, &mut warnings);
    assert!(matches!(none, LightSelector::None) && none.sample(&lights, 0, 0.5, &scratch).is_none());
    lights.add_point(PointLight { p: Vec3::ZERO, intensity: Rgb::BLACK });
    let only = lights.add_point(PointLight { p: Vec3::ZERO, intensity: Rgb::WHITE });
    for kind in KINDS {
        let single = LightSelector::build(kind, &lights, &mut warnings);
        assert_eq!(single.sample(&lights, 0, 0.25, &scratch), Some((only, 1.0, 0.25)));
        assert_eq!(
            (single.memory(), single.pmf(&lights, only, &scratch), single.pmf(&lights, LightId(0), &scratch)),
            (0, 1.0, 0.0)
        );
    }
    assert_eq!(warnings.list().len(), 1, "the dark light is named once");
}

#[test]
fn millions_of_lights_stay_small() {
    const COUNT: usize = 1_000_000;
    let mut lights = Lights::default();
    for i in 0..COUNT {
        lights.add_point(PointLight { p: Vec3::splat(i as f32), intensity: Rgb::splat(1.0 + (i % 7) as f32) });
    }
    // Vectors grown by doubling may hold twice what they need; a build from a file shrinks them.
    assert!(lights.memory() <= 2 * 28 * COUNT + COUNT, "{}", lights.memory());
    let uniform = LightSelector::build(SelectorKind::Uniform, &lights, &mut Warnings::default());
    assert_eq!(uniform.memory(), 0);
    let power = LightSelector::build(SelectorKind::Power, &lights, &mut Warnings::default());
    assert_eq!(power.memory(), 12 * COUNT);
    // 24 bits alone would leave some lights out of reach and choose others twice as often: χ² over residues of the id.
    let scratch = SelectorScratch::default();
    let mut stream = Stream::from_seed(500);
    for selector in [uniform, power] {
        let mut counts = vec![0.0; 1009];
        let mut expected = vec![0.0; 1009];
        lights
            .ids()
            .for_each(|id| expected[id.0 as usize % 1009] += 2e6 * f64::from(selector.pmf(&lights, id, &scratch)));
        for _ in 0..2_000_000 {
            let u = selector::choice(stream.next_f32(), stream.next_f32());
            let (id, ..) = selector.sample(&lights, 0, u, &scratch).expect("there are lights");
            counts[id.0 as usize % 1009] += 1.0;
        }
        chi_squared(&counts, &expected, "a million lights");
    }
}
