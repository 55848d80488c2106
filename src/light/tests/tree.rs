//! The light hierarchy: its probabilities, that it leaves no light out, its shape, size and speed.

use super::*;
use crate::light::selector::tree::Tree;
use crate::light::tree::build::{Leaf, MAX_DEPTH};
use crate::light::tree::cut::MAX_CUT;
use crate::light::tree::split::Splitting;
use crate::light::tree::{Below, Cut, LightBounds, LightTree, ROOT};
use crate::math::warp::uniform_sphere;
use crate::scene::Warnings;

/// Points in a cube of side 20 around the origin.
fn place(stream: &mut Stream) -> Vec3 {
    (Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32()) - 0.5) * 20.0
}

/// Lights of all types, `count` of each of the finite ones, strengths over six orders of magnitude.
fn many(count: usize, seed: u64) -> (Geometry, Lights) {
    let mut stream = Stream::from_seed(seed);
    let (mut geometry, mut lights) = (Geometry::default(), Lights::default());
    for i in 0..count {
        let (a, b) = (uniform_sphere(pair(&mut stream)), uniform_sphere(pair(&mut stream)));
        let p = place(&mut stream);
        let kind = match i % 4 {
            0 => sphere(p, 0.05 + 0.5 * stream.next_f32()),
            1 => quad(p, a, b),
            2 => patch([p, p + a, p + b, p + a + b + a.cross(b) * 0.4]),
            _ => disk(
                Affine3A::from_translation(p) * Affine3A::from_quat(glam::Quat::from_rotation_arc(Vec3::Z, a)),
                0.5,
                0.0,
                6.3,
            ),
        };
        let radiance = Rgb::splat(strength(&mut stream));
        push(&mut geometry, &mut lights, kind, radiance, i % 3 == 0, i % 2 == 0);
    }
    for i in 0..count {
        let intensity = Rgb::splat(if i == 3 { 0.0 } else { strength(&mut stream) });
        lights.add_point(PointLight { p: place(&mut stream), intensity });
        let (p, axis, cos_end) = (place(&mut stream), uniform_sphere(pair(&mut stream)), stream.next_f32() * 2.0 - 1.0);
        let cos_start = cos_end + (1.0 - cos_end) * stream.next_f32();
        lights.add_spot(SpotLight { p, axis, intensity: Rgb::splat(strength(&mut stream)), cos_start, cos_end });
    }
    (geometry, lights)
}

fn strength(stream: &mut Stream) -> f32 {
    10.0f32.powf(6.0 * stream.next_f32() - 3.0)
}

fn receiver(stream: &mut Stream) -> Receiver {
    let (p, ns) = (place(stream) * 1.3, uniform_sphere(pair(stream)));
    match (stream.next_f32() * 3.0) as u32 {
        0 => Receiver::Medium { p },
        1 => Receiver::Surface { p, ns, two_sided: true },
        _ => Receiver::Surface { p, ns, two_sided: false },
    }
}

fn from_infinity(lights: &mut Lights) {
    lights.add_distant(DistantLight { wi: Vec3::new(0.6, 0.0, 0.8), irradiance: Rgb::splat(0.3) });
    lights.add_infinite(InfiniteLight::Constant(Rgb::splat(0.1)));
}

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
            let sum: f64 = lights.ids().map(|id| f64::from(selector.pmf(id, &scratch))).sum();
            assert!((sum - f64::from(draws)).abs() < 1e-5 * f64::from(draws.max(1)), "{sum} {draws}");
            for draw in 0..draws {
                let u = selector::choice(stream.next_f32(), stream.next_f32());
                let (id, pmf, left) = selector.sample(draw, u, &scratch).expect("there are lights");
                assert_eq!(pmf, selector.pmf(id, &scratch), "{id:?} to the bit");
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
                    let (id, _, left) = selector.sample(draw, u, &scratch).expect("there are lights");
                    counts[id.0 as usize] += 1.0;
                    rest.add(left);
                }
            }
            rest.must_be(0.5, "what is left of u");
            let expected: Vec<f64> = lights.ids().map(|id| 1e5 * f64::from(selector.pmf(id, &scratch))).collect();
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
                    let (id, pmf, left) = selector.sample(draw, u, &scratch).expect("there are lights");
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

/// Every light below `node`.
fn lights_below(tree: &LightTree, node: u32, visit: &mut dyn FnMut(u32)) {
    match tree.below(node) {
        Below::Light(id) => visit(id),
        Below::Nodes(children) => children.into_iter().for_each(|child| lights_below(tree, child, visit)),
    }
}

#[test]
fn what_contributes_is_important_all_the_way_down() {
    let mut lit = 0;
    // At the usual scale, at extremes of it, and far from the origin.
    for (seed, (scale, offset)) in [(1.0, 0.0), (1e-6, 0.0), (1e16, 0.0), (1.0, 1e5)].into_iter().enumerate() {
        let (_, usual) = many(40, 40 + seed as u64);
        let mut lights = Lights::default();
        // Emission of a light seen from anywhere is what its bounds must hold: points and spots moved and scaled.
        for id in usual.ids() {
            let moved = |p: Vec3| p * scale + offset;
            match usual.get(id) {
                LightRef::Point(light) => lights.add_point(PointLight { p: moved(light.p), ..*light }),
                LightRef::Spot(light) => lights.add_spot(SpotLight { p: moved(light.p), ..*light }),
                _ => continue,
            };
        }
        let tree = LightTree::of(&lights).expect("some shine");
        let mut stream = Stream::from_seed(50 + seed as u64);
        for _ in 0..300 {
            let at = receiver(&mut stream);
            let (p, ns, two_sided) = match at {
                Receiver::Medium { p } => (p, None, false),
                Receiver::Surface { p, ns, two_sided } => (p, Some(ns), two_sided),
            };
            let p = p * scale + offset;
            let at = ns.map_or(Receiver::Medium { p }, |ns| Receiver::Surface { p, ns, two_sided });
            lit += check_path(&Geometry::default(), &lights, &tree, &at, &mut stream);
        }
    }
    let (geometry, lights) = many(60, 60);
    let tree = LightTree::of(&lights).expect("some shine");
    let mut stream = Stream::from_seed(61);
    for _ in 0..300 {
        lit += check_path(&geometry, &lights, &tree, &receiver(&mut stream), &mut stream);
    }
    assert!(lit > 50_000, "{lit}");
}

/// The nodes from the root to the leaf of light `id`.
fn path(tree: &LightTree, id: LightId) -> Vec<u32> {
    let mut path = vec![ROOT];
    let mut turns = tree.trail(id.0).expect("it shines");
    while let Below::Nodes(children) = tree.below(path[path.len() - 1]) {
        path.push(children[(turns & 1) as usize]);
        turns >>= 1;
    }
    path
}

/// All nodes above each light that contributes at `receiver` must be important; returns how many lights do.
fn check_path(geometry: &Geometry, lights: &Lights, tree: &LightTree, at: &Receiver, stream: &mut Stream) -> usize {
    let mut lit = 0;
    for id in lights.ids() {
        let contributes = (0..4).any(|_| {
            let s = lights.sample(geometry, id, at.p(), 0.0, pair(stream), f64::from(stream.next_f32()));
            s.is_some_and(|s| match *at {
                Receiver::Medium { .. } => true,
                Receiver::Surface { ns, two_sided: false, .. } => ns.dot(s.wi) > 0.0,
                Receiver::Surface { ns, .. } => ns.dot(s.wi) != 0.0,
            })
        });
        if contributes {
            lit += 1;
            let trail = tree.trail(id.0).expect("it shines");
            for node in path(tree, id) {
                let importance = tree.node(node).importance(at);
                assert!(importance > 0.0 && importance.is_finite(), "{id:?} {:?} at {at:?}", lights.get(id));
            }
            assert!(tree.pmf(ROOT, 0, trail, at) > 0.0);
        }
    }
    lit
}

/// Depth of the tree; fails where the sphere of a node does not hold the leaves below or its energy is not theirs.
fn check_shape(tree: &LightTree, node: u32, above: &mut Vec<u32>) -> usize {
    match tree.below(node) {
        Below::Light(_) => {
            let leaf = tree.node(node);
            for parent in above.iter().map(|&parent| tree.node(parent)) {
                let reach = parent.centre.as_dvec3().distance(leaf.centre.as_dvec3()) + f64::from(leaf.radius);
                assert!(reach <= f64::from(parent.radius) * (1.0 + 1e-5), "{reach} {}", parent.radius);
                assert!(leaf.energy <= parent.energy && leaf.energy > 0.0);
            }
            above.len()
        }
        Below::Nodes(children) => {
            above.push(node);
            let depth = children.map(|child| check_shape(tree, child, above)).into_iter().max();
            above.pop();
            depth.unwrap_or(0)
        }
    }
}

#[test]
fn a_node_holds_what_is_below() {
    let (_, lights) = many(500, 70);
    let tree = LightTree::of(&lights).expect("some shine");
    let depth = check_shape(&tree, ROOT, &mut vec![]);
    assert!(depth < 30, "{depth}");
    let mut seen = vec![0; lights.len()];
    lights_below(&tree, ROOT, &mut |id| seen[id as usize] += 1);
    for id in lights.ids() {
        assert_eq!(seen[id.0 as usize], usize::from(!lights.is_dark(id)));
    }
}

#[test]
fn lights_at_one_spot_make_a_balanced_tree() {
    let mut lights = Lights::default();
    const COUNT: usize = 1 << 17;
    let mut stream = Stream::from_seed(80);
    for i in 0..COUNT {
        let p = Vec3::new(1.0, 2.0, 3.0);
        if i % 2 == 0 {
            lights.add_point(PointLight { p, intensity: Rgb::WHITE });
        } else {
            let axis = uniform_sphere(pair(&mut stream));
            lights.add_spot(SpotLight { p, axis, intensity: Rgb::WHITE, cos_start: 0.9, cos_end: 0.8 });
        }
    }
    let tree = LightTree::of(&lights).expect("they shine");
    assert_eq!(check_shape(&tree, ROOT, &mut vec![]), COUNT.ilog2() as usize);
    // From the spot itself and from nearby.
    for at in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 3.5)] {
        let at = Receiver::Medium { p: at };
        let sum: f64 = lights.ids().map(|id| f64::from(tree.pmf(ROOT, 0, tree.trail(id.0).unwrap_or(0), &at))).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }
}

#[test]
fn depth_is_bounded_whatever_the_lights() {
    // Each light outshines all before it and is farther away by as much: the heuristic peels them off one by one.
    let mut lights = Lights::default();
    for i in 0..5000 {
        let x = 1.01f32.powi(i);
        lights.add_point(PointLight { p: Vec3::X * x.min(1e18), intensity: Rgb::splat(x.min(1e18)) });
    }
    let tree = LightTree::of(&lights).expect("they shine");
    let depth = check_shape(&tree, ROOT, &mut vec![]);
    assert!(depth <= MAX_DEPTH as usize, "{depth}");
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
        let at = Receiver::Medium { p: place(&mut stream) };
        let pmf = |id: LightId| tree.pmf(ROOT, 0, tree.trail(id.0).expect("it shines"), &at);
        let sum: f64 = lights.ids().map(|id| f64::from(pmf(id))).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        // Every one can be drawn with 48 random bits, those at the ends of the world too.
        let least = lights.ids().map(pmf).fold(1.0, f32::min);
        assert!(least > 1e-14, "{least}");
    }
}

#[test]
fn the_tree_is_the_same_with_any_number_of_threads() {
    let mut stream = Stream::from_seed(100);
    let leaves: Vec<Leaf> =
        (0..50_000).map(|i| Leaf::new(i, LightBounds::of_point(place(&mut stream), strength(&mut stream)))).collect();
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| LightTree::new(leaves.clone(), leaves.len()))
    };
    assert!(build(1) == build(2) && build(1) == build(5));
}

#[test]
fn splitting_goes_from_one_light_to_all() {
    let (_, lights) = many(20, 110);
    let count = lights.ids().filter(|&id| !lights.is_dark(id)).count();
    assert!((32..MAX_CUT).contains(&count));
    let tree = LightTree::of(&lights).expect("some shine");
    let mut stream = Stream::from_seed(111);
    let (mut cut, mut mean) = (Cut::default(), [0.0; 11]);
    for _ in 0..200 {
        let at = receiver(&mut stream);
        for (i, mean) in mean.iter_mut().enumerate() {
            cut.make(&tree, &at, Splitting::new(0.1 * i as f32));
            *mean += f64::from(cut.draws()) / 200.0;
            if i == 0 {
                assert!(cut.draws() <= 1);
            }
            // Dropping nodes that cannot contribute makes some cuts shorter; those at 1 hold exactly the lights that can.
            if i == 10 {
                let can = lights.ids().filter(|id| {
                    tree.trail(id.0).is_some()
                        && path(&tree, *id).into_iter().all(|node| tree.node(node).importance(&at) > 0.0)
                });
                assert_eq!(cut.draws() as usize, can.count());
                assert!(cut.nodes().iter().all(|node| matches!(tree.below(node.node), Below::Light(_))));
            }
        }
    }
    println!("draws by splitting, in tenths: {mean:.2?}");
    assert!(mean[5] > 1.1 && mean[10] > 10.0 && mean.is_sorted());
    // Of more lights than a cut may have nodes, as many as it may.
    let (_, lights) = many(200, 112);
    let tree = LightTree::of(&lights).expect("some shine");
    cut.make(&tree, &Receiver::Medium { p: Vec3::ZERO }, Splitting::new(1.0));
    assert_eq!(cut.draws() as usize, MAX_CUT);
}

#[test]
fn a_million_lights_take_little_memory_and_time() {
    const COUNT: usize = 1_000_000;
    let mut stream = Stream::from_seed(120);
    let mut lights = Lights::default();
    for _ in 0..COUNT {
        lights.add_point(PointLight { p: place(&mut stream), intensity: Rgb::splat(strength(&mut stream)) });
    }
    let start = std::time::Instant::now();
    let tree = Tree::new(&lights);
    let seconds = start.elapsed().as_secs_f64();
    println!("{COUNT} lights: {seconds:.2} s, {:.1} bytes a light", tree.memory() as f64 / COUNT as f64);
    assert!(tree.memory() <= 80 * COUNT, "{}", tree.memory());
    assert!(seconds < 30.0, "{seconds} s");
}

/// Prints figures: `cargo test --lib light::tests::tree::figures -- --ignored --nocapture`.
#[test]
#[ignore = "prints figures, takes a minute"]
fn figures() {
    for count in [1_000, 1_000_000, 5_000_000] {
        let mut stream = Stream::from_seed(130);
        let mut lights = Lights::default();
        for i in 0..count {
            let (p, axis) = (place(&mut stream), uniform_sphere(pair(&mut stream)));
            let intensity = Rgb::splat(strength(&mut stream));
            if i % 2 == 0 {
                lights.add_point(PointLight { p, intensity });
            } else {
                lights.add_spot(SpotLight { p, axis, intensity, cos_start: 0.8, cos_end: 0.5 });
            }
        }
        let start = std::time::Instant::now();
        let tree = LightTree::of(&lights).expect("they shine");
        let seconds = start.elapsed().as_secs_f64();
        let depth = check_shape(&tree, ROOT, &mut vec![]);
        let bytes = tree.memory() as f64 / f64::from(count);
        println!("{count} lights: built in {seconds:.2} s, {bytes:.1} bytes a light, {depth} deep");
        const SAMPLES: u32 = 300_000;
        let start = std::time::Instant::now();
        let mut sum = 0.0;
        for _ in 0..SAMPLES {
            let u = selector::choice(stream.next_f32(), stream.next_f32());
            sum += tree.sample(ROOT, &receiver(&mut stream), u).1;
        }
        let ns = |start: std::time::Instant| start.elapsed().as_secs_f64() * 1e9 / f64::from(SAMPLES);
        println!("  {:.0} ns a sample from the root ({sum:.0})", ns(start));
        let mut cut = Cut::default();
        let start = std::time::Instant::now();
        let mut nodes = 0;
        for _ in 0..SAMPLES {
            cut.make(&tree, &receiver(&mut stream), Splitting::new(0.0));
            nodes += cut.nodes().len();
        }
        println!("  {:.0} ns a cut of {:.1} nodes", ns(start), nodes as f64 / f64::from(SAMPLES));
    }
}
