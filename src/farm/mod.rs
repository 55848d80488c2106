//! Renders shared out over the machines of a farm: one job becomes tasks, each a part of some frames, and the parts of a frame become its image.
//!
//! What is written here is text: batch scripts for [`slurm`], a template for schedulers that read Open Job Description ([`openjd`]). The
//! tasks are this program's own commands, `render` with `--recover`, `--part` and `--frames`, and `merge`; nothing here renders or submits.

mod job;
pub mod openjd;
pub mod slurm;
#[cfg(test)]
mod tests;

pub use job::{FarmError, FarmJob, default_folder, plain_name};

/// A function for scripts: `numbered NAME` prints a name with the number `$frame` in place of each stretch of `#`, as `render` names
/// its files.
const NUMBERED: &str = include_str!("numbered.sh");
