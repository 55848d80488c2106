//! What a render says to a farm: JSON lines and nothing else on the error output, Open Job Description's lines on the standard output.

use serde_json::Value;

use crate::program::{Folder, LAMP, Run};

fn lamp(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("lamp.pbrt", LAMP);
    folder
}

/// The error output, every line of which must be an object with a time, a level and a message.
#[track_caller]
fn lines(run: &Run) -> Vec<Value> {
    let parse = |line: &str| -> Value {
        let value: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        let time = value["time"].as_str().unwrap_or_default();
        humantime::parse_rfc3339(time).unwrap_or_else(|error| panic!("{error}: {line}"));
        assert!(time.len() == "2026-01-02T03:04:05.678Z".len() && time.ends_with('Z'), "{line}");
        assert!(["info", "warning", "error"].contains(&value["level"].as_str().unwrap_or_default()), "{line}");
        assert!(value["message"].as_str().is_some_and(|text| !text.is_empty()), "{line}");
        value
    };
    run.err.lines().map(parse).collect()
}

const JSON: [&str; 2] = ["--log-format", "json"];

fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["render"], more, &JSON].concat()
}

#[test]
fn all_that_is_said_is_json() {
    let folder = lamp("json");
    folder.write("odd.pbrt", LAMP.replace("\"float fov\" 40", "\"float fov\" 40 \"float odd\" 1"));
    let run = folder.run(&render(&["odd.pbrt", "-o", "out.exr", "--spp", "16"])).code(0);
    assert_eq!(run.out, "");
    let said = lines(&run);
    let warning = said.iter().find(|line| line["level"] == "warning").expect("the warning");
    assert_eq!((&warning["file"], warning["line"].as_u64()), (&Value::from("odd.pbrt"), Some(2)), "{warning}");
    assert!(warning["column"].as_u64() > Some(1) && warning["message"].to_string().contains("odd"), "{warning}");
    let progress: Vec<&Value> = said.iter().filter(|line| line["progress"].is_number()).collect();
    assert!(progress.iter().all(|line| line["samplesPerPixel"].is_number()), "{}", run.err);
    assert_eq!(progress.last().expect("progress")["progress"], 1.0, "{}", run.err);
    let last = said.last().expect("a line");
    assert_eq!((&last["output"], &last["warnings"]), (&Value::from("out.exr"), &Value::from(1)), "{last}");
    for number in ["seconds", "cpuSeconds", "peakMemory", "samplesPerPixel"] {
        assert!(last[number].as_f64() > Some(0.0), "{number}: {last}");
    }
    assert!(said.iter().all(|line| line.get("frame").is_none()), "there is no sequence");
    // Errors have their place, and their frame of text is gone.
    folder.write("bad.pbrt", LAMP.replace("\"float radius\" 0.5", "\"float radius\" [0.5 \"a\"]"));
    let run = folder.run(&render(&["bad.pbrt", "--quiet"])).code(3);
    let said = lines(&run);
    assert_eq!(said.len(), 1, "{}", run.err);
    assert_eq!((&said[0]["level"], &said[0]["file"]), (&Value::from("error"), &Value::from("bad.pbrt")), "{}", run.err);
    assert_eq!(said[0]["line"], 9, "{}", run.err);
    let run = folder.run(&render(&["lamp.pbrt", "-o", "no/such/folder/a.exr"])).code(1);
    let said = lines(&run);
    assert!(said.len() == 1 && said[0]["level"] == "error" && said[0].get("file").is_none(), "{}", run.err);
}

#[test]
fn an_interrupted_render_says_json_too() {
    let folder = lamp("json-interrupted");
    let running = folder.start(&render(&["lamp.pbrt", "-o", "out.exr", "--spp", "100000000", "--exit-at", "300ms"]));
    let run = running.end().code(130);
    let said = lines(&run);
    let last = said.last().expect("a line");
    assert_eq!((&last["interrupted"], &last["output"]), (&Value::from(true), &Value::from("out.exr")), "{}", run.err);
    assert!(said.iter().any(|line| line["message"].to_string().contains("--resume")), "{}", run.err);
    let left = said.iter().filter_map(|line| line["secondsLeft"].as_f64()).next_back();
    assert!(left.is_none_or(|left| left > 10.0), "{}", run.err);
}

#[test]
fn text_counts_its_warnings() {
    let folder = lamp("counted");
    folder.write("odd.pbrt", LAMP.replace("\"float fov\" 40", "\"float fov\" 40 \"float odd\" 1 \"float odder\" 1"));
    folder.run(&["render", "odd.pbrt", "-o", "out.exr"]).code(0).says(", 2 warnings");
    let run = folder.run(&["render", "lamp.pbrt", "-o", "out.exr"]).code(0);
    assert!(!run.err.contains("warning"), "{}", run.err);
    // What only rendering finds out is said once.
    let image = image::RgbImage::from_fn(300, 200, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    image.save(folder.path("wall.png")).expect("the image can be written");
    let whole = folder.read("wall.png");
    folder.write("wall.png", &whole[..whole.len() / 2]);
    let texture = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wall.png\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n";
    folder.write("late.pbrt", LAMP.replace("Material \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]\n", texture));
    let run =
        folder.run(&["render", "late.pbrt", "-o", "out.exr", "--texture-memory", "1kB"]).code(0).says(", 1 warning");
    assert_eq!(run.err.matches("cannot read wall.png").count(), 1, "{}", run.err);
}

#[test]
fn open_job_description_is_told_how_far_it_is() {
    let folder = lamp("openjd");
    let openjd = ["--progress", "openjd"];
    let run = folder.run(&[&["render", "lamp.pbrt", "-o", "out.exr"], &openjd[..]].concat()).code(0);
    let told: Vec<&str> = run.out.lines().collect();
    assert!(
        told.iter().all(|line| line.starts_with("openjd_progress: ") || line.starts_with("openjd_status: ")),
        "{}",
        run.out
    );
    let percents: Vec<f64> = told
        .iter()
        .filter_map(|line| line.strip_prefix("openjd_progress: "))
        .map(|number| number.parse().expect("a number"))
        .collect();
    assert!(percents.is_sorted() && percents.last() == Some(&100.0) && percents.len() <= 2, "{}", run.out);
    assert!(run.err.contains("4 spp in") && !run.err.contains("openjd"), "{}", run.err);
    // Over seconds: two lines a second.
    let long = ["render", "lamp.pbrt", "-o", "out.exr", "--spp", "100000000", "--exit-at", "2500ms", "--quiet"];
    let run = folder.run(&[&long[..], &openjd].concat()).code(130);
    assert!((2..=8).contains(&run.out.lines().count()), "{}", run.out);
    // Whatever ends it with an error, also before there is anything to render.
    for (arguments, code, why) in [
        (&["render", "gone.pbrt"][..], 3, "gone.pbrt"),
        (&["render", "lamp.pbrt", "-o", "no/such/folder/a.exr"], 1, "no/such/folder"),
        (&["render", "lamp.pbrt", "-o", "out.exr", "--memory-limit", "1MB"], 4, "--memory-limit"),
    ] {
        let run = folder.run(&[arguments, &openjd].concat()).code(code);
        let told: Vec<&str> = run.out.lines().collect();
        assert!(told.len() == 1 && told[0].starts_with("openjd_fail: ") && told[0].contains(why), "{}", run.out);
    }
}

#[test]
fn progress_is_as_asked_for() {
    let folder = lamp("progress");
    for (how, some) in [("off", false), ("lines", true), ("auto", true), ("bar", false)] {
        let run = folder.run(&["render", "lamp.pbrt", "-o", "out.exr", "--progress", how]).code(0);
        assert_eq!(run.err.contains("100 %"), some, "{how}: {}", run.err);
        assert!(run.err.contains("4 spp in"), "{how}: {}", run.err);
    }
    folder.run(&["render", "lamp.pbrt", "--progress", "loud"]).code(2).says("--progress");
    folder.run(&["render", "lamp.pbrt", "--log-format", "xml"]).code(2).says("--log-format");
}
