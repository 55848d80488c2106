//! Media that absorb: side by side, steep, of several colours, of all sizes, of one voxel, of none, and sparse.

use super::blocks;
use crate::stability::case::{Stop, Trial};
use crate::stability::reference::{depth, diffuse, integrate, tent};
use crate::stability::scene::{CUBE, DOME, FOREVER, How, SHELL, Shot, boundary, grey, grid, homogeneous, list, point};

pub(super) fn stiff(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn gradient(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn colours(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn sizes(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn one_voxel(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn nothing(trial: &mut Trial) -> Result<(), Stop> {
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

#[cfg(not(feature = "openvdb"))]
pub(super) fn sparse(_: &mut Trial) -> Result<(), Stop> {
    Err(Stop::Skipped("this build has no OpenVDB".to_owned()))
}

#[cfg(feature = "openvdb")]
pub(super) fn sparse(trial: &mut Trial) -> Result<(), Stop> {
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
