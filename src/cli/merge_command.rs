//! `lanternfish merge`: parts of a frame into one image.

use std::path::PathBuf;

use clap::Args;

use super::ExitStatus;
use super::diagnostics::{print_message, say};
use super::render_outputs::refuse_overlap;
use super::render_report::command_line;
use crate::film::exr::write_exr;
use crate::film::image::{Image, write_png};
use crate::render::merge::{MergeError, Merged, merge};
use crate::system::output::{OutputError, check_writable};

/// Its arguments.
#[derive(Args, Debug)]
pub struct MergeArguments {
    /// The parts: images of one frame that have no samples in common, in any order.
    #[arg(required = true, value_name = "PART.exr")]
    pub parts: Vec<PathBuf>,
    /// The OpenEXR file to write.
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: PathBuf,
    /// Also write a PNG to FILE.
    #[arg(long, value_name = "FILE")]
    pub png: Option<PathBuf>,
    /// Merge what there is where parts are missing or were stopped: the image is noisier, and says so in its header.
    #[arg(long)]
    pub incomplete: bool,
    /// Print errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// Why there is no merged image.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Merge(#[from] MergeError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Overlap(#[from] crate::render::RenderError),
}

/// Runs the command.
pub fn run(arguments: &MergeArguments) -> ExitStatus {
    match joined(arguments) {
        Ok(()) => ExitStatus::Done,
        Err(failure) => {
            print_message(&failure.to_string());
            match failure {
                Failure::Merge(_) => ExitStatus::BadInput,
                Failure::Output(_) => ExitStatus::Failed,
                Failure::Overlap(_) => ExitStatus::Usage,
            }
        }
    }
}

fn joined(arguments: &MergeArguments) -> Result<(), Failure> {
    let MergeArguments { parts, output, png, incomplete, quiet } = arguments;
    let outputs: Vec<_> = [Some(output), png.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect();
    refuse_overlap(&outputs, parts.iter().cloned())?;
    outputs.iter().try_for_each(|path| check_writable(path))?;
    let Merged { mut image, parts, samples_per_pixel, missing } = merge(parts, *incomplete)?;
    image.attributes.push(("lanternfish.command".to_owned(), command_line()));
    if let (Some(path), Some(colour)) = (png, image.rgb("")) {
        let pixels = (0..image.bounds.area()).flat_map(|i| colour.map(|plane| plane[i])).collect();
        let [width, height] = [image.bounds.width(), image.bounds.height()].map(|n| n as usize);
        write_png(path, &Image { width, height, channels: 3, pixels }, 0.0)?;
    }
    write_exr(output, image)?;
    if !quiet {
        if let Some(missing) = missing {
            say(format!("warning: {missing}"));
        }
        say(format!("{}: {samples_per_pixel} spp from {parts} images", output.display()));
    }
    Ok(())
}
