//! Scenes whose image is known: light over a plane, slabs of media, single scattering. A wrong factor of 1 % fails.
//!
//! Where sampling is involved each assertion fails by chance with probability 1e-6, on images whose standard error is at most
//! 0.2 % (0.3 % where said).

use crate::common::{CUBE, Framed, Options, Shot, View, boundary, difference, image_mean, integrate, shuffled_grid};
use std::f64::consts::PI;

const PLATE: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n";
const RHO: f64 = 0.5;

/// A camera far away that sees the origin of the plane z = 0 at an angle, over so small a field that everything is the same in it.
fn tilted(angle: f64) -> Shot {
    let (s, c) = angle.to_radians().sin_cos();
    Shot { from: [100.0 * s, 0.0, 100.0 * c], fov: 0.0005, depth: 1, ..Shot::default() }
}

/// The same along +z: all rays are the z axis as far as anything in the scene can tell.
fn along_z(depth: u32) -> Shot {
    Shot { from: [0.0, 0.0, -100.0], fov: 0.001, size: 16, depth, ..Shot::default() }
}

#[track_caller]
fn exactly(what: &str, shot: &Shot, world: &str, expected: f64) {
    let (mean, _) = shot.mean(world, 4);
    println!("{what}: {} expected {expected}", mean[0]);
    assert!((mean[0] - expected).abs() <= 3e-4 * expected, "{what}: {} instead of {expected}", mean[0]);
}

#[test]
fn point_light_over_a_plane() {
    for [x, y, z] in [[0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [2.0, -1.0, 1.5], [-0.5, 4.0, 0.7f64]] {
        let d2 = x * x + y * y + z * z;
        let world = format!("{PLATE}LightSource \"point\" \"rgb I\" [10 10 10] \"point3 from\" [{x} {y} {z}]");
        exactly("point", &tilted(30.0), &world, RHO / PI * 10.0 * (z / d2.sqrt()) / d2);
        // A point light of a given power shines with power / 4π.
        let world = format!("{PLATE}LightSource \"point\" \"float power\" 50 \"point3 from\" [{x} {y} {z}]");
        exactly("power", &tilted(30.0), &world, RHO / PI * 50.0 / (4.0 * PI) * (z / d2.sqrt()) / d2);
    }
    // From below nothing arrives.
    let world = format!("{PLATE}LightSource \"point\" \"point3 from\" [1 0 -2]");
    exactly("below", &tilted(30.0), &world, 0.0);
}

#[test]
fn spot_light_inside_on_and_outside_its_cone() {
    let (outer, inner) = (30f64.to_radians().cos(), 25f64.to_radians().cos());
    for (angle, share) in [(0.0, 1.0), (24.0, 1.0), (27.5, f64::NAN), (29.0, f64::NAN), (31.0, 0.0), (90.0, 0.0)] {
        // Two above the origin, pointing past it by `angle`.
        let (s, c) = f64::to_radians(angle).sin_cos();
        let world = format!(
            "{PLATE}LightSource \"spot\" \"rgb I\" [8 8 8] \"point3 from\" [0 0 2] \"point3 to\" [0 {s} {}]
             \"float coneangle\" 30 \"float conedeltaangle\" 5",
            2.0 - c
        );
        let x = ((c - outer) / (inner - outer)).clamp(0.0, 1.0);
        let share = if share.is_nan() { x * x * (3.0 - 2.0 * x) } else { share };
        exactly("spot", &tilted(30.0), &world, RHO / PI * 8.0 / 4.0 * share);
    }
}

#[test]
fn distant_light_and_dome() {
    for angle in [0.0, 30.0, 75.0f64] {
        let (s, c) = angle.to_radians().sin_cos();
        let world = format!(
            "{PLATE}LightSource \"distant\" \"rgb L\" [3 3 3] \"point3 from\" [{s} 0 {c}] \"point3 to\" [0 0 0]"
        );
        exactly("distant", &tilted(20.0), &world, RHO / PI * 3.0 * c);
        let world = format!(
            "{PLATE}LightSource \"distant\" \"float illuminance\" 7 \"point3 from\" [0 {s} {c}] \"point3 to\" [0 0 0]"
        );
        exactly("illuminance", &tilted(20.0), &world, RHO / PI * 7.0 * c);
    }
    let dome = format!("{PLATE}LightSource \"infinite\" \"rgb L\" [2 2 2]");
    tilted(20.0).assert("dome", &dome, 1024, [RHO * 2.0; 3], 2e-3);
    // The dome itself is met without bounces, by a camera that looks up.
    let up = Shot { from: [0.0, 0.0, 1.0], to: [0.0, 0.0, 2.0], depth: 0, ..Shot::default() };
    exactly("dome seen", &up, &dome, 2.0);
}

/// Irradiance over radiance from a rectangle `corner + u·a + v·b` at the origin with normal +z, by quadrature of cos θ cos θ' / r².
fn rectangle([corner, a, b]: [[f64; 3]; 3]) -> f64 {
    let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    integrate(0.0, 1.0, 60, |u| {
        integrate(0.0, 1.0, 60, |v| {
            let p: Vec<f64> = (0..3).map(|k| corner[k] + u * a[k] + v * b[k]).collect();
            let r2 = p.iter().map(|x| x * x).sum::<f64>();
            let facing: f64 = (0..3).map(|k| p[k] * n[k]).sum::<f64>().abs();
            p[2].max(0.0) * facing / (r2 * r2)
        })
    })
}

#[test]
fn rectangle_lights_have_their_form_factor() {
    // Howell's catalogue of configuration factors, B-4: a rectangle a × b at height c over the corner.
    let (x, y) = (0.5f64, 1.5f64);
    let (sx, sy) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let factor = (x / sx * (y / sx).atan() + y / sy * (x / sy).atan()) / (2.0 * PI);
    let over_corner = [[0.0, 0.0, 2.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
    assert!((rectangle(over_corner) / PI - factor).abs() < 1e-9);

    let cases = [
        over_corner,
        [[-1.0, -1.5, 0.5], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]],
        [[1.0, -1.0, 0.2], [0.0, 2.0, 0.0], [0.4, 0.0, 1.0]],
    ];
    for [p, a, b] in cases {
        let corner = |u: f64, v: f64| {
            let q: Vec<String> = (0..3).map(|k| (p[k] + u * a[k] + v * b[k]).to_string()).collect();
            q.join(" ")
        };
        let (p00, p10, p01, p11) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0));
        let shapes = [
            format!("\"trianglemesh\" \"point3 P\" [{p00} {p10} {p11} {p01}] \"integer indices\" [0 1 2 0 2 3]"),
            format!("\"bilinearmesh\" \"point3 P\" [{p00} {p10} {p01} {p11}]"),
        ];
        for shape in shapes {
            let world =
                format!("{PLATE}AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] \"bool twosided\" true Shape {shape}");
            let camera = Shot { from: [-100.0, 0.0, 10.0], ..tilted(0.0) };
            camera.assert("rectangle", &world, 4096, [RHO / PI * 4.0 * rectangle([p, a, b]); 3], 2e-3);
        }
    }
}

#[test]
fn sphere_and_disk_lights() {
    for (distance, angle) in [(1.5, 0.0), (3.0, 40.0), (10.0, 60.0f64)] {
        let (s, c) = angle.to_radians().sin_cos();
        let place = format!("Translate 0 {} {}", distance * s, distance * c);
        let emit = "AreaLightSource \"diffuse\" \"rgb L\" [5 5 5]";
        let sphere = format!("{PLATE}AttributeBegin {place} {emit} Shape \"sphere\" \"float radius\" 1 AttributeEnd");
        let camera = Shot { from: [100.0, 0.0, 30.0], ..tilted(0.0) };
        let expected = RHO * 5.0 * c / (distance * distance);
        camera.assert("sphere", &sphere, 1024, [expected; 3], 2e-3);
        // A moving one that ends where it starts is sampled in another way and sheds the same light.
        let stretched = format!(
            "{PLATE}AttributeBegin {place} {emit} Scale 2 2 2 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd"
        );
        camera.assert("scaled sphere", &stretched, 1024, [expected; 3], 2e-3);
    }
    for (distance, radius) in [(1.0, 0.5), (2.0, 3.0f64)] {
        let disk = format!(
            "{PLATE}AttributeBegin Translate 0 0 {distance} AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] \"bool twosided\" true
             Shape \"disk\" \"float radius\" {radius} AttributeEnd"
        );
        let camera = Shot { from: [100.0, 0.0, 20.0], ..tilted(0.0) };
        let sin2 = radius * radius / (radius * radius + distance * distance);
        camera.assert("disk", &disk, 2048, [RHO * 5.0 * sin2; 3], 2e-3);
    }
}

/// One-sided emitters shine to the side of their normal only, and ReverseOrientation turns that round.
#[test]
fn emitters_have_a_front() {
    let light = |more: &str| {
        format!(
            "{PLATE}AttributeBegin {more} Translate 0 0 2 AreaLightSource \"diffuse\" \"rgb L\" [5 5 5]
             Shape \"disk\" \"float radius\" 1 AttributeEnd"
        )
    };
    let camera = Shot { from: [100.0, 0.0, 20.0], ..tilted(0.0) };
    exactly("facing away", &camera, &light(""), 0.0);
    camera.assert("reversed", &light("ReverseOrientation"), 1024, [RHO; 3], 2e-3);
}

// ---- Media -----------------------------------------------------------------------------------------------------------

const WALL: &str = "AttributeBegin Translate 0 0 3 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
                    Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"disk\" \"float radius\" 9 AttributeEnd\n";

/// A box from −1 to 1 under the transformation `more`, between two media.
fn slab(inside: &str, outside: &str, more: &str) -> String {
    boundary(inside, outside, &format!("{more} {CUBE}"))
}

fn homogeneous(name: &str, sigma_a: [f64; 3], sigma_s: [f64; 3], more: &str) -> String {
    let words = |c: [f64; 3]| format!("{} {} {}", c[0], c[1], c[2]);
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] {more}\n",
        words(sigma_a),
        words(sigma_s)
    )
}

/// A grid over the box from −1 to 1 whose density rises with z from cell to cell: (i + ½) / n.
fn ramp(name: &str, n: u32, scale: f64, sigma_a: [f64; 3], more: &str) -> String {
    let values: Vec<String> = (0..n).map(|i| ((f64::from(i) + 0.5) / f64::from(n)).to_string()).collect();
    let [r, g, b] = sigma_a;
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"uniformgrid\" \"integer nx\" 1 \"integer ny\" 1 \"integer nz\" {n}
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1] \"rgb sigma_a\" [{r} {g} {b}] \"rgb sigma_s\" [0 0 0] \"float scale\" {scale}
         \"float density\" [{}] {more}\n",
        values.join(" ")
    )
}

/// The optical depth along z of [`ramp`] at x = y = 0 for σ = 1: between cells' centres linear, beyond the outer ones falling to
/// half way to 0 at the box's sides (outside the samples are 0).
fn ramp_depth(n: u32) -> f64 {
    let value = |i: i64| if (0..i64::from(n)).contains(&i) { (i as f64 + 0.5) / f64::from(n) } else { 0.0 };
    let density = |z: f64| {
        let x = (z + 1.0) / 2.0 * f64::from(n) - 0.5;
        let i = x.floor();
        value(i as i64) * (1.0 - (x - i)) + value(i as i64 + 1) * (x - i)
    };
    integrate(-1.0, 1.0, 4 * n as usize, density)
}

fn transmits(what: &str, world: &str, depths: [f64; 3]) {
    let expected = depths.map(|d| (-d).exp());
    along_z(3).assert(what, &format!("{WALL}{world}"), 700, expected, 3e-3);
}

#[test]
fn slabs_transmit_by_beers_law() {
    let none = [0.0; 3];
    transmits("absorbing", &format!("{}{}", homogeneous("m", [0.25; 3], none, ""), slab("m", "", "")), [0.5; 3]);
    let chromatic = homogeneous("m", [0.05, 0.2, 0.4], none, "");
    transmits("chromatic", &format!("{chromatic}{}", slab("m", "", "")), [0.1, 0.4, 0.8]);
    // What scatters only is seen as absorbing where no scattered light is gathered (the wall is the only light: see from it nothing).
    let turned = slab("m", "", "Rotate 30 1 0 0");
    let long = 2.0 / 30f64.to_radians().cos();
    transmits("turned", &format!("{chromatic}{turned}"), [0.05 * long, 0.2 * long, 0.4 * long]);
    transmits(
        "scaled",
        &format!("{}{}", homogeneous("m", [0.25; 3], none, "\"float scale\" 2"), slab("m", "", "Scale 1 1 0.5")),
        [0.5; 3],
    );
}

#[test]
fn grids_transmit_by_beers_law() {
    for n in [1, 2, 8] {
        let depth = 0.6 * ramp_depth(n);
        // x = y = 0 lies at a cell's centre, where nothing fades towards the sides.
        transmits("ramp", &format!("{}{}", ramp("m", n, 0.6, [1.0; 3], ""), slab("m", "", "")), [depth; 3]);
    }
    let depth = ramp_depth(4);
    let chromatic = ramp("m", 4, 1.0, [0.1, 0.4, 0.8], "");
    transmits("chromatic ramp", &format!("{chromatic}{}", slab("m", "", "")), [0.1 * depth, 0.4 * depth, 0.8 * depth]);
    // Seen from the other side and turned: the same.
    let turned = format!("Rotate 180 0 1 0 {}{}Identity\n", ramp("m", 4, 0.5, [1.0; 3], ""), slab("m", "", ""));
    transmits("turned ramp", &turned, [0.5 * depth; 3]);
}

#[test]
fn overlapping_media_add_up_and_nested_ones_replace() {
    let none = [0.0; 3];
    let media =
        format!("{}{}", homogeneous("m", [0.1, 0.2, 0.3], none, ""), homogeneous("n", [0.2, 0.1, 0.1], none, ""));
    let both = format!("{media}{}{}", slab("m", "", ""), slab("n", "", "Translate 0 0 1"));
    transmits("overlap", &both, [0.6, 0.6, 0.8]);
    let with_grid =
        format!("{media}{}{}{}", ramp("k", 4, 0.2, [1.0; 3], ""), slab("m", "", ""), slab("k", "", "Scale 1.2 1.2 1"));
    let ramp = 0.2 * ramp_depth(4);
    transmits("overlap with a grid", &with_grid, [0.2 + ramp, 0.4 + ramp, 0.6 + ramp]);
    // n in m from −½ to ½ takes m's place.
    let nested = format!("{media}{}{}", slab("m", "", ""), slab("n", "m", "Scale 0.5 0.5 0.5"));
    transmits("nested", &nested, [0.1 + 0.2, 0.2 + 0.1, 0.3 + 0.1]);
    // A hole.
    let hole = format!("{media}{}{}", slab("m", "", ""), slab("", "m", "Scale 0.5 0.5 0.5"));
    transmits("hole", &hole, [0.1, 0.2, 0.3]);
}

#[test]
fn shadow_rays_see_the_same_transmittance() {
    // A floor behind the slab, seen from its own side, lit through the slab by a point light: ratio tracking.
    let depth = 0.6 * ramp_depth(8);
    let floor = "AttributeBegin Translate 0 0 2 Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 1
                 AttributeEnd LightSource \"point\" \"rgb I\" [100 100 100] \"point3 from\" [0 0 -6]\n";
    // The camera looks at the floor from beside the slab.
    let camera = Shot { from: [60.0, 0.0, -18.0], to: [0.0, 0.0, 2.0], fov: 0.0005, depth: 1, size: 16 };
    let lit = 0.5 / PI * 100.0 / 64.0;
    let cases = [
        (homogeneous("m", [0.1, 0.2, 0.3], [0.1, 0.1, 0.1], ""), [0.4, 0.6, 0.8]),
        (ramp("m", 8, 0.6, [1.0, 0.5, 0.25], ""), [depth, 0.5 * depth, 0.25 * depth]),
    ];
    for (medium, depths) in cases {
        let world = format!("{floor}{medium}{}", slab("m", "", ""));
        camera.assert("shadow", &world, 700, depths.map(|d| lit * (-d).exp()), 3e-3);
    }
    // So thick that Russian roulette comes in.
    let thick = ramp("m", 8, 3.0 / ramp_depth(8), [1.0; 3], "");
    let world = format!("{floor}{thick}{}", slab("m", "", ""));
    camera.assert("thick", &world, 3600, [lit * (-3f64).exp(); 3], 3e-3);
}

#[test]
fn emission_of_slabs() {
    let glow = "\"rgb Le\" [2 2 2]";
    let slab_of = |sigma: f64| format!("{}{}", homogeneous("m", [sigma; 3], [0.0; 3], glow), slab("m", "", ""));
    let expected = |depth: f64| 2.0 * (1.0 - (-depth).exp());
    along_z(1).assert("homogeneous", &slab_of(0.5), 700, [expected(1.0); 3], 3e-3);
    // A path of k bounces gathers emission of media while k < maxdepth (pbrt-v4, section 14.2.2): with none there is none.
    exactly("depth 0", &along_z(0), &slab_of(0.5), 0.0);
    // Emission inside a medium that also scatters: of the ray itself with maxdepth 1 (scattering then only removes).
    let grey = format!("{}{}", homogeneous("m", [0.25; 3], [0.25; 3], glow), slab("m", "", ""));
    along_z(1).assert("scattering", &grey, 700, [expected(1.0) / 2.0; 3], 3e-3);
    // Chromatic absorption: each channel by its own.
    let chromatic = format!("{}{}", homogeneous("m", [0.2, 0.5, 1.0], [0.0; 3], glow), slab("m", "", ""));
    along_z(1).assert("chromatic", &chromatic, 1000, [expected(0.4), expected(1.0), expected(2.0)], 4e-3);

    for n in [1, 8] {
        let grid = format!("{}{}", ramp("m", n, 1.0, [1.0; 3], glow), slab("m", "", ""));
        along_z(1).assert("grid", &grid, 700, [expected(ramp_depth(n)); 3], 3e-3);
        exactly("grid, depth 0", &along_z(0), &grid, 0.0);
    }
}

/// Henyey & Greenstein 1941, normalised over the sphere; `cosine` is between the directions of flight.
fn phase(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

#[test]
fn single_scattering_from_a_point_light() {
    let (sigma_a, sigma_s) = ([0.1, 0.2, 0.05], [0.5, 0.3, 0.2]);
    // Inside the box; outside it, to the side; before and behind.
    for light in [[0.5, 0.3, 0.2], [3.0, 0.5, 0.2], [0.4, 0.3, 3.0], [0.4, -0.6, -4.0f64]] {
        for g in [0.0, 0.9, -0.5] {
            let expected: Vec<f64> = (0..3)
                .map(|c| {
                    let sigma = sigma_a[c] + sigma_s[c];
                    integrate(-1.0, 1.0, 200, |z| {
                        let to = [light[0], light[1], light[2] - z];
                        let r = to.iter().map(|x| x * x).sum::<f64>().sqrt();
                        // How far to the box's side, or to the light if that is nearer. x = y = 0.
                        let sides = [
                            to[0].abs() / 1.0,
                            to[1].abs() / 1.0,
                            if to[2] > 0.0 { to[2] / (1.0 - z) } else { -to[2] / (1.0 + z) },
                        ];
                        let within = r / sides.iter().fold(1.0f64, |a, &b| a.max(b));
                        // Light flies along −to and leaves along −z.
                        let cosine = to[2] / r;
                        (-sigma * (z + 1.0 + within)).exp() * sigma_s[c] * phase(g, cosine) * 20.0 / (r * r)
                    })
                })
                .collect();
            let world = format!(
                "LightSource \"point\" \"rgb I\" [20 20 20] \"point3 from\" [{} {} {}]\n{}{}",
                light[0],
                light[1],
                light[2],
                homogeneous("m", sigma_a, sigma_s, &format!("\"float g\" {g}")),
                slab("m", "", "")
            );
            along_z(1).assert(
                &format!("g {g}, light {light:?}"),
                &world,
                1500,
                [expected[0], expected[1], expected[2]],
                5e-3,
            );
        }
    }
}

/// On the axis of a glass ball filled with an absorbing medium, in a white surrounding: every order of inner reflection stays on the axis.
#[test]
fn glass_ball_with_a_medium() {
    let sigma = [0.1, 0.3, 0.5];
    let world = format!(
        "LightSource \"infinite\" \"rgb L\" [1 1 1]\n{}AttributeBegin MediumInterface \"m\" \"\"
         Material \"dielectric\" \"float eta\" 1.5 Shape \"sphere\" \"float radius\" 1 AttributeEnd\n",
        homogeneous("m", sigma, [0.0; 3], "")
    );
    let f = 0.04;
    let expected = sigma.map(|s| {
        let a = (-2.0 * s).exp();
        f + (1.0 - f) * (1.0 - f) * a / (1.0 - f * a)
    });
    Shot { fov: 0.01, ..along_z(1000) }.assert("ball", &world, 1000, expected, 3e-3);
}

// ---- Camera, motion, opacity, instances ------------------------------------------------------------------------------

/// A half plane x < `edge` at distance z from a camera at the origin that looks along z.
fn half_plane(edge: f64, z: f64, more: &str) -> String {
    format!(
        "AttributeBegin {more} AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
         Shape \"trianglemesh\" \"point3 P\" [{0} -50 {z} {edge} -50 {z} {edge} 50 {z} {0} 50 {z}] \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n",
        edge - 100.0
    )
}

/// One row of a film, from what is seen at the left in camera space (x < 0).
fn columns(seen: &impl View, world: &str, spp: u32) -> Vec<f64> {
    let outcome = seen.render(world, &Options { spp, ..Options::default() });
    let image = outcome.film.channels();
    let (red, n) = (image.channel("R").expect("the beauty"), image.bounds.width() as usize);
    (0..n).map(|x| (0..n).map(|y| f64::from(red[y * n + x])).sum::<f64>() / n as f64).collect()
}

#[test]
fn lenses_are_sharp_at_their_focus_and_blur_elsewhere() {
    let fov = 2.0 * (0.5f64).atan().to_degrees();
    let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov, size: 16, depth: 0 };
    let camera = "\"float lensradius\" 0.4 \"float focaldistance\" 4";
    // pbrt's camera space has x to the right, and LookAt keeps it: column 0 is at x < 0 for up = y and view = z.
    for (z, blurred) in [(4.0, false), (8.0, true), (2.0, true)] {
        let seen = columns(&Framed { shot, camera, ..Framed::default() }, &half_plane(0.0, z, ""), 256);
        let expected: Vec<f64> = (0..16)
            .map(|column| {
                integrate(f64::from(column), f64::from(column) + 1.0, 50, |x| {
                    // The point in focus, and where the ray from lens point (l, ·) meets the half plane: l (1 − z/4) + focus z/4 < 0.
                    let focus = 4.0 * 0.5 * (x / 8.0 - 1.0);
                    if !blurred {
                        return f64::from(u8::from(focus < 0.0));
                    }
                    // l (1 − z/4) < −focus z/4; the distribution of l over a disk is symmetric.
                    let limit = (-focus * (z / 4.0) / (1.0 - z / 4.0).abs() / 0.4).clamp(-1.0, 1.0);
                    0.5 + (limit * (1.0 - limit * limit).sqrt() + limit.asin()) / PI
                })
            })
            .collect();
        // 4096 samples a column, each 0 or 1: a standard error of at most 0.008; stratification only helps. 16 columns,
        // 3 images at 6 standard errors: 1e-7.
        for (a, b) in seen.iter().zip(&expected) {
            let error = (b * (1.0 - b) / 4096.0).max(0.0).sqrt();
            assert!((a - b).abs() <= 6.0 * error + 1e-3, "z = {z}: {seen:.3?} instead of {expected:.3?}");
        }
    }
}

#[test]
fn motion_is_averaged_over_the_shutter() {
    let fov = 2.0 * (0.5f64).atan().to_degrees();
    let camera = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov, size: 16, depth: 0 };
    // An edge that moves from x = −1 to x = 1 at distance 2, where the image spans −1 to 1.
    let moving = half_plane(-1.0, 2.0, "ActiveTransform EndTime Translate 2 0 0 ActiveTransform All");
    let seen = columns(&camera, &moving, 256);
    for (column, value) in seen.iter().enumerate() {
        let x = (column as f64 + 0.5) / 8.0 - 1.0;
        let expected = 0.5 * (1.0 - x);
        assert!((value - expected).abs() < 6.0 * (0.25f64 / 4096.0).sqrt(), "{seen:?}");
    }
    let (mean, error) = camera.mean(&moving, 256);
    crate::common::assert_mean("motion", mean[0], error[0], 0.5, 0.0);
}

#[test]
fn opacity_transmits_what_it_does_not_cover() {
    let veil = "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"disk\" \"float radius\" 5 \"float alpha\" 0.3 AttributeEnd\n";
    let two = format!("{veil}AttributeBegin Translate 0 0 1 {veil} AttributeEnd\n");
    along_z(1).assert("veil", &format!("{WALL}{veil}"), 700, [0.7; 3], 2e-3);
    along_z(1).assert("two veils", &format!("{WALL}{two}"), 700, [0.49; 3], 3e-3);
    // The same for shadow rays: a plate 2 behind the veil, lit from before it.
    let plate = "AttributeBegin Translate 0 0 2 Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 1
                 AttributeEnd LightSource \"point\" \"rgb I\" [100 100 100] \"point3 from\" [0 0 -6]\n";
    let camera = Shot { from: [60.0, 0.0, -18.0], to: [0.0, 0.0, 2.0], fov: 0.0005, depth: 1, size: 16 };
    camera.assert("shadow", &format!("{plate}{veil}"), 700, [0.7 * 0.5 / PI * 100.0 / 64.0; 3], 2e-3);
}

/// Spheres, a grid, a homogeneous medium, a moving quad and a glowing one.
fn still_life(density: f64) -> String {
    format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] \"bool twosided\" true Translate 0 2.5 0 Rotate 90 1 0 0
         Shape \"disk\" \"float radius\" 1.2 AttributeEnd
         AttributeBegin Translate 0 -1.2 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]
         Shape \"disk\" \"float radius\" 6 AttributeEnd
         AttributeBegin Translate 1.2 -0.5 0.5 Material \"conductor\" \"float roughness\" 0.2 Shape \"sphere\" \"float radius\" 0.6 AttributeEnd
         AttributeBegin Translate -1.3 -0.5 0.2 Material \"dielectric\" Shape \"sphere\" \"float radius\" 0.6 AttributeEnd
         {}Scale 0.6 0.6 0.6 Rotate 25 0 1 0\n{}\n",
        grid_of_scatterers("m", density),
        slab("m", "", "")
    )
}

fn grid_of_scatterers(name: &str, scale: f64) -> String {
    let parameters = format!("\"rgb sigma_a\" [0.2 0.2 0.3] \"rgb sigma_s\" [2 1.5 1] \"float scale\" {scale}");
    let grid = shuffled_grid(name, &parameters);
    format!("AttributeBegin Scale 0.6 0.6 0.6 Rotate 25 0 1 0\n{grid} AttributeEnd\n")
}

#[test]
fn images_do_not_depend_on_where_or_how_large_the_scene_is() {
    let options = Options { spp: 64, ..Options::default() };
    let shot = Shot { size: 24, fov: 45.0, from: [0.0, 0.3, -5.0], ..Shot::default() };
    let plain = shot.render(&still_life(1.0), &options);
    let (mean, error) = image_mean(&plain.film);
    for far in [1e3, 1e6] {
        // Everything is placed by a translation in double precision.
        let place = |sign: f64| format!("Translate {} {} {}", sign * far, -2.0 * sign * far, 3.0 * sign * far);
        let away = Framed { shot, before: &place(-1.0), ..Framed::default() };
        let there = away.render(&format!("{}\n{}", place(1.0), still_life(1.0)), &options);
        let d = difference(&plain.film, &there.film);
        println!("at {far:e}: relative RMSE {d:e}");
        assert!(d < 1e-3, "at {far:e}: relative RMSE {d:e}");
    }
    for scale in [1e-3, 1e3f64] {
        let away = Framed { shot, before: &format!("Scale {0} {0} {0}", 1.0 / scale), ..Framed::default() };
        let there = away.render(&format!("Scale {scale} {scale} {scale}\n{}", still_life(1.0 / scale)), &options);
        let (m, e) = image_mean(&there.film);
        println!("× {scale:e}: relative RMSE {:e}", difference(&plain.film, &there.film));
        for c in 0..3 {
            // Rounding decides some events otherwise: the images agree within their errors.
            crate::common::assert_mean(&format!("× {scale:e}"), m[c], e[c].hypot(error[c]), mean[c], 0.0);
        }
    }
}

#[test]
fn instances_are_what_they_are_instances_of() {
    let options = Options { spp: 16, ..Options::default() };
    let shot = Shot { size: 24, fov: 45.0, from: [0.0, 0.3, -5.0], depth: 4, ..Shot::default() };
    let light = "LightSource \"point\" \"rgb I\" [30 30 30] \"point3 from\" [2 4 -3]\nLightSource \"infinite\" \"rgb L\" [0.2 0.3 0.4]\n";
    let shapes = "Material \"diffuse\" \"rgb reflectance\" [0.7 0.5 0.3] Shape \"sphere\" \"float radius\" 0.5
                  AttributeBegin Translate 0.8 0 0 Scale 1 0.5 1 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n";
    let places =
        ["Translate 0 1 0 Rotate 30 0 0 1", "Translate 0.3 -1 0 Scale 1 2 0.7", "Translate -1.2 0 1 Scale 0.5 0.7 0.6"];
    let direct: String = places.iter().map(|p| format!("AttributeBegin {p} {shapes} AttributeEnd\n")).collect();
    let instanced: String =
        places.iter().map(|p| format!("AttributeBegin {p} ObjectInstance \"o\" AttributeEnd\n")).collect();
    // The object is defined under a transformation, which becomes part of it.
    let defined = format!("AttributeBegin ObjectBegin \"o\" {shapes} ObjectEnd AttributeEnd\n{instanced}");
    let plain = shot.render(&format!("{light}{direct}"), &options);
    let by_instances = shot.render(&format!("{light}{defined}"), &options);
    let d = difference(&plain.film, &by_instances.film);
    assert!(d < 1e-3, "relative RMSE {d:e}");

    // Meshes may be mirrored: inside and outside stay what they are, for glass and for media.
    let fog = homogeneous("m", [0.1; 3], [1.0; 3], "");
    let shapes = format!(
        "AttributeBegin MediumInterface \"m\" \"\" Material \"dielectric\" Scale 0.5 0.6 0.7 {CUBE} AttributeEnd\n"
    );
    let place = "AttributeBegin Rotate 30 1 1 1 Scale -1 1 1";
    let direct = shot.render(&format!("{light}{fog}{place} {shapes} AttributeEnd\n"), &options);
    let object = format!("ObjectBegin \"o\" {shapes} ObjectEnd\n{place} ObjectInstance \"o\" AttributeEnd\n");
    let instanced = shot.render(&format!("{light}{fog}{object}"), &options);
    let d = difference(&direct.film, &instanced.film);
    assert!(d < 1e-3, "mirrored: relative RMSE {d:e}");
}

/// A camera that moves into a medium while the shutter is open starts its rays in vacuum first, then within.
#[test]
fn a_camera_may_enter_a_medium_during_the_shutter() {
    let text = "ActiveTransform StartTime Translate 0 0 3 ActiveTransform All Camera \"perspective\" \"float fov\" 2\n\
                Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
                WorldBegin\n\
                LightSource \"infinite\" \"rgb L\" [1 1 1]\n\
                MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [2 2 2] \"rgb sigma_s\" [0 0 0]\n\
                MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"\n";
    let outcome =
        crate::common::render_text(text, &crate::common::Options { spp: 16384, ..crate::common::Options::default() });
    let (mean, error) = crate::common::image_mean(&outcome.film);
    // From z = −3 to −1 the whole sphere is ahead, from −1 to 0 what is left of it.
    let expected = 2.0 / 3.0 * (-4f64).exp() + ((-2f64).exp() - (-4f64).exp()) / 6.0;
    crate::common::assert_mean("moving camera", mean[0], error[0], expected, 2e-3);
    assert!(error[0] < 0.02 * expected, "{}", error[0]);
}

/// Emitters that are left out do not make the ones after them invisible.
#[test]
fn lights_that_are_left_out_change_no_others() {
    let scene = |before: &str| {
        format!(
            "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 30\n\
             Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
             WorldBegin\n{before}\
             Shape \"disk\" \"float radius\" 4\n\
             AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Translate 1 0 1 Shape \"sphere\" \"float radius\" .3\n\
             AttributeEnd\n"
        )
    };
    let mean = |before: &str| {
        let options = crate::common::Options { spp: 32, ..crate::common::Options::default() };
        crate::common::image_mean(&crate::common::render_text(&scene(before), &options).film).0
    };
    let boundary = "AttributeBegin MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [0 0 0]\n\
                    MediumInterface \"m\" \"\" Material \"interface\" AreaLightSource \"diffuse\"\n\
                    Shape \"sphere\" \"float radius\" .1 \"float alpha\" 0 AttributeEnd\n";
    let unknown = "AttributeBegin AreaLightSource \"diffuse\" Shape \"cone\" \"float alpha\" 0 AttributeEnd\n";
    let alone = mean("");
    assert!(alone[0] > 0.01);
    for before in [boundary, unknown] {
        for (a, b) in mean(before).into_iter().zip(alone) {
            assert!((a - b).abs() <= 1e-6 * b, "{a} with {before}, {b} without");
        }
    }
}
