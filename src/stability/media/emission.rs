//! Media that emit: slabs seen by themselves, and fires that light a floor.

use crate::render::VolumeLights;
use crate::stability::case::{Stop, Trial};
use crate::stability::scene::{CUBE, How, Shot, boundary, grey, grid, homogeneous, list};

pub(super) fn glow(trial: &mut Trial) -> Result<(), Stop> {
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

pub(super) fn fire(trial: &mut Trial) -> Result<(), Stop> {
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
