//! Workers that misbehave: shell scripts in their place.

use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, Instant};

use super::*;

/// What reading ends with if the worker is this shell script.
fn with_worker(script: &str) -> VdbError {
    within(Duration::from_secs(20), script)
}

/// The same if it may take this long.
fn within(wall: Duration, script: &str) -> VdbError {
    under(Limits { memory: Some(1 << 30), wall: Some(wall), ..Limits::default() }, script)
}

/// The same under these limits.
fn under(limits: Limits, script: &str) -> VdbError {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("worker");
    std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("written");
    std::fs::set_permissions(&program, PermissionsExt::from_mode(0o755)).expect("executable");
    let start = Instant::now();
    let error = loop {
        match read_with(&program, Path::new("some.vdb"), 100, &limits).expect_err("no grids") {
            // Another test's child, just forked, may hold the script open for writing.
            VdbError::Reader { reason, .. } if reason.contains("Text file busy") => {}
            error => break error,
        }
    };
    assert!(start.elapsed() < Duration::from_secs(15), "{script} took long");
    error
}

/// Whether this process ignores a signal, which the processes that it starts inherit.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").expect("/proc is there");
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).expect("it is told");
    u64::from_str_radix(mask.trim(), 16).expect("a number") >> (signal - 1) & 1 == 1
}

const GREETING: &str = r"printf 'LFVDB\000\000\002'";

#[test]
fn a_stopped_reader_does_not_make_the_file_damaged() {
    for (signal, number) in [("INT", libc::SIGINT), ("TERM", libc::SIGTERM), ("HUP", libc::SIGHUP)] {
        // Programs started in the background ignore the first, under nohup the last, and so do their children.
        if is_ignored(number) {
            continue;
        }
        for greeting in ["", GREETING] {
            let error = with_worker(&format!("{greeting}\nkill -{signal} $$\nsleep 10"));
            let VdbError::Stopped { signal: told, .. } = &error else { panic!("{signal}: {error}") };
            assert_eq!(*told, format!("SIG{signal}"));
            assert!(error.to_string().contains("some.vdb") && !error.to_string().contains("damaged"), "{error}");
        }
    }
}

#[test]
fn a_crash_after_the_greeting_is_the_files_fault_and_before_it_the_installations() {
    for signal in ["SEGV", "ABRT", "KILL", "XCPU"] {
        let error = with_worker(&format!("{GREETING}\nkill -{signal} $$\nsleep 10"));
        match signal {
            // Nobody but the system, which lacks memory, or an administrator does that.
            "KILL" => assert!(matches!(error, VdbError::Limit { .. }), "{signal}: {error}"),
            _ => assert!(matches!(error, VdbError::Damaged { .. }), "{signal}: {error}"),
        }
        let error = with_worker(&format!("kill -{signal} $$\nsleep 10"));
        assert!(matches!(error, VdbError::Reader { .. }), "{signal}: {error}");
    }
    let error = with_worker("exit 127");
    assert!(matches!(&error, VdbError::Reader { reason, .. } if reason.contains("127")), "{error}");
    let error = with_worker("echo I am somebody else");
    assert!(matches!(error, VdbError::Reader { .. }), "{error}");
}

#[test]
fn nonsense_is_an_error() {
    let broken = [
        "printf '\\011aaaaaaaabbbbbbbb'",
        "exit 0",
        "printf '\\002'",
        // A header of no bytes.
        r"printf '\001\000\000\000\000\000\000\000\000aaaaaaaa'",
        // The end, and more.
        r"printf '\003\000\000\000\000\000\000\000\000aaaaaaaa'; cat /dev/zero",
    ];
    for script in broken {
        let error = with_worker(&format!("{GREETING}\n{script}"));
        assert!(matches!(error, VdbError::Damaged { .. }), "{script}: {error}");
    }
    // A header of 2^56 bytes: more than any file of its size needs, or than there is where memory is short.
    let script = format!("{GREETING}\n{}", r"printf '\001\000\000\000\000\000\000\000\001'; cat /dev/zero");
    let error = with_worker(&script);
    assert!(matches!(error, VdbError::Damaged { .. }), "{error}");
    for (memory, data) in [(Some(1 << 28), None), (None, Some(1 << 28)), (Some(1 << 28), Some(1 << 29))] {
        let error = under(Limits { memory, data, ..Limits::default() }, &script);
        assert!(matches!(error, VdbError::Limit { .. }), "{error}");
    }
}

#[test]
fn a_reader_that_stays_is_ended() {
    // One that closes its output.
    let error = with_worker(&format!("{GREETING}\nexec >&-\nexec sleep 60"));
    assert!(matches!(error, VdbError::Damaged { .. }), "{error}");
    // One whose own child keeps it open.
    let error = within(Duration::from_secs(1), &format!("{GREETING}\nsleep 60"));
    assert!(matches!(&error, VdbError::Damaged { reason, .. } if reason.contains("1 s")), "{error}");
}
