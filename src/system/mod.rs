//! What the operating system gives and takes: files that are read whole and bounded, files that are written whole or not at all,
//! how much memory is left, and what took it.

pub mod clock;
pub mod fault;
pub mod input;
pub mod memory;
pub mod output;
pub mod plain_bytes;
pub mod priority;
pub mod rewrite;
pub mod taken;
mod temporary;
