//! Figures of the light tree, printed by `cargo test --lib light::tests::tree::figures -- --ignored --nocapture`.

use super::*;
use crate::light::tree::Cut;
use crate::light::tree::split::Splitting;

/// Times and sizes.
#[test]
#[ignore = "prints figures, takes a minute"]
fn speed_and_size() {
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
        let depth = check_shape(&lights, &tree, tree.root(), &mut vec![]);
        let bytes = tree.memory() as f64 / f64::from(count);
        println!("{count} lights: built in {seconds:.2} s, {bytes:.1} bytes a light, {depth} deep");
        const SAMPLES: u32 = 300_000;
        let start = std::time::Instant::now();
        let mut sum = 0.0;
        for _ in 0..SAMPLES {
            let u = selector::choice(stream.next_f32(), stream.next_f32());
            sum += tree.sample(&lights, &tree.root(), &receiver(&mut stream), u).1;
        }
        let ns = |start: std::time::Instant| start.elapsed().as_secs_f64() * 1e9 / f64::from(SAMPLES);
        println!("  {:.0} ns a sample from the root ({sum:.0})", ns(start));
        let mut cut = Cut::default();
        let start = std::time::Instant::now();
        let mut nodes = 0;
        for _ in 0..SAMPLES {
            cut.make(&tree, &lights, &receiver(&mut stream), Splitting::new(0.0));
            nodes += cut.nodes().len();
        }
        println!("  {:.0} ns a cut of {:.1} nodes", ns(start), nodes as f64 / f64::from(SAMPLES));
    }
}

/// The relative variance of choosing lights, each known exactly, summed over the draws: from the root alone, and from a cut.
#[test]
#[ignore = "prints figures"]
fn variance_of_choice() {
    for is_grouped in [false, true] {
        let mut stream = Stream::from_seed(140);
        let mut lights = Lights::default();
        for i in 0..2000 {
            let mut p = place(&mut stream);
            if is_grouped {
                p = place(&mut Stream::from_seed(1000 + i / 50)) + p * 0.03;
            }
            lights.add_point(PointLight { p, intensity: Rgb::splat(strength(&mut stream)) });
        }
        let tree = LightTree::of(&lights).expect("they shine");
        let mut cut = Cut::default();
        for splitting in [None, Some(0.0), Some(0.6), Some(0.8), Some(0.9)] {
            let mut stream = Stream::from_seed(141);
            let (mut variance, mut draws) = (Mean::default(), Mean::default());
            for _ in 0..400 {
                let at = receiver(&mut stream);
                cut.make(&tree, &lights, &at, Splitting::new(splitting.unwrap_or(0.0)));
                let mut sums = vec![(0.0f64, 0.0f64); cut.draws() as usize];
                for id in lights.ids() {
                    let value = f64::from(lights.contribution(id, &at));
                    let place = tree.place(id.0).expect("it shines");
                    let above = cut.nodes().iter().find(|node| node.cluster.covers(place));
                    if let Some(node) = above.filter(|_| value > 0.0) {
                        let pmf = match splitting {
                            None => tree.pmf(&lights, &tree.root(), place, &at),
                            Some(_) => cut.pmf(&tree, &lights, &at, place),
                        };
                        let (squares, sum) = &mut sums[node.draw as usize];
                        *squares += value * value / f64::from(pmf);
                        *sum += value;
                    }
                }
                let total: f64 = sums.iter().map(|(_, sum)| sum).sum();
                if total > 0.0 {
                    variance.add(sums.iter().map(|(squares, sum)| squares - sum * sum).sum::<f64>() / (total * total));
                    draws.add(f64::from(cut.draws()));
                }
            }
            let how = splitting.map_or("from the root".to_owned(), |s| format!("splitting {s}"));
            let (variance, draws) = (variance.mean, draws.mean);
            println!("in groups: {is_grouped}, {how}: variance {variance:.3}, {draws:.1} draws");
        }
    }
}
