//! What two parts of the renderer must agree on, in scenes where rounding or a mirror drives them apart: where a shadow ray starts and
//! where it ends, what a ray hits and what a light samples, which crossing of a surface with holes is which.
//!
//! Assertions fail by chance with probability 1e-6.

use crate::common::{CUBE, Framed, Options, Shot, View, boundary, integrate};
use lanternfish::geometry::Backend;
use std::f64::consts::PI;

/// A camera that sees next to nothing but the point `at`, from 5 above it.
fn above(at: [f64; 3]) -> Shot {
    let [x, y, z] = at;
    Shot { from: [x, y, z + 5.0], to: at, fov: 0.05, depth: 1, ..Shot::default() }
}

/// Radiance of a white surface under a 2 × 2 square lamp of radiance 1 that hangs 8 above it.
fn under_the_lamp() -> f64 {
    integrate(-1.0, 1.0, 8, |x| integrate(-1.0, 1.0, 8, |y| 64.0 / (x * x + y * y + 64.0f64).powi(2))) / PI
}

fn lamp([x, y, z]: [f64; 3]) -> String {
    format!(
        "AttributeBegin Translate {x} {y} {} AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
         Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] AttributeEnd
         Material \"diffuse\" \"rgb reflectance\" [1 1 1]\n",
        z + 8.0
    )
}

fn backends() -> impl Iterator<Item = Backend> {
    [Backend::Embree, Backend::Native].into_iter().filter(|b| cfg!(feature = "embree") || *b == Backend::Native)
}

/// The receiver's point is known only up to a bound, and the shadow ray starts that far off it: it must not reach beyond the lamp.
#[test]
fn shadow_rays_from_uncertain_points_reach_the_lamp() {
    let floor = |size: f64| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]
             \"point3 P\" [-{size} -{size} 0  {size} -{size} 0  {size} {size} 0  -{size} {size} 0]\n"
        )
    };
    let turn = "Rotate 35 1 2 3\n";
    let seen = |before: &'static str, at: [f64; 3]| Framed { shot: above(at), before, ..Framed::default() };
    let object = |distance: f64| {
        format!(
            "ObjectBegin \"o\" Translate 0 0 {distance} Shape \"disk\" \"float radius\" 3 ObjectEnd
             Translate 0 0 -{distance} ObjectInstance \"o\""
        )
    };
    let curve =
        "Shape \"curve\" \"string type\" \"flat\" \"point3 P\" [0 -2 0  0 -1 0  0 1 0  0 2 0] \"float width\" 0.02";
    let moving = "ActiveTransform EndTime Translate 0.001 0 0 ActiveTransform All Translate 15 15 0 Shape \"disk\" \"float radius\" 3";
    for (what, shot, world) in [
        ("large and tilted", seen("Rotate -35 1 2 3", [0.0; 3]), format!("{turn}{}{}", lamp([0.0; 3]), floor(3000.0))),
        ("a curve", seen("", [0.0; 3]), format!("{}{curve}", lamp([0.0; 3]))),
        ("far from its object's origin", seen("", [0.0; 3]), format!("{}{}", lamp([0.0; 3]), object(1000.0))),
        ("moving far from its pivot", seen("", [15.0, 15.0, 0.0]), format!("{}{moving}", lamp([15.0, 15.0, 0.0]))),
    ] {
        shot.assert(what, &world, 512, [under_the_lamp(); 3], 2e-3);
    }
}

/// A bulb far away that single precision can hardly tell from a point.
#[test]
fn a_tiny_bulb_far_away_keeps_its_light() {
    for (radius, distance) in [(1e-3, 1000.0), (1e-4, 1000.0), (1e-6, 2.0)] {
        let radiance = 1e3 / (radius * radius / (distance * distance));
        let world = format!(
            "AttributeBegin Translate 0 {distance} 0 AreaLightSource \"diffuse\" \"rgb L\" [{radiance} {radiance} {radiance}]
             Shape \"sphere\" \"float radius\" {radius} AttributeEnd
             Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 9"
        );
        let shot = Shot { from: [0.0, 3.0, 4.0], to: [0.0; 3], fov: 0.001, depth: 1, ..Shot::default() };
        shot.assert("bulb", &world, 64, [0.5 * 1e3; 3], 2e-3);
    }
}

/// A lamp of radius 1 is the same however it is stated: by a huge disk made small or a tiny one made large.
#[test]
fn a_lamp_is_the_same_at_any_scale_of_its_own() {
    for exponent in [-13, 0, 13] {
        let (radius, scale) = (10f64.powi(-exponent), 10f64.powi(exponent));
        let world = format!(
            "AttributeBegin Translate 0 0 2 Scale {scale:e} {scale:e} {scale:e}
             AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
             Shape \"disk\" \"float radius\" {radius:e} AttributeEnd
             Material \"diffuse\" \"rgb reflectance\" [1 1 1] Shape \"disk\" \"float radius\" 9"
        );
        // Seen from beside the lamp; its form factor is r² / (r² + h²).
        let shot = Shot { from: [5.0, 0.0, 1.5], to: [0.0; 3], fov: 0.001, depth: 1, ..Shot::default() };
        shot.assert(&format!("scale 1e{exponent}"), &world, 1024, [0.2; 3], 2e-3);
    }
}

/// What a mirror does to the side that a one-sided lamp shines to, it does to what is seen of it and to the light that it sheds alike.
#[test]
fn mirrored_lamps_shine_to_the_side_that_is_seen() {
    let shot = |depth| Shot { from: [0.0, 0.0, 9.0], to: [0.0; 3], fov: 0.01, depth, ..Shot::default() };
    for shape in ["\"sphere\"", "\"disk\"", "\"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]"] {
        for reverse in ["", "ReverseOrientation"] {
            for mirror in ["", "Scale -1 1 1", "Scale 1 -1 -1"] {
                let emitter = |alpha: &str| {
                    format!(
                        "AttributeBegin {mirror} {reverse} AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]
                         Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape {shape} {alpha} AttributeEnd\n"
                    )
                };
                // Seen from +z, and shining on a floor there that looks down on it past its own edge.
                let seen = shot(0).mean(&emitter(""), 4).0[0];
                let floor = "Material \"diffuse\" Translate 4 0 6 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 1";
                let looking = Shot { from: [4.0, 0.0, -3.0], to: [4.0, 0.0, 6.0], ..shot(1) };
                let lit = looking.mean(&format!("{}{floor}", emitter("")), 16).0[0];
                assert!(seen == 0.0 || seen == 1.0);
                assert_eq!(seen > 0.0, lit > 0.0, "{shape} {mirror} {reverse}: seen {seen}, lit {lit}");
                // A lamp that no ray can meet sheds the same by sampling alone. (Of a sphere that shines inwards the far side would shine
                // through.)
                let is_inward = reverse.is_empty() == (mirror == "Scale -1 1 1");
                if !(shape.contains("sphere") && is_inward) {
                    let sampled = looking.mean(&format!("{}{floor}", emitter("\"float alpha\" 0")), 16).0[0];
                    assert_eq!(sampled > 0.0, lit > 0.0, "{shape} {mirror} {reverse}: sampled {sampled}, lit {lit}");
                }
            }
        }
    }
}

/// As in pbrt-v4: a mirror turns a sphere inside out unless ReverseOrientation is said too (which exporters do), and keeps a mesh as it is.
#[test]
fn mirrored_boundaries_have_pbrts_inside() {
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [0 0 0]
               LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    let shot = Shot { from: [0.0, 0.0, 9.0], fov: 0.01, depth: 0, size: 32, ..Shot::default() };
    for (mirror, is_odd) in [("", false), ("Scale -1 1 1", true), ("Scale 1 1 -1", true), ("Scale -1 -1 1", false)] {
        let sphere = format!("{} Shape \"sphere\"", if is_odd { "ReverseOrientation" } else { "" });
        for shape in [&sphere, CUBE] {
            let world = format!("{fog}{}", boundary("fog", "", &format!("{mirror} {shape}")));
            shot.assert(mirror, &world, 256, [(-2.0f64).exp(); 3], 5e-3);
        }
    }
}

/// Every crossing of a veil is a chance of its own: front and back of one sphere, several instances of one disk.
#[test]
fn each_crossing_of_a_veil_has_its_own_chance() {
    let light = "LightSource \"infinite\" \"rgb L\" [1 1 1] Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    let sphere = format!("{light}Shape \"sphere\" \"float alpha\" 0.5");
    let disks = format!(
        "{light}ObjectBegin \"o\" Shape \"disk\" \"float alpha\" 0.5 ObjectEnd ObjectInstance \"o\"
         Translate 0 0 1 ObjectInstance \"o\" Translate 0 0 1 ObjectInstance \"o\""
    );
    let shot = Shot { from: [0.1, 0.2, 9.0], to: [0.1, 0.2, 0.0], fov: 1.0, size: 16, ..Shot::default() };
    for backend in backends() {
        for (what, world, expected) in [("sphere", &sphere, 0.25), ("three instances", &disks, 0.125)] {
            let outcome = shot.render(world, &Options { spp: 256, backend, ..Options::default() });
            let (mean, error) = crate::common::image_mean(&outcome.film);
            println!("{what}, {backend:?}: {} ± {}", mean[0], error[0]);
            crate::common::assert_mean(what, mean[0], error[0], expected, 0.0);
        }
    }
}

/// Far from the ray's origin, a step through a grid that is dense somewhere is below the last place of its distance.
#[test]
fn a_dense_grid_far_away_lets_through_what_it_should() {
    let mut densities = vec!["1e-5"; 512];
    densities[0] = "1";
    let world = format!(
        "LightSource \"infinite\" \"rgb L\" [1 1 1] Translate 0 0 10000
         MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"integer nx\" 8 \"integer ny\" 8 \"integer nz\" 8
         \"point3 p0\" [-6 -6 0] \"point3 p1\" [2 2 8] \"rgb sigma_a\" [1e4 1e4 1e4] \"rgb sigma_s\" [0 0 0] \"float density\" [{}]\n{}",
        densities.join(" "),
        boundary("m", "", &format!("Translate -2 -2 4 Scale 4 4 4 {CUBE}"))
    );
    let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 0.001, size: 4, depth: 0 };
    // Within half a voxel of the grid's ends its values fade.
    let (mean, error) = shot.mean(&world, 32);
    let expected = (-0.1f64 * 7.5).exp();
    println!("far grid: {} ± {}, expected about {expected}", mean[0], error[0]);
    // What fades at the ends is known only roughly; it was next to nothing where steps got lost.
    let allowed = crate::common::critical_z(1e-6) * error[0] + 0.03;
    assert!((mean[0] - expected).abs() < allowed, "{} ± {} instead of about {expected}", mean[0], error[0]);
}

/// Objects within objects, still and moving, are what comes of writing their shapes out.
#[test]
fn nested_objects_are_flattened() {
    let light = "LightSource \"point\" \"rgb I\" [40 30 20] \"point3 from\" [2 3 5] LightSource \"infinite\"\n";
    let ball = "Material \"diffuse\" \"rgb reflectance\" [0.8 0.3 0.2] Shape \"sphere\" \"float radius\" 0.4\n";
    let nested = format!(
        "{light}ObjectBegin \"ball\" {ball} ObjectEnd
         ObjectBegin \"pair\" Translate -0.5 0 0 ObjectInstance \"ball\" Translate 1 0 0 Scale 1 2 1 ObjectInstance \"ball\" ObjectEnd
         ObjectBegin \"four\" ObjectInstance \"pair\" ActiveTransform EndTime Translate 0 0.3 0 ActiveTransform All
         Translate 0 1 0 ObjectInstance \"pair\" ObjectEnd
         Rotate 20 0 0 1 ObjectInstance \"four\""
    );
    let moving = "ActiveTransform EndTime Translate 0 0.3 0 ActiveTransform All Translate 0 1 0";
    let (left, right) = ("Translate -0.5 0 0", "Translate -0.5 0 0 Translate 1 0 0 Scale 1 2 1");
    let one = |place: &str| format!("AttributeBegin Rotate 20 0 0 1 {place} {ball} AttributeEnd\n");
    let flat: String = [left.into(), right.into(), format!("{moving} {left}"), format!("{moving} {right}")]
        .iter()
        .map(|place: &String| one(place))
        .collect();
    let shot = Shot { from: [0.0, 0.5, 6.0], to: [0.0, 0.5, 0.0], fov: 30.0, size: 48, depth: 2 };
    for backend in backends() {
        let render = |world: &str| shot.render(world, &Options { spp: 64, backend, ..Options::default() }).film;
        let apart = crate::common::difference(&render(&nested), &render(&format!("{light}{flat}")));
        println!("nested, {backend:?}: relative RMSE {apart:.2e}");
        assert!(apart < 5e-3, "{backend:?}: relative RMSE {apart:e}");
    }
}
