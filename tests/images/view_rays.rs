//! Camera rays that are split to find what shines straight into the camera: unbiased although later passes go by what earlier ones saw, and less noisy.
//!
//! False-alarm rate: 1e-6 for each mean.

use crate::common::{Options, SLACK, Shot, assert_mean, boundary, image_mean, prepare_text, render_job};
use lanternfish::render::ViewRays;

/// Pixels in the image's width and height.
const SIZE: u32 = 3;
/// Of a pixel's width, the side of a square lamp.
const SIDE: f64 = 0.2;
const RADIANCE: f64 = 25.0;
const SKY: f64 = 0.2;
/// Extinction of the air, which scatters nothing: along 4 units to the lamp, 9 to its end.
const EXTINCTION: f64 = 0.1;

/// Pixels with a lamp each that covers a 25th of it, before a dim sky.
fn scene(fog: bool) -> String {
    let fov = 1.0f64;
    let width = 8.0 * (fov / 2.0).to_radians().tan() / f64::from(SIZE);
    let lamp = |i: u32| {
        let at = |i: u32| (f64::from(i) - 0.5 * f64::from(SIZE) + 0.1 * f64::from(i + 1)) * width;
        let ([x, y], side) = ([i % SIZE, i / SIZE].map(at), SIDE * width);
        let [x1, y1] = [x + side, y + side];
        format!("Shape \"bilinearmesh\" \"point3 P\" [{x} {y} 0  {x1} {y} 0  {x} {y1} 0  {x1} {y1} 0]\n")
    };
    let lamps: String = (0..SIZE * SIZE).map(lamp).collect();
    let air = format!(
        "MakeNamedMedium \"air\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{EXTINCTION} {EXTINCTION} {EXTINCTION}] \"rgb sigma_s\" [0 0 0]\n{}",
        boundary("air", "", "Shape \"sphere\" \"float radius\" 5")
    );
    let shot = Shot { from: [0.0, 0.0, -4.0], fov, size: SIZE, depth: 1, ..Shot::default() };
    shot.text(&format!(
        "LightSource \"infinite\" \"rgb L\" [{SKY} {SKY} {SKY}]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{RADIANCE} {RADIANCE} {RADIANCE}] \"bool twosided\" true
         Material \"diffuse\" \"rgb reflectance\" [0 0 0]
         {lamps} AttributeEnd
         {}",
        if fog { &air } else { "" }
    ))
}

/// Mean and variance of the image's mean over renders with this many seeds.
fn moments(text: &str, view_rays: ViewRays, spp: u32, seeds: u32) -> (f64, f64) {
    let options = Options { spp, view_rays, ..Options::default() };
    let mut job = prepare_text(text, &options);
    let values: Vec<f64> = (0..seeds)
        .map(|seed| image_mean(&render_job(&mut job, &Options { seed, ..options.clone() }).film).0[0])
        .collect();
    let mean = values.iter().sum::<f64>() / f64::from(seeds);
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / f64::from(seeds - 1))
}

fn expected(fog: bool) -> f64 {
    let passed = |distance: f64| if fog { (-EXTINCTION * distance).exp() } else { 1.0 };
    SIDE * SIDE * RADIANCE * passed(4.0) + (1.0 - SIDE * SIDE) * SKY * passed(9.0)
}

/// Each pixel's rays are split by what those around have seen. If its own rays had a say, which are points of one sequence, the image would be too
/// bright.
#[test]
fn pixels_that_split_their_rays_have_the_right_mean() {
    for fog in [false, true] {
        const SEEDS: u32 = 4000;
        let (mean, variance) = moments(&scene(fog), ViewRays::Auto, 16, SEEDS);
        let error = (variance / f64::from(SEEDS)).sqrt();
        println!("{mean:.5} ± {error:.5}, expected {:.5}", expected(fog));
        assert!(error < 0.01 * mean, "{error} is too large to tell");
        assert_mean("a lamp in a pixel", mean, error, expected(fog), SLACK);
    }
}

/// Variances of 500 renders have standard errors of some 6 % each: a third is far beyond chance.
#[test]
fn small_lamps_have_less_noise() {
    for fog in [false, true] {
        let [auto, off] = [ViewRays::Auto, ViewRays::Off].map(|view_rays| moments(&scene(fog), view_rays, 64, 500));
        println!("variance {} of {}", auto.1, off.1);
        assert!(auto.1 < off.1 / 3.0, "variance {} is not much less than {}", auto.1, off.1);
    }
}

/// What cannot be seen to shine is not looked for.
#[test]
fn lights_without_surfaces_need_no_rays() {
    let floor = "Material \"diffuse\" Shape \"sphere\" \"float radius\" 1\n";
    for (light, splits) in [("point", false), ("infinite", true)] {
        let text = Shot::default().text(&format!("LightSource \"{light}\" {floor}"));
        let options = Options::default();
        let mut job = prepare_text(&text, &options);
        let outcome = render_job(&mut job, &options);
        let system = job.plan.systems.iter().find(|system| system.name == "view rays").expect("it is in the plan");
        assert_eq!((system.built, outcome.counters.view_rays > 0), (splits, splits), "{light}");
    }
}
