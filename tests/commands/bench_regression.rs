//! A small benchmark with fixed seeds that must come out as it did: means that are the reference's, ratios of errors at equal samples. Nothing
//! here depends on how fast the machine is; its table of ratios, times among them, is printed whether or not all is well.

use std::io::Write;
use std::process::Command;

use crate::program::{Folder, PROGRAM};
use serde_json::Value;

/// How many times half of its 95 % interval a mean may be off: with six runs more has a probability of 1e-3 (6.87 over 2.57 standard errors by Student's
/// t), of at most 1e-2 for the two means of all five methods. The seeds are fixed: that is the chance that a change of the random numbers raises
/// a false alarm, not that of a run. A bias of 5 % of what cache points gather is seen, one of 10 % of what is scattered by haze.
const DOUBT: f64 = 2.7;

/// Half of the 95 % interval of a mean may be this share of it: a check that sees nothing is none.
const BLIND: f64 = 0.12;

/// Scene, method, and how many times the RMSE of gathered light of the scene's first method its own must be at least. They were 6.5, 3.0 and 2.9
/// when this was written, within a tenth of that.
const RATIOS: [(&str, &str, f64); 3] =
    [("small-rooms", "uniform", 4.0), ("small-rooms", "tree", 1.8), ("small-godrays", "null", 1.8)];

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn curves(scene: &Value) -> Vec<Value> {
    scene["curves"].as_array().expect("curves").clone()
}

/// The geometric mean over the runs with most samples, of gathered light.
fn rmse(curve: &Value) -> f64 {
    let points = curve["points"].as_array().expect("points");
    number(&points.last().expect("a point")["gathered_rmse"]["value"])
}

#[test]
fn the_small_suite_comes_out_as_it_did() {
    let folder = Folder::new("bench-regression");
    // It takes a minute, longer than other runs may.
    let mut command = Command::new(PROGRAM);
    command.args(["bench", "--suite", "small", "--out", "out"]).current_dir(folder.path(""));
    let run = command.output().expect("the program runs");
    // Past the harness, which keeps what tests print to itself.
    let _ = std::io::stderr().lock().write_all(&run.stdout);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));

    let report = folder.json("out/results.json");
    let scenes = report["scenes"].as_array().expect("scenes").clone();
    assert_eq!(scenes.len(), 2);
    for scene in &scenes {
        for curve in curves(scene) {
            let name = format!("{}, {}", scene["name"], curve["method"]["name"]);
            for which in ["bias", "gathered_bias"] {
                let [value, half] = ["value", "half_width"].map(|key| number(&curve[which][key]));
                assert!(half < BLIND, "{name}, {which}: the mean is known to {half} only");
                assert!(value.abs() <= DOUBT * half, "{name}, {which}: the mean is off by {value} ± {half}");
            }
        }
    }
    for (scene, method, least) in RATIOS {
        let scene = scenes.iter().find(|found| found["name"] == scene).expect(scene);
        let curves = curves(scene);
        let curve = curves.iter().find(|curve| curve["method"]["name"] == method).expect(method);
        let ratio = rmse(curve) / rmse(&curves[0]);
        assert!(ratio >= least, "{method}: {ratio} times the error, less than {least}");
    }
}
