//! Cameras and filters against what they must come to.
//!
//! False-alarm rate: 1e-6 for each mean.

use std::f64::consts::PI;

use crate::common::{Options, SLACK, assert_mean, boundary, image_mean, integrate, render_text};

/// An image of this many pixels through a camera, in a world.
fn scene(camera: &str, filter: &str, [width, height]: [u32; 2], world: &str) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {width} \"integer yresolution\" {height}
         Camera {camera} PixelFilter {filter} Sampler \"zsobol\" Integrator \"volpath\" \"integer maxdepth\" 1 WorldBegin {world}"
    )
}

/// A filter along x, of any scale.
type Factor = fn(f64) -> f64;

/// Mitchell and Netravali's with B = C = 1/3, over ±2, multiplied out.
fn mitchell(x: f64) -> f64 {
    match x.abs() {
        x if x < 1.0 => (7.0 * x - 12.0) * x * x + 16.0 / 3.0,
        x if x < 2.0 => ((-7.0 / 3.0 * x + 12.0) * x - 20.0) * x + 32.0 / 3.0,
        _ => 0.0,
    }
}

fn sinc(x: f64) -> f64 {
    let part = |x: f64| if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
    if x.abs() < 4.0 { part(x) * part(x / 3.0) } else { 0.0 }
}

fn gaussian(x: f64) -> f64 {
    let g = |x: f64| (-2.0 * x * x).exp();
    (g(x) - g(1.5)).max(0.0)
}

/// The edge of a glowing half-plane under an orthographic camera is the filter's integral, negative where it rings.
#[test]
fn an_edge_is_what_the_filter_makes_of_it() {
    const WIDTH: u32 = 14;
    const ROWS: u32 = 8;
    // In pixels from the left.
    const EDGE: f64 = 6.3;
    const RADIANCE: f64 = 5.0;
    let half = f64::from(WIDTH) / 2.0;
    let [left, right] = [-100.0, EDGE - half];
    let world = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{RADIANCE} {RADIANCE} {RADIANCE}] \"bool twosided\" true Material \"diffuse\" \"rgb reflectance\" [0 0 0]
         Shape \"bilinearmesh\" \"point3 P\" [{left} -100 3  {right} -100 3  {left} 100 3  {right} 100 3] AttributeEnd"
    );
    let camera = format!("\"orthographic\" \"float screenwindow\" [{} {half} -4 4]", -half);
    let filters: [(&str, f64, Factor); 3] =
        [("\"gaussian\"", 1.5, gaussian), ("\"mitchell\"", 2.0, mitchell), ("\"sinc\"", 4.0, sinc)];
    for (name, radius, factor) in filters {
        let film =
            render_text(&scene(&camera, name, [WIDTH, ROWS], &world), &Options { spp: 256, ..Options::default() }).film;
        let image = film.channels();
        let [value, variance] = ["R", "variance.R"].map(|name| image.channel(name).expect("it is there"));
        let whole = integrate(-radius, radius, 64, factor);
        for x in 0..WIDTH {
            let to = (EDGE - f64::from(x) - 0.5).clamp(-radius, radius);
            let expected = RADIANCE * integrate(-radius, to, 64, factor) / whole;
            let column = |plane: &[f32]| (0..ROWS).map(|y| f64::from(plane[(y * WIDTH + x) as usize])).sum::<f64>();
            let (mean, error) = (column(value) / f64::from(ROWS), column(variance).sqrt() / f64::from(ROWS));
            println!("{name} {x}: {mean:.4} ± {error:.4}, expected {expected:.4}");
            assert_mean(name, mean, error.max(1e-6), expected, SLACK);
        }
        // A constant image is constant, however many of its samples count negative.
        let white = "LightSource \"infinite\" \"rgb L\" [1 1 1]";
        let options = Options { spp: 3, ..Options::default() };
        let film = render_text(&scene(&camera, name, [WIDTH, ROWS], white), &options).film;
        let worst = film.beauty().pixels.iter().map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-6, "{name}: a white sky is {worst} off");
    }
}

/// A camera that sees everything sees a lamp's share of the sphere.
#[test]
fn a_spherical_camera_counts_solid_angles() {
    const RADIANCE: f64 = 3.0;
    // A ball of radius 1 at a distance of 2 covers 30 degrees around its middle.
    let lamp = |at: [f64; 3]| {
        let [x, y, z] = at;
        format!(
            "AttributeBegin Translate {x} {y} {z} AreaLightSource \"diffuse\" \"rgb L\" [{RADIANCE} {RADIANCE} {RADIANCE}] Material \"diffuse\" \"rgb reflectance\" [0 0 0]
             Shape \"sphere\" AttributeEnd"
        )
    };
    let cap = (1.0 - (PI / 6.0).cos()) / 2.0;
    let cases = [
        ("equalarea", [0.0, 2.0, 0.0], cap),
        ("equalarea", [-1.2, 0.0, 1.6], cap),
        // Around the pole it covers a sixth of the latitudes.
        ("equirectangular", [0.0, 2.0, 0.0], 1.0 / 6.0),
    ];
    for (mapping, at, share) in cases {
        let camera = format!("\"spherical\" \"string mapping\" \"{mapping}\"");
        let text = scene(&camera, "\"box\"", [24, 24], &lamp(at));
        let film = render_text(&text, &Options { spp: 64, ..Options::default() }).film;
        let (mean, error) = image_mean(&film);
        assert_mean(mapping, mean[0], error[0], RADIANCE * share, SLACK);
    }
}

/// Parallel rays that start inside and outside of a ball of haze around the camera: each has its own media to begin with.
#[test]
fn orthographic_rays_start_in_the_media_where_they_start() {
    const EXTINCTION: f64 = 1.5;
    let haze = format!(
        "MakeNamedMedium \"haze\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{EXTINCTION} {EXTINCTION} {EXTINCTION}] \"rgb sigma_s\" [0 0 0]
         {} LightSource \"infinite\" \"rgb L\" [1 1 1]",
        boundary("haze", "", "Shape \"sphere\"")
    );
    let camera = "\"orthographic\" \"float screenwindow\" [-1.5 1.5 -1.5 1.5]";
    let film =
        render_text(&scene(camera, "\"box\"", [20, 20], &haze), &Options { spp: 256, ..Options::default() }).film;
    let (mean, error) = image_mean(&film);
    // From the plane through its middle each ray has √(1 − r²) of it to go.
    let within = 2.0 * PI * integrate(0.0, 1.0, 16, |s| s * (-EXTINCTION * s).exp());
    assert_mean("haze around the camera", mean[0], error[0], (9.0 - PI + within) / 9.0, SLACK);
}

/// A slanted rectangle before a `gbuffer` film.
#[test]
fn a_gbuffer_knows_where_surfaces_are_and_how_they_lie() {
    // z = 4 + x / 2, seen from (0, 0, -1), 60 degrees across. Its u runs along x from -10 to 10, v along y.
    let world =
        "AttributeBegin Shape \"bilinearmesh\" \"point3 P\" [-10 -10 -1  10 -10 9  -10 10 -1  10 10 9] AttributeEnd
                 LightSource \"infinite\" \"rgb L\" [1 1 1]";
    for system in ["camera", "world"] {
        let text = format!(
            "LookAt 0 0 -1  0 0 1  0 1 0 Film \"gbuffer\" \"integer xresolution\" 9 \"integer yresolution\" 9 \"string coordinatesystem\" \"{system}\"
             Camera \"perspective\" \"float fov\" 60 PixelFilter \"box\" \"float xradius\" 1e-3 \"float yradius\" 1e-3 WorldBegin {world}"
        );
        let film = render_text(&text, &Options { spp: 4, ..Options::default() }).film;
        let image = film.channels();
        let at = |name: &str, pixel: usize| f64::from(image.channel(name).unwrap_or_else(|| panic!("{name}"))[pixel]);
        let tan = (30f64).to_radians().tan();
        for [x, y] in [[4, 4], [1, 7], [8, 0]] {
            let pixel = y * 9 + x;
            let [right, up] = [(x as f64 - 4.0) / 4.5 * tan, -(y as f64 - 4.0) / 4.5 * tan];
            // On the plane, with z measured from the camera: z = 5 + x / 2.
            let z = |right: f64| 5.0 / (1.0 - right / 2.0);
            let lift = if system == "world" { 1.0 } else { 0.0 };
            let expected = [
                ("P.X", right * z(right)),
                ("P.Y", up * z(right)),
                ("P.Z", z(right) - lift),
                ("u", (right * z(right) + 10.0) / 20.0),
                ("v", (up * z(right) + 10.0) / 20.0),
                ("dzdx", z(right + tan / 4.5) - z(right)),
                ("dzdy", 0.0),
                ("Albedo.G", 0.5),
            ];
            for (name, expected) in expected {
                assert!(
                    (at(name, pixel) - expected).abs() < 2e-3 * expected.abs().max(1.0),
                    "{system} {x} {y} {name}: {} for {expected}",
                    at(name, pixel)
                );
            }
            let facing = at("N.X", pixel) / at("N.Z", pixel);
            assert!((facing + 0.5).abs() < 1e-4, "{system} {x} {y}: {facing}");
            assert!((at("Ns.X", pixel) - at("N.X", pixel)).abs() < 1e-6);
        }
    }
}
