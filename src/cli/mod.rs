//! The command line: arguments in, exit codes out, errors and progress for people. No rendering logic.

pub mod arguments;
pub mod bench_command;
mod checkpoint_arguments;
pub mod diagnostics;
mod farm_arguments;
mod farm_command;
mod frames;
pub mod images;
pub mod info_command;
pub mod interrupt;
mod limit_arguments;
pub mod log;
mod machine_progress;
mod memory_guard;
pub mod merge_command;
pub mod progress;
pub mod render_command;
mod render_frame;
mod render_outputs;
mod render_report;
pub mod scene_command;
mod share_arguments;
pub mod stability_command;
#[cfg(test)]
mod tests;
mod texture_arguments;
pub mod try_command;
pub mod vdb;

pub use arguments::{Arguments, Command};

use crate::scene::SceneErrorKind;

/// Runs the command that the arguments name.
pub fn run(arguments: &Arguments) -> ExitStatus {
    match &arguments.command {
        Command::Render(arguments) => render_command::run(arguments),
        Command::Info(arguments) => info_command::run(arguments),
        Command::Merge(arguments) => merge_command::run(arguments),
        Command::Compare(arguments) => images::run_compare(arguments),
        Command::Bench(arguments) => bench_command::run(arguments),
        Command::Try(arguments) => try_command::run(arguments),
        Command::Farm(arguments) => farm_command::run(arguments),
        Command::Scene(arguments) => scene_command::run(arguments),
        Command::Stability(arguments) => stability_command::run(arguments),
    }
}

/// How the process ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitStatus {
    /// All done.
    Done = 0,
    /// Something went wrong that is neither of the following: a full disk, say.
    Failed = 1,
    /// The command line made no sense.
    Usage = 2,
    /// A file given to us is damaged, wrong or not supported.
    BadInput = 3,
    /// Out of memory, or another limit.
    Limit = 4,
    /// Interrupted (Ctrl-C).
    Interrupted = 130,
}

pub(crate) const EXIT_CODES_HELP: &str =
    "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 bad input, 4 out of a resource limit, 130 interrupted";

impl From<ExitStatus> for std::process::ExitCode {
    fn from(status: ExitStatus) -> Self {
        Self::from(status as u8)
    }
}

impl From<&SceneErrorKind> for ExitStatus {
    fn from(kind: &SceneErrorKind) -> Self {
        match kind {
            SceneErrorKind::Limit(_) => Self::Limit,
            SceneErrorKind::System(_) => Self::Failed,
            SceneErrorKind::Syntax(_)
            | SceneErrorKind::Parameter(_)
            | SceneErrorKind::Shape(_)
            | SceneErrorKind::Undefined(_)
            | SceneErrorKind::File { .. }
            | SceneErrorKind::Unsupported(_) => Self::BadInput,
        }
    }
}
