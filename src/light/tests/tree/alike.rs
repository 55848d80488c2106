//! Ways down the tree that end where lights are alike.

use super::*;
use crate::light::selector::choice;

/// Lights in small groups, those of a group facing about the same way: points, spots with points among them, spheres, and panels (two-sided ones in one group).
fn grouped(seed: u64) -> Lights {
    let mut stream = Stream::from_seed(seed);
    let (mut geometry, mut lights) = (Geometry::default(), Lights::default());
    for group in 0..24 {
        let centre = place(&mut stream);
        let normal = uniform_sphere(pair(&mut stream));
        let side = normal.any_orthonormal_vector();
        for _ in 0..15 {
            let p = centre + 0.02 * place(&mut stream);
            let intensity = Rgb::splat(strength(&mut stream));
            match group % 4 {
                0 => _ = lights.add_point(PointLight { p, intensity }),
                1 => {
                    lights.add_spot(SpotLight { p, axis: normal, intensity, cos_start: 0.9, cos_end: 0.2 });
                    lights.add_point(PointLight { p: p + 0.02 * normal, intensity });
                }
                2 => push(&mut geometry, &mut lights, sphere(p, 0.01), intensity, false, false),
                _ => {
                    let turned = side + 0.03 * uniform_sphere(pair(&mut stream));
                    let kind = quad(p, 0.1 * turned, 0.1 * normal.cross(side));
                    push(&mut geometry, &mut lights, kind, intensity, group == 3, false);
                }
            }
        }
    }
    lights
}

fn tree_over(lights: &Lights) -> LightTree {
    let mut tree = LightTree::of(lights).expect("they shine");
    tree.end_where_alike(lights);
    tree
}

/// The clusters that the ways from the root end at, in which lights are alike.
fn ends(tree: &LightTree, receiver: &Receiver) -> Vec<Cluster> {
    let (mut open, mut found) = (vec![tree.root()], vec![]);
    while let Some(cluster) = open.pop() {
        if cluster.count > 1 && tree.alike(&cluster, receiver).is_some() {
            found.push(cluster);
        } else {
            open.extend(tree.children(&cluster));
        }
    }
    found
}

#[test]
fn what_is_chosen_by_energy_is_alike() {
    let lights = grouped(40);
    let tree = tree_over(&lights);
    let (mut stream, mut kinds) = (Stream::from_seed(41), [0; 3]);
    for _ in 0..400 {
        let at = receiver(&mut stream);
        for cluster in ends(&tree, &at) {
            let mut range = [f32::INFINITY, 0.0f32];
            for place in cluster.first..cluster.end() {
                let id = LightId(tree.light(&Cluster { first: place, count: 1, ..cluster }).expect("one light"));
                let share = lights.contribution(id, &at) / lights.bounds(id.0).energy;
                range = [range[0].min(share), range[1].max(share)];
                let kind = match lights.get(id) {
                    LightRef::Point(_) => 0,
                    LightRef::Area(light) => 1 + usize::from(light.bounds.cos_normals > -1.0),
                    other => panic!("not a light that is like others: {other:?}"),
                };
                kinds[kind] += 1;
            }
            // Few: distances by a fifth to either side, and each of two cosines by a third: 2.25 × 2.08 × 2.08.
            assert!(range[1] < 9.8 * range[0], "{range:?} of {cluster:?}");
        }
    }
    assert!(kinds.iter().all(|&count| count > 1000), "{kinds:?}");
}

#[test]
fn lights_that_are_alike_are_chosen_as_often_as_the_tree_says() {
    let lights = grouped(42);
    let tree = tree_over(&lights);
    let root = tree.root();
    let mut stream = Stream::from_seed(43);
    for r in 0..6 {
        let at = receiver(&mut stream);
        assert!(!ends(&tree, &at).is_empty());
        let pmf = |id: LightId| f64::from(tree.pmf(&lights, &root, tree.place(id.0).expect("it shines"), &at));
        let expected: Vec<f64> = lights.ids().map(pmf).collect();
        let sum: f64 = expected.iter().sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        let mut counts = vec![0.0; lights.len()];
        let mut rest = Mean::default();
        for _ in 0..50_000 {
            let mut ways = [(); 2].map(|()| Way::from(root, choice(stream.next_f32(), stream.next_f32())));
            tree.descend(&lights, &mut ways, &at);
            for way in ways {
                let (id, chosen, left) = tree.arrive(&lights, way, &at);
                assert_eq!(f64::from(chosen), expected[id as usize], "to the bit");
                counts[id as usize] += 1.0;
                rest.add(left);
            }
        }
        rest.must_be(0.5, "what is left of u");
        let expected: Vec<f64> = expected.iter().map(|pmf| 1e5 * pmf).collect();
        chi_squared(&counts, &expected, &format!("receiver {r}"));
    }
}

#[test]
fn one_that_is_alike_but_for_its_strength_stays_within_reach() {
    let mut lights = Lights::default();
    for i in 0..9 {
        let intensity = Rgb::splat(if i == 4 { 1e-12 } else { 1e12 });
        lights.add_point(PointLight { p: Vec3::new(i as f32 * 1e-3, 0.0, 0.0), intensity });
    }
    let tree = tree_over(&lights);
    let at = Receiver::medium(Vec3::new(0.0, 0.0, 5.0));
    assert_eq!(ends(&tree, &at), [tree.root()]);
    let pmf = |id: u32| tree.pmf(&lights, &tree.root(), tree.place(id).expect("it shines"), &at);
    assert!(pmf(4) > 1e-6 && (0..9).map(pmf).sum::<f32>() > 0.9999, "{}", pmf(4));
}

#[test]
fn at_one_spot_and_from_there() {
    let mut lights = Lights::default();
    for _ in 0..9 {
        lights.add_point(PointLight { p: Vec3::ONE, intensity: Rgb::WHITE });
    }
    let tree = tree_over(&lights);
    assert!(ends(&tree, &Receiver::medium(Vec3::ONE)).is_empty());
    assert_eq!(ends(&tree, &Receiver::medium(Vec3::ZERO)), [tree.root()]);
}

#[test]
fn what_sums_cannot_tell_apart_is_not_chosen_by_them() {
    let mut lights = Lights::default();
    for i in 0..18 {
        let (x, strength) = if i < 9 { (0.0, 1e20) } else { (100.0, 1e-6) };
        let p = Vec3::new(x + i as f32 * 1e-3, 0.0, 0.0);
        lights.add_point(PointLight { p, intensity: Rgb::splat(strength) });
    }
    let tree = tree_over(&lights);
    let at = Receiver::medium(Vec3::new(100.0, 0.0, 5.0));
    let weak = *tree.children(&tree.root()).iter().find(|child| child.count == 9 && child.first == 9).expect("a half");
    assert!(tree.alike(&weak, &at).is_none());
    let pmf = |id: u32| tree.pmf(&lights, &weak, tree.place(id).expect("it shines"), &at);
    assert!((9..18).all(|id| (pmf(id) - 1.0 / 9.0).abs() < 1e-3), "{:?}", (9..18).map(pmf).collect::<Vec<_>>());
}
