//! pbrt-v4's text format: `load`. Source: the pbrt-v4 file format documentation. One idea a file: `file` (bytes and
//! limits), `lexer` (tokens), `reader` (includes), `parameter` (typed lists), `directive` (names), `older` (what
//! pbrt-v3 had), `state`
//! (the graphics state), `builder` (what directives mean), `finish` (names looked up).

pub(crate) mod builder;
pub(crate) mod directive;
pub(crate) mod file;
pub(crate) mod finish;
pub(crate) mod lexer;
pub(crate) mod older;
pub(crate) mod parameter;
pub(crate) mod reader;
pub(crate) mod state;

#[cfg(test)]
mod tests;

use std::path::Path;

pub(crate) use directive::did_you_mean;

use super::{SceneDescription, SceneError, Sources, Warnings};

/// Reads the scene `path` (`.pbrt`, gzipped or not) and all that it includes. `sources` and `warnings` are filled on
/// error too.
///
/// Differences from pbrt-v4, all towards leniency: materials and objects may be used before they are declared; an included file is
/// also looked for beside the file that includes it; an integer may be written `64.0`. Stricter: a non-finite
/// transform is an error.
///
/// # Errors
/// The first error of the text, with its place; [`SceneErrorKind::Limit`](super::SceneErrorKind::Limit) for files above
/// 4 GiB, includes deeper than 64, blocks deeper than 65,536 and text that expands without bound.
pub fn load(path: &Path, sources: &mut Sources, warnings: &mut Warnings) -> Result<SceneDescription, Box<SceneError>> {
    let reader = reader::Reader::open(path, sources, warnings)?;
    builder::Builder::new(reader, reader::folder_of(path), warnings).run()
}
