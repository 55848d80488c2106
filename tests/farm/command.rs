//! `lanternfish farm` where no scheduler is: what it writes, refuses and says.

use std::process::Command;

use crate::program::{Folder, LAMP, PROGRAM};

#[test]
fn scripts_are_written_and_nothing_is_submitted_in_a_dry_run() {
    let folder = Folder::new("dry run");
    folder.write("s.pbrt", LAMP);
    let words = [
        "farm",
        "slurm",
        "s.pbrt",
        "-o",
        "out.exr",
        "--parts",
        "3",
        "--dry-run",
        "--sbatch",
        "--time=1:00:00",
        "--",
        "--spp",
        "64",
    ];
    let said = folder.run(&words).code(0).out;
    let lines: Vec<&str> = said.lines().collect();
    let [lesson, render, merge] = lines[..] else { panic!("{said}") };
    assert!(lesson.starts_with("1 tasks teach: sbatch ") && lesson.ends_with("lesson.sh'"), "{said}");
    assert!(render.contains("3 tasks render") && render.contains("--dependency=afterany:NUMBER"), "{said}");
    assert!(merge.contains("1 tasks merge") && merge.contains("--dependency=afterok:NUMBER"), "{said}");
    let text = |name: &str| String::from_utf8(folder.read(name)).expect("UTF-8");
    let render = text("out.farm/render.sh");
    assert!(render.contains("#SBATCH --array=0-2\n") && render.contains("#SBATCH --time=1:00:00\n"), "{render}");
    assert!(render.contains("set -- --spp 64\n"), "{render}");
    assert!(text("out.farm/merge.sh").contains("#SBATCH --array=0-0\n"));
    // Each part for itself, or taught by another render.
    for more in [&["--no-lesson"][..], &["--", "--load-cache", "x"]] {
        let words = ["farm", "slurm", "s.pbrt", "-o", "alone.exr", "--parts", "3", "--dry-run"];
        let said = folder.run(&[&words[..], more].concat()).code(0).out;
        assert!(said.lines().count() == 2 && !folder.path("alone.farm/lesson.sh").exists(), "{said}");
    }
    // One part is the image itself.
    folder.run(&["farm", "slurm", "s.pbrt", "-o", "one.exr", "--dry-run", "--folder", "elsewhere"]).code(0);
    assert!(folder.path("elsewhere/render.sh").exists() && !folder.path("elsewhere/merge.sh").exists());
    assert!(!folder.path("one.farm").exists());
    // A sequence has its numbers in the names of its images, whether or not that was said.
    folder.run(&["farm", "slurm", "s.pbrt", "-o", "seq.exr", "--frames", "1..2", "--dry-run"]).code(0);
    assert!(text("seq.farm/render.sh").contains("/seq.####.exr"));
    std::fs::create_dir(folder.path("f1")).expect("a folder");
    let words = ["farm", "slurm", "s.pbrt", "-o", "f#/x.exr", "--frames", "1..2", "--parts", "2", "--dry-run"];
    folder.run(&[&words[..], &["--folder", "parts of x"]].concat()).code(0);
    assert!(
        text("parts of x/merge.sh").contains("/f#/x.####.exr") && text("parts of x/merge.sh").contains("/parts/x.####")
    );
}

#[test]
fn what_no_task_could_render_is_refused_before_anything_is_written() {
    let folder = Folder::new("refused");
    folder.write("s.pbrt", LAMP);
    let before = folder.listing();
    let slurm = ["farm", "slurm", "s.pbrt", "-o", "out.exr", "--dry-run"];
    for (words, code, said) in [
        (&["--", "--spp", "0"][..], 2, "--spp"),
        (&["--", "--nonsense"], 2, "--nonsense"),
        (&["--", "-o", "x.exr"], 2, "--output"),
        (&["--parts", "2", "--", "--part", "1/2"], 2, "--part"),
        (&["--parts", "2", "--", "--stats", "s.json"], 2, "--stats"),
        (&["--parts", "0"], 2, "--parts"),
        (&["--frames", "2..1"], 2, "--frames"),
        (&["--frames-per-task", "2"], 2, "--frames"),
        (&["--sbatch", "night"], 2, "--partition=night"),
        (&["--folder", "a\\b"], 2, "backslash"),
        (&["--folder", "a\nb"], 2, "control characters"),
        (&["--frames", "1..2", "--folder", "a##"], 2, "--folder"),
    ] {
        folder.run(&[&slurm[..], words].concat()).code(code).says(said);
    }
    folder.run(&["farm", "openjd", "s.pbrt", "-o", "out.exr", "--", "--progress", "off"]).code(2).says("--progress");
    for scheduler in ["slurm", "openjd"] {
        folder.run(&["farm", scheduler, "none.pbrt", "-o", "out.exr"]).code(3).says("none.pbrt");
        folder.run(&["farm", scheduler, ".", "-o", "out.exr"]).code(3).says("directory");
        folder.run(&["farm", scheduler, "s.pbrt", "-o", "none/out.exr"]).code(1).says("none/out.exr");
        folder.run(&["farm", scheduler, "s.pbrt"]).code(2).says("--output");
    }
    assert_eq!(folder.listing(), before);
}

#[test]
fn that_slurm_is_not_there_is_said() {
    let folder = Folder::new("no-slurm");
    folder.write("s.pbrt", LAMP);
    let mut command = Command::new(PROGRAM);
    command
        .args(["farm", "slurm", "s.pbrt", "-o", "out.exr"])
        .current_dir(folder.path(""))
        .env("PATH", folder.path(""));
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && said.contains("sbatch") && said.contains("--dry-run"), "{said}");
}
