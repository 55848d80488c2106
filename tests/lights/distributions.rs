//! Lights whose light depends on the direction or the place, from a scene file to an image that is known: images around points, photometric files,
//! projectors, portals, images on emitters. And whatever chooses among them, the image is the same.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use std::f64::consts::PI;
use std::path::Path;

use crate::common::{Framed, Options, Shot, View, assert_mean, boundary, image_mean, prepare_file, render_file};
use lanternfish::render::{LightSelection, VolumeLights};
use lanternfish::scene::Warnings;
use tempfile::TempDir;

const PLATE: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n";
const RHO: f64 = 0.5;

/// A camera far away that sees the origin of the plane z = 0, over so small a field that everything is the same in it.
fn camera() -> Shot {
    Shot { from: [-70.0, 0.0, 70.0], fov: 0.0005, depth: 1, ..Shot::default() }
}

/// A folder with the files that the scenes name.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let pfm = |name: &str, width: usize, height: usize, pixel: &dyn Fn(usize, usize) -> [f32; 3]| {
        let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
        // Rows go from the bottom up.
        for y in (0..height).rev() {
            for x in 0..width {
                pixel(x, y).iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            }
        }
        std::fs::write(folder.path().join(name), bytes).expect("the image can be written");
    };
    pfm("rows.pfm", 4, 2, &|_, y| [1.0 + y as f32 * 3.0; 3]);
    pfm("quarters.pfm", 2, 2, &|x, y| [[0.5, 1.0, 2.0], [4.0, 3.0, 2.0], [1.0, 0.0, 0.0], [2.0, 2.0, 8.0]][2 * y + x]);
    pfm("halves.pfm", 2, 1, &|x, _| [[1.0, 2.0, 0.0], [3.0, 2.0, 5.0]][x]);
    pfm("sky.pfm", 16, 16, &|x, y| [0.3 + (x % 3) as f32 * 0.2, 0.4, 0.5 + (y % 4) as f32 * 0.3]);
    pfm("screen.pfm", 24, 12, &|x, y| if (x / 4 + y / 4) % 2 == 0 { [2.0, 1.0, 0.5] } else { [0.0; 3] });
    let candela: Vec<String> = [0.0, 90.0, 180.0]
        .map(|h: f64| (0..=6).map(|k| (value(15.0 * f64::from(k), h)).to_string()).collect::<Vec<_>>().join(" "))
        .to_vec();
    let text = format!(
        "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 2 7 3 1 2 0 0 0\n1 1 10\n0 15 30 45 60 75 90\n0 90 180\n{}\n",
        candela.join("\n")
    );
    std::fs::write(folder.path().join("lamp.ies"), &text).expect("the file can be written");
    std::fs::write(folder.path().join("short.ies"), &text[..text.len() - 20]).expect("the file can be written");
    folder
}

/// Half the candela of `lamp.ies`, whose multiplier is 2.
fn value(vertical: f64, horizontal: f64) -> f64 {
    (90.0 - vertical) * (1.0 + horizontal / 90.0)
}

/// The mean of an image of `world`, whose files are in `folder`.
fn mean_in(folder: &Path, view: &impl View, world: &str, options: &Options) -> ([f64; 3], [f64; 3]) {
    let path = folder.join("scene.pbrt");
    std::fs::write(&path, view.scene(world)).expect("the scene can be written");
    let (outcome, _) = render_file(&path, options).expect("the scene renders");
    assert_eq!(outcome.film.rejected().0, 0, "samples were NaN or infinite");
    image_mean(&outcome.film)
}

/// Light from a point: no noise.
#[track_caller]
fn exactly(folder: &TempDir, what: &str, light: &str, expected: [f64; 3]) {
    let world = format!("{PLATE}AttributeBegin {light} AttributeEnd");
    let (mean, _) = mean_in(folder.path(), &camera(), &world, &Options { spp: 4, ..Options::default() });
    println!("{what}: {mean:?} expected {expected:?}");
    for (mean, expected) in mean.into_iter().zip(expected) {
        assert!((mean - expected).abs() <= 5e-4 * expected, "{what}: {mean} instead of {expected}");
    }
}

/// What the plate reflects of a point of `intensity` at (x, y, z).
fn reflected(intensity: f64, [x, y, z]: [f64; 3]) -> f64 {
    let square = x * x + y * y + z * z;
    RHO / PI * intensity * z / square.sqrt() / square
}

#[test]
fn an_image_around_a_point_has_the_lights_y_up() {
    let folder = folder();
    let light = "LightSource \"goniometric\" \"string filename\" \"rows.pfm\" \"rgb I\" [1 2 3] \"float scale\" 2";
    // From either place the origin is 45° off the vertical, in the middle of a row: the upper one is 1, the lower one 4.
    let colour = |intensity: f64, at| [1.0, 2.0, 3.0].map(|c| reflected(2.0 * c * intensity, at));
    exactly(&folder, "above", &format!("Translate 0 -1 1 {light}"), colour(1.0, [0.0, -1.0, 1.0]));
    exactly(&folder, "below", &format!("Translate 0 1 1 {light}"), colour(4.0, [0.0, 1.0, 1.0]));
    exactly(&folder, "mirrored", &format!("Translate 0 1 1 Scale 1 -1 1 {light}"), colour(1.0, [0.0, 1.0, 1.0]));
    exactly(&folder, "turned", &format!("Translate 0 1 1 Rotate 180 0 0 1 {light}"), colour(1.0, [0.0, 1.0, 1.0]));
    // Look-ups are bilinear, so that the mean is not quite that of the rows; on a square image it is. All of `quarters` is 2.708 as grey.
    let mean = [3.5 / 3.0, 3.0, 1.0 / 3.0, 4.0].iter().sum::<f64>() / 4.0;
    let light = "LightSource \"goniometric\" \"string filename\" \"quarters.pfm\" \"float power\" 100";
    // Straight down (−z of the light is beside, on the equator): between two pixels of each kind.
    let (found, _) = mean_in(
        folder.path(),
        &camera(),
        &format!("{PLATE}AttributeBegin Translate 0 0 2 {light} AttributeEnd"),
        &Options { spp: 4, ..Options::default() },
    );
    let intensity = found[0] / reflected(1.0, [0.0, 0.0, 2.0]);
    let range = [1.0 / 3.0, 4.0].map(|grey| 100.0 / (4.0 * PI) * grey / mean);
    assert!(intensity > range[0] && intensity < range[1], "{intensity} {range:?}");
}

#[test]
fn photometric_files_are_candela_watts_or_relative() {
    let folder = folder();
    // Down is the light's +z; from (1, 0, 1) the origin is at 45°, and half around.
    let place = "Translate 1 0 1 Rotate 180 1 0 0";
    let light = "LightSource \"point\" \"string ies\" \"lamp.ies\" \"rgb I\" [1 0.5 0.25] \"float scale\" 3";
    let at = [1.0, 0.0, 1.0];
    let colour = |candela: f64| [1.0, 0.5, 0.25].map(|c| reflected(3.0 * c * candela, at));
    let candela = 2.0 * value(45.0, 180.0);
    exactly(&folder, "candela", &format!("{place} {light}"), colour(candela));
    exactly(&folder, "watts", &format!("{place} {light} \"string iesunits\" \"watts\""), colour(candela / 683.0));
    let relative = format!("{place} {light} \"string iesunits\" \"relative\"");
    exactly(&folder, "relative", &relative, colour(candela / (2.0 * value(0.0, 180.0))));
    exactly(&folder, "a quarter around", &format!("Translate 0 1 1 Rotate 180 1 0 0 {light}"), {
        [1.0, 0.5, 0.25].map(|c| reflected(3.0 * c * 2.0 * value(45.0, 90.0), [0.0, 1.0, 1.0]))
    });
    exactly(&folder, "beyond the horizontal", &format!("Translate 1 0 1 {light}"), [0.0; 3]);
    // ∫ (90 − v) sin v dv over 0° to 90° is 90 − 180/π; the mean around is 2 times what is written, times the multiplier.
    let flux = 2.0 * 2.0 * 2.0 * PI * (90.0 - 180.0 / PI);
    let power = "LightSource \"point\" \"string ies\" \"lamp.ies\" \"float power\" 50";
    let expected = reflected(50.0 * candela / flux, at);
    let world = format!("{PLATE}AttributeBegin {place} {power} AttributeEnd");
    let (found, _) = mean_in(folder.path(), &camera(), &world, &Options { spp: 4, ..Options::default() });
    assert!((found[0] / expected - 1.0).abs() < 2e-3, "{} {expected}", found[0]);
    // Several at once, each with its own I.
    let many = "Rotate 180 1 0 0 LightSource \"point\" \"string ies\" \"lamp.ies\" \"point3 P\" [1 0 -1  0 -1 -1] \"rgb I\" [1 0 0  0 1 0]";
    let two = [candela, 2.0 * value(45.0, 90.0), 0.0].map(|candela| reflected(candela, at));
    let world = format!("{PLATE}AttributeBegin {many} AttributeEnd");
    let (found, error) = mean_in(folder.path(), &camera(), &world, &Options { spp: 1024, ..Options::default() });
    (0..3).for_each(|c| assert_mean("two points", found[c], error[c], two[c], 5e-4));
}

#[test]
fn a_spot_may_have_a_photometric_file() {
    let folder = folder();
    let spot = |more: &str| {
        format!(
            "LightSource \"spot\" \"string ies\" \"lamp.ies\" \"point3 from\" [0 0 2] \"point3 to\" [0 1 0]
             \"float coneangle\" 30 \"float conedeltaangle\" 10 {more}"
        )
    };
    // The origin is as far off the axis as that is off the vertical. Seen along the axis, the light's own x is +x still.
    let angle = 0.5f64.atan();
    let (start, end) = (20f64.to_radians().cos(), 30f64.to_radians().cos());
    let t = (angle.cos() - end) / (start - end);
    let falloff = t * t * (3.0 - 2.0 * t);
    let z = [0.0, 1.0f64, -2.0].map(|c| c / 5f64.sqrt());
    // y = z × x, and the way to the origin in that frame.
    let y = [0.0, z[2], -z[1]];
    let way = [0.0, 0.0, -1.0f64];
    let along: f64 = (0..3).map(|c| way[c] * y[c]).sum();
    let horizontal = if along > 0.0 { 90.0 } else { 270.0 };
    // The file repeats itself behind 180°.
    let candela = 2.0 * value(angle.to_degrees(), if horizontal > 180.0 { 360.0 - horizontal } else { horizontal });
    exactly(&folder, "spot", &spot(""), [reflected(candela * falloff, [0.0, 0.0, 2.0]); 3]);
    let (whole, _) = mean_in(
        folder.path(),
        &camera(),
        &format!("{PLATE}{}", spot("\"float power\" 10")),
        &Options { spp: 4, ..Options::default() },
    );
    // The cone's flux by quadrature; around, the mean is that at 90°.
    let steps = 20_000;
    let flux: f64 = (0..steps)
        .map(|k| {
            let v = (f64::from(k) + 0.5) / f64::from(steps) * 30f64.to_radians();
            let t = ((v.cos() - end) / (start - end)).clamp(0.0, 1.0);
            2.0 * PI * v.sin() * 2.0 * value(v.to_degrees(), 90.0) * t * t * (3.0 - 2.0 * t)
        })
        .sum::<f64>()
        * 30f64.to_radians()
        / f64::from(steps);
    let expected = reflected(10.0 * candela * falloff / flux, [0.0, 0.0, 2.0]);
    assert!((whole[0] / expected - 1.0).abs() < 1e-3, "{} {expected}", whole[0]);
}

#[test]
fn a_projector_shows_its_image_within_its_field_of_view() {
    let folder = folder();
    let light = "LightSource \"projection\" \"string filename\" \"quarters.pfm\" \"float fov\" 60 \"float scale\" 2";
    let colour = |pixel: [f64; 3], at| pixel.map(|c| reflected(2.0 * c, at));
    // Turned over about x, the light's +x stays and its +y is −y.
    for (at, pixel) in [
        ([0.3, 0.2, 2.0], [0.5, 1.0, 2.0]),
        ([-0.3, 0.2, 2.0], [4.0, 3.0, 2.0]),
        ([0.3, -0.2, 2.0], [1.0, 0.0, 0.0]),
        ([-0.3, -0.2, 2.0], [2.0, 2.0, 8.0]),
        // The edge is at 2 tan 30° = 1.1547.
        ([1.15, 0.2, 2.0], [0.5, 1.0, 2.0]),
        ([1.16, 0.2, 2.0], [0.0; 3]),
        ([0.3, -1.16, 2.0], [0.0; 3]),
    ] {
        let place = format!("Translate {} {} {} Rotate 180 1 0 0 {light}", at[0], at[1], at[2]);
        exactly(&folder, &format!("{at:?}"), &place, colour(pixel, at));
    }
    // Twice as wide where the light's x is: as in pbrt-v4 a stretch reaches the image.
    let stretched = format!("Translate 2 0.2 2 Rotate 180 1 0 0 Scale 2 1 1 {light}");
    exactly(&folder, "stretched", &stretched, colour([0.5, 1.0, 2.0], [2.0, 0.2, 2.0]));
    // By power: the image over its solid angle. A quarter of the pyramid's is asin(sin² 30°)… for each pixel.
    let tan = 30f64.to_radians().tan();
    let quarter = (tan * tan / (1.0 + 2.0 * tan * tan).sqrt()).atan();
    let luminance = |[r, g, b]: [f64; 3]| 0.212_671 * r + 0.715_160 * g + 0.072_169 * b;
    let sum: f64 = [[0.5, 1.0, 2.0], [4.0, 3.0, 2.0], [1.0, 0.0, 0.0], [2.0, 2.0, 8.0]].map(luminance).iter().sum();
    let at = [-0.3, 0.2, 2.0];
    let light = "LightSource \"projection\" \"string filename\" \"quarters.pfm\" \"float fov\" 60 \"float power\" 7";
    let expected = [4.0, 3.0, 2.0].map(|c| reflected(7.0 * c / (sum * quarter), at));
    exactly(&folder, "power", &format!("Translate -0.3 0.2 2 Rotate 180 1 0 0 {light}"), expected);
}

#[test]
fn a_portal_lets_the_sky_in_by_its_form_factor() {
    let folder = folder();
    // From (0, 0) to (2, 0.7) at the height 1.3, open upwards: (p₃ − p₀) × (p₁ − p₀) is +z.
    let portal = "\"point3 portal\" [0 0 1.3  0 0.7 1.3  2 0.7 1.3  2 0 1.3]";
    let (a, b) = (2.0 / 1.3, 0.7 / 1.3);
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    let factor = 0.5 * (term(a, b) + term(b, a));
    let options = Options { spp: 1024, ..Options::default() };
    // The transform turns the sky, not the portal.
    let world = format!(
        "{PLATE}AttributeBegin Rotate 70 1 2 3 LightSource \"infinite\" \"rgb L\" [2 1 3] {portal} AttributeEnd"
    );
    let (mean, error) = mean_in(folder.path(), &camera(), &world, &options);
    for (c, radiance) in [2.0, 1.0, 3.0].into_iter().enumerate() {
        assert!(error[c] < 2e-3 * mean[c], "too noisy");
        assert_mean("portal", mean[c], error[c], RHO / PI * radiance * factor, 1e-4);
    }
    // By illuminance: what the whole sky, image or not, would give a surface that faces its +z.
    for sky in ["", "\"string filename\" \"sky.pfm\""] {
        let light = |more: &str| format!("LightSource \"infinite\" {sky} \"float illuminance\" 5 {more}");
        let [open, through] = ["", portal].map(|more| {
            let world = format!("{PLATE}{}", light(more));
            mean_in(folder.path(), &camera(), &world, &Options { spp: 2048, ..Options::default() })
        });
        assert_mean("illuminance", open.0[1], open.1[1], RHO / PI * 5.0, if sky.is_empty() { 1e-4 } else { 0.2 });
        assert!(through.0[1] < 0.5 * open.0[1], "a part of it comes through");
        if sky.is_empty() {
            assert_mean("illuminance", through.0[1], through.1[1], RHO / PI * 5.0 / PI * factor, 1e-4);
        }
    }
    // A mirror at the origin sees the sky through it, and nothing beside it.
    let mirror = "Material \"conductor\" \"rgb reflectance\" [1 1 1] Shape \"disk\" \"float radius\" 50\n";
    for (from, expected) in [([-70.0, -20.0, 90.0], 2.0), ([70.0, -20.0, 90.0], 0.0), ([-70.0, 20.0, 90.0], 0.0)] {
        let shot = Shot { from, ..camera() };
        let world = format!("{mirror}LightSource \"infinite\" \"rgb L\" [2 2 2] {portal}");
        let (mean, _) = mean_in(folder.path(), &shot, &world, &Options { spp: 4, ..Options::default() });
        assert!((mean[0] - expected).abs() < 1e-3, "{from:?}: {}", mean[0]);
    }
}

/// ∫ `radiance`(u, v, cosine at the light) cos cos' / r² over the rectangle from (−1, −0.5) to (1, 0.5) at the height 1, seen from the origin.
fn gathered(radiance: impl Fn(f64, f64, f64) -> f64) -> f64 {
    let steps = 600;
    let middle = |k: usize| (k as f64 + 0.5) / steps as f64;
    let mut sum = 0.0;
    for i in 0..steps * steps {
        let (u, v) = (middle(i % steps), middle(i / steps));
        let square = (2.0 * u - 1.0).powi(2) + (v - 0.5).powi(2) + 1.0;
        sum += radiance(u, v, 1.0 / square.sqrt()) / (square * square);
    }
    sum * 2.0 / (steps * steps) as f64
}

/// That rectangle, shining down.
fn rectangle(emission: &str) -> [String; 2] {
    let uv = "\"point2 uv\" [0 0 1 0 1 1 0 1]";
    [
        format!("AreaLightSource \"diffuse\" {emission} Material \"diffuse\" \"rgb reflectance\" [0 0 0]
                 Shape \"trianglemesh\" \"point3 P\" [-1 -0.5 1  1 -0.5 1  1 0.5 1  -1 0.5 1] {uv} \"integer indices\" [0 2 1 0 3 2]"),
        format!("ReverseOrientation AreaLightSource \"diffuse\" {emission} Material \"diffuse\" \"rgb reflectance\" [0 0 0]
                 Shape \"bilinearmesh\" \"point3 P\" [-1 -0.5 1  1 -0.5 1  -1 0.5 1  1 0.5 1]"),
    ]
}

#[track_caller]
fn lit_by_rectangle(folder: &TempDir, what: &str, emission: &str, expected: [f64; 3]) {
    // Power is that of each face, and the first has two.
    let of_faces = if emission.contains("power") { [2.0, 1.0] } else { [1.0; 2] };
    for (shape, faces) in rectangle(emission).into_iter().zip(of_faces) {
        let world = format!("{PLATE}AttributeBegin {shape} AttributeEnd");
        let (mean, error) = mean_in(folder.path(), &low_camera(), &world, &Options { spp: 2048, ..Options::default() });
        for c in 0..3 {
            println!("{what}: {} ± {} expected {}", mean[c], error[c], faces * expected[c]);
            assert!(error[c] < 4e-3 * mean[c], "{what}: too noisy");
            assert_mean(what, mean[c], error[c], RHO / PI * faces * expected[c], 1e-4);
        }
    }
}

/// One that sees the origin below the rectangle.
fn low_camera() -> Shot {
    Shot { from: [0.0, -100.0, 40.0], ..camera() }
}

#[test]
fn an_image_on_an_emitter_is_seen_where_it_is() {
    let folder = folder();
    let blend = |u: f64| ((u - 0.25) * 2.0).clamp(0.0, 1.0);
    let (left, right) = ([1.0, 2.0, 0.0], [3.0, 2.0, 5.0]);
    let texel = |c: usize, u: f64| left[c] + (right[c] - left[c]) * blend(u);
    let expected = [0, 1, 2].map(|c| 2.0 * gathered(|u, _, _| texel(c, u)));
    lit_by_rectangle(&folder, "image", "\"string filename\" \"halves.pfm\" \"float scale\" 2", expected);
    // By power, in luminance over both sides: the mean of both halves, the area 2.
    let luminance = |[r, g, b]: [f64; 3]| 0.212_671 * r + 0.715_160 * g + 0.072_169 * b;
    let mean = 0.5 * (luminance(left) + luminance(right));
    let factor = 30.0 / (PI * 2.0 * 2.0 * mean);
    let expected = [0, 1, 2].map(|c| factor * gathered(|u, _, _| texel(c, u)));
    let power = "\"string filename\" \"halves.pfm\" \"float power\" 30 \"bool twosided\" true";
    lit_by_rectangle(&folder, "power", power, expected);
    // Half of it is there, wherever it is.
    let there = "\"string filename\" \"halves.pfm\" \"float scale\" 2";
    for shape in rectangle(there).map(|shape| format!("{shape} \"float alpha\" 0.5")) {
        let world = format!("{PLATE}AttributeBegin {shape} AttributeEnd");
        let (mean, error) = mean_in(folder.path(), &low_camera(), &world, &Options { spp: 4096, ..Options::default() });
        for c in 0..3 {
            assert!(error[c] < 6e-3 * mean[c], "alpha: too noisy");
            assert_mean("alpha", mean[c], error[c], 0.5 * RHO / PI * 2.0 * gathered(|u, _, _| texel(c, u)), 1e-4);
        }
    }
    // Seen by itself: from below, so that u runs to the right where x does.
    for (x, v) in [(-0.8, 1.0), (0.8, 3.0)] {
        let shot = Shot { from: [x, 0.0, 0.0], to: [x, 0.001, 1.0], fov: 0.1, size: 4, depth: 0 };
        for shape in rectangle("\"string filename\" \"halves.pfm\"") {
            let (mean, _) = mean_in(folder.path(), &shot, &shape, &Options { spp: 4, ..Options::default() });
            assert!((mean[0] - v).abs() < 1e-4, "{x}: {mean:?}");
        }
    }
}

#[test]
fn a_photometric_file_shapes_an_emitter_about_its_normal() {
    let folder = folder();
    // The normal is −z, the reference +x: seen from the origin, a point at +x sends its light back along −x.
    let greatest = value(0.0, 180.0);
    let factor = |u: f64, v: f64, cos: f64| {
        let vertical = cos.acos().to_degrees();
        let (x, y) = (-(2.0 * u - 1.0), -(v - 0.5));
        let around = y.atan2(x).to_degrees().abs();
        value(vertical, around) / greatest
    };
    let expected = [4.0 * gathered(factor); 3];
    lit_by_rectangle(&folder, "profile", "\"string ies\" \"lamp.ies\" \"rgb L\" [4 4 4]", expected);
    // Turned the other way.
    let turned = [4.0 * gathered(|u, v, cos| factor(1.0 - u, v, cos)); 3];
    let emission = "\"string ies\" \"lamp.ies\" \"rgb L\" [4 4 4] \"vector3 iesreference\" [-1 0 0]";
    lit_by_rectangle(&folder, "turned profile", emission, turned);
}

/// One of each of them over a room of surfaces. Where `lit` does not name its place, a light is left out.
fn lights(lit: impl Fn(usize) -> bool) -> String {
    let lights = [
        "Translate -1 2 -1 LightSource \"goniometric\" \"string filename\" \"sky.pfm\" \"rgb I\" [3 2 2]",
        "Translate 1 2 -1 Rotate 90 1 0 0 Scale 1 -1 1 LightSource \"point\" \"string ies\" \"lamp.ies\" \"string iesunits\" \"relative\" \"rgb I\" [6 6 7]",
        "LightSource \"spot\" \"string ies\" \"lamp.ies\" \"string iesunits\" \"relative\" \"rgb I\" [9 8 4] \"point3 from\" [0.4 2 -1.5] \"point3 to\" [0 -1 0]",
        "LookAt 0 1.5 -3  0 -0.5 0  0 1 0 ",
        "LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"float scale\" 0.5 \"point3 portal\" [-1 2.5 -1  -1 2.5 1  1 2.5 1  1 2.5 -1]",
    ];
    // A projector is placed as a camera's inverse would be: by hand.
    let projector = "Translate 0 1.5 -3 Rotate 30 1 0 0 LightSource \"projection\" \"string filename\" \"screen.pfm\" \"float fov\" 50 \"float scale\" 6";
    let mut text = String::new();
    for (i, light) in lights.iter().enumerate().filter(|(i, _)| lit(*i)) {
        text += &format!("AttributeBegin {} AttributeEnd\n", if i == 3 { projector } else { light });
    }
    let areas = [
        (
            "\"string filename\" \"screen.pfm\" \"bool twosided\" true \"float scale\" 4",
            "Translate -1.2 0.2 0.8 Shape \"sphere\" \"float radius\" 0.3",
        ),
        (
            "\"string ies\" \"lamp.ies\" \"rgb L\" [9 5 3]",
            "Translate 1.2 1.2 0.3 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 0.4",
        ),
    ];
    for (i, (emission, shape)) in areas.iter().enumerate() {
        let light =
            if lit(i + lights.len()) { format!("AreaLightSource \"diffuse\" {emission}") } else { String::new() };
        text +=
            &format!("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] {light} {shape} AttributeEnd\n");
    }
    // A moving, mirrored object with an image.
    let light = if lit(7) {
        "AreaLightSource \"diffuse\" \"string filename\" \"halves.pfm\" \"bool twosided\" true"
    } else {
        ""
    };
    text += &format!(
        "ObjectBegin \"o\" AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] {light}
         Shape \"bilinearmesh\" \"point3 P\" [-0.4 -0.3 0  0.4 -0.3 0  -0.4 0.3 0.2  0.4 0.3 0] AttributeEnd ObjectEnd
         AttributeBegin ActiveTransform EndTime Translate 0 0.3 0 ActiveTransform All Translate 0.2 0.9 1 Scale -1 1 1 ObjectInstance \"o\" AttributeEnd\n"
    );
    text
}

const COUNT: usize = 8;

fn surfaces() -> &'static str {
    "AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5]
     Shape \"disk\" \"float radius\" 5 AttributeEnd
     AttributeBegin Translate 0.6 -0.4 0 Material \"conductor\" \"float roughness\" 0.3 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd
     AttributeBegin Translate -0.7 -0.4 -0.3 Material \"coateddiffuse\" \"float roughness\" 0.2 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n"
}

fn media() -> String {
    format!(
        "MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.05 0.1 0.05] \"rgb sigma_s\" [0.3 0.2 0.2] \"float g\" 0.4
         MakeNamedMedium \"f\" \"string type\" \"uniformgrid\" \"integer nx\" 1 \"integer ny\" 1 \"integer nz\" 1 \"point3 p0\" [-0.3 -0.3 -0.3]
         \"point3 p1\" [0.3 0.3 0.3] \"float density\" [1] \"rgb Le\" [2 1 0.5]\n{}{}",
        boundary("h", "", "Translate 0.2 0.4 0 Shape \"sphere\" \"float radius\" 1.5"),
        boundary("f", "", "Shape \"sphere\" \"float radius\" 0.5"),
    )
}

fn agree(folder: &Path, world: &str, spp: u32, volume_lights: VolumeLights) {
    let shot = Shot { from: [0.0, 1.0, -5.0], to: [0.0, 0.2, 0.0], fov: 45.0, size: 12, depth: 3 };
    let camera = Framed { shot, camera: "\"float shutteropen\" 0 \"float shutterclose\" 1", ..Framed::default() };
    let options = |lights, spp| Options { spp, lights, volume_lights, ..Options::default() };
    let (mean, error) = mean_in(folder, &camera, world, &options(LightSelection::Optimal, spp));
    let rivals = [
        ("uniform", LightSelection::Uniform, 3),
        ("power", LightSelection::Power, 3),
        ("tree", LightSelection::Tree, 1),
        ("cache points", LightSelection::CachePoints, 1),
    ];
    for (name, lights, factor) in rivals {
        let (other, other_error) = mean_in(folder, &camera, world, &options(lights, factor * spp));
        for c in 0..3 {
            let both = error[c].hypot(other_error[c]);
            println!("{name}: {:.5} ± {:.5} and {:.5} ± {:.5}", mean[c], error[c], other[c], other_error[c]);
            assert!(both < 1.2e-2 * mean[c], "{name}: {both} is too large to tell");
            assert_mean(name, other[c], both, mean[c], 0.0);
        }
    }
    // Light is additive: each alone, all together.
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    for i in 0..COUNT {
        let alone = world.replace(&lights(|_| true), &lights(|k| k == i));
        assert_ne!(alone, world);
        let (part, part_error) = mean_in(folder, &camera, &alone, &options(LightSelection::Uniform, spp));
        for c in 0..3 {
            sum[c] += part[c];
            squares[c] += part_error[c].powi(2);
        }
    }
    if !world.contains("rgb Le") {
        for c in 0..3 {
            let both = (error[c].powi(2) + squares[c]).sqrt();
            println!("one by one: {:.5} and {:.5} ± {both:.5}", mean[c], sum[c]);
            assert!(both < 1.5e-2 * mean[c], "one by one: {both} is too large to tell");
            assert_mean("one by one", sum[c], both, mean[c], 0.0);
        }
    }
}

#[test]
fn selectors_agree_on_surfaces() {
    let folder = folder();
    agree(folder.path(), &format!("{}{}", lights(|_| true), surfaces()), 512, VolumeLights::Auto);
}

#[test]
fn selectors_agree_in_media_that_glow() {
    let folder = folder();
    agree(folder.path(), &format!("{}{}{}", lights(|_| true), surfaces(), media()), 768, VolumeLights::Auto);
}

#[test]
fn they_can_be_linked() {
    let folder = folder();
    let light = "LightSource \"goniometric\" \"string filename\" \"rows.pfm\" \"string name\" \"lamp\"";
    for (lights, expected) in [("[\"lamp\"]", 4.0), ("[]", 0.0)] {
        let plate = PLATE.replace("\"float radius\" 50", &format!("\"float radius\" 50 \"string lights\" {lights}"));
        let world = format!("{plate}AttributeBegin Translate 0 1 1 {light} AttributeEnd");
        let (mean, _) = mean_in(folder.path(), &camera(), &world, &Options { spp: 4, ..Options::default() });
        assert!((mean[0] - reflected(expected, [0.0, 1.0, 1.0])).abs() < 1e-4);
    }
}

#[test]
fn what_is_wrong_is_said() {
    let folder = folder();
    let path = folder.path().join("scene.pbrt");
    let outcome = |world: &str| {
        std::fs::write(&path, camera().scene(&format!("{PLATE}{world}"))).expect("the scene can be written");
        let mut warnings = Warnings::default();
        let error = prepare_file(&path, &Options::default(), &mut warnings).err().map(|error| error.to_string());
        (error, warnings.list().iter().map(|w| w.message.clone()).collect::<Vec<_>>().join("\n"))
    };
    for (world, expected) in [
        (
            "LightSource \"point\" \"string ies\" \"short.ies\"",
            "short.ies: line 10: the file ends before a candela value",
        ),
        ("LightSource \"point\" \"string ies\" \"quarters.pfm\"", "not an IES file"),
        ("LightSource \"point\" \"string ies\" \"none.ies\"", "none.ies"),
        ("LightSource \"point\" \"string ies\" \"lamp.ies\" \"string iesunits\" \"lux\"", "\"iesunits\""),
        ("LightSource \"spot\" \"string ies\" \"short.ies\"", "line 10"),
        ("LightSource \"goniometric\" \"string filename\" \"lamp.ies\"", "lamp.ies"),
        ("LightSource \"projection\"", "needs an image"),
        ("LightSource \"projection\" \"string filename\" \"quarters.pfm\" \"float fov\" 180", "\"fov\""),
        ("LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0]", "four points"),
        ("LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0.2 1 0]", "rectangle"),
        ("AreaLightSource \"diffuse\" \"string ies\" \"short.ies\" Shape \"sphere\"", "line 10"),
        (
            "AreaLightSource \"diffuse\" \"string ies\" \"lamp.ies\" \"vector3 iesreference\" [0 0 0] Shape \"sphere\"",
            "a direction",
        ),
    ] {
        let (error, _) = outcome(world);
        let error = error.unwrap_or_else(|| panic!("{world} is accepted"));
        assert!(error.contains(expected), "{world}: {error}");
    }
    for (world, expected) in [
        ("LightSource \"goniometric\"", "alike in all directions"),
        ("LightSource \"goniometric\" \"string filename\" \"none.png\"", "none.png: the light is magenta"),
        (
            "AreaLightSource \"diffuse\" \"string filename\" \"none.pfm\" Shape \"sphere\"",
            "none.pfm: the light is magenta",
        ),
        ("LightSource \"goniometric\" \"string filename\" \"rows.pfm\"", "twice as wide as high"),
        ("LightSource \"goniometric\" \"string filename\" \"sky.pfm\" \"float fov\" 3", "\"fov\""),
        ("LightSource \"point\" \"string ies\" \"lamp.ies\" \"float iesscale\" 3", "\"iesscale\""),
        (
            "AreaLightSource \"diffuse\" \"string filename\" \"sky.pfm\" \"rgb L\" [1 1 1] Shape \"sphere\"",
            "beside \"filename\"",
        ),
    ] {
        let (error, warnings) = outcome(world);
        assert_eq!(error, None, "{world}");
        assert!(warnings.contains(expected), "{world}: {warnings}");
    }
}
