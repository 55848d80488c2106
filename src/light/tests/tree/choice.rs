//! Choices from the light tree: frequencies against probabilities, equal means, how many lights are drawn.

use super::*;
use crate::light::tree::cut::MAX_CUT;
use crate::light::tree::split::Splitting;
use crate::light::tree::{Cut, MOST_IN_LEAF};
use crate::scene::Warnings;

fn selector(lights: &Lights, splitting: f32) -> LightSelector {
    LightSelector::build(SelectorKind::Tree, lights, &mut Warnings::default()).with_splitting(splitting)
}

#[test]
fn expected_choices_add_up_to_the_number_of_draws() {
    for (seed, (infinite, splitting)) in
        [(false, 0.0), (true, 0.0), (false, 0.8), (true, 0.9), (true, 1.0)].into_iter().enumerate()
    {
        let (_, mut lights) = many(100, seed as u64);
        if infinite {
            from_infinity(&mut lights);
        }
        let selector = selector(&lights, splitting);
        let (mut stream, mut scratch) = (Stream::from_seed(10 + seed as u64), SelectorScratch::default());
        let mut most = 0;
        for _ in 0..300 {
            selector.prepare(&lights, &receiver(&mut stream), &mut scratch);
            let draws = selector.draws(&scratch);
            let sum: f64 = lights.ids().map(|id| f64::from(selector.pmf(&lights, id, &scratch))).sum();
            assert!((sum - f64::from(draws)).abs() < 1e-5 * f64::from(draws.max(1)), "{sum} {draws}");
            for draw in 0..draws {
                let u = selector::choice(stream.next_f32(), stream.next_f32());
                let (id, pmf, left) = selector.sample(&lights, draw, u, &scratch).expect("there are lights");
                assert_eq!(pmf, selector.pmf(&lights, id, &scratch), "{id:?} to the bit");
                assert!((0.0..1.0).contains(&left) && !lights.is_dark(id));
            }
            most = most.max(draws as usize);
        }
        assert_eq!(most == 1, splitting == 0.0, "{most}");
    }
}

#[test]
fn lights_are_chosen_as_often_as_the_tree_says() {
    let (_, mut lights) = many(40, 20);
    from_infinity(&mut lights);
    for (k, splitting) in [0.0, 0.9].into_iter().enumerate() {
        let selector = selector(&lights, splitting);
        let (mut stream, mut scratch) = (Stream::from_seed(21), SelectorScratch::default());
        for r in 0..6 {
            selector.prepare(&lights, &receiver(&mut stream), &mut scratch);
            let mut counts = vec![0.0; lights.len()];
            let mut rest = Mean::default();
            for _ in 0..100_000 {
                for draw in 0..selector.draws(&scratch) {
                    let u = selector::choice(stream.next_f32(), stream.next_f32());
                    let (id, _, left) = selector.sample(&lights, draw, u, &scratch).expect("there are lights");
                    counts[id.0 as usize] += 1.0;
                    rest.add(left);
                }
            }
            rest.must_be(0.5, "what is left of u");
            let expected: Vec<f64> =
                lights.ids().map(|id| 1e5 * f64::from(selector.pmf(&lights, id, &scratch))).collect();
            chi_squared(&counts, &expected, &format!("splitting {k}, receiver {r}"));
        }
    }
}

#[test]
fn the_tree_gives_the_light_that_all_lights_give() {
    let (geometry, mut lights) = many(12, 30);
    from_infinity(&mut lights);
    let mut stream = Stream::from_seed(31);
    for r in 0..4 {
        let receiver = receiver(&mut stream);
        let cosine = |wi: Vec3| match receiver {
            Receiver::Surface { ns, two_sided: false, .. } => ns.dot(wi).max(0.0),
            Receiver::Surface { ns, .. } => ns.dot(wi).abs(),
            Receiver::Medium { .. } => 1.0,
        };
        let mut estimate = |id: LightId, part: f64| {
            let s = lights.sample(&geometry, id, receiver.p(), 0.0, pair(&mut stream), part);
            s.map_or(0.0, |s| f64::from(s.radiance[0] * cosine(s.wi) / s.pdf))
        };
        let mut part = Stream::from_seed(32);
        let (mut expected, mut variance) = (0.0, 0.0);
        for id in lights.ids() {
            let mut mean = Mean::default();
            (0..20_000).for_each(|_| mean.add(estimate(id, f64::from(part.next_f32()))));
            expected += mean.mean;
            variance += mean.error().powi(2);
        }
        for splitting in [0.0, 0.85, 1.0] {
            let selector = selector(&lights, splitting);
            let mut scratch = SelectorScratch::default();
            selector.prepare(&lights, &receiver, &mut scratch);
            let mut mean = Mean::default();
            for _ in 0..100_000 {
                let sum = (0..selector.draws(&scratch)).map(|draw| {
                    let u = selector::choice(part.next_f32(), part.next_f32());
                    let (id, pmf, left) = selector.sample(&lights, draw, u, &scratch).expect("there are lights");
                    estimate(id, left) / f64::from(pmf)
                });
                mean.add(sum.sum());
            }
            let error = mean.error().hypot(variance.sqrt());
            assert!((mean.mean - expected).abs() < 4.5 * error, "{r} {splitting}: {} {expected} ± {error}", mean.mean);
            assert!(error < 0.02 * expected, "{error} of {expected}");
        }
    }
}

#[test]
fn dim_lights_beside_suns_stay_within_reach() {
    let mut lights = Lights::default();
    let mut stream = Stream::from_seed(90);
    for i in 0..200 {
        let intensity = Rgb::splat(if i % 2 == 0 { 1e-12 } else { 1e12 });
        lights.add_point(PointLight { p: place(&mut stream), intensity });
    }
    lights.add_point(PointLight { p: Vec3::splat(1e18), intensity: Rgb::splat(1e-12) });
    lights.add_point(PointLight { p: Vec3::splat(-1e18), intensity: Rgb::splat(f32::MAX) });
    let tree = LightTree::of(&lights).expect("they shine");
    for _ in 0..100 {
        let at = Receiver::medium(place(&mut stream));
        let pmf = |id: LightId| tree.pmf(&lights, &tree.root(), tree.place(id.0).expect("it shines"), &at);
        let sum: f64 = lights.ids().map(|id| f64::from(pmf(id))).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        // Every one can be drawn with 48 random bits, those at the ends of the world too.
        let least = lights.ids().map(pmf).fold(1.0, f32::min);
        assert!(least > 1e-14, "{least}");
    }
}

#[test]
fn splitting_goes_from_one_light_to_all() {
    let (_, lights) = many(18, 110);
    let count = lights.ids().filter(|&id| !lights.is_dark(id)).count();
    assert!((32..MAX_CUT).contains(&count));
    let tree = LightTree::of(&lights).expect("some shine");
    let mut stream = Stream::from_seed(111);
    let (mut cut, mut mean) = (Cut::default(), [0.0; 11]);
    for _ in 0..200 {
        let at = receiver(&mut stream);
        for (i, mean) in mean.iter_mut().enumerate() {
            cut.make(&tree, &lights, &at, Splitting::new(0.1 * i as f32));
            *mean += f64::from(cut.draws()) / 200.0;
            if i == 0 {
                assert!(cut.draws() <= 1);
            }
            // Dropping nodes that cannot contribute makes some cuts shorter; those at 1 hold exactly the lights that can.
            if i == 10 {
                let can = lights.ids().filter(|id| {
                    tree.place(id.0).is_some()
                        && path(&tree, *id).iter().all(|cluster| tree.importance(&lights, cluster, &at) > 0.0)
                });
                assert_eq!(cut.draws() as usize, can.count());
                assert!(cut.nodes().iter().all(|node| node.cluster.count == 1));
            }
        }
    }
    println!("draws by splitting, in tenths: {mean:.2?}");
    assert!(mean[5] > 1.1 && mean[10] > 10.0 && mean.is_sorted());
    // Of more lights than a cut may have nodes, as many as it may.
    let (_, lights) = many(200, 112);
    let tree = LightTree::of(&lights).expect("some shine");
    cut.make(&tree, &lights, &Receiver::medium(Vec3::ZERO), Splitting::new(1.0));
    let draws = cut.draws() as usize;
    assert!(draws <= MAX_CUT && draws + MOST_IN_LEAF > MAX_CUT, "a whole leaf may have no room: {draws}");
}
