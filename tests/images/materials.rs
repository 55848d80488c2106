//! Materials through the whole program, where theory has the answer: panes, cloth, coated metal, hair, normal and bump maps. Assertions
//! fail by chance with probability 1e-6 each (see `common::assert_mean`).

use std::path::Path;

use crate::common::{CUBE, Options, SLACK, Shot, View, assert_mean, render_text};
use lanternfish::stability::scene::{DOME, FOREVER};

const PLATE: &str = "Shape \"disk\" \"float radius\" 50\n";

/// A camera far away that sees the plane z = 0 at an angle to its normal, over a field so narrow that the angle is the same in all pixels.
fn tilted(angle: f64) -> Shot {
    let (s, c) = angle.to_radians().sin_cos();
    Shot { from: [100.0 * s, 0.0, 100.0 * c], fov: 0.1, ..Shot::default() }
}

fn fresnel_dielectric(cosine: f64, eta: f64) -> f64 {
    let t = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
    let parallel = (eta * cosine - t) / (eta * cosine + t);
    let perpendicular = (cosine - eta * t) / (cosine + eta * t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Light from a direction at `angle` from +z towards +x, of irradiance π across it.
fn sun(angle: f64) -> String {
    let (s, c) = angle.to_radians().sin_cos();
    let pi = std::f64::consts::PI;
    format!("LightSource \"distant\" \"rgb L\" [{pi} {pi} {pi}] \"point3 from\" [{s} 0 {c}] \"point3 to\" [0 0 0]\n")
}

/// A pane before the only thing that shines: what is seen of it is what R + T²R/(1 − R²) leaves.
#[test]
fn a_pane_passes_what_its_reflections_leave() {
    for (angle, eta) in [(0.0, 1.5), (60.0, 1.5), (80.0, 1.33), (45.0, 2.4)] {
        let r = fresnel_dielectric(f64::to_radians(angle).cos(), eta);
        let reflected = r + (1.0 - r).powi(2) * r / (1.0 - r * r);
        let world = format!(
            "AttributeBegin Translate 0 0 -1 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
             Material \"diffuse\" \"rgb reflectance\" [0 0 0] {PLATE} AttributeEnd
             Material \"thindielectric\" \"float eta\" {eta}\n{PLATE}"
        );
        // Where a path goes is a coin's toss for each.
        tilted(angle).assert(&format!("pane at {angle}°"), &world, 4096, [1.0 - reflected; 3], 3e-3);
    }
}

#[test]
fn cloth_scatters_to_both_sides() {
    let cloth = "Material \"diffusetransmission\" \"rgb reflectance\" [0.4 0.2 0.1] \"rgb transmittance\" [0.1 0.3 0.8] \"float scale\" 0.5";
    for (angle, expected) in [(40.0, [0.2, 0.1, 0.05]), (140.0, [0.05, 0.15, 0.4])] {
        let cosine = f64::to_radians(angle).cos().abs();
        let world = format!("{}{cloth}\n{PLATE}", sun(angle));
        tilted(20.0).assert(&format!("sun at {angle}°"), &world, 16, expected.map(|e: f64| e * cosine), 1e-6);
    }
}

/// A smooth coat over a mirror: R + (1 − R)²ρ / (1 − Rρ), with the metal's index taken relative to the coat's.
#[test]
fn coated_mirrors_reflect_all_their_bounces() {
    let (eta, k) = (0.2f64, 3.0f64);
    for angle in [0.0, 60.0f64] {
        let cosine = angle.to_radians().cos();
        let inside = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
        let (n, k1) = (eta / 1.5, k / 1.5);
        let (c2, s2) = (inside * inside, 1.0 - inside * inside);
        let t0 = n * n - k1 * k1 - s2;
        let ab = (t0 * t0 + 4.0 * n * n * k1 * k1).sqrt();
        let a = (0.5 * (ab + t0)).max(0.0).sqrt();
        let rs = (ab + c2 - 2.0 * inside * a) / (ab + c2 + 2.0 * inside * a);
        let rp = rs * (c2 * ab + s2 * s2 - 2.0 * inside * a * s2) / (c2 * ab + s2 * s2 + 2.0 * inside * a * s2);
        let metal = 0.5 * (rs + rp);
        let r = fresnel_dielectric(cosine, 1.5);
        let expected = r + (1.0 - r).powi(2) * metal / (1.0 - r * metal);
        let world = format!(
            "{DOME}Material \"coatedconductor\" \"float thickness\" 0 \"integer maxdepth\" 1000
             \"rgb conductor.eta\" [{eta} {eta} {eta}] \"rgb conductor.k\" [{k} {k} {k}]\n{PLATE}"
        );
        tilted(angle).assert(&format!("coated mirror at {angle}°"), &world, 1024, [expected; 3], 3e-3);
    }
}

/// Rough layers under a dome: what lights find and what paths find is one thing. With one of the two taken away (a dome behind glass of index
/// 1) the mean stays.
#[test]
fn rough_coated_metal_is_the_same_however_light_is_found() {
    let metal = "Material \"coatedconductor\" \"float interface.roughness\" 0.2 \"float conductor.roughness\" 0.3 \"float thickness\" 0.1
                 \"float albedo\" 0.5 \"float g\" 0.3\n";
    let shell =
        "AttributeBegin Material \"dielectric\" \"float eta\" 1 Shape \"sphere\" \"float radius\" 200 AttributeEnd\n";
    let (a, a_error) = tilted(50.0).mean(&format!("{DOME}{metal}{PLATE}"), 4096);
    let (b, b_error) = tilted(50.0).mean(&format!("{DOME}{shell}{metal}{PLATE}"), 4096);
    for c in 0..3 {
        let error = a_error[c].hypot(b_error[c]);
        assert!(error < 1e-2 * a[c], "{error} of {}", a[c]);
        assert_mean("coated metal", b[c], error, a[c], SLACK);
    }
}

/// Hair that absorbs nothing is invisible, on the curves that it is for, of every kind, and on anything else.
#[test]
fn white_hair_is_invisible() {
    let hair = |more: &str| format!("{DOME}Material \"hair\" \"rgb sigma_a\" [0 0 0] {more}\n");
    let shot = Shot { depth: FOREVER, size: 8, ..Shot::default() };
    let points = "\"point3 P\" [-1 0 0  -0.3 1 0.2  0.3 -1 -0.2  1 0 0] \"float width\" 0.5";
    for (kind, more) in [
        ("flat", ""),
        ("cylinder", "\"float beta_m\" 0.1 \"float beta_n\" 0.2"),
        ("ribbon", "\"float alpha\" 10 \"float eta\" 1.3"),
    ] {
        let normals = if kind == "ribbon" { "\"normal N\" [0 0.2 -1  0.3 0 -1]" } else { "" };
        let world = format!("{}Shape \"curve\" \"string type\" \"{kind}\" {points} {normals}", hair(more));
        shot.assert(&format!("{kind} curve"), &world, 256, [1.0; 3], 3e-3);
    }
    shot.assert("hairy cube", &format!("{}Rotate 30 1 2 3 {CUBE}", hair("")), 512, [1.0; 3], 3e-3);
}

/// A tuft of brown hair: many curves, light from lamps and a dome, the same to both backends and however many lights are asked for.
#[test]
fn pigments_darken_hair() {
    let curves: String = (0..60)
        .map(|i| {
            let (x, z) = (f64::from(i % 10) * 0.08 - 0.36, f64::from(i / 10) * 0.08);
            format!("Shape \"curve\" \"string type\" \"cylinder\" \"point3 P\" [{x} -1 {z}  {x} 0 {z}  {x} 0.3 {z}  {x} 1 {z}] \"float width\" 0.05\n")
        })
        .collect();
    let mean = |colour: &str| {
        let world = format!("{DOME}Material \"hair\" {colour}\n{curves}");
        Shot { depth: 50, fov: 8.0, ..Shot::default() }.mean(&world, 64).0
    };
    let (blond, brown, red) =
        (mean("\"float eumelanin\" 0.2"), mean("\"float eumelanin\" 1.3"), mean("\"float pheomelanin\" 1.3"));
    assert!(
        blond[1] > 1.3 * brown[1] && brown[0] > brown[2] && red[0] / red[2] > brown[0] / brown[2],
        "{blond:?} {brown:?} {red:?}"
    );
}

fn write_png(folder: &Path, name: &str, image: image::RgbImage) -> String {
    let path = folder.join(name);
    image.save(&path).expect("the image can be written");
    path.display().to_string()
}

/// Normals of one direction all over: the plate is lit as a plate of that direction would be, whatever stands between it and the map.
#[test]
fn a_map_of_one_normal_is_a_tilted_plate() {
    let folder = tempfile::tempdir().expect("a folder");
    let stored = [200u8, 127, 230];
    let file = write_png(folder.path(), "n.png", image::RgbImage::from_pixel(4, 4, image::Rgb(stored)));
    let n = stored.map(|c| 2.0 * f64::from(c) / 255.0 - 1.0);
    let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
    // The plate's tangent is +x: a quadrilateral with the usual texture coordinates.
    let quad = "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0  9 -9 0  -9 9 0  9 9 0]\n";
    let (s, c) = 30f64.to_radians().sin_cos();
    let expected = 0.5 * (n[0] * s + n[2] * c) / length;
    let mapped = format!("\"string normalmap\" \"{file}\"");
    for (name, material) in [
        ("diffuse", format!("Material \"diffuse\" {mapped}\n")),
        ("named", format!("MakeNamedMaterial \"m\" \"string type\" \"diffuse\" {mapped}\nNamedMaterial \"m\"\n")),
        (
            "mix",
            format!(
                "MakeNamedMaterial \"m\" \"string type\" \"diffuse\" {mapped}
                 Material \"mix\" \"string materials\" [\"m\" \"m\"]\n"
            ),
        ),
    ] {
        tilted(5.0).assert(name, &format!("{}{material}{quad}", sun(30.0)), 16, [expected; 3], 1e-6);
    }
}

/// A height that rises by a slope all over tilts the normal by it, on every shape and under every transform.
#[test]
fn a_displacement_of_one_slope_is_a_tilted_plate() {
    let folder = tempfile::tempdir().expect("a folder");
    // 128 texels, two grey values each: linear to the last bit.
    let ramp = image::RgbImage::from_fn(128, 1, |x, _| image::Rgb([2 * x as u8; 3]));
    let file = write_png(folder.path(), "ramp.png", ramp);
    let per_u = 128.0 * 2.0 / 255.0;
    let quad = "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] \"point2 uv\" [0.1 0.1  0.9 0.1  0.1 0.9  0.9 0.9]\n";
    let triangles =
        "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] \"integer indices\" [0 1 2 2 1 3]
                     \"point2 uv\" [0.1 0.1  0.9 0.1  0.1 0.9  0.9 0.9] \"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]\n";
    let (s, c) = 30f64.to_radians().sin_cos();
    for (name, shape, length) in [
        ("patch", quad.to_owned(), 2.5),
        ("triangles", triangles.to_owned(), 2.5),
        ("stretched", format!("Scale 3 1 1\n{quad}"), 7.5),
        ("instance", format!("ObjectBegin \"o\"\n{quad}ObjectEnd\nScale 3 2 1\nObjectInstance \"o\"\n"), 7.5),
    ] {
        let height = 0.8;
        let slope = height * per_u / length;
        let expected = 0.5 * (c - slope * s) / (1.0 + slope * slope).sqrt();
        let world = format!(
            "{}Texture \"h\" \"float\" \"imagemap\" \"string filename\" \"{file}\" \"string encoding\" \"linear\" \"float scale\" {height}
             Material \"diffuse\" \"texture displacement\" \"h\"\n{shape}",
            sun(30.0)
        );
        let (mean, error) = tilted(5.0).mean(&world, 64);
        assert!(error[0] < 1e-4, "{name}: {error:?}");
        // The height is stored in f32, and its differences are small.
        assert_mean(name, mean[0], error[0], expected, 1e-3);
    }
}

/// A scene with a map looks, to the bit, as it does without where the map is not seen.
#[test]
fn relief_keeps_the_images_of_other_materials() {
    let folder = tempfile::tempdir().expect("a folder");
    let flat = write_png(folder.path(), "flat.png", image::RgbImage::from_pixel(1, 1, image::Rgb([128, 128, 255])));
    let ball = "Shape \"sphere\" \"float radius\" 1\n";
    let scene = |more: &str| {
        let world = format!(
            "{DOME}Material \"diffuse\"\n{ball}
             AttributeBegin Translate 50 0 0 Material \"diffuse\" \"rgb reflectance\" [0 0 0] {more}\n{ball} AttributeEnd\n"
        );
        Shot::default().text(&world)
    };
    let options = Options { spp: 4, ..Options::default() };
    let plain = render_text(&scene(""), &options).film.beauty();
    let beside = render_text(&scene(&format!("\"string normalmap\" \"{flat}\"")), &options).film.beauty();
    assert_eq!(plain.pixels, beside.pixels, "a map elsewhere changes nothing");
}
