//! What the command line says of logs and limits: what a farm wants of the renders that it starts.

use bytesize::ByteSize;
use clap::{Args, ValueEnum};

use super::diagnostics::say;
use super::log;
use crate::render::{ExhaustedMemory, RenderError};
use crate::system::{memory, priority, taken};

/// How far a render is, and where that is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Shown {
    /// A bar on a terminal, lines elsewhere; with `--log-format json` lines of JSON; nothing with `--quiet`.
    #[default]
    Auto,
    /// A bar on the standard error output.
    Bar,
    /// Lines on the standard error output: at each tenth, no more than one a second.
    Lines,
    /// Lines of Open Job Description on the standard output: openjd_progress, openjd_status and, where the render fails, openjd_fail.
    Openjd,
    /// Nothing.
    Off,
}

/// Options of commands that render.
#[derive(Args, Debug)]
pub struct LimitArguments {
    /// How messages are written to the standard error output: as text, or as one JSON object a line.
    #[arg(long, value_enum, default_value_t = log::Format::Text, help_heading = "On a farm")]
    pub log_format: log::Format,
    /// How it is shown how far the render is.
    #[arg(long, value_enum, default_value_t = Shown::Auto, help_heading = "On a farm")]
    pub progress: Shown,
    /// Memory that the process may have, such as 16GB or 16GiB: caches shrink to fit, and what does not fit ends the render with exit code 4 and what took how much.
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = "On a farm")]
    pub memory_limit: Option<ByteSize>,
    /// Let other processes go first: from 0 (as they are) to 19 (whenever nobody else wants the processor).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i32).range(0..=19), help_heading = "On a farm")]
    pub nice: Option<i32>,
}

impl LimitArguments {
    /// Puts limits in force. Must come before any thread is started.
    ///
    /// # Errors
    /// A memory limit that is below what the program alone takes.
    pub fn apply(&self) -> Result<(), RenderError> {
        log::set_format(self.log_format);
        if let Some(Err(reason)) = self.nice.map(priority::set_nice) {
            say(format!("warning: --nice is ignored: {reason}"));
        }
        if let Some(limit) = self.memory_limit {
            memory::set_limit(limit.as_u64());
            taken::begin("the program itself");
            if memory::resident() > limit.as_u64() {
                return Err(ExhaustedMemory::now().into());
            }
        }
        Ok(())
    }
}

fn size(text: &str) -> Result<ByteSize, String> {
    text.parse()
        .ok()
        .filter(|size: &ByteSize| size.as_u64() > 0)
        .ok_or_else(|| "expected an amount of memory such as 800MB, 16G (10^9 bytes) or 16GiB (2^30 bytes)".to_owned())
}
