//! A cluster of one machine, this one, started for the test with ports, folders and a key of its own.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::program::PROGRAM;
use crate::{comes, find, lanternfish, parent, pixels, process_with, scene, signal, wait};

/// Programs that it takes.
const NEEDED: [&str; 7] = ["munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel", "hostname"];

/// The servers; they end with it.
struct Cluster {
    folder: tempfile::TempDir,
    servers: Vec<Child>,
}

impl Cluster {
    /// A cluster that takes jobs; `None`, with the reason printed, where Slurm is not installed or its servers do not start.
    fn start() -> Option<Self> {
        let missing: Vec<_> = NEEDED.into_iter().filter(|name| find(name).is_none()).collect();
        if !missing.is_empty() {
            println!("skipped: {} not installed (tests/setup-farm.sh)", missing.join(", "));
            return None;
        }
        // Under a short name: that of a socket may have 107 characters.
        let folder = tempfile::Builder::new().prefix("lanternfish-slurm-").tempdir_in("/tmp").expect("a folder");
        let mut cluster = Self { folder, servers: vec![] };
        for name in ["state", "spool"] {
            std::fs::create_dir(cluster.path(name)).expect("a folder");
        }
        std::fs::write(cluster.path("key"), [42; 128]).expect("written");
        let private = std::os::unix::fs::PermissionsExt::from_mode(0o600);
        std::fs::set_permissions(cluster.path("key"), private).expect("set");
        std::fs::write(cluster.path("slurm.conf"), cluster.configuration()).expect("written");
        // From 23.02 on; without it the machine's control groups would have to be Slurm's.
        if version() >= 23 {
            std::fs::write(cluster.path("cgroup.conf"), "CgroupPlugin=disabled\n").expect("written");
        }
        let own = |name: &str, file: &str| format!("--{name}={}", cluster.path(file).display());
        let munge = [
            own("key-file", "key"),
            own("socket", "munge"),
            own("pid-file", "munge.pid"),
            own("log-file", "munge.log"),
        ];
        let munge: Vec<String> =
            munge.into_iter().chain([own("seed-file", "seed"), "--foreground".into(), "--force".into()]).collect();
        cluster.serve("munged", &munge);
        if !comes(30, || cluster.path("munge").exists()) {
            println!("skipped: munged does not start here: {}", cluster.said("munged"));
            return None;
        }
        cluster.serve("slurmctld", &["-D".to_owned(), "-c".to_owned()]);
        cluster.serve("slurmd", &["-D".to_owned()]);
        let is_idle = || {
            let states = cluster.run("sinfo", &["-h", "-o", "%T"]);
            String::from_utf8_lossy(&states.stdout).trim() == "idle"
        };
        if !comes(60, is_idle) {
            println!("skipped: Slurm does not start here: {}{}", cluster.said("slurmctld"), cluster.said("slurmd"));
            return None;
        }
        Some(cluster)
    }

    /// What a server has said.
    fn said(&self, server: &str) -> String {
        std::fs::read_to_string(self.path(&format!("{server}.err"))).unwrap_or_default()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn configuration(&self) -> String {
        let said = |program: &str, word: &str| {
            let output = Command::new(program).arg(word).output().expect("it starts").stdout;
            String::from_utf8(output).expect("UTF-8").trim().to_owned()
        };
        let (host, user, folder) = (said("hostname", "-s"), said("id", "-un"), self.folder.path().display());
        let ports = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").expect("a port"));
        let [control, node] = ports.map(|port| port.local_addr().expect("it is bound").port());
        // A job that was requeued waits until its credential has expired: 5 s is the least.
        format!(
            "ClusterName=lanternfish\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\nSlurmdPort={node}\nSlurmUser={user}\nSlurmdUser={user}\n\
             AuthType=auth/munge\nCredType=cred/munge\nAuthInfo=socket={folder}/munge,cred_expire=5\nStateSaveLocation={folder}/state\n\
             SlurmdSpoolDir={folder}/spool\nSlurmctldPidFile={folder}/control.pid\nSlurmdPidFile={folder}/node.pid\n\
             SlurmctldLogFile={folder}/control.log\nSlurmdLogFile={folder}/node.log\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n\
             SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nSchedulerParameters=bf_interval=1,sched_interval=1,batch_sched_delay=0\n\
             SlurmdParameters=config_overrides\nReturnToService=2\nMpiDefault=none\nKillWait=20\nMinJobAge=600\n\
             NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000\nPartitionName=all Nodes=ALL Default=YES State=UP\n"
        )
    }

    fn serve(&mut self, name: &str, words: &[String]) {
        let program = find(name).expect("it was there");
        let mut command = Command::new(program);
        command.args(words).env("SLURM_CONF", self.path("slurm.conf")).stdin(Stdio::null());
        let log = |kind: &str| std::fs::File::create(self.path(&format!("{name}.{kind}"))).expect("a file");
        self.servers.push(command.stdout(log("out")).stderr(log("err")).spawn().expect("it starts"));
    }

    /// Runs a program as a user of the cluster.
    fn run(&self, program: impl AsRef<std::ffi::OsStr>, words: &[&str]) -> Output {
        let mut command = Command::new(program);
        command
            .args(words)
            .current_dir(self.folder.path())
            .env("SLURM_CONF", self.path("slurm.conf"))
            .stdin(Stdio::null());
        command.output().expect("it starts")
    }

    /// The same; it must succeed. What it prints.
    #[track_caller]
    fn done(&self, program: &str, words: &[&str]) -> String {
        let output = self.run(program, words);
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        assert!(output.status.success(), "{program} {words:?}: {out}{err}");
        out
    }

    /// What became of a job: a list of its tasks' states.
    fn states(&self, job: &str) -> Vec<String> {
        let text = self.done("scontrol", &["show", "job", job]);
        text.split_whitespace().filter_map(|word| word.strip_prefix("JobState=")).map(str::to_owned).collect()
    }

    /// Waits for the end of a job.
    fn wait_for(&self, job: &str) -> Vec<String> {
        wait(&format!("job {job}, {:?}", self.states(job)), 300, || {
            let states = self.states(job);
            let is_over =
                |state: &String| !["PENDING", "RUNNING", "COMPLETING", "CONFIGURING"].contains(&state.as_str());
            states.iter().all(is_over).then_some(states)
        })
    }

    /// What the tasks have said.
    fn logs(&self, folder: &Path) -> String {
        let Ok(files) = std::fs::read_dir(folder.join("logs")) else { return String::new() };
        let mut files: Vec<_> = files.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.sort();
        let text =
            |file: &PathBuf| format!("== {}\n{}", file.display(), std::fs::read_to_string(file).unwrap_or_default());
        files.iter().map(text).collect()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // The one that was started last first.
        for mut server in self.servers.drain(..).rev() {
            // Asked to, so that it takes its own processes with it.
            let _ = Command::new("sh").args(["-c", &format!("kill -TERM {}", server.id())]).status();
            let start = std::time::Instant::now();
            while matches!(server.try_wait(), Ok(None)) && start.elapsed().as_secs() < 5 {
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
            let _ = server.kill();
            let _ = server.wait();
        }
    }
}

/// The first number of Slurm's version: "slurm-wlm 22.05.8".
fn version() -> u32 {
    let output = Command::new("sbatch").arg("--version").output().expect("it starts").stdout;
    let text = String::from_utf8_lossy(&output).into_owned();
    text.split_whitespace().nth(1).and_then(|text| text.split('.').next()?.parse().ok()).unwrap_or(0)
}

/// The numbers of the jobs that `farm slurm` says it has submitted.
fn jobs(said: &str) -> Vec<String> {
    let number = |line: &str| Some(line.strip_prefix("job ")?.split(':').next()?.to_owned());
    said.lines().filter_map(number).collect()
}

/// Samples a pixel of all parts together.
const SAMPLES: u32 = 768;

#[test]
fn tasks_that_are_killed_stopped_and_requeued_change_nothing() {
    let Some(cluster) = Cluster::start() else { return };
    let name = "it's a \"shot\" $HOME 50%";
    let folder = cluster.path(name);
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::write(folder.join("s.pbrt"), scene(SAMPLES)).expect("written");
    let (input, output) = (format!("{name}/s.pbrt"), format!("{name}/out.exr"));
    let farm = ["farm", "slurm", &input, "-o", &output, "--parts", "8"];
    let sbatch = ["--sbatch", "--time=10", "--sbatch", "--mem=1000", "--"];
    let options = ["--lights", "cache-points", "--checkpoint", "4i", "--threads", "1"];
    let said = cluster.done(PROGRAM, &[&farm[..], &sbatch, &options].concat());
    let [lesson, render, merge] = &jobs(&said)[..] else { panic!("{said}") };

    // Each once it has something to go on from: one dies, one is told that its time is nearly up, one's machine is taken back.
    let part = |k: u32| folder.join(format!("out.farm/parts/out.{k}-of-8.exr"));
    let checkpoint = |k: u32| folder.join(format!("out.farm/parts/out.{k}-of-8.exr.checkpoint"));
    let under_way = |k: u32| {
        wait(&format!("a checkpoint of part {k}, or its end"), 120, || {
            let states = cluster.states(render);
            assert!(!states.contains(&"FAILED".to_owned()), "{}", cluster.logs(&folder.join("out.farm")));
            (checkpoint(k).exists() || part(k).exists()).then_some(())
        });
        // A fast machine may have it done by now.
        process_with(part(k).to_str().expect("UTF-8")).filter(|_| checkpoint(k).exists())
    };
    if let Some(render) = under_way(1) {
        signal(render, "KILL");
    }
    // As Slurm does it: the script of the task is told, and it alone.
    if let Some(script) = under_way(2).and_then(parent) {
        signal(script, "USR1");
    }
    if under_way(3).is_some() {
        cluster.run("scontrol", &["requeue", &format!("{render}_2")]);
    }

    assert_eq!(cluster.wait_for(lesson), ["COMPLETED"], "{}", cluster.logs(&folder.join("out.farm")));
    assert_eq!(cluster.wait_for(render), ["COMPLETED"; 8], "{}", cluster.logs(&folder.join("out.farm")));
    assert_eq!(cluster.wait_for(merge), ["COMPLETED"], "{}", cluster.logs(&folder.join("out.farm")));
    let logs = cluster.logs(&folder.join("out.farm"));
    println!("{logs}");
    let begun: Vec<usize> = (1..=8).map(|k| logs.matches(&format!("part {k} of 8")).count()).collect();
    assert!(begun[..3].iter().all(|&n| n == 1 || n == 2) && begun[3..] == [1; 5], "{begun:?}");
    assert!(begun[..3].contains(&2), "all were done before anything happened to them");
    for k in 1..=8 {
        assert!(!part(k).exists() && !checkpoint(k).exists(), "parts that were merged are removed");
    }

    assert_eq!(std::fs::read_dir(folder.join("out.farm/parts")).expect("a folder").count(), 0);

    // The same parts without a fault.
    let plain = cluster.path("plain");
    std::fs::create_dir(&plain).expect("a folder");
    let names: Vec<String> = (0..=8).map(|k| format!("{k}.exr")).collect();
    for (name, k) in names.iter().zip(0..) {
        let part = format!("{k}/8");
        let from = format!("../{input}");
        let words = ["render", &from, "-o", name, "--part", &part, "--threads", "2", "--checkpoint", "off", "--quiet"];
        let lesson: &[&str] =
            if k == 0 { &["--save-cache", "lesson"] } else { &["--load-cache", "lesson", "--freeze-cache"] };
        lanternfish(&plain, &[&words[..], &["--lights", "cache-points"], lesson].concat());
    }
    let words: Vec<&str> =
        ["merge"].into_iter().chain(names.iter().map(String::as_str)).chain(["-o", "whole.exr"]).collect();
    lanternfish(&plain, &words);
    assert!(pixels(&folder.join("out.exr")) == pixels(&plain.join("whole.exr")), "the image is another");
}

#[test]
fn a_job_that_fails_is_not_merged_until_it_is_mended() {
    let Some(cluster) = Cluster::start() else { return };
    std::fs::write(cluster.path("s.####.pbrt"), "").expect("written");
    for frame in [1, 2] {
        std::fs::write(cluster.path(&format!("s.000{frame}.pbrt")), scene(4)).expect("written");
    }
    // Of three frames the last has no scene; two frames a task.
    let farm =
        ["farm", "slurm", "s.####.pbrt", "-o", "f.exr", "--frames", "1..3", "--frames-per-task", "2", "--parts", "2"];
    let said = cluster.done(PROGRAM, &farm);
    let [_, render, merge] = &jobs(&said)[..] else { panic!("{said}") };
    let mut states = cluster.wait_for(render);
    states.sort();
    assert_eq!(states, ["COMPLETED", "COMPLETED", "FAILED", "FAILED"], "{}", cluster.logs(&cluster.path("f.farm")));
    assert!(cluster.wait_for(merge).iter().all(|state| state == "CANCELLED"), "{:?}", cluster.wait_for(merge));
    assert!(cluster.path("f.farm/parts/f.0002.2-of-2.exr").exists() && !cluster.path("f.0001.exr").exists());
    // The scene is there now: the same command again finds what was done, and ends with three images.
    std::fs::write(cluster.path("s.0003.pbrt"), scene(4)).expect("written");
    let said = cluster.done(PROGRAM, &farm);
    let [_, _, merge] = &jobs(&said)[..] else { panic!("{said}") };
    assert!(
        cluster.wait_for(merge).iter().all(|state| state == "COMPLETED"),
        "{}",
        cluster.logs(&cluster.path("f.farm"))
    );
    for frame in 1..=3 {
        assert_eq!(
            pixels(&cluster.path(&format!("f.000{frame}.exr"))).len(),
            pixels(&cluster.path("f.0001.exr")).len()
        );
    }
    assert_eq!(std::fs::read_dir(cluster.path("f.farm/parts")).expect("a folder").count(), 0);
}

#[test]
fn what_is_cancelled_stays_cancelled_and_what_is_refused_leaves_nothing() {
    let Some(cluster) = Cluster::start() else { return };
    std::fs::write(cluster.path("long.pbrt"), scene(1 << 20)).expect("written");
    let said = cluster.done(PROGRAM, &["farm", "slurm", "long.pbrt", "-o", "long.exr", "--", "--threads", "1"]);
    let [render] = &jobs(&said)[..] else { panic!("{said}") };
    wait("the render", 30, || cluster.logs(&cluster.path("long.farm")).contains("restart 0").then_some(()));
    let output = cluster.path("long.exr").display().to_string();
    wait("the render", 30, || process_with(&output));
    std::thread::sleep(std::time::Duration::from_millis(500));
    cluster.done("scancel", &[render]);
    assert_eq!(cluster.wait_for(render), ["CANCELLED"]);
    wait("the end of the render", 30, || process_with(&output).is_none().then_some(()));
    assert!(!cluster.logs(&cluster.path("long.farm")).contains("requeued"));

    // What sbatch does not take is said, and nothing stays in the queue.
    let refused =
        cluster.run(PROGRAM, &["farm", "slurm", "long.pbrt", "-o", "long.exr", "--sbatch", "--partition=none"]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("invalid partition") && said.contains("render.sh"), "{said}");
    assert_eq!(cluster.done("squeue", &["-h"]), "");
}
