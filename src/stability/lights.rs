//! Lights: needles, slivers, lamps that touch what they light or are far away, grazing ones, order and division.

use super::case::{Case, Stop, Trial};
use super::reference::{diffuse, line, polygon};
use super::scene::{DOME, How, Shot, lamp, list, mesh, point};
use crate::render::LightSelection;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "lights.needle",
        checks: "Lamps 2 long and 1e-2 to 1e-8 wide light a floor as a line does, as bilinear patches and as triangles.",
        seconds: 0.5,
        known: None,
        run: needle,
    },
    Case {
        name: "lights.sliver",
        checks: "Triangular lamps 2^-3 down to 2^-23 wide, level and tilted, have the form factor of Lambert's formula.",
        seconds: 2.0,
        known: None,
        run: sliver,
    },
    Case {
        name: "lights.degenerate",
        checks: "Triangles without area in the mesh of a lamp, and lamps without area, change nothing.",
        seconds: 1.0,
        known: None,
        run: degenerate,
    },
    Case {
        name: "lights.touching",
        checks: "A ball that touches the floor lights it by its exact form factor, from ten radii away up to a thousandth of one, seen at the same grazing angle.",
        seconds: 0.2,
        known: None,
        run: touching,
    },
    Case {
        name: "lights.grazing",
        checks: "Point lights down to 2^-17 above the horizon light a floor by their cosine; those in its plane, and lamps in its plane, do not.",
        seconds: 0.1,
        known: None,
        run: grazing,
    },
    Case {
        name: "lights.far",
        checks: "Balls of radius 1 at distances up to 1e8, and of radius 1e-6 close by, light a floor by the inverse square.",
        seconds: 0.1,
        known: None,
        run: far,
    },
    Case {
        name: "lights.narrow",
        checks: "Spots with cones of 10 down to 0.01 degrees have their full intensity in the middle.",
        seconds: 0.1,
        known: None,
        run: narrow,
    },
    Case {
        name: "lights.order",
        checks: "The order of lights does not matter, whatever chooses them.",
        seconds: 1.2,
        known: None,
        run: order,
    },
    Case {
        name: "lights.split",
        checks: "A square lamp cut into 4096 lamps lights a floor as the square does, whatever chooses them.",
        seconds: 3.0,
        known: None,
        run: split,
    },
    Case {
        name: "lights.decades",
        checks: "Thirty-one point lights in one place, from 1e-15 to 1e15, add up, whatever chooses them.",
        seconds: 2.0,
        known: None,
        run: decades,
    },
];

/// All ways of choosing lights that are for any number of them.
const SELECTIONS: [LightSelection; 5] = [
    LightSelection::Uniform,
    LightSelection::Power,
    LightSelection::Optimal,
    LightSelection::CachePoints,
    LightSelection::Tree,
];

const PLATE: &str = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n";
const RHO: f64 = 0.5;

/// A camera far away in the plane x = 0 that sees next to nothing but the origin, `angle` degrees off the floor's normal.
fn tilted(angle: f64) -> Shot {
    let (s, c) = angle.to_radians().sin_cos();
    Shot { from: [0.0, 100.0 * s, 100.0 * c], to: [0.0; 3], fov: 5e-4, size: 8, depth: 1 }
}

/// The same from so close by that f32 tells places apart that lie 1e-8 from each other in y: all positions are relative to the camera.
fn close(y: f64) -> Shot {
    Shot { from: [0.625, y, 0.5], ..tilted(0.0) }
}

fn bilinear([a, b, c, d]: [[f64; 3]; 4]) -> String {
    format!("Shape \"bilinearmesh\" \"point3 P\" [{}]\n", list(&[a, b, d, c].concat()))
}

fn needle(trial: &mut Trial) -> Result<(), Stop> {
    for k in [2, 4, 6, 8] {
        let w = 10f64.powi(-k);
        let corners = [[-1.0, -w / 2.0, 1.0], [1.0, -w / 2.0, 1.0], [1.0, w / 2.0, 1.0], [-1.0, w / 2.0, 1.0]];
        // A line, but for the widest.
        let expected = if k == 2 { polygon(&corners) / w } else { line(1.0, 1.0) };
        for (kind, shape) in [("bilinear", bilinear(corners)), ("triangles", mesh(&corners, &[0, 1, 2, 0, 2, 3]))] {
            let world = format!("{PLATE}{}", lamp(1.0 / w, &shape));
            let image = trial.render(&close(0.0), &world, &How::spp(512))?;
            trial.expect(
                &format!("{kind}, width 1e-{k}"),
                image.mean(),
                diffuse(RHO, expected),
                0.01,
                "the integral of d²/r⁴ along a line; a polygon for 1e-2",
            );
        }
    }
    Ok(())
}

fn sliver(trial: &mut Trial) -> Result<(), Stop> {
    for k in [3, 10, 17, 23] {
        // Powers of two: f32 holds all coordinates as they are.
        let e = 2f64.powi(-k);
        for (what, corners) in [
            ("level", [[-1.0, 0.25, 1.0], [1.0, 0.25, 1.0], [0.25, 0.25 + e, 1.0]]),
            ("tilted", [[-1.0, 0.25, 0.5], [1.0, 0.25, 1.5], [0.5, 0.25 + e, 1.25]]),
            ("with a needle's tip near by", [[0.125, 0.25, 0.25], [0.75, 0.25, 1.0], [0.75, 0.25 + e, 1.0]]),
        ] {
            let factor = polygon(&corners);
            let world = format!("{PLATE}{}", lamp(1.0 / factor, &mesh(&corners, &[0, 1, 2])));
            let image = trial.render(&close(0.25), &world, &How::spp(1024))?;
            let what = format!("{what}, 2^-{k} wide");
            trial.expect(&what, image.mean(), diffuse(RHO, 1.0), 0.02, "Lambert's formula in double precision");
        }
    }
    Ok(())
}

fn degenerate(trial: &mut Trial) -> Result<(), Stop> {
    let corners = [[-0.5, -0.3, 1.0], [0.7, -0.3, 1.0], [0.7, 0.6, 1.0], [-0.5, 0.6, 1.0]];
    let mut points = corners.to_vec();
    // On an edge, and the same place as a corner.
    points.extend([[0.1, -0.3, 1.0], [-0.5, -0.3, 1.0]]);
    let plain = mesh(&corners, &[0, 1, 2, 0, 2, 3]);
    let with = mesh(&points, &[0, 0, 0, 0, 1, 1, 0, 1, 2, 0, 4, 1, 2, 2, 0, 0, 5, 3, 0, 2, 3]);
    let none = lamp(7.0, &mesh(&[[0.0, 0.0, 0.5]; 3], &[0, 1, 2]))
        + &lamp(3.0, &mesh(&[[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [0.5, 1.0, 1.0]], &[0, 1, 2]));
    let flat = lamp(9.0, &bilinear([[0.0, 0.2, 0.4], [0.3, 0.2, 0.4], [0.3, 0.2, 0.4], [0.0, 0.2, 0.4]]));
    let source = "Lambert's formula of the lamp without them";
    for (what, lamps) in [
        ("without", lamp(4.0, &plain)),
        ("in the mesh", lamp(4.0, &with)),
        ("besides", format!("{none}{}{flat}", lamp(4.0, &plain))),
    ] {
        for lights in SELECTIONS {
            let shot = Shot { from: [-60.0, -50.0, 60.0], ..tilted(0.0) };
            let image = trial.render(&shot, &format!("{PLATE}{lamps}"), &How { lights, ..How::spp(512) })?;
            trial.expect(
                &format!("{what}, {lights:?}"),
                image.mean(),
                diffuse(RHO, 4.0 * polygon(&corners)),
                0.02,
                source,
            );
        }
    }
    Ok(())
}

fn touching(trial: &mut Trial) -> Result<(), Stop> {
    let world = format!("{PLATE}{}", lamp(1.0, "Translate 0 0 1 Shape \"sphere\""));
    for x in [10.0, 1.0, 0.1, 1e-2, 1e-3f64] {
        // From the side that the ball does not hide.
        let (s, c) = x.min(0.5).sin_cos();
        let far = 20.0 * x;
        let shot = Shot { from: [x + far * c, 0.0, far * s], to: [x, 0.0, 0.0], fov: 1e-6, size: 8, depth: 1 };
        let image = trial.render(&shot, &world, &How::spp(256))?;
        // E = π L sin² α cos θ; all of the ball is above the horizon.
        let expected = RHO / (x * x + 1.0).powf(1.5);
        trial.expect(&format!("{x} from where it touches"), image.mean(), expected, 0.02, "ρ (R/d)³");
    }
    Ok(())
}

fn grazing(trial: &mut Trial) -> Result<(), Stop> {
    // Positions are relative to the camera, and a quarter above the floor they are known to 3e-8: heights to that, and cosines.
    let shot = Shot { from: [0.0, 0.5, 0.25], ..tilted(0.0) };
    for k in [0, 3, 10, 14, 17] {
        let h = 2f64.powi(-k);
        let world = format!("{PLATE}{}", point(1.0 / h, [1.0, 0.0, h]));
        let image = trial.render(&shot, &world, &How::spp(16))?;
        let expected = diffuse(RHO, (1.0 + h * h).powf(-1.5));
        let allowed = (1e-4 + 1e-7 / h) * expected;
        trial.equal(&format!("a point 2^-{k} high"), image.mean().mean, expected, allowed, "I cos θ / d²");
    }
    for (what, light) in [
        ("a point in the plane", point(1.0, [1.0, 0.0, 0.0])),
        ("a lamp in the plane", lamp(1.0, "Translate 60 0 0 Shape \"disk\" \"float radius\" 5")),
        ("a point below", point(1.0, [1.0, 0.0, -1e-6])),
    ] {
        let image = trial.render(&tilted(30.0), &format!("{PLATE}{light}"), &How::spp(64))?;
        trial.equal(what, image.mean().mean, 0.0, 0.0, "it does not shine on it");
    }
    Ok(())
}

fn far(trial: &mut Trial) -> Result<(), Stop> {
    for (radius, distance) in [(1.0, 10.0), (1.0, 1e4), (1.0, 1e8), (1e-6, 1.0), (1e-3, 1e5f64)] {
        let radiance = (distance / radius).powi(2);
        let world = format!(
            "{PLATE}{}",
            lamp(radiance, &format!("Translate 0 0 {distance:e} Shape \"sphere\" \"float radius\" {radius:e}"))
        );
        let image = trial.render(&tilted(30.0), &world, &How::spp(64))?;
        // Straight above: E = π L (R/d)², whatever the distance.
        trial.expect(&format!("radius {radius:e} at {distance:e}"), image.mean(), RHO, 0.01, "ρ L (R/d)²");
    }
    Ok(())
}

fn narrow(trial: &mut Trial) -> Result<(), Stop> {
    for angle in [10.0, 1.0, 0.1, 0.01] {
        let world = format!(
            "{PLATE}LightSource \"spot\" \"rgb I\" [4 4 4] \"point3 from\" [0 0 2] \"point3 to\" [0 0 0]
             \"float coneangle\" {angle} \"float conedeltaangle\" {}",
            0.5 * angle
        );
        let shot = Shot { fov: 1e-5, ..tilted(30.0) };
        let image = trial.render(&shot, &world, &How::spp(16))?;
        trial.equal(
            &format!("{angle} degrees"),
            image.mean().mean,
            diffuse(RHO, 1.0),
            1e-3 * diffuse(RHO, 1.0),
            "I / d²",
        );
    }
    Ok(())
}

/// Twelve lights of several kinds.
fn several() -> Vec<String> {
    let points = (0..6).map(|i| {
        let i = f64::from(i);
        point(1.0 + i, [i - 2.5, -1.0, 1.5 + 0.2 * (i % 3.0)])
    });
    let balls = (0..4).map(|i| lamp(6.0, &format!("Translate {} 1 1 Shape \"sphere\" \"float radius\" 0.1", i - 2)));
    let quad =
        lamp(3.0, &mesh(&[[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.1], [1.0, 1.0, 2.2]], &[0, 1, 2, 1, 3, 2]));
    let spot = "LightSource \"spot\" \"rgb I\" [40 40 40] \"point3 from\" [2 -2 3] \"point3 to\" [0 0 0]\n".to_owned();
    points.chain(balls).chain([quad, spot]).collect()
}

fn order(trial: &mut Trial) -> Result<(), Stop> {
    let shot = Shot { from: [0.0, -6.0, 4.0], to: [0.0, 0.0, 0.3], fov: 35.0, size: 16, depth: 2 };
    let scenery = format!("{PLATE}Translate 0.8 0.3 0.4 Shape \"sphere\" \"float radius\" 0.4\n");
    let lights = several();
    let world = |order: Vec<usize>| order.into_iter().map(|i| lights[i].as_str()).collect::<String>() + &scenery;
    let forwards = world((0..lights.len()).collect());
    let reference =
        trial.render(&shot, &forwards, &How { seed: 99, lights: LightSelection::Optimal, ..How::spp(128) })?.mean();
    for (what, order) in [
        ("as stated", (0..lights.len()).collect::<Vec<_>>()),
        ("reversed", (0..lights.len()).rev().collect()),
        ("shuffled", (0..lights.len()).map(|i| i * 5 % lights.len()).collect()),
    ] {
        let world = world(order);
        for selection in SELECTIONS {
            let image = trial.render(&shot, &world, &How { lights: selection, ..How::spp(64) })?;
            trial.agree(&format!("{what}, {selection:?}"), image.mean(), reference, 0.02, "invariance");
        }
    }
    Ok(())
}

fn split(trial: &mut Trial) -> Result<(), Stop> {
    const SIDE: usize = 64;
    let cell = |i: usize| -1.0 + 2.0 * i as f64 / SIDE as f64;
    let tiles: String = (0..SIDE * SIDE)
        .map(|k| {
            let [x0, x1] = [cell(k % SIDE), cell(k % SIDE + 1)];
            let [y0, y1] = [cell(k / SIDE), cell(k / SIDE + 1)];
            lamp(1.0, &bilinear([[x0, y0, 0.5], [x1, y0, 0.5], [x1, y1, 0.5], [x0, y1, 0.5]]))
        })
        .collect();
    let square = [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [1.0, 1.0, 0.5], [-1.0, 1.0, 0.5]];
    // Below the lamp, from beside it.
    let shot = Shot { from: [0.0, 100.0, 10.0], ..tilted(0.0) };
    let expected = diffuse(RHO, polygon(&square));
    for lights in SELECTIONS {
        let image = trial.render(&shot, &format!("{PLATE}{tiles}"), &How { lights, ..How::spp(256) })?;
        trial.expect(&format!("{lights:?}"), image.mean(), expected, 0.03, "Lambert's formula of the square");
    }
    Ok(())
}

fn decades(trial: &mut Trial) -> Result<(), Stop> {
    let lights: String = (-15..=15).map(|k| point(10f64.powi(k), [0.0, 0.0, 2.0])).collect();
    let sum: f64 = (-15..=15).map(|k| 10f64.powi(k)).sum();
    for selection in SELECTIONS {
        let image =
            trial.render(&tilted(30.0), &format!("{PLATE}{lights}"), &How { lights: selection, ..How::spp(2048) })?;
        trial.expect(&format!("{selection:?}"), image.mean(), diffuse(RHO, sum / 4.0), 0.05, "the sum of I / d²");
    }
    // Under a sky that is ten decades brighter than what matters nothing gets lost that single precision holds.
    let image =
        trial.render(&tilted(30.0), &format!("{PLATE}{DOME}{}", point(4e-5, [0.0, 0.0, 2.0])), &How::spp(4096))?;
    trial.expect("a faint point under the sky", image.mean(), RHO + diffuse(RHO, 1e-5), 0.01, "ρ and I / d²");
    Ok(())
}
