//! Geometry: sizes, places, slivers, triangles without area, grazing views, paths of thousands of bounces between surfaces, both ray tracers.

mod size;

use super::case::{Case, Stop, Trial};
use super::scene::{DOME, FOREVER, How, Shot, lamp, list, mesh, point};
use crate::geometry::Backend;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "geometry.scale",
        checks: "A scene of some units made 2^-30 to 2^40 times as large is the same image, sample by sample.",
        seconds: 0.4,
        known: None,
        run: size::scale,
    },
    Case {
        name: "geometry.tiny",
        checks: "A scene made 2^-40, 2^-50 and 2^-60 times as large, down to 5e-18 across, is the same image.",
        seconds: 0.4,
        known: None,
        run: size::tiny,
    },
    Case {
        name: "geometry.vast",
        checks: "A scene made 2^44 and 2^56 times as large, up to 4e17 across, is the same image.",
        seconds: 0.3,
        known: None,
        run: size::vast,
    },
    Case {
        name: "geometry.far",
        checks: "A scene a million, and a thousand million units away is the same image.",
        seconds: 0.1,
        known: None,
        run: size::far,
    },
    Case {
        name: "geometry.sliver-floor",
        checks: "A floor made of a fan of 4096 triangles around one point, or of 20,000 strips, is the plain floor.",
        seconds: 0.6,
        known: None,
        run: sliver_floor,
    },
    Case {
        name: "geometry.sliver-room",
        checks: "A closed room of 6 × 1000 slivers that emits and reflects a half is at radiance 1: no light leaks out between them.",
        seconds: 0.6,
        known: None,
        run: sliver_room,
    },
    Case {
        name: "geometry.degenerate",
        checks: "Triangles and patches without area, and balls and disks of radius 1e-30, change no pixel.",
        seconds: 0.1,
        known: None,
        run: degenerate,
    },
    Case {
        name: "geometry.grazing",
        checks: "A floor under a white sky has its reflectance as radiance, seen from 30 degrees down to 1e-5 radians above it.",
        seconds: 0.2,
        known: None,
        run: grazing,
    },
    Case {
        name: "geometry.deep-paths",
        checks: "A room whose walls emit 2^-13 and reflect 1 − 2^-13 is at radiance 1: paths of 8192 bounces on average.",
        seconds: 12.0,
        known: None,
        run: deep_paths,
    },
    Case {
        name: "geometry.backends",
        checks: "Embree and the native tracer make one image of slivers, balls and disks.",
        seconds: 0.2,
        known: None,
        run: backends,
    },
];

const FLOOR: &str =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-3 0 -3  3 0 -3  3 0 3  -3 0 3]
     \"point2 uv\" [-3 -3  3 -3  3 3  -3 3]\n";
const VIEW: Shot = Shot { from: [0.0, 3.0, -5.0], to: [0.0, 0.6, 0.0], fov: 40.0, size: 24, depth: 3 };

/// Lamps and things on the floor.
fn things(scale: f64) -> String {
    format!(
        "{}{}Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4]
         AttributeBegin Translate 0.8 0.4 0.3 Material \"conductor\" \"float roughness\" 0.4 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd
         AttributeBegin Translate -0.8 0.5 0 Rotate 50 1 1 0 Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n",
        point(8.0 * scale * scale, [1.0, 2.5, -1.0]),
        lamp(6.0, "Translate -1 2 0.5 Shape \"sphere\" \"float radius\" 0.2")
    )
}

/// A mesh in the plane y = 0 with texture coordinates like the floor's.
fn flat(points: &[[f64; 3]], indices: &[u32]) -> String {
    let uv: Vec<f64> = points.iter().flat_map(|p| [p[0], p[2]]).collect();
    format!("{} \"point2 uv\" [{}]\n", mesh(points, indices).trim_end(), list(&uv))
}

/// The floor as a fan around a point of it.
fn fan(count: u32) -> String {
    let rim = (0..count).map(|i| {
        let side = count / 4;
        let x = -3.0 + 6.0 * f64::from(i % side) / f64::from(side);
        match i / side {
            0 => [x, 0.0, -3.0],
            1 => [3.0, 0.0, x],
            2 => [-x, 0.0, 3.0],
            _ => [-3.0, 0.0, -x],
        }
    });
    let points: Vec<[f64; 3]> = std::iter::once([0.013, 0.0, 0.0071]).chain(rim).collect();
    let indices: Vec<u32> = (0..count).flat_map(|i| [0, i + 1, (i + 1) % count + 1]).collect();
    flat(&points, &indices)
}

/// The square from −`half` to `half` in x and z at y = 0 as strips.
fn strips(half: f64, count: u32) -> String {
    let points: Vec<[f64; 3]> = (0..=count)
        .flat_map(|i| {
            let x = half * (2.0 * f64::from(i) / f64::from(count) - 1.0);
            [[x, 0.0, -half], [x, 0.0, half]]
        })
        .collect();
    let indices: Vec<u32> =
        (0..count).flat_map(|i| [2 * i, 2 * i + 2, 2 * i + 3, 2 * i, 2 * i + 3, 2 * i + 1]).collect();
    flat(&points, &indices)
}

/// The ray tracers of this build.
fn tracers() -> impl Iterator<Item = Backend> {
    let all = [Backend::Embree, Backend::Native];
    all.into_iter().filter(|backend| *backend != Backend::Embree || cfg!(feature = "embree"))
}

fn sliver_floor(trial: &mut Trial) -> Result<(), Stop> {
    for backend in tracers() {
        let how = How { backend, ..How::spp(8) };
        let plain = trial.render(&VIEW, &format!("{}{FLOOR}", things(1.0)), &how)?;
        for (what, floor) in [("a fan", fan(4096)), ("strips", strips(3.0, 10_000))] {
            let image = trial.render(&VIEW, &format!("{}{floor}", things(1.0)), &how)?;
            // Where a ray meets a triangle is known to a few last digits: here and there a sample goes another way.
            let (apart, source) = (image.apart(1.0, &plain), "invariance, sample by sample");
            trial.equal(&format!("relative RMSE with {what}, {backend:?}"), apart, 0.0, 2e-4, source);
        }
    }
    Ok(())
}

/// The walls of a cube from −1 to 1, each of the shape from −1 to 1 at y = 0.
fn walls(shape: &str) -> String {
    let turns = ["", "Rotate 90 1 0 0", "Rotate 180 1 0 0", "Rotate 270 1 0 0", "Rotate 90 0 0 1", "Rotate -90 0 0 1"];
    turns.map(|turn| format!("AttributeBegin {turn} Translate 0 1 0 {shape} AttributeEnd\n")).concat()
}

/// A closed room that emits and reflects.
fn room(emission: f64, reflectance: f64, shape: &str) -> String {
    format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [{emission:e} {emission:e} {emission:e}] \"bool twosided\" true
         Material \"diffuse\" \"rgb reflectance\" [{reflectance} {reflectance} {reflectance}]\n{}",
        walls(shape)
    )
}

const INSIDE: Shot = Shot { from: [0.3, 0.1, -0.8], to: [0.0, 0.0, 1.0], fov: 90.0, size: 16, depth: FOREVER };

fn sliver_room(trial: &mut Trial) -> Result<(), Stop> {
    // Seen without bounces, every pixel is what walls emit: rays that slip through would be black.
    let world = room(0.5, 0.5, &strips(1.0, 500));
    let image = trial.render(&Shot { depth: 0, size: 64, ..INSIDE }, &world, &How::spp(64))?;
    trial.equal("what walls emit", image.mean().mean, 0.5, 2e-6, "every camera ray meets a wall");
    let image = trial.render(&INSIDE, &world, &How::spp(32))?;
    trial.expect("radiance in it", image.mean(), 1.0, 0.01, "e / (1 − ρ)");
    Ok(())
}

fn degenerate(trial: &mut Trial) -> Result<(), Stop> {
    let how = How::spp(8);
    let plain = trial.render(&VIEW, &format!("{}{FLOOR}", things(1.0)), &how)?;
    let points = [[0.0, 1.0, 0.0], [0.5, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let nothing = mesh(&points, &[0, 0, 0, 0, 1, 2, 0, 1, 3, 2, 2, 1]);
    let small = "AttributeBegin Translate 0 0.5 -1 Shape \"sphere\" \"float radius\" 1e-30 Shape \"disk\" \"float radius\" 1e-30 AttributeEnd\n";
    let patches = "Shape \"bilinearmesh\" \"point3 P\" [0 1 0  1 1 0  0 1 0  1 1 0]\n\
                   Shape \"bilinearmesh\" \"point3 P\" [0 0.7 0  0 0.7 0  0 0.7 0  0 0.7 0]\n";
    for (what, more) in [("triangles", nothing.as_str()), ("patches", patches), ("balls and disks", small)] {
        let image = trial.render(&VIEW, &format!("{}{FLOOR}{more}", things(1.0)), &how)?;
        trial.equal(
            &format!("relative RMSE with {what}"),
            image.apart(1.0, &plain),
            0.0,
            1e-6,
            "nothing is there to be seen",
        );
    }
    Ok(())
}

fn grazing(trial: &mut Trial) -> Result<(), Stop> {
    let world =
        format!("{DOME}Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n");
    for angle in [0.5, 1e-2, 1e-3, 1e-4, 1e-5f64] {
        let (s, c) = angle.sin_cos();
        let shot = Shot { from: [10.0 * c, 0.0, 10.0 * s], to: [0.0; 3], fov: 1e-5, size: 8, depth: 1 };
        let image = trial.render(&shot, &world, &How::spp(256))?;
        trial.expect(&format!("{angle:e} radians above it"), image.mean(), 0.5, 0.01, "ρ");
    }
    Ok(())
}

fn deep_paths(trial: &mut Trial) -> Result<(), Stop> {
    let part = 2f64.powi(-13);
    let square = "Shape \"bilinearmesh\" \"point3 P\" [-1 0 -1  1 0 -1  -1 0 1  1 0 1]\n";
    let world = room(part, 1.0 - part, square);
    let image = trial.render(&Shot { size: 8, ..INSIDE }, &world, &How::spp(8))?;
    let length = image.counters.surface_vertices as f64 / image.counters.paths as f64;
    // A mean of 512 geometric numbers is known to 4.4 %.
    trial.equal("bounces a path", length, 1.0 / part, 0.24 / part, "roulette ends a path with probability 2^-13");
    trial.expect("radiance in it", image.mean(), 1.0, 0.06, "e / (1 − ρ), both exact in f32");
    Ok(())
}

fn backends(trial: &mut Trial) -> Result<(), Stop> {
    if !cfg!(feature = "embree") {
        return Err(Stop::Skipped("this build has no Embree to compare with".to_owned()));
    }
    let world = format!("{}{}", things(1.0), fan(1024));
    let [a, b] = [Backend::Embree, Backend::Native].map(|backend| How { backend, ..How::spp(16) });
    let (a, b) = (trial.render(&VIEW, &world, &a)?, trial.render(&VIEW, &world, &b)?);
    trial.equal("relative RMSE", a.apart(1.0, &b), 0.0, 2e-3, "two methods, sample by sample");
    Ok(())
}
