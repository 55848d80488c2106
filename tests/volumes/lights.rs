//! Media that emit as lights: whatever chooses the lights, and whether media are among them or not, the image is the same; with them, what a fire
//! lights is seen at once.
//!
//! Every test that compares images fails by chance with probability 1e-5 (`common::blocks`).

use crate::common::blocks::{Blocks, Family};
use crate::common::{
    CUBE, FLOOR, Options, Shot, View, boundary, glow, grid_medium, image_mean, prepare_text, render_text, shuffled_grid,
};
use lanternfish::cache_points::CacheSettings;
use lanternfish::film::Film;
use lanternfish::render::{LightSelection, VolumeLights};

const RATE: f64 = 1e-5;
const GRID: [usize; 2] = [3, 3];
const SEEDS: u32 = 12;

fn shot() -> Shot {
    Shot { from: [0.0, 3.0, -5.0], to: [0.0, -0.6, 0.0], fov: 50.0, size: 24, depth: 3 }
}

/// A fire of 4³ samples from −1 to 1: its densities a shuffle, its radiances another.
fn fire(name: &str, parameters: &str) -> String {
    let glow: Vec<String> = (0..64).map(|i| format!("{}", if i * 29 % 64 < 20 { i * 29 % 64 } else { 0 })).collect();
    shuffled_grid(name, &format!("\"float Lescale\" [{}] {parameters}", glow.join(" ")))
}

/// The fire in its box, `size` times as large (the grid stays).
fn placed(name: &str, size: f64) -> String {
    boundary(name, "", &format!("Scale {size} {size} {size} {CUBE}"))
}

const THIN: &str = "\"rgb sigma_a\" [0.02 0.02 0.04] \"rgb sigma_s\" [0.01 0.01 0.01] \"rgb Le\" [3 2 1]";
const SMOKY: &str = "\"rgb sigma_a\" [1 1.5 2] \"rgb sigma_s\" [2 2 3] \"float g\" 0.4 \"rgb Le\" [1.5 1 0.5]";

/// Every way of choosing with media among the lights, against none.
fn agree(name: &str, world: &str, spp: u32, precision: f64) {
    let text = shot().text(world);
    let base = Options { spp, ..Options::default() };
    let of = |lights| Options { lights, ..base.clone() };
    let points = |cache| Options { cache, ..of(LightSelection::CachePoints) };
    let rivals = [
        ("auto", of(LightSelection::Auto)),
        ("uniform", of(LightSelection::Uniform)),
        ("power", of(LightSelection::Power)),
        ("optimal of 4", Options { light_candidates: Some(4), ..of(LightSelection::Optimal) }),
        ("tree", Options { splitting: Some(0.0), ..of(LightSelection::Tree) }),
        ("tree that splits", Options { splitting: Some(1.0), ..of(LightSelection::Tree) }),
        ("points", points(CacheSettings::default())),
        ("points, few", points(CacheSettings { entries: 4, normals: false, ..CacheSettings::default() })),
    ];
    let render = |options: &Options, seeds| Blocks::render(&mut prepare_text(&text, options), options, GRID, seeds);
    let off = Options { volume_lights: VolumeLights::Off, seed: 1000, spp: 8 * spp, ..of(LightSelection::Optimal) };
    let reference = render(&off, 2 * SEEDS);
    let mut family = Family::default();
    for (rival, options) in rivals {
        family.compare(&format!("{name}, {rival}"), &render(&options, SEEDS), &reference, precision);
    }
    family.assert(RATE);
}

#[test]
fn a_thin_fire_over_a_floor() {
    agree("thin", &format!("{FLOOR}{}{}", fire("f", THIN), placed("f", 1.0)), 64, 0.01);
}

#[test]
fn a_smoky_fire_beside_a_lamp_and_under_a_sky() {
    let lamp = "AttributeBegin Translate 1.5 0.5 1.5 AreaLightSource \"diffuse\" \"rgb L\" [2 2 4] Shape \"sphere\" \"float radius\" 0.3 AttributeEnd
        LightSource \"infinite\" \"rgb L\" [0.05 0.05 0.1] LightSource \"point\" \"rgb I\" [0.5 0.5 0.5] \"point3 from\" [-2 1 1]\n";
    agree("smoky", &format!("{FLOOR}{lamp}{}{}", fire("f", SMOKY), placed("f", 1.0)), 64, 0.01);
}

/// Two fires and glowing fog in each other, one of them cut by its boundary; and the camera within the fog.
#[test]
fn fires_that_overlap() {
    let fog = "MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.02 0.01 0.03] \"rgb sigma_s\" [0.05 0.05 0.02] \"rgb Le\" [0.4 0.2 0.5]\n";
    let world = format!(
        "{FLOOR}{fog}{}Translate 0.5 0.2 0.3 Rotate 30 1 2 0 {}{}{}{}",
        fire("f", THIN),
        fire("g", SMOKY),
        placed("f", 0.8),
        placed("g", 1.0),
        boundary("h", "", "Shape \"sphere\" \"float radius\" 8")
    );
    agree("overlapping", &world, 64, 0.01);
}

/// In a box of glass, which no sampled line leaves: all that the floor sees comes from rays that happen to be refracted. Beside it a
/// box that is only a boundary, partly behind a wall.
#[test]
fn a_fire_behind_glass_and_a_wall() {
    let glass = "AttributeBegin MediumInterface \"f\" \"\" Material \"dielectric\" Scale 0.9 0.9 0.9 Shape \"sphere\" AttributeEnd\n";
    let wall = "AttributeBegin Translate 1.2 0 0 Rotate 90 0 1 0 Material \"diffuse\" \"rgb reflectance\" [0.4 0.4 0.4] Shape \"disk\" \"float radius\" 1 AttributeEnd\n";
    let world = format!(
        "{FLOOR}{wall}{}{glass}Translate 2 0 0.5 Scale 0.6 0.6 0.6 {}{}",
        fire("f", THIN),
        fire("g", THIN),
        placed("g", 1.0)
    );
    agree("glass", &world, 64, 0.02);
}

fn variance(film: &Film) -> f64 {
    let image = film.channels();
    ["variance.R", "variance.G", "variance.B"]
        .iter()
        .flat_map(|name| image.channel(name).expect("the variance"))
        .map(|v| f64::from(*v))
        .sum()
}

/// A small fire over a floor that does not see itself: all light on it comes from the fire, and most rays miss that.
#[test]
fn a_lit_floor_has_a_twentieth_of_the_variance() {
    let fire = format!("AttributeBegin Scale 0.15 0.15 0.15 {}{}AttributeEnd\n", fire("f", THIN), placed("f", 1.0));
    // Below the fire, which is not in the picture.
    let camera = Shot { from: [0.0, -0.4, -4.0], to: [0.0, -1.2, -1.0], fov: 20.0, size: 16, depth: 2 };
    let render = |volume_lights| {
        let options = Options { spp: 256, volume_lights, cache: CacheSettings::default(), ..Options::default() };
        camera.render(&format!("{FLOOR}{fire}"), &options).film
    };
    let (with, without) = (variance(&render(VolumeLights::Auto)), variance(&render(VolumeLights::Off)));
    println!("{:.1} times less variance", without / with);
    assert!(with * 20.0 < without, "{with} and {without}");
}

/// Of objects that name their lights a medium is none, but what it emits is not linked: they see it by their own rays.
#[test]
fn linking_leaves_emission_alone() {
    let linked = FLOOR.replace("Shape \"disk\"", "Shape \"disk\" \"string lights\" []");
    let fire = format!("{}{}", fire("f", THIN), placed("f", 1.0));
    let text = |floor: &str| {
        shot().text(&format!("LightSource \"point\" \"string name\" \"p\" \"rgb I\" [0 0 0]\n{floor}{fire}"))
    };
    let render =
        |text: &str, options: &Options, seeds| Blocks::render(&mut prepare_text(text, options), options, GRID, seeds);
    let options = Options { spp: 128, ..Options::default() };
    let mut family = Family::default();
    for lights in [LightSelection::Optimal, LightSelection::Uniform, LightSelection::CachePoints] {
        let options = Options { lights, ..options.clone() };
        let [a, b] = [&linked, FLOOR].map(|floor| render(&text(floor), &options, SEEDS));
        family.compare("linked", &a, &b, 0.02);
    }
    family.assert(RATE);
}

#[test]
fn bits_do_not_depend_on_threads() {
    let text = shot().text(&format!("{FLOOR}LightSource \"point\"\n{}{}", fire("f", SMOKY), placed("f", 1.0)));
    for lights in [LightSelection::Auto, LightSelection::CachePoints] {
        let render = |threads| {
            render_text(&text, &Options { spp: 8, lights, threads, ..Options::default() }).film.beauty().pixels
        };
        let one = render(1);
        assert!(one == render(2) && one == render(3));
    }
}

/// What is a light, and with which bounces, decides nothing about how much there is: depth by depth.
#[test]
fn depths_agree() {
    let world = format!("{FLOOR}{}{}", fire("f", SMOKY), placed("f", 1.0));
    for depth in [0, 1, 2] {
        let camera = Shot { depth, ..shot() };
        let of = |volume_lights| {
            let options = Options { spp: 256, volume_lights, ..Options::default() };
            image_mean(&camera.render(&world, &options).film)
        };
        let ((a, ea), (b, eb)) = (of(VolumeLights::Auto), of(VolumeLights::Off));
        for c in 0..3 {
            crate::common::assert_mean("depth", a[c], ea[c].hypot(eb[c]), b[c], 2e-5);
        }
        assert!(depth == 0 || a[0] > 0.0);
    }
}

/// No sample is NaN or infinite, and all renders end.
#[test]
fn extremes_end() {
    let (grid, le) = (grid_medium, glow);
    let cases = [
        ("one voxel", grid(1, "1", &le(1.0, 1.0))),
        ("empty", grid(2, "0 0 0 0 0 0 0 0", &le(1.0, 1.0))),
        ("thin and bright", grid(2, "1 0 0 0 0 0 0 1", &le(1e-9, 1e15))),
        ("dense", grid(2, "1 0 0 0 0 0 0 1", &le(1e3, 1e6))),
        ("all of it", grid(2, "1e-9 1e3 0 0 1 0 0 1e-9", &le(1.0, 1e6))),
        ("brightest", grid(1, "1", &le(1.0, 1e36))),
        ("of one colour", grid(1, "1", "\"rgb sigma_a\" [0 0 1] \"rgb sigma_s\" [1 0 0] \"rgb Le\" [1 1 1]")),
        ("of no colour", grid(1, "1", "\"rgb sigma_a\" [0 1 0] \"rgb sigma_s\" [1 0 0] \"rgb Le\" [1 0 1]")),
    ];
    for (what, medium) in cases {
        // Also a floor that ends within the fire, and a thousandth as large.
        for (size, height) in [(1.0, -1.2), (1.0, 0.0), (1e-3, -1.2)] {
            let floor = FLOOR.replace("-1.2", &height.to_string());
            let shot = Shot {
                from: [0.0, 3.0 * size, -5.0 * size],
                to: [0.0, -0.6 * size, 0.0],
                size: 12,
                depth: 4,
                ..shot()
            };
            let world = format!("Scale {size} {size} {size} {floor}{medium}{}", placed("g", 1.0));
            for lights in [LightSelection::Auto, LightSelection::CachePoints] {
                let world = format!("LightSource \"point\" \"point3 from\" [0 2 0]\n{world}");
                let outcome = shot.render(&world, &Options { spp: 4, lights, ..Options::default() });
                assert_eq!(outcome.film.rejected().0, 0, "{what}, {size}, {height}");
            }
        }
    }
}
