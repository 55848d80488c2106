//! Lights that move while the shutter is open light as all their places do on average, whatever chooses among them.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::{Options, Shot, View, assert_mean, image_mean};
use lanternfish::render::LightSelection;

/// Still lights that stand for one that moves: their midpoint rule is off by less than the tests can tell.
const PLACES: u32 = 64;

/// Lights, each as what goes before it and what it is. They sweep over the floor, turn, and pass behind the wall.
const LIGHTS: [(&str, &str); 4] = [
    ("Translate $t*1.5 $t*0.5 0", "LightSource \"point\" \"rgb I\" [3 2 1] \"point3 from\" [-1 0.8 0.9]"),
    (
        "Translate 0.5 1 $t*-1 Rotate $t*70 0 0 1",
        "LightSource \"spot\" \"rgb I\" [9 9 20] \"point3 from\" [0 0 0] \"point3 to\" [-0.4 -1 0] \"float coneangle\" 25",
    ),
    (
        "Translate $t*-0.5 1.2 0.5 Rotate $t*-80 1 0 1 Rotate 40 0 1 0",
        "LightSource \"goniometric\" \"rgb I\" [4 1 4] \"string filename\" \"half.pfm\"",
    ),
    (
        "Translate 0 1.5 -1 Rotate $t*50 0 1 0 Rotate 120 1 0 0",
        "LightSource \"projection\" \"string filename\" \"half.pfm\" \"float fov\" 40 \"float scale\" 5",
    ),
];

const SPP: u32 = 2048;

/// The transform at `time`.
fn at(transform: &str, time: f64) -> String {
    let word = |word: &str| match word.strip_prefix("$t*") {
        Some(factor) => (factor.parse::<f64>().expect("a number") * time).to_string(),
        None => word.to_owned(),
    };
    transform.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

fn moving(transform: &str, light: &str) -> String {
    let (start, end) = (at(transform, 0.0), at(transform, 1.0));
    format!(
        "AttributeBegin ActiveTransform StartTime {start} ActiveTransform EndTime {end} ActiveTransform All {light} AttributeEnd\n"
    )
}

/// [`PLACES`] lights that emit as much together, each where the one that moves is for a moment.
fn still(transform: &str, light: &str) -> String {
    let mut text = String::new();
    for place in 0..PLACES {
        let transform = at(transform, (f64::from(place) + 0.5) / f64::from(PLACES));
        let share = 1.0 / f64::from(PLACES);
        let light = match light.split_once("\"float scale\" 5") {
            Some((rest, _)) => format!("{rest} \"float scale\" {}", 5.0 * share),
            None => format!("{light} \"float scale\" {share}"),
        };
        text += &format!("AttributeBegin {transform} {light} AttributeEnd\n");
    }
    text
}

/// A floor, a wall that casts a shadow, and fog.
const SURFACES: &str = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.1 0.1 0.1] \"rgb sigma_s\" [1 1 1]
    AttributeBegin Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5] Shape \"disk\" \"float radius\" 6 AttributeEnd
    AttributeBegin Material \"diffuse\" Shape \"bilinearmesh\" \"point3 P\" [-0.6 0 0.2  0.2 0 -0.4  -0.6 1 0.2  0.2 1 -0.4] AttributeEnd
    AttributeBegin Translate 1.8 0.6 -0.8 MediumInterface \"fog\" \"\" Material \"interface\" Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n";

fn shot() -> Shot {
    Shot { from: [0.0, 3.0, -6.0], to: [0.0, 0.3, 0.0], fov: 40.0, size: 16, depth: 2 }
}

/// A picture whose left half is white.
fn write_picture(folder: &std::path::Path) -> String {
    let path = folder.join("half.pfm");
    let mut pfm = b"PF\n4 4\n-1.0\n".to_vec();
    for pixel in 0..16 {
        let value = if pixel % 4 < 2 { 1.0f32 } else { 0.1 };
        (0..3).for_each(|_| pfm.extend(value.to_le_bytes()));
    }
    std::fs::write(&path, pfm).expect("it can be written");
    path.display().to_string()
}

#[test]
fn lights_that_move_light_as_all_their_places_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = write_picture(folder.path());
    let world = |light: fn(&str, &str) -> String| {
        let lights: String = LIGHTS.iter().map(|(transform, what)| light(transform, what)).collect();
        format!("{}{SURFACES}", lights.replace("half.pfm", &picture))
    };
    let options =
        |lights: LightSelection, splitting: Option<f32>| Options { spp: SPP, lights, splitting, ..Options::default() };
    let (expected, expected_error) =
        image_mean(&shot().render(&world(still), &options(LightSelection::Optimal, None)).film);
    for (name, lights, splitting, factor) in [
        ("uniform", LightSelection::Uniform, None, 4),
        ("optimal", LightSelection::Optimal, None, 1),
        ("tree", LightSelection::Tree, Some(0.0), 2),
        ("tree that splits", LightSelection::Tree, Some(0.9), 2),
        ("cache points", LightSelection::CachePoints, None, 1),
    ] {
        let (mean, error) = image_mean(
            &shot().render(&world(moving), &Options { spp: factor * SPP, ..options(lights, splitting) }).film,
        );
        for c in 0..3 {
            let both = error[c].hypot(expected_error[c]);
            println!("{name}: {:.5} ± {:.5} and {:.5} ± {:.5}", mean[c], error[c], expected[c], expected_error[c]);
            assert!(both < 8e-3 * expected[c], "{name}: {both} is too large to tell");
            assert_mean(name, mean[c], both, expected[c], 2e-3);
        }
    }
    // Each of them moves, and it matters.
    for (transform, what) in LIGHTS {
        let what = what.replace("half.pfm", &picture);
        let of = |time: f64| {
            let world = format!("AttributeBegin {} {what} AttributeEnd\n{SURFACES}", at(transform, time));
            image_mean(&shot().render(&world, &options(LightSelection::Power, None)).film).0
        };
        let (start, end) = (of(0.0), of(1.0));
        assert!((start[0] - end[0]).abs() > 0.03 * end[0], "{what}: {start:?} {end:?}");
    }
}
