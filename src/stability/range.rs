//! Range: radiance from denormal numbers to 1e30, and renders of a million samples a pixel.

use super::case::{Case, Stop, Trial};
use super::reference::diffuse;
use super::scene::{DOME, How, Shot, lamp, point};
use crate::render::LightSelection;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "range.emission",
        checks: "Lamps from 1e-44 to 1e30 side by side are seen as bright as they are.",
        seconds: 1.2,
        known: None,
        run: emission,
    },
    Case {
        name: "range.proportional",
        checks: "A scene 2^-100 to 2^100 times as bright is the same image times that, sample by sample; a denormal one is as near as its digits go.",
        seconds: 1.5,
        known: None,
        run: proportional,
    },
    Case {
        name: "range.reflectance",
        checks: "Surfaces of reflectance 1e-30 to 1 under a sky of its inverse have radiance 1.",
        seconds: 0.2,
        known: None,
        run: reflectance,
    },
    Case {
        name: "range.million",
        checks: "2^20 samples a pixel: what has no noise keeps its value, what has some comes out within an error that falls as it must.",
        seconds: 5.0,
        known: None,
        run: million,
    },
];

fn emission(trial: &mut Trial) -> Result<(), Stop> {
    let decades: Vec<i32> = (-44..=30).collect();
    let count = decades.len();
    let width = 2.0 / count as f64;
    // Each a little wider than its pixel, the later ones a little farther away.
    let lamps: String = decades
        .iter()
        .enumerate()
        .map(|(i, k)| {
            let [x0, x1] = [i as f64, i as f64 + 1.0].map(|i| -1.0 + i * width);
            let shape = format!("Shape \"bilinearmesh\" \"point3 P\" [{x0} -2 0  {x1} -2 0  {x0} 2 0  {x1} 2 0]\n");
            lamp(10f64.powi(*k), &shape)
        })
        .collect();
    let fov = 2.0 * 0.1f64.atan().to_degrees();
    let shot = Shot { from: [0.0, 0.0, -10.0], to: [0.0; 3], fov, size: 3 * count as u32, depth: 0 };
    let image = trial.render(&shot, &lamps, &How::spp(4))?;
    for (i, k) in decades.iter().enumerate() {
        let expected = f64::from(10f64.powi(*k) as f32);
        let got = image.columns(3 * i + 1, 3 * i + 2).mean;
        // Below 1.2e-38 numbers are whole multiples of 1.4e-45.
        trial.equal(&format!("radiance 1e{k}"), got, expected, 1e-6 * expected + 1.5e-45, "as stated, in f32");
    }
    Ok(())
}

fn proportional(trial: &mut Trial) -> Result<(), Stop> {
    let world = |by: f64| {
        format!(
            "{}{}{}Material \"diffuse\" \"rgb reflectance\" [0.6 0.5 0.4] Shape \"disk\" \"float radius\" 3
             AttributeBegin Translate 0.8 0.3 0.4 Material \"conductor\" \"float roughness\" 0.3 Shape \"sphere\" \"float radius\" 0.4 AttributeEnd
             AttributeBegin Translate -0.8 0.3 0.4 Material \"dielectric\" Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n",
            point(8.0 * by, [1.0, -1.0, 2.5]),
            lamp(6.0 * by, "Translate -1 0.5 2 Shape \"sphere\" \"float radius\" 0.2"),
            DOME.replace("1 1 1", &format!("{by:e} {by:e} {by:e}"))
        )
    };
    let shot = Shot { from: [0.0, -5.0, 3.0], to: [0.0, 0.0, 0.3], fov: 40.0, size: 24, depth: 4 };
    for lights in [LightSelection::Optimal, LightSelection::CachePoints, LightSelection::Tree] {
        let how = How { lights, ..How::spp(8) };
        let one = trial.render(&shot, &world(1.0), &how)?;
        for k in [-100, -50, 50, 100] {
            let image = trial.render(&shot, &world(2f64.powi(k)), &how)?;
            let apart = image.apart(2f64.powi(-k), &one);
            trial.equal(
                &format!("relative RMSE at 2^{k}, {lights:?}"),
                apart,
                0.0,
                1e-5,
                "powers of two change no digit",
            );
        }
        let by = 1e-41;
        let image = trial.render(&shot, &world(by), &how)?;
        let (got, expected) = (image.mean().mean, by * one.mean().mean);
        trial.equal(
            &format!("mean at 1e-41, {lights:?}"),
            got,
            expected,
            1e-43,
            "so small numbers are multiples of 1.4e-45",
        );
    }
    Ok(())
}

fn reflectance(trial: &mut Trial) -> Result<(), Stop> {
    for k in [0, -3, -10, -20, -30] {
        let rho = 10f64.powi(k);
        let sky = format!("{:e} {:e} {:e}", 1.0 / rho, 1.0 / rho, 1.0 / rho);
        let world = format!(
            "{}Material \"diffuse\" \"rgb reflectance\" [{rho:e} {rho:e} {rho:e}] Shape \"disk\" \"float radius\" 50\n",
            DOME.replace("1 1 1", &sky)
        );
        let shot = Shot { from: [0.0, 3.0, 4.0], to: [0.0; 3], fov: 10.0, size: 8, depth: 1 };
        let image = trial.render(&shot, &world, &How::spp(256))?;
        trial.expect(&format!("reflectance 1e{k}"), image.mean(), 1.0, 0.02, "ρ L");
    }
    Ok(())
}

fn million(trial: &mut Trial) -> Result<(), Stop> {
    const SPP: u32 = 1 << 20;
    let plate = "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n";
    let shot = Shot { from: [0.0, 3.0, 4.0], to: [0.0; 3], fov: 1e-4, size: 1, depth: 1 };
    let image = trial.render(&shot, &format!("{plate}{}", point(4.0, [0.0, 0.0, 2.0])), &How::spp(SPP))?;
    let got = image.mean();
    trial.equal("a point light", got.mean, diffuse(0.5, 1.0), 1e-6 * diffuse(0.5, 1.0), "I / d²");
    let sky = format!("{plate}{DOME}{}", lamp(20.0, "Translate 3 0 2 Shape \"sphere\" \"float radius\" 0.3"));
    // A tenth of the ball's share: E = π L (R/d)² cos θ, and what it hides of the sky.
    let d2 = 9.0 + 4.0f64;
    let expected = 0.5 * (1.0 + (20.0 - 1.0) * 0.09 / d2 * 2.0 / d2.sqrt());
    let mut before = None;
    for spp in [SPP / 64, SPP] {
        let image = trial.render(&shot, &sky, &How::spp(spp))?;
        let got = image.mean();
        trial.expect(&format!("sky and ball, {spp} samples"), got, expected, 5e-3, "ρ (1 + (L − 1) (R/d)² cos θ)");
        let samples: f64 = image.film.sample_count() as f64;
        trial.equal(&format!("samples taken of {spp}"), samples, f64::from(spp), 0.0, "none is lost");
        if let Some(before) = before {
            // The variance of 16384 samples is itself known to some percent.
            trial.equal("the standard error falls by 8", before / got.error, 8.0, 1.0, "√64");
        }
        before = Some(got.error);
    }
    // A lamp among forty is learned about in every pass.
    let many: String = (0..40).map(|i| point(0.1 * f64::from(i), [0.3 * f64::from(i) - 6.0, 1.0, 2.0])).collect();
    let expected: f64 = (0..40)
        .map(|i| {
            let x = 0.3 * f64::from(i) - 6.0;
            0.1 * f64::from(i) * 2.0 / (x * x + 5.0).powf(1.5)
        })
        .sum();
    let how = How { lights: LightSelection::CachePoints, ..How::spp(SPP / 4) };
    let image = trial.render(&shot, &format!("{plate}{many}"), &how)?;
    trial.expect(
        "forty lights, learning for eighteen passes",
        image.mean(),
        diffuse(0.5, expected),
        5e-3,
        "the sum of I cos θ / d²",
    );
    Ok(())
}
