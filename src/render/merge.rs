//! Parts of a frame joined ([`crate::film::merge`]), and refused where they are none of it.
//!
//! An image's header says of which frame it is and which samples of which seed it has. Images of other frames, and those that have samples in common, are refused; what
//! is missing is named.

use std::path::{Path, PathBuf};

use super::identity::Identity;
use super::lesson::Taken;
use crate::film::ChannelImage;
use crate::film::exr::{read_exr_attributes, read_exr_layers};
use crate::film::image::ImageError;
use crate::film::merge::Sums;

/// Names of the header's attributes that say what an image is of.
pub mod attributes {
    /// Which samples it has: `SEED:FIRST..END`, with blanks between.
    pub const SAMPLES: &str = "lanternfish.samples";
    /// Which parts of how many it is: `1,2/8`.
    pub const PART: &str = "lanternfish.part";
    /// The seed, where there is one.
    pub const SEED: &str = "lanternfish.seed";
    /// What tells its frame from others.
    pub const FRAME: &str = "lanternfish.frameIdentity";
    /// What tells the render from others.
    pub const RENDER: &str = "lanternfish.renderIdentity";
    /// There where the render was stopped.
    pub const INTERRUPTED: &str = "lanternfish.interrupted";
    /// Samples that were left out.
    pub const NON_FINITE: &str = "lanternfish.nonFinite";
    /// What is missing of the frame, where parts are.
    pub const INCOMPLETE: &str = "lanternfish.incomplete";
    /// Samples a pixel.
    pub const SAMPLES_PER_PIXEL: &str = "lanternfish.samplesPerPixel";
}

/// Why images cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// One cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// One is no part of a frame.
    #[error("{path} cannot be merged: {reason}")]
    NoPart {
        /// The file.
        path: PathBuf,
        /// In words.
        reason: String,
    },
    /// Two are of different frames.
    #[error("{path} does not belong to {other}: {what} is not the same")]
    Other {
        /// The one.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// What differs.
        what: String,
    },
    /// Two have samples in common.
    #[error("{path} and {other} both have {taken}: they would count twice")]
    Overlap {
        /// The one.
        path: PathBuf,
        /// The other.
        other: PathBuf,
        /// Which samples.
        taken: Taken,
    },
    /// Not all is there.
    #[error("{0}; --incomplete merges what there is")]
    Missing(String),
}

/// What the header of a part says.
#[derive(Clone, Debug)]
struct Part {
    path: PathBuf,
    attributes: Vec<(String, String)>,
    frame: Identity,
    taken: Vec<Taken>,
    /// Which of how many; 0 is the lesson of the others.
    numbers: Option<(Vec<u32>, u32)>,
    is_interrupted: bool,
}

/// The joined image and what there is to say of it.
#[derive(Debug)]
pub struct Merged {
    /// The image.
    pub image: ChannelImage,
    /// How many parts it is made of.
    pub parts: usize,
    /// Samples a pixel.
    pub samples_per_pixel: u64,
    /// What is missing.
    pub missing: Option<String>,
}

/// Joins the images. The order of `paths` does not matter. `incomplete` takes also those that were stopped, and does without what is missing.
///
/// # Errors
/// Images that do not belong together, or too few of them.
pub fn merge(paths: &[PathBuf], incomplete: bool) -> Result<Merged, MergeError> {
    let mut parts = paths.iter().map(|path| Part::read(path)).collect::<Result<Vec<Part>, MergeError>>()?;
    // The same sums in whatever order they are named.
    parts.sort_by_key(|part| part.taken.first().map(|taken| (taken.seed, taken.first)));
    belong_together(&parts)?;
    let missing = missing(&parts);
    if let Some(missing) = missing.clone().filter(|_| !incomplete) {
        return Err(MergeError::Missing(missing));
    }
    let mut sums: Option<Sums> = None;
    for Part { path, .. } in &parts {
        let image = read_exr_layers(path)?;
        let refuse = |reason| MergeError::NoPart { path: path.clone(), reason };
        match &mut sums {
            None => sums = Some(Sums::new(&image).map_err(refuse)?),
            Some(sums) => sums.add(&image).map_err(refuse)?,
        }
    }
    let Some(sums) = sums else { return Err(MergeError::Missing("there is nothing to merge".to_owned())) };
    let mut image = sums.resolved();
    let taken = joined(parts.iter().flat_map(|part| &part.taken).copied());
    let samples_per_pixel = taken.iter().map(|taken| u64::from(taken.end - taken.first)).sum();
    image.attributes = header(&parts, &taken, samples_per_pixel, missing.as_deref());
    Ok(Merged { image, parts: parts.len(), samples_per_pixel, missing })
}

impl Part {
    fn read(path: &Path) -> Result<Self, MergeError> {
        let refuse = |reason: &str| MergeError::NoPart { path: path.to_owned(), reason: reason.to_owned() };
        let attributes = read_exr_attributes(path)?;
        let value = |name: &str| attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
        let unknown = || refuse("its header does not say which samples of which frame it has");
        let frame = value(attributes::FRAME).and_then(Identity::from_text).ok_or_else(unknown)?;
        let taken: Option<Vec<Taken>> =
            value(attributes::SAMPLES).and_then(|text| text.split_whitespace().map(parse_taken).collect());
        let taken = taken.filter(|taken| !taken.is_empty()).ok_or_else(unknown)?;
        let numbers = match value(attributes::PART) {
            None => None,
            Some(text) => Some(parse_numbers(text).ok_or_else(|| refuse("its header does not say which part it is"))?),
        };
        let is_interrupted = value(attributes::INTERRUPTED).is_some();
        Ok(Self { path: path.to_owned(), frame, taken, numbers, is_interrupted, attributes })
    }

    fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// How the header names samples.
pub fn taken_text(taken: &[Taken]) -> String {
    let text = |taken: &Taken| format!("{}:{}..{}", taken.seed, taken.first, taken.end);
    taken.iter().map(text).collect::<Vec<_>>().join(" ")
}

fn parse_taken(text: &str) -> Option<Taken> {
    let (seed, range) = text.split_once(':')?;
    let (first, end) = range.split_once("..")?;
    let taken = Taken { seed: seed.parse().ok()?, first: first.parse().ok()?, end: end.parse().ok()? };
    (taken.first < taken.end).then_some(taken)
}

fn parse_numbers(text: &str) -> Option<(Vec<u32>, u32)> {
    let (numbers, of) = text.split_once('/')?;
    let of = of.parse().ok()?;
    let numbers: Option<Vec<u32>> = numbers.split(',').map(|number| number.parse().ok()).collect();
    Some((numbers?, of)).filter(|(numbers, of)| numbers.iter().all(|number| number <= of))
}

/// Refuses images of different frames, and such as have samples in common.
fn belong_together(parts: &[Part]) -> Result<(), MergeError> {
    let Some((first, others)) = parts.split_first() else { return Ok(()) };
    for part in others {
        if let Some(what) = part.frame.difference(&first.frame) {
            return Err(MergeError::Other { path: part.path.clone(), other: first.path.clone(), what });
        }
        if let (Some((_, of)), Some((_, other))) = (&part.numbers, &first.numbers)
            && of != other
        {
            let what = format!("the number of parts ({of}, {other})");
            return Err(MergeError::Other { path: part.path.clone(), other: first.path.clone(), what });
        }
    }
    let mut all: Vec<(Taken, &Part)> =
        parts.iter().flat_map(|part| part.taken.iter().map(move |taken| (*taken, part))).collect();
    all.sort_by_key(|(taken, _)| (taken.seed, taken.first));
    match all.windows(2).find(|pair| pair[0].0.overlaps(&pair[1].0)) {
        None => Ok(()),
        Some(pair) => {
            let [(a, of_a), (b, of_b)] = [pair[0], pair[1]];
            let taken = Taken { seed: a.seed, first: b.first, end: a.end.min(b.end) };
            Err(MergeError::Overlap { path: of_a.path.clone(), other: of_b.path.clone(), taken })
        }
    }
}

/// What is missing of the frame: parts that were not named or not finished, gaps between samples.
fn missing(parts: &[Part]) -> Option<String> {
    let stopped: Vec<String> =
        parts.iter().filter(|part| part.is_interrupted).map(|part| part.path.display().to_string()).collect();
    if !stopped.is_empty() {
        return Some(format!("{} was stopped before it was done (render --resume goes on)", stopped.join(", ")));
    }
    if let Some(of) = parts.iter().find_map(|part| part.numbers.as_ref().map(|(_, of)| *of)) {
        let there: Vec<u32> =
            parts.iter().filter_map(|part| part.numbers.as_ref()).flat_map(|(n, _)| n).copied().collect();
        let missing: Vec<String> = (1..=of).filter(|n| !there.contains(n)).map(|n| n.to_string()).collect();
        let count = missing.len();
        if count > 0 {
            return Some(format!("{count} of {of} parts are missing: {}", in_few_words(&missing)));
        }
        return lesson_missing(parts);
    }
    let taken = joined(parts.iter().flat_map(|part| &part.taken).copied());
    let mut gaps = vec![];
    let mut end = (None, 0);
    for taken in &taken {
        let from = if end.0 == Some(taken.seed) { end.1 } else { 0 };
        if from < taken.first {
            gaps.push(Taken { seed: taken.seed, first: from, end: taken.first }.to_string());
        }
        end = (Some(taken.seed), taken.end);
    }
    (!gaps.is_empty()).then(|| format!("missing: {}", gaps.join(", ")))
}

/// The samples that taught the parts, where none of them has those: part 1 begins with the first one that did not.
fn lesson_missing(parts: &[Part]) -> Option<String> {
    let first = parts.iter().find(|part| part.numbers.as_ref().is_some_and(|(n, _)| n.contains(&1)))?.taken.first()?;
    let taken = joined(parts.iter().flat_map(|part| &part.taken).copied());
    let reaches = |taken: &Taken| taken.seed == first.seed && taken.first == 0 && taken.end >= first.first;
    let lesson = Taken { first: 0, end: first.first, ..*first };
    let is_whole = first.first == 0 || taken.iter().any(reaches);
    (!is_whole).then(|| format!("part 0 is missing, the lesson of the others: {lesson}"))
}

/// Some of many.
fn in_few_words(list: &[String]) -> String {
    const SHOWN: usize = 20;
    let more = list.len().saturating_sub(SHOWN);
    let shown = list[..list.len() - more].join(", ");
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}

/// In order, and as one where they adjoin.
fn joined(taken: impl Iterator<Item = Taken>) -> Vec<Taken> {
    let mut all: Vec<Taken> = taken.collect();
    all.sort_by_key(|taken| (taken.seed, taken.first));
    let mut out: Vec<Taken> = vec![];
    for taken in all {
        match out.last_mut() {
            Some(last) if last.seed == taken.seed && last.end == taken.first => last.end = taken.end,
            _ => out.push(taken),
        }
    }
    out
}

/// The header: what all parts say, and what they are together.
fn header(parts: &[Part], taken: &[Taken], samples_per_pixel: u64, missing: Option<&str>) -> Vec<(String, String)> {
    let Some((first, others)) = parts.split_first() else { return vec![] };
    let is_of_one = |name: &str| {
        [
            attributes::SAMPLES,
            attributes::PART,
            attributes::RENDER,
            attributes::INTERRUPTED,
            attributes::NON_FINITE,
            attributes::INCOMPLETE,
            attributes::SAMPLES_PER_PIXEL,
            "lanternfish.command",
        ]
        .contains(&name)
    };
    let is_said_by_all = |(name, value): &&(String, String)| {
        !is_of_one(name) && others.iter().all(|part| part.attribute(name) == Some(value.as_str()))
    };
    let mut header: Vec<(String, String)> = first.attributes.iter().filter(is_said_by_all).cloned().collect();
    let mut add = |name: &str, value: String| header.push((name.to_owned(), value));
    add(attributes::SAMPLES, taken_text(taken));
    add(attributes::SAMPLES_PER_PIXEL, samples_per_pixel.to_string());
    let faults: Vec<&str> = parts.iter().filter_map(|part| part.attribute(attributes::NON_FINITE)).collect();
    if !faults.is_empty() {
        add(attributes::NON_FINITE, faults.join("; "));
    }
    if let Some(missing) = missing {
        add(attributes::INCOMPLETE, missing.to_owned());
        let numbers = || parts.iter().filter_map(|part| part.numbers.as_ref());
        if let Some((_, of)) = numbers().next() {
            let there: Vec<String> = numbers().flat_map(|(n, _)| n).map(u32::to_string).collect();
            add(attributes::PART, format!("{}/{of}", there.join(",")));
        }
    }
    header
}
