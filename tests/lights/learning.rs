//! Cache points learn which lights are hidden. Whatever they have learned, right or wrong, the image is the same; where they
//! learn, fewer shadow rays are blocked; where there is nothing to choose or no place to learn at, they are not there.
//!
//! False-alarm rates: 1e-4 for the images of each visibility rule (`common::blocks`), 1e-6 for each comparison of shares.

use crate::common::blocks::{Blocks, Family};
use crate::common::{Options, Shot, critical_z, prepare_file, prepare_text, render_job};
use arrayvec::ArrayVec;
use glam::Vec3;
use lanternfish::cache_points::learn::VisibilityRule;
use lanternfish::cache_points::{CacheScratch, CacheSettings};
use lanternfish::film::FilmOverrides;
use lanternfish::integrator::LightChoice;
use lanternfish::light::selector::choice;
use lanternfish::light::{LightId, Receiver};
use lanternfish::math::sampler::Stream;
use lanternfish::render::stats::Iteration;
use lanternfish::render::{Job, LightSelection};
use lanternfish::scene::Warnings;

const GRID: [usize; 2] = [3, 3];
/// Places of cells along x and z, and lamps in each cell.
const CELLS: i32 = 3;
const LAMPS: i32 = 3;

/// A floor with walls in a grid, open above, with points and balls of light in each cell; thin fog over all of it if `fog`.
fn cells(fog: bool) -> String {
    let mut text = "Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]\n".to_owned();
    let cuboid = |x: f32, z: f32, size: [f32; 3]| {
        let [a, b, c] = size;
        format!("AttributeBegin Translate {x} {b} {z} Scale {a} {b} {c} {} AttributeEnd\n", crate::common::CUBE)
    };
    text += "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-4 0 -4  4 0 -4  4 0 4  -4 0 4]\n";
    for i in 0..=CELLS {
        let at = 2.0 * i as f32 - CELLS as f32;
        text += &cuboid(at, 0.0, [0.05, 0.6, 3.0]);
        text += &cuboid(0.0, at, [3.0, 0.6, 0.05]);
    }
    let mut stream = Stream::from_seed(5);
    for k in 0..CELLS * CELLS * LAMPS {
        let (cell, lamp) = (k / LAMPS, k % LAMPS);
        let mut within = |edge: i32| 2.0 * edge as f32 + 1.0 - CELLS as f32 + 1.2 * (stream.next_f32() - 0.5);
        let (x, z) = (within(cell % CELLS), within(cell / CELLS));
        let y = 0.4 + 0.3 * stream.next_f32();
        // Close to a point in fog light is without bounds, and its noise too.
        text += &match lamp {
            lamp if lamp == 0 || fog => format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 5 3] Material \"diffuse\" \"rgb reflectance\" [0 0 0]
                 Translate {x} {y} {z} Shape \"sphere\" \"float radius\" 0.1 AttributeEnd\n"
            ),
            _ => format!("LightSource \"point\" \"rgb I\" [0.3 0.2 0.1] \"point3 from\" [{x} {y} {z}]\n"),
        };
    }
    if fog {
        text += "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.02 0.02 0.02] \"rgb sigma_s\" [0.1 0.1 0.1]\n";
        text += &crate::common::boundary("fog", "", &format!("Translate 0 1.01 0 Scale 4 1 4 {}", crate::common::CUBE));
    }
    text
}

fn shot() -> Shot {
    Shot { from: [0.0, 9.0, -5.0], to: [0.0, 0.0, 0.0], fov: 38.0, size: 48, depth: 2 }
}

/// Draws at random places and calls those of `arrives` successes, whatever is in the way, in `passes` passes.
fn teach(job: &mut Job, passes: u64, arrives: impl Fn(LightId) -> bool) {
    let world = &mut job.world;
    let LightChoice::CachePoints(cache) = &mut world.light_choice else { panic!("cache points were asked for") };
    let mut scratch = CacheScratch::default();
    for pass in 0..passes {
        let mut stream = Stream::from_seed(pass);
        for i in 0..100 {
            let [x, y, z] = [(); 3].map(|()| stream.next_f32());
            // As in the scene, which the camera is the origin of.
            let p =
                Vec3::new(6.0 * x - 3.0, if i % 2 == 0 { 0.0 } else { y }, 6.0 * z - 3.0) - Vec3::new(0.0, 9.0, -5.0);
            let receiver = if i % 2 == 0 { Receiver::surface(p, Vec3::Y, false) } else { Receiver::medium(p) };
            scratch.begin_path();
            cache.prepare(&world.lights, &receiver, &mut scratch);
            let u = choice(stream.next_f32(), stream.next_f32());
            let mut drawn = ArrayVec::new();
            cache.sample(&world.lights, std::iter::once(u), &scratch, &mut drawn);
            let drawn = drawn.first().expect("there are lights");
            cache.record(drawn, arrives(drawn.light));
        }
        cache.learn(&world.lights);
    }
}

/// After no pass, one and a thousand the image is that of asking every light.
fn is_right_after_passes(visibility: VisibilityRule, fog: bool) {
    const SEEDS: u32 = 24;
    let text = shot().text(&cells(fog));
    let exact = Options { spp: 8, lights: LightSelection::Optimal, seed: 500, ..Options::default() };
    let reference = Blocks::render(&mut prepare_text(&text, &exact), &exact, GRID, SEEDS);
    // Few points, so that a thousand passes do not take long.
    let cache = CacheSettings { visibility, candidates: Some(400), rehearse: false, ..CacheSettings::default() };
    let options = Options { spp: 1, lights: LightSelection::CachePoints, cache, ..Options::default() };
    let (mut fresh, mut after_one) = (Blocks(vec![]), Blocks(vec![]));
    for seed in 0..SEEDS {
        let mut job = prepare_text(&text, &Options { seed, ..options.clone() });
        let mut render = |seed| Blocks::render(&mut job, &Options { seed, ..options.clone() }, GRID, 1).0;
        fresh.0.extend(render(seed));
        after_one.0.extend(render(100 + seed));
    }
    let mut family = Family::default();
    family.compare(&format!("{visibility:?}, no pass"), &fresh, &reference, 0.01);
    family.compare(&format!("{visibility:?}, one pass"), &after_one, &reference, 0.01);
    // What is taught has nothing to do with what is so.
    for (lesson, every) in [("nothing arrives", u32::MAX), ("every other arrives", 2)] {
        let mut job = prepare_text(&text, &options);
        teach(&mut job, 1000, |id| id.0 % every == every - 1);
        let taught = Blocks::render(&mut job, &Options { spp: 4, ..options.clone() }, GRID, SEEDS);
        family.compare(&format!("{visibility:?}, a thousand passes, {lesson}"), &taught, &reference, 0.01);
    }
    family.assert(1e-4);
}

#[test]
fn clusters_learned_or_not_leave_the_image_alone() {
    is_right_after_passes(VisibilityRule::Clusters, true);
}

#[test]
fn the_papers_rule_learned_or_not_leaves_the_image_alone() {
    is_right_after_passes(VisibilityRule::Threshold, false);
}

#[test]
fn roots_learned_or_not_leave_the_image_alone() {
    is_right_after_passes(VisibilityRule::Root, false);
}

/// A scene of the gallery by cache points, made ready.
fn gallery(name: &str, lights: Option<u32>, options: &Options) -> (Job, Warnings) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = lanternfish::gallery::find(name).expect("there is such a scene");
    let path = scene.write(folder.path(), lights).expect("it can be written");
    let mut warnings = Warnings::default();
    (prepare_file(&path, options, &mut warnings).expect("it can be prepared"), warnings)
}

#[test]
fn fewer_shadow_rays_are_blocked_once_learned() {
    for (visibility, falls) in [(VisibilityRule::Clusters, true), (VisibilityRule::Off, false)] {
        let film = FilmOverrides { resolution: Some([128, 72]), crop: None };
        let cache = CacheSettings { visibility, rehearse: false, ..CacheSettings::default() };
        // One shadow ray a path at most: rays are independent, and their shares binomial.
        let options = Options {
            spp: 64,
            max_depth: Some(1),
            lights: LightSelection::CachePoints,
            cache,
            film,
            ..Options::default()
        };
        let iterations = render_job(&mut gallery("rooms", Some(400), &options).0, &options).iterations;
        let [first, last] = [iterations[0], iterations[iterations.len() - 1]];
        let square = |i: Iteration| i.blocked * (1.0 - i.blocked) / i.shadow_rays as f64;
        let allowed = critical_z(1e-6) * (square(first) + square(last)).sqrt();
        println!("{visibility:?}: {:.4} and {:.4} ± {allowed:.4} blocked", first.blocked, last.blocked);
        assert_eq!((first.samples, last.samples), (1, 32));
        if falls {
            assert!(last.blocked < 0.8 * first.blocked && first.blocked - last.blocked > allowed);
        } else {
            assert!((last.blocked - first.blocked).abs() < allowed);
        }
    }
}

/// Whether light is selected, and why or why not, by the plan.
fn selection(job: &Job) -> (bool, &str, usize) {
    let system = job.plan.systems.iter().find(|system| system.name == "light selection").expect("it is in the plan");
    (system.built, &system.reason, system.bytes)
}

#[test]
fn one_light_needs_no_selection() {
    for lights in [LightSelection::Auto, LightSelection::CachePoints, LightSelection::Tree] {
        let options = Options { lights, cache: CacheSettings::default(), ..Options::default() };
        let (job, warnings) = gallery("lamp", None, &options);
        assert_eq!(selection(&job), (false, "there is one light: nothing to choose", 0), "{lights:?}");
        assert!(warnings.list().is_empty(), "{warnings:?}");
    }
}

#[test]
fn with_too_few_places_every_light_is_asked() {
    let text = shot().text(&cells(false));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, &text).expect("the scene can be written");
    let exact = Options { spp: 2, lights: LightSelection::Optimal, ..Options::default() };
    let expected = render_job(&mut prepare_text(&text, &exact), &exact).film;
    for (candidates, is_enough) in [(9, false), (400, true)] {
        let cache = CacheSettings { candidates: Some(candidates), ..CacheSettings::default() };
        let options = Options { lights: LightSelection::CachePoints, cache, ..exact.clone() };
        let mut warnings = Warnings::default();
        let mut job = prepare_file(&path, &options, &mut warnings).expect("it can be prepared");
        let said = warnings.list().iter().any(|warning| warning.message.contains("too few places for cache points"));
        assert_eq!(said, !is_enough, "{warnings:?}");
        let (is_built, reason, _) = selection(&job);
        assert!(is_built && (reason == "locally optimal over 27 lights") != is_enough, "{reason}");
        let apart = crate::common::difference(&render_job(&mut job, &options).film, &expected);
        assert_eq!(apart == 0.0, !is_enough, "relative RMSE {apart}");
    }
}
