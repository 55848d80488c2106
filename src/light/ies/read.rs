//! Reading IES files: LM-63-1986, -1991 (`IESNA91`), -1995, -2002 and -2019.
//!
//! Sources: IESNA LM-63-1986, LM-63-1995, ANSI/IESNA LM-63-2002, ANSI/IES LM-63-19. A file is lines of labels up to one that begins with
//! `TILT=`, and from there on numbers, however they are broken into lines; a comma separates as a space does. What follows the
//! last candela value is ignored. Values are multiplied by the candela multiplier, the ballast factor, up to 1995 the ballast-lamp
//! photometric factor (a later file has something else in its place), and the factor for the luminaire's tilt.
//!
//! Files come from anywhere: nothing is believed before it is checked, and an error names the line.

use std::path::{Path, PathBuf};

use super::{IesProfile, Photometry, Table};
use crate::system::input::read_regular;

/// No file may have more bytes than this.
const MAX_BYTES: u64 = 8 << 20;

/// Nor more angles of one kind than this: a hundredth of a degree.
const MOST_ANGLES: usize = 36_001;

/// Why a file could not be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", .line.map_or(String::new(), |line| format!("line {line}: ")))]
pub struct IesError {
    /// The line of the IES file, from 1, where one is to blame.
    pub line: Option<u32>,
    /// In words.
    pub reason: String,
}

impl IesError {
    fn at(line: u32, reason: impl Into<String>) -> Self {
        Self { line: Some(line), reason: reason.into() }
    }
}

type Result<T> = std::result::Result<T, IesError>;

/// Reads the IES file at `path`, for a luminaire that is tilted by `tilt` degrees. Files that `TILT=` names are looked up beside it.
///
/// # Errors
/// What the system says, and whatever is missing, not a number, negative, out of order or out of range, with its line.
pub fn read_ies(path: &Path, tilt: f32) -> Result<IesProfile> {
    let read = |path: &Path| -> std::result::Result<String, String> {
        let bytes = read_regular(path, MAX_BYTES).map_err(|error| error.to_string())?;
        // Labels may be in any encoding; numbers are the same in all.
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let text = read(path).map_err(|reason| IesError { line: None, reason })?;
    Ok(IesProfile::new(&parse(&text, tilt, &|name| read(&beside(path, name)))?))
}

/// The table that `text` holds. `tilt_file` gives the text of a file that `TILT=` names.
///
/// # Errors
/// As [`read_ies`].
pub fn parse(text: &str, tilt: f32, tilt_file: &dyn Fn(&str) -> std::result::Result<String, String>) -> Result<Table> {
    let mut lines = text.lines().zip(1u32..);
    let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("").to_ascii_uppercase();
    let (tilt_line, wanted) = find_tilt(&mut lines)?;
    let mut numbers = Numbers { lines, words: words(""), line: tilt_line };
    let mut factor = match wanted.to_ascii_uppercase().as_str() {
        "NONE" => 1.0,
        "INCLUDE" => numbers.tilt(tilt)?,
        "" => return Err(IesError::at(tilt_line, "\"TILT=\" must say NONE, INCLUDE or name a file")),
        _ => {
            let in_file = |reason: String| IesError::at(tilt_line, format!("the tilt file \"{wanted}\": {reason}"));
            let text = tilt_file(wanted).map_err(in_file)?;
            let mut numbers = Numbers { lines: text.lines().zip(1u32..), words: words(""), line: 1 };
            numbers.tilt(tilt).map_err(|error| in_file(error.to_string()))?
        }
    };

    numbers.next("the number of lamps")?;
    numbers.next("the lumens per lamp")?;
    factor *= numbers.positive("the candela multiplier")?;
    let vertical = numbers.count("the number of vertical angles", 2)?;
    let horizontal = numbers.count("the number of horizontal angles", 1)?;
    let kind = numbers.next("the photometric type")?;
    let photometry = match kind {
        1.0 => Photometry::C,
        2.0 => Photometry::B,
        3.0 => Photometry::A,
        _ => return Err(numbers.wrong(format!("the photometric type must be 1 (C), 2 (B) or 3 (A), not {kind}"))),
    };
    for what in ["the unit of length", "the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    factor *= numbers.positive("the ballast factor")?;
    // Since 2002 the next number is for future use, since 2019 it says how the file came about.
    let is_late = first.starts_with("IES:") || first.strip_prefix("IESNA:LM-63-").is_some_and(|year| year > "1995");
    if is_late {
        numbers.next("the number after the ballast factor")?;
    } else {
        factor *= numbers.positive("the ballast-lamp photometric factor")?;
    }
    numbers.next("the input watts")?;

    let vertical = numbers.angles("vertical", vertical, photometry)?;
    let horizontal = numbers.angles("horizontal", horizontal, photometry)?;
    let count = vertical.len() * horizontal.len();
    // A number takes two bytes at least: a file that promises more than it can hold is told before memory is taken.
    if count > text.len() / 2 + 1 {
        return Err(numbers.wrong(format!("the file is too short for {count} candela values")));
    }
    let mut candela = Vec::with_capacity(count);
    for _ in 0..count {
        let value = numbers.next("a candela value")?;
        if value < 0.0 {
            return Err(numbers.wrong(format!("a candela value is negative: {value}")));
        }
        let value = (value * factor) as f32;
        if !value.is_finite() {
            return Err(numbers.wrong("a candela value is too large"));
        }
        candela.push(value);
    }
    Ok(Table { photometry, vertical, horizontal, candela })
}

/// What `TILT=` says, and the number of its line, up to which `lines` are taken.
fn find_tilt<'a>(lines: &mut impl Iterator<Item = (&'a str, u32)>) -> Result<(u32, &'a str)> {
    let mut last = 1;
    for (line, number) in lines {
        last = number;
        let line = line.trim();
        let is_tilt = line.get(..4).is_some_and(|word| word.eq_ignore_ascii_case("TILT"));
        if is_tilt && let Some(value) = line[4..].trim_start().strip_prefix('=') {
            return Ok((number, value.trim()));
        }
    }
    Err(IesError::at(last, "no line begins with \"TILT=\": this is not an IES file"))
}

/// The file that the IES file at `path` names for its tilt; `None` where it names none or cannot be read.
pub fn tilt_file(path: &Path) -> Option<PathBuf> {
    let bytes = read_regular(path, MAX_BYTES).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let (_, name) = find_tilt(&mut text.lines().zip(1u32..)).ok()?;
    let is_name = !["", "NONE", "INCLUDE"].iter().any(|word| name.eq_ignore_ascii_case(word));
    is_name.then(|| beside(path, name))
}

/// Where `name`, which the file at `path` says, is looked up.
fn beside(path: &Path, name: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(name)
}

type Words<'a> = std::str::Split<'a, fn(char) -> bool>;

/// The words of a line, some of them empty.
fn words(line: &str) -> Words<'_> {
    line.split(|c: char| c.is_ascii_whitespace() || c == ',')
}

/// The numbers of a file, one after the other.
struct Numbers<'a, L> {
    /// The lines to come, numbered.
    lines: L,
    /// What is left of the current one.
    words: Words<'a>,
    /// Its number.
    line: u32,
}

impl<'a, L: Iterator<Item = (&'a str, u32)>> Numbers<'a, L> {
    /// An error in the current line.
    fn wrong(&self, reason: impl Into<String>) -> IesError {
        IesError::at(self.line, reason)
    }

    /// The next number, finite. `what` says which, for messages.
    fn next(&mut self, what: &str) -> Result<f64> {
        let word = loop {
            match self.words.next() {
                Some("") => {}
                Some(word) => break word,
                None => {
                    let Some((line, number)) = self.lines.next() else {
                        return Err(self.wrong(format!("the file ends before {what}")));
                    };
                    (self.words, self.line) = (words(line), number);
                }
            }
        };
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let shown: String = word.chars().take(40).collect();
                Err(self.wrong(format!("{what} is \"{shown}\", which is no number")))
            }
        }
    }

    /// A number above 0.
    fn positive(&mut self, what: &str) -> Result<f64> {
        let value = self.next(what)?;
        if value > 0.0 { Ok(value) } else { Err(self.wrong(format!("{what} must be above 0, not {value}"))) }
    }

    /// A whole number, at least `least`.
    fn count(&mut self, what: &str, least: usize) -> Result<usize> {
        let value = self.next(what)?;
        if value.fract() != 0.0 || !(least as f64..=MOST_ANGLES as f64).contains(&value) {
            let reason = format!("{what} must be a whole number from {least} to {MOST_ANGLES}, not {value}");
            return Err(self.wrong(reason));
        }
        Ok(value as usize)
    }

    /// `count` rising angles of a kind.
    fn angles(&mut self, kind: &str, count: usize, photometry: Photometry) -> Result<Vec<f32>> {
        let is_vertical = kind == "vertical";
        let (low, high) = match (photometry, is_vertical) {
            (Photometry::C, true) => (0.0, 180.0),
            (Photometry::C, false) => (0.0, 360.0),
            (_, true) => (-90.0, 90.0),
            // Around its pole, type A may go all the way; type B's horizontal angles are those from its pole.
            (Photometry::A, false) => (-180.0, 180.0),
            (Photometry::B, false) => (-90.0, 90.0),
        };
        let mut angles: Vec<f32> = vec![];
        for _ in 0..count {
            let angle = self.next(&format!("a {kind} angle"))? as f32;
            if !(low..=high).contains(&angle) {
                return Err(self.wrong(format!("a {kind} angle must be from {low} to {high} degrees, not {angle}")));
            }
            if angles.last().is_some_and(|&last| last >= angle) {
                return Err(
                    self.wrong(format!("the {kind} angles do not rise: {angle} follows {}", angles[angles.len() - 1]))
                );
            }
            angles.push(angle);
        }
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        match photometry {
            Photometry::C if !is_vertical && count > 1 => {
                let is_known = first == 0.0 && (last == 90.0 || last >= 180.0) || first == 90.0 && last == 270.0;
                if !is_known {
                    let reason = "the horizontal angles of type C must be one, or go from 0 to 90, to 180 or beyond, or from 90 to 270";
                    return Err(self.wrong(format!("{reason}; these go from {first} to {last}")));
                }
            }
            Photometry::A | Photometry::B if count == 1 => {
                return Err(self.wrong(format!("types A and B need two {kind} angles at least")));
            }
            _ => {}
        }
        Ok(angles)
    }

    /// The factor for a luminaire tilted by `tilt` degrees: linear between the angles given, beyond them that of the last.
    fn tilt(&mut self, tilt: f32) -> Result<f64> {
        self.next("the lamp-to-luminaire geometry")?;
        let count = self.count("the number of tilt angles", 1)?;
        let mut angles: Vec<f64> = vec![];
        for _ in 0..count {
            let angle = self.next("a tilt angle")?;
            if angles.last().is_some_and(|&last| last >= angle) {
                return Err(self.wrong(format!("the tilt angles do not rise: {angle}")));
            }
            angles.push(angle);
        }
        let mut factors: Vec<f64> = vec![];
        for _ in 0..count {
            let factor = self.next("a tilt factor")?;
            if factor < 0.0 {
                return Err(self.wrong(format!("a tilt factor is negative: {factor}")));
            }
            factors.push(factor);
        }
        let tilt = f64::from(tilt);
        let next = angles.partition_point(|&angle| angle <= tilt);
        if next == 0 || next == count {
            return Ok(factors[if next == 0 { 0 } else { count - 1 }]);
        }
        let share = (tilt - angles[next - 1]) / (angles[next] - angles[next - 1]);
        Ok(factors[next - 1] + (factors[next] - factors[next - 1]) * share)
    }
}
