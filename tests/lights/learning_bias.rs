//! What a pass learns is independent of the random numbers of the next. The samples of a pixel are one sequence, each where the others are
//! not: were it to go on over passes, lights would be made likelier just where the next samples fall, or do not.
//!
//! False-alarm rate: 1e-6.

use crate::common::{Options, SLACK, Shot, assert_mean, image_mean, prepare_text, render_job};
use lanternfish::cache_points::CacheSettings;
use lanternfish::render::LightSelection;
use rayon::prelude::*;

/// Lamps in a ring above a spot of floor. A board hides the first quarter of them.
const LAMPS: u32 = 16;
const HIDDEN: u32 = LAMPS / 4;

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

/// One pixel, where nothing else dilutes what its own samples taught. Were its sequence to go on, it would be 6 % too dark: 16 standard errors.
#[test]
fn samples_do_not_fall_where_passes_before_have_learned_to_look() {
    const SEEDS: u32 = 1000;
    let shot = Shot { from: [0.0, 1.0, -3.0], fov: 0.1, size: 1, depth: 1, ..Shot::default() };
    let text = shot.text(&ring());
    let cache = CacheSettings { candidates: Some(16), ..CacheSettings::default() };
    let lights = LightSelection::CachePoints;
    let options = Options { spp: 4, lights, light_candidates: Some(1), cache, ..Options::default() };
    // What was learned stays with a job, so each render has its own.
    let render = |seed| {
        let mut job = prepare_text(&text, &options);
        assert!(job.world.light_choice.learns());
        image_mean(&render_job(&mut job, &Options { seed, ..options.clone() }).film).0[0]
    };
    let values: Vec<f64> = (0..SEEDS).into_par_iter().map(render).collect();
    let count = f64::from(SEEDS);
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let error = (squares / (count - 1.0) / count).sqrt();
    // Albedo over π, times cosine over square of the distance for each lamp.
    let expected = 0.5 / std::f64::consts::PI * f64::from(LAMPS - HIDDEN) * (2.0 / 5f64.sqrt()) / 5.0;
    println!("{mean:.5} ± {error:.5}, expected {expected:.5}");
    assert!(error < 0.01 * expected, "{error} is too large to tell");
    assert_mean("learning", mean, error, expected, SLACK);
}
