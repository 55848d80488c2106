//! Errors and warnings about what the user gave us, with the place in the file.

use std::collections::HashSet;
use std::path::PathBuf;

use super::source::{Sources, Span};

/// What kind of thing was wrong.
#[derive(Debug, thiserror::Error)]
pub enum SceneErrorKind {
    /// The text does not follow the grammar.
    #[error("{0}")]
    Syntax(String),
    /// A parameter has a wrong type, count or value.
    #[error("{0}")]
    Parameter(String),
    /// A name refers to nothing.
    #[error("{0}")]
    Undefined(String),
    /// A file could not be read.
    #[error("cannot read {path}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The reason, in words.
        reason: String,
    },
    /// Something that this build or version cannot do.
    #[error("{0}")]
    Unsupported(String),
    /// A fault outside of the input: of this program's installation, or somebody stopped a part of it.
    #[error("{0}")]
    System(String),
    /// More memory, nesting or size than is allowed.
    #[error("{0}")]
    Limit(String),
}

/// An error in the input, with its place and what to do about it.
#[derive(Debug, thiserror::Error)]
#[error("{kind}")]
pub struct SceneError {
    /// What was wrong.
    pub kind: SceneErrorKind,
    /// Where; `None` where no text is to blame.
    pub span: Option<Span>,
    /// What to do.
    pub help: Option<String>,
}

impl SceneError {
    /// An error without a place.
    pub fn new(kind: SceneErrorKind) -> Box<Self> {
        Box::new(Self { kind, span: None, help: None })
    }

    /// An error at `span`.
    pub fn at(span: Span, kind: SceneErrorKind) -> Box<Self> {
        Box::new(Self { kind, span: Some(span), help: None })
    }

    /// The same error with advice.
    pub fn help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// `file:line:column: message` for logs; the command line shows an excerpt besides.
    pub fn one_line(&self, sources: &Sources) -> String {
        match self.span {
            Some(span) => format!("{}:{}:{}: {}", sources.path(span.file).display(), span.line, span.column, self.kind),
            None => self.kind.to_string(),
        }
    }
}

/// Something that was ignored or replaced.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Warning {
    /// What and what happens instead.
    pub message: String,
    /// Where.
    pub span: Option<Span>,
}

/// The warnings of one load, in the order they arose, each said once.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    list: Vec<Warning>,
    said: HashSet<Warning>,
}

impl Warnings {
    /// Adds a warning unless the very same one is there.
    pub fn add(&mut self, span: Option<Span>, message: impl Into<String>) {
        let warning = Warning { message: message.into(), span };
        if self.said.insert(warning.clone()) {
            self.list.push(warning);
        }
    }

    /// All warnings so far.
    pub fn list(&self) -> &[Warning] {
        &self.list
    }
}
