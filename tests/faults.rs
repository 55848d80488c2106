//! Deliberate faults (`system::fault`), and what catches each: a case of the stability suite that passes without it. Needs the feature `faults`.

#![cfg(feature = "faults")]

use std::process::Command;

/// A fault and a case that catches it.
const CAUGHT: [(&str, &str); 13] = [
    ("dropped-cosine", "lights.needle"),
    ("half-bsdf-pdf", "lights.touching"),
    ("certain-light", "geometry.sliver-room"),
    ("single-precision-sums", "film.accumulation"),
    ("no-offset", "geometry.far"),
    ("free-roulette", "geometry.deep-paths"),
    ("colourless-null", "media.colours"),
    ("no-density-limit", "media.nearly-white"),
    ("mirrored-phase", "media.lobes"),
    ("low-majorant", "media.gradient"),
    ("fire-twice", "media.fire"),
    ("points-alone", "media.lobes"),
    ("not-a-number", "media.gradient"),
];

/// Whether a case passes; without an answer the test fails.
fn passes(case: &str, fault: Option<&str>) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish"));
    command.args(["stability", "--case", case, "--out"]).arg(folder.path());
    command.env_remove("LANTERNFISH_FAULT");
    if let Some(fault) = fault {
        command.env("LANTERNFISH_FAULT", fault);
    }
    let output = command.output().expect("it starts");
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    println!("{fault:?}: {text}");
    match output.status.code() {
        Some(0) => true,
        Some(1) => false,
        code => panic!("{case} with {fault:?} ended with {code:?}: {text}"),
    }
}

#[test]
fn cases_that_catch_faults_pass_without() {
    let mut cases = CAUGHT.map(|(_, case)| case).to_vec();
    cases.sort_unstable();
    cases.dedup();
    let failing: Vec<_> = cases.into_iter().filter(|case| !passes(case, None)).collect();
    assert!(failing.is_empty(), "{failing:?}");
}

#[test]
fn every_fault_is_caught() {
    let missed: Vec<_> = CAUGHT.into_iter().filter(|(fault, case)| passes(case, Some(fault))).collect();
    assert!(missed.is_empty(), "{missed:?}");
}
