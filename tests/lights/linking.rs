//! Light linking: an image of objects with different lights is the sum of images in which one object alone is lit, by its lights.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use std::sync::atomic::AtomicBool;

use crate::common::{Options, Shot, View, assert_mean, boundary, image_mean};
use lanternfish::render::{Budget, Job, LightSelection, RenderSettings, Silent, Timings, load};
use lanternfish::scene::{Sources, Warnings};

const KINDS: [(&str, LightSelection); 5] = [
    ("uniform", LightSelection::Uniform),
    ("power", LightSelection::Power),
    ("optimal", LightSelection::Optimal),
    ("tree", LightSelection::Tree),
    ("cache points", LightSelection::CachePoints),
];

/// Name and whether it is exclusive, of each light of [`lights`].
const NAMES: [(&str, bool); 8] = [
    ("key", false),
    ("key", false),
    ("sun", true),
    ("sky", false),
    ("rim", false),
    ("rim", false),
    ("", false),
    ("lantern", true),
];

/// One light of each type, out of the camera's sight. Where `lit` does not name its place, a light is left out, but its shape stays.
fn lights(lit: impl Fn(usize) -> bool) -> String {
    let sources = [
        "LightSource \"point\" \"rgb I\" [6 3 2] \"point3 from\" [-1 3 -2]",
        "LightSource \"spot\" \"rgb I\" [20 25 20] \"point3 from\" [2 3 -2] \"point3 to\" [0 -1 0] \"float coneangle\" 35",
        "LightSource \"distant\" \"rgb L\" [0.3 0.3 0.6] \"point3 from\" [-1 1 -1] \"point3 to\" [0 0 0]",
        "LightSource \"infinite\" \"rgb L\" [0.2 0.1 0.2]",
    ];
    let areas = [
        ("[20 16 10]", "Translate 2.4 1.5 0 Shape \"sphere\" \"float radius\" 0.3"),
        ("[6 6 9]", "Translate -2.6 1 0.6 Rotate 90 0 1 0 Shape \"disk\" \"float radius\" 0.7"),
        (
            "[9 9 2]",
            "Translate -2.6 2 0 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0.5 1 1 1] \"integer indices\" [0 1 2 1 3 2]",
        ),
        ("[2 7 2]", "Shape \"bilinearmesh\" \"point3 P\" [2 1 1  3 1 1  2 2 1.2  3 2 0.8]"),
    ];
    let mut text = String::new();
    let label = |i: usize| {
        let (name, is_exclusive) = NAMES[i];
        let name = if name.is_empty() { String::new() } else { format!("\"string name\" \"{name}\"") };
        name + if is_exclusive { " \"bool exclusive\" true" } else { "" }
    };
    for (i, source) in sources.iter().enumerate().filter(|(i, _)| lit(*i)) {
        text += &format!("{source} {}\n", label(i));
    }
    for (i, (radiance, shape)) in areas.iter().enumerate() {
        let i = i + sources.len();
        let light = if lit(i) {
            format!("AreaLightSource \"diffuse\" \"rgb L\" {radiance} \"bool twosided\" true {}", label(i))
        } else {
            String::new()
        };
        text +=
            &format!("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] {light} {shape} AttributeEnd\n");
    }
    text
}

/// Something that scatters light.
#[derive(Clone, Copy)]
struct Object {
    /// Its material, or its medium's absorption and scattering.
    matter: &'static str,
    shape: &'static str,
    is_medium: bool,
    links: &'static str,
    /// The lights that these links come to.
    lit_by: &'static [usize],
}

const SURFACES: [Object; 4] = [
    Object {
        matter: "\"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5]",
        shape: "Translate 0 -1 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 5",
        is_medium: false,
        links: "",
        lit_by: &[0, 1, 3, 4, 5, 6],
    },
    Object {
        matter: "\"conductor\" \"float roughness\" 0.3",
        shape: "Translate 0.6 -0.4 0 Shape \"sphere\" \"float radius\" 0.5",
        is_medium: false,
        links: "\"string lights\" [\"key\" \"sun\"]",
        lit_by: &[0, 1, 2],
    },
    Object {
        matter: "\"coateddiffuse\" \"float roughness\" 0.2",
        shape: "Translate -0.7 -0.4 -0.3 Shape \"sphere\" \"float radius\" 0.5",
        is_medium: false,
        links: "\"string excludelights\" [\"key\" \"sky\"] \"string addlights\" \"lantern\"",
        lit_by: &[4, 5, 6, 7],
    },
    Object {
        matter: "\"conductor\" \"float roughness\" 0",
        shape: "Translate 0 -0.5 1 Shape \"sphere\" \"float radius\" 0.5",
        is_medium: false,
        links: "\"string lights\" [\"rim\" \"sky\"] \"string excludelights\" \"rim\"",
        lit_by: &[3],
    },
];

const MEDIA: [Object; 2] = [
    Object {
        matter: "0.1 0.4",
        shape: "Shape \"sphere\" \"float radius\" 1.1",
        is_medium: true,
        links: "\"string addlights\" \"sun\" \"string excludelights\" \"rim\"",
        lit_by: &[0, 1, 2, 3, 6],
    },
    Object {
        matter: "0.2 0.3",
        shape: "Translate 0.4 0.3 0 Shape \"sphere\" \"float radius\" 0.9",
        is_medium: true,
        links: "\"string lights\" \"rim\"",
        lit_by: &[4, 5],
    },
];

impl Object {
    /// Its text; where it is `dark`, it absorbs what it would scatter.
    fn text(&self, number: usize, is_dark: bool, links: &str) -> String {
        let Self { matter, shape, .. } = self;
        if !self.is_medium {
            let material = if is_dark { "\"diffuse\" \"rgb reflectance\" [0 0 0]" } else { matter };
            return format!("AttributeBegin Material {material} {shape} {links} AttributeEnd\n");
        }
        let (absorbed, scattered) = matter.split_once(' ').expect("two numbers");
        let [absorbed, scattered] = [absorbed, scattered].map(|value| value.parse::<f64>().expect("a number"));
        let [a, s] = if is_dark { [absorbed + scattered, 0.0] } else { [absorbed, scattered] };
        let medium = format!(
            "MakeNamedMedium \"{number}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{a} {a} {a}] \"rgb sigma_s\" [{s} {s} {s}]
             \"float g\" 0.4 {links}\n"
        );
        medium + &boundary(&number.to_string(), "", shape)
    }
}

/// Looks down at the floor, sees no light and no sky.
fn shot(depth: u32) -> Shot {
    Shot { from: [0.0, 4.0, -4.0], to: [0.0, -0.5, 0.0], fov: 28.0, size: 16, depth }
}

fn mean(world: &str, depth: u32, lights: LightSelection, spp: u32) -> ([f64; 3], [f64; 3]) {
    image_mean(&shot(depth).render(world, &Options { spp, lights, ..Options::default() }).film)
}

/// Light that is scattered once is the sum over objects.
fn is_sum_of_objects(objects: &[Object], spp: u32) {
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    for object in 0..objects.len() {
        let alone: String = (0..objects.len()).map(|k| objects[k].text(k, k != object, "")).collect();
        let lit = lights(|i| objects[object].lit_by.contains(&i)).replace("\"bool exclusive\" true", "");
        let (part, error) = mean(&format!("{lit}{alone}"), 1, LightSelection::Optimal, spp);
        for c in 0..3 {
            assert!(part[c] > 20.0 * error[c], "object {object} is hardly seen: {part:?} ± {error:?}");
            sum[c] += part[c];
            squares[c] += error[c].powi(2);
        }
    }
    let linked: String = objects.iter().enumerate().map(|(k, object)| object.text(k, false, object.links)).collect();
    let world = format!("{}{linked}", lights(|_| true));
    for (name, kind) in KINDS {
        let (whole, error) = mean(&world, 1, kind, spp);
        for c in 0..3 {
            let both = error[c].hypot(squares[c].sqrt());
            println!("{name}: {:.5} and {:.5} ± {both:.5}", whole[c], sum[c]);
            assert!(both < 7e-3 * sum[c], "{name}: {both} is too large to tell");
            assert_mean(name, whole[c], both, sum[c], 0.0);
        }
    }
}

#[test]
fn surfaces_are_lit_by_their_lights_alone() {
    is_sum_of_objects(&SURFACES, 1024);
}

#[test]
fn media_are_lit_by_their_lights_alone() {
    is_sum_of_objects(&[&SURFACES[..], &MEDIA[..]].concat(), 1216);
}

#[test]
fn what_lights_nothing_is_as_good_as_not_there() {
    // Whatever the path's length and whichever technique finds the light.
    let objects = [&SURFACES[..], &MEDIA[..]].concat();
    let plain: String = objects.iter().enumerate().map(|(k, object)| object.text(k, false, "")).collect();
    let glass = "AttributeBegin Material \"dielectric\" Translate -0.2 0.4 -1 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n";
    let left = [1, 3, 5, 6].map(|i| NAMES[i].0);
    assert_eq!(left, ["key", "sky", "rim", ""]);
    let without = format!("{}{plain}{glass}", lights(|i| [3, 6].contains(&i)));
    let defaults: String = ["shape", "medium"]
        .map(|what| format!("Attribute \"{what}\" \"string excludelights\" [\"key\" \"rim\"]\n"))
        .concat();
    let with = format!("{defaults}{}{plain}{glass}", lights(|_| true));
    let (expected, expected_error) = mean(&without, 4, LightSelection::Optimal, 448);
    for (name, kind) in KINDS {
        let (seen, error) = mean(&with, 4, kind, 448);
        for c in 0..3 {
            let both = error[c].hypot(expected_error[c]);
            println!("{name}: {:.5} and {:.5} ± {both:.5}", seen[c], expected[c]);
            assert!(both < 1e-2 * expected[c], "{name}: {both} is too large to tell");
            assert_mean(name, seen[c], both, expected[c], 0.0);
        }
    }
}

#[test]
fn mirrors_and_glass_do_not_show_lights_that_are_not_theirs() {
    let close = Shot { fov: 8.0, ..Shot::default() };
    let sky = "LightSource \"infinite\" \"rgb L\" [1 1 1] \"string name\" \"sky\"\n";
    for material in ["\"conductor\" \"float roughness\" 0", "\"dielectric\"", "\"dielectric\" \"float roughness\" 0.3"]
    {
        for (links, is_lit) in
            [("", true), ("\"string excludelights\" \"sky\"", false), ("\"string lights\" []", false)]
        {
            let world = format!("{sky}Material {material} Shape \"sphere\" {links}");
            let (mean, _) = close.mean(&world, 16);
            assert_eq!(mean.iter().all(|m| *m > 0.1), is_lit, "{material} {links}: {mean:?}");
            assert_eq!(mean == [0.0; 3], !is_lit, "{material} {links}: {mean:?}");
        }
    }
}

#[test]
fn the_camera_sees_every_light() {
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"string name\" \"lamp\" \"bool exclusive\" true
                Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"sphere\" \"string lights\" []";
    assert_eq!(Shot { fov: 8.0, ..Shot::default() }.mean(lamp, 16).0.map(|m| m as f32), [1.0, 2.0, 3.0]);
}

/// The image of a world, as bits.
fn bits(world: &str, lights: LightSelection) -> Vec<u32> {
    let outcome = shot(3).render(world, &Options { spp: 4, lights, ..Options::default() });
    outcome.film.beauty().pixels.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn without_links_nothing_changes() {
    let ordinary = lights(|_| true).replace("\"bool exclusive\" true", "");
    let nameless =
        NAMES.iter().fold(ordinary.clone(), |text, (name, _)| text.replace(&format!("\"string name\" \"{name}\""), ""));
    assert!(!nameless.contains("string name") && nameless != ordinary);
    let objects = [&SURFACES[..], &MEDIA[..]].concat();
    let with = |links: &str| -> String { objects.iter().enumerate().map(|(k, o)| o.text(k, false, links)).collect() };
    for (_, kind) in KINDS {
        let expected = bits(&format!("{nameless}{}", with("")), kind);
        assert!(bits(&format!("{ordinary}{}", with("")), kind) == expected, "names matter");
        // Links that leave nothing out.
        let all = with("\"string addlights\" [\"key\" \"sun\" \"sky\" \"rim\" \"lantern\"]");
        assert!(bits(&format!("{ordinary}{all}"), kind) == expected, "{kind:?}: links that change nothing");
        assert!(bits(&format!("{ordinary}{}", with("\"string lights\" \"key\"")), kind) != expected);
    }
}

#[test]
fn instances_are_lit_by_what_is_stated_around_them() {
    let [left, right] = ["Translate -0.7 -0.4 -0.3", "Translate 0.6 -0.4 0"];
    let [none, key, rim, all] =
        ["", "\"string lights\" \"key\"", "\"string lights\" \"rim\"", "\"string addlights\" []"];
    let ball = |links: &str| format!("Shape \"sphere\" \"float radius\" 0.5 {links}\n");
    let around = |links: &str, what: &str| {
        let attribute = if links.is_empty() { String::new() } else { format!("Attribute \"shape\" {links}") };
        format!("AttributeBegin {attribute} {what} AttributeEnd\n")
    };
    let object = |name: &str, what: &str| format!("ObjectBegin \"{name}\" {what} ObjectEnd\n");
    let at = |place: &str, links: &str, name: &str| around(links, &format!("{place} ObjectInstance \"{name}\""));
    let both = |of_left: &str, of_right: &str| at(left, of_left, "o") + &at(right, of_right, "o");
    let nested = at(left, key, "o") + &at(right, none, "o");
    let world = |objects: &str| lights(|_| true) + &SURFACES[0].text(0, false, "") + objects;
    for (objects, [of_left, of_right]) in [
        (object("o", &ball(none)) + &both(key, none), [key, none]),
        // What a shape states, or what is stated within the object, stays.
        (object("o", &ball(key)) + &both(rim, none), [key, key]),
        (object("o", &around(key, &ball(none))) + &both(rim, all), [key, key]),
        (around(key, &(object("o", &ball(rim)) + &both(none, all))), [rim, rim]),
        // What is stated around the object goes if something is stated around the instance.
        (around(key, &object("o", &ball(none))) + &both(rim, none), [rim, key]),
        (around(key, &object("o", &ball(none))) + &both(all, none), [none, key]),
        (object("o", &ball(none)) + &object("p", &nested) + &at("", rim, "p"), [key, rim]),
    ] {
        let expected =
            object("l", &ball(of_left)) + &at(left, none, "l") + &object("r", &ball(of_right)) + &at(right, none, "r");
        for kind in [LightSelection::Optimal, LightSelection::CachePoints] {
            assert!(bits(&world(&objects), kind) == bits(&world(&expected), kind), "{kind:?}: {objects}");
        }
    }
    let plain = |links: &str| bits(&world(&(object("o", &ball(links)) + &both(none, none))), LightSelection::Optimal);
    assert!(plain(none) != plain(key) && plain(key) != plain(rim), "links do not matter here");
}

/// Loads and prepares a scene.
fn prepare(world: &str, strict: bool) -> (Result<Job, String>, Warnings) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, shot(2).text(world)).expect("the scene can be written");
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let loaded = load(&path, &mut sources, &mut warnings);
    let (scene, timings): (_, Timings) = loaded.expect("the scene can be read");
    let settings = RenderSettings { strict, ..RenderSettings::default() };
    let job = Job::prepare(&scene, &settings, timings, &mut warnings).map_err(|error| error.to_string());
    (job, warnings)
}

#[test]
fn the_plan_says_what_is_linked() {
    let linking = |world: &str| {
        let job = prepare(world, true).0.expect("the scene is right");
        let system = job.plan.systems.into_iter().find(|s| s.name == "light linking").expect("it is in the plan");
        (system.built, system.reason)
    };
    let plain = SURFACES[0].text(0, false, "");
    let ordinary = lights(|_| true).replace("\"bool exclusive\" true", "");
    assert_eq!(linking(&format!("{ordinary}{plain}")), (false, "no shape names lights".to_owned()));
    let linked: String = SURFACES.iter().enumerate().map(|(k, o)| o.text(k, false, o.links)).collect();
    let reason = "4 sets of lights by object, 7 named lights, 2 exclusive".to_owned();
    assert_eq!(linking(&format!("{}{linked}", lights(|_| true))), (true, reason));
}

#[test]
fn unknown_names_are_named_where_they_stand() {
    let world = "LightSource \"point\" \"string name\" \"key\"\nShape \"sphere\"\n  \"string lights\" [\"key\" \"kye\"]\nShape \"sphere\" \"string addlights\" \"kye\"\n";
    let (job, warnings) = prepare(world, false);
    let mut job = job.expect("a warning is enough");
    let said: Vec<_> = warnings.list().iter().filter(|warning| warning.message.contains("\"kye\"")).collect();
    assert_eq!(said.len(), 1, "{warnings:?}");
    let header = shot(2).text("").lines().count() as u32;
    assert_eq!(said[0].span.map(|span| (span.line - header + 1, span.column)), Some((3, 3)), "{said:?}");
    assert_eq!(warnings.list().len(), 1, "{warnings:?}");
    job.render(1, Budget::Samples(1), &AtomicBool::new(false), &Silent);
    let (strict, _) = prepare(world, true);
    assert_eq!(strict.err().as_deref(), Some("no light is called \"kye\""));
}
