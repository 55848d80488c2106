//! Numbers hold up wherever lights are and however strong they are: no sample is NaN or infinite, and the image is the one it must be, by
//! cache points, the tree, and asking every light.
//!
//! Comparisons of means fail by chance with probability 1e-6 (`common::assert_mean`), those of blocks with 1e-6 a test
//! (`common::blocks`). The others compare images of one seed, sample by sample: see each.

use crate::common::blocks::{Blocks, Family};
use crate::common::{Options, Shot, View, assert_mean, difference, image_mean, prepare_text};
use lanternfish::cache_points::CacheSettings;
use lanternfish::film::Film;
use lanternfish::render::LightSelection;

const KINDS: [LightSelection; 3] = [LightSelection::Optimal, LightSelection::CachePoints, LightSelection::Tree];

const FLOOR: &str =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-3 0 -3  3 0 -3  3 0 3  -3 0 3]\n";
const WALL: &str =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-3 0 2  3 0 2  3 3 2  -3 3 2]\n";
const BALL: &str = "AttributeBegin Translate 0.8 0.4 0.3 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n";

fn point(intensity: f64, [x, y, z]: [f64; 3]) -> String {
    format!(
        "LightSource \"point\" \"rgb I\" [{intensity:e} {intensity:e} {intensity:e}] \"point3 from\" [{x} {y} {z}]\n"
    )
}

/// A lamp of any shape, whose own material is black.
fn lamp(radiance: f64, shape: &str) -> String {
    format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{radiance:e} {radiance:e} {radiance:e}] \"bool twosided\" true
         Material \"diffuse\" \"rgb reflectance\" [0 0 0] {shape} AttributeEnd\n"
    )
}

/// Twelve lights of several kinds, points `by` times as strong.
fn several(by: f64, by_area: f64) -> String {
    let points = (0..6).map(|i| point((1 + i) as f64 * by, [f64::from(i) - 2.5, 1.5 + 0.2 * f64::from(i % 3), -1.0]));
    let balls =
        (0..4).map(|i| lamp(6.0 * by_area, &format!("Translate {} 1 1 Shape \"sphere\" \"float radius\" 0.1", i - 2)));
    let mesh = lamp(
        3.0 * by_area,
        "Translate 0 2 0 Shape \"trianglemesh\" \"integer indices\" [0 1 2 1 3 2] \"point3 P\" [0 0 0  1 0 0  0 0.1 1  1 0.2 1]",
    );
    let strength = 40.0 * by;
    let spot = format!(
        "LightSource \"spot\" \"rgb I\" [{strength:e} {strength:e} {strength:e}] \"point3 from\" [2 3 -2] \"point3 to\" [0 0 0]\n"
    );
    points.chain(balls).chain([mesh, spot]).collect()
}

fn scenery() -> String {
    format!(
        "Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]\n{FLOOR}{WALL}Material \"conductor\" \"float roughness\" 0.4\n{BALL}"
    )
}

fn shot() -> Shot {
    Shot { from: [0.0, 3.0, -5.0], to: [0.0, 0.6, 0.0], fov: 40.0, size: 24, depth: 3 }
}

fn options(lights: LightSelection, spp: u32) -> Options {
    Options { lights, spp, cache: CacheSettings::default(), ..Options::default() }
}

#[track_caller]
fn film(shot: &Shot, world: &str, options: &Options) -> Film {
    let film = shot.render(world, options).film;
    assert_eq!(film.rejected().0, 0, "{:?}: samples were NaN or infinite", options.lights);
    film
}

/// The ways of choosing agree on every block.
fn agree(what: &str, world: &str, precision: f64) {
    let text = shot().text(world);
    let mut family = Family::default();
    let render = |options: &Options| Blocks::render(&mut prepare_text(&text, options), options, [2, 2], 16);
    let reference = render(&Options { seed: 100, ..options(LightSelection::Optimal, 16) });
    for kind in &KINDS[1..] {
        family.compare(&format!("{what}, {kind:?}"), &render(&options(*kind, 16)), &reference, precision);
    }
    family.assert(1e-6);
}

#[test]
fn strengths_from_1e_minus_12_to_1e12() {
    let lights: String = (0..25)
        .map(|i| point(10f64.powi(i - 12), [f64::from(i % 5) - 2.0, 1.0 + f64::from(i % 3), f64::from(i / 5) - 2.5]))
        .collect();
    agree("all strengths", &format!("{lights}{}", scenery()), 0.02);
    let balls: String = (0..25)
        .map(|i| {
            let (x, y, z) = (i % 5 - 2, 1 + i % 3, i / 5 - 3);
            lamp(10f64.powi((7 * i) % 25 - 12), &format!("Translate {x} {y} {z} Shape \"sphere\" \"float radius\" 0.1"))
        })
        .collect();
    agree("all strengths of balls", &format!("{balls}{}", scenery()), 0.02);
}

/// The same image but for the factor: a power of two changes no digit, so every sample goes the same way.
#[test]
fn light_is_proportional_to_strength() {
    for kind in KINDS {
        let render = |by: f64| film(&shot(), &format!("{}{}", several(by, by), scenery()), &options(kind, 4)).beauty();
        let one = render(1.0);
        for exponent in [-40, 40] {
            let by = 2f32.powi(exponent);
            let other = render(f64::from(by));
            for (x, y) in one.pixels.iter().zip(&other.pixels) {
                assert!((y / by - x).abs() <= 1e-5 * x, "{kind:?}, 2^{exponent}: {x} and {}", y / by);
            }
        }
    }
}

/// A hundred thousand lights in one place are one light a hundred thousand times as strong, whichever is chosen. Images of one seed see
/// the same, so what sets them apart is the choice alone.
#[test]
fn many_lights_in_one_place_are_one() {
    const COUNT: usize = 100_000;
    let at = [-0.5, 1.5, -0.8];
    let shot = Shot { depth: 1, ..shot() };
    let one = film(&shot, &format!("{}{}", point(8.0, at), scenery()), &options(LightSelection::Optimal, 4)).beauty();
    let many = format!("{}{}", point(8.0 / COUNT as f64, at).repeat(COUNT), scenery());
    for kind in KINDS {
        let other = film(&shot, &many, &options(kind, 4)).beauty();
        let excess: Vec<f64> = other.pixels.iter().zip(&one.pixels).map(|(a, b)| f64::from(a - b)).collect();
        let count = excess.len() as f64;
        let mean = excess.iter().sum::<f64>() / count;
        // The three channels of a pixel go together.
        let error = (3.0 * excess.iter().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt() / count;
        let whole = one.pixels.iter().map(|x| f64::from(*x)).sum::<f64>() / count;
        println!("{kind:?}: {mean:.2e} ± {error:.1e} beyond {whole:.4}");
        assert!(error < 2e-3 * whole, "{kind:?}: {error} is too large to tell");
        assert_mean(&format!("{kind:?}"), whole + mean, error, whole, crate::common::SLACK);
    }
}

#[test]
fn lights_in_one_place_add_up() {
    let pile: String = (0..12).map(|i| point(f64::from(i % 4), [-0.5, 1.5, -0.8])).collect();
    // One around the other: which of two equal ones a ray meets would be anyone's guess.
    let ball =
        |i| lamp(2.0, &format!("Translate 1 2 -0.5 Shape \"sphere\" \"float radius\" {}", 0.2 + 0.01 * f64::from(i)));
    let balls: String = (0..4).map(ball).collect();
    agree("a pile", &format!("{pile}{balls}{}{}", several(0.1, 0.1), scenery()), 0.02);
}

#[test]
fn lights_on_what_they_light() {
    let on = [
        point(3.0, [0.0, 0.0, 0.0]),
        point(3.0, [-1.0, 0.0, -1.0]),
        point(2.0, [0.8, 0.8, 0.3]),
        point(2.0, [1.0, 1.0, 2.0]),
    ];
    agree("points on surfaces", &format!("{}{}{}", on.concat(), several(0.2, 0.2), scenery()), 0.02);
    // In the floor's plane beside it, and in the wall's, before it.
    let coplanar = [
        lamp(4.0, "Translate 4 0 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 1"),
        lamp(4.0, "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point3 P\" [-3 0 -3  -3 0 3  -4 0 0]"),
        lamp(4.0, "Shape \"bilinearmesh\" \"point3 P\" [3 0 2  4 0 2  3 1 2  4 1 2]"),
        lamp(4.0, "Translate -2 0 -1 Shape \"sphere\" \"float radius\" 0.5"),
    ];
    agree("lamps in the plane", &format!("{}{}{}", coplanar.concat(), several(0.2, 0.2), scenery()), 0.02);
}

#[test]
fn a_light_at_the_camera() {
    agree("at the camera", &format!("{}{}{}", point(30.0, shot().from), several(0.3, 0.3), scenery()), 0.02);
    let around = lamp(0.3, "Translate 0 3 -5 Shape \"sphere\" \"float radius\" 0.05");
    let world = format!("{around}{}", several(1.0, 1.0));
    for kind in KINDS {
        // Inside of a lamp there is nothing else to see.
        let (mean, _) = image_mean(&film(&shot(), &world, &options(kind, 2)));
        assert!((mean[0] - 0.3).abs() < 1e-6, "{kind:?}: {mean:?}");
    }
}

#[test]
fn lights_without_strength_are_as_good_as_not_there() {
    let dark: String = (0..10)
        .map(|i| point(0.0, [f64::from(i) - 4.0, 0.5, 0.0]) + &lamp(0.0, "Translate 0 5 0 Shape \"sphere\""))
        .collect();
    let lit = several(1.0, 1.0);
    for kind in KINDS {
        let (expected, expected_error) =
            image_mean(&film(&shot(), &format!("{lit}{}", scenery()), &options(LightSelection::Optimal, 256)));
        let without = "Translate 0 5 0 Shape \"sphere\"";
        assert!(dark.contains(without));
        let (mean, error) = image_mean(&film(&shot(), &format!("{lit}{dark}{}", scenery()), &options(kind, 256)));
        println!("{kind:?}: {mean:?} ± {error:?}, {expected:?} ± {expected_error:?}");
        for c in 0..3 {
            assert_mean("with dark lights", mean[c], error[c].hypot(expected_error[c]), expected[c], 0.0);
        }
    }
}

const FOG: f64 = 0.05;

/// Everything in a size, in fog; what depends on lengths along with it.
fn sized(scale: f64, place: f64) -> (Shot, String) {
    let s = FOG / scale;
    let [from, to] = [shot().from, shot().to].map(|p| p.map(|x| x * scale + place));
    // Balls in fog only: close to points light is without bounds, and its noise too.
    let balls: String = (0..8)
        .map(|i| lamp(6.0, &format!("Translate {} {} 1 Shape \"sphere\" \"float radius\" 0.1", i - 4, 1 + i % 3)))
        .collect();
    let points: String = (0..4).map(|i| point(2.0 * scale * scale, [f64::from(i) - 1.5, 3.0, -2.0])).collect();
    let fog = format!(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{s} {s} {s}] \"rgb sigma_s\" [{s} {s} {s}]\n"
    );
    let fog = fog
        + &crate::common::boundary("fog", "", &format!("Translate 0 1.01 0 Scale 2.5 1 1.5 {}", crate::common::CUBE));
    let world =
        format!("Translate {place} {place} {place} Scale {scale} {scale} {scale}\n{points}{balls}{}{fog}", scenery());
    (Shot { from, to, ..shot() }, world)
}

/// Powers of two change no digit, powers of ten the last ones: then some samples go another way.
#[test]
fn a_scene_may_be_of_any_size() {
    for kind in KINDS {
        let render = |scale: f64, spp| {
            let (shot, world) = sized(scale, 0.0);
            film(&shot, &world, &options(kind, spp))
        };
        let one = render(1.0, 8);
        for exponent in [-20, 20] {
            let apart = difference(&render(2f64.powi(exponent), 8), &one);
            assert!(apart < 1e-6, "{kind:?}, 2^{exponent}: relative RMSE {apart}");
        }
        let (expected, expected_error) = image_mean(&render(1.0, 128));
        for scale in [1e-6, 1e6] {
            let (mean, error) = image_mean(&render(scale, 128));
            for c in 0..3 {
                assert_mean(
                    &format!("{kind:?}, {scale:e}"),
                    mean[c],
                    error[c].hypot(expected_error[c]),
                    expected[c],
                    0.0,
                );
            }
        }
    }
}

/// The camera is the origin of all that is computed in f32, and the move to it is made in f64, where 1e7 units have steps of 2e-9: a
/// last digit differs here and there, and a sample in a thousand may go another way. In f32 the steps would be of 1.
#[test]
fn a_scene_may_be_anywhere() {
    for kind in KINDS {
        let render = |place: f64| {
            let (shot, world) = sized(1.0, place);
            film(&shot, &world, &options(kind, 8))
        };
        let here = render(0.0);
        for place in [1e7, -3e6] {
            let apart = difference(&render(place), &here);
            println!("{kind:?}, {place:e}: relative RMSE {apart:.1e}");
            assert!(apart < 1e-3, "{kind:?}, {place:e}: relative RMSE {apart}");
        }
    }
}
