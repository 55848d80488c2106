//! Text into tokens: words, quoted strings and brackets, each with its place. `#` starts a comment that runs to the end
//! of the line. Source: the pbrt-v4 file format. Assumes UTF-8, which [`super::file`] has seen to.

use std::sync::Arc;

use crate::scene::{FileId, SceneError, SceneErrorKind, Span};

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// A directive, a number, `true` or `false`.
    Word,
    /// A string in double quotes.
    Quoted,
    /// `[`.
    Open,
    /// `]`.
    Close,
}

/// One token. Its text stays in the file.
#[derive(Clone, Copy, Debug)]
pub struct Token {
    /// What it is.
    pub kind: TokenKind,
    /// Its place.
    pub span: Span,
    /// Where it starts in the file's text, in bytes; a quoted string starts after its quote.
    pub start: usize,
    /// Where it ends, exclusive; a quoted string ends before its closing quote.
    pub end: usize,
}

/// Walks over one file's text.
#[derive(Debug)]
pub struct Lexer {
    file: FileId,
    text: Arc<str>,
    position: usize,
    line: u32,
    line_start: usize,
}

impl Lexer {
    /// At the start of `file`, whose text is `text`.
    pub fn new(file: FileId, text: Arc<str>) -> Self {
        let position = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Self { file, text, position, line: 1, line_start: 0 }
    }

    /// The place of the bytes `start..end` of the current line.
    fn span(&self, start: usize, end: usize) -> Span {
        let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Span {
            file: self.file,
            line: self.line,
            column: narrow(start - self.line_start + 1),
            length: narrow(end - start),
        }
    }

    /// The place just behind the last token: for "the file ends here".
    pub fn end_span(&self) -> Span {
        self.span(self.position, self.position)
    }

    fn skip_blanks(&mut self) {
        let bytes = self.text.as_bytes();
        while let Some(&byte) = bytes.get(self.position) {
            match byte {
                // A line ends with either, or with "\r\n".
                b'\n' | b'\r' => {
                    self.position += 1;
                    if byte == b'\r' && bytes.get(self.position) == Some(&b'\n') {
                        self.position += 1;
                    }
                    self.line = self.line.saturating_add(1);
                    self.line_start = self.position;
                }
                b' ' | b'\t' => self.position += 1,
                b'#' => {
                    while bytes.get(self.position).is_some_and(|b| !matches!(b, b'\n' | b'\r')) {
                        self.position += 1;
                    }
                }
                _ => break,
            }
        }
    }

    /// The next token; `None` at the end of the file.
    ///
    /// # Errors
    /// A string without its closing quote on the same line.
    pub fn next(&mut self) -> Result<Option<Token>, Box<SceneError>> {
        self.skip_blanks();
        let bytes = self.text.as_bytes();
        let start = self.position;
        let Some(&first) = bytes.get(start) else { return Ok(None) };
        let mut end = start + 1;
        match first {
            b'[' | b']' => {
                self.position = end;
                let kind = if first == b'[' { TokenKind::Open } else { TokenKind::Close };
                Ok(Some(Token { kind, span: self.span(start, end), start, end }))
            }
            b'"' => loop {
                match bytes.get(end) {
                    Some(b'"') => {
                        self.position = end + 1;
                        let span = self.span(start, end + 1);
                        return Ok(Some(Token { kind: TokenKind::Quoted, span, start: start + 1, end }));
                    }
                    Some(b'\\') if bytes.get(end + 1).is_some_and(|b| !matches!(b, b'\n' | b'\r')) => end += 2,
                    Some(b'\n' | b'\r') | None => {
                        let what = SceneErrorKind::Syntax("this string has no closing quote".into());
                        return Err(SceneError::at(self.span(start, end), what)
                            .help("close it with \" on the same line; write a quote inside a string as \\\""));
                    }
                    Some(_) => end += 1,
                }
            },
            _ => {
                while bytes.get(end).is_some_and(|b| !matches!(b, b' ' | b'\t' | b'\r' | b'\n' | b'"' | b'[' | b']')) {
                    end += 1;
                }
                self.position = end;
                Ok(Some(Token { kind: TokenKind::Word, span: self.span(start, end), start, end }))
            }
        }
    }
}

/// A quoted string's text with its escapes (`\b \f \n \r \t \\ \' \"`) replaced.
///
/// # Errors
/// An unknown escape, at its place.
pub fn unescape(text: &str, span: Span) -> Result<String, Box<SceneError>> {
    let Some(first) = text.find('\\') else { return Ok(text.to_owned()) };
    let mut out = String::with_capacity(text.len());
    out.push_str(&text[..first]);
    let mut chars = text[first..].char_indices();
    while let Some((at, c)) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        let escaped = chars.next().map(|(_, c)| c);
        out.push(match escaped {
            Some('b') => '\u{8}',
            Some('f') => '\u{c}',
            Some('n') => '\n',
            Some('r') => '\r',
            Some('t') => '\t',
            Some(c @ ('\\' | '\'' | '"')) => c,
            other => {
                let shown = other.map(String::from).unwrap_or_default();
                let column = span.column.saturating_add(u32::try_from(first + at + 1).unwrap_or(u32::MAX));
                let length = 1 + other.map_or(0, char::len_utf8) as u32;
                let what = SceneErrorKind::Syntax(format!("unknown escape \\{shown} in a string"));
                return Err(SceneError::at(Span { column, length, ..span }, what)
                    .help("write a backslash as \\\\; file names take / on every system"));
            }
        });
    }
    Ok(out)
}

/// Whether a word can only be meant as a number.
pub fn looks_like_number(word: &str) -> bool {
    matches!(word.as_bytes(), [b'0'..=b'9', ..] | [b'+' | b'-' | b'.', ..])
}

/// A finite float of 32 or 64 bits.
///
/// # Errors
/// What is wrong with `word`, in words.
pub fn number<T: std::str::FromStr + Finite>(word: &str) -> Result<T, String> {
    if !looks_like_number(word) {
        return Err(format!("expected a number, found {}", shown(word)));
    }
    match word.parse::<T>() {
        Ok(value) if value.finite() => Ok(value),
        Ok(_) => Err(format!("the number {} is too large or not finite", shown(word))),
        Err(_) => Err(format!("expected a number, found {}", shown(word))),
    }
}

/// A 32-bit integer; a float without fraction serves too.
///
/// # Errors
/// What is wrong with `word`, in words.
pub fn integer(word: &str) -> Result<i32, String> {
    if let Ok(value) = word.parse::<i32>() {
        return Ok(value);
    }
    let value: f64 = number(word)?;
    if value.fract() != 0.0 {
        return Err(format!("expected an integer, found {}", shown(word)));
    }
    if value < f64::from(i32::MIN) || value > f64::from(i32::MAX) {
        return Err(format!("the integer {} does not fit in 32 bits", shown(word)));
    }
    Ok(value as i32)
}

/// `word` in back quotes, cut short where it is long.
pub fn shown(word: &str) -> String {
    const LONGEST: usize = 40;
    match word.char_indices().nth(LONGEST) {
        Some((cut, _)) => format!("`{}…`", &word[..cut]),
        None => format!("`{word}`"),
    }
}

/// Floats that can be asked whether they are finite.
pub trait Finite {
    /// Neither NaN nor infinite.
    fn finite(&self) -> bool;
}

impl Finite for f32 {
    fn finite(&self) -> bool {
        self.is_finite()
    }
}

impl Finite for f64 {
    fn finite(&self) -> bool {
        self.is_finite()
    }
}
