//! Errors and warnings about what the user gave us, with the place in the file.

use std::collections::HashSet;
use std::path::PathBuf;

use super::older;
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
    /// A shape that cannot be, while the scene can go on without it.
    #[error("{0}")]
    Shape(String),
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

/// More warnings than this are not kept: a small file may give rise to any number.
const MOST_WARNINGS: usize = 10_000;

/// The warnings of one load, in the order they arose, each said once.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    list: Vec<Warning>,
    said: HashSet<Warning>,
    /// The first fault that was passed over: where, and what.
    fault: Option<(Span, String)>,
}

impl Warnings {
    /// Adds a warning unless the very same one is there, or too many are.
    pub fn add(&mut self, span: Option<Span>, message: impl Into<String>) {
        let warning = Warning { message: message.into(), span };
        if self.list.len() > MOST_WARNINGS || !self.said.insert(warning.clone()) {
            return;
        }
        if self.list.len() == MOST_WARNINGS {
            let message = format!("there are more than {MOST_WARNINGS} warnings: the others are not kept");
            self.list.push(Warning { message, span: None });
        } else {
            self.list.push(warning);
        }
    }

    /// Adds a warning of a fault at `span`, `what`, that is passed over as `instead` says, unless the render is a strict one.
    pub fn add_fault(&mut self, span: Span, what: String, instead: &str) {
        self.add(Some(span), format!("{what}: {instead}"));
        self.fault.get_or_insert((span, what));
    }

    /// Refuses what [`Self::add_fault`] passed over.
    ///
    /// # Errors
    /// `Parameter` at the first fault.
    pub fn refuse_faults(&self) -> Result<(), Box<SceneError>> {
        match &self.fault {
            Some((span, what)) => Err(SceneError::at(*span, SceneErrorKind::Parameter(what.clone()))
                .help("without --strict it is passed over, with a warning")),
            None => Ok(()),
        }
    }

    /// Drops those that tell what this error tells: how a file of an older pbrt is upgraded.
    pub fn drop_told_by(&mut self, error: &SceneError) {
        if older::says_so(error) {
            self.list.retain(|warning| !warning.message.contains(older::UPGRADE));
        }
    }

    /// All warnings so far.
    pub fn list(&self) -> &[Warning] {
        &self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fault_is_refused_with_its_place() {
        let at = |line| Span { file: crate::scene::FileId(0), line, column: 1, length: 1 };
        let mut warnings = Warnings::default();
        warnings.add(Some(at(1)), "no fault");
        assert!(warnings.refuse_faults().is_ok());
        warnings.add_fault(at(2), "bad".to_owned(), "it is left out");
        warnings.add_fault(at(3), "worse".to_owned(), "it is left out");
        assert_eq!(warnings.list()[1].message, "bad: it is left out");
        let error = warnings.refuse_faults().expect_err("there are faults");
        assert_eq!((error.span, error.to_string()), (Some(at(2)), "bad".to_owned()));
    }

    #[test]
    fn warnings_do_not_fill_the_memory() {
        let mut warnings = Warnings::default();
        (0..3 * MOST_WARNINGS).for_each(|i| warnings.add(None, format!("number {}", i % (2 * MOST_WARNINGS))));
        assert_eq!(warnings.list().len(), MOST_WARNINGS + 1);
        assert!(warnings.list()[MOST_WARNINGS].message.contains("more than"));
    }
}
