//! Tests of scripts by running them: with a program that writes down what it was asked for, and without a cluster.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::slurm::{SlurmOptions, lesson_script, merge_script, render_script};
use super::*;

/// A name with all that shells, `sbatch` and templates could stumble over.
const AWKWARD: &str = "it's a \"shot\" $HOME `id` 50% {{Param.X}} & ; * ? ~ é";

/// A folder with an awkward name, and programs in it that only take notes.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().expect("a folder") };
        for folder in ["parts", "bin"] {
            std::fs::create_dir_all(place.path(folder)).expect("a folder");
        }
        // Notes its arguments, a line each, and writes the file that it is to write.
        place.program(
            "renderer",
            "for word; do printf '%s\\n' \"$word\"; done >>\"$NOTES\"\necho end >>\"$NOTES\"\n\
             while [ $# -gt 0 ]; do [ \"$1\" != -o ] || : >\"$2\"; shift; done\n",
        );
        place.program("bin/scontrol", "echo \"$@\" >>\"$NOTES\"\n");
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(AWKWARD).join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().expect("UTF-8").to_owned()
    }

    fn program(&self, name: &str, text: &str) {
        let path = self.path(name);
        std::fs::write(&path, format!("#!/bin/sh\n{text}")).expect("written");
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).expect("set");
    }

    fn job(&self, parts: u32, frames: Option<RangeInclusive<i32>>, frames_per_task: u32) -> FarmJob {
        let job = FarmJob {
            program: self.text("renderer"),
            scene: self.text("scene.##.pbrt"),
            output: self.text("a-####-b.exr"),
            folder: self.text("").trim_end_matches('/').to_owned(),
            working_folder: self.text(""),
            parts,
            frames,
            frames_per_task,
            teaches: false,
            keep_parts: false,
            options: vec!["--spp".to_owned(), AWKWARD.to_owned()],
            png: None,
        };
        job.check().expect("it is right");
        job
    }

    /// `sh` with a script, as Slurm would start it for a task.
    fn task(&self, script: &str, index: u64, restarts: u32) -> Command {
        let path = self.path("script.sh");
        std::fs::write(&path, script).expect("written");
        let mut command = Command::new("sh");
        let programs = format!("{}:{}", self.text("bin"), std::env::var("PATH").unwrap_or_default());
        command.arg(&path).env("PATH", programs).env("NOTES", self.path("notes"));
        command.env("SLURM_ARRAY_TASK_ID", index.to_string()).env("SLURM_ARRAY_JOB_ID", "77");
        command.env("SLURM_RESTART_COUNT", restarts.to_string());
        for name in ["SLURM_MEM_PER_NODE", "SLURM_MEM_PER_CPU", "SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE"] {
            command.env_remove(name);
        }
        command.stdin(Stdio::null()).stderr(Stdio::null());
        command
    }

    /// What the programs have noted since the last time, a list of lines for each run.
    fn notes(&self) -> Vec<Vec<String>> {
        let text = std::fs::read_to_string(self.path("notes")).unwrap_or_default();
        let _ = std::fs::remove_file(self.path("notes"));
        text.split_terminator("end\n").map(|run| run.lines().map(str::to_owned).collect()).collect()
    }
}

/// The word behind `name`.
fn after<'a>(words: &'a [String], name: &str) -> Option<&'a str> {
    words.iter().position(|word| word == name).map(|at| words[at + 1].as_str())
}

fn is_shell(text: &str) {
    let mut child = Command::new("sh").args(["-n", "/dev/stdin"]).stdin(Stdio::piped()).spawn().expect("sh is there");
    std::io::Write::write_all(&mut child.stdin.take().expect("a pipe"), text.as_bytes()).expect("written");
    assert!(child.wait().expect("it ends").success(), "{text}");
}

#[test]
fn every_part_of_every_frame_is_rendered_once_and_merged_once() {
    let place = Place::new();
    let options = SlurmOptions::default();
    for (parts, frames, per_task) in [
        (1, None, 1),
        (3, None, 1),
        (1, Some(8..=12), 2),
        (3, Some(-1..=1), 1),
        (2, Some(7..=11), 3),
        (2, Some(-3..=-3), 4),
    ] {
        let job = place.job(parts, frames.clone(), per_task);
        let script = render_script(&job, &options).expect("a script");
        is_shell(&script);
        assert!(script.contains(&format!("#SBATCH --array=0-{}\n", job.tasks() - 1)), "{script}");
        let mut rendered = BTreeMap::new();
        for index in 0..job.tasks() {
            let status = place.task(&script, index, 0).status().expect("sh is there");
            assert!(status.success());
            let [words] = &place.notes()[..] else { panic!("one render a task") };
            assert_eq!(words[..3], ["render", job.scene.as_str(), "--recover"]);
            assert_eq!(after(words, "--spp"), Some(AWKWARD));
            assert_eq!(after(words, "--threads"), Some("1"));
            let part = after(words, "--part").map(|text| text.split_once('/').expect("K/N"));
            assert_eq!(part.map(|(_, of)| of.to_owned()), (parts > 1).then(|| parts.to_string()));
            let part = part.map_or("1", |(k, _)| k).to_owned();
            let name = if parts > 1 {
                place.text(&format!("parts/a-####-b.{part}-of-{parts}.exr"))
            } else {
                job.output.clone()
            };
            assert_eq!(after(words, "-o"), Some(name.as_str()));
            let range = words.iter().find_map(|word| word.strip_prefix("--frames="));
            let numbers = match range.map(|text| text.split_once("..").expect("A..B")) {
                Some((a, b)) => a.parse::<i32>().expect("a number")..=b.parse().expect("a number"),
                None => 0..=0,
            };
            assert_eq!(range.is_some(), frames.is_some());
            for frame in numbers {
                *rendered.entry((frame, part.clone())).or_insert(0) += 1;
            }
        }
        let expected = frames.clone().unwrap_or(0..=0);
        let expected: BTreeMap<_, _> =
            expected.flat_map(|frame| (1..=parts).map(move |part| ((frame, part.to_string()), 1))).collect();
        assert_eq!(rendered, expected, "{parts} {frames:?} {per_task}");

        let Some(script) = merge_script(&job, &options).expect("a script") else {
            assert_eq!(parts, 1);
            continue;
        };
        is_shell(&script);
        let number = |frame: i32| {
            frames.as_ref().map_or("####".to_owned(), |_| format!("{frame:0w$}", w = 4 + usize::from(frame < 0)))
        };
        let name = |frame: i32, part: u32| place.text(&format!("parts/a-{}-b.{part}-of-{parts}.exr", number(frame)));
        // What the renders would have written, with the numbers of frames in the names.
        std::fs::remove_dir_all(place.path("parts"))
            .and_then(|()| std::fs::create_dir(place.path("parts")))
            .expect("a folder");
        for frame in frames.clone().unwrap_or(0..=0) {
            (1..=parts).for_each(|part| std::fs::write(name(frame, part), "").expect("written"));
        }
        // The script's own file is where it says, and older than what it makes.
        std::fs::write(place.path("merge.sh"), &script).expect("written");
        let mut merged = vec![];
        for index in 0..job.chunks() {
            assert!(place.task(&script, index, 0).status().expect("sh is there").success());
            merged.extend(place.notes());
        }
        let expected: Vec<Vec<String>> = frames
            .clone()
            .unwrap_or(0..=0)
            .map(|frame| {
                let image = place.text(&format!("a-{}-b.exr", number(frame)));
                let parts = (1..=parts).map(|part| name(frame, part));
                ["merge".to_owned()].into_iter().chain(parts).chain(["-o".to_owned(), image]).collect()
            })
            .collect();
        assert_eq!(merged, expected);
        assert_eq!(std::fs::read_dir(place.path("parts")).expect("a folder").count(), 0, "parts are removed");
    }
}

#[test]
fn the_lesson_of_each_frame_comes_first_and_goes_with_its_parts() {
    let place = Place::new();
    let options = SlurmOptions::default();
    let png = Some(place.text("b-#.png"));
    let job = FarmJob { teaches: true, png, ..place.job(2, Some(7..=9), 2) };
    let lesson = lesson_script(&job, &options).expect("a script").expect("there is a lesson");
    let render = render_script(&job, &options).expect("a script");
    is_shell(&lesson);
    assert!(lesson.contains("#SBATCH --array=0-1\n"), "{lesson}");
    let learned = place.text("parts/a-####-b.lesson");
    for (index, frames) in [(0, "--frames=7..8"), (1, "--frames=9..9")] {
        assert!(place.task(&lesson, index, 0).status().expect("sh is there").success());
        let words = place.notes().concat();
        assert_eq!(after(&words, "--part"), Some("0/2"));
        assert_eq!(after(&words, "-o"), Some(place.text("parts/a-####-b.0-of-2.exr").as_str()));
        assert_eq!(after(&words, "--save-cache"), Some(learned.as_str()));
        assert_eq!(after(&words, "--spp"), Some(AWKWARD));
        assert!(words.contains(&frames.to_owned()) && words.contains(&"--recover".to_owned()), "{words:?}");
    }
    for (index, part, frames) in [(0, "1/2", "--frames=7..8"), (1, "2/2", "--frames=7..8"), (3, "2/2", "--frames=9..9")]
    {
        assert!(place.task(&render, index, 0).status().expect("sh is there").success());
        let words = place.notes().concat();
        assert_eq!(after(&words, "--part"), Some(part));
        assert_eq!(after(&words, "--load-cache"), Some(learned.as_str()));
        assert!(words.contains(&frames.to_owned()) && words.contains(&"--freeze-cache".to_owned()), "{words:?}");
    }
    let names = ["0-of-2.exr", "1-of-2.exr", "2-of-2.exr", "lesson"];
    let files = names.map(|name| place.text(&format!("parts/a-0009-b.{name}")));
    std::fs::remove_dir_all(place.path("parts"))
        .and_then(|()| std::fs::create_dir(place.path("parts")))
        .expect("a folder");
    files.iter().for_each(|file| std::fs::write(file, "").expect("written"));
    let script = merge_script(&job, &options).expect("a script").expect("two parts");
    std::fs::write(place.path("merge.sh"), &script).expect("written");
    assert!(place.task(&script, 1, 0).status().expect("sh is there").success());
    let [image, png] = ["a-0009-b.exr", "b-9.png"].map(|name| place.text(name));
    let outputs = ["-o".to_owned(), image, "--png".to_owned(), png];
    assert_eq!(place.notes(), [[&["merge".to_owned()], &files[..3], &outputs].concat()]);
    assert_eq!(std::fs::read_dir(place.path("parts")).expect("a folder").count(), 0);
    // One part learns for itself, and so do those that have another teacher.
    let none = |job: &FarmJob| lesson_script(job, &options).expect("right").is_none();
    assert!(none(&FarmJob { parts: 1, ..job.clone() }) && none(&FarmJob { teaches: false, ..job.clone() }));
    for (options, expected) in [("--load-cache=x", true), ("--spp 2", true), ("--spp 3", false), ("--spp=2", true)] {
        let options = options.split(' ').map(str::to_owned).collect();
        assert_eq!(none(&FarmJob { options, ..job.clone() }), expected);
    }
}

#[test]
fn parts_stay_where_merging_fails_or_they_are_to_be_kept() {
    let place = Place::new();
    let kept = |keep_parts, text: &str| {
        place.program("renderer", text);
        let job = FarmJob { keep_parts, ..place.job(2, None, 1) };
        let script = merge_script(&job, &SlurmOptions::default()).expect("a script").expect("two parts");
        for part in 1..=2 {
            std::fs::write(place.path(&format!("parts/a-####-b.{part}-of-2.exr")), "").expect("written");
        }
        let is_merged = place.task(&script, 0, 0).status().expect("sh is there").success();
        (is_merged, std::fs::read_dir(place.path("parts")).expect("a folder").count())
    };
    assert_eq!(kept(false, "exit 1"), (false, 2));
    assert_eq!(kept(true, "exit 0"), (true, 2));
    assert_eq!(kept(false, "exit 0"), (true, 0));
}

#[test]
fn a_merge_that_was_requeued_does_not_ask_for_parts_that_are_gone() {
    let place = Place::new();
    let job = place.job(2, Some(1..=2), 2);
    let script = merge_script(&job, &SlurmOptions::default()).expect("a script").expect("two parts");
    std::fs::write(place.path("merge.sh"), "").expect("written");
    std::thread::sleep(std::time::Duration::from_millis(20));
    // Frame 1 was merged and half of its parts removed.
    for name in ["a-0001-b.exr", "parts/a-0001-b.2-of-2.exr", "parts/a-0002-b.1-of-2.exr", "parts/a-0002-b.2-of-2.exr"]
    {
        std::fs::write(place.path(name), "").expect("written");
    }
    assert!(place.task(&script, 0, 1).status().expect("sh is there").success());
    let runs = place.notes();
    assert!(runs.len() == 1 && runs[0][1].contains("a-0002-b.1-of-2"), "{runs:?}");
    assert_eq!(std::fs::read_dir(place.path("parts")).expect("a folder").count(), 0);
    // An image from before this job does not stand for parts that are missing: the merge is asked for, and says so.
    std::thread::sleep(std::time::Duration::from_millis(20));
    std::fs::write(place.path("merge.sh"), "").expect("written");
    assert!(place.task(&script, 0, 0).status().expect("sh is there").success());
    assert_eq!(place.notes().len(), 2);
}

#[test]
fn what_was_stopped_or_killed_is_requeued_and_what_failed_is_not() {
    let place = Place::new();
    let script = render_script(&place.job(2, None, 1), &SlurmOptions::default()).expect("a script");
    let requeued = |text: &str, restarts| {
        place.program("renderer", text);
        let status = place.task(&script, 1, restarts).status().expect("sh is there");
        (status.code(), place.notes().concat())
    };
    let again = vec!["requeue 77_1".to_owned()];
    assert_eq!(requeued("exit 0", 0), (Some(0), vec![]));
    assert_eq!(requeued("exit 130", 0), (Some(130), again.clone()));
    assert_eq!(requeued("exit 130", 99), (Some(130), again.clone()));
    assert_eq!(requeued("exit 130", 100), (Some(130), vec![]));
    assert_eq!(requeued("kill -9 $$", 4), (Some(137), again.clone()));
    assert_eq!(requeued("kill -9 $$", 5), (Some(137), vec![]));
    for code in [1, 2, 3, 4, 127] {
        assert_eq!(requeued(&format!("exit {code}"), 0), (Some(code), vec![]));
    }
    // A program that is not there.
    std::fs::remove_file(place.path("renderer")).expect("removed");
    assert_eq!(place.task(&script, 1, 0).status().expect("sh is there").code(), Some(127));
}

/// Sends a signal by name.
fn signal(process: u32, name: &str) {
    let status = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).status();
    assert!(status.expect("sh is there").success());
}

#[test]
fn a_render_is_told_once_that_it_is_to_stop() {
    let place = Place::new();
    // Ends with what an interrupted render ends with, a while after it was told, unless it is told twice.
    let told = "told=0\ntrap 'told=$((told + 1))' USR1\ntrap 'echo TERM >>\"$NOTES\"' TERM\n: >\"$READY\"\n\
                while [ $told -eq 0 ]; do sleep 0.02; done\nsleep 0.3\necho \"told $told\" >>\"$NOTES\"\nexit 130\n";
    place.program("renderer", told);
    let script = render_script(&place.job(1, None, 1), &SlurmOptions::default()).expect("a script");
    for (first, second, expected) in [
        ("USR1", "TERM", vec!["told 1", "requeue 77_0"]),
        ("USR1", "USR1", vec!["told 1", "requeue 77_0"]),
        ("TERM", "TERM", vec!["told 1"]),
        ("TERM", "USR1", vec!["told 1"]),
    ] {
        let ready = place.path("ready");
        let _ = std::fs::remove_file(&ready);
        let mut child = place.task(&script, 0, 0).env("READY", &ready).spawn().expect("sh is there");
        while !ready.exists() {
            assert!(child.try_wait().expect("it can be asked").is_none());
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        signal(child.id(), first);
        std::thread::sleep(std::time::Duration::from_millis(100));
        signal(child.id(), second);
        assert_eq!(child.wait().expect("it ends").code(), Some(130));
        assert_eq!(place.notes().concat(), expected, "{first} {second}");
    }
}

#[test]
fn threads_and_memory_are_what_was_granted_unless_options_say_otherwise() {
    let place = Place::new();
    let asked = |options: &[&str], variables: &[(&str, &str)]| {
        let options = options.iter().map(|word| (*word).to_owned()).collect();
        let job = FarmJob { options, ..place.job(1, None, 1) };
        let script = render_script(&job, &SlurmOptions::default()).expect("a script");
        let status = place.task(&script, 0, 0).envs(variables.iter().copied()).status().expect("sh is there");
        assert!(status.success());
        let words = place.notes().concat();
        ["--threads", "--memory-limit"].map(|name| after(&words, name).map(str::to_owned))
    };
    let some = |text: &str| Some(text.to_owned());
    assert_eq!(asked(&[], &[]), [some("1"), None]);
    assert_eq!(asked(&[], &[("SLURM_CPUS_ON_NODE", "6"), ("SLURM_MEM_PER_CPU", "1000")]), [some("6"), some("5400MiB")]);
    let granted = [("SLURM_CPUS_ON_NODE", "6"), ("SLURM_CPUS_PER_TASK", "4"), ("SLURM_MEM_PER_NODE", "2000")];
    assert_eq!(asked(&[], &granted), [some("4"), some("1800MiB")]);
    assert_eq!(asked(&["--threads", "2"], &granted), [some("2"), some("1800MiB")]);
    assert_eq!(asked(&["--memory-limit=1G"], &granted), [some("4"), None]);
}

#[test]
fn options_of_sbatch_overrule_those_of_renders_but_not_the_array_of_merges() {
    let place = Place::new();
    let options =
        SlurmOptions { sbatch: vec!["--partition=night".into(), "--array=0-5%2".into(), "--signal=B:USR1@600".into()] };
    let job = FarmJob { teaches: true, ..place.job(2, Some(1..=3), 1) };
    options.check(&job).expect("right");
    let last_array = |script: &str| {
        assert!(script.contains("#SBATCH --partition=night\n"));
        script.lines().rfind(|line| line.starts_with("#SBATCH --array")).map(str::to_owned)
    };
    let render = render_script(&job, &options).expect("a script");
    assert_eq!(last_array(&render).as_deref(), Some("#SBATCH --array=0-5%2"));
    let lesson = lesson_script(&job, &options).expect("a script").expect("there is a lesson");
    assert_eq!(last_array(&lesson).as_deref(), Some("#SBATCH --array=0-2"));
    for script in [&lesson, &render] {
        let signal = script.lines().rfind(|line| line.starts_with("#SBATCH --signal"));
        assert_eq!(signal, Some("#SBATCH --signal=B:USR1@600"));
    }
    let merge = merge_script(&job, &options).expect("a script").expect("two parts");
    assert_eq!(last_array(&merge).as_deref(), Some("#SBATCH --array=0-2"));
    let logs = render.lines().find(|line| line.contains("--output=")).expect("logs");
    assert!(
        logs.contains("50%% {{Param.X}}") && logs.contains("\\\"shot\\\"") && logs.ends_with("/logs/%A_%a.log\""),
        "{logs}"
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let place = Place::new();
    let job = place.job(2, Some(1..=3), 1);
    let with = |change: fn(&mut FarmJob)| {
        let mut job = job.clone();
        change(&mut job);
        job.check().map_err(|error| error.to_string())
    };
    assert_eq!(with(|_| ()), Ok(()));
    assert!(with(|job| job.folder.push('#')).expect_err("refused").contains("--folder"));
    assert_eq!(with(|job| (job.folder.push('#'), job.frames = None).1), Ok(()));
    assert!(with(|job| job.options.push("a\nb".into())).is_err());
    for option in ["--png", "--png=x.png", "--stats x.json", "--save-cache x", "--replay 1,2,3"] {
        let options: Vec<String> = option.split(' ').map(str::to_owned).collect();
        let named = option.split([' ', '=']).next().expect("a name");
        let still = FarmJob { options, frames: None, ..job.clone() };
        assert!(still.check().expect_err(option).to_string().starts_with(named), "{option}");
        let whole = FarmJob { parts: 1, ..still };
        assert_eq!(whole.check(), Ok(()), "{option}");
        // In a sequence a file of each frame is meant.
        let frames = FarmJob { frames: Some(1..=3), ..whole };
        assert_eq!(frames.check().is_ok(), option == "--png", "{option}");
    }
    let options = vec!["--stats=a.##.json".into(), "--png".into(), "--spp=3".into()];
    let numbered = FarmJob { parts: 1, options, ..job.clone() };
    assert_eq!(numbered.check(), Ok(()));
    assert_eq!(with(|job| job.options.push("--pngs".into())), Ok(()));
    for wrong in ["", "night", "--a\n--b"] {
        assert!(SlurmOptions { sbatch: vec![wrong.into()] }.check(&job).is_err(), "{wrong:?}");
    }
    let backslash = FarmJob { folder: "/a\\b".into(), ..job };
    assert!(SlurmOptions::default().check(&backslash).is_err());
    for wrong in ["a\nb.exr", "a\tb.exr", "\u{7f}"] {
        assert!(plain_name(Path::new(wrong)).is_err(), "{wrong:?}");
    }
    assert!(plain_name(Path::new(AWKWARD)).expect("a name").ends_with(AWKWARD));
}

#[test]
fn a_png_is_of_the_merged_image() {
    let place = Place::new();
    let handed = |parts, options: &[&str]| {
        let options = options.iter().map(|word| (*word).to_owned()).collect();
        let mut job = FarmJob { options, ..place.job(parts, Some(1..=2), 1) };
        job.hand_over_png().map_err(|error| error.to_string())?;
        job.check().map_err(|error| error.to_string())?;
        let png = job.png.map(|png| png.replace(&place.text(""), ""));
        Ok::<_, String>((job.options.join(" "), png))
    };
    let done = |options: &str, png: Option<&str>| Ok((options.to_owned(), png.map(str::to_owned)));
    assert_eq!(handed(2, &["--png", "--spp", "3"]), done("--spp 3", Some("a-####-b.png")));
    assert_eq!(handed(2, &["--spp", "3", "--png"]), done("--spp 3", Some("a-####-b.png")));
    assert_eq!(handed(2, &["--png", "x#.png", "--spp", "3"]), done("--spp 3", Some("x#.png")));
    assert_eq!(handed(2, &["--png=x#.png"]), done("", Some("x#.png")));
    assert_eq!(handed(2, &["--spp=3"]), done("--spp=3", None));
    assert!(handed(2, &["--png=x.png"]).expect_err("one file").starts_with("--png cannot be used here"));
    // One part is the image.
    assert_eq!(handed(1, &["--png", "x#.png"]), done("--png x#.png", None));
}

#[test]
fn jobs_are_named_after_the_image() {
    for (output, folder) in [
        ("/a/shot.####.exr", "/a/shot.farm"),
        ("/a/shot_##.exr", "/a/shot.farm"),
        ("/a/####.exr", "/a/render.farm"),
        ("/a/b.c.exr", "/a/b.c.farm"),
        ("x", "x.farm"),
    ] {
        assert_eq!(default_folder(Path::new(output)), Path::new(folder), "{output}");
    }
    for (printed, number) in [("123\n", Some("123")), ("7;cluster\n", Some("7")), ("", None), ("Submitted 7", None)] {
        assert_eq!(slurm::job_number(printed), number);
    }
}

#[test]
fn templates_are_what_the_specification_asks_for() {
    let place = Place::new();
    for (parts, frames) in [(4, Some(-2..=3)), (1, None)] {
        let png = frames.as_ref().map(|_| place.text("b-#.png"));
        let job = FarmJob { teaches: frames.is_none(), png, ..place.job(parts, frames.clone(), 1) };
        let (template, values) = openjd::template(&job).expect("a template");
        let text = serde_json::to_string_pretty(&template).expect("JSON");
        let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(found["specificationVersion"], "jobtemplate-2023-09");
        assert!(!found["name"].as_str().expect("a name").contains("{{"));
        let range = &found["steps"][0]["parameterSpace"]["taskParameterDefinitions"];
        assert_eq!(range.as_array().map(Vec::len), Some(1 + usize::from(frames.is_some())));
        assert_eq!(found["steps"][1]["dependencies"][0]["dependsOn"], "Render");
        let value = |name: &str| values.iter().find(|(found, _)| *found == name).map(|(_, value)| value.as_str());
        assert_eq!(value("Frames"), frames.as_ref().map(|_| "-2-3"));
        assert_eq!(value("Scene"), Some(job.scene.as_str()));
        assert_eq!(shlex::split(value("RenderOptions").expect("there")), Some(job.options.clone()));
        // Every parameter has a value, and every one that is used is defined.
        let defined = found["parameterDefinitions"].as_array().expect("a list");
        assert_eq!(defined.len(), values.len());
        for used in text.split("{{Param.").skip(1).filter_map(|rest| rest.split_once("}}")) {
            // The awkward name holds one of its own, which is a value and not looked into.
            assert!(used.0 == "X" || value(used.0).is_some(), "{}", used.0);
        }
    }
    let long = FarmJob { options: vec!["x".repeat(2000)], ..place.job(1, None, 1) };
    assert!(openjd::template(&long).expect_err("too long").to_string().contains("RenderOptions"));
}

#[test]
fn the_scripts_of_templates_teach_render_and_merge() {
    let place = Place::new();
    let job = FarmJob { teaches: true, ..place.job(3, Some(5..=5), 1) };
    let (template, values) = openjd::template(&job).expect("a template");
    let template = serde_json::to_value(&template).expect("JSON");
    let run = |step: usize, part: u32| {
        let script = &template["steps"][step]["script"];
        let text = script["embeddedFiles"][0]["data"].as_str().expect("a script");
        is_shell(text);
        let arguments = script["actions"]["onRun"]["args"].as_array().expect("a list").iter().skip(1).map(|word| {
            let word = word.as_str().expect("a word");
            let name = word.trim_start_matches("{{").trim_end_matches("}}");
            match name.split_once('.') {
                Some(("Param", name)) => values.iter().find(|(found, _)| *found == name).expect("defined").1.clone(),
                Some(_) if name.ends_with("Frame") => "5".to_owned(),
                Some(_) => part.to_string(),
                None => word.to_owned(),
            }
        });
        assert!(place.task(text, 0, 0).args(arguments).status().expect("sh is there").success());
        place.notes().concat()
    };
    for part in 0..=3 {
        let words = run(part.min(1) as usize, part);
        let named = ["--save-cache", "--load-cache"].map(|name| after(&words, name));
        let lesson = place.text("parts/a-####-b.lesson");
        let expected = if part == 0 { [Some(lesson.as_str()), None] } else { [None, Some(lesson.as_str())] };
        assert_eq!(named, expected);
        assert_eq!(words.contains(&"--freeze-cache".to_owned()), part > 0);
        assert_eq!(words[..2], ["render", job.scene.as_str()]);
        assert_eq!(after(&words, "--progress"), Some("openjd"));
        assert_eq!(after(&words, "--spp"), Some(AWKWARD));
        assert_eq!(after(&words, "--part"), Some(format!("{part}/3").as_str()));
        assert!(words.contains(&"--frames=5".to_owned()) && words.contains(&"--recover".to_owned()));
        let output = after(&words, "-o").expect("an output");
        assert_eq!(output, place.text(&format!("parts/a-####-b.{part}-of-3.exr")));
        std::fs::write(output.replace("####", "0005"), "").expect("written");
        std::fs::remove_file(output).expect("the program has written it");
    }
    let words = run(2, 0);
    let names = (0..=3).map(|part| place.text(&format!("parts/a-0005-b.{part}-of-3.exr")));
    let expected = ["merge".to_owned()].into_iter().chain(names).chain(["-o".to_owned(), place.text("a-0005-b.exr")]);
    assert_eq!(words, expected.collect::<Vec<_>>());
    assert_eq!(std::fs::read_dir(place.path("parts")).expect("a folder").count(), 0);
}
