//! Whatever chooses the lights, the image is the same; the layers add up to it; and the camera knows which media it stands in.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::{CUBE, Framed, Options, Shot, View, assert_mean, boundary, image_mean, shuffled_grid};
use lanternfish::render::LightSelection;

/// One light of each type. Where `lit` does not name its place, a light is left out, but its shape stays and casts its shadow.
fn lights(lit: impl Fn(usize) -> bool) -> String {
    let sources = [
        "LightSource \"point\" \"rgb I\" [6 3 2] \"point3 from\" [-1 2 -2]",
        "LightSource \"spot\" \"rgb I\" [20 25 20] \"point3 from\" [2 2 -2] \"point3 to\" [0 -1 0] \"float coneangle\" 35",
        "LightSource \"distant\" \"rgb L\" [0.3 0.3 0.6] \"point3 from\" [-1 1 -1] \"point3 to\" [0 0 0]",
        "LightSource \"infinite\" \"rgb L\" [0.1 0.1 0.2]",
    ];
    let areas = [
        ("[8 6 4]", "Translate 1 1.6 0 Shape \"sphere\" \"float radius\" 0.2"),
        ("[3 3 5]", "Translate -1.4 0.2 0.6 Rotate 60 0 1 0 Shape \"disk\" \"float radius\" 0.5"),
        (
            "[9 9 2]",
            "Translate -0.5 1.4 0.5 Scale 0.2 0.2 0.2 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0.5 1 1 1] \"integer indices\" [0 1 2 1 3 2]",
        ),
        ("[2 7 2]", "Shape \"bilinearmesh\" \"point3 P\" [0.6 1 1  1.4 1 1  0.6 1.5 1.2  1.4 1.5 0.8]"),
    ];
    let mut text = String::new();
    for (i, source) in sources.iter().enumerate().filter(|(i, _)| lit(*i)) {
        text += &format!("{source} # {i}\n");
    }
    for (i, (radiance, shape)) in areas.iter().enumerate() {
        let light = if lit(i + sources.len()) {
            format!("AreaLightSource \"diffuse\" \"rgb L\" {radiance} \"bool twosided\" true")
        } else {
            String::new()
        };
        text +=
            &format!("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] {light} {shape} AttributeEnd\n");
    }
    text
}

const COUNT: usize = 8;

fn surfaces() -> String {
    "AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5]
     Shape \"disk\" \"float radius\" 5 AttributeEnd
     AttributeBegin Translate 0.6 -0.4 0 Material \"conductor\" \"float roughness\" 0.3 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd
     AttributeBegin Translate -0.7 -0.4 -0.3 Material \"coateddiffuse\" \"float roughness\" 0.2 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n"
        .to_owned()
}

fn media(glow: &str) -> String {
    format!(
        "{}MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.1 0.2 0.1] \"rgb sigma_s\" [0.5 0.4 0.3] \"float g\" 0.6
         {}{}",
        shuffled_grid("g", &format!("\"rgb sigma_a\" [0.1 0.2 0.4] \"rgb sigma_s\" [2 1.5 1] \"float g\" -0.3 {glow}")),
        boundary("g", "", &format!("Scale 0.9 0.9 0.9 {CUBE}")),
        boundary("h", "", "Translate 0.3 0.4 0 Shape \"sphere\" \"float radius\" 1.1"),
    )
}

fn shot() -> Shot {
    Shot { from: [0.0, 1.0, -5.0], to: [0.0, 0.2, 0.0], fov: 45.0, size: 16, depth: 3 }
}

fn options(lights: LightSelection, spp: u32) -> Options {
    Options { spp, lights, ..Options::default() }
}

fn agree(world: &str, spp: u32) {
    let (mean, error) = image_mean(&shot().render(world, &options(LightSelection::Optimal, spp)).film);
    let rivals = [
        ("uniform", LightSelection::Uniform, None, 4),
        ("power", LightSelection::Power, None, 4),
        ("tree", LightSelection::Tree, Some(0.0), 2),
        ("tree that splits", LightSelection::Tree, Some(0.9), 2),
    ];
    for (name, lights, splitting, factor) in rivals {
        let options = Options { splitting, ..options(lights, factor * spp) };
        let (other, other_error) = image_mean(&shot().render(world, &options).film);
        for c in 0..3 {
            let both = error[c].hypot(other_error[c]);
            println!("{name}: {:.5} ± {:.5} and {:.5} ± {:.5}", mean[c], error[c], other[c], other_error[c]);
            assert!(both < 5e-3 * mean[c], "{name}: {both} is too large to tell");
            assert_mean(name, other[c], both, mean[c], 0.0);
        }
    }
    // Light is additive: each alone, all together.
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    for i in 0..COUNT {
        let alone = world.replace(&lights(|_| true), &lights(|k| k == i));
        assert_ne!(alone, world);
        let (part, part_error) = render_alone(&alone, spp);
        for c in 0..3 {
            sum[c] += part[c];
            squares[c] += part_error[c].powi(2);
        }
    }
    for c in 0..3 {
        let both = (error[c].powi(2) + squares[c]).sqrt();
        println!("one by one: {:.5} and {:.5} ± {both:.5}", mean[c], sum[c]);
        assert!(both < 7e-3 * mean[c], "one by one: {both} is too large to tell");
        assert_mean("one by one", sum[c], both, mean[c], 0.0);
    }
}

fn render_alone(world: &str, spp: u32) -> ([f64; 3], [f64; 3]) {
    image_mean(&shot().render(world, &options(LightSelection::Uniform, spp)).film)
}

#[test]
fn selectors_agree_on_surfaces() {
    agree(&format!("{}{}", lights(|_| true), surfaces()), 1024);
}

#[test]
fn selectors_agree_in_media() {
    agree(&format!("{}{}{}", lights(|_| true), surfaces(), media("")), 1024);
}

#[test]
fn layers_add_up_to_the_beauty() {
    for media in [String::new(), media("\"rgb Le\" [0.1 0.1 0.1]")] {
        let glass = "AttributeBegin Translate 0 0.6 -1 Material \"dielectric\" Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n";
        let world = format!("{}{}{media}{glass}", lights(|_| true), surfaces());
        let outcome = shot().render(&world, &options(LightSelection::Optimal, 16));
        let image = outcome.film.channels();
        let mut seen = [0.0f64; 4];
        for c in ["R", "G", "B"] {
            let beauty = image.channel(c).expect("the beauty");
            let layers = ["direct", "indirect", "emission", "volume"]
                .map(|layer| image.channel(&format!("{layer}.{c}")).expect("a layer"));
            for (i, whole) in beauty.iter().enumerate() {
                let sum: f32 = layers.iter().map(|layer| layer[i]).sum();
                assert!((sum - whole).abs() <= 4e-6 * whole.abs().max(1e-3), "pixel {i}: {sum} is not {whole}");
                for (seen, layer) in seen.iter_mut().zip(&layers) {
                    *seen += f64::from(layer[i]);
                }
            }
        }
        // Each has something in it, if there is something to be in it.
        assert!(seen[..3].iter().all(|s| *s > 0.0), "{seen:?}");
        assert_eq!(seen[3] > 0.0, !media.is_empty(), "{seen:?}");
    }
}

/// A camera that looks along z from the origin at a glowing wall at z = 3.
fn within(what: &str, before: &str, world: &str, spp: u32, depths: f64) {
    let wall = "AttributeBegin Translate 0 0 3 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
                Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"disk\" \"float radius\" 9 AttributeEnd\n";
    let media: String = [("m", 0.2), ("n", 0.3)]
        .iter()
        .map(|(name, s)| {
            format!("MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{s} {s} {s}] \"rgb sigma_s\" [0 0 0]\n")
        })
        .collect();
    let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 1.0, size: 16, ..Shot::default() };
    let camera = Framed { shot, before, ..Framed::default() };
    camera.assert(what, &format!("{wall}{media}{world}"), spp, [(-depths).exp(); 3], 3e-3);
}

#[test]
fn the_camera_finds_the_regions_it_stands_in() {
    let box_of = |inside: &str, outside: &str, more: &str| boundary(inside, outside, &format!("{more} {CUBE}"));
    let m = box_of("m", "", "Translate 0.1 0.2 0");
    // In a box that no one declared, and declared as pbrt wants it.
    within("undeclared", "", &m, 700, 0.2);
    within("declared", "MediumInterface \"\" \"m\"", &m, 700, 0.2);
    // In two that overlap: the second reaches to z = 2.
    within("two", "", &format!("{m}{}", box_of("n", "", "Translate 0 0 0.5 Scale 1.5 1.5 1.5")), 700, 0.2 + 0.3 * 2.0);
    // In a medium that fills everything, with and without a box around the camera that takes its place.
    within(
        "filled",
        "MediumInterface \"\" \"m\"",
        &box_of("n", "m", "Translate 0 0 2 Scale 0.5 0.5 0.5"),
        700,
        0.2 * 2.0 + 0.3,
    );
    within("filled and replaced", "MediumInterface \"\" \"m\"", &box_of("n", "m", ""), 700, 0.3 + 0.2 * 2.0);
    // A box that declares nothing outside adds to what fills everything.
    within("filled and added", "MediumInterface \"\" \"m\"", &box_of("n", "", ""), 700, 0.2 * 3.0 + 0.3);
    // Inside an instance.
    let object =
        format!("ObjectBegin \"o\"\n{m}ObjectEnd\nAttributeBegin Scale 2 2 2 ObjectInstance \"o\" AttributeEnd\n");
    within("instance", "", &object, 700, 0.2 * 2.0);
}
