//! What the benchmarks share: processor time, arguments, the JSON file.

#![allow(dead_code)] // each benchmark uses its part

use std::path::PathBuf;
use std::time::Instant;

use cpu_time::ProcessTime;
use serde::Serialize;

/// Processor seconds (of all threads) and wall-clock seconds of `work`. The former hardly notice who else uses the machine.
pub fn time<T>(work: impl FnOnce() -> T) -> (T, f64, f64) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let result = work();
    (result, cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64())
}

/// The number after `--name` on the command line. cargo's own `--bench` is passed over.
pub fn argument(name: &str, default: u64) -> u64 {
    text_argument(name).map_or(default, |text| {
        text.parse().unwrap_or_else(|_| {
            eprintln!("--{name} wants a whole number, not \"{text}\"");
            std::process::exit(2);
        })
    })
}

/// The word after `--name`.
pub fn text_argument(name: &str) -> Option<String> {
    let mut arguments = std::env::args().skip_while(|a| a.strip_prefix("--") != Some(name)).skip(1);
    arguments.next()
}

/// Whether `--name` is on the command line.
pub fn flag(name: &str) -> bool {
    std::env::args().any(|argument| argument.strip_prefix("--") == Some(name))
}

/// The command as it was given.
pub fn command() -> String {
    std::env::args().collect::<Vec<_>>().join(" ")
}

/// Writes `value` to `target/NAME.json` and says so.
pub fn write_json(name: &str, value: &impl Serialize) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target").join(name).with_extension("json");
    let text = serde_json::to_string_pretty(value).expect("plain data");
    match std::fs::write(&path, text) {
        Ok(()) => println!("written: {}", path.display()),
        Err(error) => eprintln!("cannot write {}: {error}", path.display()),
    }
}
