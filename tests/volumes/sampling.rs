//! Sampling scattering points along camera rays: null tracking, in-scatter sampling and their mixes give the same image, and where haze is thin and
//! light is in few places, in-scatter sampling gives it with much less noise.
//!
//! Every test that compares images fails by chance with probability 1e-5 (`common::blocks`).

use crate::common::blocks::{Blocks, Family};
use crate::common::{
    CUBE, FLOOR, Options, SLACK, Shot, View, assert_mean, boundary, glow, grid_medium, image_mean, integrate,
    prepare_text, render_text, shuffled_grid,
};
use lanternfish::cache_points::CacheSettings;
use lanternfish::film::Film;
use lanternfish::render::{LightSelection, VolumeSampling};

const RATE: f64 = 1e-5;
const GRID: [usize; 2] = [3, 3];
const SEEDS: u32 = 12;

fn shot() -> Shot {
    Shot { from: [0.0, 1.0, -5.0], to: [0.0, -0.2, 0.0], fov: 50.0, size: 24, depth: 3 }
}

/// A lamp of two, the near one behind a wall as seen from some of the haze.
const LAMPS: &str = "AttributeBegin Translate -0.8 0.4 0.3 AreaLightSource \"diffuse\" \"rgb L\" [9 8 6] Shape \"sphere\" \"float radius\" 0.15 AttributeEnd
    AttributeBegin Translate -0.2 0 0.3 Rotate 90 0 1 0 Material \"diffuse\" Shape \"disk\" \"float radius\" 0.7 AttributeEnd
    LightSource \"point\" \"rgb I\" [0.3 0.4 0.9] \"point3 from\" [1.4 0.9 -0.5]\n";

fn fog(name: &str, absorption: &str, scattering: &str, g: f64) -> String {
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{absorption}] \"rgb sigma_s\" [{scattering}] \"float g\" {g}\n"
    )
}

/// All ways there are, against null tracking.
fn agree(name: &str, shot: &Shot, world: &str, spp: u32, precision: f64) {
    let text = shot.text(world);
    let base = Options { spp, ..Options::default() };
    let of = |volume_sampling| Options { volume_sampling, ..base.clone() };
    let rivals = [
        ("both", of(VolumeSampling::Both)),
        ("paths", of(VolumeSampling::Paths)),
        ("in-scatter", of(VolumeSampling::InScatter)),
        ("auto", of(VolumeSampling::Auto)),
        ("both by cache points", Options { lights: LightSelection::CachePoints, ..of(VolumeSampling::Both) }),
        ("both by the tree", Options { lights: LightSelection::Tree, ..of(VolumeSampling::Both) }),
        ("equi-angular", of(VolumeSampling::EquiAngular)),
    ];
    let render = |options: &Options, seeds| Blocks::render(&mut prepare_text(&text, options), options, GRID, seeds);
    let reference = render(&Options { seed: 1000, spp: 4 * spp, ..of(VolumeSampling::Null) }, 2 * SEEDS);
    let mut family = Family::default();
    for (rival, options) in rivals {
        // Cache points alone, with nothing beside them where they are mistaken, are noisy in thick media.
        let precision = if rival == "in-scatter" && name == "thick" { 2.5 * precision } else { precision };
        family.compare(&format!("{name}, {rival}"), &render(&options, SEEDS), &reference, precision);
    }
    family.assert(RATE);
}

#[test]
fn thin_haze_of_all_colours_around_lamps() {
    let haze = fog("h", "0.01 0.02 0.005", "0.03 0.06 0.12", 0.7);
    let world = format!("{FLOOR}{LAMPS}{haze}{}", boundary("h", "", "Shape \"sphere\" \"float radius\" 4.5"));
    agree("thin", &shot(), &world, 28, 0.02);
}

/// The camera within dense fog, under a sky and a sun.
#[test]
fn thick_fog_around_the_camera() {
    let sky = "LightSource \"infinite\" \"rgb L\" [0.2 0.3 0.5] LightSource \"distant\" \"rgb L\" [2 2 1] \"point3 from\" [1 2 -1] \"point3 to\" [0 0 0]\n";
    let dense = fog("h", "0.1 0.2 0.3", "2 1 0.5", -0.4);
    let world = format!("{FLOOR}{sky}{LAMPS}{dense}{}", boundary("h", "", "Shape \"sphere\" \"float radius\" 9"));
    agree("thick", &shot(), &world, 48, 0.04);
}

/// Haze with no end, a cloud given by a grid in it that takes its place, and another medium over both.
#[test]
fn media_within_and_over_each_other() {
    let medium = |name, g| {
        shuffled_grid(name, &format!("\"rgb sigma_a\" [0.2 0.1 0.4] \"rgb sigma_s\" [1.5 2 1] \"float g\" {g}"))
    };
    let media =
        format!("{}{}{}", fog("h", "0.01 0.01 0.01", "0.05 0.04 0.02", 0.2), medium("c", 0.5), medium("d", -0.5));
    let world = format!(
        "{FLOOR}{LAMPS}{media}{}Translate 0.4 0.3 0.2 Rotate 40 1 2 0 {}{}",
        boundary("h", "", "Shape \"sphere\" \"float radius\" 8"),
        boundary("c", "h", CUBE),
        boundary("d", "", &format!("Scale 0.8 0.8 0.8 {CUBE}")),
    );
    agree("nested", &shot(), &world, 32, 0.02);
}

/// A fire as the only light, in thin haze that scatters forward: phase sampling finds it as well.
#[test]
fn fire_in_haze() {
    let media = format!(
        "{}{}",
        fog("h", "0.01 0.01 0.01", "0.06 0.05 0.04", 0.8),
        grid_medium(
            2,
            "0.2 1 0.5 0.8 1 0 0.3 0.6",
            &format!("\"rgb sigma_a\" [0.3 0.3 0.3] \"rgb sigma_s\" [0.2 0.2 0.2] {}", glow(1.0, 5.0))
        ),
    );
    let world = format!(
        "{FLOOR}{media}{}{}",
        boundary("h", "", "Shape \"sphere\" \"float radius\" 6"),
        boundary("g", "", &format!("Scale 0.5 0.5 0.5 {CUBE}")),
    );
    agree("fire", &shot(), &world, 32, 0.01);
}

/// Narrow beams, one of them along the view; knots lie where rays cross their cones.
#[test]
fn beams_in_haze() {
    let spot = |from: &str, to: &str| {
        format!(
            "LightSource \"spot\" \"rgb I\" [400 300 200] \"float coneangle\" 3 \"float conedeltaangle\" 1 \"point3 from\" [{from}] \"point3 to\" [{to}]\n"
        )
    };
    let beams = [spot("-3 0 1", "3 0.5 1"), spot("2.5 3 2", "-1 -1 0"), spot("0.3 0.4 5", "0 0.2 -2")].concat();
    let haze = fog("h", "0.002 0.002 0.002", "0.004 0.006 0.008", 0.3);
    let world = format!("{FLOOR}{beams}{haze}{}", boundary("h", "", "Shape \"sphere\" \"float radius\" 7"));
    let shot = Shot { depth: 1, ..shot() };
    agree("beams", &shot, &world, 96, 0.02);
}

/// Haze seen in a mirror, through a pane of glass, and in the mirror through the pane: points are drawn on those rays too. The fog before them tells
/// channels apart, the glass scales radiance, and neither is the same for all rays of a pixel.
#[test]
fn haze_behind_mirrors_and_glass() {
    let haze = fog("h", "0.03 0.02 0.01", "0.05 0.08 0.15", 0.6);
    let pane = format!("Material \"dielectric\" \"float eta\" 1.4 Scale 0.5 0.7 0.02 {CUBE}");
    let world = format!(
        "{FLOOR}{LAMPS}AttributeBegin Material \"conductor\" Translate 0.9 0.3 1.2 Rotate -125 0 1 0 Shape \"disk\" \"float radius\" 1.1 AttributeEnd
         AttributeBegin Translate 0.3 0.4 -2 Rotate 20 0 1 0 {pane} AttributeEnd\n{haze}{}",
        boundary("h", "", "Shape \"sphere\" \"float radius\" 6")
    );
    agree("mirrors", &Shot { depth: 5, ..shot() }, &world, 32, 0.02);
}

/// Where nothing can be learned or drawn: black lights beside lamps, a medium that does not scatter, lights linked away.
#[test]
fn nothing_to_draw() {
    let clear = fog("h", "0.1 0.2 0.3", "0 0 0", 0.0);
    let black = fog("b", "0.2 0.2 0.2", "0 0.5 0", 0.0);
    let world = format!(
        "{FLOOR}{LAMPS}LightSource \"point\" \"rgb I\" [0 0 0]\n{clear}{black}{}{}",
        boundary("h", "", "Shape \"sphere\" \"float radius\" 8"),
        boundary("b", "", "Shape \"sphere\" \"float radius\" 1")
    );
    agree("clear", &shot(), &world, 32, 0.03);
}

/// Along a ray past a point light in haze without end, against the integral of the single scattering (Pharr, Jakob, Humphreys 2023, eq. 14.3 with
/// one scattering).
#[test]
fn single_scattering_is_its_integral() {
    let (distance, side, scattering, absorption) = (3.0f64, 0.5f64, 0.08f64, 0.02f64);
    for g in [0.0, 0.9, -0.6] {
        let haze = fog(
            "h",
            &format!("{absorption} {absorption} {absorption}"),
            &format!("{scattering} {scattering} {scattering}"),
            g,
        );
        let light = format!("LightSource \"point\" \"rgb I\" [5 5 5] \"point3 from\" [{side} 0 {distance}]\n");
        let ball = boundary("h", "", "Shape \"sphere\" \"float radius\" 200");
        let extinction = scattering + absorption;
        let radiance = |t: f64| {
            let (dx, dz) = (side, distance - t);
            let to_light = dx.hypot(dz);
            // The cosine between where the light comes from and the way on, from the light's side.
            let cos = -dz / to_light;
            let phase = (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g + 2.0 * g * cos).powf(1.5));
            5.0 / to_light.powi(2) * phase * scattering * (-extinction * (t + to_light)).exp()
        };
        let expected = integrate(0.0, 6.0, 400, radiance) + integrate(6.0, 200.0, 400, radiance);
        let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 0.01, size: 8, depth: 1 };
        for sampling in [VolumeSampling::Both, VolumeSampling::InScatter] {
            let options = Options { spp: 512, volume_sampling: sampling, ..Options::default() };
            let (mean, error) = image_mean(&shot.render(&format!("{light}{haze}{ball}"), &options).film);
            println!("g = {g}, {sampling:?}: {} ± {}, expected {expected}", mean[1], error[1]);
            assert!(error[1] < 0.015 * expected, "{} is vague beside {expected}", error[1]);
            assert_mean(&format!("g = {g}, {sampling:?}"), mean[1], error[1], expected, SLACK);
        }
    }
}

fn variance(film: &Film) -> f64 {
    let image = film.channels();
    let channels = ["variance.R", "variance.G", "variance.B"];
    channels.iter().flat_map(|name| image.channel(name).expect("the variance")).map(|v| f64::from(*v)).sum()
}

/// A room full of haze that a sun shines into through a slit. Null tracking seldom scatters, and where it does it is seldom in the light.
#[test]
fn a_shaft_of_light_has_a_fraction_of_the_variance() {
    let wall = |p: &str| format!("Shape \"trianglemesh\" \"point3 P\" [{p}] \"integer indices\" [0 1 2 0 2 3]\n");
    // A box from −3 to 3 whose roof has a slit.
    let walls = [
        wall("-3 -3 -3 3 -3 -3 3 -3 3 -3 -3 3"),
        wall("-3 -3 -3 -3 -3 3 -3 3 3 -3 3 -3"),
        wall("3 -3 -3 3 -3 3 3 3 3 3 3 -3"),
        wall("-3 -3 3 3 -3 3 3 3 3 -3 3 3"),
        wall("-3 -3 -3.1 3 -3 -3.1 3 3 -3.1 -3 3 -3.1"),
        wall("-3 3 -3.1 -0.3 3 -3.1 -0.3 3 3 -3 3 3"),
        wall("0.3 3 -3.1 3 3 -3.1 3 3 3 0.3 3 3"),
    ]
    .concat();
    let haze = fog("h", "0.002 0.002 0.002", "0.02 0.02 0.02", 0.4);
    let pane = format!(
        "AttributeBegin Material \"dielectric\" \"float eta\" 1.5 Translate 0 0 -2.6 Scale 2.9 2.9 0.02 {CUBE} AttributeEnd\n"
    );
    // Seen with nothing between, and through a pane of glass.
    for (between, depth) in [("", 1), (pane.as_str(), 3)] {
        let world = format!(
            "LightSource \"distant\" \"rgb L\" [9 9 9] \"point3 from\" [0.2 1 0.1] \"point3 to\" [0 0 0]
             AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.02 0.02 0.02] {walls} AttributeEnd\n{between}{haze}{}",
            boundary("h", "", &format!("Scale 2.99 2.99 2.99 {CUBE}"))
        );
        let shot = Shot { from: [0.0, 0.0, -2.9], to: [0.0, 0.0, 1.0], fov: 60.0, size: 32, depth };
        let render = |volume_sampling| {
            let options = Options { spp: 64, volume_sampling, cache: CacheSettings::default(), ..Options::default() };
            render_text(&shot.text(&world), &options).film
        };
        let [null, both, auto] =
            [VolumeSampling::Null, VolumeSampling::Both, VolumeSampling::Auto].map(|s| variance(&render(s)));
        println!("depth {depth}: null {null}, both {both}: {}, auto {auto}: {}", null / both, null / auto);
        assert!(null > 6.0 * both && null > 5.0 * auto, "{null} {both} {auto}");
    }
}
