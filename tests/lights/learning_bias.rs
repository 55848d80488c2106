//! What a pass learns is independent of the random numbers of the next. The samples of a pixel are one sequence, each where the others are
//! not: were it to go on over passes, lights would be made likelier just where the next samples fall, or do not.
//!
//! False-alarm rate: 1e-6.

use crate::common::{Options, SLACK, Shot, assert_mean, image_mean, prepare_text, render_job};
use std::sync::atomic::AtomicBool;

use lanternfish::cache_points::CacheSettings;
use lanternfish::render::identity::Identity;
use lanternfish::render::lesson::Lesson;
use lanternfish::render::{Budget, Job, LightSelection, RenderSettings, Share, Silent, load};
use lanternfish::scene::{Sources, Warnings};
use rayon::prelude::*;

/// Lamps in a ring above a spot of floor. A board hides the first quarter of them.
const LAMPS: u32 = 16;
const HIDDEN: u32 = LAMPS / 4;

/// Of the floor alone.
const SHOT: Shot = Shot { from: [0.0, 1.0, -3.0], to: [0.0; 3], fov: 0.1, size: 1, depth: 1 };

fn ring() -> String {
    let mut text = "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"bilinearmesh\"
         \"point3 P\" [0.02 1 0.02  0.6 1 0.02  0.02 1 0.6  0.6 1 0.6] AttributeEnd
         Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"bilinearmesh\"
         \"point3 P\" [-0.1 0 -0.1  0.1 0 -0.1  -0.1 0 0.1  0.1 0 0.1]\n"
        .to_owned();
    for i in 0..LAMPS {
        let (sin, cos) = ((f64::from(i) + 0.5) / f64::from(LAMPS) * std::f64::consts::TAU).sin_cos();
        text += &format!("LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [{cos} 2 {sin}]\n");
    }
    text
}

/// What arrives: albedo over π, times cosine over square of the distance for each lamp.
fn expected() -> f64 {
    0.5 / std::f64::consts::PI * f64::from(LAMPS - HIDDEN) * (2.0 / 5f64.sqrt()) / 5.0
}

/// Mean and variance over many renders of the one pixel by cache points, each of which learns for itself.
fn moments(spp: u32, seeds: u32, rehearse: bool) -> (f64, f64) {
    let text = SHOT.text(&ring());
    let cache = CacheSettings { candidates: Some(16), rehearse, ..CacheSettings::default() };
    let lights = LightSelection::CachePoints;
    let options = Options { spp, lights, light_candidates: Some(1), cache, ..Options::default() };
    // What was learned stays with a job, so each render has its own.
    let render = |seed| {
        let mut job = prepare_text(&text, &Options { seed, ..options.clone() });
        assert!(job.world.light_choice.learns());
        let rays = job.world.light_choice.cache_points().expect("there are some").statistics().rehearsal_rays;
        assert_eq!(rays > 0, rehearse);
        image_mean(&render_job(&mut job, &Options { seed, ..options.clone() }).film).0[0]
    };
    of((0..seeds).into_par_iter().map(render).collect())
}

fn of(values: Vec<f64>) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0))
}

/// One pixel, where nothing else dilutes what its own samples taught. Were its sequence to go on, it would be 6 % too dark: 16 standard errors.
#[test]
fn samples_do_not_fall_where_passes_before_have_learned_to_look() {
    const SEEDS: u32 = 1000;
    let (mean, variance) = moments(4, SEEDS, false);
    let (error, expected) = ((variance / f64::from(SEEDS)).sqrt(), expected());
    println!("{mean:.5} ± {error:.5}, expected {expected:.5}");
    assert!(error < 0.01 * expected, "{error} is too large to tell");
    assert_mean("learning", mean, error, expected, SLACK);
}

/// A render that goes by a lesson alone takes samples of a sequence that the lesson's are not of: were they points of one, they would not fall where the lesson has learned to look.
#[test]
fn what_is_left_as_it_was_learned_is_no_bias() {
    const SEEDS: u32 = 1000;
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.pbrt");
    std::fs::write(&scene, SHOT.text(&ring())).expect("the scene can be written");
    let cache = CacheSettings { candidates: Some(16), rehearse: false, ..CacheSettings::default() };
    let (identity, stop) = (Identity::named("ring"), AtomicBool::new(false));
    let render = |seed: u32| {
        let kept = folder.path().join(format!("lesson{seed}"));
        let render = |share, is_taught: bool| {
            let settings = RenderSettings {
                lights: LightSelection::CachePoints,
                light_candidates: Some(1),
                cache,
                share,
                seed: Some(seed),
                save_cache: (!is_taught).then(|| kept.clone()),
                load_cache: is_taught.then(|| kept.clone()),
                freeze_cache: is_taught,
                ..RenderSettings::default()
            };
            let lesson = is_taught.then(|| Lesson::read(&kept, &identity).expect("it is whole"));
            let (read, timings) = load(&scene, &mut Sources::default(), &mut Warnings::default()).expect("a scene");
            let job = Job::prepare_taught(&read, &settings, timings, &mut Warnings::default(), lesson);
            let mut job = job.expect("it can be rendered");
            let outcome = job.render(seed, job.budget, &stop, &Silent);
            if !is_taught {
                job.write_lesson(&outcome, &kept, &identity).expect("it can be written");
            }
            image_mean(&outcome.film).0[0]
        };
        render(Share::Samples(0..1), false);
        let taught = render(Share::Samples(1..4), true);
        std::fs::remove_file(&kept).expect("it is there");
        taught
    };
    let (mean, variance) = of((0..SEEDS).into_par_iter().map(render).collect());
    let (error, expected) = ((variance / f64::from(SEEDS)).sqrt(), expected());
    println!("{mean:.5} ± {error:.5}, expected {expected:.5}");
    assert!(error < 0.01 * expected, "{error} is too large to tell");
    assert_mean("left as learned", mean, error, expected, SLACK);
}

/// Pilot paths learn before the first sample, from random numbers of their own: were those the samples' own, the pixel would be too dark.
#[test]
fn a_rehearsal_is_no_bias() {
    const SEEDS: u32 = 1000;
    let ((mean, variance), (_, without)) = (moments(1, SEEDS, true), moments(1, SEEDS, false));
    let (error, expected) = ((variance / f64::from(SEEDS)).sqrt(), expected());
    println!("{mean:.5} ± {error:.5}, expected {expected:.5}; variance {variance:.2e}, without {without:.2e}");
    assert_mean("rehearsed", mean, error, expected, SLACK);
    assert!(variance < 0.75 * without, "{variance} against {without}");
}

/// What another render learned tells where to look, and that is no bias: its random numbers are others. Its lights are chosen better from the first sample on.
#[test]
fn what_another_render_learned_is_no_bias() {
    const SEEDS: u32 = 400;
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, kept) = (folder.path().join("scene.pbrt"), folder.path().join("lesson"));
    std::fs::write(&scene, SHOT.text(&ring())).expect("the scene can be written");
    let cache = CacheSettings { candidates: Some(16), rehearse: false, ..CacheSettings::default() };
    let (identity, stop) = (Identity::named("ring"), AtomicBool::new(false));
    let prepare = |settings: RenderSettings, lesson| {
        let settings = RenderSettings {
            lights: LightSelection::CachePoints,
            light_candidates: Some(1),
            cache,
            load_cache: Some(kept.clone()),
            ..settings
        };
        let (read, timings) = load(&scene, &mut Sources::default(), &mut Warnings::default()).expect("a scene");
        Job::prepare_taught(&read, &settings, timings, &mut Warnings::default(), lesson).expect("it can be rendered")
    };
    let teacher = RenderSettings {
        budget: Budget::Samples(64),
        seed: Some(1 << 20),
        save_cache: Some(kept.clone()),
        ..RenderSettings::default()
    };
    let mut job = prepare(teacher, None);
    let outcome = job.render(1 << 20, Budget::Samples(64), &stop, &Silent);
    job.write_lesson(&outcome, &kept, &identity).expect("it can be written");
    let render = |seed, is_taught: bool| {
        let lesson = is_taught.then(|| Lesson::read(&kept, &identity).expect("it is whole"));
        let settings = RenderSettings { budget: Budget::Samples(1), seed: Some(seed), ..RenderSettings::default() };
        let mut job = prepare(settings, lesson);
        let cache = job.world.light_choice.cache_points().expect("there are enough lights");
        assert_eq!(cache.statistics().are_loaded, is_taught);
        image_mean(&job.render(seed, Budget::Samples(1), &stop, &Silent).film).0[0]
    };
    let count = f64::from(SEEDS);
    let moments = |is_taught| of((0..SEEDS).into_par_iter().map(|seed| render(seed, is_taught)).collect());
    let [(mean, variance), (_, untaught)] = [true, false].map(moments);
    let expected = expected();
    println!(
        "{mean:.5} ± {:.5}, expected {expected:.5}; variance {variance:.2e}, untaught {untaught:.2e}",
        (variance / count).sqrt()
    );
    assert_mean("taught", mean, (variance / count).sqrt(), expected, SLACK);
    // One in four lamps is hidden: who knows which has next to no noise.
    assert!(variance < 0.75 * untaught, "{variance} against {untaught}");
}
