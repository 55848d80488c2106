//! The whole of it: probabilities against frequencies, sums of 1, what learning does to them, memory, and lights that strain numbers.

use arrayvec::ArrayVec;
use glam::Vec3;

use super::seed::{Candidate, ReceivingBox, scatter_in_boxes};
use super::select::{Drawn, MOST_DRAWN};
use super::*;
use crate::light::selector::choice;
use crate::light::{DistantLight, InfiniteLight, LightId, PointLight, SpotLight};
use crate::math::Rgb;
use crate::math::chi2::assert_counts;
use crate::math::sampler::Stream;
use crate::math::warp::uniform_sphere;

/// What a pixel spans.
const PIXEL: PixelSpan = PixelSpan { width: 0.0, angle: 1e-3 };

/// `count` points of various power in a room of 10 units, a few spots, the sun and the sky.
fn lights(count: usize, seed: u64) -> Lights {
    let mut stream = Stream::from_seed(seed);
    let mut place = || Vec3::from([(); 3].map(|()| 10.0 * stream.next_f32()));
    let mut lights = Lights::default();
    for i in 0..count {
        let intensity = Rgb::splat(if i % 17 == 3 { 0.0 } else { 0.01 + (i % 7) as f32 });
        lights.add_point(PointLight { p: place(), intensity });
    }
    for i in 0..count.min(5) {
        let axis = (place() - Vec3::splat(5.0)).normalize();
        let (cos_start, cos_end) = ([0.9999, 0.9, 0.0][i % 3], [0.9998, 0.8, -0.5][i % 3]);
        lights.add_spot(SpotLight { p: place(), axis, intensity: Rgb::splat(30.0), cos_start, cos_end });
    }
    lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::splat(0.3) });
    lights.add_infinite(InfiniteLight::Constant(Rgb::splat(0.05)));
    lights.set_scene_bounds(Vec3::ZERO, Vec3::splat(10.0));
    lights
}

fn candidates(count: usize) -> Vec<Candidate> {
    let mut list = vec![];
    scatter_in_boxes(&[ReceivingBox { number: 0, corners: (Vec3::ZERO, Vec3::splat(10.0)) }], count, &mut list);
    // Some on a floor and a ceiling.
    let mut stream = Stream::from_seed(77);
    for i in 0..count {
        let up = i % 2 == 0;
        let p = Vec3::new(10.0 * stream.next_f32(), if up { 0.0 } else { 10.0 }, 10.0 * stream.next_f32());
        list.push(Candidate { p, normal: if up { Vec3::Y } else { Vec3::NEG_Y } });
    }
    list
}

fn build(lights: &Lights, settings: CacheSettings) -> CachePoints {
    CachePoints::build(lights, candidates(400), PIXEL, settings, Default::default()).expect("there are candidates")
}

fn settings(gathering: Gathering, visibility: VisibilityRule) -> CacheSettings {
    CacheSettings { gathering, visibility, ..Default::default() }
}

const ALL: [(Gathering, VisibilityRule); 4] = [
    (Gathering::Hierarchy, VisibilityRule::Clusters),
    (Gathering::Hierarchy, VisibilityRule::Off),
    (Gathering::Lists, VisibilityRule::Threshold),
    (Gathering::Lists, VisibilityRule::Root),
];

fn receivers(count: usize, seed: u64) -> impl Iterator<Item = Receiver> {
    let mut stream = Stream::from_seed(seed);
    (0..count).map(move |i| {
        let p = Vec3::from([(); 3].map(|()| 14.0 * stream.next_f32() - 2.0));
        let ns = uniform_sphere([stream.next_f32(), stream.next_f32()]);
        match i % 3 {
            0 => Receiver::medium(p),
            k => Receiver::surface(p, ns, k == 2),
        }
    })
}

/// A light for each of `numbers`; there are lights.
fn draw(cache: &CachePoints, lights: &Lights, numbers: &[f64], scratch: &CacheScratch) -> ArrayVec<Drawn, MOST_DRAWN> {
    let mut drawn = ArrayVec::new();
    cache.sample(lights, numbers.iter().copied(), scratch, &mut drawn);
    assert_eq!(drawn.len(), numbers.len());
    drawn
}

/// Draws at random vertices and calls most of them failures.
fn teach(cache: &mut CachePoints, lights: &Lights, passes: u32, success: impl Fn(LightId) -> bool) {
    let mut scratch = CacheScratch::default();
    for pass in 0..passes {
        let mut stream = Stream::from_seed(u64::from(pass));
        for receiver in receivers(300, u64::from(pass)) {
            cache.prepare(lights, &receiver, &mut scratch);
            let u = choice(stream.next_f32(), stream.next_f32());
            let drawn = draw(cache, lights, &[u], &scratch)[0];
            cache.record(&drawn, success(drawn.light));
        }
        cache.learn(lights);
    }
}

#[test]
fn probabilities_add_up_to_1() {
    for (gathering, visibility) in ALL {
        for count in [2, 40, 3000] {
            let lights = lights(count, 1);
            let mut cache = build(&lights, settings(gathering, visibility));
            for passes in [0, 1, 20] {
                teach(&mut cache, &lights, passes, |id| id.0 % 3 == 0);
                let mut scratch = CacheScratch::default();
                for receiver in receivers(300, 9) {
                    scratch.begin_path();
                    cache.prepare(&lights, &receiver, &mut scratch);
                    let sum: f64 = lights.ids().map(|id| f64::from(cache.pmf(&lights, id, &scratch))).sum();
                    assert!((sum - 1.0).abs() < 2e-5, "{gathering:?} {visibility:?} {count} lights: {sum}");
                    assert_eq!(cache.pmf(&lights, LightId(3), &scratch) == 0.0, count > 3, "the dark light");
                }
            }
        }
    }
}

/// The second moment of one choice's estimate of all that arrives at some vertices, in squares of that.
fn second_moment(cache: &CachePoints, lights: &Lights) -> f64 {
    let mut scratch = CacheScratch::default();
    let mut moments = vec![];
    for receiver in receivers(200, 3) {
        scratch.begin_path();
        cache.prepare(lights, &receiver, &mut scratch);
        let given = |id| f64::from(lights.contribution(id, &receiver));
        let square = |id| given(id).powi(2) / f64::from(cache.pmf(lights, id, &scratch)).max(1e-12);
        let all: f64 = lights.ids().map(given).sum();
        moments.push(lights.ids().map(square).sum::<f64>() / (all * all));
    }
    moments.iter().sum::<f64>() / moments.len() as f64
}

#[test]
fn clusters_all_around_are_judged_at_the_vertex() {
    let lights = lights(3000, 4);
    let moment = |near_clusters| {
        let settings = CacheSettings { near_clusters, visibility: VisibilityRule::Off, ..Default::default() };
        second_moment(&build(&lights, settings), &lights)
    };
    let [with, without] = [true, false].map(moment);
    // 1 is the least there is.
    assert!(with >= 0.999 && with - 1.0 < 0.7 * (without - 1.0), "{with} {without}");
}

#[test]
fn lights_are_chosen_as_often_as_their_probability_says() {
    for (k, (gathering, visibility)) in ALL.into_iter().enumerate() {
        let lights = lights(60, 2);
        let mut cache = build(&lights, settings(gathering, visibility));
        teach(&mut cache, &lights, 3, |id| id.0 % 2 == 0);
        let mut scratch = CacheScratch::default();
        for (r, receiver) in receivers(6, 5).enumerate() {
            scratch.begin_path();
            cache.prepare(&lights, &receiver, &mut scratch);
            let mut stream = Stream::from_seed((10 * k + r) as u64);
            let mut counts = vec![0.0; lights.len()];
            let mut rest = crate::math::chi2::Moments::default();
            for _ in 0..50_000 {
                let u = choice(stream.next_f32(), stream.next_f32());
                let Drawn { light: id, pmf, rest: left, .. } = draw(&cache, &lights, &[u], &scratch)[0];
                assert!(pmf > 0.0 && pmf == cache.pmf(&lights, id, &scratch));
                assert!((0.0..1.0).contains(&left));
                counts[id.0 as usize] += 1.0;
                rest.add(left);
            }
            rest.assert_mean("what is left of u", 0.5);
            let pmf = |id| 5e4 * f64::from(cache.pmf(&lights, id, &scratch));
            let expected: Vec<f64> = lights.ids().map(pmf).collect();
            assert_counts(&format!("{gathering:?} {visibility:?} at {r}"), &counts, &expected);
        }
    }
}

#[test]
fn every_light_stays_within_reach() {
    let lights = lights(500, 3);
    for (gathering, visibility) in ALL {
        let mut cache = build(&lights, settings(gathering, visibility));
        teach(&mut cache, &lights, 100, |_| false);
        let mut scratch = CacheScratch::default();
        for receiver in receivers(100, 4) {
            cache.prepare(&lights, &receiver, &mut scratch);
            for id in lights.ids().filter(|&id| !lights.is_dark(id)) {
                assert!(cache.pmf(&lights, id, &scratch) > 1e-6, "{id:?}");
            }
        }
    }
}

#[test]
fn what_never_arrives_is_chosen_less() {
    let lights = lights(50, 4);
    for (visibility, least) in
        [(VisibilityRule::Threshold, 0.95), (VisibilityRule::Root, 0.6), (VisibilityRule::Clusters, 0.6)]
    {
        let mut cache = build(&lights, settings(Gathering::Hierarchy, visibility));
        let share = |cache: &CachePoints| {
            let mut scratch = CacheScratch::default();
            let hidden = |receiver| {
                cache.prepare(&lights, &receiver, &mut scratch);
                lights
                    .ids()
                    .filter(|id| id.0 % 2 == 1)
                    .map(|id| f64::from(cache.pmf(&lights, id, &scratch)))
                    .sum::<f64>()
            };
            receivers(200, 6).map(hidden).sum::<f64>() / 200.0
        };
        let before = share(&cache);
        teach(&mut cache, &lights, 400, |id| id.0 % 2 == 0);
        let after = share(&cache);
        assert!(after < least * before, "{visibility:?}: {before} {after}");
    }
}

/// Lights of 1e-12 to 1e12 W, several in one place, one where it is received; places with no light at all.
#[test]
fn extremes_stay_finite() {
    let mut lights = Lights::default();
    for i in 0..25 {
        let p = Vec3::splat(if i % 5 == 0 { 5.0 } else { i as f32 * 0.4 });
        lights.add_point(PointLight { p, intensity: Rgb::splat(10f32.powi(i - 12)) });
    }
    lights.add_point(PointLight { p: Vec3::splat(1e17), intensity: Rgb::WHITE });
    check_sums(&lights);
    // A sky and a sun as bright as numbers go.
    lights.add_infinite(InfiniteLight::Constant(Rgb::splat(f32::MAX)));
    lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::splat(f32::MAX) });
    check_sums(&lights);
}

/// Probabilities are those of sampling, and add up to 1.
fn check_sums(lights: &Lights) {
    for (gathering, visibility) in ALL {
        let mut cache = build(lights, settings(gathering, visibility));
        teach(&mut cache, lights, 2, |_| true);
        let mut scratch = CacheScratch::default();
        let there = [5.0, 1e18].map(|x| Receiver::medium(Vec3::splat(x)));
        for receiver in receivers(50, 8).chain(there) {
            cache.prepare(lights, &receiver, &mut scratch);
            let sum: f64 = lights.ids().map(|id| f64::from(cache.pmf(lights, id, &scratch))).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{sum} at {receiver:?}");
            for u in [0.0, 0.3, 0.5, 0.9, 1.0 - f64::EPSILON] {
                let Drawn { light: id, pmf, .. } = draw(&cache, lights, &[u], &scratch)[0];
                assert_eq!(pmf, cache.pmf(lights, id, &scratch), "at {receiver:?}");
            }
        }
    }
}

#[test]
fn lights_drawn_together_are_those_drawn_alone() {
    let lights = lights(300, 6);
    let cache = build(&lights, CacheSettings::default());
    let (mut stream, mut scratch) = (Stream::from_seed(9), CacheScratch::default());
    let sorted = |mut drawn: Vec<Drawn>| {
        drawn.sort_by_key(|d| (d.light, d.rest.to_bits()));
        drawn
    };
    for receiver in receivers(300, 10) {
        cache.prepare(&lights, &receiver, &mut scratch);
        let numbers = [(); MOST_DRAWN].map(|()| choice(stream.next_f32(), stream.next_f32()));
        let alone = numbers.iter().map(|&u| draw(&cache, &lights, &[u], &scratch)[0]).collect();
        assert_eq!(sorted(alone), sorted(draw(&cache, &lights, &numbers, &scratch).to_vec()), "at {receiver:?}");
    }
}

#[test]
fn few_candidates_make_no_cache() {
    let list = candidates(4);
    assert!(CachePoints::build(&lights(5, 1), list, PIXEL, CacheSettings::default(), Default::default()).is_none());
}

/// The clusters of all points, and which of them are near.
fn clusters(cache: &CachePoints) -> Vec<(Vec<Cluster>, Vec<u16>)> {
    let of = |point| (cache.table.list(point).iter().collect(), cache.table.near(point).to_vec());
    (0..cache.positions.len() as u32).map(of).collect()
}

#[test]
fn threads_do_not_matter() {
    let lights = lights(300, 5);
    let positions = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut cache = build(&lights, CacheSettings::default());
            teach(&mut cache, &lights, 4, |id| id.0 % 3 == 0);
            let clusters = clusters(&cache);
            (cache.points().collect::<Vec<_>>(), cache.table.energies, cache.table.visibility, clusters)
        })
    };
    assert_eq!(positions(1), positions(3));
}

#[test]
fn a_scene_may_be_scaled() {
    let scaled = |scale: f32| {
        let mut lights = Lights::default();
        let mut stream = Stream::from_seed(3);
        for _ in 0..200 {
            let p = Vec3::from([(); 3].map(|()| 8.0 * stream.next_f32()));
            lights.add_point(PointLight { p: p * scale, intensity: Rgb::splat(scale * scale) });
        }
        let list = candidates(400).into_iter().map(|c| Candidate { p: c.p * scale, ..c }).collect();
        CachePoints::build(&lights, list, PIXEL, CacheSettings::default(), Default::default()).expect("candidates")
    };
    // A power of two changes no digit.
    let (one, tiny, huge) = (scaled(1.0), scaled(2f32.powi(-40)), scaled(2f32.powi(40)));
    assert_eq!(clusters(&one), clusters(&tiny));
    assert_eq!(clusters(&one), clusters(&huge));
}

/// What a file holds is believed only where it fits the lights.
#[test]
fn kept_points_are_taken_up_whole_or_not_at_all() {
    let lights = lights(300, 11);
    for (gathering, visibility) in ALL {
        let settings = settings(gathering, visibility);
        let cache = build(&lights, settings);
        let bytes = postcard::to_stdvec(&cache.kept()).expect("it fits");
        let read = |bytes: &[u8]| postcard::from_bytes::<kept::KeptPoints>(bytes).ok();
        let again = CachePoints::from_kept(&lights, read(&bytes).expect("whole"), settings).expect("of these lights");
        for receiver in receivers(60, 3) {
            let mut scratch = [CacheScratch::default(), CacheScratch::default()];
            cache.prepare(&lights, &receiver, &mut scratch[0]);
            again.prepare(&lights, &receiver, &mut scratch[1]);
            for id in lights.ids() {
                let [a, b] = [(&cache, &scratch[0]), (&again, &scratch[1])]
                    .map(|(cache, scratch)| cache.pmf(&lights, id, scratch));
                assert_eq!(a.to_bits(), b.to_bits());
            }
        }
        // Of fewer lights; with bytes that differ: nothing is asked for that is not there.
        let fewer = self::lights(150, 11);
        assert!(CachePoints::from_kept(&fewer, read(&bytes).expect("whole"), settings).is_none());
        let mut stream = Stream::from_seed(5);
        let mut taken = 0;
        for _ in 0..100 {
            let mut bad = bytes.clone();
            let place = (stream.next_f32() * bad.len() as f32) as usize;
            bad[place] ^= 1 << (stream.next_f32() * 8.0) as u32;
            let Some(kept) = read(&bad) else { continue };
            let Some(mut cache) = CachePoints::from_kept(&lights, kept, settings) else { continue };
            taken += 1;
            for receiver in receivers(10, 4) {
                let mut scratch = CacheScratch::default();
                cache.prepare(&lights, &receiver, &mut scratch);
                draw(&cache, &lights, &[0.1, 0.5, 0.9], &scratch);
            }
            cache.learn(&lights);
        }
        println!("{gathering:?} {visibility:?}: {taken} of 100 damaged ones are as good as any");
    }
}

#[test]
fn points_that_were_told_enough_are_not_told_more() {
    let lights = lights(4, 50);
    let mut cache = build(&lights, CacheSettings { refine: false, ..Default::default() });
    let (p, light) = (Vec3::splat(5.0), LightId(0));
    let told = |cache: &CachePoints| {
        let before = cache.table.tries();
        cache.record_at(&lights, p, light, true);
        cache.table.tries() > before
    };
    assert!(!told(&cache), "nobody asks where to scatter");
    cache.weigh_scattering(&lights, [0.0].into_iter().collect());
    assert!(told(&cache));
    // 64 tries an entry on average, all of them at one.
    let enough = 64 * cache.table.counters.len();
    (1..enough - 1).for_each(|_| cache.record_at(&lights, p, light, true));
    cache.learn(&lights);
    assert!(told(&cache), "one is missing yet");
    cache.learn(&lights);
    assert!(!told(&cache));
}
