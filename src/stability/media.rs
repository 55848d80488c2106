//! Media: extinctions of eighteen decades side by side, steep gradients, albedo 1 and nearly 1, |g| → 1, huge, tiny, sparse and far-away ones.

use super::case::{Case, ROUNDING, Stop, Trial};
use super::reference::{depth, diffuse, half_space, integrate, tent};
use super::scene::{CUBE, DOME, FOREVER, How, SHELL, Shot, boundary, grey, grid, homogeneous, lamp, list, point};
use crate::render::{VolumeLights, VolumeSampling};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "media.stiff",
        checks: "Absorbing blocks of one size side by side, extinctions from 1e-9 to 1e9 (homogeneous) and to 1e5 (grids), transmit by Beer's law.",
        seconds: 2.0,
        known: None,
        run: stiff,
    },
    Case {
        name: "media.stiff-white",
        checks: "White blocks side by side, extinctions from 1e-9 to 1e3, are invisible under a white sky.",
        seconds: 2.0,
        known: None,
        run: stiff_white,
    },
    Case {
        name: "media.gradient",
        checks: "Densities that change by twelve decades from one voxel to the next transmit what quadrature says, to the camera and to shadow rays.",
        seconds: 1.5,
        known: None,
        run: gradient,
    },
    Case {
        name: "media.deep-paths",
        checks: "Paths of more than 10,000 bounces in a white ball bring back exactly 1, and on average with light sampling.",
        seconds: 12.0,
        known: None,
        run: deep_paths,
    },
    Case {
        name: "media.nearly-white",
        checks: "Half-spaces of albedo 0.99, 0.999 and 0.9999 reflect what Chandrasekhar's H function says.",
        seconds: 3.0,
        known: None,
        run: nearly_white,
    },
    Case {
        name: "media.lobes",
        checks: "Lobes of |g| from 0.9 to 0.999, thin and dense, neither gain nor lose: exactly where paths find the light, on average where lights are sampled.",
        seconds: 8.0,
        known: None,
        run: lobes,
    },
    Case {
        name: "media.colours",
        checks: "Media whose extinction is 1000 times as large in one channel as in another transmit by Beer's law in each, and are invisible if white.",
        seconds: 1.0,
        known: None,
        run: colours,
    },
    Case {
        name: "media.split",
        checks: "A medium cut into two that touch, or into two of half its coefficients in one place, is the medium.",
        seconds: 1.2,
        known: None,
        run: split,
    },
    Case {
        name: "media.sizes",
        checks: "Balls of radius 1e-8 to 1e8 and of optical depth 1 around the camera transmit 1/e.",
        seconds: 0.3,
        known: None,
        run: sizes,
    },
    Case {
        name: "media.glow",
        checks: "Slabs of depth 2e-9 to 2e3 that emit as much as makes their radiance 1 have radiance 1.",
        seconds: 3.0,
        known: None,
        run: glow,
    },
    Case {
        name: "media.fire",
        checks: "Fires of depth 1e-6 to 10 light a floor alike as lights and found by chance.",
        seconds: 1.5,
        known: None,
        run: fire,
    },
    Case {
        name: "media.one-voxel",
        checks: "Grids of one voxel, 1e-6 to 1e6 large and as far away as the camera sees them alike, transmit what trilinear interpolation says.",
        seconds: 0.3,
        known: None,
        run: one_voxel,
    },
    Case {
        name: "media.nothing",
        checks: "Media without density, without coefficients, or with denormal ones, are not there.",
        seconds: 0.2,
        known: None,
        run: nothing,
    },
    Case {
        name: "media.far",
        checks: "Smoke and lamps are the same a million and a thousand million units away.",
        seconds: 0.4,
        known: None,
        run: far,
    },
    Case {
        name: "media.sparse",
        checks: "Two clouds of 64³ voxels, 2 million voxels apart in one OpenVDB grid, transmit 1/e each; the void between them takes no steps.",
        seconds: 1.2,
        known: None,
        run: sparse,
    },
];

/// Blocks side by side across the image, one unit deep along the view; `medium` makes the medium of a name and an extinction.
fn blocks(count: usize, medium: impl Fn(&str, usize) -> String) -> (Shot, String) {
    let width = 2.0 / count as f64;
    let world = (0..count).map(|i| {
        let name = format!("m{i}");
        let middle = -1.0 + (i as f64 + 0.5) * width;
        let shape = format!("Translate {middle} 0 0 Scale {} 1.2 0.5 {CUBE}", 0.45 * width);
        medium(&name, i) + &boundary(&name, "", &shape)
    });
    let fov = 2.0 * 0.01f64.atan().to_degrees();
    let shot = Shot { from: [0.0, 0.0, -100.0], to: [0.0; 3], fov, size: (3 * count) as u32, depth: FOREVER };
    (shot, format!("{DOME}{}", world.collect::<String>()))
}

fn stiff(trial: &mut Trial) -> Result<(), Stop> {
    type Medium = fn(&str, f64) -> String;
    let smoke: Medium = |name, sigma| grid(name, 4, &[1.0; 64], [[-4.0; 3], [4.0; 3]], &grey(sigma, 0.0));
    let fog: Medium = |name, sigma| homogeneous(name, [sigma; 3], [0.0; 3], "");
    for (kind, medium, last) in [("homogeneous", fog, 9), ("grid", smoke, 5)] {
        let decades: Vec<i32> = (-9..=last).collect();
        let (shot, world) = blocks(decades.len(), |name, i| medium(name, 10f64.powi(decades[i])));
        let spp = 256;
        let image = trial.render(&shot, &world, &How::spp(spp))?;
        let size = f64::from(shot.size);
        // Of so many samples in a column: what comes about as often as a handful of them is known only as far as that.
        let floor = 25.0 / (size * f64::from(spp));
        for (i, k) in decades.iter().enumerate() {
            let x = (2.0 * (3 * i + 1) as f64 + 1.0) / size - 1.0;
            let sigma = 10f64.powi(*k);
            let expected = integrate(-1.0, 1.0, 8, |y| (-sigma * (1.0 + 1e-4 * (x * x + y * y)).sqrt()).exp()) / 2.0;
            let got = image.columns(3 * i + 1, 3 * i + 2);
            trial.mean(
                &format!("{kind}, extinction 1e{k}"),
                got,
                expected,
                0.02,
                floor,
                "exp(−σ·length), quadrature over the pixels",
            );
        }
    }
    Ok(())
}

fn stiff_white(trial: &mut Trial) -> Result<(), Stop> {
    let decades: Vec<i32> = (-9..=3).collect();
    let (shot, world) =
        blocks(decades.len(), |name, i| homogeneous(name, [0.0; 3], [10f64.powi(decades[i]); 3], "\"float g\" 0.3"));
    for volume_sampling in [VolumeSampling::Null, VolumeSampling::Both] {
        let image = trial.render(&shot, &world, &How { volume_sampling, ..How::spp(8) })?;
        for (i, k) in decades.iter().enumerate() {
            let got = image.columns(3 * i + 1, 3 * i + 2);
            let floor = ROUNDING + unseen(10f64.powi(*k), f64::from(8 * shot.size));
            trial.mean(&format!("{volume_sampling:?}, extinction 1e{k}"), got, 1.0, 0.05, floor, "a white furnace");
        }
    }
    Ok(())
}

/// What a mean over so many samples may lack because none, or too few, of the few rays were scattered that a medium of this depth scatters, where what
/// those bring has been counted by other ways of sampling: a standard error does not know of what was not met.
fn unseen(depth: f64, samples: f64) -> f64 {
    (1.5 * depth).min(25.0 / samples)
}

fn gradient(trial: &mut Trial) -> Result<(), Stop> {
    // Layers along z in the cube; a cell's value is that of its middle, and outside there is nothing.
    let layers = [1e-6, 1e6, 1e-6, 1e6];
    let value = |i: f64| if (0.0..4.0).contains(&i) { layers[i as usize] } else { 0.0 };
    let density = |p: [f64; 3]| {
        let x = (p[2] + 1.0) * 2.0 - 0.5;
        let i = x.floor();
        value(i) * (1.0 - (x - i)) + value(i + 1.0) * (x - i)
    };
    let values: Vec<f64> = (0..64).map(|i| layers[i / 16]).collect();
    let whole = depth([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], 64, density);
    for tau in [1e-2, 1.0, 3.0] {
        let medium = grid("g", 4, &values, [[-4.0, -4.0, -1.0], [4.0, 4.0, 1.0]], &grey(tau / whole, 0.0));
        let smoke = format!("{medium}{}", boundary("g", "", CUBE));
        for (slope, seen) in [(0.0, "straight"), (0.4, "aslant")] {
            let shot = Shot { from: [0.0, -8.0 * slope, -8.0], to: [0.0; 3], fov: 1e-3, size: 16, depth: 3 };
            let image = trial.render(&shot, &format!("{DOME}{smoke}"), &How::spp(256))?;
            let expected = (-tau * (1.0f64 + slope * slope).sqrt()).exp();
            trial.expect(
                &format!("depth {tau}, {seen}"),
                image.mean(),
                expected,
                0.02,
                "exp of minus the quadrature of trilinear interpolation",
            );
        }
        // A floor behind it, seen from beside it, lit through it by a point.
        let floor = "AttributeBegin Translate 0 0 2 Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" AttributeEnd\n";
        let world = format!("{floor}{}{smoke}", point(64.0, [0.0, 0.0, -6.0]));
        let shot = Shot { from: [60.0, 0.0, -18.0], to: [0.0, 0.0, 2.0], fov: 5e-4, size: 16, depth: 1 };
        let image = trial.render(&shot, &world, &How::spp(256))?;
        let expected = diffuse(0.5, 1.0) * (-tau).exp();
        trial.expect(
            &format!("depth {tau}, shadow rays"),
            image.mean(),
            expected,
            0.02,
            "the same, times the inverse square",
        );
    }
    Ok(())
}

fn deep_paths(trial: &mut Trial) -> Result<(), Stop> {
    // From the middle a walk leaves a ball of optical radius R after about R² / 2 collisions.
    let radius = 160.0;
    let ball = boundary("m", "", &format!("Shape \"sphere\" \"float radius\" {radius}"));
    let world = format!("{DOME}{}{ball}", homogeneous("m", [0.0; 3], [1.0; 3], ""));
    let shell = SHELL.replace("radius\" 3", "radius\" 400");
    let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 40.0, size: 4, depth: FOREVER };
    for (what, spp, world) in [("found by paths", 8, format!("{shell}{world}")), ("lights sampled", 24, world)] {
        let image = trial.render(&shot, &world, &How { volume_sampling: VolumeSampling::Null, ..How::spp(spp) })?;
        let length = image.counters.medium_vertices as f64 / image.counters.paths as f64;
        // Four standard deviations of a mean of 128 exit times, which vary by 0.63 of theirs.
        trial.equal(
            &format!("bounces a path, {what}"),
            length,
            radius * radius / 2.0,
            0.22 * radius * radius / 2.0,
            "the exit time of a random walk",
        );
        trial.equal(
            &format!("at least 10,000 bounces, {what}"),
            f64::from(u8::from(length >= 1e4)),
            1.0,
            0.0,
            "the case's own claim",
        );
        trial.equal(&format!("paths cut, {what}"), image.counters.cut_paths as f64, 0.0, 0.0, "none is as long as 10⁷");
        let got = image.mean();
        if what == "found by paths" {
            trial.equal("each path brings 1", got.mean, 1.0, 1e-5, "a white furnace without light sampling");
            trial.equal("without noise", got.error, 0.0, 1e-5, "the same");
        } else {
            trial.expect(what, got, 1.0, 0.06, "a white furnace");
        }
    }
    Ok(())
}

fn nearly_white(trial: &mut Trial) -> Result<(), Stop> {
    // The densest has free paths far shorter than the distance of neighbouring positions in f32.
    for (albedo, sigma) in [(0.99, 1e4), (0.999, 1e4), (0.9999, 1e4), (0.99, 1e9)] {
        let medium = homogeneous("m", [(1.0 - albedo) * sigma; 3], [albedo * sigma; 3], "");
        let world = format!("{DOME}{medium}{}", boundary("m", "", CUBE));
        let shot = Shot { from: [0.0, 0.0, -4.0], to: [0.0; 3], fov: 0.1, size: 8, depth: FOREVER };
        let image = trial.render(&shot, &world, &How::spp(64))?;
        // Light gets about 1 / √(3 (1 − ϖ)) free paths deep, 58 of the 20,000 there are; and a side is 10⁴ away.
        trial.expect(
            &format!("albedo {albedo}, extinction {sigma:e}"),
            image.mean(),
            half_space(albedo),
            0.02,
            "1 − √(1 − ϖ) H(1), Chandrasekhar 1960",
        );
    }
    Ok(())
}

fn lobes(trial: &mut Trial) -> Result<(), Stop> {
    for g in [0.9, 0.99, 0.999] {
        for (g, sigma) in [(g, 20.0), (-g, 20.0), (g, 1e-3), (-g, 0.5)] {
            let more = format!("\"float g\" {g}");
            let world = format!("{DOME}{}{}", homogeneous("m", [0.0; 3], [sigma; 3], &more), boundary("m", "", CUBE));
            let outside = Shot { from: [0.0, 0.0, -4.0], to: [0.0; 3], fov: 30.0, size: 8, depth: FOREVER };
            let inside = Shot { from: [0.0, 0.0, -2.9], ..outside };
            let what = format!("g {g}, extinction {sigma}");
            let (in_shell, source) = (format!("{SHELL}{world}"), "a white furnace without light sampling");
            let image = trial.render(&outside, &in_shell, &How::spp(4))?;
            trial.equal(&format!("{what}, found by paths"), image.mean().mean, 1.0, 1e-4, source);
            // Where the medium is seen without anything before it scattering points are drawn as well.
            for volume_sampling in [VolumeSampling::Null, VolumeSampling::Both, VolumeSampling::Paths] {
                let how = How { volume_sampling, ..How::spp(32) };
                let floor = ROUNDING + unseen(2.0 * sigma, f64::from(32 * inside.size * inside.size));
                let image = trial.render(&inside, &in_shell, &how)?;
                let found = format!("{what}, found by paths, {volume_sampling:?}");
                trial.mean(&found, image.mean(), 1.0, 0.03, floor, source);
                let image = trial.render(&inside, &world, &how)?;
                let sampled = format!("{what}, lights sampled, {volume_sampling:?}");
                trial.mean(&sampled, image.mean(), 1.0, 0.02, floor, "a white furnace");
            }
        }
    }
    Ok(())
}

fn colours(trial: &mut Trial) -> Result<(), Stop> {
    let sigma = [0.002f64, 0.3, 2.0];
    type Medium = fn([f64; 3], [f64; 3]) -> String;
    let fog: Medium = |a, s| homogeneous("m", a, s, "");
    let smoke: Medium = |a, s| {
        let coefficients = format!("\"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}]", list(&a), list(&s));
        grid("m", 4, &[1.0; 64], [[-4.0; 3], [4.0; 3]], &coefficients)
    };
    let shot = Shot { from: [0.0, 0.0, -100.0], to: [0.0; 3], fov: 0.1, size: 16, depth: FOREVER };
    for (kind, medium) in [("homogeneous", fog), ("grid", smoke)] {
        let cube = boundary("m", "", CUBE);
        for (c, channel) in ["red", "green", "blue"].into_iter().enumerate() {
            let mut sky = [0.0; 3];
            sky[c] = 3.0;
            let sky = DOME.replace("1 1 1", &list(&sky));
            let image = trial.render(&shot, &format!("{sky}{}{cube}", medium(sigma, [0.0; 3])), &How::spp(256))?;
            let expected = (-2.0 * sigma[c]).exp();
            trial.expect(&format!("{kind}, {channel}"), image.mean(), expected, 0.1, "exp(−σ·length)");
        }
        let shot = Shot { from: [0.0, 0.0, -2.9], fov: 30.0, ..shot };
        let image = trial.render(&shot, &format!("{SHELL}{DOME}{}{cube}", medium([0.0; 3], sigma)), &How::spp(64))?;
        trial.expect(&format!("{kind}, white"), image.mean(), 1.0, 0.02, "a white furnace");
    }
    Ok(())
}

fn split(trial: &mut Trial) -> Result<(), Stop> {
    let light = format!("{DOME}{}", lamp(20.0, "Translate 0 3 0 Rotate 90 1 0 0 Shape \"disk\""));
    let shot = Shot { from: [1.0, 2.0, -5.0], to: [0.0; 3], fov: 35.0, size: 12, depth: FOREVER };
    for scale in [1e-3, 1.0, 1e3] {
        let medium = |name: &str, share: f64| {
            homogeneous(name, [0.3 * scale * share; 3], [2.0 * scale * share; 3], "\"float g\" 0.5")
        };
        let halves = |place: &str, other: &str| {
            format!(
                "{}{}{}{}",
                medium("a", 1.0),
                medium("b", 1.0),
                boundary("a", "", &format!("Translate {place} Scale {other} {CUBE}")),
                boundary("b", "", &format!("Scale -1 -1 -1 Translate {place} Scale {other} {CUBE}"))
            )
        };
        let whole = format!("{}{}", medium("a", 1.0), boundary("a", "", CUBE));
        let doubled =
            format!("{}{}{}{}", medium("a", 0.25), medium("b", 0.75), boundary("a", "", CUBE), boundary("b", "", CUBE));
        let reference = trial.render(&shot, &format!("{light}{whole}"), &How { seed: 77, ..How::spp(96) })?.mean();
        for (what, world) in [
            ("in two across the view", halves("0 0 -0.5", "1 1 0.5")),
            ("in two along the view", halves("0.5 0 0", "0.5 1 1")),
            ("in two of a quarter and three quarters", doubled),
        ] {
            let image = trial.render(&shot, &format!("{light}{world}"), &How::spp(96))?;
            trial.agree(&format!("extinction {}, {what}", 2.3 * scale), image.mean(), reference, 0.02, "invariance");
        }
    }
    Ok(())
}

fn sizes(trial: &mut Trial) -> Result<(), Stop> {
    for k in [-8, -4, 0, 4, 8] {
        let radius = 10f64.powi(k);
        let ball = boundary("m", "", &format!("Shape \"sphere\" \"float radius\" {radius:e}"));
        for (kind, medium) in [
            ("homogeneous", homogeneous("m", [1.0 / radius; 3], [0.0; 3], "")),
            ("grid", grid("m", 4, &[1.0; 64], [[-4.0 * radius; 3], [4.0 * radius; 3]], &grey(1.0 / radius, 0.0))),
        ] {
            let shot = Shot { from: [0.0; 3], to: [0.6, 0.3, 1.0], fov: 60.0, size: 8, depth: 2 };
            let image = trial.render(&shot, &format!("{DOME}{medium}{ball}"), &How::spp(256))?;
            trial.expect(&format!("{kind}, radius 1e{k}"), image.mean(), (-1f64).exp(), 0.02, "Beer's law");
        }
    }
    Ok(())
}

fn glow(trial: &mut Trial) -> Result<(), Stop> {
    for k in [-9, -6, -3, 0, 3] {
        let sigma = 10f64.powi(k);
        let radiance = -1.0 / (-2.0 * sigma).exp_m1();
        let more = format!("\"rgb Le\" [{}]", list(&[radiance; 3]));
        for (kind, medium) in [
            ("homogeneous", homogeneous("m", [sigma; 3], [0.0; 3], &more)),
            ("grid", grid("m", 4, &[1.0; 64], [[-4.0; 3], [4.0; 3]], &format!("{} {more}", grey(sigma, 0.0)))),
        ] {
            let shot = Shot { from: [0.0, 0.0, -4.0], to: [0.0; 3], fov: 0.01, size: 8, depth: 1 };
            // Points of emission in a grid lie as dense as voxels at most, and here a voxel has a depth of 2000.
            let spp = if kind == "grid" && k > 0 { 1 << 14 } else { 512 };
            let image = trial.render(&shot, &format!("{medium}{}", boundary("m", "", CUBE)), &How::spp(spp))?;
            trial.expect(&format!("{kind}, extinction 1e{k}"), image.mean(), 1.0, 0.03, "Le (1 − exp(−τ))");
        }
    }
    Ok(())
}

fn fire(trial: &mut Trial) -> Result<(), Stop> {
    let values: Vec<f64> = (0..64).map(|i| f64::from(i * 37 % 64) / 63.0).collect();
    let floor =
        "AttributeBegin Translate 0 -1.2 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
                 Shape \"disk\" \"float radius\" 6 AttributeEnd\n";
    for sigma in [1e-6, 1e-2, 10.0] {
        let more = format!("{} \"rgb Le\" [{}]", grey(sigma, 0.3 * sigma), list(&[1.0 / sigma.min(1.0); 3]));
        let medium = grid("g", 4, &values, [[-1.0; 3], [1.0; 3]], &more);
        let world = format!("{floor}{medium}{}", boundary("g", "", CUBE));
        // The floor beside the fire, without the fire in view.
        let shot = Shot { from: [0.0, 4.0, -6.0], to: [0.0, -1.2, -3.0], fov: 20.0, size: 8, depth: 3 };
        let chance = How { volume_lights: VolumeLights::Off, seed: 77, ..How::spp(4096) };
        let reference = trial.render(&shot, &world, &chance)?.mean();
        let got = trial.render(&shot, &world, &How::spp(256))?.mean();
        trial.agree(&format!("extinction {sigma:e}"), got, reference, 0.02, "the same fire found by chance");
    }
    Ok(())
}

fn one_voxel(trial: &mut Trial) -> Result<(), Stop> {
    for k in [-6, -2, 2, 6] {
        let size = 10f64.powi(k);
        let [from, to] = [[-3.0, 0.35, -2.0], [3.0, -0.2, 2.0]];
        // The box from −1 to 1, cut off half way to where its neighbours would be.
        let density = |p: [f64; 3]| if p.iter().all(|c| c.abs() <= 1.0) { tent(p.map(|c| c / 2.0)) } else { 0.0 };
        let length = depth(from, to, 4000, density);
        let medium = grid("m", 1, &[1.0], [[-size; 3], [size; 3]], &grey(1.0 / length / size, 0.0));
        let world = format!("{DOME}{medium}{}", boundary("m", "", &format!("Scale {size:e} {size:e} {size:e} {CUBE}")));
        let [from, to] = [from, to].map(|p| p.map(|c| c * size));
        let shot = Shot { from, to, fov: 0.01, size: 8, depth: 2 };
        let image = trial.render(&shot, &world, &How::spp(512))?;
        trial.mean(
            &format!("a voxel of 2e{k}"),
            image.mean(),
            (-1f64).exp(),
            0.02,
            2e-4,
            "exp of minus the quadrature of one tent",
        );
    }
    Ok(())
}

fn nothing(trial: &mut Trial) -> Result<(), Stop> {
    let zero = [0.0; 3];
    let unit = [[-1.0; 3], [1.0; 3]];
    for (what, medium) in [
        ("no coefficients", homogeneous("m", zero, zero, "")),
        ("denormal coefficients", homogeneous("m", [1e-42; 3], [3e-45; 3], "")),
        ("no density", grid("m", 2, &[0.0; 8], unit, &grey(1.0, 1.0))),
        ("denormal density", grid("m", 2, &[1e-42; 8], unit, &grey(1.0, 1.0))),
        ("no coefficients of a dense grid", grid("m", 2, &[1e30; 8], unit, &grey(0.0, 0.0))),
        ("denormal coefficients of a dense grid", grid("m", 2, &[1.0; 8], unit, &grey(1e-42, 1e-42))),
    ] {
        let shot = Shot { from: [0.0, 0.3, -4.0], to: [0.0; 3], fov: 40.0, size: 8, depth: 5 };
        let image = trial.render(&shot, &format!("{DOME}{medium}{}", boundary("m", "", CUBE)), &How::spp(16))?;
        trial.equal(what, image.mean().mean, 1.0, 1e-6, "there is nothing but the sky");
    }
    Ok(())
}

/// Smoke, lamps and a floor at `place`.
fn smoke_at(place: f64) -> (Shot, String) {
    let values: Vec<f64> = (0..64).map(|i| f64::from(i * 37 % 64) / 63.0).collect();
    let medium = grid(
        "g",
        4,
        &values,
        [[-1.0; 3], [1.0; 3]],
        "\"rgb sigma_a\" [0.2 0.4 0.8] \"rgb sigma_s\" [2 1.5 1] \"float g\" 0.6",
    );
    let floor =
        "AttributeBegin Translate 0 -1.2 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5]
                 Shape \"disk\" \"float radius\" 6 AttributeEnd\n";
    let lamps = lamp(6.0, "Translate -1.6 1 0.5 Shape \"sphere\" \"float radius\" 0.3") + &point(4.0, [1.8, 2.0, -1.5]);
    let world = format!(
        "Translate {place} {place} {place}\n{floor}{lamps}{medium}{}",
        boundary("g", "", &format!("Rotate 20 0 1 0 {CUBE}"))
    );
    let at = |p: [f64; 3]| p.map(|c| c + place);
    (Shot { from: at([0.0, 1.0, -5.0]), to: at([0.0; 3]), fov: 40.0, size: 16, depth: 4 }, world)
}

fn far(trial: &mut Trial) -> Result<(), Stop> {
    let how = How::spp(16);
    let (shot, world) = smoke_at(0.0);
    let here = trial.render(&shot, &world, &how)?;
    // The move to the camera is made in double precision: 1e9 units have steps of 1e-7. A last digit differs here and there, and then a sample
    // goes another way.
    for (place, allowed) in [(1e6, 5e-3), (-1e6, 5e-3), (1e9, 5e-3)] {
        let (shot, world) = smoke_at(place);
        let there = trial.render(&shot, &world, &how)?;
        trial.equal(
            &format!("relative RMSE at {place:e}"),
            there.apart(1.0, &here),
            0.0,
            allowed,
            "invariance, sample by sample",
        );
        trial.equal(
            &format!("mean at {place:e}"),
            there.mean().mean,
            here.mean().mean,
            0.003 * here.mean().mean,
            "invariance",
        );
    }
    Ok(())
}

#[cfg(not(feature = "openvdb"))]
fn sparse(_: &mut Trial) -> Result<(), Stop> {
    Err(Stop::Skipped("this build has no OpenVDB".to_owned()))
}

#[cfg(feature = "openvdb")]
fn sparse(trial: &mut Trial) -> Result<(), Stop> {
    use openvdb::{Compression, Precision, VdbWriter};
    let (voxel, away) = (0.5, 1 << 20);
    let write = |path: &std::path::Path| {
        let mut writer = VdbWriter::new()?;
        writer.fog_grid("density", Precision::Half, 0.0, voxel, [0.0; 3])?;
        for side in [-1, 1] {
            writer.dense([side * away - 32, -32, -32], [64; 3], 0.0, |_, _, _| 1.0)?;
        }
        writer.write(path, Compression::Zip)
    };
    let path = trial.folder.join("sparse.vdb");
    if let Err(error) = write(&path) {
        return Err(Stop::Skipped(format!("the grid cannot be written: {error}")));
    }
    // From voxel middle to voxel middle 63 voxels, and half a voxel's worth of fading at either end.
    let length = 64.0 * voxel;
    let medium = format!(
        "MakeNamedMedium \"g\" \"string type\" \"openvdb\" \"string filename\" \"sparse.vdb\" {}\n",
        grey(1.0 / length, 0.0)
    );
    let world = format!("{DOME}{medium}{}", boundary("g", "", "Shape \"sphere\" \"float radius\" 2e6"));
    for side in [-1.0, 1.0] {
        let to = [side, 0.0, 0.0];
        let shot = Shot { from: [0.0; 3], to, fov: 1e-4, size: 8, depth: 2 };
        let image = trial.render(&shot, &world, &How::spp(512))?;
        // Half a million units from the camera a position in f32 is known to 0.03.
        let got = image.mean();
        trial.mean(&format!("towards {side}"), got, (-1f64).exp(), 0.02, 2e-3, "Beer's law");
        let steps = image.counters.flight_steps as f64 / image.counters.paths as f64;
        trial.equal(&format!("steps a path towards {side}, ± 8"), steps, 0.0, 8.0, "about one for each mean free path");
    }
    Ok(())
}
