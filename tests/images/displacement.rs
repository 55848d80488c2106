//! Displaced meshes through the whole program, against the meshes that they must be: moved plates and lamps, slopes, height fields, instances, motion, and
//! both backends. Statistical assertions fail by chance with probability 1e-6 each (see `common::assert_mean`).

use std::fmt::Write;

use crate::common::{CUBE, Options, SLACK, Shot, View, assert_mean, difference, image_mean, prepare_text, render_text};

/// A quadrilateral from −1 to 1 with texture coordinates from 0 to 1.
const QUAD: &str =
    "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] \"integer indices\" [0 1 2 2 1 3]
                    \"point2 uv\" [0 0  1 0  0 1  1 1]";
const LIGHT: &str = "LightSource \"point\" \"rgb I\" [6 5 4] \"point3 from\" [1 1.5 3]\n";

fn shot() -> Shot {
    Shot { from: [0.0, -3.0, 4.0], fov: 35.0, size: 32, depth: 3, ..Shot::default() }
}

/// The relative RMSE between two worlds at the same seed.
fn apart(shot: &Shot, [a, b]: [&str; 2], options: &Options) -> f64 {
    let [a, b] = [a, b].map(|world| shot.render(&format!("{LIGHT}{world}"), options));
    let (mean, _) = image_mean(&a.film);
    assert!(mean[0] > 0.0, "black");
    difference(&a.film, &b.film)
}

#[test]
fn displaced_plates_and_slopes_are_the_plates_that_they_come_to() {
    let slope =
        "Texture \"h\" \"float\" \"bilerp\" \"float v00\" 0 \"float v10\" 0.5 \"float v01\" 0.25 \"float v11\" 0.75\n";
    let at = "\"point3 P\" [-1 -1 0  1 -1 0.5  -1 1 0.25  1 1 0.75] \"point2 uv\" [0 0  1 0  0 1  1 1]";
    for (name, displaced, plain) in [
        (
            "constant",
            format!("{QUAD} \"float displacement\" 0.5 \"float displacement.edgelength\" 0.3"),
            format!("Translate 0 0 0.5 {QUAD}"),
        ),
        (
            "larger",
            format!(
                "Scale 1 1 0.5 {QUAD} \"float displacement\" 1 \"float edgelength\" 0.3 \"normal N\" [0 0 2 0 0 2 0 0 2 0 0 2]"
            ),
            format!("Translate 0 0 0.5 {QUAD}"),
        ),
        (
            "slope",
            format!("{slope}{QUAD} \"texture displacement\" \"h\" \"float displacement.edgelength\" 0.2"),
            format!("Shape \"trianglemesh\" {at} \"integer indices\" [0 1 2 2 1 3]"),
        ),
        (
            "patch",
            format!(
                "{slope}Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] \"texture displacement\" \"h\""
            ),
            format!("Shape \"bilinearmesh\" {at}"),
        ),
        (
            "instance",
            format!(
                "ObjectBegin \"o\" {slope}{QUAD} \"texture displacement\" \"h\" ObjectEnd\nRotate 20 0 0 1 ObjectInstance \"o\""
            ),
            format!("Rotate 20 0 0 1 Shape \"trianglemesh\" {at} \"integer indices\" [0 1 2 2 1 3]"),
        ),
        (
            "moving",
            format!(
                "ActiveTransform EndTime Translate 0.5 0 0.2 ActiveTransform All {slope}{QUAD} \"texture displacement\" \"h\""
            ),
            format!(
                "ActiveTransform EndTime Translate 0.5 0 0.2 ActiveTransform All Shape \"trianglemesh\" {at} \"integer indices\" [0 1 2 2 1 3]"
            ),
        ),
    ] {
        let options = Options { spp: 16, ..Options::default() };
        let rmse = apart(&shot(), [&displaced, &plain], &options);
        println!("{name}: {rmse:.1e}");
        // A sample at an edge may fall to either side.
        assert!(rmse < 5e-3, "{name}: {rmse:e}");
    }
}

/// Hills over 16 × 16 texels, from a file, against a mesh of 256 × 256 squares whose heights were computed here.
#[test]
fn an_image_of_heights_is_its_height_field() {
    const SIDE: usize = 16;
    const FINE: usize = 256;
    let folder = tempfile::tempdir().expect("a folder");
    let hill = |x: f64, y: f64| (2.0 + (5.0 * x).sin() + (7.0 * y).cos()) * 0.25;
    let texels: Vec<f64> =
        (0..SIDE * SIDE).map(|i| hill((i % SIDE) as f64 / SIDE as f64, (i / SIDE) as f64 / SIDE as f64)).collect();
    let mut pfm = format!("Pf\n{SIDE} {SIDE}\n-1.0\n").into_bytes();
    // Rows of a PFM go up, as v does.
    texels.iter().for_each(|t| pfm.extend((*t as f32).to_le_bytes()));
    let file = folder.path().join("heights.pfm");
    std::fs::write(&file, pfm).expect("it can be written");
    let bilinear = |u: f64, v: f64| {
        let (x, y) = (u * SIDE as f64 - 0.5, v * SIDE as f64 - 0.5);
        let at = |x: f64, y: f64| {
            let clamp = |x: f64| x.clamp(0.0, SIDE as f64 - 1.0) as usize;
            texels[clamp(y) * SIDE + clamp(x)]
        };
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let row = |y: f64| (1.0 - fx) * at(x.floor(), y) + fx * at(x.floor() + 1.0, y);
        (1.0 - fy) * row(y.floor()) + fy * row(y.floor() + 1.0)
    };
    let (mut points, mut indices) = (String::new(), String::new());
    for i in 0..(FINE + 1) * (FINE + 1) {
        let (u, v) = ((i % (FINE + 1)) as f64 / FINE as f64, (i / (FINE + 1)) as f64 / FINE as f64);
        write!(points, "{} {} {} ", 2.0 * u - 1.0, 2.0 * v - 1.0, bilinear(u, v)).expect("text");
        if i % (FINE + 1) < FINE && i / (FINE + 1) < FINE {
            write!(indices, "{i} {} {} {i} {} {} ", i + 1, i + FINE + 2, i + FINE + 2, i + FINE + 1).expect("text");
        }
    }
    let exact = format!("{LIGHT}Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [{indices}]");
    let displaced = format!(
        "{LIGHT}Texture \"h\" \"float\" \"imagemap\" \"string filename\" \"{}\" \"string wrap\" \"clamp\"
         {QUAD} \"texture displacement\" \"h\" \"float displacement.edgelength\" 0.012",
        file.display()
    );
    let options = Options { spp: 16, ..Options::default() };
    let [exact, displaced] = [exact, displaced].map(|world| shot().render(&world, &options));
    let rmse = difference(&exact.film, &displaced.film);
    let depth = |film: &lanternfish::film::Film| film.channels().channel("depth.Z").expect("depths").to_vec();
    let (a, b) = (depth(&exact.film), depth(&displaced.film));
    // Where both see the field and not past its border.
    let off = a.iter().zip(&b).filter(|(a, b)| a.is_finite() && b.is_finite() && (**a - **b).abs() > 0.02).count();
    println!("height field: relative RMSE {rmse:.1e}, {off} depths differ");
    assert!(rmse < 0.06 && off < a.len() / 50, "{rmse:e}, {off} of {}", a.len());
}

/// What a displaced lamp gives is what the lamp gives that it comes to: a raised plate, by radiance, by power and by an image, and a blown-up cube.
#[test]
fn displaced_emitters_are_emitters() {
    let floor = "Material \"diffuse\" Translate 0 0 -2 Shape \"disk\" \"float radius\" 50\n";
    let shot = Shot { from: [0.0, 0.0, 30.0], to: [8.0, 0.0, -2.0], fov: 3.0, size: 4, depth: 1 };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("l.pfm");
    let mut pfm = b"PF\n4 4\n-1.0\n".to_vec();
    // Nearly all of it comes from one side.
    (0..48).for_each(|i| pfm.extend(if i % 12 < 6 { 9.0f32 } else { 0.5 }.to_le_bytes()));
    std::fs::write(&file, pfm).expect("it can be written");
    let image = format!("\"string filename\" \"{}\"", file.display());
    for light in ["\"rgb L\" [3 2 1]", "\"float power\" 40", image.as_str()] {
        let lamp = |before: &str, shape: &str| {
            let world = format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"bool twosided\" true {light} {before} {shape} AttributeEnd\n{floor}"
            );
            shot.mean(&world, 256)
        };
        let (displaced, e0) =
            lamp("", &format!("{QUAD} \"float displacement\" 1.5 \"float displacement.edgelength\" 0.4"));
        let (moved, e1) = lamp("Translate 0 0 1.5", QUAD);
        for c in 0..3 {
            let error = e0[c].hypot(e1[c]);
            assert!(error < 2e-2 * moved[c], "{error} of {}", moved[c]);
            assert_mean(light, displaced[c], error, moved[c], SLACK);
        }
    }
    // A lamp of many parts is one.
    let job = prepare_text(
        &shot.text(&format!(
            "AreaLightSource \"diffuse\" {} \"float displacement\" 0.2 \"float edgelength\" 0.5",
            CUBE.trim_end()
        )),
        &Options::default(),
    );
    assert_eq!(job.world.lights.len(), 1, "a mesh is one light");
}

#[cfg(feature = "embree")]
#[test]
fn both_backends_see_the_same_mesh() {
    use lanternfish::geometry::Backend;
    let world = format!(
        "{LIGHT}LightSource \"infinite\" \"rgb L\" [0.2 0.2 0.3]
         Texture \"f\" \"float\" \"fbm\" \"integer octaves\" 4 Texture \"h\" \"float\" \"scale\" \"texture tex\" \"f\" \"float scale\" 0.3
         Scale 0.7 0.7 0.7 {} \"texture displacement\" \"h\" \"float displacement.edgelength\" 0.1",
        CUBE.trim_end()
    );
    let render = |backend| shot().render(&world, &Options { spp: 32, backend, ..Options::default() });
    let rmse = difference(&render(Backend::Embree).film, &render(Backend::Native).film);
    assert!(rmse < 1e-3, "{rmse:e}");
}

/// A closed displaced body lets nothing through: white inside a dome, with light from outside alone, it stays as black as it is.
#[test]
fn displaced_bodies_are_closed() {
    let body = format!(
        "Texture \"f\" \"float\" \"wrinkled\" Texture \"h\" \"float\" \"scale\" \"texture tex\" \"f\" \"float scale\" 0.4
         {} \"texture displacement\" \"h\" \"float displacement.edgelength\" 0.15",
        CUBE.trim_end()
    );
    let world =
        format!("LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n{body}");
    let inside = Shot { from: [0.0, 0.1, 0.2], to: [1.0, 0.3, 0.5], fov: 120.0, size: 64, depth: 0 };
    let outcome = render_text(&inside.text(&world), &Options { spp: 64, ..Options::default() });
    let (mean, _) = image_mean(&outcome.film);
    assert_eq!(mean, [0.0; 3], "rays get out");
}
