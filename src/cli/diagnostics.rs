//! Errors and warnings for people: an excerpt of the file with the place marked, one line per warning.

use std::io::{IsTerminal, Write};

use annotate_snippets::{AnnotationKind, Group, Origin, Renderer, Snippet, normalize_untrusted_str};
use serde::Serialize;

use super::log::{self, Level, Place};
use crate::render::RenderError;
use crate::scene::{SceneError, Sources, Span, Warning, Warnings};

/// No more warnings than this are printed one by one.
const MAX_WARNINGS: usize = 30;

/// Bytes of a line shown before and after the place in question: exporters write whole meshes on one line.
const CONTEXT: usize = 100;

/// What belongs to an error in JSON besides its message.
#[derive(Serialize)]
struct Fault<'a> {
    #[serde(flatten)]
    place: Option<Place>,
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<&'a str>,
}

/// Prints an error to the standard error output, in colour where that is a terminal.
pub fn print_error(error: &SceneError, sources: &Sources) {
    if log::is_json() {
        let place = error.span.map(|span| Place::of(span, sources));
        let fault = Fault { place, help: error.help.as_deref() };
        return log::write_json(Level::Error, &error.kind.to_string(), Some(fault));
    }
    let stderr = std::io::stderr();
    let text = render_error(error, sources, stderr.is_terminal());
    // Nobody is left to tell if even this fails.
    let _ = writeln!(stderr.lock(), "{text}");
}

/// Prints `error: message` for what has no place in a scene file.
pub fn print_message(message: &str) {
    if log::is_json() {
        return log::write_json(Level::Error, message, None::<()>);
    }
    let stderr = std::io::stderr();
    let title = annotate_snippets::Level::ERROR.primary_title(normalize_untrusted_str(message));
    let renderer = if stderr.is_terminal() { Renderer::styled() } else { Renderer::plain() };
    let _ = writeln!(stderr.lock(), "{}", renderer.render(&[Group::with_title(title)]));
}

/// The error with an excerpt of its line.
pub fn render_error(error: &SceneError, sources: &Sources, colour: bool) -> String {
    let title = annotate_snippets::Level::ERROR.primary_title(normalize_untrusted_str(&error.kind.to_string()));
    let mut group = Group::with_title(title);
    let excerpt = error.span.map(|span| (span, Excerpt::new(sources.line(span.file, span.line), &span)));
    if let Some((span, excerpt)) = &excerpt {
        let path = sources.path(span.file).display().to_string();
        group = group.element(Origin::path(path).line(span.line as usize).char_column(span.column as usize)).element(
            Snippet::source(excerpt.text.as_str())
                .line_start(span.line as usize)
                .annotation(AnnotationKind::Primary.span(excerpt.marked.clone())),
        );
    }
    if let Some(help) = &error.help {
        group = group.element(annotate_snippets::Level::HELP.message(normalize_untrusted_str(help)));
    }
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    renderer.render(&[group])
}

/// The part of a line around a span, and where the span lies in it.
struct Excerpt {
    text: String,
    marked: std::ops::Range<usize>,
}

impl Excerpt {
    fn new(line: &str, span: &Span) -> Self {
        let boundary = |mut at: usize, step: isize| {
            at = at.min(line.len());
            while !line.is_char_boundary(at) {
                at = at.saturating_add_signed(step);
            }
            at
        };
        let column = span.column.saturating_sub(1) as usize;
        let start = boundary(column, -1);
        // Something that runs on to further lines is marked to the end of its first.
        let end = boundary(column.saturating_add((span.length as usize).clamp(1, CONTEXT)), 1);
        let from = boundary(start.saturating_sub(CONTEXT), -1);
        let to = boundary(end.saturating_add(CONTEXT), 1);
        let (before, after) = (if from > 0 { "…" } else { "" }, if to < line.len() { "…" } else { "" });
        let shift = before.len();
        Self { text: format!("{before}{}{after}", &line[from..to]), marked: start - from + shift..end - from + shift }
    }
}

/// Prints the warnings that go before `result`: if it is an error, without those that it says again.
pub fn print_warnings_before<T>(result: &Result<T, RenderError>, warnings: &mut Warnings, sources: &Sources) {
    if let Err(RenderError::Scene(error)) = result {
        warnings.drop_told_by(error);
    }
    print_warnings(warnings, sources);
}

/// Prints warnings to the standard error output: the first thirty of them and the number of the others. All are counted.
pub fn print_warnings(warnings: &Warnings, sources: &Sources) {
    log::count_warnings(warnings.list().len());
    for warning in warnings.list().iter().take(MAX_WARNINGS) {
        if log::is_json() {
            let place = warning.span.map(|span| Place::of(span, sources));
            log::write_json(Level::Warning, &warning.message, place);
        } else {
            write_line(&warning_line(warning, sources));
        }
    }
    if warnings.list().len() > MAX_WARNINGS {
        let others = warnings.list().len() - MAX_WARNINGS;
        let message = format!("and {others} more (--stats and info --json list them)");
        match log::is_json() {
            true => log::write_json(Level::Warning, &message, None::<()>),
            false => write_line(&format!("warning: {message}")),
        }
    }
}

/// Each warning as `warning: file:line:column: what`.
pub fn warning_lines(warnings: &Warnings, sources: &Sources) -> Vec<String> {
    warnings.list().iter().map(|warning| warning_line(warning, sources)).collect()
}

fn warning_line(warning: &Warning, sources: &Sources) -> String {
    let place = match warning.span {
        Some(span) => format!("{}:{}:{}: ", sources.path(span.file).display(), span.line, span.column),
        None => String::new(),
    };
    normalize_untrusted_str(&format!("{WARNING}{place}{}", warning.message))
}

/// What lines begin with that are warnings.
const WARNING: &str = "warning: ";

/// A line on the standard error output; one that begins with `warning: ` is a warning, and counted. That nobody reads it is no error.
pub fn say(line: impl std::fmt::Display) {
    let line = line.to_string();
    let warning = line.strip_prefix(WARNING);
    log::count_warnings(usize::from(warning.is_some()));
    match (log::is_json(), warning) {
        (false, _) => write_line(&line),
        (true, Some(warning)) => log::write_json(Level::Warning, warning, None::<()>),
        (true, None) => log::write_json(Level::Info, &line, None::<()>),
    }
}

fn write_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
