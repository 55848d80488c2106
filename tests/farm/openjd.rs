//! The command line of Open Job Description runs templates, as a worker of a farm would.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::program::Folder;
use crate::{find, lanternfish, pixels, process_with, scene, signal, wait};

/// The program `openjd`: of the folder that LANTERNFISH_OPENJD names, or on the path.
fn openjd() -> Option<PathBuf> {
    let named = std::env::var_os("LANTERNFISH_OPENJD").map(|folder| Path::new(&folder).join("openjd"));
    let found = named.filter(|file| file.is_file()).or_else(|| find("openjd"));
    if found.is_none() {
        println!("skipped: openjd is not installed (tests/setup-farm.sh)");
    }
    found
}

fn check(openjd: &Path, template: &Path) {
    let output = Command::new(openjd).arg("check").arg(template).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn templates_are_valid() {
    let Some(openjd) = openjd() else { return };
    let folder = Folder::new("template");
    let name = "it's a \"shot\" {{Param.X}} $HOME.pbrt";
    folder.write(name, scene(4)).write("s.#.pbrt", "").write("s.-2.pbrt", scene(4));
    for words in [
        &["farm", "openjd", name, "-o", "a b {{.exr"][..],
        &[
            "farm",
            "openjd",
            "s.#.pbrt",
            "-o",
            "x.exr",
            "--frames",
            "-2..7",
            "--parts",
            "3",
            "--keep-parts",
            "--",
            "--spp",
            "9",
        ],
    ] {
        let said = folder.run(words).code(0).out;
        assert!(said.contains("openjd run") && said.contains("deadline bundle submit"), "{said}");
        let bundle = if words.contains(&"x.exr") { "x.farm" } else { "a b {{.farm" };
        check(&openjd, &folder.path(bundle).join("template.json"));
        let values = folder.json(&format!("{bundle}/parameter_values.json"));
        assert!(values["parameterValues"].as_array().is_some_and(|list| list.len() >= 5), "{values}");
    }
}

#[test]
fn a_task_that_is_killed_goes_on_when_it_is_run_again() {
    let Some(openjd) = openjd() else { return };
    let folder = Folder::new("openjd it's");
    folder.write("s.01.pbrt", scene(384));
    let words = ["farm", "openjd", "s.##.pbrt", "-o", "out.###.exr", "--frames", "1..1", "--parts", "2"];
    let options = ["--", "--lights", "cache-points", "--checkpoint", "4i", "--threads", "2"];
    folder.run(&[&words[..], &options].concat()).code(0);
    let template = folder.path("out.farm/template.json");
    check(&openjd, &template);
    let value = |name: &str, file: &str| format!("{name}={}", folder.path(file).display());
    let task = |step: &str, values: &[&str]| -> Child {
        let mut command = Command::new(&openjd);
        command.arg("run").arg(&template).args(["--step", step]);
        command.args(["-p", &value("Scene", "s.##.pbrt"), "-p", &value("Output", "out.###.exr")]);
        for value in values {
            command.args(["--task-param", value]);
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let end = |child: Child| {
        let output = child.wait_with_output().expect("it ends");
        let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
        (output.status.success(), said)
    };
    let (is_done, said) = end(task("Lesson", &["Frame=1"]));
    assert!(is_done && folder.path("parts/out.001.lesson").exists(), "{said}");
    // The first part dies once it has something to go on from.
    let mut first = task("Render", &["Frame=1", "Part=1"]);
    wait("a checkpoint, or the end", 60, || {
        let is_there = folder.path("parts/out.001.1-of-2.exr.checkpoint").exists();
        (is_there || first.try_wait().expect("it can be asked").is_some()).then_some(())
    });
    let part = folder.path("parts/out.###.1-of-2.exr");
    if let Some(process) = process_with(part.to_str().expect("UTF-8")) {
        signal(process, "KILL");
    }
    let (is_done, said) = end(first);
    assert!(!is_done && !folder.path("parts/out.001.1-of-2.exr").exists(), "{said}");
    // Again, and the rest.
    for part in ["Part=1", "Part=2"] {
        let (is_done, said) = end(task("Render", &["Frame=1", part]));
        assert!(is_done && said.contains("openjd_progress: "), "{said}");
    }
    let (is_done, said) = end(task("Merge", &["Frame=1"]));
    assert!(is_done, "{said}");
    assert_eq!(std::fs::read_dir(folder.path("parts")).expect("a folder").count(), 0);

    for part in ["0/2", "1/2", "2/2"] {
        let name = format!("plain#-{}.exr", &part[..1]);
        let words = ["render", "s.##.pbrt", "--frames", "1", "-o", &name, "--part", part, "--quiet"];
        let lesson: &[&str] =
            if part == "0/2" { &["--save-cache", "x#"] } else { &["--load-cache", "x#", "--freeze-cache"] };
        let words = [&words[..], &["--lights", "cache-points", "--checkpoint", "off"], lesson].concat();
        lanternfish(&folder.path(""), &words);
    }
    let parts = ["plain1-0.exr", "plain1-1.exr", "plain1-2.exr"];
    lanternfish(&folder.path(""), &[&["merge", "-o", "whole.exr"], &parts[..]].concat());
    assert!(pixels(&folder.path("out.001.exr")) == pixels(&folder.path("whole.exr")), "the image is another");
}
