//! What a command says on the standard error output: lines of text for people, or for a farm one JSON object a line (`--log-format json`), from the first line to
//! the last.
//!
//! The error output is one of a process, and so are its format, the frame that is being rendered and the number of warnings.

use std::io::Write;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::SystemTime;

use serde::Serialize;

use crate::scene::{Sources, Span};

static JSON: AtomicBool = AtomicBool::new(false);
static FRAME: Mutex<Option<i64>> = Mutex::new(None);
static WARNINGS: AtomicU64 = AtomicU64::new(0);

/// How messages are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// All is well.
    Info,
    /// Something was ignored, replaced or left out.
    Warning,
    /// The command ends without what was asked for.
    Error,
}

/// A place in a scene file, as part of a message.
#[derive(Serialize)]
pub(super) struct Place {
    file: String,
    line: u32,
    column: u32,
}

impl Place {
    pub fn of(span: Span, sources: &Sources) -> Self {
        Self { file: sources.path(span.file).display().to_string(), line: span.line, column: span.column }
    }
}

/// One line.
#[derive(Serialize)]
struct Line<'a, T> {
    /// RFC 3339, UTC, with milliseconds.
    time: String,
    level: Level,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<i64>,
    message: &'a str,
    #[serde(flatten)]
    more: Option<T>,
}

/// From now on the process says things in this format. In JSON what a bug makes the program say is JSON too.
pub fn set_format(format: Format) {
    JSON.store(format == Format::Json, Ordering::Relaxed);
    if format == Format::Json {
        std::panic::set_hook(Box::new(|panic| write_json(Level::Error, &format!("bug: {panic}"), None::<()>)));
    }
}

/// Whether messages are JSON.
pub fn is_json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// The frame that messages are about from now on; `None` outside of sequences.
pub fn set_frame(frame: Option<i64>) {
    *FRAME.lock().unwrap_or_else(PoisonError::into_inner) = frame;
}

/// Counts warnings that were given.
pub(super) fn count_warnings(more: usize) {
    WARNINGS.fetch_add(more as u64, Ordering::Relaxed);
}

/// Warnings so far.
pub fn warnings() -> u64 {
    WARNINGS.load(Ordering::Relaxed)
}

/// Writes a line of JSON with whatever else belongs to the message. That nobody reads it is no error.
pub(super) fn write_json(level: Level, message: &str, more: Option<impl Serialize>) {
    let frame = *FRAME.lock().unwrap_or_else(PoisonError::into_inner);
    let line = json(SystemTime::now(), level, frame, message, more);
    // At once, so that lines of several processes or threads stay whole.
    let _ = std::io::stderr().lock().write_all(line.as_bytes());
}

fn json(time: SystemTime, level: Level, frame: Option<i64>, message: &str, more: Option<impl Serialize>) -> String {
    let time = humantime::format_rfc3339_millis(time).to_string();
    let line = Line { time, level, frame, message, more };
    serde_json::to_string(&line).unwrap_or_default() + "\n"
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn lines_are_objects_with_a_time() {
        let time = SystemTime::UNIX_EPOCH + Duration::from_millis(1_700_000_000_250);
        let place = Place { file: "a \"b\".pbrt".to_owned(), line: 3, column: 7 };
        let line = json(time, Level::Warning, Some(-12), "two\nlines", Some(place));
        assert_eq!(
            line,
            "{\"time\":\"2023-11-14T22:13:20.250Z\",\"level\":\"warning\",\"frame\":-12,\"message\":\"two\\nlines\",\
             \"file\":\"a \\\"b\\\".pbrt\",\"line\":3,\"column\":7}\n"
        );
        let line = json(time, Level::Info, None, "done", None::<()>);
        assert_eq!(line, "{\"time\":\"2023-11-14T22:13:20.250Z\",\"level\":\"info\",\"message\":\"done\"}\n");
    }
}
