//! Media that scatter: white and nearly white, of sharp lobes, cut into parts, and far away.

use super::blocks;
use crate::render::VolumeSampling;
use crate::stability::case::{ROUNDING, Stop, Trial};
use crate::stability::reference::half_space;
use crate::stability::scene::{CUBE, DOME, FOREVER, How, SHELL, Shot, boundary, grid, homogeneous, lamp, point};

pub(super) fn stiff_white(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn deep_paths(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn nearly_white(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn lobes(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn split(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn far(trial: &mut Trial) -> Result<(), Stop> {
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
