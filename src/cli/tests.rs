//! Tests of arguments and messages.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{CommandFactory, Parser};

use super::diagnostics::{render_error, warning_lines};
use super::*;
use crate::geometry::Backend;
use crate::render::{Budget, LightSelection, PngOutput, RenderSettings};
use crate::scene::{FileId, SceneError, Sources, Span, Warnings};

fn settings(flags: &str) -> Result<RenderSettings, clap::Error> {
    let words = ["lanternfish", "render"].into_iter().chain(flags.split_whitespace());
    match Arguments::try_parse_from(words)?.command {
        Command::Render(arguments) => Ok(arguments.settings()),
        other => panic!("{other:?} is not a render"),
    }
}

#[test]
fn the_grammar_is_sound() {
    Arguments::command().debug_assert();
}

#[test]
fn flags_become_settings() {
    let all = settings(
        "a.pbrt -o b.exr --png c.png --spp 64 --seed 9 --threads 3 --lights optimal --backend native --max-depth 7 \
         --resolution 320x200 --crop 0,0.5,0.25,1 --stats s.json --strict --quiet",
    )
    .expect("valid");
    assert_eq!(all.budget, Budget::Samples(64));
    assert_eq!((all.seed, all.threads, all.max_depth), (Some(9), Some(3), Some(7)));
    assert_eq!((all.lights, all.backend), (LightSelection::Optimal, Some(Backend::Native)));
    assert_eq!(all.film.resolution, Some([320, 200]));
    assert_eq!(all.film.crop, Some([0.0, 0.5, 0.25, 1.0]));
    assert_eq!(all.png, Some(PngOutput::File("c.png".into())));
    assert!(all.strict && all.quiet);
    let tree = settings("a.pbrt --lights tree --splitting 0.7").expect("valid");
    assert_eq!((tree.lights, tree.splitting), (LightSelection::Tree, Some(0.7)));
    assert_eq!(settings("a.pbrt").expect("valid"), RenderSettings::default());
    assert_eq!(settings("a.pbrt --png").expect("valid").png, Some(PngOutput::Beside));
    assert_eq!(settings("a.pbrt --time 1.5").expect("valid").budget, Budget::Time(Duration::from_millis(1500)));
    assert_eq!(settings("a.pbrt --error 0.01").expect("valid").budget, Budget::Error(0.01));
}

#[test]
fn options_of_a_selector_that_was_not_asked_for_are_named() {
    let all = "--splitting 0.5 --cache-visibility off --cache-gathering lists --cache-no-refining --cache-no-rehearsal --cache-no-normals --cache-no-alike --cache-no-near-clusters --cache-no-beams \
               --cache-entries 8 --cache-candidates 99";
    let ignored = |flags: &str| {
        let mut warnings = Warnings::default();
        settings(&format!("a.pbrt {flags}")).expect("valid").warn_ignored(&mut warnings);
        warnings.list().iter().map(|warning| warning.message.clone()).collect::<Vec<_>>()
    };
    let splitting = "--splitting is ignored: only --lights tree uses it";
    for lights in ["auto", "cache-points"] {
        assert_eq!(ignored(&format!("--lights {lights} {all}")), [splitting], "{lights}");
    }
    for lights in ["uniform", "power", "optimal", "tree"] {
        let found = ignored(&format!("--lights {lights} {all}"));
        assert_eq!(found.contains(&splitting.to_owned()), lights != "tree", "{found:?}");
        for option in [
            "visibility",
            "gathering",
            "no-refining",
            "no-rehearsal",
            "no-normals",
            "no-alike",
            "no-near-clusters",
            "no-beams",
            "entries",
            "candidates",
        ] {
            let expected = format!("--cache-{option} is ignored: only --lights cache-points uses it");
            assert!(found.contains(&expected), "{lights}: {found:?}");
        }
        assert_eq!(ignored(&format!("--lights {lights} --cache-entries 128")), [""; 0]);
    }
}

#[test]
fn wrong_usage_is_refused_with_exit_code_2() {
    for flags in [
        "",
        "a.pbrt --spp 0",
        "a.pbrt --spp 4 --time 3",
        "a.pbrt --time 3 --error 0.1",
        "a.pbrt --time -1",
        "a.pbrt --time inf",
        "a.pbrt --error nan",
        "a.pbrt --threads 0",
        "a.pbrt --lights bright",
        "a.pbrt --splitting 1.5",
        "a.pbrt --splitting nan",
        "a.pbrt --resolution 0x10",
        "a.pbrt --resolution 10",
        "a.pbrt --crop 0,1,0",
        "a.pbrt --crop 0.5,0.5,0,1",
        "a.pbrt --crop 0,2,0,1",
        "a.pbrt b.pbrt",
        "a.pbrt --nonsense",
    ] {
        let error = settings(flags).expect_err(flags);
        assert_eq!(error.exit_code(), ExitStatus::Usage as i32, "{flags}");
    }
}

#[test]
fn output_names_follow_the_scene() {
    let default = RenderSettings { png: Some(PngOutput::Beside), ..RenderSettings::default() };
    let scene = Path::new("/scenes/lamps.pbrt.gz");
    assert_eq!(default.output_path(scene, None), PathBuf::from("lamps.exr"));
    assert_eq!(default.output_path(scene, Some("out/lamps.png")), PathBuf::from("out/lamps.exr"));
    let output = RenderSettings { output: Some("x.exr".into()), ..default.clone() }.output_path(scene, Some("y.exr"));
    assert_eq!((default.png_path(&output), output), (Some("x.png".into()), "x.exr".into()));
}

fn sources(text: &str) -> Sources {
    let mut sources = Sources::default();
    sources.add("room.pbrt", text);
    sources
}

fn at(line: u32, column: u32, length: u32) -> Span {
    Span { file: FileId(0), line, column, length }
}

#[test]
fn errors_show_the_place() {
    let sources = sources("WorldBegin\nShape \"sphäre\" \"float radius\" [ 1 ]\nWorldEnd\n");
    let error = SceneError::at(at(2, 7, 9), SceneErrorKind::Undefined("no shape \"sphäre\"".into())).help("try sphere");
    let text = render_error(&error, &sources, false);
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    assert_eq!(lines[0], "error: no shape \"sphäre\"", "{text}");
    assert_eq!(lines[1].trim(), "--> room.pbrt:2:7", "{text}");
    let excerpt = lines.iter().position(|l| l.starts_with("2 |")).expect("the line is shown");
    let column = lines[excerpt].chars().position(|c| c == '"').expect("a quote");
    let carets: Vec<usize> =
        lines[excerpt + 1].chars().enumerate().filter(|(_, c)| *c == '^').map(|(i, _)| i).collect();
    assert_eq!(carets, (column..column + 8).collect::<Vec<_>>(), "{text}");
    assert!(text.contains("help: try sphere") && !text.contains("WorldBegin"), "{text}");
    assert!(!text.contains('\u{1b}'), "no colour unless asked");
    assert!(render_error(&error, &sources, true).contains('\u{1b}'));
}

#[test]
fn excerpts_of_huge_lines_stay_short_and_odd_spans_do_no_harm() {
    let line = "0.125 ".repeat(200_000);
    let sources = sources(&line);
    let error = SceneError::at(at(1, 600_001, 5), SceneErrorKind::Syntax("odd".into()));
    let text = render_error(&error, &sources, false);
    assert!(text.len() < 1000 && text.contains("room.pbrt:1:600001"), "{text}");
    for (line, column, length) in [(1, 0, 0), (1, u32::MAX, u32::MAX), (99, 5, 5), (1, 1, u32::MAX), (2, 1, 1)] {
        let error = SceneError::at(at(line, column, length), SceneErrorKind::Syntax("odd".into()));
        assert!(render_error(&error, &sources, false).starts_with("error: odd"));
    }
    let mut multibyte = Sources::default();
    multibyte.add("u", "äöü€𝄞");
    for column in 0..20 {
        let error = SceneError::at(at(1, column, 1), SceneErrorKind::Syntax("odd".into()));
        render_error(&error, &multibyte, false);
    }
}

#[test]
fn warnings_are_lines() {
    let sources = sources("x");
    let mut warnings = Warnings::default();
    warnings.add(Some(at(3, 4, 1)), "first");
    (0..99).for_each(|i| warnings.add(None, format!("number {i}")));
    let lines = warning_lines(&warnings, &sources);
    assert_eq!((lines[0].as_str(), lines[1].as_str()), ("warning: room.pbrt:3:4: first", "warning: number 0"));
    assert_eq!(lines.len(), 100);
}

#[test]
fn limits_bad_input_and_faults_of_the_system_end_differently() {
    assert_eq!(ExitStatus::from(&SceneErrorKind::System(String::new())) as u8, 1);
    assert_eq!(ExitStatus::from(&SceneErrorKind::Limit(String::new())) as u8, 4);
    assert_eq!(ExitStatus::from(&SceneErrorKind::Syntax(String::new())) as u8, 3);
}
