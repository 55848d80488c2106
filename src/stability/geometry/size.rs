//! One scene at many sizes and places.

use super::{FLOOR, VIEW, things, tracers};
use crate::stability::case::{Stop, Trial};
use crate::stability::scene::{How, Shot, boundary, homogeneous};

/// A tetrahedron, a curve and a patch.
const TRINKETS: &str = "Shape \"trianglemesh\" \"point3 P\" [-0.3 0 -0.3  0.3 0 -0.3  0 0 0.3  0 0.5 0]
     \"integer indices\" [0 1 2 0 2 3 0 3 1 1 3 2]
     Shape \"curve\" \"string type\" \"flat\" \"point3 P\" [0 0 0  0.2 0.3 0  -0.2 0.6 0  0 1 0] \"float width0\" 0.1 \"float width1\" 0.02
     Shape \"bilinearmesh\" \"point3 P\" [-0.1 0.8 0  0.4 0.8 0.1  -0.1 1.2 0.1  0.4 1.2 0]\n";

/// Something of every kind, `by` times as large: as such, instanced and moving, and around fog.
fn world(by: f64) -> String {
    let scale = format!("Scale {by:e} {by:e} {by:e}");
    let at = |p: [f64; 3]| format!("Translate {:e} {:e} {:e}", p[0] * by, p[1] * by, p[2] * by);
    let [still, start, way] = [[0.9, 0.0, -0.8], [0.1, 0.0, 1.2], [0.3, 0.1, 0.0]].map(at);
    let fog = homogeneous("fog", [0.5 / by; 3], [2.0 / by; 3], "");
    let around = boundary("fog", "", "Translate 0 0.8 -0.6 Shape \"sphere\" \"float radius\" 0.4")
        + &boundary("fog", "", &format!("Translate -1.4 0.2 -0.8 {TRINKETS}"));
    format!(
        "AttributeBegin {scale} Material \"diffuse\" ObjectBegin \"trinkets\" {TRINKETS} ObjectEnd AttributeEnd
         AttributeBegin {still} Rotate 20 0 1 0 Scale 1 1.3 1 ObjectInstance \"trinkets\" AttributeEnd
         AttributeBegin {start} ActiveTransform EndTime {way} Rotate 50 0 1 0 ActiveTransform All ObjectInstance \"trinkets\" AttributeEnd
         {fog}{scale}\n{}{FLOOR}AttributeBegin Translate -1.6 0 0.8 {TRINKETS} AttributeEnd\n{around}",
        things(by)
    )
}

/// The world `by` times as large; sample by sample as it is.
fn sized(trial: &mut Trial, powers: &[i32]) -> Result<(), Stop> {
    for backend in tracers() {
        let how = How { backend, ..How::spp(8) };
        let one = trial.render(&VIEW, &world(1.0), &how)?;
        for k in powers {
            let by = 2f64.powi(*k);
            let shot = Shot { from: VIEW.from.map(|x| x * by), to: VIEW.to.map(|x| x * by), ..VIEW };
            let image = trial.render(&shot, &world(by), &how)?;
            let (apart, source) = (image.apart(1.0, &one), "powers of two change no digit");
            trial.equal(&format!("relative RMSE at 2^{k}, {backend:?}"), apart, 0.0, 1e-6, source);
        }
    }
    Ok(())
}

pub(super) fn scale(trial: &mut Trial) -> Result<(), Stop> {
    sized(trial, &[-30, -20, 20, 40])
}

pub(super) fn tiny(trial: &mut Trial) -> Result<(), Stop> {
    // Below, squares of distances are denormal: at 2^-61 the relative RMSE is 4e-4, at 2^-70 0.05, with either tracer.
    sized(trial, &[-40, -50, -60])
}

pub(super) fn vast(trial: &mut Trial) -> Result<(), Stop> {
    // Scenes that reach beyond 1e18 units are refused.
    sized(trial, &[44, 56])
}

pub(super) fn far(trial: &mut Trial) -> Result<(), Stop> {
    let how = How::spp(8);
    let here = trial.render(&VIEW, &format!("{}{FLOOR}", things(1.0)), &how)?;
    // The move to the camera is made in double precision: 1e9 units have steps of 1e-7.
    for (place, allowed) in [(1e6, 1e-4), (-1e6, 1e-4), (1e9, 1e-4)] {
        let shot = Shot { from: VIEW.from.map(|x| x + place), to: VIEW.to.map(|x| x + place), ..VIEW };
        let world = format!("Translate {place:e} {place:e} {place:e}\n{}{FLOOR}", things(1.0));
        let image = trial.render(&shot, &world, &how)?;
        trial.equal(
            &format!("relative RMSE at {place:e}"),
            image.apart(1.0, &here),
            0.0,
            allowed,
            "invariance, but for steps of double precision",
        );
    }
    Ok(())
}
