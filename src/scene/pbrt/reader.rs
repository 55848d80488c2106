//! One stream of tokens over a file and all that it includes, with the limits that keep hostile files bounded.
//!
//! `Include` splices: its file's tokens simply continue, so a parameter list may even end in the including file. The
//! end of an `Import`ed file, by contrast, is an end that the parser sees, because the graphics state falls back there.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::file::{self, Source, Text};
use super::lexer::{Lexer, Token, TokenKind};
use crate::math::spectrum::Spectrum;
use crate::scene::{FileId, Name, Names, SceneError, SceneErrorKind, Sources, Span, Warnings};

/// How many files may be open within each other.
pub const DEEPEST_INCLUDE: usize = 64;

/// Text that is included again counts against an allowance of this many bytes plus eight times the bytes of all
/// distinct files: a few lines that include each other doubly would otherwise expand without end.
const REPEAT_ALLOWANCE: u64 = 256 << 20;

/// How many times `Include` and `Import` may be executed.
const MOST_INCLUDES: u32 = 100_000;

type Result<T> = std::result::Result<T, Box<SceneError>>;

struct Frame {
    lexer: Lexer,
    path: PathBuf,
    import: bool,
}

/// What a file's text is written in, and where that is seen.
enum Encoding {
    Utf8,
    Latin1(Span),
    Binary(Span),
}

/// The stream of tokens.
pub struct Reader<'a> {
    sources: &'a mut Sources,
    frames: Vec<Frame>,
    peeked: Option<Token>,
    known: HashMap<PathBuf, FileId>,
    names: Names,
    /// Named spectra and those of files, by path, as far as they were asked for.
    pub(super) spectra: HashMap<PathBuf, Spectrum>,
    distinct_bytes: u64,
    read_bytes: u64,
    includes: u32,
}

impl<'a> Reader<'a> {
    /// At the start of the scene file `path`.
    ///
    /// # Errors
    /// The file cannot be read, is too large or no text.
    pub fn open(path: &Path, sources: &'a mut Sources, warnings: &mut Warnings) -> Result<Self> {
        let mut reader = Self {
            sources,
            frames: Vec::new(),
            peeked: None,
            known: HashMap::new(),
            names: Names::default(),
            spectra: HashMap::new(),
            distinct_bytes: 0,
            read_bytes: 0,
            includes: 0,
        };
        reader.enter(path, false, warnings)?;
        Ok(reader)
    }

    /// Continues with the file `path`, which the string at `span` names; returns where it ends to the current one.
    ///
    /// # Errors
    /// As [`Reader::open`], and nesting too deep, in a circle, or repeated beyond reason.
    pub fn include(&mut self, path: &Path, span: Span, import: bool, warnings: &mut Warnings) -> Result<()> {
        debug_assert!(self.peeked.is_none(), "a peeked token would be read in the wrong file");
        let limit = |message: String| Err(SceneError::at(span, SceneErrorKind::Limit(message)));
        if self.frames.iter().any(|f| f.path == path) {
            let message = format!("{} includes itself", path.display());
            return Err(SceneError::at(span, SceneErrorKind::Syntax(message)));
        }
        if self.frames.len() >= DEEPEST_INCLUDE {
            return limit(format!("more than {DEEPEST_INCLUDE} files include each other in a chain"));
        }
        self.includes += 1;
        if self.includes > MOST_INCLUDES {
            return limit(format!("more than {MOST_INCLUDES} Include and Import directives"));
        }
        self.enter(path, import, warnings).map_err(|mut e| {
            e.span.get_or_insert(span);
            e
        })?;
        if self.read_bytes > REPEAT_ALLOWANCE + 8 * self.distinct_bytes {
            return limit("the same files are included again and again: the text expands beyond all reason".into());
        }
        Ok(())
    }

    fn enter(&mut self, path: &Path, import: bool, warnings: &mut Warnings) -> Result<()> {
        let file = match self.known.get(path) {
            Some(&file) => file,
            None => {
                let source = if self.frames.is_empty() { Source::Any } else { Source::Regular };
                let (file, encoding) = self.register(path, source)?;
                match encoding {
                    Encoding::Utf8 => {}
                    Encoding::Latin1(span) => {
                        let message =
                            "this byte is not UTF-8: the file is taken for Latin-1 (ISO 8859-1); save it as UTF-8";
                        warnings.add(Some(span), message);
                    }
                    Encoding::Binary(span) => {
                        let what = SceneErrorKind::Syntax("this byte is not valid UTF-8 text".into());
                        return Err(SceneError::at(span, what).help("scene files are UTF-8; is this a binary file?"));
                    }
                }
                file
            }
        };
        let text = self.sources.text(file).clone();
        self.read_bytes += text.len() as u64;
        self.frames.push(Frame { lexer: Lexer::new(file, text), path: path.to_owned(), import });
        Ok(())
    }

    /// Reads a file and adds it to the sources.
    fn register(&mut self, path: &Path, source: Source) -> Result<(FileId, Encoding)> {
        let (text, place, is_text) = match file::read_text(path, source)? {
            Text::Utf8(text) => (text, None, true),
            Text::Latin1(text, place) => (text, Some(place), true),
            Text::Binary(text, place) => (text, Some(place), false),
        };
        self.distinct_bytes += text.len() as u64;
        let file = self.sources.add(path, text);
        if is_text {
            self.known.insert(path.to_owned(), file);
        }
        let encoding = match place.map(|[line, column]| Span { file, line, column, length: 1 }) {
            None => Encoding::Utf8,
            Some(span) if is_text => Encoding::Latin1(span),
            Some(span) => Encoding::Binary(span),
        };
        Ok((file, encoding))
    }

    /// The text of a file that a parameter names, which is one of the scene's sources too: a spectrum's. `None` where it is no text.
    ///
    /// # Errors
    /// The file cannot be read or is too large.
    pub fn aside(&mut self, path: &Path) -> Result<Option<&str>> {
        let file = match self.known.get(path) {
            Some(&file) => file,
            None => match self.register(path, Source::Regular)? {
                (_, Encoding::Binary(_)) => return Ok(None),
                (file, _) => file,
            },
        };
        Ok(Some(self.sources.text(file)))
    }

    /// The next token; `None` at the end of the scene or of an imported file (see [`Reader::leave_import`]).
    ///
    /// # Errors
    /// The text is no token.
    pub fn next(&mut self) -> Result<Option<Token>> {
        if let Some(token) = self.peeked.take() {
            return Ok(Some(token));
        }
        loop {
            let last = self.frames.len() - 1;
            let frame = &mut self.frames[last];
            if let Some(token) = frame.lexer.next()? {
                return Ok(Some(token));
            }
            if frame.import || last == 0 {
                return Ok(None);
            }
            self.frames.pop();
        }
    }

    /// The next token without taking it.
    ///
    /// # Errors
    /// The text is no token.
    pub fn peek(&mut self) -> Result<Option<Token>> {
        if self.peeked.is_none() {
            self.peeked = self.next()?;
        }
        Ok(self.peeked)
    }

    /// The next token, which must exist; `wanted` says what it should be.
    ///
    /// # Errors
    /// The file ends, or the text is no token.
    pub fn expect(&mut self, wanted: &str) -> Result<Token> {
        match self.next()? {
            Some(token) => Ok(token),
            None => {
                let what = SceneErrorKind::Syntax(format!("the file ends where {wanted} should follow"));
                Err(SceneError::at(self.here(), what))
            }
        }
    }

    /// The next token, which must be a string; returns it unescaped.
    ///
    /// # Errors
    /// It is something else, or has an unknown escape.
    pub fn expect_string(&mut self, wanted: &str) -> Result<(String, Span)> {
        let token = self.expect(wanted)?;
        if token.kind != TokenKind::Quoted {
            let found = super::lexer::shown(self.text(&token));
            let what = SceneErrorKind::Syntax(format!("expected {wanted} in quotes, found {found}"));
            return Err(SceneError::at(token.span, what));
        }
        Ok((super::lexer::unescape(self.text(&token), token.span)?, token.span))
    }

    /// `text` as a name, shared with all others that say the same.
    pub fn name(&mut self, text: &str) -> Name {
        self.names.get(text)
    }

    /// The text of a token, without its quotes.
    pub fn text(&self, token: &Token) -> &str {
        &self.sources.text(token.span.file)[token.start..token.end]
    }

    /// Leaves the imported file whose end [`Reader::next`] has just met; `false` at the end of the scene.
    pub fn leave_import(&mut self) -> bool {
        let more = self.frames.len() > 1;
        if more {
            self.frames.pop();
        }
        more
    }

    /// The place behind the last token read.
    pub fn here(&self) -> Span {
        self.frames[self.frames.len() - 1].lexer.end_span()
    }

    /// The folder of the file being read.
    pub fn folder(&self) -> PathBuf {
        folder_of(&self.frames[self.frames.len() - 1].path)
    }
}

/// The folder that holds `path`.
pub fn folder_of(path: &Path) -> PathBuf {
    path.parent().map(Path::to_owned).unwrap_or_default()
}
