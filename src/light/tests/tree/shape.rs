//! The light tree itself: it leaves no light out, is no deeper than it may be, always the same, small and soon built.

use super::*;
use crate::light::selector::tree::Tree;
use crate::light::tree::MOST_IN_LEAF;
use crate::light::tree::build::MAX_DEPTH;

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
                Receiver::Medium { p, .. } => (p, None, false),
                Receiver::Surface { p, ns, two_sided, .. } => (p, Some(ns), two_sided),
            };
            let p = p * scale + offset;
            let at = ns.map_or(Receiver::medium(p), |ns| Receiver::surface(p, ns, two_sided));
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
            let place = tree.place(id.0).expect("it shines");
            for cluster in path(tree, id) {
                let importance = tree.importance(lights, &cluster, at);
                assert!(importance > 0.0 && importance.is_finite(), "{id:?} {:?} at {at:?}", lights.get(id));
            }
            assert!(tree.pmf(lights, &tree.root(), place, at) > 0.0);
        }
    }
    lit
}

#[test]
fn a_node_holds_what_is_below() {
    let (_, lights) = many(500, 70);
    let tree = LightTree::of(&lights).expect("some shine");
    let depth = check_shape(&lights, &tree, tree.root(), &mut vec![]);
    assert!(depth < 30, "{depth}");
    for id in lights.ids() {
        let place = tree.place(id.0);
        assert_eq!(place.is_some(), !lights.is_dark(id));
        if place.is_some() {
            let path = path(&tree, id);
            assert_eq!(tree.light(&path[path.len() - 1]), Some(id.0));
        }
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
    assert_eq!(check_shape(&lights, &tree, tree.root(), &mut vec![]), (COUNT / MOST_IN_LEAF).ilog2() as usize);
    // From the spot itself and from nearby.
    for at in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 3.5)] {
        let at = Receiver::medium(at);
        let sum: f64 =
            lights.ids().map(|id| f64::from(tree.pmf(&lights, &tree.root(), tree.place(id.0).unwrap_or(0), &at))).sum();
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
    let depth = check_shape(&lights, &tree, tree.root(), &mut vec![]);
    assert!(depth <= MAX_DEPTH as usize, "{depth}");
}

#[test]
fn the_tree_is_the_same_with_any_number_of_threads() {
    let mut stream = Stream::from_seed(100);
    let mut lights = Lights::default();
    for _ in 0..50_000 {
        lights.add_point(PointLight { p: place(&mut stream), intensity: Rgb::splat(strength(&mut stream)) });
    }
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| LightTree::of(&lights))
    };
    assert!(build(1) == build(2) && build(1) == build(5));
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
    assert!(tree.memory() <= 32 * COUNT, "{}", tree.memory());
    assert!(seconds < 30.0, "{seconds} s");
}
