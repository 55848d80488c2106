//! The stability suite's quick cases, and that its verdicts can be failures.
//!
//! All comparisons of the suite together fail by chance with a probability of at most 1e-4 (`stability::case`); seeds are fixed.

use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::program::Folder;
use lanternfish::film::{Film, FilmSettings, PixelBounds, PixelFilter, PixelSamples, SampleResult, Sensor};
use lanternfish::math::Rgb;
use lanternfish::stability::case::{Measured, Stop, Trial};
use lanternfish::stability::report::{line, repeat};
use lanternfish::stability::run::{CaseReport, Limits, Verdict, run};
use lanternfish::stability::scene::{DOME, How, Shot};
use lanternfish::stability::{Case, cases};

fn limits() -> Limits {
    Limits { threads: 2, ..Limits::default() }
}

#[test]
fn quick_cases_pass() {
    #[cfg(feature = "openvdb")]
    openvdb::set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    let reports: Vec<CaseReport> = cases().filter(|case| case.is_quick()).map(|case| run(case, limits())).collect();
    reports.iter().for_each(|report| println!("{}", line(report)));
    assert!(reports.len() > 20, "only {} cases are quick", reports.len());
    let wrong: Vec<String> = reports.iter().filter(|r| r.verdict == Verdict::Fail).map(line).collect();
    assert!(wrong.is_empty(), "{} cases fail:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn cases_have_names_of_their_own() {
    let names: BTreeSet<&str> = cases().map(|case| case.name).collect();
    assert_eq!(names.len(), cases().count());
    for case in cases() {
        assert!(case.name.contains('.') && !case.group().is_empty(), "{}", case.name);
        assert!(case.checks.ends_with('.') && case.seconds > 0.0, "{}", case.name);
    }
}

/// A case that does this.
fn case(run: fn(&mut Trial) -> Result<(), Stop>) -> Case {
    Case { name: "test.case", checks: "What a test wants.", seconds: 1.0, known: None, run }
}

const SHOT: Shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 30.0, size: 4, depth: 1 };
const FLOOR: &str =
    "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Shape \"disk\" \"float height\" 2 \"float radius\" 9\n";

/// The mean of a floor of reflectance 0.5 under a white sky, which is 0.5.
fn floor(trial: &mut Trial) -> Result<Measured, Stop> {
    Ok(trial.render(&SHOT, &format!("{DOME}{FLOOR}"), &How::spp(64))?.mean())
}

#[test]
fn a_wrong_expectation_fails() {
    let right = case(|trial| {
        let got = floor(trial)?;
        trial.expect("the floor", got, 0.5, 0.05, "ρ");
        Ok(())
    });
    let report = run(&right, limits());
    assert_eq!(report.verdict, Verdict::Pass, "{}", line(&report));
    let error = report.rows[0].error.expect("it is sampled");
    assert!(error > 0.0 && report.rows[0].allowed < 6.0 * error, "{report:?}");
    let wrong = case(|trial| {
        let got = floor(trial)?;
        trial.expect("the floor", got, 0.6, 0.05, "a wrong idea of ρ");
        trial.expect("the floor", got, 0.5, 0.05, "ρ");
        Ok(())
    });
    let report = run(&wrong, limits());
    assert_eq!(report.verdict, Verdict::Fail);
    assert_eq!(report.worst().map(|row| row.source.as_str()), Some("a wrong idea of ρ"));
    assert!(line(&report).contains("expected 0.6"), "{}", line(&report));
    let words = repeat(&report, "out".as_ref());
    assert!(
        words.contains("stability --case test.case") && words.contains("render out/scenes/test.case/1.pbrt"),
        "{words}"
    );
    // The same as a known fault does not fail the suite; but a fault that is gone must be taken off the list.
    let known = |case: Case| run(&Case { known: Some("a reason"), ..case }, limits());
    assert_eq!(known(wrong).verdict, Verdict::Known);
    assert_eq!(known(right).verdict, Verdict::Fail);
}

#[test]
fn what_says_nothing_fails() {
    let vague = case(|trial| {
        let got = floor(trial)?;
        trial.expect("the floor", got, 0.5, 1e-6, "ρ");
        Ok(())
    });
    let report = run(&vague, limits());
    assert_eq!(report.verdict, Verdict::Fail);
    assert!(report.rows[0].note.contains("too large"), "{report:?}");
    let nothing = run(&case(|_| Ok(())), limits());
    assert_eq!((nothing.verdict, nothing.reason.as_deref()), (Verdict::Fail, Some("it compared nothing")));
    let not_a_number = case(|trial| {
        trial.equal("a number", f64::NAN, 1.0, 1.0, "none");
        trial.mean("a mean", Measured { mean: 1.0, error: f64::NAN }, 1.0, 1.0, 1.0, "none");
        Ok(())
    });
    let report = run(&not_a_number, limits());
    assert!(report.verdict == Verdict::Fail && report.rows.iter().all(|row| !row.passes), "{report:?}");
    let absent = run(&case(|_| Err(Stop::Skipped("of no reason".into()))), limits());
    assert_eq!((absent.verdict, absent.reason.as_deref()), (Verdict::Skipped, Some("of no reason")));
    let unreadable = case(|trial| trial.render(&SHOT, "Shape 7", &How::spp(1)).map(|_| ()));
    assert_eq!(run(&unreadable, limits()).verdict, Verdict::Fail);
}

/// One sample that is not finite fails a case in which all else is well, and where it is is told.
#[test]
fn a_sample_that_is_not_finite_fails() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        // Closures that capture nothing are functions: each kind of number has its own.
        let run_with: fn(&mut Trial) -> Result<(), Stop> = match bad {
            x if x.is_nan() => |trial| with_one(trial, f32::NAN),
            x if x > 0.0 => |trial| with_one(trial, f32::INFINITY),
            _ => |trial| with_one(trial, f32::NEG_INFINITY),
        };
        let report = run(&case(run_with), limits());
        assert_eq!(report.verdict, Verdict::Fail, "{bad}");
        let faults: Vec<_> = report.rows.iter().filter(|row| !row.passes).collect();
        assert_eq!((faults.len(), faults[0].got, faults[0].note.as_str()), (1, 1.0, "--replay 2,1,1"), "{bad}");
    }
}

fn with_one(trial: &mut Trial, bad: f32) -> Result<(), Stop> {
    trial.equal("what is well", 1.0, 1.0, 0.0, "itself");
    let filter = PixelFilter::Box { radius: glam::Vec2::splat(0.5) };
    let bounds = PixelBounds::full(4, 4);
    let settings =
        FilmSettings { resolution: [4, 4], bounds, filename: None, sensor: Sensor::default(), filter, gbuffer: None };
    let mut film = Film::new(settings, true);
    let mut samples = PixelSamples::new(Sensor::default());
    samples.add(0, &SampleResult::default());
    samples.add(1, &SampleResult { beauty: Rgb::new(0.0, bad, 0.0), ..SampleResult::default() });
    film.tiles_mut()[0].merge([2, 1], &samples);
    trial.accept("a film", &film);
    Ok(())
}

#[test]
fn hangs_and_panics_are_verdicts() {
    let brief = Limits { time: Duration::from_millis(300), ..limits() };
    let long = case(|trial| trial.render(&SHOT, &format!("{DOME}{FLOOR}"), &How::spp(1 << 30)).map(|_| ()));
    let report = run(&long, brief);
    assert_eq!(report.verdict, Verdict::Fail);
    assert!(report.reason.as_deref().is_some_and(|reason| reason.contains("not done")), "{report:?}");
    let listens = case(|trial| {
        trial.equal("what came before", 1.0, 1.0, 0.0, "itself");
        while !trial.interrupt.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(Stop::Interrupted)
    });
    assert_eq!(run(&listens, brief).rows.len(), 1, "what came before is kept");
    // One that does not listen is left behind.
    let deaf = case(|_| {
        std::thread::sleep(Duration::from_secs(60));
        Ok(())
    });
    let report = run(&deaf, brief);
    assert!(report.verdict == Verdict::Fail && report.seconds < 30.0, "{report:?}");
    let panics = run(&case(|_| panic!("on purpose")), limits());
    assert_eq!((panics.verdict, panics.reason.as_deref()), (Verdict::Fail, Some("it panicked: on purpose")));
}

#[test]
fn the_program_runs_cases() {
    let folder = Folder::new("stability");
    let run = folder.run(&["stability", "--list"]).code(0);
    assert_eq!(run.out.lines().count(), cases().count());
    folder.run(&["stability"]).code(2);
    let run = folder.run(&["stability", "--case", "film.offset", "--case", "film.none", "--out", "o"]).code(2);
    run.says("no case is called \"film.none\"").says("film.offset");
    let run = folder.run(&["stability", "--case", "film.offset", "--case", "film.layers", "--out", "o"]).code(0);
    assert!(run.out.contains("film.offset") && run.out.contains("2 pass"), "{}", run.out);
    let read = |name: &str| std::fs::read_to_string(folder.path("o").join(name)).expect(name);
    let json: serde_json::Value = serde_json::from_str(&read("stability.json")).expect("JSON");
    assert_eq!(json["cases"].as_array().map(Vec::len), Some(2));
    assert_eq!(json["cases"][0]["verdict"], "pass");
    let rows: usize =
        json["cases"].as_array().into_iter().flatten().filter_map(|c| c["rows"].as_array()).map(Vec::len).sum();
    assert_eq!(read("stability.csv").lines().count(), rows + 1);
    let page = read("stability.html");
    assert!(
        page.contains("film.layers") && page.matches("<tr").count() == rows + 3 && !page.contains("src="),
        "{page}"
    );
    // Known faults do not fail the suite, and cases out of time do; their scenes are kept.
    let run = folder.run(&["stability", "--case", "range.million", "--time-limit", "0.01", "--out", "o"]).code(1);
    assert!(
        run.out.contains("not done after") && run.out.contains("to repeat it: lanternfish stability"),
        "{}",
        run.out
    );
    assert!(folder.path("o/scenes/range.million/1.pbrt").exists());
}
