//! What the command line says of frames and of parts of them.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;

use super::frames::Frames;
use crate::render::Share;

/// Options of `lanternfish render`.
#[derive(Args, Debug)]
pub struct ShareArguments {
    /// Take only samples A up to B, without B, of each pixel: `merge` joins them with others of the frame. Samples count from 0.
    #[arg(long, value_name = "A..B", value_parser = samples, conflicts_with_all = ["time", "error"], help_heading = "Farms")]
    pub samples: Option<Range<u32>>,
    /// Take only part K of N of the samples of each pixel; with --time all parts take that long. Part 0 is a lesson for the others: the first samples, with
    /// --save-cache; with its file as --load-cache parts are those of the other samples.
    #[arg(long, value_name = "K/N", value_parser = part, conflicts_with_all = ["samples", "error"], help_heading = "Farms")]
    pub part: Option<[u32; 2]>,
    /// Render frames A to B, both among them: `####` in the names of the scene and of outputs is the frame's number, in at least as many digits. Each frame has
    /// noise of its own.
    #[arg(long, value_name = "A..B", value_parser = Frames::parse, allow_hyphen_values = true, help_heading = "Farms")]
    pub frames: Option<Frames>,
    /// Write what was learned about lights and image to a file, for other renders of the scene.
    #[arg(long, value_name = "FILE", conflicts_with = "replay", help_heading = "Farms")]
    pub save_cache: Option<PathBuf>,
    /// Begin with what another render of the scene has learned.
    #[arg(long, value_name = "FILE", help_heading = "Farms")]
    pub load_cache: Option<PathBuf>,
    /// Learn nothing more about the lights than --load-cache brings: then samples of all parts are points of one sequence, spread as evenly as those of one
    /// render.
    #[arg(long, requires = "load_cache", conflicts_with = "save_cache", help_heading = "Farms")]
    pub freeze_cache: bool,
}

impl ShareArguments {
    /// Which samples to take.
    pub fn share(&self) -> Share {
        match (&self.samples, self.part) {
            (Some(samples), _) => Share::Samples(samples.clone()),
            (None, Some([0, of])) => Share::Lesson { of },
            (None, Some([number, of])) => Share::Part { number, of },
            (None, None) => Share::Whole,
        }
    }
}

fn samples(text: &str) -> Result<Range<u32>, String> {
    let parse = |part: &str| part.trim().parse().ok().filter(|n| *n <= 0x7fff_ffff);
    let range = text.split_once("..").and_then(|(a, b)| Some(parse(a)?..parse(b)?));
    let range = range.filter(|range: &Range<u32>| !range.is_empty());
    range.ok_or_else(|| "expected A..B with A below B: A..B are samples A to B - 1, counted from 0".to_owned())
}

fn part(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once('/').and_then(|(k, n)| Some([k.trim().parse().ok()?, n.trim().parse().ok()?]));
    let parts = parts.filter(|&[number, of]: &[u32; 2]| number <= of && (1..=1 << 16).contains(&of));
    parts.ok_or_else(|| "expected K/N with K from 0 to N, and N from 1 to 65536".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_parts_are_checked() {
        assert_eq!(samples("0..32"), Ok(0..32));
        assert_eq!(samples(" 64 .. 128 "), Ok(64..128));
        for wrong in ["", "3", "3..3", "4..3", "-1..3", "1..=3", "..3", "3..", "0..4294967295"] {
            assert!(samples(wrong).is_err(), "{wrong}");
        }
        assert_eq!([part("8/8"), part("0/8")], [Ok([8, 8]), Ok([0, 8])]);
        for wrong in ["", "1", "9/8", "1/0", "0/0", "1/65537", "a/b", "-1/3"] {
            assert!(part(wrong).is_err(), "{wrong}");
        }
    }
}
